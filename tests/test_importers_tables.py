"""Tables as people have them: nothing is silently wrong, whatever they leave unsaid."""

import io
from functools import cache
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from support.recordings import read

from pitchlore.pipeline import matches
from pitchlore.pipeline.base.errors import BadRecording, BadSettings
from pitchlore.pipeline.importers.forms.presets import presets, titles
from pitchlore.pipeline.importers.tracking.mapping import load_map
from pitchlore.pipeline.matches.frame import MatchLog

#: Goals of a half, s: two at +x and one at -x; seconds of a half, samples a second.
GOALS, HALF_S, HZ = ((30, 1), (60, 1), (90, -1)), 120, 10
BLUE = [(30, "blue"), (60, "blue"), (90, "yellow")]
BOTH = [*BLUE, *((t + HALF_S, team) for t, team in BLUE)]


@cache
def half(number: int = 1, teams: tuple[str, str] = ("blue", "yellow")) -> pl.DataFrame:
    """Two minutes of a goalkeeper and two others a side on a VSSS pitch; in the second half sides are changed."""
    t = np.arange(HALF_S * HZ) / HZ
    ball = np.stack([0.5 * np.sin(t / 3), 0.6 * np.sin(t / 2)], axis=1)
    for at, end in GOALS:
        near = (t > at - 1) & (t <= at)
        ball[near] = np.stack([end * 0.8 * (t[near] - at + 1), 0 * t[near]], axis=1)
        ball[(t > at) & (t < at + 2.5)] = 0
    bodies = [("ball", None, ball[:, 0], ball[:, 1])]
    for team, end in zip(teams, (-1, 1), strict=True):
        bodies.append((team, 0, end * 0.7 + 0.01 * np.sin(t), 0.15 * np.sin(t)))
        bodies += [(team, n, end * (0.2 * n + 0.1 * np.sin(t + n)), 0.6 * np.sin(t * 0.7 + 3 * n)) for n in (1, 2)]
    sign = 1 if number == 1 else -1
    return pl.concat(
        pl.DataFrame({"frame": np.arange(len(t)) + (number - 1) * len(t), "t": t, "team": team,
                      "player": pl.Series([player] * len(t), dtype=pl.Int64), "x": sign * x, "y": sign * y})
        for team, player, x, y in bodies).sort("frame", maintain_order=True)


def halves() -> pl.DataFrame:
    """Two halves that both count from 0; blue 4 : 2 yellow."""
    return pl.concat(half(n).with_columns(segment=pl.lit(f"{n}.")) for n in (1, 2))


def scored(table: pl.DataFrame, *, anew: bool = False) -> pl.DataFrame:
    """The table with a score; anew: each half counts from 0 : 0."""
    later = 0 if anew else pl.col("segment") == "2."
    done = [sum((pl.col("t") >= at).cast(pl.Int64) for at, end in GOALS if end == sign) + goals * later
            for sign, goals in ((1, 2), (-1, 1))]
    return table.with_columns(score_home=done[0], score_away=done[1])


def match(table: pl.DataFrame, mapping: str = "") -> MatchLog:
    return read(table.write_csv().encode(), "game.csv", mapping=load_map(mapping))


def goals(log: MatchLog) -> list[tuple[int, str]]:
    """Goals, to the nearest half minute, and the scoring team's name."""
    teams = {"home": log.info.home, "away": log.info.away}
    told = log.referee.filter(pl.col("event") == "goal").select("t_ns", pl.col("team").cast(pl.String))
    return [(round(t_ns / 30e9) * 30, teams[team]) for t_ns, team in told.iter_rows()]


def said(log: MatchLog) -> str:
    return "; ".join(log.quality.filter(pl.col("flaw") == "assumed")["note"])


# --- time ---------------------------------------------------------------------------------------------

