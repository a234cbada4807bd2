// Shapes on the canvas, in pixels: many of one colour become one path.

/** A view of the map: from metres to pixels of the canvas. */
export class Projection {
  constructor(camera, left, top, width, height) {
    Object.assign(this, { left, top, width, height, scale: camera.scale, isCoarse: camera.isCoarse });
    this.midX = left + width / 2 - camera.x * camera.scale;
    this.midY = top + height / 2 + camera.y * camera.scale;
  }

  x(x) { return this.midX + x * this.scale; }
  y(y) { return this.midY - y * this.scale; }
  mapX(pixel) { return (pixel - this.midX) / this.scale; }
  mapY(pixel) { return (this.midY - pixel) / this.scale; }

  sees(x, y, margin) {
    const px = this.x(x);
    const py = this.y(y);
    const reach = margin * this.scale + 2;
    return px > this.left - reach && px < this.left + this.width + reach && py > this.top - reach && py < this.top + this.height + reach;
  }
}

/** Adds a box to the path: w across, d along the heading. */
export function traceBox(context, view, x, y, w, d, yaw) {
  const cos = (Math.cos(yaw) * view.scale) / 2;
  const sin = (-Math.sin(yaw) * view.scale) / 2;
  const ax = d * cos;
  const ay = d * sin;
  const bx = -w * sin;
  const by = w * cos;
  const px = view.midX + x * view.scale;
  const py = view.midY - y * view.scale;
  context.moveTo(px + ax + bx, py + ay + by);
  context.lineTo(px + ax - bx, py + ay - by);
  context.lineTo(px - ax - bx, py - ay - by);
  context.lineTo(px - ax + bx, py - ay + by);
  // Not closePath, which costs more than all the rest of a box.
  context.lineTo(px + ax + bx, py + ay + by);
}

/** Adds all boxes of a flat list that can be seen, or those of them at the places that `isWanted` says. */
export function traceBoxes(context, view, values, layout, isWanted = () => true) {
  for (let k = 0; k < values.length; k += layout.size) {
    const x = values[k + layout.x];
    const y = values[k + layout.y];
    const w = values[k + layout.w];
    const d = values[k + layout.d];
    if (isWanted(k) && view.sees(x, y, w + d)) traceBox(context, view, x, y, w, d, values[k + layout.yaw]);
  }
}

/** Adds the ellipse of two standard deviations to the path. */
export function traceEllipse(context, view, x, y, xx, xy, yy) {
  const mean = (xx + yy) / 2;
  const spread = Math.hypot((xx - yy) / 2, xy);
  const long = 2 * Math.sqrt(Math.max(0, mean + spread)) * view.scale;
  const short = 2 * Math.sqrt(Math.max(0, mean - spread)) * view.scale;
  if (!(long > 1.5)) return;
  const turn = 0.5 * Math.atan2(2 * xy, xx - yy);
  const px = view.x(x);
  const py = view.y(y);
  context.moveTo(px + long * Math.cos(turn), py - long * Math.sin(turn));
  context.ellipse(px, py, long, short, -turn, 0, 2 * Math.PI);
}

/** Adds a ring sector to the path. */
export function traceSector(context, view, pose, field) {
  const [px, py] = [view.x(pose.x), view.y(pose.y)];
  const outer = field.range_max_m * view.scale;
  const middle = -(pose.yaw + field.azimuth_rad);
  if (field.width_rad >= 2 * Math.PI - 1e-6) {
    context.moveTo(px + outer, py);
    context.arc(px, py, outer, 0, 2 * Math.PI);
    return;
  }
  const inner = field.range_min_m * view.scale;
  const [from, to] = [middle - field.width_rad / 2, middle + field.width_rad / 2];
  context.moveTo(px + outer * Math.cos(from), py + outer * Math.sin(from));
  context.arc(px, py, outer, from, to);
  context.arc(px, py, inner, to, from, true);
  context.closePath();
}

/** Calls `visit` with points along the outer edge of a ring sector. */
export function eachEdgePoint(pose, field, visit) {
  const steps = 16;
  for (let k = 0; k <= steps; k += 1) {
    const turn = pose.yaw + field.azimuth_rad + (k / steps - 0.5) * field.width_rad;
    visit(pose.x + field.range_max_m * Math.cos(turn), pose.y + field.range_max_m * Math.sin(turn));
  }
}

/** The round length of a scale bar of about this many pixels, m. */
export function roundLength(metres) {
  const power = 10 ** Math.floor(Math.log10(metres));
  return [5, 2, 1].find((digit) => digit * power <= metres) * power;
}
