"use strict";
// The page that compares: two matches, two teams, or the behaviours of two teams or versions of the knowledge.

const known = new Map(); // version to its teams, as its script gave them
const asking = new Map(); // version to a promise of its teams: each script is loaded once
let league = null;
/** Rows of a table at most; the rest is counted. Of these so many are shown at first. */
const ROWS = 2000, FIRST = 20;
/** The normal distribution's 97.5 % point. */
const Z = 1.959964;
/** Of what the numbers of a table are, its counts and its other numbers. */
const TEN = "share, or each 10 minutes";

/** Called by compare/numbers.js. */
function scoutNumbers(facts) {
  league = facts;
}

/** Called by compare/vN.js. */
function scoutKnowledge(facts) {
  known.set(facts.version, facts.teams);
}

/** The teams of a version; its script is loaded when it is first asked for. */
function versionOf(version) {
  if (!asking.has(version)) asking.set(version, loaded(version));
  return asking.get(version);
}

function loaded(version) {
  return new Promise((resolve, reject) => {
    const script = document.createElement("script");
    script.src = `compare/v${version}.js`;
    script.onload = () => resolve(known.get(version));
    script.onerror = () => reject(new Error(`compare/v${version}.js is missing: write the pages again`));
    document.head.append(script);
  });
}

const minus = (text) => text.replaceAll("-", "−"), percent = (share) => `${Math.round(100 * share)}\u00a0%`;
const plain = (value, share, digits = Number.isInteger(value) ? 0 : 2) => (value === null ? "–" : share ? percent(value) : minus(value.toFixed(digits)));
const named = ({ id, names, score }) => `${id.replace(/(.)-[0-9a-f]{12}$/, "$1")}: ${names[0]} ${score} ${names[1]}`;

/** A mean over matches with its interval; Mean is a list: mean, low, high, n, varies, standard error. */
function interval(mean, share) {
  if (mean === null) return "–";
  const [middle, low, high, n, varies] = mean;
  const ends = varies ? " varies too much" : low === null ? (n > 1 ? " too few matches" : "") : ` [${[low, high].map((end) => (share ? Math.round(100 * end) : plain(end, false, 1))).join(", ")}]`;
  return plain(middle, share, 1) + ends;
}

/** A table: text only, whatever the data hold. The first cell of each row is its head; `over` are [head, columns, its short form]. */
function table(heads, rows, over = []) {
  const made = document.createElement("table");
  made.className = "stacks";
  const above = over.flatMap(([content, columns, short]) => Array(columns).fill(short ?? content.textContent ?? content));
  if (over.length) {
    const row = made.createTHead().insertRow();
    for (const [content, columns] of [["", 1], ...over]) {
      const cell = row.appendChild(document.createElement(content ? "th" : "td"));
      cell.colSpan = columns;
      cell.style.whiteSpace = "normal";
      cell.append(content);
    }
  }
  const head = made.createTHead().insertRow();
  heads.forEach((text, i) => {
    const cell = head.appendChild(document.createElement("th"));
    cell.append(text);
    if (i) cell.className = "n";
  });
  const body = made.createTBody();
  for (const cells of rows) {
    const row = body.insertRow();
    cells.forEach((text, i) => {
      const cell = row.appendChild(document.createElement(i ? "td" : "th"));
      if (i) cell.className = "n"; else cell.scope = "row";
      if (i) cell.dataset.head = [above[i - 1], heads[i]].filter(Boolean).join(": "); // said above it on a phone
      if (text instanceof Node) cell.append(text);
      else if (typeof text === "object") [cell.textContent, cell.dataset.by] = text; // as it is shown, and as it sorts
      else cell.textContent = text;
    });
  }
  return made;
}

function paragraph(text) {
  const made = document.createElement("p");
  made.textContent = text;
  return made;
}

/** Show what is found: sentences, and from the first table on what a phone folds. */
function put(section, nodes) {
  const [said, folded] = section.querySelectorAll(".found"), at = nodes.findIndex((each) => each.tagName === "TABLE");
  said.replaceChildren(...(at < 0 ? nodes : nodes.slice(0, at)));
  folded.replaceChildren(...(at < 0 ? [] : nodes.slice(at)));
  folded.closest(".folds").hidden = at < 0;
}

