"""The study of teams from recordings runs: copies, controls, wheels, two tables; what was done is kept."""

from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import harness
import numpy as np
import polars as pl
import pytest
from from_recordings import everything, executed, gain, psim, rebuilt, recovered, sets, study, wheels
from options import motion, rolling
from peers.network import load

from pitchlore.pipeline import matches
from pitchlore.pipeline.arena.env import BEHAVIOURS
from pitchlore.pipeline.arena.match import sighted
from pitchlore.pipeline.arena.match.recipe import MatchSettings
from pitchlore.pipeline.game.pitch import Kind, Pitch
from pitchlore.pipeline.settings import GramSettings, OptionSettings
from pitchlore.pipeline.stages.options.windows import Bodies
from pitchlore.pipeline.stages.sequences.sights import sights
from pitchlore.schemas import ROLES, Values

PITCH = Pitch(kind=Kind.VSSS, length=1.5, width=1.3, goal_width=0.4)


def test_tables(tmp_path, monkeypatch):
    """A constant team is copied; copies and controls play static; the motion of its robots is foretold."""
    monkeypatch.setattr(study, "workers", lambda: ThreadPoolExecutor(1))
    small = study.Study(tmp_path / "data", recorded=(2,), pairs=2, seconds=10.0)
    table = study.main(small, tmp_path, teams=("best-constant",))
    assert table["team"].to_list() == [
        "copy, knowledge emptied", "itself", "copy", "run by default", "copy, noisy camera", "recognised codes, Sarsa", "behaviours of options, Sarsa", "behaviours of options, usual kept, Sarsa", "copy, clues shuffled",
        "copy, options known", "copy, options known, and V", "wheel clone"]
    assert table["recordings"].to_list() == [0, 0, *[2] * 10]
    assert table["matches"].unique().to_list() == [4]
    assert study.main(small, tmp_path, teams=("best-constant",)).equals(table)
    monkeypatch.setattr(sets, "workers", study.workers)
    of_sets = sets.main(small, tmp_path, ("best-constant",), of_set=1)
    assert of_sets["recordings"].to_list() == ["0 to 0", "1 to 1", "all sets"]
    first, second, whole = of_sets["difference"]
    assert whole == pytest.approx((first + second) / 2, abs=0.01)
    assert of_sets["between"][2] == pytest.approx(abs(first - second) / 2**0.5, abs=0.02)
    ahead = motion.main(small, tmp_path / "motion.csv", ("best-constant",), count=1, foretell=1, sample=None)
    assert ahead["by"].n_unique() == 6
    assert ahead["by"].len() == 18
    of_way = ahead.pivot("seconds", index="by", values="cm")
    assert (of_way["0.1"] < of_way["0.5"]).all()


@pytest.mark.parametrize("away", [False, True])
def test_the_network_logs_what_it_chose(away, tmp_path):
    """At each of its decisions the log has what the network chooses by the poses there, and in 0.2 s the next one."""
    path = tmp_path / "match.mcap"
    study.recorded(study.Job("", study.PPO, 7, away, False, 20.0), path)
    log, made = matches.read(path.read_bytes(), where=path.name), pl.read_parquet(executed.decisions_beside(path))
    assert made["team"].unique().to_list() == ["away" if away else "home"]
    assert made.filter(pl.col("ends").is_null()).select(pl.col("end_ns") - pl.col("t_ns")).to_series().unique().to_list() == [200_000_000]
    seen = sights(replace(log, decisions=made), Values.empty(), GramSettings())
    vectors = np.hstack([seen["sight"].to_numpy(), np.eye(len(ROLES))[seen["role"].to_physical()]]).astype(np.float32)
    for row in vectors:
        sighted.scale(row[:30], sighted.scales(MatchSettings()))
    chosen = load(study.FOLDER / f"{study.PPO}.npz").choose(vectors)
    code = made["behaviour_id"].str.tail(3).fill_null("194").cast(pl.Int64)
    assert (np.array(BEHAVIOURS)[chosen] == code.to_numpy()).mean() > 0.99, "the log rounds"


