"""Football's recordings, as kloppy reads them: sizes, places, numbers, heights, states and refusals."""

import codecs
import gzip
import json
import multiprocessing
import os
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest
import zstandard
from football.skillcorner import FILES, MATCH, source_of
from support import recordings
from support.football import (
    DEAD,
    FRAMES,
    HALF,
    KINDS,
    LENGTH,
    MADE,
    NEEDS_KLOPPY,
    NEEDS_KLOPPY_ALONE,
    PFF,
    PLAYERS,
    WIDTH,
    ball,
    epts,
    files_of,
    made,
)
from support.mcap_logs import written
from support.recordings import assert_sound

from pitchlore.pipeline import matches
from pitchlore.pipeline.base.errors import BadRecording, NotFound, PitchloreError
from pitchlore.pipeline.engine.matches import read_recording, take_in
from pitchlore.pipeline.engine.recordings import Recording
from pitchlore.pipeline.game.pitch import Kind
from pitchlore.pipeline.importers.football.dataset import match_of_dataset
from pitchlore.pipeline.importers.football.providers import PROVIDERS, dataset_of, open_files, provider_of
from pitchlore.pipeline.importers.football.squad import UNNUMBERED, Stay, shirt_numbers
from pitchlore.pipeline.importers.readers import open_source, read
from pitchlore.pipeline.matches.frame import Heights, MatchLog
from pitchlore.pipeline.settings import ImportSettings
from pitchlore.pipeline.store import Store
from pitchlore.schemas import Matches

S = 1_000_000_000


def test_every_provider_is_made() -> None:
    """The table of providers and the kinds that the tests make by code are the same."""
    assert {"tracab", *(kind.provider for kind in MADE.values())} == set(PROVIDERS)


@NEEDS_KLOPPY
@pytest.mark.parametrize(("provider", "names", "teams", "score", "samples", "attacks"), KINDS)
def test_kinds(provider: str, names: tuple[str, ...], teams: str, score: tuple[int, int] | None, samples: int, attacks: tuple[int, int]) -> None:
    """Each kind of file has the provider's names, score and directions, and its bodies on the pitch; no score is unknown."""
    match = read(source_of(provider, names))
    row = matches.row(match).row(0, named=True)
    assert (f"{row['home']} - {row['away']}", len(match.frames)) == (teams, samples)
    assert (row["score_home"], row["score_away"]) == (score or (None, None))
    told = [period.home_attacks * (not period.inferred) for period in match.info.periods]
    assert told == [attacks[place % 2] for place, _ in enumerate(told)]
    flaws = match.quality["flaw"].cast(pl.String).to_list()
    assert flaws.count("direction inferred") + flaws.count("direction unknown") == told.count(0)  # no told one is contradicted
    assert "off the pitch" not in flaws
    assert not match.quality["note"].fill_null("").str.contains("but the provider's score").any()
    assert again_as_json(match)


def again_as_json(match: MatchLog) -> bool:
    """True if all facts of a match are Python's own numbers and texts."""
    return json.loads(json.dumps(match.info.model_dump(mode="json"))) == match.info.model_dump(mode="json")


#: The same match in TRACAB's text and in its five kinds of metadata: the home team's first player stands at x = -30 m.
TRACAB_RAW = "".join(f"{frame}:0,1,9,{1000 + frame},0,0.1;1,2,7,-3000,{frame},0.2;4,3,-1,0,0,0.0;:0,0,0,0.0,H,Alive;:\n" for frame in range(100, 110))


def tracab_team(side: str, name: str, number: int, *, flat: bool) -> str:
    kind, player = ("item", "PlayerID") if flat else ("Player", "PlayerId")
    return (
        f"<{side}Team><LongName>{name}</LongName><ShortName>{name}</ShortName><Team{player[-2:]}>{number}</Team{player[-2:]}><Players><{kind}>"
        f"<{player}>{number}</{player}><FirstName>A</FirstName><LastName>B</LastName><JerseyNo>{number}</JerseyNo><StartFrameCount>100</StartFrameCount>"
        f"<EndFrameCount>110</EndFrameCount></{kind}></Players></{side}Team>")


