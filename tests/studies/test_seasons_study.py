"""The study of seasons: our claims, its page and its plots, and a run of seconds."""

import re

import polars as pl
import pytest
from conftest import ROOT
from harness import settings_of
from seasons import study
from seasons.claims import OURS, Aim
from seasons.kickoffs import NOT_TOLD, about_kick_offs, conclusions
from seasons.page import about_ablations, about_preferences, commands, evaluating, markdown
from seasons.plots import ablations as ablations_plot
from seasons.plots import pictures
from support.seasons import (
    ablations,
    apprentices,
    evaluation,
    evolving,
    rising,
    season,
    tables,
    world,
)

from pitchlore.pipeline.arena.teams.clock import PAPER
from pitchlore.pipeline.arena.teams.panel import PANEL
from pitchlore.pipeline.numbers.claims import Evidence, Range
from pitchlore.pipeline.numbers.statistics import UNDEFINED, Estimate, wilson
from pitchlore.pipeline.stages.report.claims import CLAIMS, season_verdicts
from pitchlore.pipeline.stages.report.kickoffs import kick_offs
from pitchlore.pipeline.stages.report.measures import DIFFERENCE, OTHER, seasons_of
from pitchlore.pipeline.stages.report.preferences import NO_PREFERENCES
from pitchlore.pipeline.stages.report.summary import mean_curves
from pitchlore.pipeline.views.report import ReportTables
from pitchlore.schemas import Claims, Evaluations, Games, Growth

FOLDER = ROOT / "data" / "studies" / "seasons"
HUMAN, STATIC, RANDOM, PERSON = "human-like", "static", "random", "person"
NONE = Evaluations.empty()

def judged(games, growth, evaluations=NONE):
    """Verdicts on the paper's claims and on ours."""
    return season_verdicts(seasons_of(games, growth, evaluations), (*CLAIMS, *OURS))


def page_of(games, growth, evaluations=NONE, left_out=0, preferences=NO_PREFERENCES):
    """The page of the study, without plots."""
    return markdown(ReportTables(games, growth, evaluations, left_out, preferences), judged(games, growth, evaluations), [], "pitchlore")


def claim(found, text):
    rows = found.filter(pl.col("claim").str.contains(text, literal=True))
    assert rows.height == 1, rows
    return rows.row(0, named=True)


def test_settings():
    """All settings of the study are played, and the paper's keep the paper's clock."""
    own = {path.stem for path in FOLDER.glob("*.toml")}
    assert {name for name, *_ in study.WHOLE.seasons} == {"paper", "paper-literal", "best", "best-in-games", *own}
    assert {settings_of(name).clock for name in ("paper-full35", "paper-level", "paper-literal", "best-paper-clock")} == {PAPER}


@pytest.mark.slow
def test_page_again(tmp_path, monkeypatch):
    """ReportTables and page are those that the study makes of the games that are kept with it."""
    monkeypatch.setattr(study, "pictures", lambda *_: {path.stem: path.read_bytes() for path in FOLDER.glob("*.png")})
    def kept(name, schema):
        return schema.validate(pl.read_csv(FOLDER / f"{name}.csv", infer_schema_length=None), cast=True)

    preferences = pl.read_csv(FOLDER / "preferences.csv", schema_overrides=NO_PREFERENCES.schema)
    study.write(tmp_path, ReportTables(kept("games", Games), kept("growth", Growth), kept("evaluations", Evaluations), 0, preferences))
    written = {path.name for path in tmp_path.iterdir()}
    assert written == {path.name for path in FOLDER.iterdir() if path.suffix in (".csv", ".md", ".png")}
    for name in written:
        assert (tmp_path / name).read_bytes() == (FOLDER / name).read_bytes(), name


def test_words_of_an_aim():
    """An aim is reached or not; what holds by construction, or is not judged, is said as of any claim."""
    def verdict(estimate, observations=5, **kind):
        aim = Aim("aim", "It grows", "growth", Range("above 0", low=0.0, strict=True), lambda _: (), **kind)
        return aim.verdict(Evidence(estimate, observations, {}), 5)

    grows, unclear, falls = Estimate(2, 1, 3), Estimate(1, -1, 3), Estimate(-2, -3, -1)
    assert [verdict(each) for each in (grows, unclear, falls)] == ["reached", "not reached", "not reached"]
    assert verdict(UNDEFINED, 0) == verdict(grows, 4) == "not judged"
    assert verdict(grows, by_construction=True) == "by construction"


