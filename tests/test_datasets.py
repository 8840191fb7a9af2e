"""Datasets: decisions for Minari, frames for LeRobot. Both are loaded by their libraries, and equal the tables."""

import json
import os
import re
import subprocess
import sys
from functools import partial
from importlib.util import find_spec

import minari
import numpy as np
import polars as pl
import pyarrow.dataset
import pyarrow.parquet as pq
import pytest
from conftest import clip
from polars.testing import assert_frame_equal
from support.league import bring
from support.played import policy

from pitchlore.pipeline.arena.match.controllers import PolicyTables
from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.engine.matches import take_in
from pitchlore.pipeline.engine.record import record
from pitchlore.pipeline.engine.recordings import Recording
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.update import scope_of
from pitchlore.pipeline.face.league import League
from pitchlore.pipeline.settings import OptionSettings, Settings
from pitchlore.pipeline.stages.options.windows import Bodies
from pitchlore.pipeline.state import encode
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.views import datasets
from pitchlore.pipeline.views.lerobot import files, write
from pitchlore.pipeline.views.lerobot.episodes import motion
from pitchlore.pipeline.views.lerobot.grid import even_frames
from pitchlore.pipeline.views.lerobot.layout import frame_features
from pitchlore.schemas import ROLES, SIDES, Decisions

pytestmark = pytest.mark.slow

ID = "derby/decisions-v0"


@pytest.fixture(scope="module")
def league(tmp_path_factory):
    """A played match with logged decisions, a recorded one whose blue team logs options, a version of the knowledge."""
    folder = tmp_path_factory.mktemp("datasets")
    store = Store(folder / "data")
    known = PolicyTables(policy(*((role, 0, codes, 0.5) for role in ROLES for codes in ("046-044-021", "044", "194"))))
    record(store, Recipe(
        home=TeamSettings(kind="learned", policy="known", explore=0.5), away=TeamSettings(kind="static"), seed=9,
        referee=RefereeSettings(duration_s=20.0)), {"known": known})
    second = pl.col("t").floor().cast(pl.Int64)
    clip(0.0, 30.0).with_columns(option=pl.when(team="blue").then(44 + 2 * (second % 2))).write_csv(folder / "derby.csv")
    take_in(store, Recording(file=folder / "derby.csv"))
    bring(store, Settings(options=OptionSettings(recover=True)))
    return store


@pytest.fixture
def written(league, call, tmp_path, monkeypatch):
    """Writes a dataset; what the command says."""
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "minari"))
    return lambda *words: call("minari", *words, "--data", league.root)


def table(store) -> pl.DataFrame:
    return store.read_table(store.receipt("decisions", "all"), "decisions", Decisions)


def league_table(store, name: str) -> pl.DataFrame:
    """A table of all matches."""
    return League(store).lazy(name).collect()


def coded(rows: pl.DataFrame, column: str, moments: pl.DataFrame) -> list[int]:
    """The code of the row that holds each moment of a robot, 0 without one: the slow way, by a join of all with all."""
    keys = ["match_id", "team", "robot"]
    pairs = moments.with_row_index("at").join(rows.select(*keys, "start_ns", "end_ns", found=column), on=keys)
    inside = pairs.filter(pl.col("t_ns") >= pl.col("start_ns"), pl.col("t_ns") < pl.col("end_ns"))
    assert inside["at"].is_unique().all()
    known = dict(inside.select("at", "found").iter_rows())
    return [known.get(at) or 0 for at in range(moments.height)]


def rebuilt(dataset) -> pl.DataFrame:
    """The table of decisions, of nothing but what Minari loads."""
    known = dataset.storage.metadata
    reported = dataset.storage.get_episode_metadata(range(dataset.total_episodes))
    rows = []
    for episode, own in zip(dataset.iterate_episodes(), reported, strict=True):
        assert all(seen in dataset.observation_space for seen in episode.observations)
        assert all(action in dataset.action_space for action in episode.actions)
        assert len(episode.observations) == len(episode.actions) + 1
        infos, options = episode.infos, own["options"]
        states = encode(episode.observations[:-1], "full36")
        for t, action in enumerate(episode.actions):
            behaviour = known["behaviours"][action]
            rows.append({
                "match_id": options["match_id"], "team": options["team"], "robot": int(options["robot"]),
                "role": known["roles"][infos["role"][t]], "t_ns": int(infos["t_ns"][t]),
                "end_ns": int(infos["t_ns"][t + 1]), "state": int(states[t]),
                "behaviour_id": None if behaviour == "194" else behaviour,
                "chosen": bool(infos["chosen"][t]), "random": bool(infos["random"][t]),
                "reward": float(episode.rewards[t]), "episode": int(options["episode"]),
                "ends": "terminal" if episode.terminations[t] else "truncated" if episode.truncations[t] else None,
                "value": float(infos["value"][t]),
            })
    return pl.DataFrame(rows, schema=Decisions.dtypes())


