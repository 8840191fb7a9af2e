"""The provider's files that kloppy's wheel ships, read where they are installed and never copied; others, made by code."""

import json
from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

import pytest
from football.skillcorner import THERE

from pitchlore.pipeline.importers.football.providers import open_files
from pitchlore.pipeline.importers.source import SourceFile

#: Skips where kloppy, or its files, are not there.
NEEDS_KLOPPY = pytest.mark.skipif(not THERE, reason="needs the extra kloppy with its test files")

#: Skips where kloppy is not there; its test files may be absent.
NEEDS_KLOPPY_ALONE = pytest.mark.skipif(find_spec("kloppy") is None, reason="needs the extra kloppy")

SKILLCORNER = ("skillcorner_meta_data.json", "skillcorner_v3_raw_data.jsonl")
SIGNALITY = ("signality_meta_data.json", "signality_venue_information.json", *(f"signality_p{half}_raw_data_subset.json" for half in (1, 2)))
PFF = ("pff_metadata_10517.json", "pff_rosters_10517.json", "pff_10517.jsonl")
#: Files of kloppy's own tests, each kind that it has: provider, files, teams, score, samples, and where home attacks by
#: the provider's word in the first and second half (0 where it has none).
KINDS = [
    *(("tracab", (f"tracab_meta{kind}", f"tracab_raw.{raw}"), teams, None, 7, attacks) for kind, teams, attacks in (
        (".json", "Short Name Home - Short Name Away", (-1, 1)), (".xml", "Short Name Home - Short Name Away", (0, 0)),
        ("_2.xml", "home - away", (0, 0)), ("_3.xml", "home - away", (0, 0)),
        ("_4.xml", "Widzew Łódź - Short Name Away", (-1, 1))) for raw in ("dat", "json")
      if raw == "dat" or "home" not in teams),  # these two name no players, whom the JSON form needs
    *(("metrica-epts", (f"epts_metrica_metadata{meta}.xml", f"epts_metrica_tracking{raw}.txt"), "Team A - Team B", None, 100, (1, -1))
      for meta in ("", "_without_score", "_unused_sensor") for raw in ("", "_with_empty_values")),
    ("metrica-csv", ("metrica_home.csv", "metrica_away.csv"), "Home - Away", None, 6, (0, 0)),
    *(("secondspectrum", ("second_spectrum_fake_metadata.xml", raw, *more), teams, score, samples, (0, 0))
      for raw, samples in (("second_spectrum_fake_data.jsonl", 376), ("second_spectrum_fake_data_utf8sig.jsonl", 13))
      for more, teams, score in (((), "home - away", None), (("second_spectrum_fake_metadata.json",), "FK1 - FK2", (2, 1)))),
    *(("sportec", ("sportec_meta.xml", f"sportec_positional{raw}.xml"), "Sport-Club Freiburg - Borussia Mönchengladbach", (1, 0), 202, (0, 0))
      for raw in ("", "_w_referee")),
    *(("statsperform", (f"statsperform_tracking_ma1.{meta}", "statsperform_tracking_ma25.txt"), "Monaco - Reims", (2, 2), 92, (0, 0))
      for meta in ("json", "xml")),
    ("signality", SIGNALITY, "Home Team - Away Team", None, 10, (0, 0)),
    ("skillcorner", SKILLCORNER, "Team Name - Team Name", (1, 0), 6, (-1, 1)),
    ("pff", PFF, "Argentina - France", None, 200, (1, -1)),
    ("pff", ("pff_metadata_3812.json", "pff_rosters_3812.json", "pff_3812.jsonl"), "Senegal - Netherlands", None, 100, (-1, 1)),
]


# --- one match in all kinds of files -------------------------------------------------------------------

#: Frames of each half, metres of the pitch, the frame in which the ball is dead, and when the second half begins, in seconds.
HALF, LENGTH, WIDTH, DEAD, SECOND_S = 50, 105.0, 68.0, 3, 900.0
FRAMES = range(2 * HALF)
Place = tuple[float, float]


def _turned(n: int, x: float, y: float) -> Place:
    """A place of the n-th frame, the other way in the second half."""
    return (x, y) if n < HALF else (-x, -y)


def home_7(n: int) -> Place:
    """Home's only player in the n-th frame, in metres from the centre, +y up."""
    return _turned(n, -30.0, 10.0 + n / 10)


