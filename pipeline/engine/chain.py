"""The chain of stages: the order, what an output is made from, how it is made."""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping
from itertools import chain, groupby

from pydantic import BaseModel

from pitchlore.pipeline.base.errors import CorruptFile, NotFound
from pitchlore.pipeline.engine.inputs import Seen, StoreInputs
from pitchlore.pipeline.engine.outputs import digests, need, refusing
from pitchlore.pipeline.engine.stage import Output, Per, Scope, Stage
from pitchlore.pipeline.settings import Settings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Receipt
from pitchlore.pipeline.store.work import Work


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
        return self.nouns(Per.MATCH, Per.GROUP)

    @property
    def learned(self) -> tuple[str, ...]:
        """The nouns of matches without those that people alone are told, in order."""
        return tuple(noun for noun in self.of_matches if not self[noun].told)

    @property
    def versioned(self) -> tuple[str, ...]:
        """The nouns that have immutable versions, in order."""
        return self.nouns(Per.VERSION)

    @property
    def receipted(self) -> tuple[str, ...]:
        """The nouns whose outputs have receipts, in order."""
        return tuple(noun for noun in self if noun not in self.versioned)

    def computed(self) -> Iterator[Stage]:
        """The stages that are computed from matches, in order."""
        return (self[noun] for noun in self.of_matches if self[noun].compute is not None)

    def stage_groups(self) -> Iterator[tuple[Stage, ...]]:
        """The computed stages in groups: neighbours of matches make one, any other stage is its own.

        The outputs of a group for a match depend on no other match but by the groups before.
        """
        for of_match, group in groupby(self.computed(), lambda stage: stage.per is Per.MATCH):
            stages = tuple(group)
            yield from [stages] if of_match else [(stage,) for stage in stages]

    def sources(
        self, store: Store, stage: Stage, output: Output, settings: BaseModel, scope: Scope
    ) -> dict[str, list[Receipt]]:
        """The receipts that an output is made from, by noun.

        An input's outputs are taken if they have the same match, as far as both have one. A stage may choose
        among the matches of a group.

        Raises:
            NotFound: if one of them has not been made.
        """
        matches: tuple[str, ...] | None = None if output.match is None else (output.match,)
        if stage.choose is not None:
            matches = stage.choose(store, output, scope, settings)
        return {noun: [need(store, noun, each.name) for each in self[noun].outputs(scope, matches)]
                for noun in stage.inputs}

    def work(
        self, store: Store, stage: Stage, output: Output, settings: BaseModel, scope: Scope,
        seen: Seen | None = None,
    ) -> tuple[Work, StoreInputs]:
        """An output as a piece of work, and what it is made from; ``seen`` as for :class:`StoreInputs`.

        Raises:
            NotFound: if one of its inputs has not been made.
        """
        receipts = self.sources(store, stage, output, settings, scope)
        return stage.work(output.name, settings, digests(receipts)), StoreInputs(store, receipts, seen=seen)

    def done(self, store: Store, stage: Stage, output: Output, settings: BaseModel, scope: Scope) -> bool:
        """True if the store has an output that was made from the same inputs with the same settings."""
        try:
            return store.holding(self.work(store, stage, output, settings, scope)[0]) is not None
        except (NotFound, CorruptFile):
            return False

    def perform(
        self, store: Store, stage: Stage, output: Output, settings: BaseModel, scope: Scope,
        seen: Seen | None = None,
    ) -> bool | None:
        """Make and commit an output. Returns whether its bytes are new, None if it was done before.

        Args:
            store: receives the output.
            stage: stage of the output.
            output: to make.
            settings: settings of the stage.
            scope: its matches.
            seen: as for :class:`StoreInputs`.

        Raises:
            Exception: as :func:`refusing`.
        """
        with refusing(store, stage.noun, output.name):
            work, inputs = self.work(store, stage, output, settings, scope, seen)
            if store.holding(work) is not None:
                return None
            assert stage.compute is not None
            before = _files(store, work)
            made = stage.compute(inputs, settings)
            receipt = store.commit(work, made, chain.from_iterable(inputs.receipts.values()))
            if seen is not None:
                seen |= {receipt.files[schema.NAME].sha256: frame.rechunk() for frame, schema in made.tables}
            return receipt.files != before

    def make(
        self, store: Store, settings: Settings, scope: Scope, nouns: Container[str] | None = None
    ) -> None:
        """Make all new outputs of a scope, one after the other, in this thread.

        Args:
            store: receives the outputs.
            settings: settings of all stages.
            scope: its matches.
            nouns: the nouns to make; None: all.

        Raises:
            Exception: as :func:`refusing`; the first error ends the work.
        """
        for stage in self.computed():
            if nouns is not None and stage.noun not in nouns:
                continue
            own = stage.settings(settings)
            for output in stage.outputs(scope):
                if not self.done(store, stage, output, own, scope):
                    self.perform(store, stage, output, own, scope)


def _files(store: Store, work: Work) -> object:
    """The files that an output's receipt names now, None if there is none that can be read."""
    receipt = store.readable(work.noun, work.name)
    return receipt and receipt.files