def test_all_of_our_claims():
    """Aims are reached where they hold; those on learned actions hold by construction."""
    found = judged(*world(), apprentices())
    assert found["verdict"].is_in(Claims.dtypes()["verdict"].categories).all()
    assert claim(found, "In its last games it beats the static team")["verdict"] == "reached"
    assert claim(found, "It uses what it learned: against the static team")["verdict"] == "by construction"
    late = found.filter(pl.col("claim") == "In its last games it uses what it learned")
    assert late.select("opponent", "verdict").rows() == [(STATIC, "by construction"), (HUMAN, "not judged")]


def test_beside_constant_teams():
    """Aims are held against constant teams."""
    games, growth = tables(*(season("best", STATIC, s) for s in range(5)))
    rows = pl.concat([
        apprentices(5), evaluation("constant:044", goals=lambda i: (5 + i // 2 % 2, 1)),
        evaluation("constant:021", goals=lambda i: (0, i % 2)), evaluation("constant:001"),
    ])
    beyond = [claim(judged(games, growth, rows), f"({control})") for control in ("constant:044", "constant:021")]
    assert [row["verdict"] for row in beyond] == ["not reached", "reached"]
    assert beyond[0]["measured"] == pytest.approx(2.4 - 4.5)
    assert (beyond[0]["settings"], beyond[0]["seasons"]) == ("best less constant:044", 5)
    assert claim(judged(games, growth, apprentices(5)), "(constant:044)")["verdict"] == "not judged"


def test_kick_offs_of_the_paper():
    """Learned actions that are three a kick-off say how many kick-offs the paper's would be."""
    games, _ = tables(*(season("paper", STATIC, s, goals=lambda g, s=s: (0, g + s), last=20,
                               other=lambda g, s=s: 0.0 if g < 11 else 3 * (g + s + 1) / 10) for s in range(3)))
    said = " ".join(conclusions(kick_offs(games)))
    # games 11 to 35 of the paper's column: 132 a game
    assert "There are 3 of them for each kick-off. Goals + 1 accounts for 100 %" in said
    assert "the paper's 132 learned actions a game (from game 11 on) are 44.1 kick-offs, one each 10.9 s" in said
    some = [season("paper-full35", HUMAN, s, last=20, other=lambda g: 3.0) for s in range(3)]
    reported = "\n".join(about_kick_offs(tables(*some)[0]))
    assert "- With `paper-full35` against human-like (a second script): 100 % of our learned actions" in reported


def test_preferences_on_page():
    """The page says what each of the best apprentices prefers, and which policies are gone."""
    games, _ = world()
    does = pl.DataFrame([("best", STATIC, "best-static-s1", role, f"{code} Robot …", worth, 9.0) for role, code, worth in (
        ("goalkeeper", "088", 0.123), ("midfield", "021", 0.5), ("striker", "044", 0.25))], schema=NO_PREFERENCES.schema, orient="row")
    text = "\n".join(about_preferences(games, does))
    assert "| best | static | best-static-s1 | 088 Robot … (0.12) | 021 Robot … (0.5) | 044 Robot … (0.25) |" in text
    assert "best-static-s0, best-static-s2" in text
    assert "cannot be listed: the policy is gone" in text
    assert list(about_preferences(games.filter(pl.col("settings") == "paper"), NO_PREFERENCES)) == []


@pytest.mark.slow
def test_effects_on_page():
    """The page says which way a change goes if its interval leaves out zero, and leaves variations out."""
    paper = [season("paper", STATIC, s) for s in range(5)]
    vary = [season("paper-vary-maps-large", STATIC, s) for s in range(5)]
    games, _ = (pl.concat(parts) for parts in zip(world(), *(season("best-exact", STATIC, s) for s in range(2)), *vary, strict=True))
    text = "\n".join(about_ablations(games))
    assert re.search(r"\| best-exact \| best \| static \| 2 and 5 \| 26 to 35 \| -\d.* \| worse \|", text)
    assert "paper-vary" not in text
    assert "ablations-paper" not in pictures(*tables(*paper, *vary))


def test_aims():
    """Our aims are judged by evaluations after the last game."""
    found = judged(*world(), apprentices(late=lambda s: s))
    row = claim(found, "The best apprentice beats")
    # goal differences 2, 3, 2, 3, 2
    assert (row["measured"], row["seasons"], row["verdict"]) == (pytest.approx(2.4), 5, "reached")
    row = claim(found, "It wins against the random team")
    # 1, .95, .9, .85, .8: mean .9, s = .0790569, t(4) = 2.776: ± .0982; 50 pairs: Wilson's .786 is lower
    assert row["measured"] == pytest.approx(0.9)
    assert (row["low"], row["high"]) == (pytest.approx(wilson(45, 50)[0]), pytest.approx(0.9 + 0.0981620, abs=1e-6))
    assert row["verdict"] == "not reached"
    assert (row["settings"], row["opponent"]) == ("best", STATIC)
    many = pl.concat(evaluation(f"best-static-s{s}", RANDOM, 50) for s in range(5))
    assert claim(judged(*world(), many), "It wins against the random team")["verdict"] == "reached"


def test_unfinished_season():
    """The apprentice of a season that has not ended is not counted as one after its last game."""
    games, growth = (table.filter((pl.col("season") != "best-static-s1") | (pl.col("game") < 35)) for table in world())
    assert claim(judged(games, growth, apprentices()), "The best apprentice beats")["seasons"] == 4


def test_foreign_evaluations():
    """Evaluations of teams without a season say nothing."""
    rows = pl.concat([apprentices(), evaluation("best-static-s77", goals=lambda _: (0, 9)), evaluation("v3", goals=lambda _: (0, 9))])
    assert judged(*world(), rows).equals(judged(*world(), apprentices()))


def test_ablation_claims():
    """A claim is reproduced by an ablation only where that breaks what the score explains."""
    games, growth = (pl.concat(parts) for parts in zip(world(), *ablations(), strict=True))
    found = judged(games, growth, NONE).filter(pl.col("item") == "ablation")
    assert found["verdict"].to_list() == ["reproduced"] * 5
    assert claim(found, "used against the second script")["measured"] == pytest.approx(1.0 * 34 / 35, abs=0.01)
    unbroken = [season("paper-full35", kind, s, other=other(s)) for s in range(5) for kind, other in ((STATIC, evolving), (HUMAN, rising))]
    games, growth = (pl.concat(parts) for parts in zip(world(), *unbroken, strict=True))
    found = judged(games, growth, NONE).filter(pl.col("item") == "ablation")
    assert found["verdict"].to_list() == ["contradicted", "not judged", "not reproduced", "not judged", "not reproduced"]


def test_too_few():
    """A column with hardly any learned actions leads to no number of kick-offs, and old seasons to none at all."""
    games, _ = tables(*(season("paper", HUMAN, s, last=20, other=lambda g, s=s: 5.0 if (s, g) == (0, 12) else 0.0) for s in range(3)))
    said = list(conclusions(kick_offs(games)))
    assert said[-1].endswith(" They are too few to say anything of the paper's column.")
    old = games.with_columns(pl.lit(None, pl.Int64).alias("first_other_actions"))
    assert list(conclusions(kick_offs(old))) == []
    assert next(iter(reversed(list(about_kick_offs(games))))).endswith(NOT_TOLD)
    assert list(about_kick_offs(games.filter(pl.col("settings") == "best"))) == []


@pytest.mark.slow
def test_ablations_drawn():
    """Ablations are drawn for the settings that they vary, and for no others."""
    games, growth = (pl.concat(parts) for parts in zip(world(2), *ablations(2), strict=True))
    named = pictures(games, growth)
    assert "ablations-paper" in named
    assert "ablations-best" not in named


def test_ablation_panels():
    """Each of many ablations has a panel of its own, with the base in it."""
    every = [season(name, "static", s, last=4, goals=lambda g, k=k, s=s: (k + s * (k == 0), 2))
             for k, name in enumerate(("best", *(f"best-{letter}" for letter in "abcdefg"))) for s in range(2)]
    games, _ = tables(*every, season("best-in-each-state", "static", 0, last=4))
    figure = ablations_plot(mean_curves(games, {"difference": DIFFERENCE, "other": OTHER}), "best", None)
    shown = [axes for axes in figure.axes if axes.get_visible()]
    assert len(shown) == 2 * 8
    titles = [axes.get_title(loc="left") for axes in shown]
    assert [t for t in titles if t] == [*(f"best-{letter} (2 seasons)" for letter in "abcdefg"), "best-in-each-state (1 season)"]
    assert {text.get_text() for text in figure.legends[0].get_texts()} == {"best (2 seasons)", "with the change"}
    assert len({axes.get_ylim() for axes, title in zip(shown, titles, strict=True) if title}) == 1
    lines = [(axes.get_ylim(), line.get_ydata()) for axes in shown for line in axes.lines if len(line.get_xdata()) == 4]
    assert len(lines) > 16
    assert all(low < min(y) <= max(y) < high for (low, high), y in lines)
    # .5 ± 12.7 × .707 / √2 less 2: the base's band
    assert figure.axes[0].get_ylim()[0] < 0.5 - 12.706 * 0.5 - 2
    five = games.filter(pl.col("settings").is_in(["best", *(f"best-{letter}" for letter in "abcde")]))
    figure = ablations_plot(mean_curves(five, {"difference": DIFFERENCE, "other": OTHER}), "best", 11)
    assert sum(axes.get_visible() for axes in figure.axes) == 2 * 5


def test_season_commands():
    """The report names the commands that play its seasons again."""
    games, _ = tables(*(season("paper", "static", seed) for seed in (1, 2, 3, 7)), season("best", "random", 1, last=2))
    assert list(commands(games)) == [
        "pitchlore season --settings best --opponent random --seed 1 --seasons 1 --games 2",
        "pitchlore season --settings paper --opponent static --seed 1 --seasons 3",
        "pitchlore season --settings paper --opponent static --seed 7 --seasons 1",
    ]


def test_person_commands():
    """A person plays one season at a time, and no command plays it again as it was."""
    games, growth = tables(*(season("paper", PERSON, seed, left=2) for seed in (1, 2)), season("best", STATIC, 1, last=2))
    assert list(commands(games))[1:] == [
        f"pitchlore season --settings paper --opponent person --seed {seed}" for seed in (1, 2)]
    assert "`make seasons` makes the study again, but for what people do" in page_of(games, growth)


def test_evaluation_commands():
    """The report names the commands that measure its apprentices again."""
    games, _ = tables(season("best", "static", 1), season("best", "static", 2))
    rows = pl.concat([
        evaluation("best-static-s1", pairs=100), evaluation("best-static-s1", "random", 3, first=2, minutes=2.5),
        evaluation("best-static-s2", pairs=2), evaluation("best-static-s2", pairs=1, first=7), evaluation("best-static-s9"),
        evaluation("best-static-s2", "v3", 1),
        *(evaluation("best-constant", opponent, 2) for opponent in (*PANEL, "random")),
        *(evaluation("constant:044", opponent, 2) for opponent in PANEL[1:]),
    ])
    assert list(evaluating(games, rows)) == [
        "pitchlore evaluate --policy best-constant --matches 4",
        "pitchlore evaluate --policy best-constant --against random --matches 4",
        "pitchlore evaluate --policy best-static-s1 --against random --matches 6 --seed 2 --minutes 2.5",
        "pitchlore evaluate --policy best-static-s1 --against static --matches 200",
        "pitchlore evaluate --policy best-static-s2 --against static --matches 4",
        "pitchlore evaluate --policy best-static-s2 --against static --matches 2 --seed 7",
        "pitchlore evaluate --policy best-static-s2 --against learned:3 --matches 2",
        *(f"pitchlore evaluate --policy constant:044 --against {opponent} --matches 4" for opponent in sorted(PANEL[1:])),
    ]


def test_tally_of_aims():
    """A claim that holds by construction is said, and counts in no tally."""
    games, growth = world()
    claims = judged(games, growth, apprentices())
    text = page_of(games, growth, apprentices())
    of = {"The paper": ~pl.col("item").is_in(["aim", "ablation"]), "Ours on ablations": pl.col("item") == "ablation",
          "Our aims": pl.col("item") == "aim"}
    for source, group in of.items():
        given = claims.filter(group, pl.col("verdict") == "by construction").height
        (tally, said, more) = re.findall(rf"- {source}, (\d+) claims: ([^.]*)\.(.*)", text)[0]
        assert int(tally) == claims.filter(group).height - given
        assert "by construction" not in said
        assert more == (f" {given} more hold by construction and are not counted." if given else "")
    assert claims.filter(of["Our aims"], pl.col("verdict") == "by construction").height == 3