def test_in_psim(tmp_path, monkeypatch):
    """A team is recorded there and copied; rows of teams that are not played stay. Here our arena stands in for pSim."""
    monkeypatch.setattr(psim, "moving", lambda python: nullcontext(lambda match: None))
    monkeypatch.setattr(psim, "workers", lambda: ThreadPoolExecutor(1))
    monkeypatch.setattr(psim, "TRIED", ("best-constant",))
    small = study.Study(tmp_path / "data", recorded=(2,), pairs=2, seconds=20.0)
    for job, path in small.recordings("best-constant", False):
        study.recorded(job, path)
    pl.DataFrame({"demonstrator": ["best-constant", "other"], "team": "itself", "matches": 4, "difference": [9.0, 9.0],
                  "low": 8.5, "high": 9.5}).write_csv(tmp_path / "psim.csv")
    psim.main("python", small, tmp_path, ("best-constant",))
    table = pl.read_csv(tmp_path / "psim.csv")
    assert table["team"].to_list() == [
        "itself", "itself", "copy, recorded in our arena", "copy, recorded in pSim", "copy, recorded in pSim, clues shuffled",
        "copy, recorded in pSim, its robots known", psim.COPY, psim.CONTROL, "copy, recorded in pSim, options known", psim.AHEAD]
    assert table["demonstrator"].to_list() == ["other", *["best-constant"] * 9]
    assert table["difference"][:2].to_list() == [9.0, np.mean([
        study.ahead(study.Job(str(small.data), "best-constant", seed, away, False, 20.0)) for seed in (psim.FIRST_PLAYED, psim.FIRST_PLAYED + 1) for away in (False, True)])]
    differences = dict(table[1:].select("team", "difference").iter_rows())
    assert differences[psim.AHEAD] == pytest.approx(differences[psim.COPY] - differences[psim.CONTROL], abs=0.02)
    found = recovered.main(small.data, tmp_path, count=2)
    assert found.select("demonstrator", "recorded in", "executors drive", "options").n_unique() == found.height == 5 * 2
    told = found.filter(options="classes")["recovered"].to_list()
    assert min(*told[:3], told[4]) > told[3] + 0.2, "here all robots drive as ours"
    assert found["shuffled"].abs().max() < 0.1


def test_everything(tmp_path, monkeypatch, capsys):
    """One command says its hours, runs each part once and in order, and goes on at the part that failed; without pSim it says so."""
    ran = []

    def run(words, check):
        if words[1:] == ["-c", "import pSim"]:
            return SimpleNamespace(returncode=int(words[0] == "true"))
        ran.append(Path(words[1]))
        return SimpleNamespace(returncode=int(len(ran) == 4))

    monkeypatch.setattr(everything, "subprocess", SimpleNamespace(run=run))
    for bare in ("true", "no-such-python"):
        with pytest.raises(SystemExit, match=f"PSIM={bare} is no Python that has pSim"):
            everything.main(bare, tmp_path, tmp_path)
    with pytest.raises(SystemExit, match=r"psim\.py ended with 1: mend .* goes on there"):
        everything.main("python", tmp_path, tmp_path)
    assert "7.0 h on two free cores" in capsys.readouterr().out
    everything.main("python", tmp_path, tmp_path)
    assert [path.stem for path in ran] == ["study", "sets", "motion", "psim", "psim", "recovered", "rebuilt", "gain"]
    assert all(path.exists() for path in ran)
    everything.main("-", tmp_path, tmp_path)
    assert "psim" not in [path.stem for path in ran[8:]]
    assert len(ran) == 14
    assert "without pSim" in capsys.readouterr().out


