"""A process that does things to data folders when it is told to.

A line of standard input is a delay in seconds, an action and a folder. The answer is a line: what came of it.
"""

import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

from pitchlore.pipeline.base.errors import PitchloreError
from pitchlore.pipeline.engine.catalog import forget_match, refresh, renew
from pitchlore.pipeline.engine.costs import Spent
from pitchlore.pipeline.engine.games import Turn, done, take_game
from pitchlore.pipeline.engine.making import Outcome, make
from pitchlore.pipeline.engine.matches import take_in
from pitchlore.pipeline.engine.progress import RunReport
from pitchlore.pipeline.engine.recordings import Recording
from pitchlore.pipeline.engine.stage import Output, Per, Scope, Stage
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.update import bring_up_to_date
from pitchlore.pipeline.engine.verify import backup_at, mend, verify_all
from pitchlore.pipeline.engine.versions import emit
from pitchlore.pipeline.face.league import League
from pitchlore.pipeline.settings import Settings
from pitchlore.pipeline.stages.seasons.settings import Season, parse_season
from pitchlore.pipeline.store import Store, parts

SHORT = 'base = "paper"\ngames = 2\nlead_from = 2\n[referee]\nduration_s = 3'


def run(store: Store) -> str:
    """The work of `pitchlore run`, in this thread."""
    report = RunReport()

    def perform(
        todo: Mapping[Output, Sequence[Stage]], settings: Settings, scope: Scope
    ) -> Iterator[tuple[Output, Outcome]]:
        for output, stages in todo.items():
            nouns = [stage.noun for stage in stages]
            yield output, make(store.root, nouns, output, settings, scope.of(output), store.suspect)

    def version(stage: Stage, settings: Settings, scope: Scope) -> tuple[int, bool, Spent]:
        manifest, new = emit(store, stage, stage.settings(settings), scope)
        return manifest.version, new, Spent()

    bring_up_to_date(store, Settings(), report, perform, version)
    refresh(store)
    return f"{report.knowledge_is_new} {report.policy_is_new}"


def bring_in(store: Store) -> str:
    """Import the recordings of the folder beside the data folder."""
    for file in sorted((store.root.parent / "recordings").iterdir()):
        take_in(store, Recording(file=file))
    refresh(store)
    return "imported"


def forget(store: Store) -> str:
    """Forget the match of the recording ``early``, or what is left of it."""
    for noun in STAGES.nouns(Per.MATCH):
        for receipt in store.receipts(noun):
            if receipt.name.startswith("early"):
                forget_match(store, receipt.name)
    refresh(store)
    return "forgotten"


def prune(store: Store) -> str:
    """Remove superseded files."""
    return str(sum(len(store.prune(noun)) for noun in STAGES.receipted))


def train(store: Store) -> str:
    """Train a policy, unless one stands."""
    settings = Settings()
    scope = Scope(matches=tuple(receipt.name for receipt in store.receipts("matches")))
    return str(emit(store, STAGES["policies"], settings.policies, scope)[1])


def season(store: Store) -> str:
    """Play the next game of a short season, and learn from it."""
    own = Season(name="short", opponent="static", seed=1, settings=parse_season(SHORT, where="short.toml"))
    before = done(store, own)
    game = 1 if before is None else before.details["games"] + 1
    if game <= own.settings.games:
        take_game(store.root, Turn(own, game), discard=False)
    refresh(store)
    return f"game {game}"


def scout(store: Store) -> str:
    """Write all pages, beside the data folder's own."""
    return str(League(store).scout().new)


def export(store: Store) -> str:
    """Write each match as tables and as a recording."""
    league = League(store)
    return str([league.match(name).export(to) for name in store.names("matches") for to in ("csv", "foxglove")])


def restore(store: Store) -> str:
    """Restore damaged files from the folder beside the data folder."""
    return str(mend(verify_all(store), store, backup_at(store.root.parent / "backup")))


def join(store: Store) -> str:
    """Join every two matches that are complete, and make the catalogue."""
    parts.MATCHES = 2
    return str(renew(store))


ACTIONS: dict[str, Callable[[Store], str]] = {
    "run": run, "import": bring_in, "forget": forget, "prune": prune, "train": train, "season": season,
    "scout": scout, "export": export, "restore": restore, "join": join,
}


def answer(action: str, store: Store) -> str:
    """The line that comes of an action."""
    try:
        store.catch_up()
        return ACTIONS[action](store)
    except PitchloreError as error:
        return f"error: {error}"


def main() -> None:
    """Answer lines until there are no more."""
    print("ready", flush=True)
    for line in sys.stdin:
        delay, action, folder = line.rstrip("\n").split(" ", 2)
        time.sleep(float(delay))
        print(answer(action, Store(Path(folder))), flush=True)


if __name__ == "__main__":
    main()
