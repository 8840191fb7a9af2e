"use strict";
// The page that compares: two matches, two teams, or the behaviours of two teams or versions of the knowledge.

const known = new Map(); // version to its teams, as its script gave them
let league = null;
/** Rows of a table at most; the rest is counted. */
const ROWS = 300;
/** The normal distribution's 97.5 % point. */
const Z = 1.959964;

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
  if (known.has(version)) return Promise.resolve(known.get(version));
  return new Promise((resolve, reject) => {
    const script = document.createElement("script");
    script.src = `compare/v${version}.js`;
    script.onload = () => resolve(known.get(version));
    script.onerror = () => reject(new Error(`compare/v${version}.js is missing: write the pages again`));
    document.head.append(script);
  });
}

const percent = (share) => `${Math.round(100 * share)}\u00a0%`;
const plain = (value, share, digits = Number.isInteger(value) ? 0 : 2) => (value === null ? "–" : share ? percent(value) : value.toFixed(digits));

/** A mean over matches with its interval; Mean is a list: mean, low, high, n. */
function interval(mean, share) {
  if (mean === null) return "–";
  const [middle, low, high] = mean;
  const ends = low === null ? "" : ` [${plain(low, share, 1)}, ${plain(high, share, 1)}]`;
  return plain(middle, share, 1) + ends;
}

/** A table: text only, whatever the data hold. The first cell of each row is its head. */
function table(heads, rows) {
  const made = document.createElement("table");
  const head = made.createTHead().insertRow();
  heads.forEach((text, i) => {
    const cell = head.appendChild(document.createElement("th"));
    cell.textContent = text;
    if (i) cell.className = "n";
  });
  const body = made.createTBody();
  for (const cells of rows) {
    const row = body.insertRow();
    cells.forEach((text, i) => {
      const cell = row.appendChild(document.createElement(i ? "td" : "th"));
      if (i) cell.className = "n"; else cell.scope = "row";
      if (text instanceof Node) cell.append(text); else cell.textContent = text;
    });
  }
  return made;
}

function paragraph(text) {
  const made = document.createElement("p");
  made.textContent = text;
  return made;
}

/** Fill a select with choices [value, text], and choose one if it is there. */
function fill(select, choices, chosen) {
  select.replaceChildren(...choices.map(([value, text]) => new Option(text, value)));
  if (choices.some(([value]) => value === chosen)) select.value = chosen;
}

/** A section with two selects; `show` gives what is found for the two choices. */
function pair(id, choices, asked, show) {
  const section = document.getElementById(id);
  if (choices.length < 2) {
    section.hidden = true;
    return;
  }
  const sides = [0, 1].map((side) => section.querySelector(`[data-side="${side}"]`));
  const first = asked?.[0] ?? choices[0][0];
  const second = asked?.[1] ?? choices.find(([value]) => value !== first)[0];
  fill(sides[0], choices, first);
  fill(sides[1], choices, second);
  const update = () => section.querySelector(".found").replaceChildren(...show(sides[0].value, sides[1].value));
  sides.forEach((select) => select.addEventListener("change", () => {
    history.replaceState(null, "", `#${id}=${sides.map((each) => encodeURIComponent(each.value)).join(",")}`);
    update();
  }));
  update();
  if (asked) section.scrollIntoView();
}

function twoMatches(...ids) {
  const both = ids.map((id) => league.matches.find((match) => match.id === id));
  const heads = ["", ...both.flatMap((match) => match.names)];
  const link = (match) => {
    const made = document.createElement("a");
    made.href = `matches/${match.id}.html`;
    made.textContent = `${match.id}: ${match.names[0]} ${match.score} ${match.names[1]}`;
    return made;
  };
  const links = document.createElement("p");
  links.append(link(both[0]), document.createElement("br"), link(both[1]));
  const rows = league.measures.map(([label, key, share]) => [
    label, ...both.flatMap((match) => match.numbers.map((side) => plain(side[key], share)))]);
  return [links, table(heads, rows)];
}

