"""The command record: play matches between teams and log them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

import polars as pl

from pitchlore.flows.commands.addresses import At, Interface, addressed
from pitchlore.flows.commands.common import DEFAULTS, Common, Json, On
from pitchlore.flows.commands.playing import AS_LEARNED, AS_USUAL, Learners, Many, Playing, Seed, WhoPlays
from pitchlore.flows.commands.printing import console, print_frame, print_json, print_stand_in, say
from pitchlore.flows.commands.waiting import bars
from pitchlore.pipeline.arena.match.controllers import PolicyTables
from pitchlore.pipeline.arena.match.recipe import Recipe
from pitchlore.pipeline.base.errors import BadSettings, PitchloreError
from pitchlore.pipeline.engine.catalog import renew
from pitchlore.pipeline.engine.placement.places import executors_at
from pitchlore.pipeline.engine.record import record_match, unplayed
from pitchlore.pipeline.engine.tasks import spread
from pitchlore.pipeline.importers.packets.streams import Stream
from pitchlore.pipeline.sessions.simulating import STREAMS, simulate
from pitchlore.pipeline.store import Store
from pitchlore.schemas import Matches, note_on


def record_matches(
    *,
    home: WhoPlays = "static",
    away: WhoPlays = "static",
    seed: Seed = 1,
    matches: Many = 1,
    playing: Playing = AS_USUAL,
    learners: Learners = AS_LEARNED,
    serve: Literal["vsss"] | None = None,
    at: At = (),
    interface: Interface = None,
    on: On = None,
    json: Json = False,
    common: Common = DEFAULTS,
) -> None:
    """Play matches and log them.

    With `--serve vsss` the arena is a simulator for others' programs: one match is played in real time,
    frames are sent as FIRASim does, the referee's commands as VSSReferee does, and teams that are `remote`
    are driven by FIRASim's commands. Home is blue. The streams are vision, referee and commands.

    Args:
        home: Home team.
        away: Away team.
        seed: Seed of the first match; each later match has the next seed. The same teams, settings and
            seed give the same match. With --serve: the first seed that was not played, from this one on.
        matches: Number of matches.
        playing: How the matches are played.
        learners: How learned teams play.
        serve: Be a simulator of this league.
        at: Address of one stream.
        interface: Network card.
        on: Where matches are played; a single one is played by this process.
        json: Print JSON.
        common: Options of every command.
    """
    store = common.store
    how = playing.matches(store).of_match()
    teams, policies = learners.entrants(store, home, away)
    if serve is not None:
        if matches != 1:
            raise BadSettings("only one match is served", where=f"--matches {matches}",
                              next_step="Leave it out")
        recipe = unplayed(store, Recipe(**how, home=teams[0].settings, away=teams[1].settings, seed=seed))
        _serve(store, recipe, policies, addressed(STREAMS, None, at), interface, json=json)
        renew(store)
        return
    days = matches * how["referee"].duration_s / 86_400
    if days >= 1:
        say(f"{matches:,} matches are {days:,.0f} days of play; Ctrl-C keeps those that are finished")
    recipes = (Recipe(**how, home=teams[0].settings, away=teams[1].settings, seed=number)
               for number in range(seed, seed + matches))
    played: dict[int, dict[str, object]] = {}  # by seed: matches of several workers end in any order
    failure = None
    with executors_at(on, store.root, here=True) as executors, bars() as progress:
        progress.begin("matches", matches)
        data = executors.path(store.root)
        pieces = ((recipe.match_id, {"data": data, "recipe": recipe, "policies": policies})
                  for recipe in recipes)
        try:
            for name, (receipt, new) in spread(executors, record_match, pieces, matches):
                row = store.read_table(receipt, "matches", Matches)
                played[receipt.settings["seed"]] = {
                    **row.select("match_id", "home", "away", "score_home", "score_away", "duration_s")
                    .row(0, named=True), "new": new, "note": note_on(home, away)}
                progress.advance("matches", name)
        except PitchloreError as error:
            failure = error
    rows = [played[number] for number in sorted(played)]
    if json:
        print_json(rows)
    elif rows:
        print_frame(pl.DataFrame(rows).drop("note"))
        print_stand_in(home, away)
    if failure is not None:
        raise failure
    renew(store)


def _serve(
    store: Store, recipe: Recipe, policies: Mapping[str, PolicyTables], streams: Sequence[Stream],
    interface: str | None, *, json: bool,
) -> None:
    done = simulate(
        store, recipe, policies, {stream.name: stream for stream in streams}, interface=interface, say=say,
        listening=lambda where: say(f"Commands at {where}. Ctrl-C ends the match"))
    if json:
        print_json(done._asdict())
    else:
        without = f", {done.others} packets without one" if done.others else ""
        console().print(
            f"{recipe.home.name} {done.score[0]} : {done.score[1]} {recipe.away.name}, {done.frames} frames "
            f"sent, {done.commands} commands{without}. Kept as {done.match_id}; watch it with `pitchlore "
            f"replay {done.match_id}`.", soft_wrap=True)
