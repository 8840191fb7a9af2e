"""People's labels of what is seen on film beside the recogniser's answers, before and now.

``study.py [RECORDINGS]`` (``make study-labels``, half a minute) writes answers.csv, agreement.csv, codes.csv,
kicks.csv and shares.csv beside moments.csv and the labels. ``study.py sheets FOLDER [RECORDINGS]`` draws the
pictures for a new labeller: sheets/NNN.png, one a moment, and dials/NNN.png. ``study.py kicks LOG…`` prints
how 2D logs agree with their servers' counts. RECORDINGS is the folder of the
recordings that are not part of the project; rows about one that is absent are kept.
"""

from __future__ import annotations

import sys
from pathlib import Path

import polars as pl
from harness import ALL, RECORDINGS
from labels import agreement, kicks, shares
from labels.moments import Recording, recording, recordings
from labels.sheets import pictures

from pitchlore.pipeline.settings import EventSettings, SituationSettings
from pitchlore.pipeline.stages.events.derive import events
from pitchlore.pipeline.stages.situations.recognise import recognise


def study(folder: Path, recorded: dict[str, Recording]) -> None:
    """Write the tables of the folder anew, from those recordings that are there.

    Rows about the rules before are kept, and so are rows about a recording that is absent.
    """
    found = {name: recognise(film.table, film.pitch, SituationSettings()) for name, film in recorded.items()}
    now = agreement.answers(
        pl.read_csv(folder / "moments.csv"), {name: film.table for name, film in recorded.items()}, found)
    read_answers(folder).update(now, on=agreement.ROW, how="left").write_csv(folder / "answers.csv")
    for name, table in agreed(folder).items():
        table.write_csv(folder / name)
    counted = {name: kicks.judged(found[name], film) for name, film in recorded.items() if len(film.commands)}
    _write_now(folder / "kicks.csv", counted)
    reported = {}
    for name, film in recorded.items():
        it = events(film.table, film.referee, film.pitch, EventSettings())
        reported[name] = pl.DataFrame([
            shares.summary(found[name]) | shares.on_ball(it.possession, it.passes, found[name])])
    _write_now(folder / "shares.csv", reported)


def agreed(folder: Path) -> dict[str, pl.DataFrame]:
    """The tables that follow from the folder's labels and answers, by file name."""
    labels, moments = agreement.read_labels(folder), pl.read_csv(folder / "moments.csv")
    said = read_answers(folder)
    return {
        "agreement.csv": agreement.agreement(labels, said, moments),
        "codes.csv": agreement.by_code(labels, said, moments)}


def read_answers(folder: Path) -> pl.DataFrame:
    """The folder's answers: columns of ROW, before, near_before, now, near_now."""
    return pl.read_csv(
        folder / "answers.csv", schema_overrides={"near_before": pl.String, "near_now": pl.String})


def _write_now(path: Path, tables: dict[str, pl.DataFrame]) -> None:
    """Put tables by recording in place of the table's rows about those recordings and the rules of now."""
    old = pl.read_csv(path)
    new = pl.concat([old.clear(), *(
        table.select(pl.lit(name).alias("recording"), pl.lit("now").alias("rules"), pl.all())
        .with_columns(pl.selectors.float().round(3)).cast(old.schema) for name, table in tables.items())])
    place = {name: place for place, name in enumerate(ALL)}
    pl.concat([old.join(new, on=["recording", "rules"], how="anti"), new]).sort(
        pl.col("recording").replace_strict(place), "rules", maintain_order=True).write_csv(path)


def main(words: list[str]) -> None:
    """Do as the command line says."""
    if words[:1] == ["kicks"]:
        for path in map(Path, words[1:]):
            film = recording(path)
            found = recognise(film.table, film.pitch, SituationSettings())
            print(path.name, kicks.judged(found, film), sep="\n", flush=True)
        return
    here, draws = Path(__file__).parent, words[:1] == ["sheets"]
    out, *rest = map(Path, words[1:] if draws else [str(here), *words])
    recorded = recordings(rest[0] if rest else RECORDINGS)
    if draws:
        pictures(out, here, recorded)
    else:
        study(out, recorded)


if __name__ == "__main__":
    main(sys.argv[1:])
