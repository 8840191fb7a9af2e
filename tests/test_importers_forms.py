"""Tables of other forms: wide, without a header, with decimal commas, in other encodings; what a user may have meant."""

import codecs
import time

import numpy as np
import polars as pl
import pytest
from support.recordings import read as opened
from support.recordings import same_frames
from support.tracking import flaws, parquet, read, robots

from pitchlore.pipeline.base.errors import BadRecording, BadSettings
from pitchlore.pipeline.importers import readers
from pitchlore.pipeline.importers.forms.words import WORDS, WORDS_OF, meant
from pitchlore.pipeline.importers.tracking import csv_file
from pitchlore.pipeline.importers.tracking.mapping import load_map
from pitchlore.pipeline.importers.tracking.texts import fields_of_line
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.pipeline.settings import ImportSettings

#: One match in the plain form; a name with an accent, whose bytes tell encodings apart.
LONG = """frame,t,team,player,x,y,heading
0,0.0,ball,,0.5,-0.25,
0,0.0,réds,1,-0.6,0.1,1.5
0,0.0,réds,2,-0.2,0.2,-1.5
0,0.0,greens,1,0.6,0.3,-3.0
1,0.025,ball,,0.25,-0.125,
1,0.025,réds,1,-0.61,0.1,1.5
1,0.025,greens,1,0.6,0.3,-3.0
"""
HEADLESS = LONG.partition("\n")[2]
NUMBERED = '[columns]\nframe = 1\nt = 2\nteam = 3\nplayer = 4\nx = 5\ny = 6\nheading = 7\n'
#: The same match with a row a sample.
WIDE = """frame,t,ball_x,ball_y,x_réds1,y_réds1,th_réds1,x_réds2,y_réds2,th_réds2,greens_1_x,greens_1_y,greens_1_theta
0,0.0,0.5,-0.25,-0.6,0.1,1.5,-0.2,0.2,-1.5,0.6,0.3,-3.0
1,0.025,0.25,-0.125,-0.61,0.1,1.5,,,,0.6,0.3,-3.0
"""


def same(one: MatchLog, two: MatchLog) -> bool:
    """True if two matches have the same teams, bodies and samples."""
    return (one.info.home, one.info.away) == (two.info.home, two.info.away) and same_frames(one.frames, two.frames)


# --- text -------------------------------------------------------------------------------------------

@pytest.mark.parametrize(("data", "said"), [
    (LONG.encode(), False),
    (codecs.BOM_UTF8 + LONG.encode(), False),
    (codecs.BOM_UTF16_LE + LONG.encode("utf-16-le"), False),
    (codecs.BOM_UTF16_BE + LONG.encode("utf-16-be"), False),
    (LONG.encode("utf-16-le"), True),
    (LONG.encode("utf-16-be"), True),
    (LONG.encode("latin-1"), True),
    (LONG.replace("\n", "\r\n").encode("cp1252"), True),
    (LONG.replace("\n", "\r").encode(), False),
    (b"\n \n# of the final\n" + LONG.encode(), False),
    (b"sep=;\r\n" + LONG.replace(",", ";").encode(), False),
    (LONG.replace(",", "|").encode(), False),
    (LONG.replace("\n", ",\n").encode(), False),
    (LONG.replace("-", "\u2212").encode(), False),
])
def test_encodings(data: bytes, said: bool) -> None:
    """A table is read in whatever it is written; an encoding that the file does not say is a flaw."""
    match = opened(data, "game.csv")
    assert match.info.format == "tracking"
    assert same(match, read(LONG))
    assert match.info.away == "réds"
    assert [row[:2] for row in flaws(match)] == ([("text encoding", 1)] if said else [])


def test_damaged_utf8() -> None:
    """One wrong byte does not make another encoding of a text in UTF-8."""
    damaged = LONG.encode().replace(b"1.5\n", b"1.\xff\n", 1)
    assert "réds" in (opened(damaged, "game.csv").info.home, opened(damaged, "game.csv").info.away)


@pytest.mark.parametrize("mark", [";", "\t"])
def test_decimal_commas(mark: str) -> None:
    """Decimal commas are read where fields are separated by something else, or quoted."""
    assert same(read(LONG.replace(",", mark).replace(".", ",")), read(LONG))
    quoted = LONG.replace("-0.25", '"-0,25"').replace("0.5,", '"0,5",', 1)
    assert read(quoted.replace("-0.125", '"-0,125"').replace("0.25,", '"0,25",')).frames.ball["y"].tolist() == [-0.25, -0.125]


def test_all_quoted() -> None:
    """Each field in quotes, the first row too, with decimal commas between commas: as spreadsheets write it."""
    rows = (",".join(f'"{field.replace(".", ",")}"' for field in line.split(",")) for line in LONG.splitlines())
    assert same(read("".join(f"{row}\n" for row in rows)), read(LONG))


