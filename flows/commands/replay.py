"""The command replay: a match as a web page or a film."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from pitchlore.flows.commands.commentary import told_of
from pitchlore.flows.commands.common import DEFAULTS, Common
from pitchlore.flows.commands.match_id import chain_of
from pitchlore.flows.commands.printing import console, print_stand_in
from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.settings import GramSettings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Receipt
from pitchlore.pipeline.views.replay import page
from pitchlore.pipeline.views.replay.animation import animation, seconds_shown
from pitchlore.schemas import Goals, Matches, Passes, Referee, Shots, Situations, Trajectories


def replay(
    match: str, *, output: Annotated[Path | None, Parameter(alias="-o")] = None, hz: float = 20.0,
    gif: Path | None = None, start: Annotated[float, Parameter(name="--from")] = 0.0, seconds: float = 20.0,
    common: Common = DEFAULTS,
) -> None:
    """Write a match as one web page with pitch, situations, goals, passes and shots, or a part as a GIF.

    The page needs no network.

    Args:
        match: Id of the match, or its beginning.
        output: File to write (default: replays/MATCH.html in the data folder).
        hz: Samples per second of play in the page.
        gif: Write an animation of a part of the match into this file instead.
        start: Start of the animation, seconds since the first sample.
        seconds: Length of the animation, seconds. It ends with the match at the latest.
        common: Options of every command.
    """
    store = common.existing
    if gif is not None:
        log, made = chain_of(store, match, "trajectories", "situations")
        row = store.read_table(log, "matches", Matches)
        film = animation(
            row,
            store.read_table(made["trajectories"], "trajectories", Trajectories),
            store.read_table(made["situations"], "situations", Situations),
            store.read_table(log, "referee", Referee),
            Pitch.model_validate(log.details["pitch"]), start_s=start, seconds=seconds,
        )
        store.write_bytes(gif, film)
        lasts = seconds_shown(row, start, seconds)
        said = f"{gif} ({len(film) / 1e6:.2f} MB): {lasts:.4g} s from {start:g} s on"
        console().print(said, soft_wrap=True)
        return
    path, log = write_page(store, match, output, hz)
    size = path.stat().st_size / 1e6
    console().print(f"{path} ({size:.2f} MB): open it in a browser", soft_wrap=True)
    print_stand_in(log.details["home"], log.details["away"])


def write_page(
    store: Store, match: str, output: Path | None = None, hz: float = 20.0
) -> tuple[Path, Receipt]:
    """Write the replay page of a match.

    Args:
        store: holds the match.
        match: id of the match, or its beginning.
        output: file to write; None: ``replays/MATCH.html`` in the data folder.
        hz: samples per second of play.

    Returns:
        The page's path, and the receipt of the match's log.

    Raises:
        NotFound: if the id fits no match or several, or if the match's stages have not run.
    """
    log, made = chain_of(store, match, "trajectories", "situations", "goals", "events")
    sequences = store.receipt("sequences", log.name)
    settings = GramSettings() if sequences is None else GramSettings.model_validate(sequences.settings)
    text = page(
        store.read_table(log, "matches", Matches),
        store.read_table(made["trajectories"], "trajectories", Trajectories),
        store.read_table(made["situations"], "situations", Situations),
        store.read_table(made["goals"], "goals", Goals),
        store.read_table(log, "referee", Referee),
        Pitch.model_validate(log.details["pitch"]),
        hz=hz,
        passes=store.read_table(made["events"], "passes", Passes),
        shots=store.read_table(made["events"], "shots", Shots),
        told=told_of(store, log.name).sentences(),
        gap_s=settings.gap_s,
    )
    path = output or store.root / "replays" / f"{log.name}.html"
    if output is None:
        store.keep(path, text.encode())
    else:
        store.write_bytes(path, text.encode())
    return path, log
