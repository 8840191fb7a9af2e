"""The chain of stages: the order, what an output is made from, how it is made."""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping, Sequence
from itertools import chain
from typing import NamedTuple

from pydantic import BaseModel

from flows.outputs import digests, need, refusing
from flows.stage import Inputs, Longer, Output, Per, Scope, Stage
from pipeline.errors import CorruptFile, NotFound
from pipeline.settings import Settings
from pipeline.store import Store
from pipeline.store.receipts import Receipt
from pipeline.store.work import Work


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
        return self.nouns(Per.MATCH, Per.GROUP, Per.GRAMS, Per.ROUND)

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
            if stage.per in (Per.MATCH, Per.GROUP):
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

    def sources(
        self, store: Store, stage: Stage, output: Output, settings: BaseModel, scope: Scope
    ) -> dict[str, list[Receipt]]:
        """The receipts that an output is made from, by noun.

        An input's outputs are taken if they have the same match and length, as far as both have one. A
        stage may choose among the matches of a group.

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
            matches: tuple[str, ...] | None = None if output.match is None else (output.match,)
            if stage.choose is not None:
                matches = stage.choose(store, output, scope, settings)
            found[noun] = [need(store, noun, o.name) for o in self[noun].outputs(scope, matches, lengths)]
        return found

    def work(
        self, store: Store, stage: Stage, output: Output, settings: BaseModel, scope: Scope
    ) -> tuple[Work, Inputs]:
        """An output as a piece of work, and what it is made from.

        Raises:
            NotFound: if one of its inputs has not been made.
        """
        receipts = self.sources(store, stage, output, settings, scope)
        return stage.work(output.name, settings, digests(receipts)), Inputs(store, receipts, n=output.n or 0)

    def done(self, store: Store, stage: Stage, output: Output, settings: BaseModel, scope: Scope) -> bool:
        """Whether the store has an output that was made from the same inputs with the same settings."""
        try:
            return store.holding(self.work(store, stage, output, settings, scope)[0]) is not None
        except (NotFound, CorruptFile):
            return False

    def perform(self, store: Store, stage: Stage, output: Output, settings: BaseModel, scope: Scope) -> bool:
        """Make and commit an output, unless it is done. Returns whether its bytes are new.

        Raises:
            Exception: as :func:`refusing`.
        """
        with refusing(store, stage.noun, output.name):
            work, inputs = self.work(store, stage, output, settings, scope)
            if store.holding(work) is not None:  # by another command, or by a task that was tried before
                return True
            assert stage.compute is not None
            before = _files(store, work)
            made = stage.compute(inputs, settings)
            return store.commit(work, made, chain.from_iterable(inputs.values())).files != before

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


def _files(store: Store, work: Work) -> object:
    """The files that an output's receipt names now, None if there is none that can be read."""
    try:
        receipt = store.receipt(work.noun, work.name)
    except CorruptFile:
        return None
    return receipt and receipt.files
