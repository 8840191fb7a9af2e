/** Say how many of a page's rows or cards are shown; says so too if there are none. */
function counter(tools) {
  const said = document.createElement("p");
  said.className = "shown";
  said.setAttribute("role", "status");
  tools.after(said);
  return (shown, all) => {
    said.textContent = shown ? `${shown} of ${all} shown` : `Nothing fits the filter: 0 of ${all} shown.`;
    said.classList.toggle("none", !shown);
  };
}

/** Tables that are wider than the screen say so, and scroll by the keyboard. */
function wide(table) {
  const hint = document.createElement("p");
  hint.className = "scrolls";
  hint.textContent = "The table goes on to the right: scroll it.";
  table.before(hint);
  const measure = () => {
    const over = table.scrollWidth > table.clientWidth + 1;
    hint.classList.toggle("on", over);
    if (over) table.tabIndex = 0; else table.removeAttribute("tabindex");
  };
  new ResizeObserver(measure).observe(table);
}

/** Of clips side by side one is a Tab stop; arrow keys lead to the others. */
function rove(holder) {
  const all = [...holder.querySelectorAll("canvas")];
  if (all.length < 2) return;
  holder.setAttribute("role", "group");
  holder.setAttribute("aria-label", `${all.length} clips; arrow keys lead from one to the next`);
  const only = (one) => all.forEach((canvas) => { canvas.tabIndex = canvas === one ? 0 : -1; });
  only(all[0]);
  all.forEach((canvas, at) => {
    canvas.addEventListener("focus", () => only(canvas));
    canvas.addEventListener("keydown", (event) => {
      const next = { ArrowRight: at + 1, ArrowDown: at + 1, ArrowLeft: at - 1, ArrowUp: at - 1 }[event.key];
      if (next === undefined) return;
      event.preventDefault();
      all[next]?.focus();
    });
  });
}

addEventListener("DOMContentLoaded", () => {
  document.querySelectorAll("main table").forEach(wide);
  document.querySelectorAll(".clips").forEach(rove);
});
