"""Stages: their inputs, their new outputs, and how one output is made."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any, NamedTuple

import polars as pl
from pydantic import BaseModel, ConfigDict

from pipeline.errors import CorruptFile, NotFound
from pipeline.pitch import Pitch
from pipeline.settings import Settings
from pipeline.store import Store
from pipeline.store.receipts import Manifest, Receipt
from pipeline.store.work import Made, Work
from schemas import Table


class Scope(BaseModel):
    """The matches and gram lengths of a run.

    Attributes:
        matches: ids of the matches, sorted.
        lengths: lengths of the grams, longest first.
        group: None if behaviours are selected from all matches of the store; else the id of the group
            they are selected from. With groups, learning from a new match always costs the same.
    """

    model_config = ConfigDict(frozen=True)

    matches: tuple[str, ...]
    lengths: tuple[int, ...]
    group: str | None = None

    def round(self, n: int) -> str:
        """Name of the output of the round for grams of length ``n``: ``n4``, ``<group>.n4``."""
        return f"n{n}" if self.group is None else f"{self.group}.n{n}"


class Output(NamedTuple):
    """One output of a stage.

    Attributes:
        name: unique in its noun.
        match: its match, None if it is of all matches of the scope.
        n: its length of grams, None if it has no single length.
    """

    name: str
    match: str | None = None
    n: int | None = None


class Per(Enum):
    """The unit for which a stage has one output."""

    MATCH = "match"
    GRAMS = "match and gram length"
    ROUND = "gram length"
    VERSION = "version"
    OWN = "piece of work of a flow of its own"


class Longer(NamedTuple):
    """An input that is read only for greater gram lengths.

    Attributes:
        noun: the stage.
    """

    noun: str


class Inputs(Mapping[str, Sequence[Receipt]]):
    """The inputs of one output, by noun; a table is read when it is asked for.

    Args:
        store: holds the inputs.
        receipts: receipts by noun, in order. A manifest stands for a version.
        n: length of grams of the output, 0 if it has no single length.
        version: number of the version that is being made, 0 if the noun has no versions.
    """

    def __init__(
        self, store: Store, receipts: Mapping[str, Sequence[Receipt]], *, n: int = 0, version: int = 0
    ) -> None:
        self._store = store
        self._receipts = receipts
        self.n = n
        self.version = version

    def __getitem__(self, noun: str) -> Sequence[Receipt]:
        return self._receipts[noun]

    def __iter__(self) -> Iterator[str]:
        return iter(self._receipts)

    def __len__(self) -> int:
        return len(self._receipts)

    def table(self, noun: str, schema: type[Table]) -> pl.DataFrame:
        """The table of the only output of a noun.

        Raises:
            CorruptFile, SchemaMismatch: as for :meth:`pipeline.store.Store.read_table`.
        """
        (found,) = self.tables(noun, schema)
        return found

    def tables(self, noun: str, schema: type[Table]) -> Iterator[pl.DataFrame]:
        """The tables of all outputs of a noun, each read when its turn comes."""
        for receipt in self[noun]:
            yield self._store.read_table(receipt, schema.NAME, schema)

    def blob(self, noun: str, role: str) -> bytes | None:
        """A file other than a table, of the only output of a noun; None if there is none."""
        (found,) = self.blobs(noun, role)
        return found

    def blobs(self, noun: str, role: str) -> Iterator[bytes | None]:
        """A file other than a table, of each output of a noun."""
        for receipt in self[noun]:
            yield self._store.read(receipt, role) if role in receipt.files else None

    def details(self, noun: str) -> dict[str, Any]:
        """Details of the only output of a noun."""
        (receipt,) = self[noun]
        return receipt.details

    def where(self, noun: str, role: str) -> str:
        """Path of a file of the only output of a noun, for error messages."""
        (receipt,) = self[noun]
        return str(self._store.root / receipt.files[role].path)

    @property
    def pitch(self) -> Pitch:
        """The pitch of the match that the output is of."""
        return Pitch.model_validate(self.details("matches")["pitch"])


class Plan(NamedTuple):
    """The inputs of a version that may be made.

    Attributes:
        receipts: receipts by noun, for :class:`Inputs`.
        inputs: label to SHA-256, for the key.
        parent: the version that it follows or is made from, None for the first.
        standing: the version that already holds this work, None to look for it by the key.
        seed: seed of the work.
    """

    receipts: Mapping[str, Sequence[Receipt]]
    inputs: Mapping[str, str]
    parent: int | None = None
    standing: Manifest | None = None
    seed: int | None = None


@dataclass(frozen=True, slots=True)
class Stage:
    """How one noun is made from others.

    Attributes:
        noun: the stage.
        per: the unit that has one output.
        inputs: the nouns that it is made from, each once.
        schemas: schemas of the tables that it makes.
        version: raised when the stage makes other bytes from the same inputs; the goldens say when.
        compute: function from inputs and settings to tables; None if the noun has a flow of its own.
        plan: for a versioned noun, the function from store, scope, settings and stage to the inputs of
            the next version.
    """

    noun: str
    per: Per
    inputs: tuple[str | Longer, ...] = ()
    schemas: tuple[type[Table], ...] = ()
    version: int = 1
    compute: Callable[[Inputs, Any], Made] | None = None
    plan: Callable[[Store, Scope, Any, Stage], Plan] | None = None

    def settings(self, settings: Settings) -> BaseModel:
        """The settings of this stage among those of a run."""
        found = getattr(settings, self.noun)
        assert isinstance(found, BaseModel)
        return found

    def work(
        self, name: str, settings: BaseModel, inputs: Mapping[str, str], *, seed: int | None = None,
        through: Mapping[str, int] | None = None,
    ) -> Work:
        """The piece of work that makes an output from these inputs (label to SHA-256)."""
        return Work(
            noun=self.noun, name=name, settings=settings.model_dump(mode="json"), version=self.version,
            inputs=inputs, seed=seed, schemas=self.schemas, through=through or {},
        )

    def outputs(
        self, scope: Scope, matches: Sequence[str] | None = None, lengths: Sequence[int] | None = None
    ) -> list[Output]:
        """The outputs of this stage for a scope, or for some of its matches and lengths."""
        matches = scope.matches if matches is None else matches
        lengths = scope.lengths if lengths is None else lengths
        match self.per:
            case Per.MATCH:
                return [Output(match, match) for match in matches]
            case Per.GRAMS:
                return [Output(f"{match}.n{n}", match, n) for n in lengths for match in matches]
            case Per.ROUND:
                return [Output(scope.round(n), n=n) for n in lengths]
            case _:
                return []


class Wave(NamedTuple):
    """Outputs that can be made at once.

    Attributes:
        stage: the stage that makes them.
        lengths: their lengths of grams; None if the stage has no lengths.
    """

    stage: Stage
    lengths: tuple[int, ...] | None


class Chain(Mapping[str, Stage]):
    """Stages by noun, in the order in which they are made."""

    def __init__(self, *stages: Stage) -> None:
        self._stages = {stage.noun: stage for stage in stages}

    def __getitem__(self, noun: str) -> Stage:
        return self._stages[noun]

    def __iter__(self) -> Iterator[str]:
        return iter(self._stages)

    def __len__(self) -> int:
        return len(self._stages)

    def nouns(self, *per: Per) -> tuple[str, ...]:
        """The nouns with one output for each of these units, in order; all nouns if no unit is named."""
        return tuple(noun for noun, stage in self.items() if not per or stage.per in per)

    @property
    def of_matches(self) -> tuple[str, ...]:
        """The nouns whose outputs are of matches, in order."""
        return self.nouns(Per.MATCH, Per.GRAMS, Per.ROUND)

    @property
    def versioned(self) -> tuple[str, ...]:
        """The nouns that have immutable versions, in order."""
        return self.nouns(Per.VERSION)

    @property
    def receipted(self) -> tuple[str, ...]:
        """The nouns whose outputs have receipts, in order."""
        return tuple(noun for noun in self if noun not in self.versioned)

    def waves(self, scope: Scope) -> Iterator[Wave]:
        """The stages that are computed from matches, in order; stages with gram lengths take turns."""
        together: list[Stage] = []
        for noun in self.of_matches:
            stage = self[noun]
            if stage.compute is None:
                continue
            if stage.per is Per.MATCH:
                yield from self._by_length(together, scope)
                together = []
                yield Wave(stage, None)
            else:
                together.append(stage)
        yield from self._by_length(together, scope)

    @staticmethod
    def _by_length(together: Sequence[Stage], scope: Scope) -> Iterator[Wave]:
        if together:
            for n in scope.lengths:
                for stage in together:
                    yield Wave(stage, (n,))

    def sources(self, store: Store, stage: Stage, output: Output, scope: Scope) -> dict[str, list[Receipt]]:
        """The receipts that an output is made from, by noun.

        An input's outputs are taken if they have the same match and length, as far as both have one.

        Raises:
            NotFound: if one of them has not been made.
        """
        found: dict[str, list[Receipt]] = {}
        for each in stage.inputs:
            noun = each.noun if isinstance(each, Longer) else each
            lengths: tuple[int, ...] | None = None if output.n is None else (output.n,)
            if isinstance(each, Longer):
                assert output.n is not None
                lengths = tuple(n for n in scope.lengths if n > output.n)
            matches = None if output.match is None else (output.match,)
            found[noun] = [need(store, noun, o.name) for o in self[noun].outputs(scope, matches, lengths)]
        return found

    def work(
        self, store: Store, stage: Stage, output: Output, settings: BaseModel, scope: Scope
    ) -> tuple[Work, Inputs]:
        """An output as a piece of work, and what it is made from.

        Raises:
            NotFound: if one of its inputs has not been made.
        """
        receipts = self.sources(store, stage, output, scope)
        return stage.work(output.name, settings, digests(receipts)), Inputs(store, receipts, n=output.n or 0)

    def done(self, store: Store, stage: Stage, output: Output, settings: BaseModel, scope: Scope) -> bool:
        """Whether the store has an output that was made from the same inputs with the same settings."""
        try:
            return store.holding(self.work(store, stage, output, settings, scope)[0]) is not None
        except (NotFound, CorruptFile):
            return False

    def perform(self, store: Store, stage: Stage, output: Output, settings: BaseModel, scope: Scope) -> bool:
        """Make and commit an output. Returns whether its bytes are new.

        Raises:
            Exception: as :func:`refusing`.
        """
        with refusing(store, stage.noun, output.name):
            work, inputs = self.work(store, stage, output, settings, scope)
            assert stage.compute is not None
            before = _files(store, work)
            return store.commit(work, stage.compute(inputs, settings)).files != before

    def make(
        self, store: Store, settings: Settings, scope: Scope, nouns: Container[str] | None = None
    ) -> None:
        """Make all new outputs of a scope, one after the other, in this thread.

        Args:
            store: receives the outputs.
            settings: settings of all stages.
            scope: matches and lengths.
            nouns: the nouns to make; None: all.

        Raises:
            Exception: as :func:`refusing`; the first error ends the work.
        """
        for stage, lengths in self.waves(scope):
            if nouns is not None and stage.noun not in nouns:
                continue
            own = stage.settings(settings)
            for output in stage.outputs(scope, lengths=lengths):
                if not self.done(store, stage, output, own, scope):
                    self.perform(store, stage, output, own, scope)


class refusing:  # noqa: N801 (a context manager is used like a function)
    """Put an output in quarantine if the body fails, and take it out if the body succeeds.

    An error that may vanish when tried again, or a missing input, puts nothing in quarantine.

    Args:
        store: store of the output.
        noun: the stage.
        name: name of the output.

    Raises:
        Exception: whatever the body raised.
    """

    def __init__(self, store: Store, noun: str, name: str) -> None:
        self._store, self._noun, self._name = store, noun, name

    def __enter__(self) -> None:
        return None

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if error is None:
            self._store.release(self._noun, self._name)
        elif (isinstance(error, Exception) and not isinstance(error, NotFound)
              and not getattr(error, "transient", False)):
            self._store.quarantine(self._noun, self._name, error)


def emit(store: Store, stage: Stage, settings: BaseModel, scope: Scope) -> tuple[Manifest, bool]:
    """Make the next version of a noun, unless a version holds the same. Returns it, and whether it is new.

    The noun is locked meanwhile: two runs at once make one version, and no version comes between another
    and its parent. If the work gives the tables of the newest version again, no version is made.

    Raises:
        Exception: whatever planning or computing raised.
    """
    assert stage.plan is not None
    assert stage.compute is not None
    with store.locked(stage.noun):
        plan = stage.plan(store, scope, settings, stage)
        work = stage.work(stage.noun, settings, plan.inputs, seed=plan.seed)
        standing = plan.standing or store.standing(work)
        if standing is not None:
            return standing, False
        with store.claim(stage.noun) as version:
            made = stage.compute(Inputs(store, plan.receipts, version=version), settings)
            newest = store.latest(stage.noun)
            if newest is not None and _holds(store, newest, work, made):
                store.confirm(work, newest.version)
                return newest, False
            return store.commit_version(work, made, version, parent=plan.parent), True


def _holds(store: Store, version: Manifest, work: Work, made: Made) -> bool:
    """Whether a version has the same inputs and the same tables, except for its own number."""
    return version.inputs == dict(work.inputs) and all(
        store.read_table(version, schema.NAME, schema).drop("version").equals(table.drop("version"))
        for table, schema in made.tables
    )


def digests(receipts: Mapping[str, Sequence[Receipt]]) -> dict[str, str]:
    """SHA-256 of all files of some outputs, labelled ``noun/name/role``."""
    found: dict[str, str] = {}
    for each in receipts.values():
        for receipt in each:
            found |= receipt.digests()
    return found


def need(store: Store, noun: str, name: str) -> Receipt:
    """The receipt of an output that a stage is made from.

    Raises:
        NotFound: if it has not been made.
    """
    receipt = store.receipt(noun, name)
    if receipt is None:
        raise NotFound(f"{noun} of {name} have not been made", where=str(store.root),
                       next_step=f"Run the stage {noun} first (`pitchlore run` runs them all)")
    return receipt


def match_names(store: Store) -> list[str]:
    """The ids of all matches in the store, sorted."""
    return [receipt.name for receipt in store.receipts("matches")]


def _files(store: Store, work: Work) -> object:
    """The files that an output's receipt names now, None if there is none that can be read."""
    try:
        receipt = store.receipt(work.noun, work.name)
    except CorruptFile:
        return None
    return receipt and receipt.files