def test_gain(tmp_path, monkeypatch, call):
    """Seasons that start as the copy, from nothing, and from shuffled habits are in the table, and what each needs."""
    (settings := tmp_path / "tiny.toml").write_text(
        'base = "looking-held"\npractice = 0\nexplore_counted = true\n[referee]\nduration_s = 10\n')
    monkeypatch.setattr(harness, "settings_file", lambda _: settings)
    monkeypatch.setattr(harness, "command", lambda *words: ended.append(call(*words)[0]))
    ended: list[int] = []
    small = study.Study(tmp_path / "data", recorded=(1,), pairs=1, seconds=20.0)
    table = gain.main(small, tmp_path, "tiny", seeds=(1,), controls=(1,), games=2, teacher="best-constant")
    assert table.select("starts", "seed", "game").rows() == [
        (start, 1, game) for start in ("as the copy", "from nothing", "from shuffled habits") for game in (1, 2)]
    assert ended == [0, 0, 0]
    assert table.columns == pl.read_csv(gain.FOLDER / "gain.csv").columns
    assert (gain.needed([4, 6, 5]), gain.needed([6, 4, 5]), gain.needed([1, 2, 9]), gain.needed([1, 2])) == (0, 0, 10, None)


def test_wheels_are_told_from_motion(tmp_path):
    """A rim that follows has its command's speed; of one that changes as fast as it can the side is known."""
    settings, frames, rng = OptionSettings(), 900, np.random.default_rng(0)
    ahead, turn = (np.repeat(rng.uniform(-most, most, frames // 30), 30) for most in (0.6, 0.1))
    told = np.column_stack([ahead - turn, ahead + turn])
    view, rims, places = np.zeros((3, 6)), np.zeros(2), np.zeros((frames, 3, 6))
    view[2] = 9.0  # far away
    for frame in range(frames):
        places[frame] = view
        rolling.go_on(view, 1, rims, told[max(frame - 1, 0)], 0.1, settings.axle, 1 / 60)
    t_ns, play = (np.arange(frames) * 1e9 / 60).astype(np.int64), np.zeros(frames, dtype=np.int64)
    found = wheels.samples(Bodies(t_ns, play, places, ((1,), (1,))), 0, PITCH, settings)
    whole, mirrored = (
        wheels.Samples(*each) for each in zip(*(np.split(column, 2) for column in found), strict=True))
    was, side = told[:len(whole.rims) * wheels.EVERY:wheels.EVERY], whole.beyond
    assert 0.7 < (side == 0.0).mean() < 0.9
    assert np.abs(whole.rims - was)[side == 0.0].max() < 2e-3
    assert ((was - whole.rims) * side)[side != 0.0].min() > -0.1
    assert np.allclose(mirrored.rims, whole.rims[:, ::-1])
    clone = wheels.fit(found, hidden=(16,), passes=1)
    clone.write(tmp := tmp_path / "clone.npz")
    assert np.array_equal(wheels.Clone.read(tmp)(found.seen), clone(found.seen))


def test_rebuilt(tmp_path, monkeypatch):
    """Policies play an original and its copy, and matches are described: a row for each comparison."""
    monkeypatch.setattr(rebuilt, "workers", lambda: ThreadPoolExecutor(1))
    small = study.Study(tmp_path / "data", recorded=(1,), seconds=10.0)
    sizes = rebuilt.Rebuilt(small, ("static", "constant:044", "random"), pairs=1, described=2, minutes=0.1, halvings=2)
    tables = rebuilt.main(sizes, tmp_path, ("best-constant", "static"))
    assert tables["rebuilt-leads"].height == 2 * 3 * 3
    assert tables["rebuilt"].group_by("demonstrator").len()["len"].to_list() == [3, 3]
    assert tables["rebuilt-told"].height == 2 * len(rebuilt.DESCRIPTIONS)


def test_told():
    """Teams of other habits are always told apart, halves of one team are not; leads of one order are correlated."""
    rng = np.random.default_rng(0)
    one, same, other = (rng.normal(mean, 1, (40, 5)) for mean in (0, 0, 9))
    assert rebuilt.told(one, other, rng) == 1.0
    assert rebuilt.told(one, same, rng) == pytest.approx(0.5, abs=0.1)
    leads = np.arange(10.0)
    assert rebuilt.correlation(leads, leads**3) == pytest.approx({"spearman": 1, "low": 1, "high": 1})
    found = rebuilt.correlation(leads, np.array([1, 0, 3, 2, 5, 4, 7, 6, 9, 8]))
    assert found["spearman"] == pytest.approx(1 - 6 * 10 / 990)
    assert found["low"] < found["spearman"] < found["high"] <= 1
