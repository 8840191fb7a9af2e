"""The report on seasons: plots, the page in both forms, the command."""

import json
import re
import shutil

import polars as pl
import pytest
from support.played import policy, starting
from support.receipts import put_receipt, receipt_at
from support.seasons import apprentices, rising, season, tables, world

from pitchlore.flows.cli import main
from pitchlore.pipeline import arena
from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.arena.teams.table import TEAMS
from pitchlore.pipeline.base.errors import NotFound
from pitchlore.pipeline.engine.evaluations import evaluate
from pitchlore.pipeline.engine.teams import entrant
from pitchlore.pipeline.stages.evaluations import Evaluation
from pitchlore.pipeline.stages.report.claims import season_verdicts
from pitchlore.pipeline.stages.report.document import code, markdown_table, picture, web_page
from pitchlore.pipeline.stages.report.measures import DIFFERENCE, OTHER, seasons_of
from pitchlore.pipeline.stages.report.preferences import preferred_by_role
from pitchlore.pipeline.stages.report.report import markdown
from pitchlore.pipeline.stages.report.summary import beside_table_3, mean_curves
from pitchlore.pipeline.stages.seasons.settings import Season, parse_season
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.query import ask
from pitchlore.pipeline.store.work import Made, Work
from pitchlore.pipeline.views.plots import seasons as plots
from pitchlore.pipeline.views.plots.style import plot_png
from pitchlore.pipeline.views.report import NAME, sources, write_report
from pitchlore.pipeline.views.report import tables as tables_in
from pitchlore.schemas import Evaluations, Games, Growth, Policies

pytestmark = pytest.mark.slow


def put(store, games, growth):
    """Commit each season as the flow of seasons does."""
    for (name,), mine in games.partition_by("season", as_dict=True).items():
        work = Work("seasons", name, {}, version=1, through={"arena": 1})
        store.commit(work, Made([(mine, Games), (growth.filter(pl.col("season") == name), Growth)]))


def labels(figure):
    return {text.get_text() for legend in figure.legends for text in legend.get_texts()}


def test_table_3():
    """Table 3 is drawn with the paper's values as dots beside it."""
    games, _ = world()
    paper = games.filter(pl.col("settings") == "paper")
    figure = plots.table_3(mean_curves(paper, {"other": OTHER}), beside_table_3(games, "paper"), 11)
    human, static = figure.axes
    assert human.get_xlabel() == static.get_xlabel() == "game"
    assert "%" in human.get_ylabel()
    assert human.get_title(loc="left") == "against human-like, a second script"
    assert labels(figure) == {"against human-like, a second script (5 seasons)", "against static (5 seasons)",
                              "the paper, against humans", "the paper, against Yamamoto"}
    line, dots = human.lines
    assert line.get_ydata()[:3] == pytest.approx([0.0, 0.28, 0.38])
    assert dots.get_ydata()[:3].tolist() == [0.0, 0.87, 1.04]
    (change,) = [line for line in static.lines if list(line.get_xdata()) == [10.5, 10.5]]
    assert change.get_linestyle() != "-"


def test_people_in_table_3():
    """Seasons against people are drawn beside the paper's human column, and the second script is not."""
    games, growth = (pl.concat(parts) for parts in zip(world(), season("paper", "person", 7, other=rising(7)), strict=True))
    paper = games.filter(pl.col("settings") == "paper")
    figure = plots.table_3(mean_curves(paper, {"other": OTHER}), beside_table_3(games, "paper"), 11)
    human, _ = figure.axes
    assert human.get_title(loc="left") == "against people"
    assert labels(figure) == {"against people (1 season)", "against static (5 seasons)",
                              "the paper, against humans", "the paper, against Yamamoto"}
    assert human.lines[0].get_ydata()[:2] == pytest.approx([0.0, 0.3])
    (line,) = {line.get_color() for line in human.lines} & {TEAMS["human"].colour}
    assert line
    assert labels(plots.states(mean_curves(growth, {"states": pl.col("states")}, ["role"]))) >= {
        "against people (1 season)", "against human-like, a second script (5 seasons)"}


def test_equal_bytes():
    """Equal tables give plots of equal bytes, whatever the order of their rows."""
    games, _ = world(2)
    best = games.filter(pl.col("settings") == "best")
    shuffled = best.sample(fraction=1.0, shuffle=True, seed=3)
    once, again = (plot_png(plots.progress(mean_curves(table, {"difference": DIFFERENCE, "other": OTHER}), 90)) for table in (best, shuffled))
    assert once == again


def test_no_games():
    """A plot of no games is refused with the reason."""
    with pytest.raises(NotFound, match="there are no games to draw"):
        plots.states(mean_curves(Growth.empty(), {"states": pl.col("states")}, ["role"]))


