"""A match: its tables, and the views of it."""

from __future__ import annotations

import base64
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import polars as pl

from pitchlore.pipeline.base.errors import BadSettings, NotFound
from pitchlore.pipeline.engine.inputs import Inputs
from pitchlore.pipeline.engine.tables import MatchTables, TableOf
from pitchlore.pipeline.store.files import Files
from pitchlore.pipeline.store.paths import named_path
from pitchlore.pipeline.store.temporaries import sweep
from pitchlore.schemas import SIDES, note_on

if TYPE_CHECKING:
    from pitchlore.pipeline.views.commentary import Commentary

#: Seconds before the first goal of a notebook's picture: at the goal itself the ball is put back.
_BEFORE_S = 0.2


class Match(MatchTables):
    """One match: its tables, and replay, commentary and exports made from them.

    :func:`pitchlore.read` and :func:`pitchlore.play` give a match in memory. Its tables are computed when
    they are asked for. :attr:`pitchlore.League.matches` gives matches of a data folder. Their tables are
    read. Both have the same tables: polars frames with the columns that ``pitchlore sql --tables`` lists. A
    table is kept, so that the second look costs nothing.

    Args:
        inputs: the nouns of the match.
        folder: data folder of the match, None for a match in memory.

    Raises:
        NotFound: by a table of a data folder in which the match's stages have not run.

    Examples:
        >>> m = pitchlore.read("derby.csv")
        >>> m.home, m.away, m.score
        ('blue', 'yellow', (2, 0))
        >>> m.goals.select("team", "kind").row(0)
        ('home', 'indirect')
    """

    def __init__(self, inputs: Inputs, folder: Files | None = None) -> None:
        super().__init__(inputs)
        self._folder = folder

    @property
    def info(self) -> dict[str, Any]:
        """The match's row of the table ``matches``: source, teams, start, duration [s], rate [Hz], score."""
        return self.matches.row(0, named=True)

    @property
    def home(self) -> str:
        """Name of the home team."""
        return str(self.inputs.details("matches")["home"])

    @property
    def away(self) -> str:
        """Name of the away team."""
        return str(self.inputs.details("matches")["away"])

    @property
    def score(self) -> tuple[int | None, int | None]:
        """Goals of home and away at the end; None where the recording does not tell."""
        home, away = (self.inputs.details("matches")["score"][side] for side in SIDES)
        return home, away

    @property
    def flaws(self) -> dict[str, int]:
        """Flaws that the import found, and how often; the table ``quality`` has notes and the later ones."""
        return dict(self.inputs.details("matches").get("flaws", {}))

    def table(self, name: str) -> pl.DataFrame:
        """A table by its name, for programs; ``m.table("goals")`` is ``m.goals``.

        Args:
            name: name of a table of matches; ``sequences``, ``choices`` and ``moments`` are in no catalogue.

        Returns:
            The rows of this match.

        Raises:
            BadSettings: if no table of a match has this name.
        """
        known = {word: it for word, it in vars(MatchTables).items() if isinstance(it, TableOf)}
        if name not in known:
            raise BadSettings(f"a match has no table {name!r}", next_step=f"Name one of {', '.join(known)}")
        return known[name].of(self)

    def commentary(self) -> Commentary:
        """The match in words; ``print`` shows goals, chances, restarts, possession and numbers.

        Returns:
            ``moments``, each with its time [ns], kind, team and sentence, and ``summary``, the numbers.

        Raises:
            NotFound: if the match's stages have not run.
        """
        from pitchlore.pipeline.views.commentary import commentary  # noqa: PLC0415 (loaded when asked for)

        return commentary(self)

    def page(self, *, hz: float = 20.0) -> str:
        """The replay as one web page that needs no network, HTML.

        Args:
            hz: samples shown for each second of play, in (0, 1000].

        Raises:
            NotFound: if the match's stages have not run, or if it has no sample.
            BadSettings: if ``hz`` is out of its bounds.
        """
        from pitchlore.pipeline.views.replay import page  # noqa: PLC0415 (loaded when asked for)

        return page(self, hz=hz, reported=self.commentary().sentences())

    def replay(self, path: str | Path | None = None, *, hz: float = 20.0) -> Path:
        """Write the replay page (:meth:`page`).

        Args:
            path: file to write. None: ``replays/ID.html`` in the match's data folder, ``ID.html`` here for a
                match in memory.
            hz: as for :meth:`page`.

        Returns:
            The file.

        Raises:
            NotFound, BadSettings: as for :meth:`page`.
            StorageFailed: if the disk refuses.
        """
        return self._write(path, "replays", f"{self.name}.html", self.page(hz=hz).encode())

    def film(self, path: str | Path, *, start_s: float = 0.0, seconds: float = 20.0) -> Path:
        """Write a part of the match as an animated GIF.

        Args:
            path: file to write.
            start_s: start, seconds since the first sample.
            seconds: length, in (0, 120]; the film ends with the match at the latest.

        Returns:
            The file.

        Raises:
            NotFound: if nothing was recorded then.
            BadSettings: if start or length are out of their bounds.
            StorageFailed: if the disk refuses.
        """
        from pitchlore.pipeline.views.replay.animation import animation  # noqa: PLC0415 (loaded when asked for)

        return self._write(path, "replays", "", animation(self, start_s=start_s, seconds=seconds))

    def export(self, to: str, folder: str | Path | None = None) -> list[Path]:
        """Write the match in a form that other programs read.

        Args:
            to: csv or parquet (tables that :func:`pitchlore.read` reads back), kloppy or floodlight (two
                files that both read), foxglove or rerun (recordings that those viewers draw), physics
                (settings for ``pitchlore record``: the ball's friction, fitted).
            folder: folder to write into. None: ``exports`` in the match's data folder, else the folder here.

        Returns:
            The files.

        Raises:
            BadSettings: if there is no such form.
            NotFound: if the match's stages have not run, or if the form's library is not installed.
            BadRecording: if the form cannot hold the match.
            StorageFailed: if the disk refuses.
        """
        from pitchlore.pipeline.views.exports.content import ExportedMatch  # noqa: PLC0415 (loaded when asked for)
        from pitchlore.pipeline.views.exports.formats import FORMATS  # noqa: PLC0415 (loaded when asked for)

        if to not in FORMATS:
            raise BadSettings(f"there is no form {to!r}", next_step=f"Name one of {', '.join(FORMATS)}")
        written = FORMATS[to].write(ExportedMatch(self))
        files = {f"{self.name}.{ending}": data for ending, data in written.items()}
        return [self._write(None if folder is None else named_path(folder) / name, "exports", name, data)
                for name, data in files.items()]

    @staticmethod
    def forms() -> dict[str, str]:
        """The forms of :meth:`export`, each with the programs that read it."""
        from pitchlore.pipeline.views.exports.formats import FORMATS  # noqa: PLC0415 (loaded when asked for)

        return {name: form.about for name, form in FORMATS.items()}

    def _write(self, path: str | Path | None, folder: str, name: str, data: bytes) -> Path:
        """Write a file where the user says, else into the match's data folder, else here."""
        if path is None and self._folder is not None:
            target = self._folder.root / folder / name
            self._folder.keep(target, data)
        else:
            target = Path(name) if path is None else named_path(path)
            Files(target.parent).write_bytes(target, data)
        sweep(target.parent, 1)
        return target

    def __repr__(self) -> str:
        home, away = ("?" if goals is None else goals for goals in self.score)
        seconds = round(self.inputs.details("matches")["duration_s"])
        return f"<Match {self.name}: {self.home} {home} : {away} {self.away}, {seconds} s>"

    def _repr_html_(self) -> str:
        """Picture, teams, score and flaws, for notebooks."""
        from pitchlore.pipeline.views.replay.animation import still  # noqa: PLC0415 (loaded when asked for)
        from pitchlore.pipeline.views.scout.content.flaws import flaws  # noqa: PLC0415 (loaded when asked for)

        home, away = ("?" if goals is None else goals for goals in self.score)
        lines = [f"<b>{escape(self.home)} {home} : {away} {escape(self.away)}</b> <code>{self.name}</code>"]
        details = self.inputs.details("matches")
        noted = [note_on(self.home, self.away), flaws(self.recorded_quality, details["frames"])]
        lines += [escape(said) for said in noted if said]
        try:
            goals = self.referee.filter(pl.col("event") == "goal")["t_ns"]
            picture = still(self, goals[0] / 1e9 - _BEFORE_S if len(goals) else details["duration_s"] / 2)
            source = f"data:image/png;base64,{base64.b64encode(picture).decode()}"
            when = "before the first goal" if len(goals) else "at half time"
            lines.append(f'<img alt="the pitch {when}" src="{source}">')
        except NotFound:  # its stages have not run
            lines.append("Its stages have not run.")
        return f"<div>{'<br>'.join(lines)}</div>"