def tracab_meta(kind: str, left: str = "true") -> str:
    """Metadata of TRACAB."""
    period = '<period iId="1" iStartFrame="100" iEndFrame="110"/><period iId="2" iStartFrame="0" iEndFrame="0"/>'
    match = f'<match iId="1" dtDate="2023-12-15 20:32:20" iFrameRateFps="25" fPitchXSizeMeters="105.00" fPitchYSizeMeters="68.00">{period}</match>'
    phases = [("FrameRate", "25"), ("PitchShortSide", "6800"), ("PitchLongSide", "10500"), ("GameID", "1")]
    phases += [(f"Phase{phase}{end}Frame", {"1Start": "100", "1End": "110"}.get(f"{phase}{end}", "0")) for phase in range(1, 6) for end in ("Start", "End")]
    if kind == "json":
        team = {"LongName": "A", "ShortName": "A & B", "TeamID": 1, "Players": []}
        player = {"FirstName": "A", "LastName": "B", "StartFrameCount": 100, "EndFrameCount": 110}
        return json.dumps({name: int(value) for name, value in phases} | {
            "Kickoff": "2023-12-15 20:32:20", "Phase1HomeGKLeft": left == "true",
            "HomeTeam": team | {"TeamID": 7, "Players": [player | {"PlayerID": 7, "JerseyNo": 7}]}, "AwayTeam": team | {"ShortName": "C", "Players": [player | {"PlayerID": 9, "JerseyNo": 9}]}})
    if kind == "flat":
        facts = "".join(f"<{name}>{value}</{name}>" for name, value in [*phases, ("Phase1HomeGKLeft", left), ("Kickoff", "2023-12-15 20:32:20")])
        return f"<root>{facts}{tracab_team('Home', 'A &amp;amp; B', 7, flat=True)}{tracab_team('Away', 'C', 9, flat=True)}</root>"
    teams = tracab_team("Home", "A &amp; B", 7, flat=False) + tracab_team("Away", "C", 9, flat=False) if kind == "teams" else ""
    return f"<TracabMetaData>{match}{teams}</TracabMetaData>"


@NEEDS_KLOPPY_ALONE
@pytest.mark.parametrize(("kind", "left", "teams", "attacks", "contradicted"), [
    ("json", "true", "A & B - C", 1, False), ("json", "false", "A & B - C", -1, True), ("flat", "true", "A & B - C", 1, False),
    ("flat", "false", "A & B - C", -1, True), ("teams", "", "A & B - C", None, False), ("plain", "", "home - away", None, False),
])
def test_tracab(kind: str, left: str, teams: str, attacks: int | None, contradicted: bool) -> None:
    """TRACAB's metadata in JSON and each XML give names as texts, and the end of home's goalkeeper; bodies that say otherwise are heard."""
    match = read(open_files([("meta", tracab_meta(kind, left).encode()), ("raw.dat", TRACAB_RAW.encode())], "tracab"))
    assert f"{match.info.home} - {match.info.away}" == teams
    home = match.frames.robots[match.frames.robots["team"] == 0]
    assert (home["id"][0], home["x"][0], len(match.frames)) == (7, -30.0, 10)
    (period,) = match.info.periods
    assert (period.home_attacks, period.inferred) == (attacks or 1, attacks is None)
    notes = match.quality.filter(flaw="direction inferred")["note"]
    assert any("the source tells that home attacks -x, and is believed, but the vote of the bodies is +" in note for note in notes) == contradicted
    assert matches.row(match)["score_home"][0] is None