def test_page_of_markdown():
    """A page shows data as they are, marks up sentences, and holds its pictures and colours."""
    text = "\n\n".join([
        "# A & B", "**bold** and `code` < *so*", code(["a < b"]), picture("plot", "What *is* seen"),
        markdown_table(("name", "*n*"), [("<b>*x*|y</b> [1]", "1"), ("reproduced", "reproduced")], (False, True)), "reproduced",
    ])
    assert "| &lt;b>\\*x\\*\\|y&lt;/b> \\[1\\] | 1 |" in text
    assert "| --- | ---: |" in text
    assert "![What *is* seen](plot.png)" in text
    assert "    a < b" in text
    page = web_page("T <1>", text, {"plot": b"\x89PNG"}, {"reproduced": "#00644a"}).decode()
    assert "<title>T &lt;1&gt;</title>" in page
    assert "<h1>A &amp; B</h1>" in page
    assert "<strong>bold</strong> and <code>code</code> &lt; <em>so</em>" in page
    assert "<pre><code>a &lt; b\n</code></pre>" in page
    assert "<td>&lt;b&gt;*x*|y&lt;/b&gt; [1]</td>" in page
    assert '<th style="text-align:right">*n*</th>' in page
    assert re.search(r'<figure id="plot"><img src="data:image/png;base64,iVBORw==" alt="What is seen" ?/>'
                     r"<figcaption>What <em>is</em> seen</figcaption>\s*</figure>", page)
    assert page.count("color: #00644a") == 2  # both cells, not the sentence
    assert page.count('<div class="table"><table>') == page.count("</table></div>") == 1


def test_people_on_page():
    """The page says how much people played, and shows their games beside the paper's."""
    games, growth = tables(*(season("paper", "person", seed, left=2) for seed in (1, 2)), season("best", "static", 1, last=2))
    text = markdown(games, Evaluations.empty(), 0, season_verdicts(seasons_of(games, growth)), [], "pitchlore")
    assert "Seasons that people played: 2, games: 70." in text
    assert "Games left before their end, and played anew: 140." in text
    assert "### Against people" in text
    assert "nobody has played" not in text


def test_second_script():
    """Until a person plays, the human-like team is called a second script in each table that it is in."""
    games, growth = world()
    text = markdown(games, apprentices(), 0, season_verdicts(seasons_of(games, growth)), [], "pitchlore")
    assert "Here nobody has played a season yet" in text
    assert "### Against human-like (a second script), beside the paper's human column" in text
    for line in re.findall(r".*human-like.*", text):
        assert "human-like (a second script)" in line, line
    assert "paper, static less human-like (a second script)" in text.replace("\\", "")


def test_apprentices_on_page():
    """The page says how apprentices did and what is left out."""
    games, growth = world()
    text = markdown(games, apprentices(), 3, season_verdicts(seasons_of(games, growth)), [], "pitchlore").replace("\\", "")
    assert "| best | static | 35 | random | 5 | 100 | 3.80 [3.80, 3.80] | 95.0 [95.0, 95.0] | 10.0 [10.0, 10.0] | 95.0 [" in text
    assert "Left out: 3 pairs" in text
    assert re.search(r"- The paper, \d+ claims: .*reproduced.*\. 12 more hold by construction and are not counted\.", text)


ROLE_BY_ROLE = policy(
    ("goalkeeper", 0, "088", 0.3, 1.0), ("goalkeeper", 0, "044-021", 0.2, 100.0), ("goalkeeper", 0, "194", -0.1, 900.0),
    ("midfield", 0, "044", 0.1, 4.0), ("midfield", 0, "021", 0.0, 4.0), ("striker", 0, "021", 0.5, 1000.0), ("striker", 0, "046", 0.4, 1000.0),
)


def test_preferred():
    """An apprentice prefers the behaviour that is worth most after its doubt is subtracted."""
    # .3 - .7 / 1 against .2 - .7 / 10
    assert preferred_by_role(ROLE_BY_ROLE, 0.7).rows() == [
        ("goalkeeper", "044 Robot reaches the ball, 021 Robot kicks the ball", 0.2, 100.0),
        ("midfield", "044 Robot reaches the ball", 0.1, 4.0), ("striker", "021 Robot kicks the ball", 0.5, 1000.0)]
    assert preferred_by_role(ROLE_BY_ROLE, 0.0)["does"].to_list()[0] == "088 Robot approaches its own goal"
    assert preferred_by_role(policy(("striker", 0, "021", 1.0), key="self6"), 0.0).height == 0
    assert preferred_by_role(Policies.empty(), 0.0).height == 0


