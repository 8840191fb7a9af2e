"""What a version of the knowledge was made of, through all versions that it adds to."""

from collections.abc import Iterator

from pipeline.store import Store
from pipeline.store.receipts import Manifest


def lineage(store: Store, knowledge: Manifest | None) -> Iterator[Manifest]:
    """A version of the knowledge and those that it adds to, the newest first.

    Raises:
        NotFound: if one of them is gone.
    """
    while knowledge is not None:
        yield knowledge
        adds_to = knowledge.parent if knowledge.settings.get("accumulate", False) else None
        knowledge = None if adds_to is None else store.manifest("knowledge", adds_to)


def matches_of(knowledge: Manifest) -> list[str]:
    """The matches whose decisions a version names itself, sorted."""
    labels = (label.split("/") for label in knowledge.inputs)
    return sorted({label[1] for label in labels if label[0] == "decisions"})
