// What can be found in a match: goals, passes and shots (of its tables), situations, and runs of situations.

const LONGEST_RUN = 4; // situations in a behaviour, as in pipeline/stages/sequences/windows.py
const EVENTS = { kick: "passes and shots", shot: "shots", pass: "passes", goal: "goals" };

/** A behaviour's id, perhaps with a side before it: [side, role, codes]; null if it is none. */
function behaviourOf(id) {
  const parts = /^(?:(home|away):)?(?:([a-z]+)-)?(\d{1,3}(?:-\d{1,3})*)$/.exec(id.trim());
  if (!parts) return null;
  const codes = parts[3].split("-").map(Number);
  return codes.length <= LONGEST_RUN ? [parts[1] ?? null, parts[2] ?? null, codes] : null;
}

/** Finds in a match; each hit has t and end (ms), team, robot, body (-1: unknown) and what it is, by time. */
function finder(match) {
  const { situations: table, teams, robots } = match;
  const bodies = new Map(robots.map((robot) => [`${robot.team} ${robot.id}`, robot.body]));
  const owner = new Map(robots.map((robot) => [robot.body, robot]));
  const hit = (kind, t, end, team, robot, what) => (
    { kind, t, end, team, robot, body: bodies.get(`${team} ${robot}`) ?? -1, what });

  const events = [
    ...match.goals.map(([t, team, robot, kind]) => {
      const maker = match.makers(team, kind), by = maker === null || maker === team ? "" : ` off ${teams[maker]}`;
      return hit("goal", t, t, maker, robot, `${match.goalTitle(team)}${by}${kind === null || by ? "" : `, ${kind}`}`);
    }),
    ...match.passes.map(([t, end, team, robot, to, direction, through]) => (
      hit("pass", t, end, team, robot, `${through ? "through pass" : "pass"} to ${to}, ${direction}`))),
    ...match.shots.map(([t, team, robot, outcome, distance]) => (
      hit("shot", t, t, team, robot, `shot from ${distance.toFixed(2)} m, ${outcome}`))),
  ].sort((a, b) => a.t - b.t);

  /** Runs of consecutive situations with these codes; the first one's role counts, as in pipeline/stages/sequences/windows.py. */
  function runs(codes, role, side) {
    const hits = [], lit = new Uint8Array(table.code.length);
    const what = codes.map((code) => match.names[code] ? match.shortName(code) : three(code)).join(", then ");
    for (let i = 0; i + codes.length <= table.code.length; i++) {
      const { team, id } = owner.get(table.body[i]);
      if ((role && table.role[i] !== role) || (side && team !== side)) continue;
      if (!codes.every((code, k) => table.code[i + k] === code && (k === 0 || table.follows[i + k]))) continue;
      lit.fill(1, i, i + codes.length);
      hits.push(hit("run", table.start[i], table.end[i + codes.length - 1], team, id, what));
    }
    return { name: what, hits: hits.sort((a, b) => a.t - b.t), lit };
  }

  /** What a choice of the page means: a key of EVENTS, a code, or a behaviour's id; null for anything else. */
  function find(wanted) {
    if (Object.hasOwn(EVENTS, wanted)) {
      const hits = events.filter(({ kind }) => kind === wanted || (wanted === "kick" && kind !== "goal"));
      return { name: EVENTS[wanted], hits, lit: null };
    }
    const behaviour = behaviourOf(wanted);
    return behaviour && runs(behaviour[2], behaviour[1], behaviour[0]);
  }

  return { events, find };
}
