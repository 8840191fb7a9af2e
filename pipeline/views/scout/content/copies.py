"""The pages of copies: how well an imitation knows its team, and how like it the copy plays."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline.engine.imitations import PREFIX, imitation_of
from pitchlore.pipeline.engine.outputs import table_of
from pitchlore.pipeline.engine.policies import known_play, trained_on
from pitchlore.pipeline.game.pitch import Kind
from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.pipeline.stages.options.runs import LOGGED
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Manifest, Receipt
from pitchlore.pipeline.views.scout.alike import described, likeness, spectrum
from pitchlore.pipeline.views.scout.content.sources import LeagueMatch, TeamName, sides_played
from pitchlore.pipeline.views.scout.words import NAMES, short
from pitchlore.schemas import ROLES, SIDES, Matches, Options, Policies, Trajectories

#: A recovered option counts as sure from this probability on: it is more probable than all others together.
SURE = 0.5
#: Options of each role in the table: those that take most of its time.
_OPTIONS = 3
#: Samples of robots: how long each stands for, its option, and whether the team logged that.
_SAMPLES = pl.DataFrame(schema={
    "role": pl.Enum(ROLES), "seconds": pl.Float64, "option": pl.Int16, "probability": pl.Float32,
    "logged": pl.Boolean})


class Copied(NamedTuple):
    """A team that has an imitation.

    Attributes:
        team: the team.
        manifest: the imitation's newest policy.
        originals: all matches of the team that have run.
        copies: the matches that have run in which this policy played, each with its side.
    """

    team: TeamName
    manifest: Manifest
    originals: Sequence[LeagueMatch]
    copies: Sequence[tuple[LeagueMatch, str]]

    @property
    def key(self) -> object:
        """Everything that its page is made from, as JSON values."""
        situations = [match.inputs["situations"][0].digests()
                      for match in (*self.originals, *(match for match, _ in self.copies))]
        return [self.manifest.key, self.manifest.version, [side for _, side in self.copies], situations]

    def at(self, store: Store) -> Copied:
        """The same, read through another store of the same data."""
        return self._replace(originals=[match.at(store) for match in self.originals],
                             copies=[(match.at(store), side) for match, side in self.copies])


def copied_teams(
    store: Store, teams: Sequence[TeamName], league: Sequence[LeagueMatch]
) -> dict[TeamName, Copied]:  # fmt: skip
    """The teams that have an imitation with a policy.

    Args:
        store: the data folder.
        teams: teams of the pages.
        league: all matches that have run.
    """
    from pitchlore.pipeline.engine.teams import label  # noqa: PLC0415 (the arena is loaded with it)

    found = {}
    for team in (team for team in teams if team.kind == Kind.VSSS):  # teams of other leagues have none
        own = imitation_of(store, team.name)
        own.leave_out = store.leave_out
        versions = own.manifests("policies")
        if not versions:
            continue
        manifest = versions[-1]
        policy = label(manifest)
        copies = [(match, side) for match in league for side in SIDES
                  if _policy(match.inputs["matches"][0], side) == policy]
        originals = [match for match in league if team in (match.home, match.away)]
        found[team] = Copied(team, manifest, originals, copies)
    return found


def _policy(match: Receipt, side: str) -> str | None:
    """The label of the policy that played a side of a match; None of teams without one, and of recordings."""
    label: str | None = match.settings.get(side, {}).get("policy")
    return label


def copy_facts(store: Store, copied: Copied) -> dict[str, Any]:
    """Content of the page of a team's copy.

    Args:
        store: the data folder.
        copied: the team.
    """
    own, manifest = imitation_of(store, copied.team.name), copied.manifest
    knowledge = trained_on(own, manifest)
    learned = _learned_from(own, knowledge)
    samples = pl.concat([_SAMPLES, *(_samples(own, match, copied.team) for match in learned)])
    sides = [(match, side) for match in copied.originals for side in sides_played(copied.team, match)]
    originals, copies = _described(sides), _described(copied.copies)
    word = f"{PREFIX}{copied.team.name}"
    return {
        "team": copied.team, "version": manifest.version, "word": word, "quoted": shlex.quote(word),
        "shell_name": shlex.quote(copied.team.name),
        "learned": len(learned),
        # versions from before habits were knowledge do not say it
        "windows": None if knowledge is None else knowledge.details.get("habits", {}).get("windows"),
        "roles": _options(own, manifest, samples), "shares": known_play(own, manifest),
        "logged": _logged(samples.drop_nulls("option")),
        "originals": len(copied.originals),
        "copies": len(copied.copies), "by_chance": _by_chance(copied.copies),
        "against": [_rivals(played) for played in (sides, copied.copies)],
        "situations": _beside(originals, copies) if len(copies) else [],
        "likeness": likeness(originals, {
            "its copy": copies, "its adversaries": _described(
                [(match, SIDES[1 - SIDES.index(side)]) for match, side in sides])}) if len(copies) else [],
    }


def _learned_from(own: Store, knowledge: Manifest | None) -> list[Receipt]:
    """The matches whose options a version of the knowledge is of; those that are gone are left out."""
    inputs = knowledge.inputs if knowledge is not None else {}
    names = {label.split("/")[1] for label in inputs if label.startswith("options/")}
    return [receipt for receipt in own.receipts("matches") if receipt.name in names]


def _options(own: Store, manifest: Manifest, samples: pl.DataFrame) -> list[dict[str, Any]]:
    """For each role how much of its time has an option, how sure that is, and what it does most."""
    offered = dict(table_of(own, manifest, Policies).group_by(pl.col("role").cast(pl.String)).agg(
        pl.col("behaviour_id").n_unique()).iter_rows())
    return [_role(role, rows, offered.get(role, 0)) for role in ROLES
            if not (rows := samples.filter(role=role)).is_empty()]


def _logged(known: pl.DataFrame) -> float:
    """The share of the time with an option that the team itself logged."""
    return float(known.filter("logged")["seconds"].sum()) / (float(known["seconds"].sum()) or 1.0)


def _samples(own: Store, match: Receipt, team: TeamName) -> pl.DataFrame:
    """The samples of a team's robots in play, each with the option that it lies in, or null."""
    found = {noun: own.receipt(noun, match.name) for noun in ("options", "trajectories")}
    options, trajectories = found["options"], found["trajectories"]
    hz = table_of(own, match, Matches)["hz"][0]
    if options is None or trajectories is None or not hz:
        return _SAMPLES
    mine = _mine(match, team)
    samples = table_of(own, trajectories, Trajectories).filter(mine, pl.col("segment").is_not_null()).select(
        pl.col("team").cast(pl.String), "robot", "role", "t_ns").drop_nulls("role").sort("t_ns")
    lasting = table_of(own, options, Options).filter(mine).select(
        pl.col("team").cast(pl.String), "robot", "start_ns", "end_ns",
        pl.coalesce(LOGGED, "option").alias("option"), "probability", LOGGED.is_not_null().alias("logged"),
    ).sort("start_ns")
    within = pl.col("t_ns") < pl.col("end_ns")
    return samples.join_asof(
        lasting, left_on="t_ns", right_on="start_ns", by=["team", "robot"], check_sortedness=False,
    ).select("role", seconds=pl.lit(1 / hz), option=pl.when(within).then("option"),
             probability=pl.when(within).then("probability"), logged="logged").cast(_SAMPLES.schema)