def test_preferred_is_played():
    """An apprentice plays the behaviours that it is said to prefer."""
    team = TeamSettings(kind="learned", lcb_weight=0.7)
    of = Recipe(home=team, away=TeamSettings(kind="static"), seed=1, referee=RefereeSettings(duration_s=20.0))
    played = starting(of, ROLE_BY_ROLE)
    played.advance(20 * 60)
    does = {role: "-".join(re.findall(r"\d{3}", words)) for role, words, *_ in preferred_by_role(ROLE_BY_ROLE, 0.7).iter_rows()}
    made = played.take().decisions.filter("chosen")
    assert set(made["behaviour_id"]) == {f"{role}-{codes}" for role, codes in does.items()}


@pytest.fixture(scope="module")
def reported(tmp_path_factory):
    data = tmp_path_factory.mktemp("report")
    put(Store(data), *world(5))
    export = data / "export"
    with pytest.raises(SystemExit, match="0"):
        main(["report", "--export", str(export), "--data", str(data)])
    return data, export


def test_page(reported):
    """The page is one small file that fetches nothing."""
    data, _ = reported
    page = (data / "report" / "index.html").read_bytes()
    assert len(page) < 3_000_000
    text = page.decode()
    assert not re.search(r'(src|href)="(?!data:)', text)
    assert text.count("const WORDS = ") == 1, "its words are explained"
    for what in ("a second script", "no model of anyone", "Table 3: new actions", "Figure 8", "Figure 9", "Figure 10",
                 "Our best apprentice", "Settings beside each other", "contradictory", "5,230"):
        assert what in text, what


def test_export(reported):
    """An export is complete, and its README links every picture in it and nothing else."""
    data, export = reported
    names = {path.name for path in export.iterdir()}
    assert names == {"README.md", "games.csv", "growth.csv", "evaluations.csv", "claims.csv", "preferences.csv", "kick-offs.csv", "sensitivity.csv", "table-3.png", "figure-8.png", "figure-9.png",
                     "figure-10.png", "best.png"}
    linked = re.findall(r"\]\(([^)]+)\)", (export / "README.md").read_text())
    assert set(linked) == {name for name in names if name.endswith(".png")}
    assert pl.read_csv(export / "games.csv").height == 20 * 35
    assert pl.read_csv(export / "growth.csv").height == 20 * 35 * 3
    assert ask(data / "catalog.duckdb", "select count(*) n from claims")["n"].item() == pl.read_csv(export / "claims.csv").height


def read(store):
    """Games that a report would be made of."""
    return tables_in(store, sources(store))


SHORT = Season(name="best", opponent="static", seed=1, settings=parse_season('base = "best"\n[referee]\nduration_s = 2', where="here"))


@pytest.fixture
def taught(tmp_path):
    """A data folder with a season of one game, whose apprentice has a behaviour for each role."""
    store, own = Store(tmp_path), Store(tmp_path / "seasons" / SHORT.id)
    games, growth = tables(season("best", "static", 1, last=1, name=SHORT.id))
    policy = Made([(ROLE_BY_ROLE, Policies)], details={"knowledge_version": 1})
    own.commit_version(Work("policies", "policies", {}, version=1), policy, 1, parent=None)
    work = Work("seasons", SHORT.id, SHORT.model_dump(mode="json"), version=1, through={"arena": arena.VERSION})
    store.commit(work, Made([(games, Games), (growth, Growth)],
                            details={"games": 1, "store": f"seasons/{SHORT.id}", "policy": 1}))
    return store


def test_preferences_in_report(taught, call):
    """A report says what the apprentices of the best settings do, as long as their policy is there."""
    assert "preferred behaviours of the best apprentices" in call("report", "--data", taught.root)[1]
    (goalkeeper, _, striker) = json.loads(call("report", "--json", "--data", taught.root)[1])["preferences"]
    assert goalkeeper["does"] == "044 Robot reaches the ball, 021 Robot kicks the ball"  # as cautious as it plays
    assert striker == {"settings": "best", "opponent": "static", "season": SHORT.id, "role": "striker",
                       "does": "021 Robot kicks the ball", "worth": 0.5, "evidence": 1000.0}
    store = taught.root / "seasons" / SHORT.id
    store.rename(away := store.with_name("away"))
    assert read(taught).preferences.height == 0
    away.rename(store)
    assert read(taught).preferences.height == 3


def measure(store, seeds=(0,), seconds=2.0, policy=SHORT.id, against="random", **options):
    """As the command evaluate does."""
    known = {}
    team, opponent = entrant(store, policy, known, **options), entrant(store, against, known)
    evaluate(store, Evaluation(team=team, opponent=opponent, referee=RefereeSettings(duration_s=seconds)), seeds, known)