/** Fill a select with choices [value, text], and choose one if it is there. */
function fill(select, choices, chosen) {
  select.replaceChildren(...choices.map(([value, text]) => new Option(text, value)));
  if (choices.some(([value]) => value === chosen)) select.value = chosen;
}

/** A section with two selects; `show` gives what is found for the two choices, `partner` the second for a first. */
function pair(id, choices, asked, show, preset, partner, chosen = () => {}) {
  const section = document.getElementById(id);
  if (choices.length < 2) {
    section.hidden = true;
    return;
  }
  const sides = [0, 1].map((side) => section.querySelector(`[data-side="${side}"]`));
  const first = asked?.[0] ?? preset ?? choices[0][0];
  const second = asked?.[1] ?? partner(first) ?? choices.find(([value]) => value !== first)[0];
  fill(sides[0], choices, first);
  fill(sides[1], choices, second);
  const update = () => {
    put(section, show(sides[0].value, sides[1].value));
    chosen(sides.map((each) => each.value));
  };
  section.querySelector("[data-under]")?.addEventListener("change", update);
  sides.forEach((select) => select.addEventListener("change", () => {
    history.replaceState(null, "", `#${id}=${sides.map((each) => encodeURIComponent(each.value)).join(",")}`);
    update();
  }));
  update();
  if (asked) section.scrollIntoView();
}

/** The first two of some that `fit` each other, or none. */
function firstPair(list, fit) {
  for (const [i, one] of list.entries()) {
    const other = list.slice(i + 1).find((it) => fit(one, it));
    if (other) return [one, other];
  }
  return undefined;
}

/** Another than the chosen one, of its league if there is one: such as `fits` it, else any of the league. */
function partner(list, chosen, fits) {
  const one = list.find(chosen);
  const others = list.filter((other) => one && other !== one && other.kind === one.kind);
  return others.find((other) => fits(one, other)) ?? others[0];
}

const teamsOf = (match) => JSON.stringify([match.kind, ...[...match.names].sort()]);

/** Which column of the second match is that of each column of the first: of its team, else of its side. */
function aligned(both) {
  const swapped = both[0].names[0] !== both[1].names[0] && (both[0].names[0] === both[1].names[1] || both[0].names[1] === both[1].names[0]);
  return swapped ? [1, 0] : [0, 1];
}

/** The difference of two numbers as they are shown, with its sign; of shares in percentage points. */
function less(one, other, share, digits) {
  if (one === null || other === null) return "–";
  const shown = (value) => Number((share ? 100 * value : value).toFixed(share ? 0 : digits));
  const value = shown(other) - shown(one);
  return `${value > 0 ? "+" : ""}${minus(value.toFixed(share ? 0 : digits))}`;
}

function twoMatches(...ids) {
  const both = ids.map((id) => league.matches.find((match) => match.id === id));
  const to = aligned(both);
  const order = [[0, 1], to]; // a team has the same place in both
  const names = both.map((match, at) => order[at].map((side) => match.names[side]));
  const heads = ["", ...names.flat(), ...names[0].map((name, side) => (name === names[1][side] ? name : `${names[1][side]} less ${name}`))];
  const link = (match) => {
    const made = document.createElement("a");
    made.href = `matches/${match.id}.html`;
    made.textContent = named(match);
    return made;
  };
  const rows = league.measures.map(([label, key, share]) => {
    const [one, other] = both.map((match, at) => order[at].map((side) => match.numbers[side][key]));
    return [label, ...[...one, ...other].map((value) => plain(value, share)), ...one.map((value, side) => less(value, other[side], share, key === "xg" ? 2 : 0))];
  });
  const found = [table(heads, rows, [[link(both[0]), 2, "first"], [link(both[1]), 2, "second"], ["second match less first", 2, "second less first"]])];
  found.push(paragraph("Differences are of whole matches, of shares in percentage points; matches of other lengths are not made equal."));
  if (both[0].kind !== both[1].kind) found.unshift(paragraph("They are of two leagues: their counts are of other games."));
  return found;
}

/** Whether two teams have played each other, or are one. */
function met(both) {
  const [one, other] = both;
  return one.slug === other.slug || league.matches.some(({ kind, names }) => one.kind === kind && other.kind === kind
    && names.includes(one.name) && names.includes(other.name));
}