def test_round_trip(league, written):
    """All decisions of all matches come back, logged and observed ones, with their provenance."""
    code, out, err = written(ID, "--json")
    assert code == 0, err
    said = json.loads(out)
    dataset = minari.load_dataset(ID)
    expected = table(league)
    assert_frame_equal(rebuilt(dataset), expected)
    assert expected["chosen"].any()
    assert not expected["chosen"].all()
    assert expected["behaviour_id"].null_count() > 0
    assert said["steps"] == dataset.total_steps == expected.height
    known = dataset.storage.metadata
    assert known["knowledge_version"] == 1
    assert {match.split("-")[0]: seed for match, seed in known["matches"].items()} == {"derby": None, "learned": 9}
    assert known["code_permalink"] == league.receipt("decisions", "all").software
    assert len(known["elements"]) == 36
    labels = pl.concat([pl.DataFrame({name: episode.infos[name] for name in ("option", "situation", "v")})
                        for episode in dataset.iterate_episodes()])
    seen = expected.select("match_id", "team", "robot", "t_ns").hstack(labels)
    for name, rows, code in (("option", league_table(league, "options"), "option"),
                             ("situation", league_table(league, "situations"), "code")):
        assert seen[name].to_list() == coded(rows, code, seen)
        assert (seen[name] > 0).mean() > 0.5
    exact = seen.join(league_table(league, "values"), on=["match_id", "t_ns"])
    assert exact.height > 10
    assert exact["v"].to_list() == exact.select(pl.when(team="home").then("value").otherwise(-pl.col("value"))).to_series().to_list()
    assert {own.get("seed") for own in dataset.storage.get_episode_metadata(range(dataset.total_episodes))} == {None, 9}


def test_of_some_matches(league, written):
    """A match by the beginning of its id; Minari's own sampling works on it."""
    code, out, _ = written(ID, "derby")
    assert code == 0
    assert f'minari.load_dataset("{ID}")' in out
    dataset = minari.load_dataset(ID)
    assert_frame_equal(rebuilt(dataset), table(league).filter(pl.col("match_id").str.starts_with("derby")))
    long = dataset.filter_episodes(lambda episode: len(episode.actions) > 1)
    assert 0 < len(long) < len(dataset)
    assert len(dataset.sample_episodes(2)) == 2


@pytest.mark.parametrize(("words", "said"), [
    ((ID, "nobody"), r"nobody: no match with decisions is called so \(there are: derby-"),
    (("derby",), "derby: is no id of a Minari dataset. Name it NAME-v0"),
    (("../up-v0",), "is no id of a Minari dataset"),
    (("x" * 100_000,), "x…: is no id of a Minari dataset"),
])
def test_errors(written, words, said):
    code, out, err = written(*words)
    assert (code, out) == (1, "")
    assert re.search(said, err)


def test_never_over_another(written, tmp_path):
    written(ID)
    before = sorted((tmp_path / "minari").rglob("*"))
    code, _, err = written(ID)
    assert code == 1
    assert "there is such a dataset already" in err
    assert sorted((tmp_path / "minari").rglob("*")) == before


def test_nothing_half_written(league, tmp_path, monkeypatch):
    """If an episode cannot be written, there is no dataset."""
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "minari"))
    origin = datasets.DecisionSource({}, None, "pitchlore", {})  # no match has a seed, not even None
    with pytest.raises(KeyError):
        datasets.write_dataset(ID, table(league), origin)
    assert not (tmp_path / "minari" / ID).exists()


def test_without_the_extra(written, monkeypatch):
    """Where Minari is not installed, the command names the extra."""
    monkeypatch.setitem(sys.modules, "minari", None)
    monkeypatch.delitem(sys.modules, "pitchlore.pipeline.views.datasets")
    monkeypatch.delattr("pitchlore.pipeline.views.datasets")
    code, _, err = written(ID)
    assert code == 1
    assert "needs minari, which is not installed. Install the extra pitchlore[rl]" in err


