"""The words that pages explain where they stand: one list, of which also the page of words is made.

``terms.js`` marks the words in a page and shows their meanings; ``terms.css`` is its style.
"""

from __future__ import annotations

import json
from importlib import resources
from typing import NamedTuple


class Term(NamedTuple):
    """A word with its meaning.

    Attributes:
        key: its anchor in the page of words.
        title: the word.
        means: its meaning in sentences; what stands between backticks is typed.
        found: pattern of the words in a text, of JavaScript and Python alike; empty if none is marked.
    """

    key: str
    title: str
    means: str
    found: str = ""


TERMS = (
    Term("situation", "Situation",
         "One thing that one robot did, with start and end: it kicks the ball, it approaches its goal. "
         "There are 32, each with a code.",
         "[Ss]ituations?"),
    Term("gram", "Gram",
         "A run of one to four situations of one robot, one after the other.",
         "[Gg]rams?"),
    Term("instance", "Instance",
         "One time that a robot did it.",
         "[Ii]nstances?|[Oo]ccurrences?"),
    Term("behaviour", "Behaviour",
         "A gram that a role of a team showed often enough to be kept in the knowledge. Its id is the "
         "role and the codes: `striker-044-021`.",
         "[Bb]ehaviours?"),
    Term("role", "Role",
         "What a robot does at a moment, by its place among its team: goalkeeper, midfield or striker. "
         "A robot may change it.",
         "[Rr]oles?"),
    Term("support", "Support",
         "The number of instances of a behaviour that were seen.",
         "[Ss]upport"),
    Term("v", "V",
         "The chance of a team to score soon, less that of the adversary, at one moment. It is between "
         "−1 and 1, and each league has a V of its own.",
         "V|[Cc]hances? (?:of [^.]{1,40} )?to score soon|Who is on top"),
    Term("value", "Value",
         "Of a behaviour: what an instance changes of V on average, with its 95 % interval in "
         "brackets. Of a behaviour in a state of a policy: the return that the policy expects, +1 for "
         "a goal for and −1 for a goal against, less the later it comes.",
         "[Vv]alues?"),
    Term("effect", "Effect in all",
         "What V changed with a behaviour in all: its value times how often it was seen.",
         "[Ee]ffect"),
    Term("went-with", "Went with better (or worse) chances",
         "While a robot did this, the chances of its team rose (or fell) on average. It is not said "
         "that doing more of it helps: a robot does it where chances are good, and doing it elsewhere "
         "may do harm.",
         "[Ww]ent with (?:better|worse|more|winning|losing|its)(?:(?: adversaries')? chances)?"),
    Term("sure", "Sure",
         "It is hardly chance that the two went together. Of behaviours that are called so, 5 % are "
         "false at most. Of acts on the first page, the 99.9 % interval around the change of chances does "
         "not reach the usual change.",
         "(?<=: )sure|^sure$"),
    Term("likely", "Likely",
         "The 95 % interval around the change of chances does not reach the usual change. Of thousands "
         "that are compared, some are called so by luck.",
         "(?<=: )likely|^likely$"),
    Term("too-few", "Too few",
         "Seen fewer than five times, or too seldom to tell its value from 0: the 95 % interval reaches 0.",
         "(?<=: )too few"),
    Term("may-be-chance", "May be chance",
         "The 95 % interval around the change of chances reaches the usual change, so chance alone may have "
         "made the difference.",
         "^may be chance$"),
    Term("too-few-matches", "Too few matches",
         "Fewer than four matches on a side. With three matches on each side even the largest difference "
         "comes by chance one time in ten.",
         "too few matches"),
    Term("varies", "Varies too much",
         "From match to match it differs so much that the 95 % interval of its mean reaches from 0 to twice "
         "the mean.",
         "varies too much"),
    Term("interval", "95 % interval",
         "Where a number lies as far as chance goes. Of a hundred such intervals about five miss it.",
         "95[ \\u00a0]% intervals?"),
    Term("evidence", "Evidence",
         "How much a number rests on. That of a policy is counted in episodes.",
         "[Ee]vidence"),
    Term("episode", "Episode",
         "A stretch of play whose end is known.",
         "[Ee]pisodes?"),
    Term("policy", "Policy",
         "What the robots of a trained team decide by.",
         "[Pp]olic(?:y|ies)"),
    Term("knowledge", "Knowledge",
         "The behaviours that were kept of each team, and where they were seen. Each version has a "
         "number and stays as it is.",
         "[Kk]nowledge"),
    Term("option", "Option",
         "What a robot is about to do: the situation that it is bringing about.",
         "[Oo]ptions?"),
    Term("state", "State and key",
         "A state says in levels where the ball and the robots are, as one robot sees them. A key says "
         "how many elements of it are kept.",
         "[Ss]tates?|[Kk]ey(?= [a-z]+-?\\d)"),
    Term("possession", "Possession",
         "Share of the time with an owner of the ball in which the team is it. The owner touched last; "
         "in a duel it is nobody.",
         "[Pp]ossession(?! of the)"),
    Term("duel", "Duel",
         "Both teams touch the ball at once.",
         "[Dd]uels?"),
    Term("territory", "Territory",
         "Share of the time in play in which the ball is in the adversary's half.",
         "[Tt]erritory|ball in the adversary's half"),
    Term("space", "Space",
         "Share of the pitch that the robots of a team reach first, each going on as it moves and then "
         "at its league's top speed.",
         "[Ss]pace|pitch that it reaches first"),
    Term("shots", "Shot on target",
         "A touch after which the ball's straight line crosses the goal line between the posts, as "
         "loganalyzer3 counts. A shot that a robot blocks or saves is one, too. A wide shot is not. The "
         "first touch of a kick-off is a shot only if it goes in or gets half of its way to the goal line.",
         "[Ss]hots? on target"),
    Term("from-shots", "Goal from a shot",
         "A goal that a shot became, perhaps off adversaries. The shooter may still push the ball "
         "while an adversary touches it. A goal that several robots push in together, or that the "
         "adversary makes, is not from a shot.",
         "[Gg]oals? from shots?|[Ff]rom shots"),
    Term("xg", "Expected goals (xG)",
         "The probability that a shot becomes a goal; of a match, their sum over its shots.",
         "[Ee]xpected goals|xG"),
    Term("lost", "Ball lost",
         "The adversary touches the ball next, and the last touch was no shot.",
         "[Bb]alls? lost|[Ll]ost balls?|(?:[Ww]ho|[Ww]here it) loses the ball"),
    Term("goals", "Direct, indirect, error",
         "How a goal was made. Direct: a robot kicked or guided the ball, nobody else touched it, and "
         "it rolled straight into the goal. Indirect: the scoring team made it in another way. Error: "
         "a robot of the team that conceded it put it in, or it went in off that robot without a shot.",
         "(?:[Ii]n)?[Dd]irect|errors?(?= of [^.]+$)|^errors?$"),
    Term("through", "Through pass",
         "A pass far forward, deep into the adversary's half and behind its last robot but the "
         "goalkeeper.",
         "[Tt]hrough pass(?:es)?"),
    Term("tried", "Pass that was tried",
         "A ball that leaves a robot and goes at least 2 m on a pitch of 105 m, in proportion on "
         "others, before another robot touches it or play stops. One that arrives is a pass.",
         "passes tried"),
    Term("pressing", "To press",
         "To be close to an adversary while it touches the ball. Two robots that press at once count "
         "twice.",
         "[Pp]ress(?:ed|es|ing|ure)?"),
    Term("ppda", "PPDA",
         "Passes that the adversary tries in its own 60 % of the pitch, for each ball won or duel "
         "there. Less is more pressing.",
         "PPDA"),
    Term("phase", "Phase",
         "A part of a team's possession. Transition: the first quarter of the time that a run along "
         "the pitch takes, after the ball was won in play. Then by the third where the ball is: "
         "build-up in the own one, middle, and attack.",
         "[Pp]hases?|[Tt]ransition|[Bb]uild-up|[Oo]f its possession"),
    Term("sprint", "Fast, sprint",
         "Fast is from 60 % of the league's top cruising speed, of people from 5.5 m/s. A sprint is a "
         "stretch from 90 %, of people from 7 m/s.",
         "[Ss]prints?|fast"),
    Term("stamina", "Stamina",
         "What a player of RoboCup 2D can still spend on running, of 8,000; the server gives some of "
         "it back in each cycle. While it is low, its dashes become weaker.",
         "[Ss]tamina"),
    Term("typical", "Typical",
         "What a team shows more often than the other teams of its league, also by the lower end of "
         "the 95 % interval.",
         "^[Tt]ypical$|[Tt]ypical of"),
    Term("neuron", "Neuron and prototype",
         "A cell of a self-organising map, which puts grams that are alike side by side. Its prototype "
         "is the gram that it stands for.",
         "[Nn]eurons?|[Pp]rototypes?"),
    Term("n", "n",
         "The number of cases that a number is made from.",
         "n(?= =)|^n$"),
    Term("beyond", "★",
         "The difference is larger than chance gives: in 95 % of such cases chance stays below it.",
         "★"),
    Term("tables", "Tables",
         "The pages show numbers of public tables. Names such as `decisions` or `grams` are such "
         'tables: `pitchlore sql "from grams limit 5"` reads one.'),
)


def words_script() -> str:
    """The words, and the code that marks them in a page."""
    return f"const WORDS = {json.dumps(TERMS, ensure_ascii=False)};\n{_asset('terms.js')}"


def words_style() -> str:
    """The style of marked words."""
    return _asset("terms.css")


def explained(page: bytes) -> bytes:
    """A page that stands alone, with its words explained."""
    added = f"<style>\n{words_style()}</style>\n<script>\n\"use strict\";\n{words_script()}</script>\n</html>"
    return page.replace(b"</html>", added.encode())


def _asset(name: str) -> str:
    return resources.files(__name__.rpartition(".")[0]).joinpath(name).read_text(encoding="utf-8")
