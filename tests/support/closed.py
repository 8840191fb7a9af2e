"""A user who may not read what another one keeps: as root, which may read everything, a thread without that right."""

import ctypes
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

#: The rights to change owners, to read and search everything, and to act as any owner, as bits.
_RIGHTS = 0b11111
_VERSION = 0x20080522
#: Another user and a group that has no name here.
OTHER, GROUP = 12_345, 23_456
ROOT = os.geteuid() == 0


class _Header(ctypes.Structure):
    _fields_ = (("version", ctypes.c_uint32), ("pid", ctypes.c_int))


class _Rights(ctypes.Structure):
    _fields_ = tuple((name, ctypes.c_uint32) for name in ("effective", "permitted", "inheritable"))


@contextmanager
def as_user(group: int | None = None) -> Iterator[None]:
    """Run the body as a user who may read only what modes allow, in a group if one is named; threads of the body, too."""
    if not ROOT:
        yield
        return
    libc, header, rights = ctypes.CDLL(None, use_errno=True), _Header(_VERSION, 0), (_Rights * 2)()
    assert libc.capget(ctypes.byref(header), rights) == 0
    before = rights[0].effective
    if group is not None:
        libc.setfsgid(group)
    rights[0].effective = before & ~_RIGHTS
    assert libc.capset(ctypes.byref(header), rights) == 0, os.strerror(ctypes.get_errno())
    try:
        yield
    finally:
        rights[0].effective = before
        assert libc.capset(ctypes.byref(header), rights) == 0
        if group is not None:
            libc.setfsgid(os.getegid())


def close(path: Path) -> None:
    """Let nobody but another user read a file or folder."""
    path.chmod(0o700 if path.is_dir() and ROOT else 0o600 if ROOT else 0)
    if ROOT:
        os.chown(path, OTHER, OTHER)
