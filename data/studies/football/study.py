"""Football's situations, touches and possession beside those of the provider.

``make football`` (three minutes; RECORDINGS is a folder of further recordings). SkillCorner's
match is read where kloppy's wheel has installed it, and nothing of it is copied: the tables have counts only.
In its raw file a frame's ``possession`` has a group, the team that has the ball, and a trackable object, the
player. kloppy passes on the first of the two.

``possession.csv`` has for each guess how often it names the provider's team, with a 95 % interval by a
bootstrap over blocks of five minutes, ``confusion.csv`` the counts, ``touches.csv`` the same for players,
``contact.csv`` what another contact distance gives, and ``codes.csv`` the spread of situations of every
recording.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import polars as pl
from football.skillcorner import FILES, MATCH, whole_match
from harness import elsewhere, read, recordings
from usual.study import situations_of

from pitchlore.pipeline.game.pitch import PITCHES, SCALES, Kind
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.pipeline.settings import TrajectorySettings
from pitchlore.pipeline.stages.events.control import NOBODY, ball_control
from pitchlore.pipeline.stages.situations.usual import recognition
from pitchlore.pipeline.stages.trajectories.derive import trajectories
from pitchlore.pipeline.stages.trajectories.heights import with_heights
from pitchlore.schemas import SIDES
from pitchlore.schemas.situations import MOVES_RANDOMLY

#: Blocks of the bootstrap, s, its rounds and seed.
BLOCK_S, ROUNDS, SEED = 300.0, 2000, 7
#: Contact distances that are tried, m.
CONTACTS = (0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0, 2.5, 3.0)
#: A guess that names nobody.
NONE = -1

Codes = npt.NDArray[np.int64]


#: Team times this and number are a player.
_TEAM = 1000


class Truth(NamedTuple):
    """The provider's word, by time: team (place in SIDES), player (team and number in one); NONE without."""

    t_ns: Codes
    team: Codes
    player: Codes


def provider(match: MatchLog) -> Truth:
    """The provider's possession at the frames that kloppy reads; frames without a team are left out."""
    meta, raw = (json.loads((FILES / name).read_text()) for name in MATCH)
    sides = {meta["home_team"]["id"]: 0, meta["away_team"]["id"]: 1}
    who = {p["trackable_object"]: _TEAM * sides[p["team_id"]] + p["number"] for p in meta["players"]}
    frames = [frame for frame in raw if frame["period"] is not None and frame["data"]]
    assert len(frames) == len(match.frames)
    team = [{"home team": 0, "away team": 1}.get(frame["possession"]["group"], NONE) for frame in frames]
    player = [who.get(frame["possession"]["trackable_object"], NONE) for frame in frames]
    known = np.array(team) != NONE
    return Truth(match.frames.t_ns[known], np.array(team)[known], np.array(player)[known])


class Guess(NamedTuple):
    """Team and player at the times of the truth, NONE without."""

    team: Codes
    player: Codes


def ours(bodies: pl.DataFrame, match: MatchLog, t_ns: Codes) -> Guess:
    """Our team with the ball (as in table possession), and our player in touch."""
    held = ball_control(bodies, match.info.pitch)
    player = np.full(len(held.team), NONE)
    touching = held.toucher != NOBODY
    contact = held.toucher[touching]
    player[touching] = _TEAM * held.contacts.team[contact] + held.contacts.robot[contact]
    return at(held.ball.t_ns, held.team, player, t_ns)


def nearest(bodies: pl.DataFrame, t_ns: Codes) -> Guess:
    """The control: the player nearest to the ball among those that are seen, and his team."""
    ball = bodies.filter(pl.col("team") == "ball").select("t_ns", bx="x", by="y")
    near = bodies.filter(pl.col("team") != "ball").join(ball, on="t_ns").with_columns(
        d=(pl.col("x") - pl.col("bx")) ** 2 + (pl.col("y") - pl.col("by")) ** 2,
    ).sort("t_ns", "d").unique("t_ns", keep="first", maintain_order=True)
    team: Codes = np.array([SIDES.index(side) for side in near["team"].cast(pl.String)])
    return at(near["t_ns"].to_numpy(), team, _TEAM * team + near["robot"].to_numpy(), t_ns)


def constant(truth: Truth) -> Guess:
    """The control: always the team, or the player, that the provider names most often."""
    team, player = (np.bincount(said[said != NONE]).argmax() for said in (truth.team, truth.player))
    return Guess(np.full(len(truth.t_ns), team), np.full(len(truth.t_ns), player))


def at(times: Codes, team: Codes, player: Codes, t_ns: Codes) -> Guess:
    """A guess at the times of the truth; NONE where there is none."""
    place = np.clip(np.searchsorted(times, t_ns), 0, len(times) - 1)
    there = times[place] == t_ns
    return Guess(np.where(there, team[place], NONE), np.where(there, player[place], NONE))


