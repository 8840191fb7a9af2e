"""The pages of policies: where they are sure and where not, in words and on a pitch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import polars as pl

from pitchlore.pipeline.engine.outputs import table_of
from pitchlore.pipeline.engine.policies import copies, known_play, looks, trained_on, way_of_play
from pitchlore.pipeline.game.pitch import PITCHES, Kind, Pitch
from pitchlore.pipeline.state.words import levels_in_words, with_elements
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Manifest, Receipt
from pitchlore.pipeline.views.commentary.words import percent
from pitchlore.pipeline.views.scout.content.sources import LeagueMatch, TeamName, sides_played, team_name
from pitchlore.pipeline.views.scout.pictures import bars, on_pitch
from pitchlore.pipeline.views.scout.states import facts_of, shaded
from pitchlore.pipeline.views.scout.words import of_behaviour
from pitchlore.schemas import KEYS, ROLES, SIDES, Appraisals, Clues, Habits, Policies, Returns, Sights, States
from pitchlore.schemas.policies import FEW, VERDICTS

#: States shown of each role and key that are unsure, and that are not; candidates shown of each.
_UNSURE, _KNOWN, _CANDIDATES = 4, 2, 5
#: Bins of episodes: label, least and most, both included.
_BINS = (("0", 0, 0), ("1", 1, 1), ("2", 2, 2), ("3 to 4", 3, 4), ("5 to 9", 5, 9), ("10 to 19", 10, 19),
         ("20 and more", 20, 1 << 62))
#: Matches and moments at most that a policy that looks is asked about.
_LOOKED_AT, _MOMENTS = 10, 6_000
_LEVELS = ("very close", "close", "far")
#: Greatest expected share of sure states if no behaviour were better than another. Both tails of a 95 %
#: interval count, because the evidence that is tested also decides which behaviour is best.
_BY_CHANCE = 0.05


class Newest(NamedTuple):
    """The newest policy that imitates a team.

    Attributes:
        manifest: manifest of the version.
        team: team that it imitates; None: the decisions of all teams.
        pitch: on which its league plays.
        matches: the last matches of its team, or of all, by id: options if the policy copies, else sequences,
            by which one that looks is asked; and the team's sides. At most ``_LOOKED_AT``.
    """

    manifest: Manifest
    team: TeamName | None
    pitch: Pitch
    matches: Sequence[tuple[Receipt, Sequence[str]]]

    @property
    def slug(self) -> str:
        """Name of its page."""
        return "all" if self.team is None else self.team.slug

    @property
    def reported(self) -> bool:
        """True if it was trained by a version that keeps returns and states."""
        return States.NAME in self.manifest.files

    @property
    def key(self) -> object:
        """Everything that its page is made from, as JSON values."""
        moments = [receipt.digests() for receipt, _ in self.matches] if looks(self.manifest) else []
        pitch = self.pitch.model_dump(mode="json")
        return [self.manifest.key, self.manifest.version, self.slug, pitch, moments]


def newest_policies(store: Store, league: Sequence[LeagueMatch]) -> list[Newest]:
    """The newest policy of each team that policies imitate, the newest version first.

    The pitch is that of the team's last match, or its league's usual one.
    """
    found: dict[TeamName | None, Newest] = {}
    for manifest in reversed(store.manifests("policies")):
        of = manifest.details.get("imitates")
        team = None if of is None else team_name(of["team"], of["kind"])
        if team not in found:
            played = [match.pitch for match in league if team is None or match.home.kind == team.kind]
            usual = PITCHES[Kind.VSSS if team is None else Kind(team.kind)]
            noun = "options" if copies(manifest) else "sequences"
            own = [(receipt, SIDES if team is None else sides_played(team, match))
                   for match in league if team in (None, match.home, match.away)
                   if (receipt := store.receipt(noun, match.name)) is not None]
            found[team] = Newest(manifest, team, played[-1] if played else usual, own[-_LOOKED_AT:])
    return list(found.values())


def policy_lines(store: Store, policies: Sequence[Newest]) -> list[dict[str, Any]]:
    """A line for each policy; counts are None for one that looks, or was trained before states were kept."""
    lines = []
    for each in policies:
        line: dict[str, Any] = {"version": each.manifest.version, "team": each.team, "slug": each.slug,
                                "told": each.reported, "states": None, "unsure": None}
        if each.reported and not looks(each.manifest):
            states = table_of(store, each.manifest, States)
            line |= {"states": states.height, "unsure": _unsure_share(states)}
        lines.append(line)
    return lines


def policy_facts(store: Store, policy: Newest, cards: Mapping[str, str]) -> dict[str, Any]:
    """Content of the page of a policy.

    Args:
        store: the data folder.
        policy: the policy.
        cards: address of the gallery's card of a behaviour, by its id; for those that have one.
    """
    about = {"policy": policy, "version": policy.manifest.version, "team": policy.team, "few": FEW,
             "knowledge": policy.manifest.details["knowledge_version"],
             "discount": policy.manifest.settings.get("discount"), "plays": way_of_play(policy.manifest),
             "copies": copies(policy.manifest)}
    if not policy.reported:
        return about | {"told": False}
    states, returned, values = (
        table_of(store, policy.manifest, schema) for schema in (States, Returns, Policies))
    if looks(policy.manifest):
        usual = {"habits": _habits(store, policy.manifest, cards)} if copies(policy.manifest) else {}
        return about | {"told": True, "looks": _looks(store, policy, values, cards)} | usual
    unsure, states = pl.col("verdict").is_in(["few", "close"]), with_elements(states)
    shown = [rows for (_, _), rows in states.group_by("key", "role", maintain_order=True)]
    shown.sort(key=lambda rows: (KEYS.index(rows["key"][0]), ROLES.index(rows["role"][0])))
    candidates = values.join(returned, on=["role", "key", "state", "behaviour_id"], how="left").sort(
        "q", "episodes", "behaviour_id", descending=[True, True, False], nulls_last=True)

    def reported(rows: pl.DataFrame) -> list[dict[str, Any]]:
        return [_state(row, candidates, policy.pitch, cards) for row in rows.iter_rows(named=True)]

    keep = [key for key in KEYS if any(rows["key"][0] == key and len(rows["elements"][0]) for rows in shown)]
    return about | {
        "told": True, "shares": known_play(store, policy.manifest), "unsure_share": _unsure_share(states),
        "groups": [_group(rows) for rows in shown], "evidence": _evidence(states),
        "ball": [it for rows in shown if (it := _by_ball(rows, policy.pitch)) is not None],
        "unsure": [card for rows in shown for card in reported(rows.filter(unsure).sort(
            "visits", "state", descending=[True, False]).head(_UNSURE))],
        "known": [card for rows in shown for card in reported(rows.filter(~unsure).sort(
            pl.col("verdict") == "sure", "low", "visits", "state", descending=[True, True, True, False],
            nulls_last=True).head(_KNOWN))],
        "shown_key": keep[-1] if keep else "",  # the coarsest has the most evidence
        "keys": sorted({rows["key"][0] for rows in shown}, key=KEYS.index), "roles": ROLES,
    }


def _looks(
    store: Store, policy: Newest, values: pl.DataFrame, cards: Mapping[str, str]
) -> list[dict[str, Any]]:
    """Preferences of a policy that looks, role by role; none without moments."""
    from pitchlore.pipeline.views.scout.preferred import (  # noqa: PLC0415 (numba's code is loaded with it)
        actions_of,
        preference_picture,
        preferred,
    )

    seen = _moments(store, policy)
    seen = seen.gather_every(max(1, -(-seen.height // _MOMENTS)))
    found = preferred(values, table_of(store, policy.manifest, Appraisals), seen)
    roles = []
    for role in ROLES:
        moments = found.filter(role=role)
        if moments.is_empty():
            continue
        actions = actions_of(moments)
        letters = dict(actions.select("behaviour_id", "letter").iter_rows())
        label = f"the action that a {role} prefers, by where the ball is"
        roles.append({
            "role": role, "moments": moments.height, "gain": moments["gain"].mean(),
            "picture": preference_picture(moments, letters, policy.pitch, label),
            "actions": [
                row | {"words": of_behaviour(row["behaviour_id"]), "link": cards.get(row["behaviour_id"])}
                for row in actions.iter_rows(named=True)],
        })
    return roles


def _habits(store: Store, policy: Manifest, cards: Mapping[str, str]) -> list[dict[str, Any]]:
    """How often each role takes an option, by the knowledge of a copy; none if that is gone."""
    knowledge = trained_on(store, policy)
    if knowledge is None:
        return []
    often = table_of(store, knowledge, Habits).sort("share", "option", descending=[True, False])
    shares = {role: often.filter(role=role).select("option", "share").rows() for role in ROLES}
    return [{"role": role, "options": [
        {"words": of_behaviour(name := f"{role}-{option:03d}"), "link": cards.get(name), "share": share}
        for option, share in of_role]} for role, of_role in shares.items()]


def _moments(store: Store, policy: Newest) -> pl.DataFrame:
    """Role and sight in moments of the last matches: windows of a copied team, or players' decisions."""
    columns = ("role", "sight")
    if copies(policy.manifest):
        own = (table_of(store, receipt, Clues).filter(pl.col("team").is_in(sides))
               for receipt, sides in policy.matches)
        return pl.concat([Clues.empty(), *own]).select(columns).drop_nulls("role")
    return pl.concat([Sights.empty().select(columns), *(
        table_of(store, receipt, Sights).filter(pl.col("code").is_null()).select(columns)
        for receipt, _ in policy.matches if Sights.NAME in receipt.files)])