def test_quoted_head_is_cheap() -> None:
    """A line of quotes and nothing else takes no time to tell."""
    begun = time.perf_counter()
    assert not csv_file.detects(b'"' * (1 << 16) + b"\n" + b'a"' * (1 << 15))
    assert fields_of_line('"' * (1 << 20) + ",b", ",") != []
    assert time.perf_counter() - begun < 2


# --- without a header -------------------------------------------------------------------------------

def test_no_header() -> None:
    """A table without a header is read with a map that numbers its columns; numbers count those of one with a header, too."""
    assert same(opened(HEADLESS.encode(), "game.csv", load_map(NUMBERED)), read(LONG))
    commas = HEADLESS.replace(",", ";").replace(".", ",")
    assert same(opened(commas.encode(), "game.csv", load_map(NUMBERED)), read(LONG))

    assert same(read(LONG, load_map("[columns]\nx = 5\nteam = 3\n")), read(LONG))


# --- wide -------------------------------------------------------------------------------------------

def test_wide() -> None:
    """A table with a row a sample is the match of the plain form, in CSV and in Parquet."""
    assert same(read(WIDE), read(LONG))
    assert same(read(parquet(pl.read_csv(WIDE.encode()))), read(LONG))
    assert flaws(read(WIDE)) == []


def test_logged_options() -> None:
    """Options of both forms, also by a map, are the log's changes; a value that is none is flagged, not taken."""
    codes = ("44", "44", "", "44", "1", "44", "184")  # of the ball, réds 1 and 2, greens 1; then without réds 2
    lines = [f"{line},{code}" for line, code in zip(HEADLESS.splitlines(), codes, strict=True)]
    long = "\n".join([LONG.partition("\n")[0] + ",option", *lines])
    home, away = (0, 1) if read(LONG).info.home == "réds" else (1, 0)
    head, first, last = WIDE.splitlines()
    for match in (
        read(long), read(long.replace("option", "does"), load_map('[columns]\noption = "does"\n')),
        read(f"{head},option_réds1,greens_1_option\n{first},44,44\n{last},44,184\n"),
    ):
        assert same(match, read(LONG))
        assert set(match.options.tolist()) == {(0, 44, 1, home), (0, 44, 1, away), (25_000_000, 184, 1, away)}
        assert flaws(match) == flaws(read(LONG))
    wrong = read(long.replace(",184", ",7").replace(",1.5,44", ",1.5,x"))
    assert wrong.options.tolist() == [(0, 44, 1, away), (25_000_000, 0, 1, away)]
    (note,) = wrong.quality.filter(flaw="skipped")["note"]
    assert note == "column option has 7, words, which a robot cannot do on purpose: taken for not logged"


@pytest.mark.parametrize("spelling", [
    "{x}_{team}{n}", "{team}_{n}_{x}", "{team}{n}_{x}", "robot_{team}_{n}_pos_{x}", "{team}Robot{n}{X}",
])
def test_spellings(spelling: str) -> None:
    """Parts of a column's name may stand in any order."""
    bodies = [("blue", 0, 0.7), ("yellow", 3, -0.7)]
    names = [spelling.format(x=x, X=x.upper(), team=team, n=n) for team, n, _ in bodies for x in ("x", "y")]
    rows = "".join(f"{t}," + ",".join(f"{x},{0.1}" for _, _, x in bodies) + ",0.5,0.25\n" for t in (0, 1))
    match = read(f"t,{','.join(names)},x_ball,y_ball\n{rows}")
    assert {(match.info.home, match.info.away)} == {("blue", "yellow")}
    assert [row[:4] for row in robots(match)[:2]] == [(0, 0, 0.7, 0.1), (1, 3, -0.7, 0.1)]
    assert match.frames.ball["y"].tolist() == [0.25, 0.25]


@pytest.mark.parametrize("spelling", ["{team}{n}.{q}", "{q}_{team}{n}"])
def test_teams_of_one_letter(spelling: str) -> None:
    """A team y is not the quantity y: its letter stands before the number."""
    names = [spelling.format(team=team, n=n, q=q) for team, n in (("b", 0), ("y", 3)) for q in ("x", "y", "theta")]
    match = read(f"t,{','.join(names)}\n0,0.7,0.1,1,-0.7,0.2,2\n1,0.7,0.1,1,-0.7,0.2,2\n")
    assert (match.info.home, match.info.away) == ("b", "y")
    assert [row[:4] for row in robots(match)[:2]] == [(0, 0, 0.7, 0.1), (1, 3, -0.7, 0.2)]


