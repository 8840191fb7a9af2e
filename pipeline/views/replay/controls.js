// The page's words, keys and clicks, and how it moves through time.

const SPEEDS = [0.25, 0.5, 1, 2, 4, 8];
const WINDOW = 20000, BEFORE_GOAL = 3000, STEP = 50;
const BEFORE_SITUATION = 1000, KICK = 21;
const READING = 6000; // so long a sentence of the commentary stands
const LINGER = 1500; // so much of a stoppage is played before it is jumped over

function element(tag, className, text) {
  const node = document.createElement(tag);
  if (className) node.className = className;
  if (text !== undefined) node.textContent = text;
  return node;
}

/** @param known lists of league, team and ids of its behaviours */
function start(match, known) {
  const { time, end, robots, teams, goalTimes, family, dead, situations: table, samples: S } = match;
  const hash = new URLSearchParams(location.hash.slice(1));
  const still = matchMedia("(prefers-reduced-motion: reduce)");
  const state = {
    t: 0, playing: false, filter: false, found: null, speed: 1, labels: hash.get("labels") !== "0",
    skip: hash.get("skip") !== "0", marked: -1, view: 0, span: Math.min(WINDOW, end || 1), dragging: false, dirty: true,
  };
  let chosen = null; // the robot that the address names
  let ours = "home"; // the side of the team that the page before was of: it is blue, and plays to the right
  const { events, find } = finder(match);
  const { paint, readColours, timeAt, robotAt, lineHeight } = painter(match, state);

  // -- words ----------------------------------------------------------------------------------

  const nowRows = robots.map((robot) => {
    const row = element("div", "now");
    const what = element("span", "what"), code = element("span", "code"), place = element("span", "unseen");
    row.setAttribute("role", "listitem");
    row.append(element("span", `chip ${robot.team}`, robot.id), what, code, place);
    $("now").append(row);
    return { robot, row, what, code, place, index: null };
  });
  const ballRow = element("span", "unseen");
  ballRow.setAttribute("role", "listitem");
  $("now").append(ballRow);
  const goalRows = match.goals.map(([t, team, robot, kind]) => {
    const row = element("button", "goal");
    const maker = match.makers(team, kind);
    row.append(
      element("span", "time", clock(t)), element("span", `chip ${maker ?? "unknown"}`, robot ?? "?"),
      element("span", "what", kind === "error" ? `off ${teams[maker]}` : kind ?? teams[team] ?? "scorer unknown"),
      element("span", "code", match.scoreWords(t)));
    if (kind !== null) row.dataset.term = "goals";
    row.style.borderLeftColor = `var(--${team ?? "muted"})`;
    row.addEventListener("click", () => { seek(t - BEFORE_GOAL); say(row.querySelector(".what").textContent); });
    $("goals").append(row);
    return row;
  });
  $("goals-title").hidden = !match.goals.length;
  if (match.counted) $("score").append(element("small", "", " counted"));
  if (match.crowded) $("now").parentElement.prepend($("goals-title"), $("goals"), $("panel")); // they are fewer
  const fill = panel(match, events, jump);

  const toldTimes = match.told.map(([t]) => t);
  $("told").hidden = !toldTimes.length;
  $("stage").classList.toggle("telling", toldTimes.length > 0);
  const where = (at) => (at ? `at x ${at.x.toFixed(2)} m, y ${at.y.toFixed(2)} m` : "not seen");

  /** Tells screen readers what a jump led to; the clock itself says nothing while it runs. */
  function say(what) {
    $("said").textContent = `${clock(state.t, 1)}: ${what}`;
  }

  function writeWords() {
    $("score").firstChild.textContent = match.scoreWords(state.t);
    $("clock").textContent = `${clock(state.t, 1)} / ${clock(end)}`;
    const now = match.moment(state.t), placed = !state.playing || Math.abs(state.t - writeWords.last) > 1000;
    if (placed) { // for screen readers, who cannot see the pitch
      writeWords.last = state.t;
      ballRow.textContent = `ball, ${where(match.ball < 0 ? null : match.pose(match.ball, now))}`;
    }
    const line = match.told[before(toldTimes, state.t)];
    $("told").firstChild.textContent = line && state.t - line[0] < READING ? line[1] : "";
    for (const entry of nowRows) {
      const index = match.situationAt(entry.robot, state.t), absent = !match.pose(entry.robot.body, now);
      entry.row.classList.toggle("absent", absent);
      if (placed) entry.place.textContent = `${teams[entry.robot.team]}, ${where(match.pose(entry.robot.body, now))}`;
      if (index === entry.index) continue;
      entry.index = index;
      const code = index < 0 ? null : table.code[index];
      entry.what.textContent = code === null ? "–" : match.shortName(code);
      entry.code.textContent = code === null ? "" : three(code);
      entry.row.classList.toggle("quiet", code === RANDOM);
      entry.what.style.setProperty("--family", code === null ? "transparent" : `var(--family-${family.get(code)})`);
    }
    goalRows.forEach((row, i) => row.classList.toggle("past", goalTimes[i] <= state.t));
  }

  /** Says in the tip which situation is under the pointer. */
  function tell(event) {
    const robot = robotAt(event.clientX, event.clientY);
    const index = robot ? match.situationAt(robot, timeAt($("timeline"), event.clientX)) : -1;
    $("tip").hidden = index < 0;
    if (index < 0) return;
    const a = table.start[index], b = table.end[index], target = table.target[index], strength = table.strength[index];
    const facts = [`${clock(a, 1)} – ${clock(b, 1)} · ${((b - a) / 1000).toFixed(2)} s · ${table.role[index]}`];
    if (target !== null) facts.push(`target: ${target}`);
    if (strength !== null) facts.push(`strength: ${strength} %`);
    $("tip").replaceChildren(
      element("b", "", `${three(table.code[index])} ${match.names[table.code[index]]}`),
      element("small", "", `${teams[robot.team]}, robot ${robot.id}`),
      ...facts.map((fact) => element("small", "", fact)));
    const { offsetWidth: w, offsetHeight: h } = $("tip");
    $("tip").style.left = `${Math.max(4, Math.min(event.clientX + 12, innerWidth - w - 8))}px`;
    $("tip").style.top = `${Math.max(4, event.clientY - h - 12)}px`;
  }

  // -- moving through time --------------------------------------------------------------------

  function seek(t, keepView = false) {
    state.t = clamp(t, 0, end);
    if (!keepView && (state.t < state.view || state.t > state.view + state.span)) look(state.t - 0.35 * state.span);
    if (!state.playing) remember();
    state.dirty = true;
  }

  function look(from, span = state.span) {
    state.span = clamp(span, 1000, Math.max(end, 1000));
    state.view = clamp(from, 0, Math.max(0, end - state.span));
    state.dirty = true;
  }

  function remember() {
    clearTimeout(remember.timer);
    remember.timer = setTimeout(() => history.replaceState(null, "", `#${address()}`), 250);
  }

  function play(on) {
    if (on && state.t >= end) seek(0);
    state.playing = on;
    $("play").querySelector("path").setAttribute("d", on ? "M4 3h4v14H4zM12 3h4v14h-4z" : "M4 2l14 8-14 8z");
    if (!on) remember();
    state.dirty = true;
  }

  function step(direction) {
    play(false);
    const i = before(time, state.t);
    const next = time[clamp(direction > 0 ? i + 1 : state.t > time[i] ? i : i - 1, 0, S - 1)];
    seek(clamp(next, state.t - STEP, state.t + STEP)); // samples are far apart where bodies keep their course
  }

  function toGoal(direction) {
    const shown = state.t + BEFORE_GOAL; // the goal that a jump would have brought us to
    const t = direction > 0 ? goalTimes.find((g) => g > shown + 1) : goalTimes.findLast((g) => g < shown - 1500);
    if (t === undefined) return;
    seek(t - BEFORE_GOAL);
    say(`3 s before a ${match.goalTitle(match.goals[goalTimes.indexOf(t)][1])}`);
  }

  /** What the address of this moment says. */
  function address() {
    const parts = [`t=${(state.t / 1000).toFixed(2)}`], wanted = $("situation").value;
    if (chosen) parts.push(`robot=${chosen.team}-${chosen.id}`);
    if (ours === "away") parts.push("ours=away");
    if (wanted && wanted !== first) parts.push(`${Object.hasOwn(EVENTS, wanted) ? "find" : /^\d+$/.test(wanted) ? "situation" : "behaviour"}=${wanted}`);
    return [...parts, ...(state.filter ? ["filter"] : []), "paused"].join("&");
  }

  /** Takes what the list of choices says; false if it is nothing that can be found. */
  function choose(asked) {
    const wanted = /^\d+$/.test(asked) ? String(Number(asked)) : asked, found = find(wanted);
    if (!found) return false;
    if (![...$("situation").options].some((option) => option.value === wanted)) {
      let own = document.getElementById("asked");
      if (!own) { own = element("optgroup"); own.id = "asked"; own.label = "asked for"; $("situation").append(own); }
      own.append(new Option(`${wanted}: ${found.name}`, wanted));
    }
    $("situation").value = wanted;
    state.found = found;
    fill(found);
    state.dirty = true;
    return true;
  }

  /** To a moment shortly before a hit; its robot is marked unless the address names one. */
  function jump(hit) {
    if (!chosen) state.marked = hit.body;
    seek(Math.max(0, hit.t - (hit.kind === "goal" ? BEFORE_GOAL : BEFORE_SITUATION)));
    say(`${hit.team ?? "unknown team"} ${hit.robot ?? ""}: ${hit.what}`);
  }

  /** To the next or previous one of some hits, by the robot that the address names if it names one. */
  function toNext(hits, direction, shown = state.t + BEFORE_SITUATION) {
    const own = chosen ? hits.filter(({ body }) => body === chosen.body) : hits;
    const lead = ({ kind }) => (kind === "goal" ? BEFORE_GOAL - BEFORE_SITUATION : 0);
    const hit = direction > 0 ? own.find((h) => h.t - lead(h) > shown + 1) : own.findLast((h) => h.t - lead(h) < shown - 500);
    if (hit) jump(hit);
    else say(`no ${direction > 0 ? "later" : "earlier"} one`);
  }

  const toFound = (direction) => toNext(state.found?.hits ?? [], direction);
  const toKick = (direction) => toNext(find("kick").hits, direction);

  function faster(direction) {
    setSpeed(SPEEDS[clamp(SPEEDS.indexOf(state.speed) + direction, 0, SPEEDS.length - 1)]);
  }

  function setSpeed(speed) {
    state.speed = SPEEDS.includes(speed) ? speed : 1;
    $("speed").value = String(state.speed);
  }

  function toggle(name) {
    state[name] = !state[name];
    $(name).setAttribute("aria-pressed", state[name]);
    state.dirty = true;
  }

  function whole() {
    const all = state.span < end;
    look(all ? 0 : state.t - 0.35 * WINDOW, all ? end : WINDOW);
  }

  function tick(wall) {
    const passed = Math.min(250, wall - (tick.last ?? wall));
    tick.last = wall;
    if (state.playing && !state.dragging) {
      let t = state.t + passed * state.speed;
      const stopped = state.skip && match.stoppage(t);
      if (stopped && t > stopped[0] + LINGER) t = stopped[1];
      state.t = Math.min(t, end);
      if (state.t >= end) play(false);
      const target = clamp(state.t - 0.35 * state.span, 0, Math.max(0, end - state.span));
      const far = Math.abs(target - state.view) > state.span;
      state.view += (target - state.view) * (far || still.matches ? 1 : Math.min(1, passed / 120));
      state.dirty = true;
    }
    if (state.dirty) draw();
    requestAnimationFrame(tick);
  }

  function draw() {
    state.dirty = false;
    paint(); writeWords();
  }

  for (const canvas of [$("overview"), $("timeline")]) {
    const onTimeline = canvas.id === "timeline";
    pointers(canvas, {
      seek: (x) => {
        seek(timeAt(canvas, x), onTimeline);
        if (!onTimeline) look(state.t - 0.35 * state.span);
      },
      zoom: (x, before, factor) => {
        const t = timeAt($("timeline"), before), span = clamp(state.span * factor, 1000, Math.max(end, 1000));
        look(t - (timeAt($("timeline"), x) - state.view) * (span / state.span), span);
      },
      dragging: (on) => { state.dragging = on; if (on) $("tip").hidden = true; },
      hover: (event) => { if (onTimeline) tell(event); },
    });
    canvas.addEventListener("pointerleave", () => { $("tip").hidden = true; });
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      if (event.shiftKey || Math.abs(event.deltaX) > Math.abs(event.deltaY)) {
        look(state.view + ((event.deltaX || event.deltaY) / 800) * state.span);
        return;
      }
      const t = canvas.id === "timeline" ? timeAt(canvas, event.clientX) : state.t;
      const span = clamp(state.span * Math.exp(event.deltaY / 400), 1000, Math.max(end, 1000));
      look(t - ((t - state.view) / state.span) * span, span);
    }, { passive: false });
  }

  const KEYS = {
    " ": () => play(!state.playing), k: () => play(!state.playing),
    ArrowLeft: (e) => seek(state.t - (e.shiftKey ? 5000 : 1000)), ArrowRight: (e) => seek(state.t + (e.shiftKey ? 5000 : 1000)),
    ",": () => step(-1), ".": () => step(1), ArrowUp: () => faster(1), ArrowDown: () => faster(-1),
    n: () => toFound(1), N: () => toFound(-1), p: () => toKick(1), P: () => toKick(-1), g: () => toGoal(1), G: () => toGoal(-1), Home: () => seek(0), End: () => seek(end),
    l: () => toggle("labels"), f: () => toggle("filter"), s: () => toggle("skip"), z: whole, "?": () => $("keys").showModal(),
  };
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || $("keys").open || !Object.hasOwn(KEYS, event.key)) return;
    if (event.target.matches("input, select")) return; // they have these keys themselves
    if (event.key === " " && event.target.matches("button, summary")) return;
    event.preventDefault();
    KEYS[event.key](event);
  });
  const clicks = {
    play: () => play(!state.playing), "goal-back": () => toGoal(-1), "goal-on": () => toGoal(1), "situation-back": () => toFound(-1), "situation-on": () => toFound(1), "frame-back": () => step(-1),
    "frame-on": () => step(1), labels: () => toggle("labels"), filter: () => toggle("filter"), skip: () => toggle("skip"), whole, help: () => $("keys").showModal(),
  };
  for (const [id, act] of Object.entries(clicks)) {
    $(id).addEventListener("click", (event) => {
      act();
      if (event.detail) $(id).blur(); // after a click with the mouse the keys are the page's again
    });
  }
  $("keys").addEventListener("click", (event) => { if (event.target === $("keys")) $("keys").close(); });
  for (const speed of SPEEDS) $("speed").append(new Option(`${speed}×`, speed));
  $("speed").addEventListener("change", () => { setSpeed(Number($("speed").value)); $("speed").blur(); });

  function group(label, options) {
    const own = element("optgroup");
    own.label = label;
    own.append(...options.map(([value, text]) => new Option(text, value)));
    if (options.length) $("situation").append(own);
  }
  const codes = Object.keys(match.names).map(Number);
  group("events", Object.entries(EVENTS).filter(([key]) => find(key).hits.length));
  group("situations", codes.map((code) => [String(code), `${three(code)} ${match.shortName(code)}`]));
  for (const [kind, team, ids] of known) {
    for (const side of ["home", "away"]) {
      if (kind !== match.pitch.kind || team !== teams[side]) continue;
      const told = ids.map((id) => [`${side}:${id}`, find(`${side}:${id}`)]).filter(([, found]) => found?.hits.length);
      group(`behaviours of ${team} (${side})`, told.map(([id, { name }]) => [id, `${id.slice(5)}: ${name}`]));
    }
  }
  const first = KICK in match.names ? String(KICK) : $("situation").options[0]?.value;
  $("situation").addEventListener("change", () => { choose($("situation").value); $("situation").blur(); });
  $("panel").addEventListener("toggle", () => { // where the column scrolls, the list comes to its top
    if ($("panel").open) $("panel").parentElement.scrollTop = $("panel").offsetTop;
  });
  $("narrow").addEventListener("input", () => fill(state.found));
  $("codes").addEventListener("change", () => {
    const wanted = $("codes").value.trim().toLowerCase();
    const good = !wanted || choose(wanted);
    $("codes").setCustomValidity(good ? "" : "a role and up to four codes, as striker-044-021");
    $("codes").reportValidity();
    if (wanted && good) toFound(1);
  });

  // -- begin ----------------------------------------------------------------------------------

  function colour(side) {
    ours = side;
    state.turned = ours === "away";
    document.documentElement.classList.toggle("turned", state.turned);
    for (const team of ["home", "away"]) $(team).querySelector("small").textContent = team === ours ? "attacks right →" : "← attacks left";
    readColours();
    const other = { home: "away", away: "home" }[ours];
    $("colours").textContent = `Blue is ${teams[ours]} (${ours} in tables and addresses), orange is ${teams[other]} (${other}). ` + (match.worn
      ? `The edge of a robot is its team's own colour: ${match.worn.home} or ${match.worn.away}.`
      : "The recording does not say which colours the teams wear.");
  }

  function follow() {
    const wanted = new URLSearchParams(location.hash.slice(1));
    colour(wanted.get("ours") === "away" ? "away" : "home");
    setSpeed(Number(wanted.get("speed") ?? state.speed));
    if (wanted.has("window")) look(state.view, 1000 * Number(wanted.get("window")) || WINDOW);
    const [team, id] = (wanted.get("robot") ?? "").split("-");
    chosen = robots.find((robot) => robot.team === team && robot.id === Number(id)) ?? null;
    state.marked = chosen ? chosen.body : -1;
    const what = wanted.get("behaviour") ?? wanted.get("situation") ?? wanted.get("find");
    const named = what !== null && choose(what);
    if (!named && !state.found && first) choose(first);
    if (wanted.has("filter") !== state.filter) toggle("filter");
    const t = 1000 * Number(wanted.get("t") ?? 0);
    seek(Number.isFinite(t) ? t : 0);
    if (named && !wanted.has("t")) toNext(state.found.hits, 1, -Infinity);
    look(state.t - 0.35 * state.span);
    play(!wanted.has("paused") && !still.matches);
  }

  $("home").querySelector("span").textContent = match.home;
  $("away").querySelector("span").textContent = match.away;
  $("skip").hidden = !dead.length;
  for (const name of ["labels", "skip", "filter"]) $(name).setAttribute("aria-pressed", state[name]);
  match.families.forEach(([name], i) => {
    const item = element("span", "", name), swatch = element("i");
    swatch.style.background = `var(--family-${i})`;
    item.prepend(swatch);
    $("legend").append(item);
  });
  if (!match.complete) $("legend").append(element("span", "", `not complete: ${match.incomplete_reason ?? "reason unknown"}`));
  if (match.note) $("legend").append(element("span", "", match.note));
  if (match.worn) $("legend").append(element("span", "", "edge: the team's own colour"));
  $("overview").style.height = "38px";
  $("timeline").style.height = `${lineHeight()}px`;
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { readColours(); draw(); });
  addEventListener("hashchange", follow);
  follow();
  const resized = new ResizeObserver(draw);
  for (const id of ["stage", "overview", "timeline"]) resized.observe($(id));
  requestAnimationFrame(tick);
}

(async () => {
  try {
    if (typeof DecompressionStream === "undefined") {
      throw new Error("this browser cannot inflate data (DecompressionStream is missing); open the page in a current one");
    }
    const [packed, known] = await data($("payload"));
    start(understand(await decode(packed)), known);
  } catch (error) {
    $("trouble").hidden = false;
    $("trouble").textContent = `The replay cannot be shown: ${error.message}.`;
    throw error;
  }
})();