def _unsure_share(states: pl.DataFrame) -> float | None:
    """Share of the visits that were to states where the policy is unsure; None without visits."""
    visits, unsure = int(states["visits"].sum()), states.filter(pl.col("verdict").is_in(["few", "close"]))
    return int(unsure["visits"].sum()) / visits if visits else None


def _group(rows: pl.DataFrame) -> dict[str, Any]:
    """A role and key in counts."""
    counts = dict(rows.group_by(pl.col("verdict").cast(pl.String)).len().iter_rows())
    tested = counts.get("sure", 0) + counts.get("close", 0)
    return {
        "key": rows["key"][0], "role": rows["role"][0], "states": rows.height,
        "visits": int(rows["visits"].sum()), "unsure": _unsure_share(rows), "tested": tested,
        "chance": _BY_CHANCE * tested, **{name: counts.get(name, 0) for name in VERDICTS},
    }


def _evidence(states: pl.DataFrame) -> dict[str, Any]:
    """How the episodes of the best behaviours are spread over states."""
    episodes = states["best_episodes"]
    counts = [int(episodes.is_between(low, high).sum()) for _, low, high in _BINS]
    return {
        "bins": [{"label": label, "count": count, "share": count / max(states.height, 1)}
                 for (label, _, _), count in zip(_BINS, counts, strict=True)],
        "picture": bars([float(count) for count in counts], "states by the episodes of their best behaviour"),
        "total": states.height,
        "below": sum(count for count, (_, _, high) in zip(counts, _BINS, strict=True) if high < FEW),
    }


