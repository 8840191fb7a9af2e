"""The ratios that are shipped: how much more probable a motion is with one option than with others.

``make study-options`` (some minutes of it) plays teams that deal options at random, with and without a
camera's noise, seen at 60 and at 30 Hz, and fits the trees. No team that is reported on has played. If the
file changes, raise the version of the stage options; ``make golden`` says so.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from harness import ROOT, workers
from options.dealt import Job, rows
from sklearn.ensemble import HistGradientBoostingClassifier

from pitchlore.pipeline.numbers.arrays import F32, F64
from pitchlore.pipeline.numbers.trees import arrays_of
from pitchlore.pipeline.stages.options.likelihood import ratios_to_bytes

MATCHES, SECONDS, _FIRST_SEED = 160, 120.0, 430_000
_TREES, _LEAVES, _LEAF_SAMPLES = 60, 255, 100


def main(
    path: Path, matches: int = MATCHES, seconds: float = SECONDS, trees: int = _TREES,
    first: int = _FIRST_SEED, described: Callable[[Job], tuple[F32, F64]] = rows,
) -> None:  # fmt: skip
    """Write the trees; ``first`` is the first match's seed, ``described`` plays and describes a match."""
    jobs = [Job(first + i, noisy=i // 2 % 2 == 1, every=1 + i // 4 % 2, seconds=seconds)
            for i in range(matches)]
    with workers() as pool:
        parts = list(pool.map(described, jobs))
    features, labels = (np.concatenate(each) for each in zip(*parts, strict=True))
    print(f"{len(labels):,} descriptions of {int(labels.sum()):,} windows")
    builder = HistGradientBoostingClassifier(  # type: ignore[no-untyped-call]
        max_iter=trees, learning_rate=0.3, max_leaf_nodes=_LEAVES, min_samples_leaf=_LEAF_SAMPLES,
        l2_regularization=2.0, early_stopping=False, random_state=0)
    found = arrays_of(builder.fit(features, labels))
    path.write_bytes(ratios_to_bytes(found))
    print(f"{len(found.start)} trees, {len(found.left):,} nodes, {path.stat().st_size / 1024:.0f} KiB")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "pipeline" / "stages" / "options" / "shipped.npz")
