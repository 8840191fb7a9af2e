// What the scout's pages do: clips that play where they are seen, tables that sort, lists that filter.

const matches = new Map(); // id to a promise of the match, fetched when a clip of it is first seen
const REST_MS = 1000, MATCHES_AT_REST = 12;
const waiting = new Map(); // id to the function that its data file calls

/** Called by the data files in data/: pages that are opened from disk may load scripts, but fetch nothing. */
function scoutMatch(id, payload) {
  waiting.get(id)(payload);
  waiting.delete(id);
}

function matchOf(id) {
  if (!matches.has(id)) {
    matches.set(id, new Promise((resolve, reject) => {
      waiting.set(id, resolve);
      const script = document.createElement("script");
      script.src = `${document.body.dataset.up}data/${id}.js`;
      script.onerror = () => reject(new Error(`data/${id}.js is missing: write the pages again`));
      document.head.append(script);
    }).then(decode).then(understand));
  }
  return matches.get(id);
}

const OTHER = { home: "away", away: "home" };

/** A match as away sees it: turned by half, and away in the colour of home. */
function turned(match) {
  const swapped = (both) => both && { home: both.away, away: both.home }, of = (team) => OTHER[team] ?? null;
  const half = (at) => at && { ...at, x: -at.x, y: -at.y, heading: at.heading === null ? null : at.heading + Math.PI };
  return {
    ...match, worn: swapped(match.worn), teams: swapped(match.teams),
    robots: match.robots.map((robot) => ({ ...robot, team: of(robot.team) })),
    pose: (body, now) => half(match.pose(body, now)),
    goalTitle: (team) => match.goalTitle(of(team)), story: (team, robot, kind) => match.story(of(team), robot, kind),
    goalAt: (t, from) => {
      const found = match.goalAt(t, from);
      return found && { ...found, goal: [found.goal[0], of(found.goal[1]), ...found.goal.slice(2)] };
    },
  };
}

/** One clip: a stretch of a match that plays again and again while it is seen and not paused. Returns what loads it. */
function clip(figure) {
  const canvas = figure.querySelector("canvas");
  const { match: id = document.body.dataset.match, team, robot, start, end, at = start } = figure.dataset;
  const state = { t: 1000 * at, from: 1000 * start, labels: false, marked: -1 };
  const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
  let painting = null, loading = null, seen = false, paused = still, last = 0;
  canvas.tabIndex = 0;
  canvas.setAttribute("role", "button");
  canvas.setAttribute("aria-label", `stop the clip: ${canvas.getAttribute("aria-label")}`);
  canvas.title = "click or space stops the clip, and plays it again";

  const load = () => (loading ??= loaded());

  async function loaded() {
    try {
      const around = "turned" in figure.dataset, match = around ? turned(await matchOf(id)) : await matchOf(id);
      state.marked = match.robots.find((r) => r.team === (around ? OTHER[team] : team) && r.id === Number(robot))?.body ?? -1;
      painting = painter(match, state);
      painting.readColours();
      matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { painting.readColours(); paint(); });
      paint();
      figure.dataset.ready = "";
      requestAnimationFrame(tick);
    } catch (error) {
      figure.querySelector("figcaption").append(` (${error.message})`);
    }
  }

  const paint = () => painting.drawPitch(canvas);

  function tick(now) {
    if (!seen) return;
    if (!paused) {
      state.t += Math.min(100, now - (last || now));
      if (state.t > 1000 * end) state.t = 1000 * start;
      paint();
    }
    last = now;
    requestAnimationFrame(tick);
  }

  function toggle() {
    paused = !paused;
    mark();
  }

  function mark() {
    figure.classList.toggle("paused", paused);
    canvas.setAttribute("aria-pressed", String(paused));
  }
  mark();
  canvas.addEventListener("click", toggle);
  canvas.addEventListener("keydown", (event) => {
    if (event.key === " " || event.key === "Enter") { event.preventDefault(); toggle(); }
  });
  new IntersectionObserver(([entry]) => {
    const before = seen;
    seen = entry.isIntersecting;
    last = 0;
    if (seen && !loading) load(); else if (seen && !before) requestAnimationFrame(tick);
  }, { rootMargin: "80px" }).observe(canvas);
  const repaint = (t) => { if (painting) { state.t = t; painting.readColours(); paint(); } };
  addEventListener("beforeprint", () => repaint(Math.max(1000 * start, 1000 * at - 200))); // on paper: just before what it is of
  addEventListener("afterprint", () => repaint(1000 * start));
  return { id, load };
}

/** When a page has rested, clips that nobody has seen load too, so that it prints whole: those of the first matches. */
async function loadRest(all) {
  const few = new Set([...new Set(all.map(({ id }) => id))].slice(0, MATCHES_AT_REST));
  for (const { id, load } of all) if (few.has(id)) await load();
}

/** On a phone the rows of a table stand as blocks: each cell says its column's head. */
function stacks(table) {
  const heads = [...(table.tHead?.rows[table.tHead.rows.length - 1]?.cells ?? [])].map((head) => head.textContent.trim());
  [...table.tBodies[0].rows].forEach((row) => [...row.cells].forEach((cell, i) => { if (i) cell.dataset.head ??= heads[i]; }));
}