/** The 97.5 % point of Student's t: of the angle whose tangent is t / sqrt(v), whose density is cos^(v - 1). */
function student(v) {
  const steps = 2000, high = Array.from({ length: 2 * steps + 1 }, (_, i) => Math.cos((i * Math.PI) / 4 / steps) ** (v - 1)), areas = [0];
  for (let i = 0; i < steps; i++) areas.push(areas[i] + high[2 * i] + 4 * high[2 * i + 1] + high[2 * i + 2]); // Simpson
  const wanted = 0.95 * areas[steps], i = areas.findIndex((area) => area >= wanted);
  const angle = (i - 1 + (wanted - areas[i - 1]) / (areas[i] - areas[i - 1])) * (Math.PI / 2 / steps);
  return Math.sqrt(v) * Math.tan(angle);
}

/** Half of Welch's 95 % interval of the difference of two means, by their numbers and standard errors, as on the page of a team. */
function welch([, , , n, , error], [, , , m, , other]) {
  const sum = error ** 2 + other ** 2;
  return sum && student(sum ** 2 / (error ** 4 / (n - 1) + other ** 4 / (m - 1))) * Math.sqrt(sum);
}

/** A team's mean less another's; with its 95 % interval where both have one and the teams share no match. */
function apart(one, other, share, independent) {
  if (one === null || other === null) return "–";
  const value = other[0] - one[0], shown = less(one[0], other[0], share, 1);
  if (!independent || one[1] === null || other[1] === null) return shown;
  const half = welch(one, other);
  return `${Math.abs(value) > half ? "★ " : ""}${shown} ± ${share ? Math.round(100 * half) : half.toFixed(1)}`;
}

/** What tells chance from a difference, in a paragraph; without a test where matches are in common. */
function tested(independent) {
  return paragraph(independent
    ? "★ the 95 % interval of the difference (Welch's) leaves out 0. It is given from four matches on each side: fewer cannot tell. A difference with ± and without ★ is not larger than chance gives. Differences of shares are in percentage points."
    : "The two have matches in common, so no interval of the difference is given. Differences of shares are in percentage points.");
}

/** Two sides, each a team in some matches: what it won, its numbers and those of its adversaries, and the differences. */
function twoSides(both, heads, matches, independent) {
  const won = ({ standing: it }) => (it ? [`${it.won} – ${it.drawn} – ${it.lost}`, `${it.goals} : ${it.against}`] : ["–", "–"]);
  const top = [["matches", ...matches.flatMap((count) => [count, ""]), "", ""],
    ...["won – drawn – lost", "goals for : against"].map((label, at) => [label, ...both.flatMap((it) => [won(it)[at], ""]), "", ""])];
  const rows = league.measures.map(([label, key, share]) => [
    label, ...both.flatMap(({ numbers, against }) => [interval(numbers[key], share), interval(against[key], share)]),
    ...["numbers", "against"].map((of) => apart(...both.map((it) => it[of][key]), share, independent))]);
  const columns = ["it", "its adversaries"];
  return [table([TEN, ...columns, ...columns, ...columns], [...top, ...rows],
    [...heads.map((head, side) => [head, 2, typeof head === "string" ? ["first", "second"][side] : undefined]), ["second less first", 2]]), tested(independent)];
}

/** Words one after another, the last after "and". */
const enumerated = (words) => (words.length > 1 ? `${words.slice(0, -1).join(", ")} and ${words.at(-1)}` : words.join(""));

/** Which numbers of two sides differ by more than chance gives, in a sentence. */
function answered(both, matches, independent) {
  const counted = `(${matches[0]} ${matches[0] === 1 ? "match" : "matches"} against ${matches[1]})`;
  if (!independent) return `The two have matches in common, so no difference can be told from chance ${counted}.`;
  const found = [["", "numbers"], ["its adversaries' ", "against"]].flatMap(([whose, of]) => league.measures.map(([label, key, share]) => [
    whose + label, apart(...both.map((it) => it[of][key]), share, true)]));
  const told = found.filter(([, value]) => value.includes("±"));
  if (!told.length) return `Too few matches to tell a difference from chance ${counted}: four on each side are needed.`;
  const beyond = told.filter(([, value]) => value.startsWith("★"));
  const by = `of ${told.length} numbers chance alone makes about ${(0.05 * told.length).toFixed(1)} so`;
  return beyond.length ? `More than chance gives changed: ${enumerated(beyond.map(([name, value]) => `${name} (${value.slice(2)})`))} ${counted}; ${by}.`
    : `No difference between these sets is larger than chance gives ${counted}.`;
}

