"""The next version of a noun."""

from __future__ import annotations

import json
from dataclasses import replace

from pydantic import BaseModel

from pitchlore.pipeline.base.errors import CorruptFile, Overtaken
from pitchlore.pipeline.engine.inputs import StoreInputs
from pitchlore.pipeline.engine.stage import Plan, Scope, Stage
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Manifest
from pitchlore.pipeline.store.work import Made, Work

#: Detail of a version: matches and versions that it was made without, because they are damaged or refused.
WITHOUT = "without"


def emit(store: Store, stage: Stage, settings: BaseModel, scope: Scope) -> tuple[Manifest, bool]:
    """Make the next version of a noun, unless a version holds the same. Returns it, and whether it is new.

    The noun is locked meanwhile: two runs at once make one version, and no version comes between another
    and its parent. If the work gives the tables of the newest version again, no version is made. If another
    machine makes the version first, this one is planned and made anew, after it.

    Raises:
        Exception: whatever planning or computing raised.
    """
    lost = 0
    while True:
        with store.claim(stage.noun) as version:
            try:
                return _next(store, stage, settings, scope, version)
            except Overtaken:
                if version == lost:  # the bucket neither has the version nor takes it
                    raise
                lost = version


def _next(
    store: Store, stage: Stage, settings: BaseModel, scope: Scope, version: int
) -> tuple[Manifest, bool]:
    """The version of a number, unless one holds the same; and whether it is new."""
    assert stage.plan is not None
    assert stage.compute is not None
    plan = stage.plan(store, scope, settings, stage)
    work = stage.work(stage.noun, settings, plan.inputs, seed=plan.seed)
    standing = plan.standing or store.standing(work)
    if standing is not None:
        return standing, False
    made = stage.compute(StoreInputs(store, plan.receipts, version=version), settings)
    if without := _left_out(store, stage, scope, plan):
        made = replace(made, details={**made.details, WITHOUT: without})
    newest = store.newest_whole(stage.noun)
    if newest is not None and _holds(store, newest, work, made):
        store.confirm(work, newest.version)
        return newest, False
    return store.commit_version(work, made, version, parent=plan.parent), True


def _left_out(store: Store, stage: Stage, scope: Scope, plan: Plan) -> list[str]:
    """The matches and versions that would count for the next version, but are left out or damaged."""
    found = {*scope.without}
    for knowledge in plan.receipts.get("knowledge", ()):
        found.update(knowledge.details.get(WITHOUT, ()))
    for noun in {stage.noun, "knowledge"}:
        every = list(store.tried_versions(noun))
        while every and isinstance(every[-1][1], CorruptFile):  # the newest one that is whole was taken
            found.add(f"{noun} version {every.pop()[0]}")
    return sorted(found)


def _holds(store: Store, version: Manifest, work: Work, made: Made) -> bool:
    """True if a version has the same inputs, tables and details, except for its own number."""
    same = version.inputs == dict(work.inputs) and version.details == json.loads(json.dumps(made.details))
    return same and all(
        schema.NAME in version.files  # an older version has fewer tables
        and store.read_table(version, schema.NAME, schema).drop("version").equals(table.drop("version"))
        for table, schema in made.tables
    )
