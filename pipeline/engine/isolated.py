"""Reading of a stranger's recording in a process of its own, with limits on its time and memory."""

from __future__ import annotations

import json
import multiprocessing
from collections.abc import Sequence
from contextlib import ExitStack, suppress
from multiprocessing.connection import Connection
from pathlib import Path

from pitchlore.pipeline import matches as log
from pitchlore.pipeline.base import errors
from pitchlore.pipeline.base.digests import Content
from pitchlore.pipeline.base.errors import BadRecording, PitchloreError, in_one_line
from pitchlore.pipeline.base.system import clean, limit_memory, start_clean
from pitchlore.pipeline.importers.readers import open_parts, read
from pitchlore.pipeline.importers.source import SourceFile
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.pipeline.settings import ImportSettings
from pitchlore.pipeline.store.files import Files

#: A new process is forked from one that has loaded these, and has read nothing.
_LOADED = "pitchlore.pipeline.engine.isolated", "pitchlore.pipeline.importers.readers"
_TRUST = "Remove it; if you trust it, raise {} in the [imports] settings"
#: How much more time and memory than others football may take: kloppy makes objects of every frame. Ninety
#: minutes at 25 Hz take a minute and 3.5 GB.
_FOOTBALL = 4


def read_isolated(
    paths: Sequence[Path], source: SourceFile, mapping: TrackingMap
) -> tuple[MatchLog, Content]:
    """The match of a recording, read in a process of its own, and its log's bytes.

    That process sends back a log of ours, or an error as JSON: nothing from it is executed.

    Args:
        paths: paths of the recording's files, in order.
        source: the recording, opened.
        mapping: how to read a tracking table.

    Raises:
        BadRecording: if it cannot be read, brings its reader down, or exceeds a limit.
        PitchloreError: as the reader raised it.
    """
    limits, room = source.limits, 1 if source.provider is None else _FOOTBALL
    times = "" if room == 1 else f"{room} times "
    here, there = multiprocessing.Pipe(duplex=False)
    process = clean(_LOADED).Process(
        target=_answer, args=(
            there, [str(path) for path in paths], source.provider, source.sha256, source.match_id, mapping,
            limits, room * limits.memory_megabytes, source.number), daemon=True)
    start_clean(process)
    there.close()
    try:
        if not here.poll(room * limits.seconds):
            raise BadRecording(f"takes longer than {times}the limit seconds = {limits.seconds:g} to read",
                               where=source.name, next_step=_TRUST.format("seconds"))
        kind, data = here.recv_bytes(1), here.recv_bytes(limits.megabytes << 20)
    except (EOFError, OSError) as error:
        process.join(5)
        raise BadRecording(
            f"brings its reader down (exit code {process.exitcode}), perhaps by {times}the limit "
            f"memory_megabytes = {limits.memory_megabytes}",
            where=source.name, next_step=_TRUST.format("memory_megabytes"),
        ) from error
    finally:
        process.kill()
        process.join()
        here.close()
    if kind == b"e":
        said = json.loads(data)
        found = getattr(errors, said["error"], PitchloreError)
        refused = found(said["what"], where=said["where"], next_step=said["next_step"])
        refused.offer = said["offer"]
        raise refused
    return log.read(data, where=source.name), data


def _answer(
    there: Connection, paths: Sequence[str], provider: str | None, sha256: str, match_id: str,
    mapping: TrackingMap, limits: ImportSettings, megabytes: int, number: int,
) -> None:
    """Read a recording and send its match, in the process of its own."""
    answer: tuple[bytes, Content]
    try:
        limit_memory(megabytes << 20)
        with ExitStack() as stack:
            parts = [
                (file.name, stack.enter_context(Files(file.parent).opened(file, megabytes=limits.megabytes)))
                for file in map(Path, paths)
            ]
            source = open_parts(parts, provider, limits).numbered(number)
            if source.sha256 != sha256:
                raise BadRecording("changes while it is read", where=source.name,  # noqa: TRY301
                                   next_step="Wait until it is whole")
            match = read(source.named(match_id), mapping)
        data = log.packed(match)
    except Exception as error:
        ours = error if isinstance(error, PitchloreError) else BadRecording(
            f"cannot be read ({in_one_line(error)})", where=Path(paths[0]).name, next_step="Record it again")
        answer = b"e", json.dumps({
            "error": type(ours).__name__, "what": ours.what, "where": ours.where, "next_step": ours.next_step,
            "offer": ours.offer,
        }).encode()
    else:
        answer = b"m", data
    with suppress(OSError):  # nobody waits any more
        for part in answer:
            there.send_bytes(part)