/** The adversaries of two sets, in a sentence: they differ if their shares of the matches do. */
function adversaries(both, names) {
  const met = both.map(({ matches }, side) => matches.reduce((count, id) => {
    const { names: [home, away] } = league.matches.find((match) => match.id === id), other = home === names[side] ? away : home;
    return count.set(other, (count.get(other) ?? 0) + 1);
  }, new Map()));
  const every = [...new Set(met.flatMap((count) => [...count.keys()]))].sort();
  const [one, other] = both.map(({ matches }) => matches.length);
  if (every.every((name) => (met[0].get(name) ?? 0) * other === (met[1].get(name) ?? 0) * one)) {
    return `Both sets have the same adversaries${every.length > 1 ? ", in the same shares" : ""}.`;
  }
  const times = (n) => ({ 1: "once", 2: "twice" })[n] ?? `${n} times`;
  const [first, second] = met.map((count) => enumerated(every.map((name) => (count.has(name) ? `${name} ${times(count.get(name))}` : `no ${name}`))));
  const what = met[0].size === every.length && met[1].size === every.length ? "shares of the adversaries" : "adversaries";
  return `The ${what} differ, too: the first set has ${first}; the second set has ${second}.`;
}

function twoTeams(...slugs) {
  const both = slugs.map((slug) => league.teams.find((team) => team.slug === slug));
  const link = (team) => {
    const made = document.createElement("a");
    made.href = `teams/${team.slug}.html`;
    made.textContent = `${team.name} (${team.kind})`;
    return made;
  };
  const independent = !met(both), counts = both.map(({ matches }) => matches);
  const found = [...(independent ? [paragraph(answered(both, counts, true))] : []), ...twoSides(both, both.map(link), counts, independent)];
  for (const team of both) if (team.counted !== undefined && team.counted.includes(",")) found.push(paragraph(`${team.name}: ${team.counted}.`));
  if (both[0].kind !== both[1].kind) found.unshift(paragraph("They are of two leagues: their counts are of other games."));
  return found;
}

/** Two sets of matches, each of one team; with intervals of the differences where they share no match. */
function twoSets(...places) {
  const whole = places.map((place) => league.sets[Number(place)]), select = document.querySelector("#sets [data-under]");
  const common = Object.keys(whole[0].under).filter((name) => name in whole[1].under);
  fill(select, [["", "any adversary"], ...common.map((name) => [name, name])], select.value);
  const both = whole.map((set) => set.under[select.value] ?? set), counts = both.map(({ matches }) => matches.length);
  const independent = !both[0].matches.some((match) => both[1].matches.includes(match));
  const names = whole.map(({ team }) => league.teams.find((it) => it.slug === team).name);
  const heads = whole.map(({ says }) => (select.value ? `${says}, against ${select.value}` : says));
  return [paragraph(`${answered(both, counts, independent)} ${adversaries(both, names)}`), ...twoSides(both, heads, counts, independent)];
}

/** A behaviour's id in words. */
function inWords(id) {
  const [role, ...codes] = id.split("-");
  const names = codes.map((code) => league.codes[Number(code)] ?? code);
  return `${role}: ${names.join(" → ")}`;
}

const worth = (row) => (row ? minus(`${row[2].toFixed(3)}${row[3] === null ? "" : ` [${row[3].toFixed(3)}, ${row[4].toFixed(3)}]`}`) : "–");

/** Behaviours of both sides by id: their rows, and the difference of their values with its 95 % interval. */
function differences(first, second, independent) {
  const by = new Map();
  [first, second].forEach((rows, side) => rows.forEach((row) => {
    if (!by.has(row[0])) by.set(row[0], [null, null]);
    by.get(row[0])[side] = row;
  }));
  return [...by].map(([id, [a, b]]) => {
    const shared = a && b ? a[2] - b[2] : null;
    const tested = independent && shared !== null && a[3] !== null && b[3] !== null;
    const half = tested ? Math.hypot(a[4] - a[2], b[4] - b[2]) : null;
    return { id, a, b, shared, half, sure: tested && Math.abs(shared) > half };
  });
}

