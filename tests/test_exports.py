"""Exports: tables that come back, files that kloppy and floodlight read, recordings that viewers draw."""

import csv
import json
from collections import Counter
from dataclasses import replace
from functools import cache
from io import BytesIO, StringIO
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from conftest import clip
from mcap.reader import make_reader
from support.football import NEEDS_KLOPPY
from support.handmade import derived, handmade
from support.tracking import read

from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap
from pitchlore.pipeline.matches.frame import OPTION_DTYPE, Heights, MatchLog
from pitchlore.pipeline.stages.events.restarts import kind_of
from pitchlore.pipeline.views.exports import foxglove, second_spectrum, tables
from pitchlore.pipeline.views.exports.content import ExportedMatch
from pitchlore.pipeline.views.exports.formats import FORMATS
from pitchlore.pipeline.views.exports.spreadsheet import safe_csv
from pitchlore.schemas import Referee
from pitchlore.schemas.restarts import RESTARTS

#: The part of the sample that is exported, s.
SECONDS = 40.0


@cache
def content() -> ExportedMatch:
    """The sample's first 40 s, with a height of the ball at one sample, and options of a robot for five seconds."""
    match = read(clip(0.0, SECONDS).write_csv())
    times = match.frames.t_ns
    told = np.array([(times[100], 44, 1, 1), (times[200], 46, 1, 1), (times[300], 0, 1, 1)], dtype=OPTION_DTYPE)
    match = replace(match, heights=Heights(times[100:101], np.float32([0.25])), options=told)
    return ExportedMatch(handmade(log=match, **derived(match)))


def same_places(one: MatchLog, two: MatchLog, atol: float = 0.0) -> None:
    """Both matches have the same bodies at the same places."""
    assert np.array_equal(one.frames.t_ns, two.frames.t_ns)
    assert np.array_equal(one.frames.offsets, two.frames.offsets)
    for name in ("team", "id", "x", "y"):
        assert np.allclose(one.frames.robots[name], two.frames.robots[name], atol=atol, rtol=0)
    for name in ("x", "y"):
        assert np.allclose(one.frames.ball[name], two.frames.ball[name], atol=atol, rtol=0, equal_nan=True)


@pytest.mark.parametrize(("cell", "safe"), [
    ("=1+1", "'=1+1"), ("+a", "'+a"), ("-a", "'-a"), ("@SUM(A1)", "'@SUM(A1)"), ("\t=1", "'\t'=1"), ("\r", "'\r"), ("＝1", "'＝1"),
    ("x;=1", "x;'=1"), ("x\n=1\n+2", "x\n'=1\n'+2"), ("-1.5e-3", "-1.5e-3"), ("+7", "+7"), ("-.5", "-.5"), ("-5 m", "'-5 m"),
    ("a=b", "a=b"), ('"=1', '"=1'), ("", ""), ("044-011", "044-011"), (-1.5, "-1.5"), (None, ""),
])
def test_no_cell_is_a_formula(cell, safe) -> None:
    """Text, in cells, headers and kinds of text, that a spreadsheet would compute begins with an apostrophe; numbers are as they are."""
    frames = [pl.DataFrame({"a": [cell], "b": [1]})]
    if isinstance(cell, str):
        frames += [frames[0].cast({"a": kind}) for kind in (pl.Categorical, pl.Enum([cell]))]
        assert next(csv.reader(StringIO(safe_csv(frames[0].rename({"a": cell})), newline="")))[0] == safe
    for frame in frames:
        assert list(csv.reader(StringIO(safe_csv(frame), newline=""))) == [["a", "b"], [safe, "1"]]


def test_exported_names_are_no_formulas() -> None:
    """A team whose name is a formula is text in the CSV that is exported, and itself in Parquet."""
    log = content().log
    named = ExportedMatch(handmade(log=(evil := replace(log, info=log.info.model_copy(update={"home": "=1+1"}))), **derived(evil)))
    assert "'=1+1" in pl.read_csv(FORMATS["csv"].write(named)["csv"])["team"]
    assert "=1+1" in pl.read_parquet(FORMATS["parquet"].write(named)["parquet"])["team"]


