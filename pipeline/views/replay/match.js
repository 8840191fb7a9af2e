// A match in the page: the payload (its format is documented in pipeline/views/replay/packing.py) and questions to it.
// All times are milliseconds since the first sample.

const SEEN = 1, SUSPECT = 2, HEADED = 4, NO_STRENGTH = 255;
const STOPPAGE = 250; // a shorter stretch without play is not shown as one

const $ = (id) => document.getElementById(id);

/** Index of the last of the sorted `times` at or before t; -1 before the first. */
function before(times, t) {
  let low = 0, high = times.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] <= t) low = middle + 1; else high = middle;
  }
  return low - 1;
}

function clock(t, digits = 0) {
  const unit = 10 ** digits, ticks = Math.floor((Math.max(0, t) * unit) / 1000 + 1e-6);
  const minutes = Math.floor(ticks / unit / 60), seconds = ticks / unit - 60 * minutes;
  return `${String(minutes).padStart(2, "0")}:${seconds.toFixed(digits).padStart(digits ? 3 + digits : 2, "0")}`;
}

const clamp = (value, low, high) => Math.max(low, Math.min(high, value));
const three = (code) => String(code).padStart(3, "0");

/** Inflate and parse the payload: the facts (JSON), and the samples as typed arrays. */
async function decode(base64) {
  const packed = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  const length = new DataView(bytes.buffer).getUint32(0, true);
  const match = JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + length)));
  let at = 4 + length;
  const S = match.samples, B = match.bodies.length;
  const take = (n) => bytes.subarray(at, (at += n));
  const differences = (n, width) => {
    const planes = take(n * width), out = new Int32Array(n);
    for (let i = 0; i < n; i++) {
      let z = 0;
      for (let w = width - 1; w >= 0; w--) z = z * 256 + planes[w * n + i];
      out[i] = (z >>> 1) ^ -(z & 1);
    }
    return out;
  };
  const ticks = differences(S, 4);
  for (let i = 1; i < S; i++) ticks[i] += ticks[i - 1];
  match.time = ticks.map((each) => Math.round(each * match.tick));
  match.joined = take(S);
  match.mask = take(S * B);
  const { joined } = match;
  /** The step of sample i that is expected after the step before it. */
  const expected = (step, i) => {
    if (i < 2 || !joined[i] || !joined[i - 1]) return 0;
    const last = ticks[i - 1] - ticks[i - 2];
    return last > 0 ? Math.floor((2 * step * (ticks[i] - ticks[i - 1]) + last) / (2 * last)) : 0;
  };
  for (const channel of ["x", "y", "heading"]) {
    const off = differences(S * B, 2), into = match[channel] = new Int16Array(S * B);
    for (let b = 0; b < B; b++) {
      for (let i = 0, k = b * S, step = 0, sum = 0; i < S; i++, k++) {
        step = (off[k] + expected(step, i)) << 16 >> 16;
        into[k] = sum += step;
      }
    }
  }
  match.situations = situated(match, differences, take);
  return match;
}

/** The situations as columns of equal length. */
function situated({ tick, situations: { kinds, bodies } }, differences, take) {
  const body = bodies.flatMap(([each, n]) => Array(n).fill(each)), N = body.length;
  const kind = differences(N, 2), start = differences(N, 4), end = differences(N, 4), strength = take(N), follows = take(N);
  for (let i = 0; i < N; i++) {
    if (body[i - 1] === body[i]) start[i] += end[i - 1];
    end[i] += start[i];
  }
  const [code, target, role] = [0, 1, 2].map((part) => Array.from(kind, (index) => kinds[index][part]));
  const ms = (ticks) => Array.from(ticks, (each) => Math.round(each * tick));
  return { body, code, target, role, start: ms(start), end: ms(end), follows, strength: Array.from(strength, (percent) => (percent === NO_STRENGTH ? null : percent)) };
}

