"""The provider's files that kloppy's wheel ships, read where they are installed and never copied; others, made by code."""

import json
from functools import cache
from importlib.util import find_spec

import pytest
from football.skillcorner import THERE, source_of

from pitchlore.pipeline.importers.football.dataset import match_of_dataset
from pitchlore.pipeline.importers.football.providers import dataset_of
from pitchlore.pipeline.matches.frame import MatchLog

#: Skips where kloppy, or its files, are not there.
NEEDS_KLOPPY = pytest.mark.skipif(not THERE, reason="needs the extra kloppy with its test files")

#: Skips where kloppy is not there; its test files may be absent.
NEEDS_KLOPPY_ALONE = pytest.mark.skipif(find_spec("kloppy") is None, reason="needs the extra kloppy")

#: A recording of each provider: its files in the provider's order.
RECORDINGS = {
    "skillcorner": ("skillcorner_meta_data.json", "skillcorner_v3_raw_data.jsonl"),
    "secondspectrum": ("second_spectrum_fake_metadata.xml", "second_spectrum_fake_data.jsonl"),
    "tracab": ("tracab_meta.json", "tracab_raw.json"),
    "metrica-csv": ("metrica_home.csv", "metrica_away.csv"),
    "metrica-epts": ("epts_metrica_metadata.xml", "epts_metrica_tracking.txt"),
    "sportec": ("sportec_meta.xml", "sportec_positional.xml"),
    "statsperform": ("statsperform_tracking_ma1.json", "statsperform_tracking_ma25.txt"),
    "signality": (
        "signality_meta_data.json", "signality_venue_information.json", "signality_p1_raw_data_subset.json",
        "signality_p2_raw_data_subset.json"),
    "pff": ("pff_metadata_10517.json", "pff_rosters_10517.json", "pff_10517.jsonl"),
}


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
    ("signality", RECORDINGS["signality"], "Home Team - Away Team", None, 10, (0, 0)),
    ("skillcorner", RECORDINGS["skillcorner"], "Team Name - Team Name", (1, 0), 6, (-1, 1)),
    ("pff", RECORDINGS["pff"], "Argentina - France", None, 200, (1, -1)),
    ("pff", ("pff_metadata_3812.json", "pff_rosters_3812.json", "pff_3812.jsonl"), "Senegal - Netherlands", None, 100, (-1, 1)),
]


@cache
def shipped(provider: str) -> MatchLog:
    """The match of a provider's shortest recording."""
    source = source_of(provider, RECORDINGS[provider])
    return match_of_dataset(dataset_of(source), source)


# --- one match in three kinds of files ----------------------------------------------------------------

#: Places in metres from the centre, +y up: home's 7, away's 9 and the ball, in the n-th frame.
HOME_7, AWAY_9, BALL = (lambda n: (-30.0, 10.0 + n)), (lambda n: (20.0 + n, -5.0)), (lambda n: (float(n), 2.0))
FRAMES, LENGTH, WIDTH = 10, 105.0, 68.0


def _shares(place: tuple[float, float]) -> tuple[float, float]:
    """A place as Metrica writes it: shares of the pitch from its upper left corner."""
    return round(place[0] / LENGTH + 0.5, 9), round(0.5 - place[1] / WIDTH, 9)


def metrica_csv() -> tuple[bytes, ...]:
    """Metrica's pair of tables."""
    def side(team: str, number: int, place) -> bytes:
        rows = "".join(",".join(map(str, (1, n + 1, (n + 1) / 25, *_shares(place(n)), *_shares(BALL(n))))) + "\n" for n in range(FRAMES))
        return f",,,{team},,,\n,,,{number},,,\nPeriod,Frame,Time [s],Player{number},,Ball,\n{rows}".encode()

    return side("Home", 7, HOME_7), side("Away", 9, AWAY_9)


def skillcorner() -> tuple[bytes, ...]:
    """SkillCorner's metadata and positions, of version 3."""
    def player(number: int, team: int) -> dict:
        return {"id": number, "team_id": team, "trackable_object": number, "number": number, "first_name": "A", "last_name": "B", "short_name": "A",
                "player_role": {"id": 1, "name": "Left Winger", "acronym": "LW"}, "start_time": "00:00:00", "end_time": None}

    meta = {"id": 1, "home_team": {"id": 3, "name": "Home"}, "away_team": {"id": 4, "name": "Away"}, "home_team_coach": None, "away_team_coach": None,
            "referees": [], "players": [player(7, 3), player(9, 4)], "ball": {"trackable_object": 55}, "pitch_length": LENGTH, "pitch_width": WIDTH,
            "home_team_score": 2, "away_team_score": 1, "home_team_side": ["left_to_right", "right_to_left"], "date_time": "2023-08-11T18:00:00Z"}
    lines = []
    for n in range(FRAMES):
        bodies = [dict(zip("xy", place(n), strict=True)) | {"player_id": number, "is_detected": True} for number, place in ((7, HOME_7), (9, AWAY_9))]
        ball = dict(zip("xy", BALL(n), strict=True)) | {"z": 0.0, "is_detected": True}
        lines.append(json.dumps({"frame": n, "timestamp": f"00:00:{n / 10:05.2f}", "period": 1, "ball_data": ball,
                                 "possession": {"player_id": None, "group": "home team"}, "player_data": bodies}))
    return json.dumps(meta).encode(), "\n".join(lines).encode()


def epts(score: str = "") -> tuple[bytes, ...]:
    """EPTS as Metrica writes it, with the XML of a score."""
    def parameters(kind: str, **values: object) -> str:
        each = "".join(f"<ProviderParameter><Name>{name}</Name><Value>{value}</Value></ProviderParameter>" for name, value in values.items())
        return f"<{kind}>{each}</{kind}>"

    halves = parameters("ProviderGlobalParameters", first_half_start=1, first_half_end=FRAMES, second_half_start="", second_half_end="")
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
    ball = '<SplitRegister separator=","><BallChannelRef channelId="x"/><BallChannelRef channelId="y"/></SplitRegister>'
    meta = (
        f'<main><Metadata><GlobalConfig><FileDate>2021-09-14T08:56:31.465Z</FileDate><ProviderName>Metrica Sports</ProviderName><FrameRate>25.0</FrameRate>{halves}</GlobalConfig>'
        f'<Sessions><Session id="s"><SessionType>Match</SessionType><Start>2021-09-14T08:56:31.465Z</Start><MatchParameters>{score}</MatchParameters>'
        f'<FieldSize><Width>{LENGTH:g}</Width><Height>{WIDTH:g}</Height></FieldSize></Session></Sessions><Teams>{teams}</Teams><Players>{players}</Players>'
        f'{sensor}<PlayerChannels>{of_players}</PlayerChannels></Metadata><DataFormatSpecifications><DataFormatSpecification endFrame="{FRAMES}" '
        f'separator=":" startFrame="1"><StringRegister name="frameCount"/><SplitRegister separator=";">{split}</SplitRegister>{ball}'
        "</DataFormatSpecification></DataFormatSpecifications></main>")
    rows = [":".join((str(n + 1), ";".join(",".join(map(str, _shares(place(n)))) for place in (HOME_7, AWAY_9)), ",".join(map(str, _shares(BALL(n))))))
            for n in range(FRAMES)]
    return meta.encode(), "\n".join(rows).encode()


#: Kinds that are made by code: their files, the score that they tell, and whether they tell where home attacks.
MADE = {"metrica-csv": (metrica_csv, None, False), "skillcorner": (skillcorner, (2, 1), True), "metrica-epts": (epts, None, True)}
