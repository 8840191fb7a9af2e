"""The recogniser once more, slowly and literally: one robot, one rule, one sample at a time.

Nothing of the fast one is used but the rules' texts, the terms and the settings: signals are plain
trigonometry, memberships are scikit-fuzzy's, conditions are walked as Python syntax trees, marks are a
dict, and priorities are painted on a list. Both must find the same situations.
"""

import ast
import functools
import itertools
import math
from collections import defaultdict
from typing import Any, NamedTuple

import polars as pl

from pitchlore.pipeline.game.pitch import SCALES, Pitch
from pitchlore.pipeline.settings import SituationSettings
from pitchlore.pipeline.stages.situations import fuzzy
from pitchlore.pipeline.stages.situations.fuzzy import Variable
from pitchlore.pipeline.stages.situations.rules import MACROS, RULES, TABLE_1, Rule, Start, Target
from pitchlore.schemas import ROLES

CLOCK = 1_000
ROUNDING = 1e-9
NAN = math.nan
Body = tuple[str, int | None]
BALL: Body = ("ball", None)


class Found(NamedTuple):
    """One situation, as a row of schema Situations without the match and the name."""

    team: str
    robot: int
    role: str
    code: int
    start_ns: int
    end_ns: int
    strength: float | None
    target: str | None
    segment: int


def turn_between(a: float, b: float) -> float:
    """Absolute difference of two angles, in [0, pi]."""
    return abs(math.remainder(a - b, 2 * math.pi))


def bearing(dx: float, dy: float) -> float:
    """Direction of a thing, unknown if it is where one stands."""
    return math.atan2(dy, dx) if dx or dy else NAN