@pytest.mark.parametrize(("table", "by"), [
    (halves(), "by segment"),
    (halves().drop("segment"), "by time itself"),
    (halves().rename({"segment": "period"}).with_columns(frame=(pl.col("t") * HZ).round().cast(pl.Int64)), "by period"),
    (halves().sort("t", maintain_order=True), "by segment"),
    (halves().sort("team", "player", "segment", "t", nulls_last=True), "by segment"),
    (halves().drop("segment").sort("team", "player", "frame"), "by time itself"),
    (halves().with_columns(segment=pl.col("segment").str.head(1)).sort("segment", descending=True, maintain_order=True), "by segment"),
    (halves().with_columns(t=pl.col("t") + 110 * (pl.col("segment") == "2.")), "by segment"),  # stoppage time
    (halves().with_columns(t=pl.col("t") + 10 * (pl.col("segment") == "1.")), "by segment"),  # the first begins later
    (halves().drop("segment").filter((pl.col("team") != "blue") | (pl.col("player") != 1) | (pl.col("frame") > 1200)), "by time itself"),
    (scored(halves()), "by segment"),
    (scored(halves(), anew=True), "by segment"),
    (scored(halves()).with_columns(game_state=pl.lit("play")), "by segment"),
])
def test_time_that_begins_anew(table: pl.DataFrame, by: str) -> None:
    """Halves that both count from 0 follow each other, however the table is sorted; sides change, goals are whose they are."""
    log = match(table)
    assert goals(log) == BOTH
    assert log.frames.t_ns.max() == int((2 * HALF_S - 0.1) * 1e9)
    assert [(round(p.start_ns / 1e9), p.home_attacks) for p in log.info.periods] == [(0, 1), (HALF_S, -1)]
    assert log.referee.filter(pl.col("event") == "half").height == 1
    assert said(log) == f"time begins anew: 2 periods were put one after the other, {by}"


def test_names_that_stand_twice() -> None:
    """A column of no use that stands twice harms nothing, in either form; a time beyond all numbers is left out."""
    for table in (half(), wide("{team}_{n}_{q}", "ball_{q}")):
        head, _, rows = table.with_columns(one=pl.lit(1), two=pl.lit(2)).write_csv().partition("\n")
        assert goals(read(f"{head.replace('one', 'note').replace('two', 'note')}\n{rows}".encode(), "game.csv")) == BLUE
    assert goals(match(half().with_columns(frame=pl.col("frame") * 1.0).drop("t").with_columns(
        frame=pl.when(pl.col("frame") == 7).then(1e307).otherwise("frame")), "time = {hz = 10}")) == BLUE