/** Sort a table by a column; again turns it round. Cells sort by data-by, or by what they say. */
function sortable(table) {
  const heads = [...table.tHead.rows[table.tHead.rows.length - 1].cells];
  heads.forEach((head, column) => {
    head.tabIndex = 0;
    const sort = () => {
      const up = head.getAttribute("aria-sort") !== "ascending";
      heads.forEach((other) => other.removeAttribute("aria-sort"));
      head.setAttribute("aria-sort", up ? "ascending" : "descending");
      const value = (row) => (row.cells[column].dataset.by ?? row.cells[column].textContent.trim()).replace("−", "-");
      const rows = [...table.tBodies[0].rows].sort((a, b) => {
        const [x, y] = [value(a), value(b)];
        const order = x !== "" && y !== "" && !Number.isNaN(Number(x)) && !Number.isNaN(Number(y)) ? x - y : x.localeCompare(y);
        return up ? order : -order;
      });
      table.tBodies[0].append(...rows);
    };
    head.addEventListener("click", sort);
    head.addEventListener("keydown", (event) => { if (event.key === "Enter") sort(); });
  });
}

/** Of many cards or rows the first few are shown, until a button is pressed, one is linked to, or a filter chooses. */
function fold(holder, changed) {
  let open = false;
  const button = document.createElement("button");
  button.type = "button";
  button.className = "more";
  button.textContent = holder.id ? `Show all ${holder.children.length} ${holder.id}` : `${holder.children.length - holder.dataset.few} more goals`;
  (holder.closest("table") ?? holder).after(button);
  const unfold = () => { open = true; changed(); };
  button.addEventListener("click", () => {
    const next = holder.children[holder.dataset.few];
    unfold();
    next.tabIndex = -1;
    next.focus();
  });
  const reveal = () => {
    const target = document.getElementById(decodeURIComponent(location.hash.slice(1)));
    if (!open && target && holder.contains(target)) { unfold(); target.scrollIntoView(); }
  };
  addEventListener("hashchange", reveal);
  addEventListener("load", reveal);
  return { cut(wanted) { holder.classList.toggle("cut", wanted && !open); button.hidden = !wanted || open; } };
}

/** Show only the rows or cards that have all the words, and at least the numbers asked for. */
function filters() {
  const words = document.querySelector("[data-filter]"), least = document.querySelector("[data-least]"), is = document.querySelector("[data-is]");
  if (!words) return;
  const holders = words.dataset.filter.split(" ").map((id) => document.getElementById(id)).filter(Boolean);
  const items = holders.flatMap((holder) => [...(holder.tBodies ? holder.tBodies[0].rows : holder.children)]);
  // of a card only what it is, not what is said of it
  const inFull = (item) => item.cells?.[0].title ?? "";
  const texts = items.map((item) => (item.dataset.words ?? `${item.textContent} ${inFull(item)}`).toLowerCase());
  const tell = counter(words.closest(".tools"));
  const phrases = document.querySelector(".phrases");
  phrases?.addEventListener("click", ({ target }) => {
    if (target.tagName !== "BUTTON") return;
    words.value = target.textContent;
    words.dispatchEvent(new Event("input"));
    words.focus();
  });
  const folds = holders.filter((holder) => holder.children.length > (holder.dataset.few ?? Infinity)).map((holder) => fold(holder, () => show()));
  const filtered = () => words.value.trim() !== "" || Boolean(is?.value) || Number(least?.value || 0) > Number(least?.defaultValue || 0);
  const show = () => {
    folds.forEach((each) => each.cut(!filtered()));
    const asked = words.value.toLowerCase().split(/\s+/).filter(Boolean);
    items.forEach((item, i) => {
      const enough = !least || Number(item.dataset[least.dataset.least]) >= Number(least.value || 0);
      const right = !is?.value || item.dataset[is.dataset.is] === is.value;
      item.hidden = !(enough && right && asked.every((word) => texts[i].includes(word)));
    });
    if (phrases) phrases.hidden = items.some((item) => !item.hidden);
    tell(holders.map((holder) => {
      const own = items.filter((item) => holder.contains(item));
      const fit = own.filter((item) => !item.hidden).length;
      return [holder.classList.contains("cut") ? Math.min(fit, holder.dataset.few) : fit, own.length, holder.id];
    }));
  };
  words.addEventListener("input", show);
  least?.addEventListener("input", show);
  is?.addEventListener("input", show);
  const linked = () => { // what a link leads to is shown, however seldom it was seen
    const target = document.getElementById(decodeURIComponent(location.hash.slice(1)));
    const item = target && items.find((each) => each.contains(target));
    if (!least || !item || Number(item.dataset[least.dataset.least]) >= Number(least.value)) return;
    least.value = item.dataset[least.dataset.least];
    show();
    target.scrollIntoView();
  };
  addEventListener("hashchange", linked);
  show();
  linked();
}

/**
 * Put cards into the order of one of their numbers, the greatest first; equal ones stay as they are.
 *
 * While words are typed, the behaviours of the fewest situations that have them come first.
 */
function orders() {
  const choice = document.querySelector("[data-order]");
  if (!choice) return;
  const words = document.querySelector("[data-filter]"), holder = document.getElementById(choice.dataset.order);
  const first = [...holder.children];
  const arrange = () => {
    const plain = words.value.trim() !== "", chosen = choice.selectedIndex > 0;
    holder.append(...[...first].sort((a, b) => (plain && a.dataset.length - b.dataset.length)
      || (chosen && b.dataset[choice.value] - a.dataset[choice.value])));
  };
  choice.addEventListener("change", arrange);
  words.addEventListener("input", arrange);
}

addEventListener("DOMContentLoaded", () => {
  addEventListener("beforeprint", () => document.documentElement.classList.add("on-paper"));
  addEventListener("afterprint", () => document.documentElement.classList.remove("on-paper"));
  const all = [...document.querySelectorAll(".clip")].map(clip);
  setTimeout(loadRest, REST_MS, all);
  document.querySelectorAll(".sortable").forEach(sortable);
  document.querySelectorAll(".stacks").forEach(stacks);
  document.querySelectorAll("ol[data-few]").forEach((goals) => {
    const few = fold(goals, () => few.cut(true));
    few.cut(true);
  });
  filters();
  orders();
});