class Match:
    """The table as dicts: everything by frame and body."""

    def __init__(self, table: pl.DataFrame, pitch: Pitch) -> None:
        self.pitch = pitch
        self.scales = SCALES[pitch.kind]
        self.still = 0.05 * self.scales.speed
        self.time: dict[int, int] = {}
        self.segment: dict[int, int | None] = {}
        self.at: dict[int, dict[Body, dict[str, Any]]] = defaultdict(dict)
        self.bodies: list[Body] = []
        for row in table.iter_rows(named=True):
            frame, body = row["frame"], (row["team"], row["robot"])
            self.time[frame], self.segment[frame] = row["t_ns"], row["segment"]
            if body not in self.bodies:
                self.bodies.append(body)
            if not row["suspect"]:
                self.at[frame][body] = {key: NAN if value is None else value for key, value in row.items()}
        self.frames = sorted(self.time)
        self.ball_course: dict[int, float] = {}
        course, before = NAN, None
        for frame in self.frames:
            if self.segment[frame] != before:
                course, before = NAN, self.segment[frame]
            ball = self.at[frame].get(BALL)
            if ball and math.hypot(ball["vx"], ball["vy"]) >= self.still:
                course = math.atan2(ball["vy"], ball["vx"])
            self.ball_course[frame] = course
        self.ball_jolts = self.jolts()

    def jolts(self) -> dict[int, tuple[float, float]]:
        """Jolt and gain of the ball at each frame that has it."""
        found, sizes, gains = {}, {}, {}
        seen = [frame for frame in self.frames if BALL in self.at[frame]]
        for i, frame in enumerate(seen):
            first = i
            while first > 0 and self.segment[seen[first - 1]] == self.segment[frame] and (
                self.time[seen[first]] - self.time[seen[first - 1]] <= 200_000_000
            ):
                first -= 1
            middle = self.back(seen, i, first)
            begin = self.back(seen, middle, first) if middle is not None else None
            if begin is None:
                found[frame] = (0.0, 0.0)
                continue
            after, before = self.velocity(seen[middle:i + 1]), self.velocity(seen[begin:middle + 1])
            jolt = math.dist(after, before) - 0.1 * math.hypot(*before)
            gains[frame] = math.hypot(*after) - math.hypot(*before)
            sizes[frame] = max(jolt, 0.0)
            recent = [f for f in seen[first:i + 1] if self.time[frame] - self.time[f] <= 50_000_000 + CLOCK]
            peak = max(recent, key=lambda f: (sizes.get(f, 0.0), f))
            found[frame] = (sizes[frame], gains.get(peak, 0.0))
        return found

    def back(self, seen: list[int], i: int, first: int) -> int | None:
        """The latest of the samples before sample i that is 50 ms earlier, else the first; None without any."""
        if i == first:
            return None
        enough = [j for j in range(first, i) if self.time[seen[i]] - self.time[seen[j]] >= 50_000_000 - CLOCK]
        return enough[-1] if enough else first

    def velocity(self, frames: list[int]) -> tuple[float, float]:
        """Slope of the least-squares line through the ball's places."""
        times = [self.time[frame] * 1e-9 for frame in frames]
        middle = sum(times) / len(times)
        spread = sum((t - middle) ** 2 for t in times)

        def slope(name: str) -> float:
            values = [self.at[frame][BALL][name] for frame in frames]
            mean = sum(values) / len(values)
            return float(sum((t - middle) * (v - mean) for t, v in zip(times, values, strict=True)) / spread)

        return slope("x"), slope("y")

    def role(self, body: Body, frame: int) -> int | None:
        """The role it had when it was last seen."""
        for earlier in reversed([f for f in self.frames if f <= frame]):
            if body in self.at[earlier]:
                return ROLES.index(self.at[earlier][body]["role"])
        return None

    def course(self, robot: dict[str, Any]) -> float:
        """The direction in which a robot drives."""
        theta, vx, vy = robot["theta"], robot["vx"], robot["vy"]
        if math.isnan(theta + vx + vy):
            return NAN
        if self.scales.omnidirectional:
            return math.atan2(vy, vx) if math.hypot(vx, vy) >= self.still else theta
        return theta + math.pi if vx * math.cos(theta) + vy * math.sin(theta) < -self.still else theta

    def signals(self, me: Body, frame: int, other: Body | None) -> dict[str, float]:
        """All signals of one robot at one sample; of those about one other if there is one."""
        now = self.at[frame]
        robot = now[me]
        x, y, theta, course = robot["x"], robot["y"], robot["theta"], self.course(robot)
        speed = math.hypot(robot["vx"], robot["vy"])
        found = {"speed": speed}

        def towards(name: str, there: tuple[float, float]) -> None:
            dx, dy = there[0] - x, there[1] - y
            found[f"{name}_distance"] = math.hypot(dx, dy)
            found[f"{name}_off_heading"] = turn_between(bearing(dx, dy), theta)
            found[f"{name}_off_course"] = turn_between(bearing(dx, dy), course)

        if other is not None:
            away = now.get(other, {"x": NAN, "y": NAN})
            towards("other", (away["x"], away["y"]))
            return found
        ball = now.get(BALL)
        if ball is None:
            ball, ball_course, (jolt, gain) = {"x": NAN, "y": NAN, "vx": NAN, "vy": NAN}, NAN, (NAN, NAN)
        else:
            ball_course, (jolt, gain) = self.ball_course[frame], self.ball_jolts[frame]
        ball_speed = math.hypot(ball["vx"], ball["vy"])
        towards("ball", (ball["x"], ball["y"]))
        towards("ball_x", (ball["x"], y))
        towards("ball_y", (x, ball["y"]))
        side = -1 if me[0] == "home" else 1
        towards("own_goal", (side * self.pitch.goal_x, 0.0))
        towards("adversary_goal", (-side * self.pitch.goal_x, 0.0))
        found["robot_off_ball_course"] = turn_between(bearing(x - ball["x"], y - ball["y"]), ball_course)
        found["course_off_ball_course"] = turn_between(course, ball_course)
        found["ball_y_way_off_course"] = turn_between(bearing(0.0, math.sin(ball_course)), course)
        off = found["ball_off_heading"]
        found["ball_off_face"] = {0: 0 * off, 1: off, 2: min(off, math.pi - off)}[self.scales.faces]
        found["ball_jolt"], found["ball_gain"] = jolt, gain
        found["ball_speed"] = ball_speed
        found["speed_over_ball"] = speed - ball_speed
        found["ball_speed_over_robot"] = ball_speed - speed
        for name, mine in (("opponent", False), ("teammate", True)):
            nearest = NAN if math.isnan(ball["x"]) else 1e6
            for body, row in now.items():
                if body not in (BALL, me) and (body[0] == me[0]) == mine:
                    nearest = min(nearest, math.hypot(ball["x"] - row["x"], ball["y"] - row["y"]))
            found[f"{name}_ball_distance"] = nearest
        others = min(found["opponent_ball_distance"], found["teammate_ball_distance"])
        found["nearest_ball_distance"] = 1e6 if others < found["ball_distance"] else found["ball_distance"]
        return found


