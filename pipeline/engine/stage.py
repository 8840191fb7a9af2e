"""A stage: its unit, its inputs, its outputs for a scope."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any, NamedTuple

from pydantic import BaseModel, ConfigDict

from pitchlore.pipeline.engine.inputs import Inputs
from pitchlore.pipeline.settings import Settings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Manifest, Receipt
from pitchlore.pipeline.store.work import Made, Work
from pitchlore.schemas import Table

#: Name of the output of a group, where the group is all matches of the store.
ALL = "all"


class Scope(BaseModel):
    """The matches of a run.

    Attributes:
        matches: ids of the matches, sorted.
        group: None if behaviours are selected from all matches of the store; else the id of the group
            they are selected from. With groups, learning from a new match always costs the same.
        without: ids of matches that are there and left out: damaged, or refused by a stage. What is made of
            the others says so.
    """

    model_config = ConfigDict(frozen=True)

    matches: tuple[str, ...]
    group: str | None = None
    without: tuple[str, ...] = ()

    def but(self, dropped: Collection[str | None]) -> Scope:
        """The scope without some of its matches."""
        left = tuple(match for match in self.matches if match not in dropped)
        gone = {*self.without, *self.matches} - {*left}
        return self.model_copy(update={"matches": left, "without": tuple(sorted(gone))})

    def of(self, output: Output) -> Scope:
        """The part of the scope that decides an output: its match, if it has one."""
        return self if output.match is None else self.model_copy(update={"matches": (output.match,)})

    @property
    def name(self) -> str:
        """Name of an output that is of all matches of the scope."""
        return self.group or ALL


class Output(NamedTuple):
    """One output of a stage.

    Attributes:
        name: unique in its noun.
        match: its match, None if it is of all matches of the scope.
    """

    name: str
    match: str | None = None


class Per(Enum):
    """The unit for which a stage has one output."""

    MATCH = "match"
    GROUP = "group of matches"
    VERSION = "version"
    OWN = "piece of work of a flow of its own"


class Plan(NamedTuple):
    """The inputs of a version that may be made.

    Attributes:
        receipts: receipts by noun, for :class:`pipeline.engine.inputs.StoreInputs`.
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
        choose: for a noun with one output a group, the function from store, output, scope and settings to the
            matches of the scope that it is made from; None: all.
        plan: for a versioned noun, the function from store, scope, settings and stage to the inputs of
            the next version.
        told: whether people are told of it and nothing is learned from it: seasons do without.
    """

    noun: str
    per: Per
    inputs: tuple[str, ...] = ()
    schemas: tuple[type[Table], ...] = ()
    version: int = 1
    compute: Callable[[Inputs, Any], Made] | None = None
    plan: Callable[[Store, Scope, Any, Stage], Plan] | None = None
    choose: Callable[[Store, Output, Scope, Any], tuple[str, ...]] | None = None
    told: bool = False

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

    def outputs(self, scope: Scope, matches: Sequence[str] | None = None) -> list[Output]:
        """The outputs of this stage for a scope, or for some of its matches."""
        match self.per:
            case Per.MATCH:
                return [Output(match, match) for match in (scope.matches if matches is None else matches)]
            case Per.GROUP:
                return [Output(scope.name)]
            case _:
                return []
