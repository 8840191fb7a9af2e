// Mouse and fingers on a time line: a drag seeks, two fingers zoom and move, a finger that goes up or down scrolls the page.

const SLOP = 6; // pixels that a finger may move and still taps

/**
 * @param at.seek seek to the time under an x; at.zoom(x, before, factor): the time under `before` goes under `x`,
 *   and the time that is shown is `factor` times as long; at.dragging(on); at.hover(event)
 */
function pointers(canvas, at) {
  const down = new Map(); // pointer to its place and whether it drags
  const pair = () => {
    const [a, b] = [...down.values()];
    return { middle: (a.x + b.x) / 2, apart: Math.max(20, Math.abs(a.x - b.x)) };
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    const drags = event.pointerType !== "touch";
    down.set(event.pointerId, { x: event.clientX, from: event.clientX, drags });
    at.dragging(drags || down.size > 1);
    if (drags) at.seek(event.clientX);
  });
  canvas.addEventListener("pointermove", (event) => {
    const own = down.get(event.pointerId);
    if (!own) { at.hover(event); return; }
    if (down.size === 2) {
      const before = pair();
      own.x = event.clientX; own.drags = true;
      const now = pair();
      at.zoom(now.middle, before.middle, before.apart / now.apart);
      for (const each of down.values()) each.pinched = true;
      return;
    }
    own.x = event.clientX;
    own.drags ||= Math.abs(own.x - own.from) > SLOP;
    if (own.drags && !own.pinched) { at.dragging(true); at.seek(own.x); }
  });
  canvas.addEventListener("pointerup", (event) => {
    const own = down.get(event.pointerId);
    if (own && !own.drags && !own.pinched) at.seek(event.clientX);
  });
  for (const name of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(name, (event) => { down.delete(event.pointerId); if (!down.size) at.dragging(false); });
  }
}