def test_evaluations_in_report(taught):
    """A report is made anew for evaluations of its own apprentices, and for no others."""
    first = write_report(taught).receipt
    measure(taught, policy="static")
    measure(taught, seconds=1.0)
    measure(taught, min_visits=3)
    again = write_report(taught).receipt
    assert again == first
    assert (read(taught).evaluations.height, read(taught).left_out) == (0, 2)
    measure(taught, (0, 1))
    measured, page, _ = write_report(taught)
    assert measured.key != first.key
    rows = read(taught).evaluations
    assert rows.select("team", "opponent", "seed", "match").rows() == [
        (SHORT.id, "random", seed, match) for seed in (0, 1) for match in (1, 2)]
    assert sum(label.startswith("evaluations/") for label in measured.inputs) == 2
    assert re.search(r'<td>best</td>\s*<td>static</td>\s*<td[^>]*>1</td>\s*<td>random</td>\s*<td[^>]*>1</td>\s*<td[^>]*>4</td>', page.read_text())
    assert write_report(taught)[0] == measured
    assert [receipt.name for receipt in taught.receipts("report")] == [NAME]


def test_controls_in_report(taught):
    """Constant teams in matches like a season's stand beside its apprentice."""
    measure(taught, (0, 1))
    measure(taught, (0, 1), policy="constant:044")
    measure(taught, policy="constant:021", seconds=1.0)
    _, page, (_, _, evaluations, left_out, _) = write_report(taught)
    assert (evaluations["team"].unique().sort().to_list(), left_out) == ([SHORT.id, "constant:044"], 1)
    assert "<td>constant:044</td>" in page.read_text()


def test_controls_beside_an_old_season(taught):
    """A season whose settings this version cannot read takes nothing from the others."""
    measure(taught, (0, 1), policy="constant:044")
    path = taught.root / "seasons" / f"{SHORT.id}.receipt.json"
    said = receipt_at(path)
    said["settings"]["settings"]["pipeline"]["behaviours"]["teams"] = ["away"]
    put_receipt(taught.root / "seasons" / "an-old-one.receipt.json", said, name="an-old-one")
    assert read(taught).evaluations["team"].unique().to_list() == ["constant:044"]


def test_evaluations_left_out(taught, monkeypatch):
    """Evaluations by two arenas are not mixed, and those of a policy that is gone are left out."""
    measure(taught, (0, 1))
    path = next((taught.root / "evaluations").glob("*-0.receipt.json"))
    put_receipt(path, receipt_at(path), versions={"evaluations": 1, "arena": 0})
    assert (read(taught).evaluations["seed"].unique().to_list(), read(taught).left_out) == ([1], 1)
    # those of the season's own arena come first
    season_path = taught.root / "seasons" / f"{SHORT.id}.receipt.json"
    put_receipt(season_path, receipt_at(season_path), versions={"seasons": 1, "arena": 0})
    assert (read(taught).evaluations["seed"].unique().to_list(), read(taught).left_out) == ([0], 1)
    shutil.rmtree(taught.root / "seasons" / SHORT.id)
    assert (read(taught).evaluations.height, read(taught).left_out) == (0, 2)


def test_json(reported, call):
    """The report as JSON has the sections of the page and the verdicts on the claims."""
    data, _ = reported
    code, out, _ = call("report", "--json", "--data", data)
    said = json.loads(out)
    assert code == 0
    assert set(said) == {"page", "played", "claims", "compared", "ablated", "measured", "left_out", "preferences",
                         "kick_offs", "sensitivity", "note"}
    assert {row["verdict"] for row in said["claims"]} >= {"reproduced", "contradictory", "by construction", "not reproduced"}


def test_no_seasons(tmp_path, call):
    """Without a season the command fails and names the next step."""
    (tmp_path / "inbox").mkdir()
    code, _, err = call("report", "--data", tmp_path)
    assert code == 1
    assert "no season has been played. Play one with `pitchlore season`" in err


def test_broken_receipt(tmp_path, call):
    """A report is made anew when there are more seasons; one whose receipt cannot be read is named and left out."""
    store = Store(tmp_path)
    put(store, *tables(season("paper", "static", 1, last=2)))
    first, page, _ = write_report(store)
    assert "not judged" in page.read_text()
    put(store, *tables(*(season("paper", "static", seed, last=2) for seed in (2, 3))))
    (tmp_path / "seasons" / "paper-static-s3.receipt.json").write_text("{")
    code, out, err = call("report", "--json", "--data", tmp_path)
    assert code == 3
    assert "paper-static-s3.receipt.json: is not a readable receipt" in err
    assert [row["seasons"] for row in json.loads(out)["played"]] == [2]
    (again,) = store.receipts("report")
    assert again.key != first.key