function told(rows, names, independent) {
  const both = rows.filter(({ a, b }) => a && b), tested = both.filter(({ half }) => half !== null);
  const only = (side) => rows.filter((row) => row[side] && !row[side === "a" ? "b" : "a"]).length;
  const counts = `${both.length} in both, ${only("a")} only in ${names[0]}, ${only("b")} only in ${names[1]}.`;
  if (!independent) return `${counts} The two have matches in common, so no interval of the difference is given.`;
  return `${counts} Of ${tested.length} that can be compared, ${tested.filter(({ sure }) => sure).length} went with more in one`
    + ` (the 95 % interval of the difference leaves out 0); by chance alone it would be about ${(0.05 * tested.length).toFixed(1)}.`;
}

function linked(id, team) {
  const at = league.teams.find((it) => it.name === team.name && it.kind === team.kind);
  if (!at) return inWords(id);
  const made = document.createElement("a");
  made.href = `behaviours/${at.slug}.html#${id}`;
  made.textContent = inWords(id);
  return made;
}

/** How often a behaviour is shown in ten minutes of play, as it is shown and as it sorts. */
function often(row, team) {
  if (!row || !team.minutes) return ["–", -1];
  const rate = (10 * row[1]) / team.minutes;
  return [rate.toFixed(1), rate];
}

const sorts = (text, value) => [text, value ?? -1e9];

/** A button that shows all rows of a table that is cut after the first ones; sorting keeps the cut. */
function more(made, count) {
  if (count <= FIRST) return [];
  made.classList.add("cut");
  const button = document.createElement("button");
  button.textContent = `Show all ${count}`;
  button.addEventListener("click", () => { made.classList.remove("cut"); button.remove(); made.tabIndex = -1; made.focus(); });
  return [button];
}

function twoLists(teams, versions, show) {
  const independent = !(teams[0].name === teams[1].name && teams[0].kind === teams[1].kind);
  const names = teams.map((team, side) => `${team.name}, version ${versions[side]}`);
  const rows = differences(teams[0].behaviours, teams[1].behaviours, independent);
  const rank = ({ shared, half, sure, a, b }) => (sure ? 2000 + Math.abs(shared) - half
    : shared !== null ? 1000 + Math.abs(shared) : (a ?? b)[3] ?? (a ?? b)[2]);
  const wanted = { all: () => true, sure: (row) => row.sure, first: ({ a, b }) => a && !b, second: ({ a, b }) => b && !a };
  const kept = rows.filter(wanted[show]).sort((x, y) => rank(y) - rank(x));
  const found = [paragraph(told(rows, names, independent))];
  if (teams[0].kind !== teams[1].kind) found.push(paragraph("They are of two leagues, and each league has a V of its own."));
  const made = table(["Behaviour", ...teams.flatMap(() => ["n", "each 10 min", "value"]), "of values"], kept.slice(0, ROWS).map((row) => [
    linked(row.id, row.a ? teams[0] : teams[1]),
    ...[row.a, row.b].flatMap((own, side) => [sorts(own?.[1] ?? "–", own?.[1]), often(own, teams[side]), sorts(worth(own), own?.[2])]),
    sorts(row.shared === null ? "" : `${row.sure ? "★ " : ""}${minus(row.shared.toFixed(3))}${row.half === null ? "" : ` ± ${row.half.toFixed(3)}`}`, row.shared)]),
  [[names[0], 3], [names[1], 3], ["difference", 1]]);
  made.className = "sortable"; // too long to be blocks on a phone
  sortable(made);
  found.push(made, ...more(made, Math.min(kept.length, ROWS)));
  if (!kept.length) found.push(paragraph("Nothing fits the choice."));
  if (kept.length > ROWS) found.push(paragraph(`The first ${ROWS} of ${kept.length} are shown.`));
  return found;
}

