"""The replays of the scout's folder: the match's payload, and the behaviours that it looks for."""

from __future__ import annotations

import json
from collections.abc import Sequence

from pitchlore.pipeline.game.pitch import SCALES
from pitchlore.pipeline.views.commentary import Commentary
from pitchlore.pipeline.views.replay import payload, script, style
from pitchlore.pipeline.views.scout.content.learned import Learned
from pitchlore.pipeline.views.scout.content.sources import Known, LeagueMatch, TeamName
from pitchlore.pipeline.views.scout.content.teams import on_page

#: Most samples a second in clips and replays, and how far they may show a robot from its place, in its radii.
_HZ, _NEAR = 60.0, 1 / 2


def data(match: LeagueMatch, reported: Commentary) -> bytes:
    """The script with a match's payload: the clips and the replay load it."""
    packed = payload(
        match, hz=_HZ, near=_NEAR * SCALES[match.pitch.kind].robot_radius, reported=reported.sentences())[1]
    return f"scoutMatch({json.dumps(match.name)}, {json.dumps(packed)});\n".encode()


def replay_files(teams: Sequence[TeamName], known: Known | None, learned: Learned) -> dict[str, bytes]:
    """The files that all replays load: their code, their style, and the teams' behaviours."""
    return {"replay.js": script().encode(), "replay.css": style().encode(),
            "known.js": known_behaviours(teams, known, learned)}


def known_behaviours(teams: Sequence[TeamName], known: Known | None, learned: Learned) -> bytes:
    """The script with the behaviours of each team that its gallery shows: league, team, and their ids.

    It is one file for all replays, so that a new version of the knowledge leaves the replays as they are.
    """
    found = [] if known is None else [
        (team.kind, team.name, on_page(team, known, learned)["behaviour_id"].to_list())
        for team in teams]
    return f"scoutKnown({json.dumps(found)});\n".encode()
