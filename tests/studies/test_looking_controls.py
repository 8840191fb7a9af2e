"""The controls of the team that looks: blind teams, and learning from a log that was dealt out anew."""

from __future__ import annotations

import numpy as np
import polars as pl
import pytest
from looking.blind import blind
from looking.permuted import actions_dealt, dealt, sights_dealt
from support.looking import PLACE, SMALL, decided, looks, pairs_of, two_places

from pitchlore.pipeline.arena.match.controllers import controllers_of
from pitchlore.pipeline.arena.teams.appraising import action_value as worth
from pitchlore.pipeline.arena.teams.appraising import appraiser_of
from pitchlore.schemas import HOME


def unseeing(late_s=None, **how):
    """As :func:`support.looking.looks`, of a team that is blind."""
    return looks(lambda recipe, policies: controllers_of(recipe, policies, (blind(policies["it"], late_s)(recipe, HOME), None)), **how)


def test_blind_team():
    """A blind team takes each action as often as it sees cause to, but at other times."""
    ball, shoots = unseeing()
    there, back, whole = shoots[ball > 0], shoots[ball <= 0], shoots
    assert 0.05 < whole.mean() < 0.95
    assert abs(there.mean() - back.mean()) < 4 * np.sqrt(whole.var() * (1 / len(there) + 1 / len(back)))


def test_blind_for_a_time():
    """It acts on what its role saw so many decisions ago: first on the first, then on one after the other."""
    ball, shoots = unseeing(3.0)  # a decision each 0.5 s
    late = 6
    assert (shoots[late:] == (ball[:-late] > 0)).all()
    assert (shoots[:late] == (ball[0] > 0)).all()
    assert (shoots != (ball > 0)).any()
    ball, shoots = unseeing(0.1)  # less than half a decision: one
    assert (shoots[1:] == (ball[:-1] > 0)).all()
    ball, shoots = unseeing(0.5, clock_s=1e-9)  # a decision lasts for a frame at least
    assert (shoots[30:] == (ball[:-30] > 0)).all()


def test_learns_nothing_from_shuffled_actions():
    """The control of a season: with the actions of a role dealt out anew, none is distinguished from another by place."""
    sight, code, change = two_places(1)
    found, kept = dealt(actions_dealt, *decided(sight, code, change), pairs_of(goalkeeper=[], midfield=[], striker=[21, 44]),
                        SMALL, 1)
    appraiser, _ = appraiser_of(kept, found)
    new = two_places(2)[0][:500]
    up = new[:, PLACE["ball_x"]] > 0
    gain = np.array([worth(appraiser, 1, each) - worth(appraiser, 2, each) for each in new])
    assert abs(gain[up].mean() - gain[~up].mean()) < 0.02, "0.2 in truth"


def test_learns_no_places_from_drawn_sights():
    """The control of looking: with sights of other moments no place is distinguished, and what is always worse still is."""
    sight, code, change = two_places(1)
    found, kept = dealt(sights_dealt, *decided(sight, code, change), pairs_of(goalkeeper=[], midfield=[], striker=[21, 44, 88]),
                        SMALL.model_copy(update={"least_share": 0.0}), 1)
    appraiser, _ = appraiser_of(kept, found)
    new = two_places(2)[0][:500]
    up = new[:, PLACE["ball_x"]] > 0
    gain = np.array([worth(appraiser, 1, each) - worth(appraiser, 2, each) for each in new])
    assert abs(gain[up].mean() - gain[~up].mean()) < 0.02, "0.2 in truth"
    worst = np.array([worth(appraiser, 1, each) - worth(appraiser, 3, each) for each in new])
    assert worst.mean() > 0.1, "0.2 in truth"


@pytest.mark.parametrize("deal", [actions_dealt, sights_dealt])
def test_deals_within_roles(deal):
    """The actions dealt out in a role are the role's own; decisions that no tree is fitted to stay, and all else."""
    sight, code, change = two_places(1)
    rng = np.random.default_rng(0)
    made, seen = decided(sight, code, change)
    role = pl.Series(rng.choice(["goalkeeper", "striker"], len(code))).cast(made.schema["role"])
    ours = pl.Series(rng.random(len(code)) < 0.9)
    made = made.with_columns(role=role, chosen=ours, behaviour_id=role.cast(pl.String) + pl.col("behaviour_id").str.tail(4))
    seen = seen.with_columns(role=role).sample(fraction=1.0, shuffle=True, seed=3)
    after = deal(made, seen, 5)
    assert [table.shape for table in after] == [made.shape, seen.shape]
    differ = [name for old, new in zip((made, seen), after, strict=True) for name in old.columns if not old[name].equals(new[name])]
    assert differ == (["behaviour_id"] if deal is actions_dealt else ["sight"])
    at = ["match_id", "team", "robot", "t_ns"]
    old, new = (decisions.join(sights.select(*at, "sight"), on=at, maintain_order="left") for decisions, sights in ((made, seen), after))
    assert old.filter(~ours).equals(new.filter(~ours))
    for each in ("goalkeeper", "striker"):
        mine = (table.filter(pl.col("role") == each, ours)[differ[0]] for table in (old, new))
        first, second = (sorted(values.to_list()) for values in mine)
        assert first == second