def away_9(n: int) -> Place:
    return _turned(n, 20.0 + n / 10, -5.0)


def ball(n: int) -> Place:
    return n / 10, 2.0


PLAYERS = (("home", 7, home_7), ("away", 9, away_9))


def _halves(n: int) -> tuple[int, int]:
    """The period of the n-th frame, and the frame in it."""
    return n // HALF + 1, n % HALF


def _lines(rows: list[dict]) -> bytes:
    return "\n".join(map(json.dumps, rows)).encode()


def _shares(place: Place) -> Place:
    """A place as Metrica writes it: shares of the pitch from its upper left corner."""
    return round(place[0] / LENGTH + 0.5, 9), round(0.5 - place[1] / WIDTH, 9)


def metrica_csv() -> tuple[bytes, ...]:
    """Metrica's pair of tables."""
    def side(team: str, number: int, place) -> bytes:
        rows = "".join(",".join(map(str, (_halves(n)[0], n + 1, (n + 1) / 25, *_shares(place(n)), *_shares(ball(n))))) + "\n" for n in FRAMES)
        return f",,,{team},,,\n,,,{number},,,\nPeriod,Frame,Time [s],Player{number},,Ball,\n{rows}".encode()

    return side("Home", 7, home_7), side("Away", 9, away_9)


def skillcorner() -> tuple[bytes, ...]:
    """SkillCorner's metadata and positions, of version 3."""
    def player(number: int, team: int) -> dict:
        return {"id": number, "team_id": team, "trackable_object": number, "number": number, "first_name": "A", "last_name": "B", "short_name": "A",
                "player_role": {"id": 1, "name": "Left Winger", "acronym": "LW"}, "start_time": "00:00:00", "end_time": None}

    meta = {"id": 1, "home_team": {"id": 3, "name": "Home"}, "away_team": {"id": 4, "name": "Away"}, "home_team_coach": None, "away_team_coach": None,
            "referees": [], "players": [player(7, 3), player(9, 4)], "ball": {"trackable_object": 55}, "pitch_length": LENGTH, "pitch_width": WIDTH,
            "home_team_score": 2, "away_team_score": 1, "home_team_side": ["left_to_right", "right_to_left"], "date_time": "2023-08-11T18:00:00Z"}
    lines = []
    for n in FRAMES:
        period, at = _halves(n)
        bodies = [dict(zip("xy", place(n), strict=True)) | {"player_id": number, "is_detected": True} for _, number, place in PLAYERS]
        lines.append({"frame": n, "timestamp": f"00:{45 * (period - 1):02d}:{at / 10:05.2f}", "period": period,
                      "ball_data": dict(zip("xyz", (*ball(n), 0.5), strict=True)) | {"is_detected": True},
                      "possession": {"player_id": None, "group": "home team"}, "player_data": bodies})
    return json.dumps(meta).encode(), _lines(lines)


