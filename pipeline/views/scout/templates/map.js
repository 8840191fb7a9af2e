"use strict";

/** A picture to walk through: one of its places is chosen, and only the panel of that place is shown. */
function walk(section) {
  const places = [...section.querySelectorAll("[data-place]")];
  const panels = [...section.querySelectorAll(".panel")];
  const edges = [...section.querySelectorAll(".edge")];
  const columns = Number(section.dataset.columns ?? 0); // 0: a ring, on which there is no up and no down
  if (!places.length) return;

  function choose(key) {
    places.forEach((place) => {
      const chosen = place.dataset.place === key;
      place.setAttribute("tabindex", chosen ? "0" : "-1");
      if (chosen) place.setAttribute("aria-current", "true"); else place.removeAttribute("aria-current");
    });
    panels.forEach((panel) => { panel.hidden = panel.id !== key; });
    edges.forEach((edge) => {
      edge.classList.toggle("on", edge.dataset.from === key);
      edge.classList.toggle("to", edge.dataset.to === key && edge.dataset.from !== key);
    });
    section.querySelector(".ring")?.classList.add("chosen");
  }

  function go(place) {
    history.replaceState(null, "", `#${place.dataset.place}`);
    choose(place.dataset.place);
    place.focus({ preventScroll: true });
  }

  function step(at, key) {
    if (!columns) return { ArrowLeft: at - 1, ArrowUp: at - 1, ArrowRight: at + 1, ArrowDown: at + 1 }[key];
    const column = at % columns;
    if (key === "ArrowLeft") return column > 0 ? at - 1 : at;
    if (key === "ArrowRight") return column < columns - 1 ? at + 1 : at;
    return { ArrowUp: at - columns, ArrowDown: at + columns }[key];
  }

  places.forEach((place, at) => {
    place.addEventListener("click", (event) => { event.preventDefault(); go(place); });
    place.addEventListener("keydown", (event) => {
      let next = step(at, event.key);
      if (next === undefined) return;
      event.preventDefault();
      if (!columns) next = (next + places.length) % places.length;
      if (places[next]) go(places[next]);
    });
  });

  const asked = () => {
    const key = decodeURIComponent(location.hash.slice(1));
    if (!panels.some((panel) => panel.id === key)) return false;
    choose(key);
    return true;
  };
  addEventListener("hashchange", () => { if (asked()) section.scrollIntoView(); });
  const count = (place) => Number(place.querySelector("b")?.textContent.replaceAll(",", ""));
  const busiest = places.reduce((a, b) => (count(b) > count(a) ? b : a));
  if (asked()) section.scrollIntoView(); else choose(busiest.dataset.place);
}

addEventListener("DOMContentLoaded", () => document.querySelectorAll(".walk").forEach(walk));