@pytest.mark.parametrize("form", ["csv", "parquet"])
def test_a_table_comes_back(form: str) -> None:
    """A match exported as a table is imported as the same match: places, headings, goals, score, sides."""
    match = content().log
    home = TrackingMap.model_validate({
        "teams": {"home": match.info.home, "away": match.info.away},
        "pitch": match.info.pitch.model_dump()})
    again = read(FORMATS[form].write(content())[form], home)
    same_places(again, match)
    assert np.array_equal(again.options, match.options)
    assert np.array_equal(again.frames.robots["theta"], match.frames.robots["theta"], equal_nan=True)
    assert again.info.pitch == match.info.pitch
    columns = ("t_ns", "event", "team", "score_home", "score_away")
    goals = pl.col("event") == "goal"
    assert match.referee.filter(goals).height > 0
    assert again.referee.filter(goals).select(columns).equals(match.referee.filter(goals).select(columns))
    assert [p.home_attacks for p in again.info.periods] == [p.home_attacks for p in match.info.periods]


def test_restarts_come_back() -> None:
    """A restart is exported by its kind, and is the same restart when the table is imported."""
    made = content()
    notes = ("freeball", "goal_kick_l", "GOAL_KICK_YELLOW", "corner_kick_r", "kick_in_l", "directEnemy", "penalty_kick_r", "segment")
    rows = [{"match_id": made.log.info.match_id, "t_ns": 500_000_000 * place, "event": "fault",
             "team": ("home", "away")[place % 2], "score_home": 0, "score_away": 0, "note": note}
            for place, note in enumerate(notes, start=1)]
    made = ExportedMatch(handmade(log=replace(made.log, referee=Referee.of(rows))))
    again = read(FORMATS["csv"].write(made)["csv"], TrackingMap.model_validate({
        "teams": {"home": made.log.info.home, "away": made.log.info.away}}))

    def reported(match: MatchLog) -> list[tuple[str, str]]:
        faults = match.referee.filter(pl.col("event") == "fault")
        return [(kind_of("fault", note), team) for note, team in faults.select("note", "team").iter_rows()]

    assert reported(again) == reported(made.log)
    assert {kind for kind, _ in reported(again)} == set(RESTARTS) - {"kick-off"}
    assert "skipped" not in again.quality["flaw"]


def test_columns_of_a_table() -> None:
    """Missing values are empty, heights are there if one is known, states name events once."""
    table = tables.tracking_table(content())
    assert table.columns[:6] == ["frame", "t", "team", "player", "x", "y"]
    assert table["z"].drop_nulls().to_list() == [0.25]
    unknown = Heights(np.empty(0, dtype=np.int64), np.empty(0, dtype=np.float32))
    assert "z" not in tables.tracking_table(ExportedMatch(handmade(log=replace(content().log, heights=unknown)))).columns
    info = content().log.info.model_copy(update={"home": "static", "away": "static"})
    itself = ExportedMatch(handmade(log=replace(content().log, info=info)))
    again = read(FORMATS["csv"].write(itself)["csv"])
    assert (again.info.home, again.info.away) == ("static", "static-2")
    same_places(again, content().log)
    first = table.unique("frame", keep="first", maintain_order=True)["game_state"]
    reported = content().log.referee.filter(pl.col("t_ns") <= int(SECONDS * 1e9))
    words = Counter(word for state in first for word in state.split("+") if word not in ("play", "stop"))
    events_told = Counter(
        event if team is None else f"{event}_{team}" for event, team in reported.select("event", "team").iter_rows())
    assert words == Counter({word: n for word, n in events_told.items() if word not in ("play", "stop")})


def _written(folder: Path) -> tuple[Path, Path]:
    meta, raw = second_spectrum.second_spectrum_files(content())
    (folder / "meta.json").write_bytes(meta)
    (folder / "tracking.jsonl").write_bytes(raw)
    return folder / "meta.json", folder / "tracking.jsonl"