def epts(score: str = "") -> tuple[bytes, ...]:
    """EPTS as Metrica writes it, with the XML of a score."""
    def parameters(kind: str, **values: object) -> str:
        each = "".join(f"<ProviderParameter><Name>{name}</Name><Value>{value}</Value></ProviderParameter>" for name, value in values.items())
        return f"<{kind}>{each}</{kind}>"

    halves = parameters("ProviderGlobalParameters", first_half_start=1, first_half_end=HALF, second_half_start=HALF + 1, second_half_end=2 * HALF)
    teams = "".join(f'<Team id="{team}"><Name>{name}</Name>{parameters("ProviderTeamsParameters", attack_direction_first_half=way)}</Team>'
                    for team, name, way in (("TEAM_A", "Home", "left_to_right"), ("TEAM_B", "Away", "right_to_left")))
    parts = parameters("ProviderPlayerParameters", position_type="Unknown", position_index=-1, position_x=0.0, position_y=0.0)
    players = "".join(f'<Player id="P{n}" teamId="{team}"><Name>P{n}</Name><ShirtNumber>{n}</ShirtNumber>{parts}</Player>'
                      for n, team in ((7, "TEAM_A"), (9, "TEAM_B")))
    channels = "".join(f'<Channel id="{axis}"><Name>position_{axis}</Name><Unit>normalized</Unit></Channel>' for axis in "xy")
    sensor = f'<Devices><Device id="d"><Name>D</Name><Sensors><Sensor id="position"><Name>Position</Name><Channels>{channels}</Channels></Sensor></Sensors></Device></Devices>'
    of_players = "".join(f'<PlayerChannel channelId="{axis}" id="player{n}_{axis}" playerId="P{n}"/>' for n in (7, 9) for axis in "xy")
    split = "".join('<SplitRegister separator=",">' + "".join(f'<PlayerChannelRef playerChannelId="player{n}_{axis}"/>' for axis in "xy") + "</SplitRegister>"
                    for n in (7, 9))
    of_ball = '<SplitRegister separator=","><BallChannelRef channelId="x"/><BallChannelRef channelId="y"/></SplitRegister>'
    meta = (
        f'<main><Metadata><GlobalConfig><FileDate>2021-09-14T08:56:31.465Z</FileDate><ProviderName>Metrica Sports</ProviderName><FrameRate>25.0</FrameRate>{halves}</GlobalConfig>'
        f'<Sessions><Session id="s"><SessionType>Match</SessionType><Start>2021-09-14T08:56:31.465Z</Start><MatchParameters>{score}</MatchParameters>'
        f'<FieldSize><Width>{LENGTH:g}</Width><Height>{WIDTH:g}</Height></FieldSize></Session></Sessions><Teams>{teams}</Teams><Players>{players}</Players>'
        f'{sensor}<PlayerChannels>{of_players}</PlayerChannels></Metadata><DataFormatSpecifications><DataFormatSpecification endFrame="{2 * HALF}" '
        f'separator=":" startFrame="1"><StringRegister name="frameCount"/><SplitRegister separator=";">{split}</SplitRegister>{of_ball}'
        "</DataFormatSpecification></DataFormatSpecifications></main>")
    rows = [":".join((str(n + 1), ";".join(",".join(map(str, _shares(place(n)))) for place in (home_7, away_9)), ",".join(map(str, _shares(ball(n))))))
            for n in FRAMES]
    return meta.encode(), "\n".join(rows).encode()


def secondspectrum(*, xml: bool, names: bool) -> tuple[bytes, ...]:
    """Second Spectrum's metadata in XML, with the names beside it or without, or all in JSON."""
    spans = [(0, 1000), (900_000, 901_000)]  # milliseconds
    periods = "".join(f'<period iId="{i}" iStartFrame="{first}" iEndFrame="{last}"/>' for i, (first, last) in enumerate(spans, 1))
    meta = f'<MetaData><match iFrameRateFps="25" fPitchXSizeMeters="{LENGTH}" fPitchYSizeMeters="{WIDTH}">{periods}</match></MetaData>'
    facts = {"description": "Home - Away : 2023-8-11", "year": 2023, "month": 8, "day": 11, "pitchLength": LENGTH, "pitchWidth": WIDTH, "fps": 25.0,
             "periods": [{"number": i, "startFrameIdx": first, "endFrameIdx": last} for i, (first, last) in enumerate(spans, 1)],
             "homeScore": 2, "awayScore": 1, "ssiId": "1", "homeOptaId": 3, "awayOptaId": 4,
             **{f"{side}Players": [{"name": "A", "number": number, "position": "LW", "optaId": f"p{number}"}] for side, number, _ in PLAYERS}}
    rows = [{"period": _halves(n)[0], "frameIdx": _halves(n)[1], "gameClock": _halves(n)[1] / 25, "wallClock": 0, "live": n != DEAD, "lastTouch": "home",
             "ball": {"xyz": [*ball(n), 0.5], "speed": 1.0},
             **{f"{side}Players": [{"playerId": f"p{number}", "number": number, "xyz": [*place(n), 0.0], "speed": 1.0}] for side, number, place in PLAYERS}}
            for n in FRAMES]
    told = json.dumps(facts).encode()
    return (meta.encode(), _lines(rows), told)[:2 + names] if xml else (told, _lines(rows))