# --- LeRobot ---

READS = """
import sys
import numpy as np
from lerobot.datasets.lerobot_dataset import LeRobotDataset
from lerobot.datasets.compute_stats import aggregate_stats
import pyarrow.parquet as pq
root, out = sys.argv[1:]
dataset = LeRobotDataset("pitchlore/league", root=root)
rows = [dataset[i] for i in range(len(dataset))]
found = {name: np.stack([row[name].numpy().reshape(-1) for row in rows]) for name in dataset.features}
ahead = LeRobotDataset("pitchlore/league", root=root, delta_timestamps={"action": [0, 1 / dataset.fps]})
episodes = pq.read_table(root + "/meta/episodes").to_pylist()
names = [name for name in dataset.features]
words = ("min", "max", "mean", "std", "count", "q01", "q10", "q50", "q90", "q99")
joined = aggregate_stats([{n: {w: np.array(e[f"stats/{n}/{w}"]) for w in words} for n in names} for e in episodes])
for name in names:
    for word in words:
        np.testing.assert_allclose(joined[name][word], dataset.meta.stats[name][word], rtol=1e-9, atol=1e-12)
chosen = LeRobotDataset("pitchlore/league", root=root, episodes=[1])
np.savez(out, tasks=[row["task"] for row in rows], episodes=dataset.num_episodes, fps=dataset.fps, of_one=len(chosen),
         ahead=np.stack([ahead[i]["action"].numpy() for i in range(len(rows))]), **found)
"""
#: A Python that has LeRobot, which wants other versions of much than we do.
LEROBOT = os.environ.get("LEROBOT") or (sys.executable if find_spec("lerobot") else None)


@pytest.fixture(scope="module")
def frames(league, tmp_path_factory):
    """The league as a dataset of LeRobot: its folder, and its rows."""
    folder = tmp_path_factory.mktemp("lerobot") / "set"
    made = League(league).lerobot(folder=folder)
    table = pyarrow.dataset.dataset(folder / "data", format="parquet").to_table()
    assert (made.path, made.frames, made.fps, made.robots, made.recovered) == (folder, table.num_rows, 20, 3, 2)
    return folder, table


def matrix(table, name: str) -> np.ndarray:
    """A column as an array [T, n]."""
    column = table[name].combine_chunks()
    flat = column.flatten() if pyarrow.types.is_fixed_size_list(column.type) else column
    return flat.to_numpy(zero_copy_only=False).reshape(len(column), -1)


def episodes_in(folder) -> list[dict]:
    return pq.read_table(folder / "meta" / "episodes").to_pylist()


def test_frames_in_order(frames):
    """Files that describe columns, episodes and frames are right; all frames are numbered through."""
    folder, table = frames
    info = json.loads((folder / "meta" / "info.json").read_text())
    episodes = episodes_in(folder)
    assert (info["codebase_version"], info["fps"], info["total_frames"], info["total_episodes"]) == (
        "v3.0", 20, table.num_rows, len(episodes))
    assert table.schema.names == list(info["features"])
    for name, feature in info["features"].items():
        assert feature["shape"] == [matrix(table, name).shape[1]]
        assert feature["names"] is None or len(feature["names"]) == feature["shape"][0]
    assert table["index"].to_pylist() == list(range(table.num_rows))
    words = pq.read_table(folder / "meta" / "tasks.parquet").to_pylist()
    assert [word["task_index"] for word in words] == list(range(info["total_tasks"])) == list(range(4))
    for number, episode in enumerate(episodes):
        part = table.slice(episode["dataset_from_index"], episode["length"])
        assert set(part["episode_index"].to_pylist()) == {number} == {episode["episode_index"]}
        assert part["frame_index"].to_pylist() == list(range(episode["length"]))
        assert np.array_equal(part["timestamp"], np.arange(episode["length"], dtype=np.float32) / np.float32(20))
        assert part["next.done"].to_pylist() == [False] * (episode["length"] - 1) + [True]
        (task,) = set(part["task_index"].to_pylist())
        assert [words[task]["task"]] == episode["tasks"] == [f"play robot soccer (vsss) as {episode['team']}"]
    assert episodes[-1]["dataset_to_index"] == table.num_rows