class Degrees:
    """Degrees of conditions of one robot (about one other), sample by sample."""

    def __init__(self, match: Match, me: Body, other: Body | None, frames: list[int]) -> None:
        self.terms = fuzzy.terms(match.scales)
        self.signals = [match.signals(me, frame, other) for frame in frames]
        self.known: dict[tuple[str, str], list[float]] = {}
        self.walked: dict[tuple[str, int], float] = {}

    def term(self, signal: str, term: str, k: int) -> float:
        """Membership of one signal, by scikit-fuzzy."""
        if (signal, term) not in self.known:
            variable = (
                Variable.DISTANCE if signal.endswith("distance")
                else Variable.ORIENTATION if signal == "course_off_ball_course"
                else Variable.BEARING if "_off_" in signal
                else Variable.VELOCITY
            )
            values = [signals[signal] for signals in self.signals]
            self.known[signal, term] = fuzzy.membership(self.terms[variable][term], values).tolist()
        return self.known[signal, term][k]

    def of(self, text: str, k: int) -> float:
        """Degree of a condition at sample k."""
        if (text, k) not in self.walked:
            self.walked[text, k] = self.walk(tree(text), k)
        return self.walked[text, k]

    def walk(self, node: ast.expr, k: int) -> float:
        if isinstance(node, ast.BoolOp):
            degrees = [self.walk(value, k) for value in node.values]
            return unless_unknown(min if isinstance(node.op, ast.And) else max, degrees)
        if isinstance(node, ast.UnaryOp):
            return 1 - self.walk(node.operand, k)
        if isinstance(node, ast.Call):
            return self.walk(node.args[0], k) ** 2
        if isinstance(node, ast.Compare):
            signal, terms = node.left, node.comparators[0]
            names = terms.values if isinstance(terms, ast.BoolOp) else [terms]
            return unless_unknown(max, [self.term(signal.id, name.id, k) for name in names])
        return self.of(MACROS[node.id], k)


def unless_unknown(extreme: Any, degrees: list[float]) -> float:
    """The least or greatest degree; unknown if any is."""
    return NAN if math.isnan(sum(degrees)) else extreme(degrees)


@functools.cache
def tree(text: str) -> ast.expr:
    return ast.parse(text, mode="eval").body