/** The decoded match with what the page asks of it. */
function understand(match) {
  const { time, mask, x, y, heading, joined, quantum, situations: table } = match;
  const S = match.samples, end = time[S - 1];
  const robots = match.bodies.map(([team, id], body) => ({ team, id, body })).filter((r) => r.team !== "ball");
  const ball = match.bodies.findIndex(([team]) => team === "ball");
  const teams = { home: match.home, away: match.away };
  const goalTimes = match.goals.map(([t]) => t), scoreTimes = match.scores.map(([t]) => t);
  const goalTitle = (team) => (team === null ? "goal, scorer unknown" : `goal for ${teams[team]}`);
  const restarts = match.events.filter(([, event]) => ["kick-off", "fault", "half", "end"].includes(event));

  const family = new Map();
  match.families.forEach(([, ranges], i) => {
    for (const code of Object.keys(match.names)) {
      if (ranges.some(([first, last]) => first <= code && code <= last)) family.set(Number(code), i);
    }
  });
  const shortName = (code) => match.names[code].replace(/^(the )?robot /i, "").replace(/^./, (letter) => letter.toLowerCase());

  // each robot's situations, as parallel slices in order of start
  for (const robot of robots) robot.situations = { start: [], end: [], index: [] };
  const byBody = new Map(robots.map((robot) => [robot.body, robot.situations]));
  table.body.forEach((body, index) => {
    const own = byBody.get(body);
    own.start.push(table.start[index]); own.end.push(table.end[index]); own.index.push(index);
  });
  const situationAt = (robot, t) => {
    const own = robot.situations, i = before(own.start, t);
    return i >= 0 && t < own.end[i] ? own.index[i] : -1;
  };

  /** The stretches between stretches of play that are long enough to see or to skip. */
  const dead = [];
  for (let i = 0, from = 0; i <= match.play.length; i++) {
    const [a, b] = match.play[i] ?? [end, end];
    if (a - from > STOPPAGE) dead.push([from, a]);
    from = b;
  }
  const stoppage = (t) => dead.find(([a, b]) => a < t && t < b);

  /** Sample at or before t, and how far t is towards the next one if play goes on to it. */
  function moment(t) {
    const i = Math.max(0, before(time, t));
    const on = i + 1 < S && joined[i + 1] === 1;
    if (!on && t - time[i] > match.gap) return { i: -1, part: 0 };
    return { i, part: on ? (t - time[i]) / (time[i + 1] - time[i]) : 0 };
  }

  function pose(body, { i, part }) {
    if (i < 0) return null;
    const k = body * S + i, m = mask[k];
    if (!(m & SEEN)) return null;
    const n = mask[k + 1] & SEEN && !((m | mask[k + 1]) & SUSPECT) && part > 0 ? k + 1 : k;
    const half = match.turn / 2;
    const turned = ((heading[n] - heading[k] + half) & (match.turn - 1)) - half;
    return {
      x: (x[k] + (x[n] - x[k]) * part) * quantum,
      y: (y[k] + (y[n] - y[k]) * part) * quantum,
      heading: m & HEADED ? ((heading[k] + turned * part) * 2 * Math.PI) / match.turn : null,
      suspect: Boolean(m & SUSPECT),
    };
  }

  const starts = match.play.map(([a]) => a);
  const resumed = goalTimes.map((t) => starts.find((a) => a >= t) ?? Infinity);
  /** The goal at or before t, and whether its own stoppage still lasts; null if there is none since `from`. */
  function goalAt(t, from = 0) {
    const g = before(goalTimes, t);
    return g < 0 || goalTimes[g] < from ? null : { goal: match.goals[g], stopped: t < resumed[g] };
  }

  /** The team whose robot made the goal: an error is the conceding team's; null where nobody knows. */
  const makers = (team, kind) => (kind === "error" ? { home: "away", away: "home" }[team] : team);

  function story(team, robot, kind) {
    const by = robot === null ? "" : ` · ${teams[makers(team, kind)]} ${robot}`;
    return kind === null ? by : `${by} · ${kind}`;
  }

  /** Goals of home and of away at t: as the referee gave them, or before that counted; "?" after a goal whose scorer is
   *  unknown, and where nobody told the score or a goal. */
  function scoreAt(t) {
    const score = match.scores[before(scoreTimes, t)];
    const unknown = match.goals.findLast(([at, team]) => at <= t && team === null);
    if (!(match.scores.length || match.goals.length) || (unknown && !(score && score[0] >= unknown[0]))) return ["?", "?"];
    const counted = (team) => match.goals.filter(([at, by]) => at <= t && by === team).length;
    return score ? [score[1], score[2]] : [counted("home"), counted("away")];
  }

  const counted = !match.scores.length && match.goals.length > 0; // nobody told the score
  const scoreWords = (t) => scoreAt(t).join(" : ");

  return {
    ...match, end, robots, ball, teams, goalTimes, restarts, dead, crowded: robots.length > 8,
    family, shortName, situationAt, stoppage, moment, pose, makers, story, counted, scoreWords, goalTitle, goalAt,
  };
}