@NEEDS_KLOPPY_ALONE
@pytest.mark.slow
@pytest.mark.parametrize("kind", MADE)
def test_made(kind: str, call, tmp_path: Path) -> None:
    """One match in all kinds of files, made by code, is one: numbers, places and names, and what each kind tells beside them."""
    files, spec = files_of(kind, tmp_path), MADE[kind]
    code, out, err = call("import", "--from", f"kloppy:{spec.provider}", *files, "--data", tmp_path / "data")
    assert (code, spec.names in out) == (0, True), out + err
    match = matches.read(next((tmp_path / "data").glob("matches/*.mcap")).read_bytes(), where="log")
    assert_sound(match)
    row = Matches.validate(matches.row(match)).row(0, named=True)
    assert (f"{row['home']} - {row['away']}", match.info.pitch.kind, match.info.format) == (spec.names, Kind.HUMAN, "kloppy")
    assert (match.info.pitch.length, match.info.pitch.width) == (LENGTH, WIDTH)
    assert np.allclose(match.frames.t_ns / S, [n % HALF / spec.rate + spec.second_s * (n // HALF) for n in FRAMES])
    robots = match.frames.robots
    for side, number, place in PLAYERS:
        own = robots[robots["team"] == ("home", "away").index(side)]
        assert set(own["id"]) == {number}
        assert np.allclose([own["x"], own["y"]], np.transpose([place(n) for n in FRAMES]), atol=1e-3)
    assert np.allclose([match.frames.ball["x"], match.frames.ball["y"]], np.transpose([ball(n) for n in FRAMES]), atol=1e-3)
    assert match.heights.z.tolist() == [spec.height] * len(FRAMES) * (spec.height is not None)
    assert (row["score_home"], row["score_away"]) == (spec.score or (None, None))
    events = spec.states.split() + ["end"] * (spec.score is not None)
    assert match.referee["event"].to_list() == events
    stops = match.referee.filter(event="stop")["t_ns"].to_list()
    assert stops[:1] == [DEAD * S // spec.rate][:len(stops)]
    assert [(period.home_attacks, not period.inferred) for period in match.info.periods] == [(1, spec.attacks), (-1, spec.attacks)]
    assert not match.quality["note"].str.contains(r"map|\[units\]|add columns").any()  # which football's users cannot give


@NEEDS_KLOPPY_ALONE
@pytest.mark.parametrize(("score", "known"), [
    ("", None), ("<Score {0}><LocalTeamScore/><VisitingTeamScore/></Score>", None),
    ("<Score {0}><LocalTeamScore>2</LocalTeamScore><VisitingTeamScore>1</VisitingTeamScore></Score>", (2, 1)),
    ("<Score {0}><LocalTeamScore>0</LocalTeamScore><VisitingTeamScore>0</VisitingTeamScore></Score>", (0, 0)),
])
def test_score_of_epts(score: str, known: tuple[int, int] | None) -> None:
    """A score that EPTS does not give is unknown, and 0 : 0 is one that it gives."""
    files = epts(score.format('idLocalTeam="TEAM_A" idVisitingTeam="TEAM_B"'))
    match = read(open_files(list(zip(("meta.xml", "raw.txt"), files, strict=True)), "metrica-epts"))
    assert matches.row(match).select("score_home", "score_away").row(0) == (known or (None, None))


@NEEDS_KLOPPY_ALONE
def test_axes_that_turn() -> None:
    """A dataset with fixed directions tells them; one whose axes turn with the ball's owner is refused."""
    dataset = dataset_of(made("pff"))
    fixed = match_of_dataset(dataset.transform(to_orientation="STATIC_AWAY_HOME"))
    assert {(period.home_attacks, period.inferred) for period in fixed.info.periods} == {(-1, False)}
    with pytest.raises(BadRecording, match="axes that turn with who has the ball"):
        match_of_dataset(dataset.transform(to_orientation="BALL_OWNING_TEAM"))


@NEEDS_KLOPPY
def test_more_goals_than_the_score(monkeypatch: pytest.MonkeyPatch) -> None:
    """Goals that were found beyond the provider's score are said; here in two minutes around a goal."""
    meta, frames = ((FILES / name).read_bytes() for name in MATCH)
    cut = json.dumps(json.loads(frames)[16_000:17_200]).encode()
    source = open_files([(MATCH[0], meta), (MATCH[1], cut)], "skillcorner")
    monkeypatch.setattr("pitchlore.pipeline.importers.football.dataset.score_told", lambda *_: (0, 0))
    said = " ".join(match_of_dataset(dataset_of(source), source).quality["note"])
    assert "1 : 0 goals were found from the ball, but the provider's score is 0 : 0" in said


@NEEDS_KLOPPY_ALONE
@pytest.mark.parametrize("system", ["skillcorner", "kloppy", "tracab", "metrica", "sportec", "secondspectrum"])
def test_coordinates(system: str) -> None:
    """The places do not depend on the coordinate system that a dataset is in; the match's id is of its positions."""
    from kloppy import skillcorner

    dataset = skillcorner.load(*MADE["skillcorner"].make(), coordinates=system)
    match, reported = match_of_dataset(dataset), read(made("skillcorner"))
    assert match.info.match_id.startswith("1-")
    assert match_of_dataset(dataset).info.match_id == match.info.match_id
    for field in ("x", "y"):
        assert np.allclose(match.frames.robots[field], reported.frames.robots[field], atol=2e-3)
        assert np.allclose(match.frames.ball[field], reported.frames.ball[field], atol=2e-3)


def test_nameless_tracks_share_places() -> None:
    """A shirt's number is kept; tracks get places, the longest empty one first, none twice at once."""
    shirts, tracks = [7, 9, 9, 123], [(0, 10), (5, 20), (12, 30), (20.5, 40)]
    stays = [Stay(shirt, 0, 90 * S) for shirt in shirts]
    stays += [Stay(None, int(first * S), int(last * S)) for first, last in tracks]
    found = shirt_numbers(stays).tolist()
    assert found[0] == 7
    # two players wear 9, and no shirt has 123: these are tracks, too, which are there all the time
    assert found[1:4] == [UNNUMBERED, UNNUMBERED + 1, UNNUMBERED + 2]
    # the third track takes the place empty since 10 s; at 20.5 s that of the second is empty for half a second only
    first, second, third, fourth = found[4:]
    assert first == third == UNNUMBERED + 3
    assert len({first, second, fourth}) == 3


@NEEDS_KLOPPY
def test_ball_overhead_is_not_touched(tmp_path: Path) -> None:
    """A ball above everybody's reach is nobody's: touches, possession and situations know its height."""
    from pitchlore.pipeline.settings import EventSettings, TrajectorySettings
    from pitchlore.pipeline.stages.events.derive import events
    from pitchlore.pipeline.stages.trajectories.derive import trajectories

    match = read(source_of("pff", PFF))
    bodies, _ = trajectories(match, TrajectorySettings())
    found = events(bodies, match.referee, match.info.pitch, EventSettings())
    aloft = bodies.with_columns(z=pl.when(pl.col("team") == "ball").then(5.0))
    none = events(aloft, match.referee, match.info.pitch, EventSettings())
    assert len(found.possession)
    assert not len(none.possession)
    receipt, new, _ = take_in(Store(tmp_path), Recording(
        file=FILES / PFF[0], provider="pff", more=tuple(FILES / name for name in PFF[1:])))
    assert new
    assert receipt.details["heights"] == len(match.heights.t_ns)


def test_heights_of_a_log_without_any_change_nothing() -> None:
    """A log declares the channel of heights only if it has one, so that other logs keep their bytes."""
    match = recordings.imported(recordings.RSIM)
    high = replace(match, heights=Heights(match.frames.t_ns[:1], np.float32([1.5])))
    assert b"/ball_height" not in written(match)
    assert b"/ball_height" in written(high)


def test_refusals(monkeypatch: pytest.MonkeyPatch) -> None:
    """An unreadable file is refused in one line that says what to give."""
    with pytest.raises(NotFound, match="names no source") as unknown:
        provider_of("kloppy:opta")
    assert "kloppy:skillcorner" in str(unknown.value)
    with pytest.raises(BadRecording, match="META_DATA RAW_DATA"):
        open_files([("a.json", b"{}")], "skillcorner")
    with pytest.raises(BadRecording, match="RAW_DATA_FEEDS"):
        open_files([("a.json", b"{}"), ("b.json", b"{}")], "signality")
    source = open_files([("a.json", b"{}"), ("b.json", b"{}")], "skillcorner")
    monkeypatch.setitem(sys.modules, "kloppy.skillcorner", None)
    with pytest.raises(NotFound, match=r"the extra pitchlore\[kloppy\]"):
        dataset_of(source)


@NEEDS_KLOPPY
@pytest.mark.parametrize("content", [b'[{"frame": 1, "data": []}, {"frame": 2}]', b'{"frame": 1}\n{"frame": 2}\n', b"<?xml version='1.0'?><a/>"])
def test_nobody_says_whose(content: bytes) -> None:
    """A file that looks like a provider's is refused with how to say whose it is, however long its lines are."""
    with pytest.raises(BadRecording) as refused:
        read(open_source(content + b" " * (2 << 20), "match.json"))
    assert str(refused.value).startswith(
        "match.json: is not a recording of a known format. If it is football data, say whose, as with --from kloppy:skillcorner. ")


@NEEDS_KLOPPY_ALONE
@pytest.mark.parametrize("more", [b"{}", b"<a/>"])
def test_further_file_is_not_passed_over(more: bytes) -> None:
    """Second Spectrum's further file, which kloppy goes on without if it is another's, is refused and not ignored."""
    parts = MADE["secondspectrum-xml"].make()
    with pytest.raises(BadRecording, match="the additional_meta_data beside it is not Second Spectrum's"):
        dataset_of(open_files([(f"part{place}", data) for place, data in enumerate((*parts, more))], "secondspectrum"))


def test_not_the_providers_files() -> None:
    """Files of another kind are refused with the library's reason in one line."""
    with pytest.raises(BadRecording, match="is not read by kloppy as TRACAB") as refused:
        dataset_of(open_files([("a.json", b"{}"), ("b.json", b"{}")], "tracab"))
    assert "\n" not in str(refused.value)


@NEEDS_KLOPPY_ALONE
@pytest.mark.slow
def test_command(call, tmp_path) -> None:
    """The command knows a provider's files again, isolated or not, and takes no map for them."""
    files = files_of("pff", tmp_path)
    words = ("import", "--from", "kloppy:pff", *files, "--data", tmp_path / "data")
    assert call(*words, "--isolate")[0] == 0
    code, out, _ = call(*words)
    assert (code, out.splitlines()[0]) == (0, "0 imported, 1 already here, 0 not imported")
    code, _, err = call(*words, "--map", files[0])
    assert (code, "--map" in err) == (1, True)


# --- XML that means harm ----------------------------------------------------------------------------

#: Documents that a stranger writes; a harmless one is the last.
DTD = '<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/passwd">]>'
HARM = [DTD, DTD.lower(), "<!-- first -->\n" + DTD, '<?pi ?><!DOCTYPE a SYSTEM "pipe">', "<!ENTITY x 'xxx'>"]
PLAIN = '<a name="Müller">&#60;!ENTITY</a>'
#: How a document is encoded, and whether that is read.
ENCODED = {
    "UTF-8": (lambda text: text.encode(), True),
    "its mark": (lambda text: text.encode("utf-8-sig"), True),
    "declared": (lambda text: ('<?xml version="1.0" encoding="utf-8" standalone="no" ?>' + text).encode(), True),
    "UTF-16": (lambda text: text.encode("utf-16"), True),
    "UTF-16 BE, declared": (lambda text: codecs.BOM_UTF16_BE + ("<?xml version='1.0' encoding='UTF-16'?>" + text).encode("utf-16-be"), True),
    "UTF-16 LE": (lambda text: text.encode("utf-16-le"), True),
    "UTF-16 BE": (lambda text: text.encode("utf-16-be"), True),
    "UTF-32": (lambda text: text.encode("utf-32"), True),
    "UTF-32 BE": (lambda text: text.encode("utf-32-be"), True),
    "UTF-32 LE": (lambda text: text.encode("utf-32-le"), True),
    "latin-1": (lambda text: ("<?xml version='1.0' encoding='ISO-8859-1'?>" + text).encode("latin-1"), True),
    "Windows": (lambda text: ('<?xml version="1.0"  encoding = "windows-1252"?>' + text).encode("cp1252"), True),
    "labelled UTF-16": (lambda text: ('<?xml version="1.0" encoding="utf-16"?>' + text).encode(), True),
    "UTF-7": (lambda text: b'<?xml version="1.0" encoding="UTF-7"?>' + text.encode("utf-7"), False),
    "UTF-7 alone": (lambda text: text.encode("utf-7"), False),
    "EBCDIC": (lambda text: ('<?xml version="1.0" encoding="IBM037"?>' + text).encode("cp037"), False),
    "punycode": (lambda text: b'<?xml version="1.0" encoding="punycode"?>' + text.encode("punycode"), False),
    "UCS-4 2143": (lambda text: b"".join(bytes([0, 0, c, 0]) for c in text.encode()), False),
    "half a letter": (lambda text: text.encode("utf-16") + b"\0", False),
}
PACKED = [bytes, gzip.compress, zstandard.compress, lambda data: gzip.compress(data[:9]) + gzip.compress(data[9:])]


@pytest.mark.parametrize("how", ENCODED)
def test_no_dtd_reaches_a_library(how):
    """No document type definition passes, in any encoding, packed or not; what passes says that it is UTF-8."""
    encode, is_read = ENCODED[how]
    for provider, file in ((word, place) for word, each in PROVIDERS.items() for place, name in enumerate(each.files) if name in each.markup):
        def opened(data: bytes, provider: str = provider, file: int = file) -> bytes:
            parts = [(f"{place}.xml", data if place == file else b"<a/>") for place, _ in enumerate(PROVIDERS[provider].files)]
            return open_files(parts, provider).parts[file]

        for pack in PACKED:
            for harm in HARM:
                with pytest.raises(BadRecording, match=rf"^{file}\.xml: (has <!|is not XML|cannot be read in the encoding)") as refused:
                    opened(pack(encode(harm + PLAIN)))
                assert "has <!" in str(refused.value) or not is_read
            if is_read:
                assert opened(pack(encode(PLAIN))) == b'<?xml version="1.0" encoding="UTF-8"?>' + PLAIN.encode()


@pytest.mark.parametrize(("inside", "said"), [
    ('<SplitRegister separator="(x+x+)+y"/>', r"separates fields by '\(x"), ('<SplitRegister separator="&#124;"/>', r"by '\|'"),
    ('<SplitRegister separator=";"><x><SplitRegister separator=":"/></x></SplitRegister>', "by ':'"),
    ('<StringRegister name="x&gt;(a+)+$)(?P&lt;y"/>', "has the name 'x>"), ('<PlayerChannel playerId="1" channelId="."/>', r"name '\.'"),
    ('<BallChannelRef channelId="x>.*)*"/>', "has the name"), ("<b>", "is not XML"), (" " * (16 << 20), "has 16 MiB, more than metadata"),
    ('<SplitRegister separator=";"/><SplitRegister separator=";"><SplitRegister separator=","/></SplitRegister>', ""),
])
def test_separators_are_no_expressions(inside, said):
    """EPTS's separators and names, which become an expression, mean themselves, and no line is gone over twice."""
    parts = [("meta.xml", f'<a separator=":">{inside}</a>'.encode()), ("raw.txt", b"")]
    if not said:
        assert open_files(parts, "metrica-epts").parts[0].endswith(parts[0][1])
        return
    with pytest.raises(BadRecording, match=rf"^meta.xml: .*{said}"):
        open_files(parts, "metrica-epts")


@NEEDS_KLOPPY_ALONE
@pytest.mark.parametrize("kind", [*MADE, "tracab"])
def test_markup_is_complete(kind, monkeypatch):
    """All that reaches kloppy's XML parser was made safe: a stranger's file in another argument's place is not parsed."""
    from lxml import etree, objectify

    parsed, fromstring, iterparse = [], objectify.fromstring, etree.iterparse
    monkeypatch.setattr(objectify, "fromstring", lambda data, *a, **k: (parsed.append(data), fromstring(data, *a, **k))[1])
    monkeypatch.setattr(etree, "iterparse", lambda file, *a, **k: (parsed.append(file.getvalue()), iterparse(file, *a, **k))[1])
    whole = made(kind) if kind in MADE else open_files([("meta", tracab_meta("teams").encode()), ("raw.dat", TRACAB_RAW.encode())], kind)
    spec = PROVIDERS[whole.provider]
    dataset_of(whole)
    assert bool(parsed) == any(part.startswith(b"<") for part in whole.parts), "the parser that is looked at is kloppy's"
    for place, _ in enumerate(whole.parts):
        if place >= len(spec.files) or spec.files[place] not in spec.markup:
            with pytest.raises(BadRecording):
                dataset_of(replace(whole, parts=(*whole.parts[:place], b"<a/>", *whole.parts[place + 1:])))
    assert all(data.startswith(b'<?xml version="1.0" encoding="UTF-8"?>') for data in parsed)


@NEEDS_KLOPPY_ALONE
@pytest.mark.slow
def test_stranger_reads_nothing(call, tmp_path):
    """A DTD that makes a secret a team's name, or names a pipe, is refused at once; kloppy alone prints the secret."""
    from kloppy import sportec

    (tmp_path / "secret").write_text("PASSWORD=hunter2")
    (tmp_path / "x.dtd").write_text(f"<!ENTITY % f SYSTEM '{tmp_path}/secret'><!ENTITY % g \"<!ENTITY x '%f;'>\">%g;")
    os.mkfifo(tmp_path / "pipe")
    meta, raw = (part.decode() for part in MADE["sportec"].make())
    for place, named in (("x.dtd", "meta"), ("pipe", "meta"), ("pipe", "raw")):
        texts = {"meta": meta, "raw": raw}
        texts[named] = texts[named].replace("?>", f'?><!DOCTYPE a [<!ENTITY % d SYSTEM "{tmp_path / place}">%d;]>', 1).replace(
            ' TeamName="', ' TeamName="&x;', 1)
        if place == "x.dtd":
            assert "hunter2" in sportec.load_tracking(texts["meta"].encode(), raw.encode()).metadata.teams[0].name
        for file, text in texts.items():
            (tmp_path / f"{file}.xml").write_text(text)
        code, out, err = call("import", "--from", "kloppy:sportec", tmp_path / "meta.xml", tmp_path / "raw.xml", "--data", tmp_path / "data")
        assert code == 1
        assert f"{named}.xml: has <!DOCTYPE" in out + err
        assert "hunter2" not in out + err


def test_football_is_read_apart(tmp_path, monkeypatch):
    """A provider's files are read in a process of their own, asked for or not, in four times the usual limits; no script runs twice."""
    (tmp_path / "a.json").write_text("{}")
    recording = Recording(file=tmp_path / "a.json", provider="tracab", more=(tmp_path / "a.json",))
    with pytest.raises(BadRecording, match=r"takes longer than 4 times the limit seconds = 0\.001"):
        read_recording(recording, ImportSettings(seconds=0.001))
    monkeypatch.setitem(multiprocessing.current_process()._config, "daemon", True)  # as a worker of Dask is
    monkeypatch.setattr(sys.modules["__main__"], "__spec__", None)
    monkeypatch.setattr(sys.modules["__main__"], "__file__", str(tmp_path / "none.py"), raising=False)
    with pytest.raises(PitchloreError, match=r"is not read by kloppy as TRACAB|kloppy, which reads TRACAB, cannot be loaded"):
        read_recording(recording)


def test_files_are_told_apart_by_content() -> None:
    """Other files are another match; the same ones under another name, or gzipped, are the same."""
    parts = [(f"{place}.gz", gzip.compress(part)) for place, part in enumerate(MADE["skillcorner"].make())]
    assert open_files(parts, "skillcorner").sha256 == made("skillcorner").sha256
    assert open_files([*parts[:1], ("other", b"{}")], "skillcorner").sha256 != made("skillcorner").sha256