def interval(t_ns: Codes, right: npt.NDArray[np.bool_]) -> tuple[float, float]:
    """95 % interval of the share of rows that are right, by a bootstrap over blocks of time."""
    _, block = np.unique(t_ns // int(BLOCK_S * 1e9), return_inverse=True)
    rows, of_them = np.bincount(block), np.bincount(block, weights=right)
    drawn = np.random.default_rng(SEED).integers(0, len(rows), (ROUNDS, len(rows)))
    low, high = np.quantile(of_them[drawn].sum(axis=1) / rows[drawn].sum(axis=1), [0.025, 0.975])
    return float(low), float(high)


def agreement(name: str, t_ns: Codes, said: Codes, guess: Codes, own: Codes) -> dict[str, object]:
    """Frames that the provider names, those that the guess names, and how often it is right.

    The last share is that of the frames in which both this guess and ``own``, ours, name somebody.
    """
    named, right = guess != NONE, guess == said
    both = named & (own != NONE)
    low, high = interval(t_ns, right)
    return {
        "guess": name, "frames": len(said), "named": int(named.sum()), "right": int(right.sum()),
        "agreement": right.mean(), "low": low, "high": high,
        "agreement_where_named": right[named].mean(), "agreement_where_ours_is_named": right[both].mean()}


def spread(name: str, kind: Kind, situations: pl.DataFrame) -> dict[str, object]:
    """Number of codes, share of 194, and how evenly the time is spread over the codes."""
    time = situations.group_by("code").agg(s=(pl.col("end_ns") - pl.col("start_ns")).sum())
    share = time["s"].to_numpy() / time["s"].sum()
    shown = recognition(situations, kind)
    return {
        "recording": name, "kind": kind.value, "robot_s": shown.seconds, "codes": shown.codes + (
            MOVES_RANDOMLY in time["code"]), "moves_randomly": shown.random,
        "entropy_bits": float(-(share * np.log2(share)).sum()), "poor": shown.poor,
    }


def codes(match: MatchLog, folder: Path) -> pl.DataFrame:
    """The spread of situations: football as it was read before, as now, and the other recordings."""
    as_2d = replace(match, info=match.info.model_copy(update={"pitch": PITCHES[Kind.SIM2D]}))
    rows = [
        spread("SkillCorner, read as 2D", Kind.SIM2D, situations_of(as_2d)),
        spread("SkillCorner", Kind.HUMAN, situations_of(match))]
    for name, path in recordings(folder).items():
        log = read(path)
        rows.append(spread(name.split(".")[0], log.info.pitch.kind, situations_of(log)))
    return pl.DataFrame(rows)


def main(out: Path, folder: Path) -> None:
    """Measure, and write the tables."""
    match = whole_match()
    bodies, _ = trajectories(match, TrajectorySettings())
    bodies, truth = with_heights(bodies, match.heights), provider(match)
    guesses = {
        "pitchlore": ours(bodies, match, truth.t_ns), "nearest player": nearest(bodies, truth.t_ns),
        "constant": constant(truth)}
    flat = ours(bodies.drop("z"), match, truth.t_ns)
    tables = {"possession": pl.DataFrame([
        agreement(name, truth.t_ns, truth.team, guess.team, guesses["pitchlore"].team)
        for name, guess in {**guesses, "pitchlore without heights": flat}.items()])}
    tables["confusion"] = pl.DataFrame([
        {"guess": name, "provider": side, **{
            says: int(((truth.team == code) & (guess.team == value)).sum())
            for says, value in (("home", 0), ("away", 1), ("nobody", NONE))}}
        for name, guess in guesses.items() for code, side in enumerate(SIDES)])
    named = truth.player != NONE
    tables["touches"] = pl.DataFrame([
        agreement(name, truth.t_ns[named], truth.player[named], guess.player[named],
                  guesses["pitchlore"].player[named])
        for name, guess in guesses.items()])
    scales, rows = SCALES[Kind.HUMAN], []
    for contact in CONTACTS:
        SCALES[Kind.HUMAN] = replace(scales, contact=contact)
        guess = ours(bodies, match, truth.t_ns)
        right, touch = guess.team == truth.team, guess.player[named]
        rows.append({
            "contact_m": contact, "possession_agreement": right.mean(),
            "possession_named": (guess.team != NONE).mean(), "touch_named": (touch != NONE).mean(),
            "touch_right_where_named": (touch == truth.player[named])[touch != NONE].mean()})
    SCALES[Kind.HUMAN] = scales
    tables["contact"], tables["codes"] = pl.DataFrame(rows), codes(match, folder)
    for name, table in tables.items():
        table.write_csv(out / f"{name}.csv", float_precision=4)


if __name__ == "__main__":
    main(Path(__file__).parent, elsewhere())