def _mine(match: Receipt, team: TeamName) -> pl.Expr:
    """Rows of a team's sides in a match."""
    return pl.col("team").cast(pl.String).is_in([side for side in SIDES if match.details[side] == team.name])


def _role(role: str, samples: pl.DataFrame, offered: int) -> dict[str, Any]:
    """A role's line."""
    played, known = float(samples["seconds"].sum()), samples.drop_nulls("option")
    seconds = float(known["seconds"].sum())
    most = known.group_by("option").agg(pl.col("seconds").sum()).sort(
        "seconds", "option", descending=[True, False])
    weighed = known.select(
        mean=pl.col("seconds") * pl.col("probability"),
        sure=pl.col("seconds") * (pl.col("probability") >= SURE)).sum().row(0, named=True)
    return {
        "role": role, "minutes": played / 60, "recovered": seconds / played, "offered": offered,
        "probability": weighed["mean"] / seconds if seconds else None,
        "sure": weighed["sure"] / seconds if seconds else None,
        "most": [{"code": code, "words": short(NAMES[code]), "share": took / seconds}
                 for code, took in most.head(_OPTIONS).iter_rows()],
    }


def _described(sides: Sequence[tuple[LeagueMatch, str]]) -> F64:
    """Descriptions of sides of matches that have situations, float64 [M, S]."""
    found = [described(rows) for match, side in sides
             if not (rows := match.situations.filter(pl.col("team") == side)).is_empty()]
    return np.array(found) if found else np.empty((0, 0))


def _beside(originals: F64, copies: F64) -> list[dict[str, Any]]:
    """Shares of situations of the original and of the copy, the most frequent of either first."""
    one, other = (spectrum(list(rows)) for rows in (originals, copies))
    rows = [{"code": code, "words": NAMES[code], "of_original": share, "of_copy": other[code],
             "more": other[code] - share}
            for code, share in one.items() if share or other[code]]
    return sorted(rows, key=lambda row: (-max(row["of_original"], row["of_copy"]), row["code"]))


def _by_chance(copies: Sequence[tuple[LeagueMatch, str]]) -> float | None:
    """The share of the copy's decisions that were drawn at random; None without decisions."""
    made = [match.choices.filter(pl.col("team") == side)["random"] for match, side in copies]
    total = sum(map(len, made))
    return sum(int(each.sum()) for each in made) / total if total else None


def _rivals(sides: Sequence[tuple[LeagueMatch, str]]) -> list[str]:
    """The names of the adversaries of some sides, sorted."""
    return sorted({(match.away if side == "home" else match.home).name for match, side in sides})