def test_frames_are_the_tables(league, frames):
    """Bodies, codes, V and goals of the frames are those of the tables; each action leads to the next frame."""
    folder, table = frames
    tables = {name: league_table(league, name) for name in ("trajectories", "options", "situations", "values", "goals")}
    read = {name: matrix(table, name) for name in table.schema.names}
    state, action = (read[name].reshape(len(read["index"]), 3, -1) for name in ("observation.state", "action"))
    around = read["observation.environment_state"]
    decided = table_of_logged(league)
    moments = []
    for episode in episodes_in(folder):
        rows = slice(episode["dataset_from_index"], episode["dataset_to_index"])
        t_ns = episode["start_ns"] + np.arange(episode["length"]) * 50_000_000
        sign = 1 if episode["side"] == "home" else -1
        other = SIDES[1 - SIDES.index(episode["side"])]
        of_match = tables["trajectories"].filter(match_id=episode["match_id"])
        bodies = {key: part.sort("t_ns") for key, part in of_match.partition_by("team", "robot", as_dict=True).items()}

        def seen(team, robot, t_ns=t_ns, bodies=bodies):
            one = bodies[team, robot]
            near = np.abs(one["t_ns"].to_numpy() - t_ns[:, None]).argmin(axis=1)
            assert np.abs(one["t_ns"].to_numpy()[near] - t_ns).max() < 1_000
            return one[near.tolist()]

        adversaries = [body for body in bodies if body[0] == other]
        views = [(seen("ball", None), around[rows, :5], [0, 1, 2, 3])]
        views += [(seen(episode["side"], robot), state[rows, place], [0, 1, 4, 5])
                  for place, robot in enumerate(episode["numbers"])]
        views += [(seen(*body), around[rows, 5 + 8 * place:13 + 8 * place], [0, 1, 4, 5])
                  for place, body in enumerate(sorted(adversaries))]
        for one, numbers, columns in views:
            assert np.allclose(numbers[:, columns], sign * one.select("x", "y", "vx", "vy").fill_null(0.0).to_numpy(), atol=1e-5)
            assert (numbers[:, -1] == 1).all()
            if numbers.shape[1] == 8:
                theta = one["theta"].to_numpy()
                assert np.allclose(numbers[:, 2:4], sign * np.stack([np.cos(theta), np.sin(theta)], axis=1), atol=1e-5)
                assert np.allclose(numbers[:, 6], one["omega"].fill_null(0.0), atol=1e-5)
        # each action leads from one frame to the next
        pose, does = state[rows].astype(np.float64), action[rows].astype(np.float64) / 20
        heading = np.arctan2(pose[..., 3], pose[..., 2])
        half = heading + does[..., 2] / 2
        x = pose[..., 0] + does[..., 0] * np.cos(half) - does[..., 1] * np.sin(half)
        y = pose[..., 1] + does[..., 0] * np.sin(half) + does[..., 1] * np.cos(half)
        assert np.allclose(np.stack([x, y], axis=-1)[:-1], pose[1:, :, :2], atol=1e-5)
        assert np.allclose(np.exp(1j * (heading + does[..., 2]))[:-1], pose[1:, :, 2] + 1j * pose[1:, :, 3], atol=1e-5)
        for place, robot in enumerate(episode["numbers"]):
            moments.append(pl.DataFrame({
                "match_id": episode["match_id"], "team": episode["side"], "robot": robot, "t_ns": t_ns,
                **{name: read[name][rows, place] for name in ("option", "option.logged", "situation")},
                "value": sign * read["value"][rows, 0],
            }, schema_overrides={"robot": pl.Int16, "team": pl.Enum(SIDES)}))
        goals = tables["goals"].filter(pl.col("t_ns") > t_ns[-1], match_id=episode["match_id"]).sort("t_ns")
        reward = read["next.reward"][rows, 0]
        assert (reward[:-1] == 0).all()
        assert reward[-1] == (0 if episode["outcome"] != "goal" else 1 if goals["team"][0] == episode["side"] else -1)
        assert read["next.truncated"][rows, 0][-1] == (episode["outcome"] != "goal")
    found = pl.concat(moments)
    assert read["acts"].all()
    assert set(np.unique(read["next.reward"])) == {-1, 0, 1}
    for name, of_table, column in (("option", tables["options"], "option"), ("situation", tables["situations"], "code"),
                                   ("option.logged", decided, "logged")):
        assert found[name].to_list() == coded(of_table, column, found), name
        assert found[name].n_unique() > 1, name
    exact = found.join(tables["values"], on=["match_id", "t_ns"])
    assert exact.height > 100
    assert np.allclose(exact["value"], exact["value_right"], atol=1e-6)