def _by_ball(rows: pl.DataFrame, pitch: Pitch) -> dict[str, Any] | None:
    """The share of visits to unsure states by the ball's zone; None without zones in the key, or visits."""
    names = [f"distance of ball to {goal} goal" for goal in ("own", "adversary's")]
    said_of = [levels_in_words(elements) for elements in rows["elements"].to_list()]
    if not said_of or any(name not in said_of[0] for name in names):
        return None
    zones = rows.with_columns(**{
        place: pl.Series([each[name] for each in said_of])
        for place, name in zip(("own", "their"), names, strict=True)})
    found, under = [], []
    for own in _LEVELS:
        for their in _LEVELS:
            there = zones.filter(own=own, their=their)
            share = _unsure_share(there)
            if share is not None:
                visits = int(there["visits"].sum())
                says = f"{percent(share)} of {visits} visits; our goal: {own}, theirs: {their}"
                found.append({"own": own, "their": their, "visits": visits, "unsure": share})
                under.append(shaded(pitch, [own, their], 0.15 + 0.85 * share, says))
    if not found:
        return None
    label = "share of unsure visits by the zone of the ball"
    return {"key": rows["key"][0], "role": rows["role"][0], "zones": found,
            "picture": on_pitch(pitch, label, under=type(under[0])("").join(under))}


def _state(
    row: Mapping[str, Any], candidates: pl.DataFrame, pitch: Pitch, cards: Mapping[str, str]
) -> dict[str, Any]:
    """A state with its candidates, best first."""
    own = candidates.filter(role=row["role"], key=row["key"], state=row["state"])
    return {
        **{name: row[name] for name in ("role", "key", "state", "visits", "verdict", "gap", "low", "high",
                                        "best_episodes", "second_episodes", "behaviours")},
        **facts_of(levels_in_words(row["elements"]), row["role"], pitch),
        "candidates": [{
            "words": of_behaviour(each["behaviour_id"]),
            "link": cards.get(each["behaviour_id"]),
            **{name: each[name] for name in ("q", "visits", "evidence", "episodes", "mean", "spread")},
        } for each in own.head(_CANDIDATES).iter_rows(named=True)],
    }
