// The page's words, keys and clicks, and how it moves through time.

const SPEEDS = [0.25, 0.5, 1, 2, 4, 8];
const WINDOW = 20000, BEFORE_GOAL = 3000;
const BEFORE_SITUATION = 1000, KICK = 21;
const LINGER = 1500; // so much of a stoppage is played before it is jumped over

function element(tag, className, text) {
  const node = document.createElement(tag);
  if (className) node.className = className;
  if (text !== undefined) node.textContent = text;
  return node;
}

function start(match) {
  const { time, end, robots, teams, goalTimes, family, dead, situations: table, samples: S } = match;
  const hash = new URLSearchParams(location.hash.slice(1));
  const state = {
    t: 0, playing: !hash.has("paused"), speed: 1, labels: hash.get("labels") !== "0",
    skip: hash.get("skip") !== "0", marked: -1, view: 0, span: Math.min(WINDOW, end || 1), dragging: false, dirty: true,
  };
  let chosen = null; // the robot that the address names
  const { paint, readColours, timeAt, robotAt, lineHeight } = painter(match, state);

  // -- words ----------------------------------------------------------------------------------

  const nowRows = robots.map((robot) => {
    const row = element("div", "now");
    const what = element("span", "what"), code = element("span", "code");
    row.append(element("span", `chip ${robot.team}`, robot.id), what, code);
    $("now").append(row);
    return { robot, row, what, code, index: null };
  });
  const goalRows = match.goals.map(([t, team, robot, kind]) => {
    const row = element("button", "goal");
    const maker = match.makers(team, kind);
    row.append(
      element("span", "time", clock(t)), element("span", `chip ${maker ?? "unknown"}`, robot ?? "?"),
      element("span", "what", kind === "error" ? `error of ${teams[maker]}` : kind ?? teams[team] ?? "scorer unknown"),
      element("span", "code", match.scoreAt(t).join(" : ")));
    row.style.borderLeftColor = `var(--${team ?? "muted"})`;
    row.addEventListener("click", () => seek(t - BEFORE_GOAL));
    $("goals").append(row);
    return row;
  });
  $("goals-title").hidden = !match.goals.length;
  if (match.crowded) $("now").parentElement.append($("now-title"), $("now")); // the goals first: they are fewer

  function writeWords() {
    $("score").textContent = match.scoreAt(state.t).join(" : ");
    $("clock").textContent = `${clock(state.t, 1)} / ${clock(end)}`;
    const now = match.moment(state.t);
    for (const entry of nowRows) {
      const index = match.situationAt(entry.robot, state.t), absent = !match.pose(entry.robot.body, now);
      entry.row.classList.toggle("absent", absent);
      if (index === entry.index) continue;
      entry.index = index;
      const code = index < 0 ? null : table.code[index];
      entry.what.textContent = code === null ? "–" : match.shortName(code);
      entry.code.textContent = code === null ? "" : three(code);
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
    remember.timer = setTimeout(() => history.replaceState(null, "", `#t=${(state.t / 1000).toFixed(2)}&paused`), 250);
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
    const between = state.t > time[i];
    seek(time[clamp(direction > 0 ? i + 1 : between ? i : i - 1, 0, S - 1)]);
  }

  function toGoal(direction) {
    const shown = state.t + BEFORE_GOAL; // the goal that a jump would have brought us to
    const t = direction > 0 ? goalTimes.find((g) => g > shown + 1) : goalTimes.findLast((g) => g < shown - 1500);
    if (t !== undefined) seek(t - BEFORE_GOAL);
  }

  /** To the next or previous situation of the chosen code, by the marked robot if there is one; it is marked. */
  function toSituation(direction) {
    const code = Number($("situation").value), shown = state.t + BEFORE_SITUATION;
    const [earliest, latest] = direction > 0 ? [shown + 1, Infinity] : [-Infinity, shown - 500];
    let found = -1;
    table.code.forEach((each, i) => {
      const t = table.start[i], better = found < 0 || (direction > 0 ? t < table.start[found] : t > table.start[found]);
      if (each === code && t >= earliest && t <= latest && better && (!chosen || table.body[i] === chosen.body)) found = i;
    });
    if (found < 0) return;
    if (!chosen) state.marked = table.body[found];
    seek(Math.max(0, table.start[found] - BEFORE_SITUATION));
  }

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
      state.view += (target - state.view) * (far ? 1 : Math.min(1, passed / 120));
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
    const drag = (event) => {
      seek(timeAt(canvas, event.clientX), canvas.id === "timeline");
      if (canvas.id === "overview") look(state.t - 0.35 * state.span);
    };
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId); state.dragging = true; $("tip").hidden = true; drag(event);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (state.dragging) drag(event); else if (canvas.id === "timeline") tell(event);
    });
    for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, () => { state.dragging = false; });
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
    n: () => toSituation(1), N: () => toSituation(-1), g: () => toGoal(1), G: () => toGoal(-1), Home: () => seek(0), End: () => seek(end),
    l: () => toggle("labels"), s: () => toggle("skip"), z: whole, "?": () => $("keys").showModal(),
  };
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || $("keys").open || !KEYS[event.key]) return;
    event.preventDefault();
    KEYS[event.key](event);
  });
  const clicks = {
    play: () => play(!state.playing), "goal-back": () => toGoal(-1), "goal-on": () => toGoal(1), "situation-back": () => toSituation(-1), "situation-on": () => toSituation(1), "frame-back": () => step(-1),
    "frame-on": () => step(1), labels: () => toggle("labels"), skip: () => toggle("skip"), whole, help: () => $("keys").showModal(),
  };
  for (const [id, act] of Object.entries(clicks)) $(id).addEventListener("click", act);
  $("keys").addEventListener("click", (event) => { if (event.target === $("keys")) $("keys").close(); });
  for (const speed of SPEEDS) $("speed").append(new Option(`${speed}×`, speed));
  $("speed").addEventListener("change", () => { setSpeed(Number($("speed").value)); $("speed").blur(); });

  for (const code of Object.keys(match.names).map(Number)) $("situation").append(new Option(`${three(code)} ${match.shortName(code)}`, code));
  if (KICK in match.names) $("situation").value = String(KICK);
  $("situation").addEventListener("change", () => $("situation").blur());

  // -- begin ----------------------------------------------------------------------------------

  function follow() {
    const wanted = new URLSearchParams(location.hash.slice(1));
    setSpeed(Number(wanted.get("speed") ?? state.speed));
    if (wanted.has("window")) look(state.view, 1000 * Number(wanted.get("window")) || WINDOW);
    const [team, id] = (wanted.get("robot") ?? "").split("-");
    chosen = robots.find((robot) => robot.team === team && robot.id === Number(id)) ?? null;
    state.marked = chosen ? chosen.body : -1;
    if (wanted.has("situation")) $("situation").value = wanted.get("situation");
    const t = 1000 * Number(wanted.get("t") ?? 0);
    seek(Number.isFinite(t) ? t : 0);
    look(state.t - 0.35 * state.span);
    play(!wanted.has("paused"));
  }

  $("home").querySelector("span").textContent = match.home;
  $("away").querySelector("span").textContent = match.away;
  $("skip").hidden = !dead.length;
  for (const name of ["labels", "skip"]) $(name).setAttribute("aria-pressed", state[name]);
  match.families.forEach(([name], i) => {
    const item = element("span", "", name), swatch = element("i");
    swatch.style.background = `var(--family-${i})`;
    item.prepend(swatch);
    $("legend").append(item);
  });
  if (!match.complete) $("legend").append(element("span", "", `not complete: ${match.incomplete_reason ?? "reason unknown"}`));
  if (match.note) $("legend").append(element("span", "", match.note));
  $("overview").style.height = "38px";
  $("timeline").style.height = `${lineHeight()}px`;
  readColours();
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
    start(understand(await decode($("payload").textContent)));
  } catch (error) {
    $("trouble").hidden = false;
    $("trouble").textContent = `The replay cannot be shown: ${error.message}.`;
    throw error;
  }
})();