def table_of_logged(store) -> pl.DataFrame:
    """Decisions that are one option, and blue's options of each second, as they were logged."""
    rows = table(store).filter("chosen", pl.col("behaviour_id").str.count_matches("-") == 1)
    decided = rows.select("match_id", "team", "robot", start_ns="t_ns", end_ns="end_ns", logged=pl.col("behaviour_id").str.slice(-3).cast(pl.Int64))
    robots = league_table(store, "options").join(league_table(store, "sides"), left_on=["match_id", "team"], right_on=["match_id", "side"])
    robots = robots.filter(pl.col("team_right") == "blue")
    assert set(robots["logged"]) == {44, 46}
    rows = pl.read_csv(store.root.parent / "derby.csv").select("option", t_ns=((pl.col("t") - pl.col("t").min()) * 1e9).round().cast(pl.Int64))
    begun = rows.drop_nulls().unique("t_ns").sort("t_ns").filter(pl.col("option").diff().fill_null(1) != 0)
    assert begun.height == 30
    told = robots.select("match_id", "team", "robot").unique().join(begun, how="cross").select(
        "match_id", "team", "robot", start_ns="t_ns", end_ns=pl.col("t_ns").shift(-1).over("robot").fill_null(10**12), logged="option")
    return pl.concat([decided, told])


def test_statistics(frames):
    """The statistics are numpy's: of all frames, and of each episode; quantiles are joined by weight."""
    folder, table = frames
    known, episodes = json.loads((folder / "meta" / "stats.json").read_text()), episodes_in(folder)
    numpys = {"min": np.min, "max": np.max, "mean": np.mean, "std": np.std}
    quantiles = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}
    lengths = np.array([episode["length"] for episode in episodes])
    assert set(known) == set(frame_features(3))
    for name, said in known.items():
        values = matrix(table, name).astype(np.float64)
        for word, function in numpys.items():
            assert np.allclose(said[word], function(values, axis=0), rtol=1e-9, atol=1e-12), (name, word)
        assert said["count"] == [table.num_rows]
        for word, share in quantiles.items():
            of_each = [np.quantile(values[e["dataset_from_index"]:e["dataset_to_index"]], share, axis=0) for e in episodes]
            assert np.allclose([episode[f"stats/{name}/{word}"] for episode in episodes], of_each)
            assert np.allclose(said[word], np.average(of_each, axis=0, weights=lengths))


def test_between_samples():
    """Frames between samples are interpolated, headings too; a body that is missed has zeros, no action, and says so."""
    t_ns = np.delete(np.arange(41) * 25_000_000, slice(21, 30))  # 40 Hz, with a hole of a quarter of a second
    places = np.zeros((len(t_ns), 3, 6))
    places[:, 1, 0] = 2.0 * t_ns / 1e9
    places[:, 1, 2] = (3.0 + 4.0 * t_ns / 1e9 + np.pi) % (2 * np.pi) - np.pi
    places[6, 2] = np.nan
    places[-2:, 1, 0] += 5.0  # somebody puts it there
    match = Bodies(t_ns, np.zeros(len(t_ns), dtype=np.int64), places, ((1,), (1,)))
    frames = even_frames(match, 0, 30)
    assert np.array_equal(frames.t_ns, np.round(np.arange(31) * 1e9 / 30).astype(np.int64))
    hole = (frames.t_ns > t_ns[20]) & (frames.t_ns < t_ns[21])
    assert np.array_equal(np.isnan(frames.places[:, 1, 0]), hole)
    driven = ~hole & (frames.t_ns <= t_ns[-3])
    assert np.allclose(frames.places[driven, 1, 0], 2.0 * frames.t_ns[driven] / 1e9, atol=1e-7)
    found = motion(frames.places, 1, 30, farthest=0.5)
    known = driven[:-1] & driven[1:] | (frames.t_ns[:-1] >= t_ns[-2])
    assert np.array_equal(found["acts"][:, 0], known)
    assert np.allclose(found["action"][known, 2], 4.0, atol=1e-4)
    assert (found["action"][~known] == 0).all()
    assert np.array_equal(found["observation.state"][:, 7], ~hole[:-1])
    assert (found["observation.state"][hole[:-1]] == 0).all()
    # sample 6 is at .15 s: the frames at .133 and .167 lie beside it
    other = found["observation.environment_state"][:, 12]
    assert np.flatnonzero(~hole[:-1] & (other == 0)).tolist() == [4, 5]


