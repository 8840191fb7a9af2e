"""The engine of Pitchlore and all that it stands on (see CONTRIBUTING.md for the map)."""

import hashlib as _hashlib
import os as _os
from pathlib import Path as _Path

_HERE = _Path(__file__).parent


def _kernels(folder: _Path) -> str:
    """Name of the code of all compiled functions: a hash of the files that compile something with numba."""
    found = _hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        source = path.read_bytes()
        if any(word in source for word in (b"njit", b"@kernel", b" = switch(")):
            found.update(path.name.encode() + b"\0" + source)
    return found.hexdigest()[:8]


def _cache() -> _Path:
    """A folder that can be written to: beside the code, else the user's own cache, if there is a home."""
    # a path without a home raises
    own = _Path(_os.environ.get("XDG_CACHE_HOME") or _os.path.expanduser("~/.cache"))  # noqa: PTH111
    if _os.access(_HERE, _os.W_OK) or not own.is_absolute():
        return _HERE / "__pycache__"
    return own / "pitchlore"


# numba's cache sees an edit of the file that a function is in, but not of those that it calls into:
# what was compiled from other code must not be found
_os.environ.setdefault("NUMBA_CACHE_DIR", str(_cache() / f"numba-{_kernels(_HERE)}"))
# in colours it writes each overload that does not fit, for nobody: a twentieth of the time to compile
_os.environ.setdefault("NUMBA_DISABLE_ERROR_MESSAGE_HIGHLIGHTING", "1")