class Robot:
    """One robot's samples and what is found in them."""

    def __init__(self, match: Match, me: Body, settings: SituationSettings) -> None:
        self.match, self.me, self.settings = match, me, settings
        frames = [f for f in match.frames if me in match.at[f] and match.segment[f] is not None]
        self.frames = frames
        self.t = [match.time[f] for f in frames]
        self.piece = [0] * len(frames)
        for k in range(1, len(frames)):
            neighbours = match.frames.index(frames[k]) == match.frames.index(frames[k - 1]) + 1
            away = not neighbours and self.t[k] - self.t[k - 1] > settings.flicker_s * 1e9 + CLOCK
            other_segment = match.segment[frames[k]] != match.segment[frames[k - 1]]
            self.piece[k] = self.piece[k - 1] + (away or other_segment)
        self.until = [self.end_of(k) for k in range(len(frames))]

    def end_of(self, k: int) -> int:
        """Where sample k's own interval ends."""
        if k + 1 < len(self.t) and self.piece[k + 1] == self.piece[k]:
            return self.t[k + 1]
        match = self.match
        at = match.frames.index(self.frames[k])
        times = [match.time[f] for f in match.frames if match.segment[f] == match.segment[self.frames[k]]]
        steps = sorted(b - a for a, b in itertools.pairwise(times))
        middle = (steps[(len(steps) - 1) // 2] + steps[len(steps) // 2]) / 2 if steps else 0
        end = self.t[k] + int(middle)
        return min(end, match.time[match.frames[at + 1]]) if at + 1 < len(match.frames) else end

    def close(self, later: int, earlier: int, seconds: float) -> bool:
        """True if two samples are neighbours or at most so far apart."""
        return later == earlier + 1 or self.t[later] - self.t[earlier] <= seconds * 1e9 + CLOCK

    def chunk(self, k0: int, k1: int, longest_s: float) -> int:
        """End of the first of the even chunks."""
        longest, lasts = longest_s * 1e9, self.until[k1 - 1] - self.t[k0]
        if lasts <= longest + CLOCK:
            return k1
        share = lasts / math.ceil((lasts - CLOCK) / longest)
        k = k0 + 1
        while k < k1 and self.until[k] - self.t[k0] <= share + CLOCK:
            k += 1
        return k

    def hold(self, rule: Rule) -> float:
        """Seconds after which a playing time belongs to the rule's term."""
        term = fuzzy.PLAYING_TIMES[rule.lasts]
        return term.a + self.settings.fire_at * (term.b - term.a)

    def stretches(self, rule: Rule, degrees: Degrees) -> list[tuple[int, int, float]]:
        """Occurrences of a rule without final condition."""
        fire = self.settings.fire_at - ROUNDING
        runs: list[list[int]] = []
        for k in range(len(self.t)):
            if degrees.of(rule.initial, k) >= fire:
                last = runs[-1][-1] if runs else None
                if last is not None and self.piece[last] == self.piece[k] and self.close(
                    k, last, self.settings.flicker_s
                ):
                    runs[-1].append(k)
                else:
                    runs.append([k])
        found = []
        for run in runs:
            last = run[-1]
            at_the_end = last + 1 == len(self.t) or self.piece[last + 1] != self.piece[last]
            k0, k1 = run[0], last + at_the_end
            lasted = self.t[run[-1]] - self.t[k0]
            if lasted < self.hold(rule) * 1e9 - CLOCK:
                continue
            time = fuzzy.PLAYING_TIMES[rule.lasts]
            long_enough = fuzzy.membership(time._replace(c=1e6, d=1e6), lasted * 1e-9).item()
            degree = min([degrees.of(rule.initial, k) for k in run] + [long_enough])
            if rule.once:
                end = next((k for k in range(k0 + 1, k1) if self.t[k] - self.t[k0] >= rule.limit_s * 1e9 - CLOCK), k1)
                found.append((k0, end, degree))
                continue
            while k0 < k1:
                end = self.chunk(k0, k1, min(rule.limit_s, self.settings.longest_s))
                found.append((k0, end, degree))
                k0 = end
        return found

    def completions(self, rule: Rule, degrees: Degrees) -> list[tuple[int, int, float]]:
        """Occurrences of a rule with initial and final condition."""
        fire = self.settings.fire_at - ROUNDING
        found = []
        mark: dict[str, Any] = {}
        for k in range(len(self.t)):
            if k and self.piece[k] != self.piece[k - 1]:
                mark = {}
            if mark:
                final = degrees.of(rule.final, k)
                if final >= fire:
                    if self.close(k, mark["held"], rule.limit_s):
                        k0 = mark["onset"] if rule.start == Start.ONSET else mark["held"]
                        while k0 < mark["held"] and self.t[k] - self.t[k0] > self.settings.longest_s * 1e9 + CLOCK:
                            k0 += 1
                        found.append((k0, k, min(mark["degree"], final)))
                    mark = {}
            initial = degrees.of(rule.initial, k)
            if initial >= fire:
                if not mark or not self.close(k, mark["held"], self.settings.lull_s):
                    mark = {"onset": k}
                mark |= {"held": k, "degree": initial}
        return found

    def code_of(self, rule: Rule, k0: int, other: Body | None) -> int:
        if isinstance(rule.code, int):
            return rule.code
        assert other is not None
        mine = self.match.role(self.me, self.frames[k0])
        theirs = self.match.role(other, self.frames[k0])
        if theirs is None:
            return 0
        return rule.code[theirs if rule.target == Target.OPPONENT else (theirs - mine) % 3]

    def occurrences(self) -> list[tuple[int, int, int, int, int, int, float, str | None]]:
        """(priority, k0, code, rule, other's place, k1, strength, target), in order of painting."""
        match = self.match
        robots = [body for body in match.bodies if body != BALL]
        found = []
        for other in [None, *robots]:
            if other == self.me:
                continue
            degrees = Degrees(match, self.me, other, self.frames)
            for place, rule in enumerate(RULES):
                about = None if rule.target not in (Target.OPPONENT, Target.TEAMMATE) else rule.target
                if other is None:
                    if about is not None:
                        continue
                elif about != (Target.TEAMMATE if other[0] == self.me[0] else Target.OPPONENT):
                    continue
                apply = self.stretches if rule.start == Start.WHILE else self.completions
                for k0, k1, degree in apply(rule, degrees):
                    code = self.code_of(rule, k0, other)
                    if code:
                        target = f"{other[0]}-{other[1]}" if other else str(rule.target)
                        found.append((
                            TABLE_1[code][1], k0, code, place, robots.index(other) if other else -1, k1, degree,
                            None if target == "nothing" else target,
                        ))
        return sorted(found, key=lambda row: row[:5])

    def fill(self, paint: list[Any], occurrence: Any, k0: int, k1: int, least_s: float) -> None:
        """Paint all free stretches of [k0, k1) that last so long, and all of it if it is free."""
        for free, run in itertools.groupby(range(k0, k1), key=lambda k: paint[k] is None):
            part = list(run)
            lasts = self.until[part[-1]] - self.t[part[0]]
            if free and (len(part) == k1 - k0 or lasts >= least_s * 1e9 - CLOCK):
                for k in part:
                    paint[k] = occurrence

    def situations(self) -> list[Found]:
        """The resolved sequence."""
        settings = self.settings
        paint: list[Any] = [None] * len(self.t)
        for occurrence in self.occurrences():
            _, k0, _, place, _, k1, _, _ = occurrence
            if RULES[place].start == Start.WHILE:
                self.fill(paint, occurrence, k0, k1, min(self.hold(RULES[place]), settings.random_least_s))
                continue
            free = k1
            while free > k0 and paint[free - 1] is None:
                free -= 1
            if k1 - free >= min(max(2, settings.least_share * (k1 - k0)), k1 - k0):
                paint[free:k1] = [occurrence] * (k1 - free)
        longest = defaultdict(lambda: settings.longest_s)
        for rule in RULES:
            if rule.start == Start.WHILE:
                longest[rule.code] = min(
                    settings.longest_s, max(r.limit_s for r in RULES if r.code == rule.code)
                )
        parts: list[list[Any]] = []
        k = 0
        while k < len(paint):
            end = k + 1
            while end < len(paint) and paint[end] is paint[k] and self.piece[end] == self.piece[k]:
                end += 1
            if paint[k] is None:
                if self.until[end - 1] - self.t[k] >= settings.random_least_s * 1e9 - CLOCK:
                    while k < end:
                        cut = self.chunk(k, end, settings.random_longest_s)
                        parts.append([194, None, k, cut, None])
                        k = cut
            else:
                _, _, code, _, _, _, degree, target = paint[k]
                last = parts[-1] if parts else None
                if (
                    last and last[:2] == [code, target] and last[3] == k and self.piece[k - 1] == self.piece[k]
                    and self.until[end - 1] - self.t[last[2]] <= longest[code] * 1e9 + CLOCK
                ):
                    last[3], last[4] = end, min(last[4], degree)
                else:
                    parts.append([code, target, k, end, degree])
            k = end
        return [
            Found(
                self.me[0], self.me[1], ROLES[self.match.role(self.me, self.frames[k0])], code, self.t[k0],
                self.until[k1 - 1], degree, target, self.match.segment[self.frames[k0]],
            )
            for code, target, k0, k1, degree in parts
        ]


def recognise_literally(table: pl.DataFrame, pitch: Pitch, settings: SituationSettings) -> list[Found]:
    """The situations of all robots, sorted by team, robot, start."""
    match = Match(table, pitch)
    robots = sorted((body for body in match.bodies if body != BALL), key=lambda body: (body[0] == "away", body[1]))
    return [found for body in robots for found in Robot(match, body, settings).situations()]