@pytest.mark.skipif(LEROBOT is None, reason="needs LeRobot: LEROBOT=/path/to/a/python that has it")
def test_lerobot_reads_it(frames, tmp_path):
    """LeRobot's own loader, offline, gives every number of every frame; it joins statistics to the same ones."""
    folder, table = frames
    offline = {**os.environ, "HF_HUB_OFFLINE": "1", "HF_HOME": str(tmp_path / "hf")}
    done = subprocess.run([LEROBOT, "-c", READS, folder, tmp_path / "read.npz"], env=offline, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]
    read = np.load(tmp_path / "read.npz")
    for name in frame_features(3):
        assert np.array_equal(read[name], matrix(table, name)), name
    episodes = episodes_in(folder)
    assert (read["episodes"], read["fps"], read["of_one"]) == (len(episodes), 20, episodes[1]["length"])
    assert read["tasks"].tolist() == [task for episode in episodes for task in episode["tasks"] * episode["length"]]
    assert np.array_equal(read["ahead"][0], matrix(table, "action")[:2])


def test_files_are_numbered(league, tmp_path, monkeypatch):
    """Small files: each episode is where its row says, in folders of two; all together are the same frames."""
    monkeypatch.setattr(files, "FILES_OF_CHUNK", 2)
    monkeypatch.setattr(write, "NumberedFiles", partial(files.NumberedFiles, most=1))
    League(league).lerobot("derby", folder=tmp_path / "set")
    episodes = episodes_in(tmp_path / "set")
    assert len(episodes) > 2
    for number, episode in enumerate(episodes):
        place = divmod(number, 2)
        assert (episode["data/chunk_index"], episode["data/file_index"]) == place
        part = pq.read_table(tmp_path / "set" / "data" / f"chunk-{place[0]:03d}" / f"file-{place[1]:03d}.parquet")
        assert part["index"].to_pylist() == list(range(episode["dataset_from_index"], episode["dataset_to_index"]))


@pytest.mark.parametrize(("words", "said"), [
    (("nobody",), "nobody: there is no such match"),
    (("--fps", "61"), r"--fps: 61 frames a second do not fit a recording of 40 samples a second. Name 1 to 40"),
    (("derby", "-o", "{}/there"), "there: is there already. Name another folder, or remove it"),
    (("--data", "{}/mixed"), r"the matches are of several leagues \(human, vsss\)"),
    (("--data", "{}/bare"), r"bare-\w+: has no headings of robots, from which their actions are told"),
])
def test_no_dataset(league, call, tmp_path, words, said):
    (tmp_path / "there").mkdir()
    store = Store(tmp_path / words[-1].rpartition("/")[2])
    for name, kind in {"mixed": (("a", "vsss"), ("b", "human")), "bare": (("bare", "vsss"),)}.get(store.root.name, ()):
        store.root.mkdir(exist_ok=True)
        clip(0.0, 8.0).filter(pl.col("t") > len(kind)).drop("heading").write_csv(tmp_path / f"{name}.csv")
        (tmp_path / f"{name}.toml").write_text(f"[pitch]\nkind = '{kind}'\nlength = 1.5\nwidth = 1.3\n")
        take_in(store, Recording(file=tmp_path / f"{name}.csv", mapping=tmp_path / f"{name}.toml"))
        STAGES.make(store, Settings(), scope_of(store))
    before = sorted(tmp_path.rglob("*"))
    given = [word.format(tmp_path) for word in words]
    code, out, err = call("export", "--to", "lerobot", *given, *(() if "--data" in given else ("--data", league.root)))
    assert (code, out) == (1, "")
    assert re.search(said, err)
    assert {path.name for path in set(tmp_path.rglob("*")) - set(before)} <= {"exports"}


def test_no_half_dataset(league, tmp_path, monkeypatch):
    """A dataset that is broken off after a match leaves nothing."""
    calls = []

    def fails(match, *more):
        calls.append(match.name)
        if len(calls) > 1:
            raise KeyboardInterrupt
        return write_episodes(match, *more)

    write_episodes = write.episodes_of
    monkeypatch.setattr(write, "episodes_of", fails)
    with pytest.raises(KeyboardInterrupt):
        League(league).lerobot(folder=tmp_path / "set")
    assert len(calls) == 2
    assert list(tmp_path.iterdir()) == []
