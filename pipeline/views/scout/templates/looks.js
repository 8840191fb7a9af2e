/** Say how many of a page's rows or cards are shown, of lists [shown, all, what]; says so too if there are none. */
function counter(tools) {
  const said = document.createElement("p");
  said.className = "shown";
  said.setAttribute("role", "status");
  tools.after(said);
  return (parts) => {
    const none = parts.every(([shown]) => !shown);
    const counts = parts.map(([shown, all, what]) => `${shown} of ${all}${parts.length > 1 ? ` ${what}` : ""}`).join(", ");
    said.textContent = none ? `Nothing fits the filter: ${counts} shown.` : `${counts} shown`;
    said.classList.toggle("none", none);
  };
}

/** Tables that are wider than their place scroll by the keyboard, and say so. */
function wide(table) {
  table.dataset.looked = "";
  const hint = document.createElement("p");
  hint.className = "scrolls";
  hint.textContent = "The table goes on to the right: scroll it.";
  table.before(hint);
  const measure = () => {
    const over = table.scrollWidth > table.clientWidth + 4;
    hint.classList.toggle("on", over);
    table.classList.toggle("over", over);
    table.classList.toggle("at-start", table.scrollLeft < 2);
    table.classList.toggle("at-end", table.scrollLeft + table.clientWidth > table.scrollWidth - 2);
    if (over) table.tabIndex = 0; else table.removeAttribute("tabindex");
  };
  table.addEventListener("scroll", measure);
  new ResizeObserver(measure).observe(table);
}

/** These teams come first in menus. This file alone says which: a new match leaves the pages of the others as they are. */
function menuFirst(slugs) {
  for (const menu of document.querySelectorAll("nav, nav .menu div")) {
    const links = [...menu.querySelectorAll(":scope > a")].filter((link) => /(teams|against)\/[^/]+$/.test(link.getAttribute("href")));
    links[0]?.before(...slugs.flatMap((slug) => links.filter((link) => link.getAttribute("href").endsWith(`/${slug}.html`))));
  }
}

/** The menu marks the page that is shown; a match is one of the league's. */
function mark() {
  const here = location.href.split("#")[0], links = [...document.querySelectorAll("nav a")];
  const own = links.find((link) => link.href === here) ?? links.find((link) => document.body.dataset.match && link.hash === "#all-matches");
  own?.setAttribute("aria-current", "page");
  own?.closest("details")?.querySelector("summary").setAttribute("aria-current", "true");
}

/** On a phone tables and long parts are folded below the pictures; where an address leads, and on paper, they are open. */
function folds() {
  const narrow = matchMedia("(max-width: 640px)"), all = [...document.querySelectorAll(".folds")];
  const head = (each) => (!each || each.matches("h2") ? each : head(each.previousElementSibling));
  const fit = (folded) => all.forEach((each) => {
    const own = each.querySelector(":scope > .fold");
    if (folded && !own) {
      const made = document.createElement("details"), said = document.createElement("summary");
      made.className = "fold";
      said.textContent = each.dataset.head;
      made.append(said, ...each.childNodes);
      each.append(made);
    } else if (!folded && own) {
      own.firstElementChild.remove();
      own.replaceWith(...own.childNodes);
    }
  });
  const lead = () => {
    const target = document.getElementById(decodeURIComponent(location.hash.slice(1).split("=")[0]));
    if (!target || !narrow.matches) return;
    all.filter((each) => each.contains(target) || head(each) === target || each.parentElement === target).forEach((each) => { each.firstElementChild.open = true; });
    target.scrollIntoView();
  };
  fit(narrow.matches);
  lead();
  narrow.addEventListener("change", () => fit(narrow.matches));
  addEventListener("hashchange", lead);
  addEventListener("beforeprint", () => fit(false));
  addEventListener("afterprint", () => fit(narrow.matches));
}

/** The way to the top is there only where the page scrolls. */
function toTop() {
  const way = document.querySelector(".to-top");
  new ResizeObserver(() => { way.hidden = document.documentElement.scrollHeight <= innerHeight + (way.hidden ? 0 : way.offsetHeight + 12); }).observe(document.body);
}

/** Of clips side by side, and of the marks of a picture, one is a Tab stop; arrow keys lead to the others. */
function rove(holder, which, label) {
  const all = [...holder.querySelectorAll(which)];
  if (!all.length) return;
  if (all.length > 1) {
    holder.setAttribute("role", "group");
    holder.setAttribute("aria-label", `${label}; arrow keys lead from one to the next`);
  }
  const only = (one) => all.forEach((each) => { each.tabIndex = each === one ? 0 : -1; });
  only(all[0]);
  all.forEach((each, at) => {
    each.addEventListener("focus", () => only(each));
    each.addEventListener("keydown", (event) => {
      const next = { ArrowRight: at + 1, ArrowDown: at + 1, ArrowLeft: at - 1, ArrowUp: at - 1 }[event.key];
      if (next === undefined) return;
      event.preventDefault();
      all[next]?.focus();
    });
  });
}

addEventListener("DOMContentLoaded", () => {
  const look = () => document.querySelectorAll("main table:not([data-looked])").forEach(wide);
  look();
  new MutationObserver((changes) => { // a comparison makes tables
    look();
    changes.forEach(({ addedNodes }) => addedNodes.forEach((each) => { if (each.nodeType === 1 && !each.matches(".term")) explain(each); }));
  }).observe(document.querySelector("main"), { childList: true, subtree: true });
  toTop();
  mark();
  folds();
  document.querySelectorAll(".clips").forEach((clips) => rove(clips, "canvas", "clips"));
  document.querySelectorAll("svg.pitch, svg.top").forEach((pitch) => rove(pitch, "a", pitch.getAttribute("aria-label")));
});
