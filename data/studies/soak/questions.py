"""Questions that `sql` and a notebook ask without pause, and whether an answer can be true."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from threading import Lock

#: Tables whose rows of a match depend on nothing but the match, each with those that it is made from.
MADE_FROM: dict[str, tuple[str, ...]] = {
    "matches": (), "sides": ("matches",), "trajectories": ("matches",), "situations": ("trajectories",),
    "goals": ("matches", "situations")}
#: How many rows of which content each table has of each match, and each version of the knowledge.
QUESTION = " union all ".join(
    f"select '{name}' as kind, {key} as name, count(*) as many, bit_xor(hash(t))::varchar as content"  # noqa: S608
    f" from {name} t group by all"
    for name, key in (*((name, "match_id") for name in MADE_FROM), ("behaviours", "version::varchar")))
Row = tuple[str, str, int, str]
#: Tables and matches of receipts that stood while a question was answered.
Standing = Collection[tuple[str, str]]

#: The notebook: it asks the catalogue as our notebooks do, and prints each answer.
NOTEBOOK = f"""
import duckdb, json, os, sys, time
while True:
    try:
        with duckdb.connect(sys.argv[1], read_only=True) as catalog:
            catalog.execute("set enable_progress_bar = false")
            catalog.execute(f"set variable pitchlore_data = '{{os.path.dirname(sys.argv[1])}}'")
            said = catalog.sql({QUESTION!r}).fetchall()
    except duckdb.Error as error:
        said = f"{{type(error).__name__}}: {{error}}".splitlines()[0][:200]
    print(json.dumps(said), flush=True)
    time.sleep(0.5)
"""


#: A program: it opens the league once, and asks at each line that it is told.
PROGRAM = f"""
import json, sys
import pitchlore
league = pitchlore.open(sys.argv[1])
for line in sys.stdin:
    try:
        said = league.sql({QUESTION!r}).fetchall()
    except Exception as error:
        said = f"{{type(error).__name__}}: {{error}}"[:300]
    print(json.dumps(said), flush=True)
"""


class Judge:
    """Says what of an answer cannot be true.

    Args:
        truth: the answer of a folder in which nothing else happened.
        kept: matches that are in the folder all the time.
        live: how names of matches begin of which nothing is known before.
    """

    def __init__(self, truth: Iterable[Row], kept: frozenset[str] = frozenset(), live: str = "ssl-") -> None:
        self.kept, self._live = kept, live
        self._truth = {(kind, name): (many, content) for kind, name, many, content in truth}
        self._versions: dict[str, tuple[int, str]] = {}
        self._lock = Lock()

    def wrong(self, answer: Iterable[Row], *, of_now: bool = True, said: str = "") -> list[str]:
        """Faults of an answer; none, if it is of one state that the folder can have had.

        A match's rows are all there and no others; what a table is made from is there with it, unless the
        answer is not ``of_now``: the catalogue may have been made while a file was damaged; or what was
        ``said`` on standard error names it as left out. A version of the knowledge has the rows that it had
        when it was first seen.
        """
        found, there = [], set()
        for kind, name, many, content in answer:
            if kind == "behaviours":
                with self._lock:
                    first = self._versions.setdefault(name, (many, content))
                if first != (many, content):
                    found.append(f"knowledge {name} has changed")
                continue
            if name.startswith(self._live):
                continue
            there.add((kind, name))
            if self._truth.get((kind, name)) != (many, content):
                found.append(f"wrong rows: {kind} of {name}, {many}")
        found += [f"{kind} of {name} without its {source}" for kind, name in sorted(there)
                  for source in MADE_FROM[kind]
                  if of_now and (source, name) in self._truth and (source, name) not in there
                  and f"/{source}/{name}" not in said]
        return found

    def lacking(self, answer: Iterable[Row], standing: Standing, quarantined: str = "") -> list[str]:
        """Rows that an answer has to have, and has not.

        Args:
            answer: one that claims to be whole.
            standing: tables and matches whose receipts stood all the time, as others have counted them.
            quarantined: names of what was in quarantine: of such a match only the match itself is shown.
        """
        there = {(kind, name) for kind, name, _, _ in answer}
        wanted = {of for of in self._truth if of[1] in self.kept or of in standing}
        wanted |= {of for of in standing if of[0] == "matches" and of[1].startswith(self._live)}
        return [f"a smaller answer without a word: {kind} of {name}" for kind, name in sorted(wanted - there)
                if kind == "matches" or name not in quarantined]