/** The section of behaviours: two versions, and a team of each. */
function behaviours(asked) {
  const section = document.getElementById("behaviours");
  if (!league.versions.length) {
    section.hidden = true;
    return;
  }
  const [versions, sides] = ["version", "side"].map((name) => [0, 1].map((i) => section.querySelector(`[data-${name}="${i}"]`)));
  const show = section.querySelector("[data-show]");
  const numbers = league.versions.map(({ version, matches }) => [String(version), `${version} (${matches} matches)`]);
  const said = asked ?? [];
  fill(versions[0], numbers, said[0] ?? numbers[0][0]);
  fill(versions[1], numbers, said[2] ?? numbers[0][0]);
  let lists = [[], []];
  const update = () => {
    const teams = sides.map((select, side) => lists[side][Number(select.value)]);
    const why = !teams.every(Boolean) ? "This version of the knowledge has no behaviours of a team alone."
      : teams[0] === teams[1] ? "Both are the same team in the same version." : "";
    put(section, why ? [paragraph(why)] : twoLists(teams, versions.map((it) => it.value), show.value));
  };
  const load = async (teams = sides.map((select) => select.selectedOptions[0]?.textContent)) => {
    try {
      lists = await Promise.all(versions.map((select) => versionOf(Number(select.value))));
    } catch (error) {
      put(section, [paragraph(error.message)]);
      return;
    }
    sides.forEach((select, side) => {
      const names = lists[side].map((team, i) => [String(i), `${team.name} (${team.kind})`]);
      const same = versions[0].value === versions[1].value;
      const most = [...lists[0]].sort((one, other) => other.behaviours.length - one.behaviours.length);
      const two = same ? firstPair(most, (one, other) => one.kind === other.kind) : undefined;
      const preset = two ? names[lists[0].indexOf(two[side])] : side ? names.find(([, name]) => name === sides[0].selectedOptions[0]?.textContent) : undefined;
      fill(select, names, (names.find(([, name]) => name === teams[side]) ?? preset ?? names[0])?.[0]);
    });
    update();
  };
  versions.forEach((select) => select.addEventListener("change", () => load()));
  [...sides, show].forEach((select) => select.addEventListener("change", update));
  const loaded = load([said[1], said[3]]).then(() => {
    // without two teams of one league: the same team in two versions
    if (asked || numbers.length < 2 || firstPair(lists[0], (one, other) => one.kind === other.kind)) return;
    versions[1].value = numbers[1][0];
    return load();
  });
  if (asked) section.scrollIntoView();
  return (slugs) => loaded.then(() => {
    const lacking = slugs.flatMap((slug, side) => {
      const { name, kind } = league.teams.find((team) => team.slug === slug);
      const at = lists[side].findIndex((team) => team.name === name && team.kind === kind);
      if (at >= 0) sides[side].selectedIndex = at;
      return at >= 0 ? [] : [name];
    });
    update();
    if (lacking.length) section.querySelector(".found").prepend(paragraph(`This version of the knowledge has no behaviours of ${lacking.join(" and ")}: it was made of other teams.`));
  });
}

addEventListener("DOMContentLoaded", () => {
  const [name, rest] = location.hash.slice(1).split("=");
  const asked = (own) => (name === own && rest ? rest.split(",").map(decodeURIComponent) : undefined);
  const newest = [...league.matches].reverse();
  pair("matches", league.matches.map((match) => [match.id, named(match)]), asked("matches"), twoMatches,
    firstPair(newest, (one, other) => teamsOf(one) === teamsOf(other))?.[1].id, (id) => partner(newest, (it) => it.id === id,
      (one, other) => teamsOf(one) === teamsOf(other))?.id);
  const sets = league.sets.map(({ says, team, matches }, place) => ({ says, team, matches, place: String(place) }));
  const other = (place) => { // of the same team, and without a match in common if there is one
    const one = sets[Number(place)], common = (it) => it.matches.filter((match) => one.matches.includes(match)).length;
    return sets.filter((it) => it !== one && it.team === one.team).sort((a, b) => common(a) - common(b) || b.matches.length - a.matches.length)[0]?.place;
  };
  const [first] = asked("teams") ?? [league.teams[0]?.slug];
  const dated = sets.filter((it) => it.team === first), preset = dated.find(({ says }) => says.includes(", before ")) ?? dated[0] ?? sets[0];
  pair("sets", sets.map(({ says, place }) => [place, says]), asked("sets"), twoSets, preset?.place, other);
  const follow = behaviours(asked("behaviours"));
  let own = Boolean(asked("behaviours")); // an address of behaviours holds until teams are chosen
  pair("teams", league.teams.map(({ name: team, kind, slug }) => [slug, `${team} (${kind})`]), asked("teams"), twoTeams,
    firstPair(league.teams, (one, other) => one.kind === other.kind)?.[0].slug,
    (slug) => partner(league.teams, (it) => it.slug === slug, (one, other) => met([one, other]))?.slug,
    (slugs) => { if (!own) follow?.(slugs); own = false; });
});