def test_time_that_does_not() -> None:
    """A copy of the match, a late frame, segments that come back and a clock that is mended begin no half; the last is said."""
    one = half()
    late = one.with_row_index().sort(pl.when(pl.col("frame") == 300).then(pl.col("index") + 500).otherwise("index")).drop("index")
    for table in (pl.concat([one, one]), late, one.with_columns(segment=(pl.col("t") // 10 % 2).cast(pl.String))):
        log = match(table)
        assert goals(log) == BLUE
        assert "begins anew" not in said(log)
    assert "time goes back by 4.9 s" in said(match(one.with_columns(t=pl.col("t") - 5.0 * (pl.col("t") > 70))))
    with pytest.raises(BadRecording, match="time that begins anew, and nothing tells to which half a row belongs"):
        match(halves().drop("segment").with_columns(frame=pl.col("frame") % 1200).sort("team", "player", maintain_order=True))
    mixed = halves().drop("segment").sort("t", maintain_order=True)
    for table in (mixed, mixed.drop("frame"), one.drop("frame").with_columns(pl.col("t").floor())):
        with pytest.raises(BadRecording, match=r"several places at one time, .* Write the half of each row in a column period"):
            match(table)


# --- numbers for "not seen" ---------------------------------------------------------------------------

def lost(value: float, of: str = "ball", share: int = 20) -> pl.DataFrame:
    """The first half with a number in place of every so many-th place, but not where a goal is."""
    ball = pl.col("team") == "ball"
    at = (ball if of[:4] == "ball" else ~ball) & (pl.col("frame") % share == 7) & (pl.col("frame") % 300 > 40)
    return half().with_columns(pl.when(at).then(value).otherwise(pl.col(axis)).alias(axis) for axis in of.partition(", ")[2] or "xy")


@pytest.mark.parametrize("of", ["ball", "robots", "robots, y"])
@pytest.mark.parametrize("value", [-999.0, 9999.0, -1.0, 1e6, 1e9, 255.0, 0.0, 0.25])
def test_not_seen(value: float, of: str) -> None:
    """A number that stands for "not seen" on both axes or one is found, made null and said; league, pitch and goals stay."""
    log = match(lost(value, of))
    assert (log.info.pitch.kind, log.info.pitch.length, goals(log)) == ("vsss", 1.5, BLUE)
    assert f"places of {value:g} recur exactly and are no places: taken for not seen" in said(log)
    bodies = log.frames.ball if of == "ball" else log.frames.robots
    assert not np.isin(bodies["y"], np.float32(value)).any() or value == 0
    if of == "ball":  # where it is put to the centre it is seen
        assert 0 <= (bodies["y"] == 0).sum() - (match(half()).frames.ball["y"] == 0).sum() < 5  # those beside it stay there


@pytest.mark.parametrize(("x", "y", "there"), [(-1.0, -1.0, 5.0), (0.0, 0.0, 5.0), (0.3, 0.3, 5.0), (-0.3, 0.2, 6.0), (-9.0, 0.2, 6.0)])
def test_never_seen(x: float, y: float, there: float) -> None:
    """A robot that is nowhere but at one number on both axes was not seen; one that stands elsewhere was, however far off."""
    at = (pl.col("team") == "yellow") & (pl.col("player") == 2)
    log = match(half().with_columns(x=pl.when(at).then(x).otherwise("x"), y=pl.when(at).then(y).otherwise("y")), "pitch = {kind = 'vsss', length = 1.5}")
    assert len(log.frames.robots) / len(log.frames) == there
    assert ("not seen" in said(log)) == (there < 6)
    assert "not seen" not in said(match(half()))


def test_heading_that_is_not_known() -> None:
    """A number for "not known" among headings and velocities is left out and said; the others are radians."""
    turned = half().with_columns(heading=pl.when(pl.col("team") == "ball").then(-999.0).otherwise((pl.col("t") * 0.7).sin()))
    log = match(turned)
    assert "heading is -999 in rows where it is not known: left out" in said(log)
    assert np.isfinite(log.frames.robots["theta"]).all()
    back = half().with_columns(heading=pl.when(pl.col("team") == "yellow").then(np.pi).otherwise((pl.col("t") * 0.7).sin() / 9))
    assert "heading is" not in said(match(back))  # who faces backwards is known


# --- origin and unit ----------------------------------------------------------------------------------

def moved(along: float, across: float, factor: tuple[float, float]) -> pl.DataFrame:
    return half().with_columns(x=(pl.col("x") + along) * factor[0], y=(pl.col("y") + across) * factor[1])


@pytest.mark.parametrize(("table", "mapping", "says"), [
    (moved(0.75, 0.65, (1, 1)), "", "read as m from a corner of a pitch of 1.5 x 1.3 m"),
    (moved(0.75, 0.65, (100, 100)), "", "read as cm from a corner of a pitch of 1.5 x 1.3 m"),
    (moved(0.75, 0.65, (1000, 1000)), "", "read as mm from a corner of a pitch of 1.5 x 1.3 m"),
    (moved(0, 0, (100, 100)), "", "read as cm from the centre of a pitch of 1.5 x 1.3 m"),
    (moved(0.75, -0.65, (1, 1)), "axes = {centre = [0.75, -0.65]}", ""),
    (moved(0.75, -0.65, (1, 1)), "", "read as m from a centre at 0.75, -0.65 of a pitch of 1.5 x 1.3 m"),
    (moved(0.75, 0, (1000, 1000)), "", "read as mm from a centre at 750, 0 of a pitch"),
    (moved(0, -0.65, (1, 1)), "", "[axes] centre = [0.0, -0.65]"),
    (moved(0.75, 0.65, (1 / 1.5, 1 / 1.3)), "units = {length = 'share'}\npitch = {kind = 'vsss'}", ""),
    (moved(0.75, 0.65, (100 / 1.5, 100 / 1.3)), "units = {length = 'percent'}\npitch = {kind = 'vsss'}", ""),
    (moved(0, 0, (1 / 0.75, 1 / 0.65)), "units = {length = 'half'}\npitch = {kind = 'vsss'}", ""),
    (moved(0.75, 0.65, (80, 50)), "units = {metres = [0.0125, 0.02]}\naxes = {origin = 'corner'}", ""),
])
def test_origin(table: pl.DataFrame, mapping: str, says: str) -> None:
    """Places from a corner, in other units or in parts of the pitch become metres from the centre, by a map or where one reading fits."""
    log, usual = match(table, mapping), match(half())
    assert log.info.pitch == usual.info.pitch
    assert np.allclose(log.frames.robots["x"], usual.frames.robots["x"], atol=1e-5)
    assert goals(log) == BLUE
    assert says in said(log)


@pytest.mark.parametrize(("table", "says"), [
    (moved(0.75, 0.65, (1 / 1.5, 1 / 1.3)), r"all bodies in one quarter .* \[units\] length = \"share\""),
    (moved(0.75, 0.65, (100 / 1.5, 100 / 1.3)), r"all bodies in one quarter .* \"percent\""),
    (moved(0.75, 0.65, (1, 0.5)), r"one quarter .* \[axes\] origin = \"corner\""),
    (moved(0.75, 0.65, (80, 60)), r"one quarter .* \[axes\] origin = \"corner\""),  # as of 120 x 80 yards
    (moved(0, 0, (400, 300)), r"further out than any pitch .* \[units\] length = \"m\""),
    (moved(0, 0, (1 / 0.75, 1 / 0.65)), r"reach as far across as along .* \[pitch\] kind"),
])
def test_origin_that_nothing_tells(table: pl.DataFrame, says: str) -> None:
    """Where no reading or several fit, the table is refused with the lines of a map."""
    with pytest.raises(BadRecording, match=says):
        match(table)


LARGE = moved(0, 0, (70, 52))


@pytest.mark.parametrize(("table", "kind", "says"), [
    (half(), "vsss", ""), (half().with_columns(t=pl.col("t") / 4), "vsss", ""),
    (moved(0, 0, (1 / 0.75, 0.75 / 0.65)), "vsss", "taken for metres; if they are shares, say in a map"),
    (moved(0.75, 0, (100 / 1.5, 40)), "2d", "all bodies in one half of the pitch"),
    (moved(0, 0, (36, 36)), "2d", "taken for a pitch of 105 x 68 m (2d); if it is another, say so in a map, [pitch] kind"),
    (LARGE, "2d", 'of RoboCup 2D and of people\'s football: taken for RoboCup 2D; a map settles it, [pitch] kind = "2d" or "human"'),
    (LARGE.with_columns(player=pl.col("player") * 9), "human", "because a player has the number 18;"),
    (LARGE.with_columns(t=pl.col("t") * 0.4), "human", "because there is a sample each 0.04 s;"),
    (half().rename({"x": "y", "y": "x"}), "vsss", 'if x and y are exchanged, say so in a map, [columns] x = "y", y = "x"'),
])
def test_doubts(table: pl.DataFrame, kind: str, says: str) -> None:
    """A pitch that two games have, and bodies that do not fit theirs, are said with the word that settles it."""
    log = match(table)
    assert (log.info.pitch.kind, says in said(log), bool(said(log))) == (kind, True, bool(says))


# --- who is home --------------------------------------------------------------------------------------

@pytest.mark.parametrize("names", [("home", "away"), ("Away", "Home"), ("visitante", "casa"), ("l", "r"), ("home_team", "away_team"),
                                   ("guest", "host"), ("Bears (away)", "Ants (home)"), ("opponent", "us")])
def test_home_by_name(names: tuple[str, str]) -> None:
    """Teams that are called home and away are; a score is home's, with a ball or without."""
    home = next(name for name in names if name.lower() in ("home", "casa", "l", "home_team", "host", "ants (home)", "us"))
    table = half(1, names)
    for log in (match(table), match(table.filter(pl.col("team") != "ball").with_columns(score_home=2, score_away=1))):
        assert (log.info.home, log.info.settings["guessed"]["home"]["from"]) == (home, "names")
    assert log.referee.select("score_home", "score_away").row(-1) == (2, 1)


def test_home_that_nothing_tells() -> None:
    """Where nothing tells who is home, that is said with the word that settles it, and a score is nobody's."""
    table = scored(halves()).filter(pl.col("team") != "ball")
    log = match(table)
    assert log.referee["score_home"].to_list().count(None) == len(log.referee)
    assert 'say in a map [teams] home = "blue" or "yellow"' in log.quality.filter(flaw="home inferred")["note"][0]
    assert goals(match(table, "teams = {home = 'yellow'}")) == [(t, {"blue": "yellow", "yellow": "blue"}[team]) for t, team in BOTH]


# --- times --------------------------------------------------------------------------------------------

def clock(form: str) -> pl.Expr:
    """Times of a table as text of a form."""
    ns = (pl.col("t") * 1e9).round().cast(pl.Int64)
    seconds = (pl.col("t") % 60).round(1)
    return {
        "duration": ns.cast(pl.Duration("ns")), "datetime": ns.cast(pl.Datetime("ns", "UTC")),
        "us": (ns // 1000).cast(pl.Datetime("us")), "time": ns.cast(pl.Time),
        "pandas": pl.format("0 days 00:0{}:{}", pl.col("t") // 60, seconds), "clock": pl.format("0{}:{}", pl.col("t").cast(int) // 60, seconds),
        "iso": pl.format("2026-05-01T15:0{}:{}Z", pl.col("t").cast(int) // 60, seconds.cast(pl.String).str.zfill(4)),
        "zone": pl.format("2026-05-01 15:0{}:{}+02:00", pl.col("t").cast(int) // 60, seconds.cast(pl.String).str.zfill(4)),
        "period": pl.format("PT{}M{}S", pl.col("t").cast(int) // 60, seconds),
        "game": pl.format("45:00+{}:{}", pl.col("t").cast(int) // 60, seconds),
        **{name: (pl.datetime(2026, 5, 31, 23, 59) + ns.cast(pl.Duration("ns"))).dt.strftime(text) for name, text in {
            "day first": "%d/%m/%Y %H:%M:%S%.3f", "dots": "%d.%m.%Y, %H:%M:%S%.3f", "noon": "%m/%d/%Y %I:%M:%S%.3f %p",
            "slashes": "%Y/%m/%d %H:%M:%S%.3f", "UTC": "%Y-%m-%d %H:%M:%S%.3f UTC", "month": "%b %d %Y %H:%M:%S%.3f"}.items()},
        "excel": 45_800 + pl.col("t") / 86_400, "days": pl.col("t") / 86_400, "ms": pl.col("t") * 1000 + 1.75e12, "microseconds": ns // 1000, "ns": ns,
        "countdown": 600 - pl.col("t"),
    }[form]


NUMBERS = {"excel": "taken for days", "days": "taken for days", "ms": "taken for ms", "microseconds": "taken for us", "ns": "taken for ns",
           "countdown": "t counts down: times are those since its start"}


#: When the table begins, by times of a calendar.
STARTS = {"iso": "2026-05-01 15:00:00+00:00", "zone": "2026-05-01 13:00:00+00:00", "excel": "2025-05-23 00:00:00+00:00",
          "ms": "2025-06-15 15:06:40+00:00"}


@pytest.mark.parametrize("form", ["duration", "datetime", "us", "time", "pandas", "clock", "iso", "zone", "period", "game", *NUMBERS,
                                  "day first", "dots", "noon", "slashes", "UTC", "month"])
def test_times_that_are_no_numbers(form: str) -> None:
    """Dates, durations, clocks and numbers in any unit are times, in Parquet and as text; a unit that was found is said."""
    table = half().with_columns(t=clock(form))
    if form in ("duration", "datetime", "us", "time"):
        out = io.BytesIO()
        table.write_parquet(out)
        log = read(out.getvalue(), "game.parquet")
    elif form in NUMBERS:
        log = match(table)
    else:
        log = match(table.with_columns(pl.col("t").str.replace("00:00.0:", "00:00:", literal=True).str.replace("00:01.0:", "00:01:", literal=True)))
    assert np.abs(log.frames.t_ns - match(half()).frames.t_ns).max() <= (1000 if form in NUMBERS else 0)
    assert goals(log) == BLUE
    assert NUMBERS.get(form, "") in said(log)
    assert str(log.info.started_at or "").partition(".")[0] == STARTS.get(form, "")


def test_times_that_count_samples() -> None:
    """Frames are the time where a map tells their rate; velocities a sample become those a second; clocks too coarse are refused."""
    table = half().drop("t").with_columns(vx=pl.lit(0.05), vy=pl.lit(-0.01), heading=pl.col("x") * 0 + 0.25)
    with pytest.raises(BadRecording, match=r"has no time, only frame\. Say in a map .* \[time\] hz = 10"):
        match(table)
    log = match(table, "time = {hz = 10}\nunits = {speed = 'sample', angle = 'turn'}")
    assert (log.frames.t_ns == match(half()).frames.t_ns).all()
    assert (np.unique(log.frames.robots["vx"]).tolist(), float(log.frames.robots["theta"][0])) == ([0.5], pytest.approx(np.pi / 2))
    for coarse in (pl.format("00:{}", pl.col("t").cast(pl.Int64)), pl.col("t").floor()):
        with pytest.raises(BadRecording, match=r"one time for several frames, 1080 of 1200\. .*\[time\] hz = 10"):
            match(half().with_columns(t=coarse))
    with pytest.raises(BadRecording, match=r"has the time '1,000\.0', no number, in most rows \(row \d+\).* without marks between thousands"):
        match(half().with_columns(t=pl.when(pl.col("t") < 1).then(pl.col("t").cast(pl.String)).otherwise(pl.lit("1,000.0"))))
    # minutes are seconds too fast for robots: never learned from, until a map says so
    minutes = half().with_columns(pl.col("t") / 60)
    assert any("robots move at" in note for note in match(minutes).quality.filter(flaw="implausible")["note"])
    assert goals(match(minutes, "units = {time = 'min'}")) == BLUE
    for slower, told in ((2.5, False), (1, True)):  # players of 2D run 10.5 m/s; nobody runs 20
        large = match(LARGE.with_columns(pl.col("t") * slower)).quality.filter(flaw="implausible")["note"]
        assert any("robots move at" in note for note in large) == told
    assert goals(match(halves().with_columns(t=clock("period")))) == BOTH


# --- words and the ball -------------------------------------------------------------------------------

def renamed(**words: str) -> pl.DataFrame:
    return half().rename(words)


@pytest.mark.parametrize(("table", "says"), [
    (half().rename(str.upper), "FRAME for frame, T for t"),
    (half().rename(str.upper).with_row_index(""), "FRAME for frame, T for t"),  # as pandas writes it
    (renamed(t="Time [s]", team="Team Name", player="Robot ID", x="pos_x", y="pos_y"), "Time [s] for t, Team Name for team"),
    (renamed(t="tempo", team="time", player="jogador"), "tempo for t, time for team, jogador for player"),
    (renamed(t="Tiempo", team="equipo", player="jugador"), "Tiempo for t, equipo for team, jugador for player"),
    (renamed(t="jikan", team="chiimu", player="senshu"), "jikan for t, chiimu for team, senshu for player"),
    (renamed(t="t_ms", x="x (cm)", y="y (cm)").with_columns(pl.col("t_ms") * 1000, pl.col("x (cm)", "y (cm)") * 100), 'length in "cm"'),
    (half().with_columns(team=pl.col("team").replace({"ball": "Bola"})), "the team Bola was taken for the ball"),
    (half().with_columns(team=pl.col("team").replace({"ball": None})), "rows without a team, one a sample, were taken for the ball"),
    (half().with_columns(team=pl.col("team").replace({"ball": ""})), "rows without a team, one a sample, were taken for the ball"),
    (half().with_columns(player=pl.col("player").cast(pl.String).fill_null("Ball"), team=pl.col("team").replace({"ball": "none"})),
     "the player Ball was taken for the ball"),
])
def test_other_words(table: pl.DataFrame, says: str) -> None:
    """Columns and the ball are known by other words, without case, and what was taken for what is said."""
    log = match(table)
    assert says in said(log)
    assert (log.frames.t_ns == match(half()).frames.t_ns).all()
    assert goals(log) == BLUE


@pytest.mark.parametrize("names", [("ball_x", "ball_y"), ("BallX", "BallY"), ("bola_x", "bola_y"), ("bx", "by")])
def test_ball_in_each_row(names: tuple[str, str]) -> None:
    """The ball is read from columns of each row: by their names, or by a map."""
    ball = half().filter(pl.col("team") == "ball").select("frame", pl.col("x").alias(names[0]), pl.col("y").alias(names[1]))
    table = half().filter(pl.col("team") != "ball").join(ball, "frame", maintain_order="left")
    log = match(table, f"[bodies]\nball = {{x = '{names[0]}', y = '{names[1]}'}}" if names[0] == "bx" else "")
    assert (log.frames.ball["x"] == match(half()).frames.ball["x"]).all()
    assert goals(log) == BLUE
    assert f"the ball is read from the columns {names[0]}, {names[1]} of each row" in said(log)


# --- forms that are known, and maps that are offered --------------------------------------------------

def librcsc() -> pl.DataFrame:
    """Three cycles as rcg2csv writes them: y down, degrees, metres a cycle."""
    bodies = {"b": (1.0, -2.0), "l1": (-50.0, 3.0), "l2": (-10.0, 0.0), "r1": (50.0, 0.0), "r2": (10.0, 5.0)}
    places = {f"{body}_{axis}": value for body, place in bodies.items() for axis, value in zip("xy", place, strict=True)}
    turns = {f"{body}_{part}": value for body in list(bodies)[1:] for part, value in (("body", 90.0), ("vx", 0.1), ("vy", 0.0))}
    return pl.DataFrame({"#": [1, 2, 3], "cycle": [1, 1, 2], "stopped": [0, 1, 0], "playmode": ["kick_off_l", "play_on", "play_on"],
                         "l_name": "Helios", "l_score": [0, 0, 1], "r_name": "Cyrus", "r_score": 0, **places, **turns})


def test_form_by_name(call, tmp_path: Path) -> None:
    """`--as` gives the map of a form; a refusal names the form that fits, and `--list` all; a map may begin from one."""
    log = match(librcsc(), 'form = "librcsc"\nteams = {names = {r = "Cyrus2D"}}')
    assert (log.info.home, log.info.away, log.info.pitch.kind) == ("Helios", "Cyrus2D", "2d")
    assert log.frames.t_ns.tolist() == [0, 100_000_000, 200_000_000]
    robot = log.frames.robots[0]
    assert [float(robot[name]) for name in ("x", "y", "vx", "theta")] == pytest.approx([-50, -3, 1, -np.pi / 2])
    file = tmp_path / "tracking.csv"
    file.write_text(librcsc().write_csv())
    where = "--data", tmp_path / "data"
    assert "It looks like the form librcsc: --as librcsc" in " ".join(call("import", file, *where)[1:])
    assert "Helios - Cyrus" in call("import", file, "--as", "librcsc", *where)[1]
    listed = call("import", "--list")[1]
    assert all(f"--as {name}" in listed for name in titles())
    assert "there is no form 'x'. Say one of librcsc" in " ".join(call("import", file, "--as", "x", *where)[1:])


@pytest.mark.parametrize("name", sorted(presets()))
def test_each_form_is_a_map(name: str) -> None:
    """Each form is a map that fits."""
    assert load_map(f'form = "{name}"').settings()
    with pytest.raises(BadSettings, match="form: there is none called 'x', only librcsc"):
        load_map('form = "x"')


def wide(pattern: str, ball: str, **columns: pl.Expr) -> pl.DataFrame:
    """The first half with a row a sample: columns by patterns of a team, a player and an axis."""
    parts = [half().filter(pl.col("team") == "ball").select("frame", "t", pl.col("x").alias(ball.format(q="x")), pl.col("y").alias(ball.format(q="y")))]
    for team, player in half().filter(pl.col("team") != "ball").select("team", "player").unique().sort("team", "player").iter_rows():
        names = {q: pattern.format(team=team, n=player, q=q) for q in ("x", "y")}
        parts.append(half().filter(pl.col("team") == team, pl.col("player") == player).select("frame", *(pl.col(q).alias(name) for q, name in names.items())))
    table = parts[0]
    for part in parts[1:]:
        table = table.join(part, "frame", maintain_order="left")
    return table.with_columns(**columns)


def parts_of_pitch(table: pl.DataFrame, whole: float) -> pl.DataFrame:
    """Places as parts of the VSSS pitch from its corner, y down."""
    along = [name for name in table.columns if name.rstrip("0123456789").endswith("x")]
    across = [name for name in table.columns if name.rstrip("0123456789").endswith("y")]
    return table.with_columns(*((pl.col(name) / 1.5 + 0.5) * whole for name in along), *((pl.col(name) / -1.3 + 0.5) * whole for name in across))


def sides_named(table: pl.DataFrame, home: str, away: str) -> pl.DataFrame:
    return table.rename(lambda name: name.replace("blue", home).replace("yellow", away))


NS = (pl.col("t") * 1e9).round().cast(pl.Int64)
OF_FORMS = {
    "kloppy": (parts_of_pitch(sides_named(wide("{team}_{n}_{q}", "ball_{q}"), "home", "away"), 1).with_columns(
        timestamp=pl.format("0 days 00:0{}:{}", pl.col("t").cast(pl.Int64) // 60, (pl.col("t") % 60).round(1)),
        period_id=1, frame_id="frame", ball_state=pl.lit("alive")).drop("frame", "t"), "home", "away"),
    "databallpy": (sides_named(wide("{team}_{n}_{q}", "ball_{q}"), "home", "away").with_columns(
        datetime=NS.cast(pl.Datetime("ns", "UTC")), period_id=1, ball_status=pl.lit("alive")).drop("t"), "home", "away"),
    "laurie": (sides_named(wide("{team}_{n}_{q}", "ball_{q}"), "Home", "Away").rename({"t": "Time [s]"}).with_columns(Period=1), "Home", "Away"),
    "kinexon": (half().select(pl.col("t").mul(1000).alias("ts in ms"), pl.col("team").replace("ball", "Ball").alias("group name"),
                              pl.col("player").alias("number"), pl.col("x").alias("x in m"), pl.col("y").alias("y in m")), "blue", "yellow"),
    "rsoccer": (wide("robots_{team}_{n}_{q}", "ball_{q}").drop("t").with_columns(frame=pl.col("frame") * 4), "robots_blue", "robots_yellow"),
    "firasim": (wide("robots_{team}.{n}.{q}", "ball.{q}").drop("t").with_columns(frame=pl.col("frame") * 6), "robots_blue", "robots_yellow"),
}


@pytest.mark.parametrize("name", OF_FORMS)
def test_forms(name: str) -> None:
    """A table of each form comes in with the bodies where they are, in its own file's kind, teams by their names."""
    table, home, away = OF_FORMS[name]
    out = io.BytesIO()
    table.write_parquet(out)
    mapping = load_map(f'form = "{name}"\npitch = {{kind = "vsss"}}')
    for log in (read(table.write_csv().encode(), "game.csv", mapping=mapping), read(out.getvalue(), "game.parquet", mapping=mapping)):
        usual = match(half())
        assert ({log.info.home, log.info.away}, log.info.pitch.length) == ({home.removeprefix("robots_"), away.removeprefix("robots_")}, 1.5)
        assert log.frames.t_ns.tolist() == usual.frames.t_ns.tolist()
        order = np.lexsort((log.frames.robots["x"], log.frames.robot_frames())), np.lexsort((usual.frames.robots["x"], usual.frames.robot_frames()))
        for axis in ("x", "y"):
            assert np.allclose(log.frames.robots[axis][order[0]], usual.frames.robots[axis][order[1]], atol=1e-5)
            assert np.allclose(log.frames.ball[axis], usual.frames.ball[axis], atol=1e-5)


@pytest.mark.parametrize("form", ["rows", "rows of no team", "columns"])
def test_files_of_one_match(call, tmp_path: Path, form: str) -> None:
    """`--together` reads home and away from two files: rows, rows of the team that the file is called, or columns."""
    table = half() if form != "columns" else wide("{team}_{n}_{q}", "ball_{q}")
    files = []
    for team, other in (("blue", "yellow"), ("yellow", "blue")):
        ours = table.filter(pl.col("team").is_in(["ball", team]) | (team == other)) if form != "columns" else table.select(
            name for name in table.columns if other not in name)
        if form == "rows of no team":
            ours = ours.with_columns(player=pl.col("player").cast(pl.String).fill_null("ball")).drop("team")
        files.append(tmp_path / f"{team}.csv")
        files[-1].write_text(ours.write_csv())
    code, out, error = call("import", *files, "--together", "--data", tmp_path / "data")
    assert code == 0, out + error
    assert "blue - yellow" in out
    code, out, _ = call("sql", "select frames, robots_per_team from matches", "--csv", "--data", tmp_path / "data")
    assert out.splitlines()[1:] == ["1200,3"]
    log = matches.read(next((tmp_path / "data").glob("matches/*.mcap")).read_bytes(), where="")
    assert goals(log) == BLUE


def test_offered_map(call, tmp_path: Path) -> None:
    """A refusal ends with the path of a map that has what was recognised, is a map, and works once it is mended."""
    file, data = tmp_path / "derby.csv", tmp_path / "data"
    file.write_text(half().rename({"t": "tempo", "x": "abscissa", "player": "Robô"}).write_csv())
    code, *out = call("import", file, "--data", data)
    assert code
    (offered,) = (data / "maps").glob("*.toml")
    assert f"--map {offered}." in "".join(out).replace("\n", "")
    text = offered.read_text(encoding="utf-8")
    assert load_map(text).columns.t == "tempo"
    offered.write_text(text.replace('# x = "?"', 'x = "abscissa"'), encoding="utf-8")
    assert call("import", file, "--map", offered, "--data", data)[0] == 0
