"""Preferences of a policy that looks: the actions that it appraises highest, by where the ball is."""

from __future__ import annotations

from collections.abc import Mapping
from string import ascii_lowercase, ascii_uppercase

import numpy as np
import polars as pl
from markupsafe import Markup

from pitchlore.pipeline.arena.teams.appraising import action_values_at, appraiser_of
from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.views.commentary.words import percent
from pitchlore.pipeline.views.scout.pictures import Mark, on_pitch
from pitchlore.schemas import ROLES
from pitchlore.schemas.sights import SIGHT

#: Parts of the pitch: along it, and from the line between the goals to a side line.
PARTS = (6, 2)
#: Names of actions in pictures: enough for all of Table 1.
_LETTERS = ascii_uppercase + ascii_lowercase
#: Fewer moments of a part say nothing.
_FEW = 10
#: Least and greatest radius of a dot, hundredths of the pitch.
_DOT = (2.2, 4.2)


def preferred(values: pl.DataFrame, appraisals: pl.DataFrame, sights: pl.DataFrame) -> pl.DataFrame:
    """The action that a policy prefers in each moment, whatever was done there.

    Args:
        values: rows of schema Policies of one version: the actions of each role.
        appraisals: rows of schema Appraisals of the same version.
        sights: rows of schema Sights.

    Returns:
        A row a moment of a role that has actions: role, behaviour_id, ball_x and ball_y as in
        ``schemas.sights.SIGHT``, and gain: how much more the action is worth there than the role's best
        constant, the action that is worth most on average; in V (table values), 0 where it is that one.
    """
    appraiser, names = appraiser_of(values, appraisals)
    sight = np.ascontiguousarray(sights["sight"].to_numpy(), dtype=np.float32)
    worth, role = action_values_at(appraiser, sight), sights["role"].cast(pl.String).to_numpy()
    ball = [sight[:, list(SIGHT).index(name)] for name in ("ball_x", "ball_y")]
    parts = []
    for number, name in enumerate(ROLES):
        offered, own = np.flatnonzero(appraiser.allowed[number][1:]) + 1, np.flatnonzero(role == name)
        if not len(offered) or not len(own):
            continue
        of_role = worth[np.ix_(offered, own)]
        best, constant = of_role.argmax(0), of_role.mean(1).argmax()
        ids = np.array([names[number * len(appraiser.codes) + action] for action in offered])
        parts.append(pl.DataFrame({
            "role": np.full(len(own), name), "behaviour_id": ids[best], "ball_x": ball[0][own],
            "ball_y": ball[1][own], "gain": of_role.max(0) - of_role[constant],
        }))
    return pl.concat(parts) if parts else pl.DataFrame(schema={
        "role": pl.String, "behaviour_id": pl.String, "ball_x": pl.Float32, "ball_y": pl.Float32,
        "gain": pl.Float64})


def actions_of(moments: pl.DataFrame) -> pl.DataFrame:
    """The actions of one role's moments, the most preferred first.

    Returns:
        behaviour_id; letter, by which the picture names it; share of the moments in which it is preferred;
        gain, its mean there.
    """
    found = moments.group_by("behaviour_id").agg(
        share=pl.len() / moments.height, gain=pl.col("gain").mean(),
    ).sort("share", "behaviour_id", descending=[True, False])
    letters = pl.Series("letter", list(_LETTERS[:found.height]), dtype=pl.String)
    return found.select("behaviour_id", letters, "share", "gain")


def preference_picture(moments: pl.DataFrame, letters: Mapping[str, str], pitch: Pitch, label: str) -> Markup:
    """The most preferred action in each part of the pitch that the ball was in, for one role.

    The larger the dot, the greater the share of the moments in which that action is preferred.

    Args:
        moments: moments of one role, from :func:`preferred`.
        letters: by behaviour id.
        pitch: the pitch.
        label: description of the picture, in words.
    """
    wide, high = pitch.length / PARTS[0], pitch.width / 2 / PARTS[1]
    along = (pl.col("ball_x") / wide + PARTS[0] / 2).floor().clip(0, PARTS[0] - 1).cast(pl.Int64)
    across = (pl.col("ball_y") / high).floor().clip(0, PARTS[1] - 1).cast(pl.Int64)
    counts = moments.filter(pl.col("ball_x").is_finite()).group_by(
        along.alias("along"), across.alias("across"), "behaviour_id").len()
    parts = counts.sort("along", "across", "len", "behaviour_id", descending=[False, False, True, False])
    marks = []
    for (column, row), found in parts.group_by("along", "across", maintain_order=True):
        total = int(found["len"].sum())
        if total < _FEW:
            continue
        best, share = found["behaviour_id"][0], float(found["len"][0]) / total
        x, y = (int(column) + 0.5) * wide - pitch.length / 2, (int(row) + 0.5) * high
        size = _DOT[0] + (_DOT[1] - _DOT[0]) * share
        says = f"{letters[best]} in {percent(share)} of {total} moments"
        marks += [Mark(x, side * y, "mark home", says, size=size, letter=letters[best]) for side in (1, -1)]
    return on_pitch(pitch, label, marks=marks)
