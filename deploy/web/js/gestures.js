// Pointer and wheel on the canvas: drag, zoom, pinch, click, and where the mouse rests.

const CLICK_PIXELS = 5;

export function listen(canvas, camera, { onChange, onClick, onMove, onPoint }) {
  const pointers = new Map();
  let travelled = 0;

  const middle = () => {
    const all = [...pointers.values()];
    const x = all.reduce((sum, each) => sum + each.x, 0) / all.length;
    const y = all.reduce((sum, each) => sum + each.y, 0) / all.length;
    const spread = all.length > 1 ? Math.hypot(all[0].x - all[1].x, all[0].y - all[1].y) : 0;
    return { x, y, spread };
  };
  const fromMiddle = (x, y) => [x - canvas.clientWidth / 2, y - canvas.clientHeight / 2];

  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, { x: event.offsetX, y: event.offsetY });
    if (pointers.size === 1) travelled = 0;
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!pointers.has(event.pointerId)) {
      if (event.pointerType === "mouse") onPoint(event.offsetX, event.offsetY);
      return;
    }
    const before = middle();
    pointers.set(event.pointerId, { x: event.offsetX, y: event.offsetY });
    const after = middle();
    travelled += Math.hypot(after.x - before.x, after.y - before.y) + Math.abs(after.spread - before.spread);
    if (travelled < CLICK_PIXELS) return;
    camera.pan(after.x - before.x, after.y - before.y);
    if (before.spread > 0 && after.spread > 0) camera.zoom(after.spread / before.spread, ...fromMiddle(after.x, after.y));
    onMove();
    onChange();
  });
  const lift = (event) => {
    const was = pointers.delete(event.pointerId);
    if (was && event.type === "pointerup" && pointers.size === 0 && travelled < CLICK_PIXELS) onClick(event.offsetX, event.offsetY);
  };
  canvas.addEventListener("pointerup", lift);
  canvas.addEventListener("pointercancel", lift);
  canvas.addEventListener("pointerleave", () => onPoint(NaN, NaN));
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    const pixels = event.deltaMode === 1 ? event.deltaY * 24 : event.deltaY;
    camera.zoom(Math.exp(-pixels * (event.ctrlKey ? 0.01 : 0.0016)), ...fromMiddle(event.offsetX, event.offsetY));
    onChange();
  }, { passive: false });
}