@NEEDS_KLOPPY
def test_kloppy_loads_it(tmp_path: Path) -> None:
    """kloppy's own loader gives the same places, times, heights and teams, in metres; what comes back is the same match."""
    from kloppy import secondspectrum

    from pitchlore.pipeline.importers.football.dataset import match_of_dataset

    match, (meta, raw) = content().log, _written(tmp_path)
    dataset = secondspectrum.load(meta.read_bytes(), raw.read_bytes(), coordinates="secondspectrum")
    frames = match.frames
    assert len(dataset.records) == len(frames)
    assert dataset.metadata.pitch_dimensions.pitch_length == match.info.pitch.length
    assert [team.name for team in dataset.metadata.teams] == [match.info.home, match.info.away]
    for i in range(0, len(frames), 37):
        record, robots = dataset.records[i], frames.robots[frames.offsets[i]:frames.offsets[i + 1]]
        assert record.timestamp.total_seconds() == pytest.approx(frames.t_ns[i] / 1e9, abs=1e-6)
        theirs = sorted(
            (("home", "away").index(p.team.ground.value), p.jersey_no, d.coordinates.x, d.coordinates.y)
            for p, d in record.players_data.items())
        ours = sorted((int(r["team"]), int(r["id"]), float(r["x"]), float(r["y"])) for r in robots)
        assert np.array(theirs) == pytest.approx(np.array(ours), abs=1e-6)
        assert record.ball_coordinates.x == pytest.approx(float(frames.ball["x"][i]), abs=1e-6)
    assert dataset.records[100].ball_coordinates.z == pytest.approx(0.25)
    alive = [record.ball_state.value == "alive" for record in dataset.records]
    assert alive == content().in_play().to_list()
    owners = Counter(record.ball_owning_team.name for record in dataset.records)
    assert set(owners) == {match.info.home, match.info.away}

    again = match_of_dataset(secondspectrum.load(meta.read_bytes(), raw.read_bytes()))
    same_places(again, match, atol=2e-5)
    assert [period.home_attacks for period in again.info.periods] == [p.home_attacks for p in match.info.periods]


def test_floodlight_loads_it(tmp_path: Path) -> None:
    """floodlight's own loader gives the same places at the sampling rate, and who has the ball."""
    secondspectrum = pytest.importorskip("floodlight.io.secondspectrum", reason="needs floodlight")
    match, (meta, raw) = content().log, _written(tmp_path)
    xy, possession, ballstatus, sheets, pitch = secondspectrum.read_position_data_jsonl(raw, meta)
    assert (pitch.length, pitch.width) == (match.info.pitch.length, match.info.pitch.width)
    assert list(xy) == ["HT1"]
    assert xy["HT1"]["Home"].framerate == 40
    home = match.frames.robots[match.frames.robots["team"] == 0]
    links = sheets["Home"].get_links("jID", "xID")
    for number, column in links.items():
        own = home[home["id"] == number]
        theirs = xy["HT1"]["Home"].xy[:, 2 * column:2 * column + 2]
        assert theirs[: len(own), 0] == pytest.approx(own["x"].astype(float), abs=1e-6)
    assert len(xy["HT1"]["Ball"].xy) == len(match.frames)
    assert set(possession["HT1"].code) == {"H", "A"}
    assert (ballstatus["HT1"].code == "A").tolist() == content().in_play().to_list()


def test_nobody_had_the_ball() -> None:
    """A form that has to say who had the ball is refused in one line where nobody ever had."""
    with pytest.raises(BadRecording, match="nobody ever had the ball"):
        second_spectrum.second_spectrum_files(ExportedMatch(handmade(log=content().log)))


@pytest.mark.slow
def test_foxglove() -> None:
    """The MCAP has Foxglove's schemas; bodies move as recorded, situations begin and end, the pitch is drawn."""
    data = foxglove.recording(content())
    assert data == foxglove.recording(content())
    reader = make_reader(BytesIO(data))
    summary = reader.get_summary()
    assert summary is not None
    assert sorted(schema.name for schema in summary.schemas.values()) == [
        "foxglove.FrameTransforms", "foxglove.Log", "foxglove.SceneUpdate"]
    assert {schema.encoding for schema in summary.schemas.values()} == {"jsonschema"}
    assert sorted(channel.topic for channel in summary.channels.values()) == [
        "/bodies", "/log", "/pitch", "/situations", "/tf"]
    counted: Counter[str] = Counter()
    drawn: Counter[str] = Counter()
    places: dict[str, dict[int, tuple[float, float]]] = {}
    alive: set[str] = set()
    for schema, channel, message in make_reader(BytesIO(data)).iter_messages():
        assert schema is not None
        counted[channel.topic] += 1
        reported = json.loads(message.data)
        _conforms(reported, json.loads(schema.data))
        for entity in reported.get("entities", []):
            drawn.update({kind: len(entity[kind]) for kind in ("cylinders", "spheres", "arrows", "texts", "lines")})
        if channel.topic == "/tf":
            for frame in reported["transforms"]:
                at = frame["translation"]
                places.setdefault(frame["child_frame_id"], {})[message.log_time] = (at["x"], at["y"])
        if channel.topic == "/situations":
            alive -= {gone["id"] for gone in reported["deletions"]}
            alive |= {entity["id"] for entity in reported["entities"]}
    assert counted["/pitch"] == 1
    # 40 s at no more than 25 Hz, of a recording at 40 Hz: every other sample
    assert counted["/bodies"] == counted["/tf"] == pytest.approx(SECONDS * 20, abs=2)
    situations = content().match.situations
    assert counted["/log"] == situations.height + content().log.referee.height
    assert drawn["cylinders"] == drawn["arrows"] == 6 * counted["/bodies"]
    assert drawn["spheres"] == counted["/bodies"]
    assert drawn["lines"] == 7
    assert not alive  # the last situations end
    frames = content().log.frames
    for i in range(0, len(frames), 80):
        for robot in frames.robots[frames.offsets[i]:frames.offsets[i + 1]]:
            name = f"{('home', 'away')[robot['team']]}-{robot['id']}"
            seen = places[name].get(int(frames.t_ns[i]))
            if seen is not None:
                assert seen == pytest.approx((float(robot["x"]), float(robot["y"])), abs=1e-4)