def sportec() -> tuple[bytes, ...]:
    """The DFL's metadata and positions: a set of frames for each body and half."""
    def team(side: str, number: int) -> str:
        role = {"home": "home", "away": "guest"}[side]
        return (f'<Team TeamId="{side}" TeamName="{side.title()}" Role="{role}"><TrainerStaff/><Players><Player PersonId="p{number}" ShirtNumber="{number}" '
                f'FirstName="A" LastName="B" Shortname="A" Starting="true"/></Players></Team>')

    meta = (
        '<?xml version="1.0" encoding="UTF-8"?><PutDataRequest><MatchInformation>'
        '<General KickoffTime="2023-08-11T18:00:00+02:00" MatchDay="1" MatchId="1" Result="2:1"/>'
        f'<Environment PitchX="{LENGTH}" PitchY="{WIDTH}"/><Teams>{"".join(team(side, number) for side, number, _ in PLAYERS)}</Teams>'
        '<OtherGameInformation TotalTimeFirstHalf="2000" TotalTimeSecondHalf="2000"/></MatchInformation></PutDataRequest>')

    def frames(whose: str, place, half: int) -> str:
        each = "".join(
            f'<Frame N="{(10_000, 100_000)[half] + at}" X="{place(n)[0]}" Y="{place(n)[1]}" Z="0.5" S="1" BallPossession="1" BallStatus="{int(n != DEAD)}"/>'
            for n in FRAMES for period, at in [_halves(n)] if period == half + 1)
        return f'<FrameSet GameSection="{("firstHalf", "secondHalf")[half]}" {whose}>{each}</FrameSet>'

    bodies = [*((f'TeamId="{side}" PersonId="p{number}"', place) for side, number, place in PLAYERS), ('TeamId="BALL" PersonId="b"', ball)]
    sets = "".join(frames(whose, place, half) for half in (0, 1) for whose, place in bodies)
    return meta.encode(), f'<?xml version="1.0"?><PutDataRequest><Positions>{sets}</Positions></PutDataRequest>'.encode()


def statsperform(*, xml: bool) -> tuple[bytes, ...]:
    """Stats Perform's MA1 in XML or JSON, and MA25, whose origin is the upper left corner."""
    periods = [{"id": 1, "start": "2023-08-11T18:00:00Z", "end": "2023-08-11T18:00:01Z"},
               {"id": 2, "start": "2023-08-11T18:15:00Z", "end": "2023-08-11T18:15:01Z"}]
    teams = [{"id": side, "name": side.title(), "position": side} for side, *_ in PLAYERS]
    players = [{"playerId": f"p{number}", "firstName": "A", "lastName": "B", "matchName": "A", "shirtNumber": number} for _, number, _ in PLAYERS]

    def tag(name: str, facts: dict, inside: str = "") -> str:
        return f"<{name} " + " ".join(f'{key}="{value}"' for key, value in facts.items()) + f">{inside}</{name}>"

    if xml:
        lineups = "".join(tag("lineUp", {"contestantId": team["id"], "formationUsed": ""}, tag("player", player)) for team, player in zip(teams, players, strict=True))
        meta = (
            f'<match><matchInfo id="1" date="2023-08-11Z" week="1"><contestants>{"".join(tag("contestant", team) for team in teams)}</contestants></matchInfo>'
            f'<liveData><matchDetails><periods>{"".join(tag("period", period) for period in periods)}</periods><scores><total home="2" away="1"/></scores>'
            f"</matchDetails>{lineups}</liveData></match>")
    else:
        meta = json.dumps({"matchInfo": {"id": "1", "date": "2023-08-11Z", "week": "1", "contestant": teams}, "liveData": {
            "matchDetails": {"period": periods, "scores": {"total": {"home": 2, "away": 1}}},
            "lineUp": [{"contestantId": team["id"], "formationUsed": "", "player": [player]} for team, player in zip(teams, players, strict=True)]}})

    def corner(place: Place) -> str:
        return f"{place[0] + LENGTH / 2},{WIDTH / 2 - place[1]}"

    rows = [f"{_halves(n)[1] * 40};{_halves(n)[1] * 40},{_halves(n)[0]},{int(n == DEAD)}:0,p7,7,{corner(home_7(n))};4,p9,9,{corner(away_9(n))};:{corner(ball(n))},0.5;"
            for n in FRAMES]
    return meta.encode(), "\n".join(rows).encode()