def test_wide_by_the_map() -> None:
    """A map names or numbers the columns of bodies whose names tell nothing, with a header or without."""
    bodies = '[bodies]\nball = {x = 3, y = 4}\n"réds 1" = {x = 5, y = 6, heading = 7}\n"réds 2" = {x = 8, y = 9, heading = 10}\n'
    mapping = load_map(f'{bodies}"greens 1" = {{x = 11, y = 12, heading = 13}}\n[columns]\nframe = 1\nt = 2\n')
    assert same(opened(WIDE.partition("\n")[2].encode(), "game.csv", mapping), read(LONG))
    assert same(opened(WIDE.encode(), "game.csv", mapping), read(LONG))
    with pytest.raises(BadRecording, match=r"has no column q for the body 'reds 1'; it has frame, t, .*Mend the map's \[bodies\]"):
        read(WIDE, load_map('[bodies]\n"reds 1" = {x = "q", y = "q"}\n'))
    with pytest.raises(BadSettings, match="the body 'reds' is neither a team and a player nor the ball 'ball'"):
        load_map('[bodies]\nreds = {x = 1, y = 2}\n')


def test_half_a_body() -> None:
    """A column of a body without x or y is a flaw."""
    match = read(WIDE.replace("y_réds2", "q_réds2"))
    assert [row[:2] for row in flaws(match)] == [("skipped", 2)]
    assert "x_réds2, th_réds2" in match.quality.filter(flaw="skipped")["note"][0]


def test_too_wide() -> None:
    """The limit on rows is one of rows of bodies."""
    source = readers.open_source(WIDE.encode(), "game.csv", ImportSettings(rows=7))
    with pytest.raises(BadRecording, match="has 8 rows of bodies, more than the limit rows = 7"):
        readers.read(source)


# --- what was meant ---------------------------------------------------------------------------------

@pytest.mark.parametrize(("column", "found", "said"), [
    ("team", ["time", "x"], None),  # a team in Portuguese, but a time in most files
    ("team", ["time", "equipe"], "equipe"),
    ("team", ["tempo", "Team Name"], "Team Name"),
    ("t", ["team", "time"], "time"),
    ("t", ["time", "tempo"], "tempo"),
    ("t", ["Tempo (s)"], "Tempo (s)"),
    ("player", ["jogador"], "jogador"),
    ("player", ["Robô"], "Robô"),
    ("heading", ["Orientação"], "Orientação"),
    ("x", ["Posição X", "Posição Y"], "Posição X"),
    ("x", ["y"], None),
    ("player", ["player_vx", "player_x"], None),
    ("heading", ["headng"], "headng"),
])
def test_meant(column: str, found: list[str], said: str | None) -> None:
    """Suggestions know English and Portuguese, and offer no word of another column."""
    assert meant(column, column, found) == said


def test_no_word_twice() -> None:
    """No word is one of two columns."""
    assert len(WORDS) == sum(len(words.split()) for words in WORDS_OF.values())


@pytest.mark.parametrize(("text", "mapping", "says"), [
    (LONG.replace(".", ","), "", "semicolons between them"),  # decimal commas between commas
    (HEADLESS, "", (r"^game.csv: has no header; its first line is '0,0.0,ball,,0.5,-0.25,'\. "
                    r"Number its columns from 1 in a map: \[columns\] t = 1, .*\.$")),
    (HEADLESS, NUMBERED.replace("heading = 7", "heading = 9"), "has no column number 9; it has number 1, number 2"),
    (LONG.replace("\n", "\n-,s,-,-,m,m,rad\n", 1), "", "looks like a table of positions, .* leave out titles and units"),
    ("A match\n" + LONG, "", "looks like a table of positions, but its first line is no header"),
    (HEADLESS.replace("ball", "réds").replace("greens", "réds"), NUMBERED, "has one team besides 'ball': réds"),
    ("t,x1,y1,x2,y2\n0,0,0,1,1\n1,0,0,1,1\n", "",
     r"bodies of no team: x1, y1, x2, y2\. Say whose they are in a map: \[bodies\]"),
    (WIDE.replace("frame,t,", "frame,quux,"), "", r"has no time, only frame\. .*\[time\] hz = 10"),
    ("frame,time,quux,player,x,y\n0,0,a,1,0,0\n", '[columns]\nt = "time"\n',
     r"has no column team; it has frame, time, quux"),
    (LONG.replace("heading", "option").replace("1.5", "7"), "",
     r"^game.csv: column option has -7, -3, 7, which a robot cannot do on purpose\. Write codes of Table 1 \(1, 11, "),
])
def test_refusals(text: str, mapping: str, says: str) -> None:
    """Tables that do not tell what is needed are refused in one line, with the cure."""
    with pytest.raises(BadRecording, match=says):
        opened(text.encode(), "game.csv", load_map(mapping))


def test_unmatched_words() -> None:
    """Words of a map that match nothing are named."""
    csv = "frame,t,team,player,x,y,game_state\n" + "".join(
        f"{i},{i},{team},1,{x},0,laeuft\n" for i in range(3) for team, x in (("a", 0.7), ("b", -0.7)))
    match = read(csv, load_map('[teams]\nball = "bola"\n[states]\nlaeuft = "play"\nTor = "goal"\n'))
    (note,) = match.quality.filter(flaw="unmatched map")["note"]
    assert note == ("words of the map that are nowhere in the table: [states] Tor; "
                    "[teams] ball = bola (teams are a, b)")
    assert np.isnan(match.frames.ball["x"]).all()