def _conforms(value: object, schema: dict[str, object]) -> None:
    """The value has what its JSON Schema requires, and nothing that it does not know."""
    kinds = {"object": dict, "array": list, "number": (int, float), "integer": int, "string": str, "boolean": bool}
    assert isinstance(value, kinds[str(schema["type"])]), (value, schema)
    if isinstance(value, dict) and "properties" in schema:
        properties = schema["properties"]
        assert isinstance(properties, dict)
        assert set(value) == set(properties)
        for name, part in value.items():
            _conforms(part, properties[name])
    if isinstance(value, list):
        items = schema["items"]
        assert isinstance(items, dict)
        for part in value:
            _conforms(part, items)


@pytest.mark.slow
def test_rerun(tmp_path: Path) -> None:
    """The recording has each body, its number and heading, a lane of states a robot, and a blueprint."""
    pytest.importorskip("rerun", reason="needs the extra rerun")
    from rerun.chunk import RrdReader

    path = tmp_path / "match.rrd"
    path.write_bytes(FORMATS["rerun"].write(content())["rrd"])
    reader = RrdReader(path)
    assert [entry.application_id for entry in reader.recordings()] == ["pitchlore"]
    assert len(reader.blueprints()) == 1
    archetypes = {
        (column.entity_path, column.archetype.rpartition(".")[2])
        for column in reader.store().schema().component_columns() if column.archetype is not None}
    assert Counter(archetype for _, archetype in archetypes) == {
        "LineStrips2D": 1, "Points2D": 7, "Arrows2D": 6, "StateChange": 6, "TextLog": 1}
    rows: dict[str, pl.DataFrame] = {}
    for chunk in reader.stream().to_chunks():
        if not chunk.is_static:
            rows[chunk.entity_path] = pl.concat([
                rows.get(chunk.entity_path, pl.DataFrame()), pl.DataFrame(chunk.to_record_batch())], how="diagonal")
    frames, situations = content().log.frames, content().match.situations
    for team, side in enumerate(("home", "away")):
        for number in range(3):
            robots = frames.robots
            own = robots[(robots["team"] == team) & (robots["id"] == number)]
            moved = rows[f"/pitch/{side}/{number}"]
            assert moved.height == len(own)
            there = np.array(moved["Points2D:positions"].to_list()).reshape(-1, 2)
            assert there == pytest.approx(np.column_stack([own["x"], -own["y"]]), abs=1e-6)
            lane = rows[f"/situations/{side}/{number}"]
            mine = situations.filter(pl.col("team") == side, pl.col("robot") == number)
            labels = [state[0] for state in lane["StateChange:state"].to_list() if state and state[0]]
            assert labels == [f"{code:03d} {name}" for code, name in mine.select("code", "name").iter_rows()]
    assert rows["/referee"].height == content().log.referee.height


@pytest.mark.slow
def test_command(call, tmp_path: Path) -> None:
    """The command writes what the format names, says what reads it, and says what is missing."""
    clip(0.0, 20.0).write_csv(tmp_path / "derby.csv")
    data = tmp_path / "data"
    assert call("import", tmp_path / "derby.csv", "--data", data)[0] == 0
    code, out, _ = call("export", "derby", "--to", "csv", "--data", data, "-o", tmp_path / "out")
    assert code == 0
    assert [file.suffix for file in (tmp_path / "out").iterdir()] == [".csv"]
    assert "tracking table" in out
    code, _, err = call("export", "derby", "--to", "kloppy", "--data", data)
    assert code == 1
    assert "pitchlore run" in err


def test_formats_are_those_of_the_command() -> None:
    """The command's words are the table's."""
    from typing import get_args

    from pitchlore.flows.commands.export import Word

    assert sorted(get_args(Word)) == sorted([*FORMATS, "lerobot"])


