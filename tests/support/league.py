"""A league with pages, made once for all processes of a session."""

import shutil
from pathlib import Path
from typing import Any

import polars as pl
import pytest
from conftest import clip
from support.sessions import once

from pitchlore.pipeline.engine.matches import take_in
from pitchlore.pipeline.engine.recordings import Recording
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.update import scope_of
from pitchlore.pipeline.engine.versions import emit
from pitchlore.pipeline.settings import PolicySettings, Settings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.views.scout.content.write import WrittenPages, write_pages

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
HOSTILE = "<script>document.title='taken'</script> \"'&"


def league(folder: Path) -> Store:
    """A league of two matches of the sample's first minutes; one team has a hostile name."""
    store = Store(folder)
    for name, start in (("one", 0.0), ("two", 120.0)):
        table = clip(start, start + 60.0)
        if name == "two":
            table = table.with_columns(pl.col("team").replace("yellow", HOSTILE))
        (folder / "inbox").mkdir(parents=True, exist_ok=True)
        table.write_parquet(folder / "inbox" / f"{name}.parquet")
        take_in(store, Recording(file=folder / "inbox" / f"{name}.parquet"))
    bring(store)
    return store


def bring(store: Store, settings: Settings = Settings(policies=PolicySettings(learner="sarsa"))) -> None:
    """Make all outputs and a version of the knowledge."""
    STAGES.make(store, settings, scope := scope_of(store))
    emit(store, STAGES["knowledge"], STAGES["knowledge"].settings(settings), scope)


def shared(tmp_path_factory: pytest.TempPathFactory) -> Store:
    """The league with its pages. Tests read it; one that changes it takes :func:`copied`."""
    return Store(once(tmp_path_factory, "league", lambda folder: write_pages(league(folder))))


def copied(tmp_path_factory: pytest.TempPathFactory) -> Store:
    """A copy of the league without pages."""
    folder = tmp_path_factory.mktemp("copied") / "data"
    shutil.copytree(shared(tmp_path_factory).root, folder, ignore=shutil.ignore_patterns("scout*"))
    return Store(folder)


def gallery(pages: WrittenPages) -> Path:
    """A page of behaviours that has clips."""
    return next(found for found in sorted((pages.first.parent / "behaviours").iterdir()) if "data-match" in found.read_text())


def serious(page: Any, scheme: str) -> list[str]:
    """Serious and critical findings of axe on a page; in the dark scheme contrast alone can be another.

    Of cards and rows that are alike, the first ones are looked at: hundreds take axe half a minute.
    """
    from axe_core_python.sync_playwright import Axe

    page.evaluate("""for (const each of ["article.card", "tbody tr", "svg.pitch .mark", ".heat", "figure.clip"])
        for (const holder of new Set([...document.querySelectorAll(each)].map((it) => it.parentNode)))
          [...holder.querySelectorAll(`:scope > ${each.split(" ").pop()}`)].slice(6).forEach((it) => it.remove())""")
    options = {"resultTypes": ["violations"], **({"runOnly": ["color-contrast"]} if scheme == "dark" else {})}
    return [f"{page.url}: {each['id']}: {each['nodes'][0]['html'][:120]}"
            for each in Axe().run(page, options=options)["violations"] if each["impact"] in ("serious", "critical")]
