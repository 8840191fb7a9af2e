"""`pitchlore record`: what it leaves behind when it is killed."""

from __future__ import annotations

import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from flows.cli import main
from pipeline import matches
from pipeline.play.match import Match
from pipeline.play.minds import mind_of
from pipeline.play.recipe import Recipe, TeamSettings
from pipeline.store import Store
from pipeline.world.laws import RefereeSettings
from schemas import Matches

#: Of a match that is certainly not over when it is killed.
MINUTES = 100
RECORD = "import sys; from flows.cli import main; main(sys.argv[1:])"
CHUNKS = 300_000  # bytes


@pytest.fixture(scope="module")
def killed(tmp_path_factory):
    """A data folder in which a match was killed as it was played."""
    data = tmp_path_factory.mktemp("killed")
    words = ["record", "--home", "static", "--away", "static", "--minutes", MINUTES, "--data", data]
    with subprocess.Popen([sys.executable, "-c", RECORD, *map(str, words)]) as process:
        try:
            deadline = time.monotonic() + 120
            while not any(file.stat().st_size > CHUNKS for file in (data / "playing").glob("*.mcap")):
                assert process.poll() is None, "it ended before it could be killed"
                assert time.monotonic() < deadline
                time.sleep(0.01)
        finally:
            process.kill()
    assert process.returncode == -signal.SIGKILL
    return data


def test_kill_9_while_a_match_is_played_and_the_next_run_takes_what_was_played(killed, prefect_server):
    store = Store(killed)
    assert not list(store.receipts("matches"))
    with pytest.raises(SystemExit) as left:
        main(["run", "--data", str(killed)])
    assert left.value.code == 0
    (receipt,) = store.receipts("matches")
    row = store.read_table(receipt, "matches", Matches).row(0, named=True)
    assert not row["complete"]
    assert 10.0 < row["duration_s"] < 60 * MINUTES
    assert store.receipt("situations", receipt.name) is not None
    assert not store.quarantined()

    static = TeamSettings(kind="static")
    recipe = Recipe(home=static, away=static, seed=1, referee=RefereeSettings(duration_s=60 * MINUTES))
    assert receipt.name == recipe.match_id
    salvaged = matches.read(store.read(receipt, "log"), where="salvaged").frames
    again = Match(recipe, (mind_of(static, recipe, 0), mind_of(static, recipe, 1)))
    again.advance(len(salvaged))
    played = again.take().frames
    assert salvaged.ball.tobytes() == played.ball.tobytes()
    for name in played.robots.dtype.names:
        np.testing.assert_array_equal(salvaged.robots[name], played.robots[name])
