// The list behind the pictures: goals, passes, shots, and what is chosen; each line jumps to its moment.

const MOST_LINES = 300;

/** Fills the list whenever what is chosen or the words that narrow it change; `jump` goes to a hit. */
function panel(match, events, jump) {
  const body = $("list");

  function line(hit) {
    const row = element("tr"), button = element("button", "time", clock(hit.t, 1));
    const known = hit.team !== null, whose = known ? match.teams[hit.team] : "unknown team";
    const chip = element("span", `chip ${hit.team ?? "unknown"}`, hit.robot ?? "?");
    const robot = element("td"), time = element("td");
    robot.append(element("span", "unseen", `${hit.team ?? ""} ${whose} `), chip);
    button.addEventListener("click", () => jump(hit));
    time.append(button);
    row.append(time, robot, element("td", "what", hit.what));
    return row;
  }

  /** Show all events, and the hits of what is found besides. */
  function fill(found) {
    const every = found?.lit ? [...events, ...found.hits].sort((a, b) => a.t - b.t) : found?.hits ?? events;
    const asked = $("narrow").value.toLowerCase().split(/\s+/).filter(Boolean);
    const text = (hit) => `${hit.team ?? "unknown"} ${match.teams[hit.team] ?? ""} ${hit.robot ?? ""} ${hit.kind} ${hit.what}`.toLowerCase();
    const hits = every.filter((hit) => asked.every((word) => text(hit).includes(word)));
    body.replaceChildren(...hits.slice(0, MOST_LINES).map(line));
    explain(body);
    $("count").textContent = asked.length ? `${hits.length} of ${every.length}` : String(every.length);
    $("more").textContent = hits.length > MOST_LINES ? `The first ${MOST_LINES} are shown; narrow the list.` : "";
  }

  return fill;
}