def signality() -> tuple[bytes, ...]:
    """Signality's match, venue, and a file of positions for each half, whose last frame is its end."""
    meta = {f"team_{side}_{word}": value for side, number, _ in PLAYERS
            for word, value in (("name", side.title()), ("players", [{"name": "A", "jersey_number": number}]))}
    feeds = [[{"utc_time": 1_691_776_800_000 + half * 900_000 + 40 * (at + 1), "idx": at, "match_time": 40 * (at + 1),
               "state": "end" if at == HALF - 1 else "stopped" if n == DEAD else "running", "ball": {"position": [*ball(n), 0.5], "team": None},
               **{f"{side}_team": [{"jersey_number": number, "position": place(n), "speed": 1.0}] for side, number, place in PLAYERS}}
              for at, n in enumerate(FRAMES[half * HALF:][:HALF])] for half in (0, 1)]
    return tuple(json.dumps(part).encode() for part in (meta, {"pitch_size": [LENGTH, WIDTH]}, *feeds))


def pff() -> tuple[bytes, ...]:
    """PFF's metadata, roster and positions."""
    meta = {"id": "1", "homeTeam": {"id": "3", "name": "Home"}, "awayTeam": {"id": "4", "name": "Away"}, "homeTeamStartLeft": True, "week": 1, "fps": 25.0,
            "date": "2023-08-11T18:00:00", "stadium": {"pitches": [{"length": LENGTH, "width": WIDTH}]}}
    roster = [{"player": {"id": f"p{number}", "nickname": "A"}, "positionGroupType": "LW", "shirtNumber": str(number), "team": {"id": team}}
              for team, (_, number, _) in zip("34", PLAYERS, strict=True)]
    events = {0: "FIRSTKICKOFF", DEAD: "OUT", DEAD + 1: "OTB", HALF: "SECONDKICKOFF"}
    rows = [{"frameNum": (_halves(n)[0] - 1) * 900 * 25 + _halves(n)[1], "period": _halves(n)[0], "periodElapsedTime": _halves(n)[1] / 25,
             "ballsSmoothed": dict(zip("xyz", (*ball(n), 0.5), strict=True)),
             "game_event": {"game_event_type": events[n], "home_ball": True} if n in events else None,
             **{f"{side}PlayersSmoothed": [{"jerseyNum": str(number)} | dict(zip("xy", place(n), strict=True))] for side, number, place in PLAYERS}}
            for n in FRAMES]
    return json.dumps([meta]).encode(), json.dumps(roster).encode(), _lines(rows)


class Made(NamedTuple):
    """A kind that is made by code, and what its files tell: score, where home attacks, when the second half begins, the ball's state."""

    provider: str
    make: Callable[[], tuple[bytes, ...]]
    score: tuple[int, int] | None = None
    attacks: bool = False
    second_s: float = HALF / 25
    states: str = "play stop play half play"
    names: str = "Home - Away"
    rate: int = 25
    height: float | None = 0.5


MADE = {
    "metrica-csv": Made("metrica-csv", metrica_csv, states="play half play", height=None),
    "metrica-epts": Made("metrica-epts", epts, attacks=True, states="play half play", height=None),
    "skillcorner": Made("skillcorner", skillcorner, (2, 1), attacks=True, second_s=HALF / 10, states="play half play", rate=10),
    "secondspectrum-xml": Made("secondspectrum", partial(secondspectrum, xml=True, names=False), names="home - away"),
    "secondspectrum-both": Made("secondspectrum", partial(secondspectrum, xml=True, names=True), (2, 1)),
    "secondspectrum-json": Made("secondspectrum", partial(secondspectrum, xml=False, names=True), (2, 1)),
    "sportec": Made("sportec", sportec, (2, 1), second_s=3600.0),
    "statsperform-xml": Made("statsperform", partial(statsperform, xml=True), (2, 1), second_s=SECOND_S),
    "statsperform-json": Made("statsperform", partial(statsperform, xml=False), (2, 1), second_s=SECOND_S),
    "signality": Made("signality", signality, second_s=SECOND_S, states="play stop play half play stop"),
    "pff": Made("pff", pff, attacks=True, second_s=SECOND_S),
}


def made(kind: str) -> SourceFile:
    """The files of a kind, opened."""
    return open_files([(f"part{place}", data) for place, data in enumerate(MADE[kind].make())], MADE[kind].provider)


def files_of(kind: str, folder: Path) -> list[Path]:
    """The files of a kind, written."""
    paths = [folder / f"{kind}-{place}" for place, _ in enumerate(MADE[kind].make())]
    for path, data in zip(paths, MADE[kind].make(), strict=True):
        path.write_bytes(data)
    return paths
