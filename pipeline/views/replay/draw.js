// How the page paints a match: the pitch, the overview of the ball, and the robots' time lines.

const GUTTER = 118, EDGE = 14, AXIS = 20, TEAM_GAP = 6;
const FLASH = 2500, TRAIL = 900;
const SMALL = 360; // pixels: a pitch less wide is that of a clip
const NARROW = 560; // pixels: on a pitch less wide all names would cover it
const RANDOM = 194; // says nothing, so it has no label
const IDLE = [184, 194]; // not worth a label where it is crowded: does not move, moves randomly

const BALLS = { vsss: "#ff8a00", ssl: "#ff8a00", "2d": "#ffffff", human: "#ffffff" }; // as the leagues have them; the monitor of 2D shows white
const BALL_RIM = "#16191a"; // so that each is seen on light and on dark ground
const WORN = { blue: "#2f6bff", yellow: "#ffd400" }; // the patches of VSSS and SSL
const DIMMED = 0.16;

const COLOURS = ["ink", "muted", "line", "grass", "chalk", "outside", "ball", "halo", "label", "home", "away", "dead"];

const MARGIN = { vsss: 0.06, ssl: 0.35, "2d": 2.5, human: 2.5 }; // metres around the pitch

/** Paints the moment `state.t`, and `state.view` to `state.view + state.span` of the time lines. */
function painter(match, state) {
  const { time, mask, x, joined, pitch, quantum, situations: table, samples: S } = match;
  const { end, robots, ball, teams, crowded, family, dead } = match;
  const rowHeight = clamp(Math.floor(220 / robots.length), 11, crowded ? 17 : 22); // eleven a side fit a small screen
  const rowEdge = rowHeight < 17 ? 0.5 : 2, rowFont = rowHeight < 17 ? 8.5 : 10.5;

  let colours = {};
  /** Takes the colours that painting uses from the style sheet, whose theme may have changed. */
  function readColours() {
    const style = getComputedStyle(document.documentElement);
    const names = [...COLOURS, ...match.families.map((_, i) => `family-${i}`)];
    colours = Object.fromEntries(names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
  }

  /** Fit the canvas to its box at the screen's resolution; its context in CSS pixels. */
  function fitted(canvas) {
    const ratio = window.devicePixelRatio || 1, { clientWidth: w, clientHeight: h } = canvas;
    if (canvas.width !== Math.round(w * ratio) || canvas.height !== Math.round(h * ratio)) {
      canvas.width = Math.round(w * ratio); canvas.height = Math.round(h * ratio);
    }
    const c = canvas.getContext("2d");
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    c.clearRect(0, 0, w, h);
    return { c, w, h };
  }

  /** Whether a situation is not of those that are looked for, while only these are shown. */
  const dimmed = (index) => Boolean(state.filter && state.found) && !state.found.lit?.[index];

  /** Where a body is, as it is drawn: turned by half where `state.turned` says so. */
  function pose(body, now) {
    const at = match.pose(body, now);
    return at && state.turned ? { ...at, x: -at.x, y: -at.y, heading: at.heading === null ? null : at.heading + Math.PI } : at;
  }

  const sans = (size, weight = 400) => `${weight} ${size}px system-ui, "Segoe UI", "DejaVu Sans", sans-serif`;
  const mono = (size, weight = 400) => `${weight} ${size}px ui-monospace, "DejaVu Sans Mono", Menlo, monospace`;

  function drawMarkings(c, scale) {
    const { length, width, goal_width: mouth, goal_depth: depth, kind } = pitch;
    const { circle, areas, corner, marks } = MARKINGS[kind];
    const X = length / 2, Y = width / 2;
    c.lineJoin = "round";
    for (const [side, team] of state.turned ? [[1, "home"], [-1, "away"]] : [[-1, "home"], [1, "away"]]) { // who defends it
      c.fillStyle = colours[team]; c.globalAlpha = 0.22;
      c.fillRect(side > 0 ? X : -X - depth, -mouth / 2, depth, mouth);
      c.globalAlpha = 1; c.strokeStyle = colours[team]; c.lineWidth = 2.5 / scale;
      c.beginPath(); c.moveTo(side * X, -mouth / 2); c.lineTo(side * (X + depth), -mouth / 2);
      c.lineTo(side * (X + depth), mouth / 2); c.lineTo(side * X, mouth / 2); c.stroke();
    }
    c.beginPath();
    const corners = [[X, Y], [-X, Y], [-X, -Y], [X, -Y]];
    corners.forEach(([cx, cy], i) => { // cut by the corner triangles, where there are any
      const alongFirst = i % 2 === 1;
      const a = [cx - Math.sign(cx) * corner, cy], b = [cx, cy - Math.sign(cy) * corner];
      for (const [px, py] of alongFirst ? [a, b] : [b, a]) c.lineTo(px, py);
    });
    c.closePath();
    c.fillStyle = colours.grass; c.fill();
    c.strokeStyle = colours.chalk; c.lineWidth = 1.5 / scale; c.stroke();
    c.beginPath(); c.moveTo(0, -Y); c.lineTo(0, Y); c.stroke();
    c.beginPath(); c.arc(0, 0, circle, 0, 7); c.stroke();
    for (const side of [-1, 1]) {
      for (const [deep, wide] of areas) c.strokeRect(side > 0 ? X - deep : -X, -wide / 2, deep, wide);
      for (const [mx, my] of marks) {
        c.beginPath(); c.arc(side * mx, my, 2 / scale, 0, 7); c.fillStyle = colours.chalk; c.fill();
      }
    }
  }

  function drawRobot(c, scale, robot, at) {
    const r = Math.max(match.robot_radius, 8 / scale);
    c.save();
    c.translate(at.x, at.y);
    c.fillStyle = colours[robot.team]; c.strokeStyle = colours.halo; c.lineWidth = 1.5 / scale;
    c.globalAlpha = at.suspect ? 0.4 : 1;
    c.rotate(at.heading ?? 0);
    c.beginPath();
    if (pitch.kind === "vsss") c.rect(-r, -r, 2 * r, 2 * r);
    else if (pitch.kind === "ssl" && at.heading !== null) { c.arc(0, 0, r, 0.6, 2 * Math.PI - 0.6); c.closePath(); }
    else c.arc(0, 0, r, 0, 7);
    c.fill();
    if (match.worn) { // the team's own colour about it
      c.strokeStyle = BALL_RIM; c.lineWidth = 4.5 / scale; c.stroke();
      c.strokeStyle = WORN[match.worn[robot.team]]; c.lineWidth = 2.5 / scale;
    }
    c.stroke();
    const small = r * scale < 14;
    if (at.heading !== null && small) { // a nose before the front
      c.strokeStyle = colours[robot.team]; c.lineWidth = 2.5 / scale;
      c.beginPath(); c.moveTo(r, 0); c.lineTo(r * 1.6, 0); c.stroke();
    } else if (at.heading !== null) { // an arrow on the front
      c.fillStyle = colours.halo; c.beginPath();
      c.moveTo(r * 0.98, 0); c.lineTo(r * 0.52, r * 0.46); c.lineTo(r * 0.52, -r * 0.46); c.fill();
    }
    c.rotate(-(at.heading ?? 0));
    c.scale(1 / scale, -1 / scale);
    c.fillStyle = colours.halo; c.textAlign = "center"; c.textBaseline = "middle";
    c.font = sans(Math.max(9, Math.min(20, r * scale * 0.95)), 700);
    const back = at.heading === null || small ? 0 : r * scale * 0.18;
    c.fillText(robot.id, -back * Math.cos(at.heading ?? 0), back * Math.sin(at.heading ?? 0) + 0.5);
    c.restore();
  }

  function drawBall(c, scale, now) {
    const r = Math.max(match.ball_radius, 4 / scale);
    if (now.i >= 0) {
      c.strokeStyle = colours.ball;
      let next = pose(ball, now);
      for (let i = now.i, right = state.t; next && i >= 0 && state.t - time[i] < TRAIL; i--) {
        const at = pose(ball, { i, part: 0 });
        if (!at || at.suspect || next.suspect) break;
        c.globalAlpha = 0.38 * (1 - (state.t - right) / TRAIL); c.lineWidth = r * 1.3;
        c.beginPath(); c.moveTo(next.x, next.y); c.lineTo(at.x, at.y); c.stroke();
        next = at; right = time[i];
        if (!joined[i]) break;
      }
      c.globalAlpha = 1;
    }
    const at = pose(ball, now);
    if (!at) return;
    c.beginPath(); c.arc(at.x, at.y, r, 0, 7);
    c.strokeStyle = colours.halo; c.lineWidth = 4.5 / scale; c.stroke();
    c.strokeStyle = at.suspect ? colours.ball : BALL_RIM; c.lineWidth = 2 / scale; c.stroke();
    c.fillStyle = BALLS[pitch.kind];
    if (!at.suspect) c.fill();
  }

  /**
   * Code and name beside each robot where they cover nothing else; for want of room the code alone. On a narrow
   * pitch only the robot that is nearest to the ball has its name.
   */
  function drawLabels(c, places, at, width, height) {
    const size = crowded ? 10.5 : 12, h = size + 7;
    const taken = places.map(({ px, py, reach }) => ({ l: px - reach + 4, t: py - reach + 4, w: 2 * reach - 8, h: 2 * reach - 8 }));
    if (at) taken.push({ l: at.px - 8, t: at.py - 8, w: 16, h: 16 });
    const free = (b) => taken.every((o) => b.l > o.l + o.w || o.l > b.l + b.w || b.t > o.t + o.h || o.t > b.t + b.h);
    const around = ({ px, py, reach }, w) => [
      [-w / 2, -reach - h], [-w / 2, reach], [reach, -h / 2], [-reach - w, -h / 2], [0, -reach - h], [-w, -reach - h], [0, reach], [-w, reach],
    ].map(([dx, dy]) => ({ l: clamp(px + dx, 3, width - w - 3), t: clamp(py + dy, 3, height - h - 3), w, h }));
    const far = ({ px, py }) => (at ? Math.hypot(px - at.px, py - at.py) : 0);
    const nearest = width < NARROW ? Math.min(...places.map(far)) : Infinity;
    for (const place of places) {
      const index = match.situationAt(place.robot, state.t), code = table.code[index];
      if (index < 0 || code === RANDOM || (crowded && IDLE.includes(code)) || dimmed(index)) continue;
      const name = match.shortName(code);
      c.font = mono(size, 600);
      const codeWidth = c.measureText(three(code)).width;
      c.font = sans(size);
      const boxes = far(place) <= nearest ? around(place, codeWidth + c.measureText(name).width + 18) : [];
      const box = boxes.find(free) ?? around(place, codeWidth + 12).find(free);
      if (!box) continue; // better no label than one over the ball or a robot
      taken.push(box);
      c.fillStyle = colours.label; c.strokeStyle = colours[`family-${family.get(code)}`]; c.lineWidth = 1.5;
      c.beginPath(); c.roundRect(box.l, box.t, box.w, box.h, 4); c.fill(); c.stroke();
      c.textAlign = "left"; c.textBaseline = "middle";
      c.font = mono(size, 600); c.fillStyle = colours[place.robot.team];
      c.fillText(three(code), box.l + 6, box.t + h / 2 + 0.5);
      if (box.w < codeWidth + 18) continue;
      c.font = sans(size); c.fillStyle = colours.ink; c.fillText(name, box.l + 12 + codeWidth, box.t + h / 2 + 0.5);
    }
  }

  /** A line of words at the top, or at the bottom if the ball is at the top. */
  function banner(c, w, h, text, colour, alpha, ballAt) {
    const part = clamp(h / 380, 0.4, 1), high = 42 * part, edge = 14 * part; // a clip is small: little is covered
    const top = ballAt !== null && ballAt < edge + 1.4 * high ? h - edge - high : edge;
    c.globalAlpha = alpha; c.font = sans(Math.max(10.5, 22 * part), 700); c.textAlign = "center"; c.textBaseline = "middle";
    const width = Math.min(w - 20 * part, c.measureText(text).width + 44 * part);
    c.fillStyle = colour; c.beginPath(); c.roundRect((w - width) / 2, top, width, high, 10 * part); c.fill();
    c.fillStyle = colours.halo; c.fillText(text, w / 2, top + high / 2 + 0.5, width - 20 * part); c.globalAlpha = 1;
  }

  /** The pitch at the moment `state.t`; `state.marked` is a body to point out. */
  function drawPitch(canvas) {
    const { c, w, h } = fitted(canvas);
    const margin = MARGIN[pitch.kind];
    if (!w || !h) return; // a clip that a filter hides
    const free = w < SMALL ? 8 : 0; // pixels: where robots are drawn greater than they are, none is cut at the edge
    const scale = Math.min((w - 2 * free) / (pitch.length + 2 * (pitch.goal_depth + margin)), (h - 2 * free) / (pitch.width + 2 * margin));
    c.fillStyle = colours.outside; c.fillRect(0, 0, w, h);
    c.save();
    c.translate(w / 2, h / 2); c.scale(scale, -scale);
    drawMarkings(c, scale);
    const now = match.moment(state.t), places = [];
    for (const robot of robots) {
      const at = pose(robot.body, now);
      if (!at) continue;
      drawRobot(c, scale, robot, at);
      if (robot.body === state.marked) {
        c.strokeStyle = colours.ink; c.lineWidth = 2 / scale; c.setLineDash([4 / scale, 3 / scale]);
        c.beginPath(); c.arc(at.x, at.y, Math.max(1.9 * match.robot_radius, 15 / scale), 0, 7); c.stroke(); c.setLineDash([]);
      }
      const reach = Math.max(match.robot_radius * scale * 1.35, 13);
      places.push({ robot, px: w / 2 + at.x * scale, py: h / 2 - at.y * scale, reach });
    }
    if (ball >= 0) drawBall(c, scale, now);
    c.restore();
    const seen = ball >= 0 && pose(ball, now);
    const under = seen ? { px: w / 2 + seen.x * scale, py: h / 2 - seen.y * scale } : null;
    if (state.labels) drawLabels(c, places, under, w, h);
    const shown = match.goalAt(state.t, state.from), since = shown ? state.t - shown.goal[0] : Infinity;
    const [, team, robot, kind] = shown?.goal ?? [];
    if (since < FLASH) {
      c.strokeStyle = colours[team ?? "muted"]; c.lineWidth = w < SMALL ? 4 : 8; c.globalAlpha = 1 - since / FLASH;
      c.strokeRect(c.lineWidth / 2, c.lineWidth / 2, w - c.lineWidth, h - c.lineWidth); c.globalAlpha = 1;
    }
    if (since < FLASH && shown.stopped) { // never over the play that follows
      const title = match.goalTitle(team);
      banner(c, w, h, `${title[0].toUpperCase()}${title.slice(1)}${match.story(team, robot, kind)}`, colours[team ?? "muted"], Math.min(1, 2 * (1 - since / FLASH)), under && under.py);
    } else if (now.i < 0) banner(c, w, h, "nothing recorded here", colours.muted, 0.9, null);
    else if (match.stoppage(state.t)) banner(c, w, h, "play is stopped", colours.muted, 0.75, under && under.py);
  }

  let hatch = null;
  function hatching(c) {
    if (hatch && hatch.colour === colours.dead) return hatch.pattern;
    const tile = document.createElement("canvas");
    tile.width = tile.height = 8;
    const p = tile.getContext("2d");
    p.strokeStyle = colours.dead; p.lineWidth = 1.6;
    p.beginPath(); p.moveTo(-2, 10); p.lineTo(10, -2); p.moveTo(-2, 2); p.lineTo(2, -2); p.moveTo(6, 10); p.lineTo(10, 6); p.stroke();
    hatch = { colour: colours.dead, pattern: c.createPattern(tile, "repeat") };
    return hatch.pattern;
  }

  function marker(c, px, top, bottom, team) {
    c.strokeStyle = c.fillStyle = colours[team ?? "muted"]; c.lineWidth = 2;
    c.beginPath(); c.moveTo(px, top); c.lineTo(px, bottom); c.stroke();
    c.beginPath(); c.arc(px, top + 4, 4.5, 0, 7); c.fill();
  }

  function drawOverview() {
    const { c, w, h } = fitted($("overview"));
    const wide = w - GUTTER - EDGE, px = (t) => GUTTER + (t / (end || 1)) * wide, middle = h / 2 - 1;
    const reach = middle - 5;
    c.fillStyle = colours.muted; c.font = sans(11); c.textAlign = "left"; c.textBaseline = "middle";
    c.fillText("ball, whole match", 14, middle);
    c.fillStyle = hatching(c);
    for (const [a, b] of dead) c.fillRect(px(a), 4, Math.max(1, px(b) - px(a)), h - 10);
    if (ball >= 0) { // the mean place of the ball along the pitch in each pixel, in the colour of the team that attacks there
      let mean = 0, seen = -Infinity;
      for (let column = 0, i = 0; column < wide; column++) {
        const until = ((column + 1) / wide) * end;
        let sum = 0, n = 0;
        for (; i < S && time[i] <= until; i++) {
          if (mask[ball * S + i] & SEEN) { sum += x[ball * S + i] * quantum; n++; seen = time[i]; }
        }
        if (n) mean = sum / n;
        if (until - seen > match.gap && !n) continue;
        const v = clamp(mean / (pitch.length / 2), -1, 1) * (state.turned ? -reach : reach);
        c.fillStyle = colours[mean > 0 ? "home" : "away"]; c.globalAlpha = 0.55;
        c.fillRect(GUTTER + column, v > 0 ? middle - v : middle, 1, Math.max(0.5, Math.abs(v)));
      }
      c.globalAlpha = 1;
    }
    for (const [t, team] of match.goals) marker(c, px(t), 3, h - 4, team);
    c.strokeStyle = colours.ink; c.lineWidth = 1.5; c.globalAlpha = 0.9;
    c.beginPath(); c.roundRect(px(state.view), 1.5, Math.max(3, px(state.view + state.span) - px(state.view)), h - 4, 4); c.stroke();
    c.globalAlpha = 0.07; c.fillStyle = colours.ink; c.fill(); c.globalAlpha = 1;
    c.beginPath(); c.moveTo(px(state.t), 0); c.lineTo(px(state.t), h); c.stroke();
  }

  const rowTop = (n) => AXIS + n * rowHeight + (robots[n].team === "away" && robots[0].team === "home" ? TEAM_GAP : 0);
  const lineHeight = () => (robots.length ? rowTop(robots.length - 1) + rowHeight + 4 : AXIS);

  function drawTimeline() {
    const { c, w, h } = fitted($("timeline"));
    const wide = w - GUTTER - EDGE, from = state.view, to = from + state.span;
    const px = (t) => GUTTER + ((t - from) / state.span) * wide;
    c.save(); c.beginPath(); c.rect(GUTTER, 0, wide, h); c.clip();
    c.fillStyle = hatching(c);
    for (const [a, b] of dead) if (b > from && a < to) c.fillRect(px(a), AXIS, px(b) - px(a), h - AXIS - 2);
    const step = [1, 2, 5, 10, 30, 60, 120, 300, 600].find((s) => (s * 1000 * wide) / state.span > 70) ?? 1200;
    c.font = mono(10.5); c.textAlign = "center"; c.textBaseline = "middle"; c.lineWidth = 1; c.strokeStyle = colours.line;
    for (let t = Math.ceil(from / 1000 / step) * step * 1000; t <= to; t += step * 1000) {
      c.fillStyle = colours.muted; c.fillText(clock(t), clamp(px(t), GUTTER + 18, GUTTER + wide - 18), 10);
      c.beginPath(); c.moveTo(px(t), AXIS - 3); c.lineTo(px(t), h); c.stroke();
    }
    robots.forEach((robot, n) => drawRow(c, robot, rowTop(n), px, from, to));
    if (state.found && !state.found.lit) drawHits(c, px, from, to);
    c.setLineDash([4, 3]); c.strokeStyle = colours.ink; c.lineWidth = 1.2; c.globalAlpha = 0.7;
    for (const [t] of match.restarts) if (t >= from && t <= to) { c.beginPath(); c.moveTo(px(t), AXIS - 4); c.lineTo(px(t), h); c.stroke(); }
    c.setLineDash([]); c.globalAlpha = 1;
    for (const [t, team] of match.goals) if (t >= from && t <= to) marker(c, px(t), AXIS - 8, h, team);
    c.restore();
    robots.forEach((robot, n) => drawGutter(c, robot, rowTop(n)));
    const p = px(state.t);
    if (p >= GUTTER - 1 && p <= GUTTER + wide + 1) {
      c.strokeStyle = c.fillStyle = colours.ink; c.lineWidth = 2;
      c.beginPath(); c.moveTo(p, 8); c.lineTo(p, h); c.stroke();
      c.beginPath(); c.moveTo(p - 6, 3); c.lineTo(p + 6, 3); c.lineTo(p, 12); c.fill();
    }
  }

  function drawRow(c, robot, top, px, from, to) {
    const own = robot.situations;
    c.textAlign = "left"; c.textBaseline = "middle";
    for (let i = Math.max(0, before(own.start, from)); i < own.start.length && own.start[i] < to; i++) {
      const code = table.code[own.index[i]], l = px(own.start[i]), r = px(own.end[i]);
      const current = own.start[i] <= state.t && state.t < own.end[i];
      c.globalAlpha = dimmed(own.index[i]) ? DIMMED : 1;
      c.fillStyle = colours[`family-${family.get(code)}`];
      c.fillRect(l, top + rowEdge, Math.max(0.7, r - l - (r - l > 4 ? 1 : 0)), rowHeight - 2 * rowEdge);
      if (r - l > 24) {
        const name = match.shortName(code);
        c.save(); c.beginPath(); c.rect(l, top, r - l - 3, rowHeight); c.clip();
        c.fillStyle = textOn(colours[`family-${family.get(code)}`]);
        const seen = Math.max(l, GUTTER), middle = top + rowHeight / 2 + 0.5;
        c.font = mono(rowFont, 600); c.fillText(three(code), seen + 3, middle);
        c.font = sans(rowFont + 0.5);
        if (r - seen > 34 + c.measureText(name).width) c.fillText(name, seen + 27, middle);
        c.restore();
      }
      if (current && r - l > 4) { c.strokeStyle = colours.ink; c.lineWidth = 1.5; c.strokeRect(l, top + rowEdge, r - l - 1, rowHeight - 2 * rowEdge); }
      c.globalAlpha = 1;
    }
  }

  /** Passes, shots or goals that are looked for, each on the row of its robot. */
  function drawHits(c, px, from, to) {
    c.fillStyle = colours.ink; c.strokeStyle = colours.halo; c.lineWidth = 1.5;
    for (const { t, body } of state.found.hits) {
      const n = t >= from && t <= to ? robots.findIndex((robot) => robot.body === body) : -1;
      if (n < 0) continue;
      const at = px(t), middle = rowTop(n) + rowHeight / 2, reach = rowHeight / 2 - rowEdge;
      c.beginPath(); c.moveTo(at, middle - reach); c.lineTo(at + reach, middle); c.lineTo(at, middle + reach); c.lineTo(at - reach, middle);
      c.closePath(); c.fill(); c.stroke();
    }
  }

  function drawGutter(c, robot, top) {
    c.fillStyle = colours[robot.team];
    c.beginPath(); c.roundRect(14, top + rowEdge, 22, rowHeight - 2 * rowEdge, 4); c.fill();
    c.fillStyle = colours.halo; c.font = mono(rowFont + 0.5, 600); c.textAlign = "center"; c.textBaseline = "middle";
    c.fillText(robot.id, 25, top + rowHeight / 2 + 0.5);
    c.fillStyle = colours.muted; c.font = sans(rowFont + 1); c.textAlign = "left";
    let name = teams[robot.team];
    while (c.measureText(name).width > GUTTER - 50 && name.length > 1) name = `${name.slice(0, -2).trimEnd()}…`;
    c.fillText(name, 43, top + rowHeight / 2 + 0.5);
  }

  /** Black or white, whichever reads better on the colour `#rrggbb`. */
  function textOn(colour) {
    const [r, g, b] = [1, 3, 5].map((i) => parseInt(colour.slice(i, i + 2), 16));
    return 0.299 * r + 0.587 * g + 0.114 * b > 140 ? "#101512" : "#fff";
  }

  /** The time under a point of a canvas, by its place in the window. */
  function timeAt(canvas, clientX) {
    const box = canvas.getBoundingClientRect();
    const part = (clientX - box.left - GUTTER) / (box.width - GUTTER - EDGE);
    return canvas.id === "overview" ? part * end : state.view + part * state.span;
  }

  /** The robot whose row is under a point of the time line; undefined where there is none. */
  function robotAt(clientX, clientY) {
    const box = $("timeline").getBoundingClientRect(), y = clientY - box.top;
    return clientX - box.left < GUTTER ? undefined : robots.find((_, n) => y >= rowTop(n) && y < rowTop(n) + rowHeight);
  }

  function paint() {
    drawPitch($("pitch")); drawOverview(); drawTimeline();
  }

  return { paint, drawPitch, readColours, timeAt, robotAt, lineHeight };
}