function twoTeams(...slugs) {
  const both = slugs.map((slug) => league.teams.find((team) => team.slug === slug));
  const rows = league.measures.map(([label, key, share]) => [
    share ? label : `${label}, each 10 minutes`, ...both.map((team) => interval(team.numbers[key], share))]);
  const found = [table(["", ...both.map((team) => `${team.name} (${team.kind})`)], [
    ["matches", ...both.map((team) => team.matches)], ...rows])];
  if (both[0].kind !== both[1].kind) found.unshift(paragraph("They are of two leagues: their counts are of other games."));
  return found;
}

/** A behaviour's id in words. */
function inWords(id) {
  const [role, ...codes] = id.split("-");
  const names = codes.map((code) => (league.codes[Number(code)] ?? code).replace(/^Robot /, ""));
  return `${role}: ${names.join(", then ")}`;
}

const worth = (row) => (row ? `${row[2].toFixed(3)}${row[3] === null ? "" : ` [${row[3].toFixed(3)}, ${row[4].toFixed(3)}]`}` : "–");

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
  return `${counts} Of ${tested.length} that can be compared, ${tested.filter(({ sure }) => sure).length} pay more in one`
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
  found.push(table(["Behaviour", "n", names[0], "n", names[1], "difference"], kept.slice(0, ROWS).map((row) => [
    linked(row.id, row.a ? teams[0] : teams[1]), row.a?.[1] ?? "–", worth(row.a), row.b?.[1] ?? "–", worth(row.b),
    row.shared === null ? "" : `${row.sure ? "★ " : ""}${row.shared.toFixed(3)}${row.half === null ? "" : ` ± ${row.half.toFixed(3)}`}`])));
  if (kept.length > ROWS) found.push(paragraph(`The first ${ROWS} of ${kept.length} are shown.`));
  return found;
}

/** The section of behaviours: two versions, and a team of each. */
function behaviours(asked) {
  const section = document.getElementById("behaviours"), found = section.querySelector(".found");
  if (!league.versions.length) {
    section.hidden = true;
    return;
  }
  const [versions, sides] = ["version", "side"].map((name) => [0, 1].map((i) => section.querySelector(`[data-${name}="${i}"]`)));
  const show = section.querySelector("[data-show]");
  const numbers = league.versions.map(({ version, matches }) => [String(version), `${version} (${matches} matches)`]);
  const said = asked ?? [];
  fill(versions[0], numbers, said[0] ?? numbers[0][0]);
  fill(versions[1], numbers, said[2] ?? (numbers[1] ?? numbers[0])[0]);
  let lists = [[], []];
  const update = () => {
    const teams = sides.map((select, side) => lists[side][Number(select.value)]);
    found.replaceChildren(...(teams.every(Boolean) ? twoLists(teams, versions.map((it) => it.value), show.value) : []));
  };
  const load = async (teams = sides.map((select) => select.selectedOptions[0]?.textContent)) => {
    try {
      lists = await Promise.all(versions.map((select) => versionOf(Number(select.value))));
    } catch (error) {
      found.replaceChildren(paragraph(error.message));
      return;
    }
    sides.forEach((select, side) => {
      const names = lists[side].map((team, i) => [String(i), `${team.name} (${team.kind})`]);
      const other = side && versions[0].value === versions[1].value ? names.find(([at]) => at !== sides[0].value) : undefined;
      fill(select, names, (names.find(([, name]) => name === teams[side]) ?? other ?? names[0])?.[0]);
    });
    update();
  };
  versions.forEach((select) => select.addEventListener("change", () => load()));
  [...sides, show].forEach((select) => select.addEventListener("change", update));
  load([said[1], said[3]]);
  if (asked) section.scrollIntoView();
}

addEventListener("DOMContentLoaded", () => {
  const [name, rest] = location.hash.slice(1).split("=");
  const asked = (own) => (name === own && rest ? rest.split(",").map(decodeURIComponent) : undefined);
  pair("matches", league.matches.map(({ id, names, score }) => [id, `${id}: ${names[0]} ${score} ${names[1]}`]), asked("matches"), twoMatches);
  pair("teams", league.teams.map(({ name: team, kind, slug }) => [slug, `${team} (${kind})`]), asked("teams"), twoTeams);
  behaviours(asked("behaviours"));
});
