// The bird's-eye view: one picture for each hub that is shown, side by side.

import { drawDetections, drawMarks, drawViews } from "./agents.js";
import { groups, tints } from "./classes.js";
import { hubStyle } from "./hubs.js";
import { BOLD, FONT, Labels, shortTrack, shortened } from "./labels.js";
import { layers } from "./layers.js";
import { markOf } from "./marks.js";
import { palette } from "./palette.js";
import { Projection, roundLength, traceBox, traceBoxes, traceEllipse } from "./shapes.js";
import { DETECTION, OBJECT, TRUTH, eachTrailPoint } from "./store.js";

const TRAIL_MS = 6000;
const FRESH_MS = 1000;
/** Truth is dashed, whatever the scale: that tells it from detections without colour. */
const TRUTH_DASH = [6, 2];
const COARSE_DASH = [3, 1.5];
/** Width and height of the corners with the buttons, which are beside each other in a narrow picture, and with what was skipped. */
const ZOOM_PIXELS = [60, 150];
const NARROW_ZOOM_PIXELS = [140, 54];
const NARROW = 560;
const SKIPPED_PIXELS = [130, 36];
/** The height of the strip above each of several pictures that says whose it is. */
const TITLE = 26;
/** Room below everything for the scale, and for the buttons in a narrow picture, where all is fitted into the picture. */
const SCALE_HEIGHT = 30;
/** An agent that is an object of the list itself lies so near to it, m. */
const SAME_M = 2.5;
/** Letters without numbers, and lines in boxes, are of no use where objects are so small: fewer pixels a metre. */
const LEAST_FOR_FINE = 2.5;
/** Letters of a hub's name above its picture. */
const MOST_LETTERS = 14;
/** Beyond this number of objects in sight there are no labels but the selected one's. */
const MOST_LABELS = 150;

export class Scene {
  constructor(canvas, store, camera) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.labels = new Labels(this.context);
    this.store = store;
    this.camera = camera;
    this.panes = [];
    /** Whether pictures of several hubs are below each other. */
    this.isStacked = false;
    this.resize(canvas.clientWidth, canvas.clientHeight);
  }

  /** The canvas has this size on the screen. It is asked for when it changes only: asking makes the browser lay out. */
  resize(width, height) {
    this.ratio = Math.min(devicePixelRatio || 1, 2);
    Object.assign(this, { width, height });
    this.canvas.width = Math.round(width * this.ratio);
    this.canvas.height = Math.round(height * this.ratio);
  }

  /** Draws the moment `time` for these hubs, with the figures of `figuresAt`; returns whether something moves by itself. */
  draw(time, hubs, { selection, highlighted, figuresAt }) {
    const { context, width, height } = this;
    context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    context.fillStyle = palette.ground;
    context.fillRect(0, 0, width, height);
    const n = Math.max(1, hubs.length);
    const [paneWidth, paneHeight] = this.#paneSize(n, this.isStacked);
    const title = n > 1 ? TITLE : 0;
    this.panes = [];
    this.moves = false;
    for (let k = 0; k < n; k += 1) {
      const [left, top] = this.isStacked ? [0, (k * height) / n] : [(k * width) / n, 0];
      const view = new Projection(this.camera, left, top + title, paneWidth, paneHeight);
      view.colour = hubStyle(k).colour;
      this.#drawPane(view, hubs[k] ?? null, { time, figuresAt, selection, highlighted, isOneOfMany: n > 1 });
    }
    return this.moves;
  }

  /** The width and height of each of so many pictures, pixels. */
  #paneSize(n, isStacked) {
    const { width, height } = this;
    const title = n > 1 ? TITLE : 0;
    return isStacked ? [width, height / n - title] : [width / n, height - title];
  }

  /** So many pictures are beside or below each other, as shows bounds larger. */
  arrange(bounds, n) {
    if (n < 2 || !bounds) return;
    const scaleOf = (isStacked) => {
      const [width, height] = this.#paneSize(n, isStacked);
      return Math.min(width / (bounds.right - bounds.left), (height - this.#below) / (bounds.top - bounds.bottom));
    };
    // What is only a little better does not turn the page over.
    if (scaleOf(!this.isStacked) > 1.1 * scaleOf(this.isStacked)) this.isStacked = !this.isStacked;
  }

  /** Fits bounds into each of so many pictures. */
  fit(bounds, n) {
    this.arrange(bounds, n);
    this.camera.fit(bounds, ...this.#paneSize(n, this.isStacked), this.#below);
  }

  get #below() { return this.width <= NARROW ? NARROW_ZOOM_PIXELS[1] : SCALE_HEIGHT; }

  #drawPane(view, hub, { time, figuresAt, selection, highlighted, isOneOfMany }) {
    const { context, labels } = this;
    const frame = hub?.frames.at(time) ?? null;
    const agents = this.#agentsAt(time);
    labels.clear(view);
    this.panes.push({ view, hub, frame, agents, labels: labels.placed });
    this.#reservePlates(view);
    if (frame) this.#avoidObjects(view, frame);
    context.save();
    context.beginPath();
    context.rect(view.left, view.top, view.width, view.height);
    context.clip();
    context.lineJoin = "round";
    if (layers.grid) this.#drawGrid(view);
    if (layers.roads) this.#drawRoads(view);
    if (layers.views) drawViews(context, view, agents, highlighted);
    if (layers.truth && frame?.truth) this.#drawTruth(view, frame.truth);
    if (layers.detections) agents.forEach((each) => drawDetections(context, view, each, highlighted));
    if (frame && layers.fused) this.#drawFused(view, hub, frame, time);
    const chosen = frame && selection?.hub === hub.name ? frame.tracks.indexOf(selection.track) : -1;
    if (chosen >= 0) this.#drawSelected(view, frame, chosen);
    const events = this.store.events.filter((event) => event.hub === hub?.name);
    if (frame && layers.fused) markFused(agents, frame);
    if (drawMarks(context, view, agents, { labels, highlighted, time, figuresAt, events })) this.moves = true;
    if (frame && layers.labels && layers.fused) this.#drawLabels(view, hub, frame, chosen);
    // All pictures have one scale.
    if (this.#isLowerLeft(view)) this.#drawScale(view);
    context.restore();
    if (isOneOfMany) this.#drawTitle(view, hub, figuresAt);
  }

  #isLowerLeft({ left, top, height }) {
    return left === 0 && top + height >= this.height - 1;
  }

  /** No label lies under what stands on the map: scale, buttons, and what was skipped. */
  #reservePlates(view) {
    const { labels } = this;
    const [right, bottom] = [view.left + view.width, view.top + view.height];
    if (this.#isLowerLeft(view)) labels.reserve(view.left + 10, bottom - 38, 130, 28);
    if (right < this.width - 1) return;
    const isNarrow = this.width <= NARROW;
    if (isNarrow && bottom >= this.height - 1) labels.reserve(right - NARROW_ZOOM_PIXELS[0], bottom - NARROW_ZOOM_PIXELS[1], ...NARROW_ZOOM_PIXELS);
    if (!isNarrow && view.top <= TITLE) labels.reserve(right - ZOOM_PIXELS[0], view.top, ...ZOOM_PIXELS);
    if (this.store.skipped && bottom >= this.height - 1) labels.reserve(right - SKIPPED_PIXELS[0], bottom - SKIPPED_PIXELS[1], ...SKIPPED_PIXELS);
  }

  /** No label lies over an object, fused or true. */
  #avoidObjects(view, frame) {
    const { labels } = this;
    const avoid = (values, layout, isLabelled) => {
      for (let k = 0; k < values.length; k += layout.size) {
        if (!view.sees(values[k + layout.x], values[k + layout.y], 0)) continue;
        const [across, up] = reachOf(view, values, k, layout);
        labels.avoid(view.x(values[k + layout.x]) - across, view.y(values[k + layout.y]) - up, 2 * across, 2 * up, isLabelled);
      }
    };
    if (layers.fused) avoid(frame.values, OBJECT, true);
    if (layers.truth && frame.truth) avoid(frame.truth, TRUTH, false);
  }

  /** The agents that have sent something, with the newest frame at that time. */
  #agentsAt(time) {
    const found = [];
    for (const agent of this.store.agents.values()) {
      const frame = agent.frames.at(time);
      if (frame && time - frame.received < 10_000) found.push({ agent, frame, isFresh: time - frame.received < FRESH_MS });
    }
    return found;
  }

  #drawGrid(view) {
    const { context } = this;
    const step = roundLength(120 / view.scale);
    context.beginPath();
    for (let x = Math.ceil(view.mapX(view.left) / step) * step; view.x(x) < view.left + view.width; x += step) {
      const pixel = Math.round(view.x(x)) + 0.5;
      context.moveTo(pixel, view.top);
      context.lineTo(pixel, view.top + view.height);
    }
    for (let y = Math.ceil(view.mapY(view.top + view.height) / step) * step; view.y(y) > view.top; y += step) {
      const pixel = Math.round(view.y(y)) + 0.5;
      context.moveTo(view.left, pixel);
      context.lineTo(view.left + view.width, pixel);
    }
    context.strokeStyle = palette.grid;
    context.lineWidth = 1;
    context.stroke();
  }

  #drawRoads(view) {
    const { context, store } = this;
    const origin = store.origin ?? { x: 0, y: 0 };
    const trace = (points) => {
      context.beginPath();
      for (let k = 0; k < points.length; k += 2) context.lineTo(view.x(points[k] - origin.x), view.y(points[k + 1] - origin.y));
    };
    context.lineCap = "butt";
    for (const road of store.hello?.roads ?? []) {
      if (road.kind === "area") {
        trace(road.points);
        context.fillStyle = palette.road;
        context.fill();
        continue;
      }
      const isSurface = road.kind === "surface";
      context.lineWidth = Math.max(isSurface ? 2 : 1, road.width_m * view.scale);
      context.strokeStyle = isSurface ? palette.road : palette.marking;
      context.setLineDash(road.kind === "marking" ? [3 * view.scale, 4 * view.scale] : []);
      if (isSurface || view.scale > 1.2) {
        trace(road.points);
        context.stroke();
      }
    }
    context.setLineDash([]);
  }

  #drawTruth(view, truth) {
    const { context } = this;
    context.beginPath();
    traceBoxes(context, view, truth, TRUTH);
    context.strokeStyle = palette.truth;
    context.lineWidth = view.isCoarse ? 1.6 : 2;
    context.setLineDash(view.isCoarse ? COARSE_DASH : TRUTH_DASH);
    context.stroke();
    context.setLineDash([]);
  }

  #drawFused(view, hub, frame, time) {
    const { context } = this;
    const { values } = frame;
    if (layers.trails) this.#drawTrails(view, hub, frame, time);
    const each = (draw) => {
      context.beginPath();
      for (let k = 0; k < values.length; k += OBJECT.size) {
        if (view.sees(values[k + OBJECT.x], values[k + OBJECT.y], 20)) draw(k);
      }
    };
    if (layers.covariance && !view.isCoarse) {
      each((k) => traceEllipse(context, view, values[k + OBJECT.x], values[k + OBJECT.y], values[k + OBJECT.xx], values[k + OBJECT.xy], values[k + OBJECT.yy]));
      context.fillStyle = view.colour;
      context.globalAlpha = 0.22;
      context.fill();
      context.globalAlpha = 1;
    }
    this.#fillByClass(view, values);
    context.beginPath();
    traceBoxes(context, view, values, OBJECT);
    context.strokeStyle = view.colour;
    context.lineWidth = view.isCoarse ? 1.2 : 1.8;
    context.stroke();
    // Where the front is: from the middle to it. From far away a box has no room for a line.
    if (view.scale >= LEAST_FOR_FINE) each((k) => {
      const x = values[k + OBJECT.x];
      const y = values[k + OBJECT.y];
      const half = values[k + OBJECT.d] / 2;
      const yaw = values[k + OBJECT.yaw];
      context.moveTo(view.x(x), view.y(y));
      context.lineTo(view.x(x + half * Math.cos(yaw)), view.y(y + half * Math.sin(yaw)));
    });
    context.lineWidth = view.isCoarse ? 0.9 : 1.4;
    context.stroke();
    if (layers.velocity) this.#drawVelocities(view, each, values);
  }

  /** All boxes of a colour are one path. */
  #fillByClass(view, values) {
    const { context, store } = this;
    context.globalAlpha = layers.classes ? palette.tintOpacity : 0.25;
    for (const colour of layers.classes ? tints : [view.colour]) {
      context.beginPath();
      traceBoxes(context, view, values, OBJECT, (k) => !layers.classes || groups[store.groups[values[k + OBJECT.class]]]?.colour === colour);
      context.fillStyle = colour;
      context.fill();
    }
    context.globalAlpha = 1;
  }

  /** Where each object will be after a second, if it is faster than a slow walk. */
  #drawVelocities(view, each, values) {
    const { context } = this;
    // Far away a head would be larger than a pedestrian.
    const head = view.isCoarse ? 3.2 : 6;
    each((k) => {
      const vx = values[k + OBJECT.vx];
      const vy = values[k + OBJECT.vy];
      if (vx * vx + vy * vy < 0.25) return;
      const fromX = view.x(values[k + OBJECT.x]);
      const fromY = view.y(values[k + OBJECT.y]);
      const toX = view.x(values[k + OBJECT.x] + vx);
      const toY = view.y(values[k + OBJECT.y] + vy);
      const turn = Math.atan2(toY - fromY, toX - fromX);
      context.moveTo(fromX, fromY);
      context.lineTo(toX, toY);
      context.lineTo(toX - head * Math.cos(turn - 0.45), toY - head * Math.sin(turn - 0.45));
      context.moveTo(toX, toY);
      context.lineTo(toX - head * Math.cos(turn + 0.45), toY - head * Math.sin(turn + 0.45));
    });
    context.strokeStyle = palette.ink;
    context.globalAlpha = 0.75;
    context.lineWidth = view.isCoarse ? 0.9 : 1.2;
    context.stroke();
    context.globalAlpha = 1;
  }

  #drawTrails(view, hub, frame, time) {
    const { context } = this;
    context.beginPath();
    for (let k = 0; k < frame.n; k += 1) {
      const trail = hub.trails.get(frame.tracks[k]);
      const at = k * OBJECT.size;
      const speed = Math.hypot(frame.values[at + OBJECT.vx], frame.values[at + OBJECT.vy]);
      if (!trail || speed < 0.3 || !view.sees(frame.values[at + OBJECT.x], frame.values[at + OBJECT.y], 120)) continue;
      context.moveTo(view.x(frame.values[at + OBJECT.x]), view.y(frame.values[at + OBJECT.y]));
      eachTrailPoint(trail, time - TRAIL_MS, time, (x, y) => context.lineTo(view.x(x), view.y(y)));
    }
    context.strokeStyle = view.colour;
    context.globalAlpha = 0.4;
    context.lineWidth = 2;
    context.stroke();
    context.globalAlpha = 1;
  }

  #drawSelected(view, frame, chosen) {
    const { context } = this;
    const at = chosen * OBJECT.size;
    const { values } = frame;
    const [x, y, w, d, yaw] = [values[at + OBJECT.x], values[at + OBJECT.y], values[at + OBJECT.w], values[at + OBJECT.d], values[at + OBJECT.yaw]];
    for (const { agent, detection, pose } of contributorsOf(this.store, frame, chosen)) {
      if (!detection) continue;
      context.strokeStyle = markOf(agent).colour;
      context.lineWidth = 2.5;
      context.beginPath();
      traceBox(context, view, detection.x, detection.y, detection.w, detection.d, detection.yaw);
      context.stroke();
      context.lineWidth = 1.2;
      context.setLineDash([5, 4]);
      context.beginPath();
      context.moveTo(view.x(x), view.y(y));
      context.lineTo(view.x(detection.x), view.y(detection.y));
      if (pose) context.lineTo(view.x(pose.x), view.y(pose.y));
      context.stroke();
      context.setLineDash([]);
    }
    context.beginPath();
    traceBox(context, view, x, y, w + 9 / view.scale, d + 9 / view.scale, yaw);
    context.strokeStyle = palette.ink;
    context.lineWidth = 1.5;
    context.stroke();
  }

  #drawLabels(view, hub, frame, chosen) {
    const { store } = this;
    const { values } = frame;
    this.labels.use(FONT);
    const write = (k) => {
      const at = k * OBJECT.size;
      const letter = groups[store.groups[values[at + OBJECT.class]]]?.letter ?? "U";
      this.labels.writeAround(`${hub.name} ${frame.tracks[k]}`, hub.keepsTracks ? letter + shortTrack(frame.tracks[k]) : letter,
        [view.x(values[at + OBJECT.x]), view.y(values[at + OBJECT.y])], reachOf(view, values, at, OBJECT), k === chosen ? palette.ink : view.colour);
    };
    if (chosen >= 0) write(chosen);
    if (view.scale < (hub.keepsTracks ? 1.5 : LEAST_FOR_FINE)) return;
    const seen = [];
    for (let k = 0; k < frame.n; k += 1) {
      if (k !== chosen && view.sees(values[k * OBJECT.size + OBJECT.x], values[k * OBJECT.size + OBJECT.y], 0)) seen.push(k);
    }
    if (seen.length > MOST_LABELS) return;
    // What moves is looked at first, and takes the better places.
    const isMoving = (k) => Math.hypot(values[k * OBJECT.size + OBJECT.vx], values[k * OBJECT.size + OBJECT.vy]) > 0.5;
    for (const moves of [true, false]) for (const k of seen) if (isMoving(k) === moves) write(k);
  }

  #drawScale(view) {
    const { context } = this;
    const metres = roundLength(110 / view.scale);
    const text = metres >= 1000 ? `${metres / 1000}\u00a0km` : `${metres}\u00a0m`;
    const [x, y, length] = [view.left + 18, view.top + view.height - 18, metres * view.scale];
    this.labels.use(FONT);
    context.beginPath();
    context.moveTo(x, y - 5);
    context.lineTo(x, y);
    context.lineTo(x + length, y);
    context.lineTo(x + length, y - 5);
    // No plate: an object under it is seen.
    context.strokeStyle = palette.ground;
    context.lineWidth = 4;
    context.stroke();
    context.strokeText(text, x + 5, y - 5);
    context.strokeStyle = context.fillStyle = palette.ink;
    context.lineWidth = 1.5;
    context.stroke();
    context.fillText(text, x + 5, y - 5);
  }

  /** A strip that says whose picture is below it, with a box of the hub's colour. */
  #drawTitle({ left, top, width, colour }, hub, figuresAt) {
    const { context } = this;
    const error = hub.error.recent(figuresAt);
    const parts = [shortened(hub.name, MOST_LETTERS), ...(this.store.isGone(hub.name) ? ["gone"] : []), ...(hub.keepsTracks ? [] : ["no tracks"])];
    const short = parts.join("  ·  ");
    const whole = Number.isFinite(error) ? `${short}  ·  error ${error.toFixed(2)}\u00a0m` : short;
    this.labels.use(BOLD);
    // The page's first line has the error, too.
    const text = this.labels.width(whole) < width - 44 ? whole : short;
    const y = top - TITLE;
    context.fillStyle = palette.panel;
    context.fillRect(left, y, width, TITLE);
    context.fillStyle = palette.line;
    context.fillRect(left, top - 1, width, 1);
    if (left > 0) context.fillRect(left, y, 1, this.height);
    if (y > 0) context.fillRect(left, y, width, 1);
    context.strokeStyle = colour;
    context.lineWidth = 2;
    context.strokeRect(left + 12, y + 8, 18, 9);
    context.fillStyle = palette.ink;
    context.fillText(text, left + 38, y + 17, width - 44);
  }
}

/** Notes at each vehicle whether it is an object of the list itself: its mark hides that. */
function markFused(agents, { values }) {
  for (const each of agents) {
    const pose = each.agent.sensor?.kind === "vehicle" ? each.frame.pose : null;
    for (let k = 0; pose && !each.isFused && k < values.length; k += OBJECT.size) {
      each.isFused = Math.hypot(values[k + OBJECT.x] - pose.x, values[k + OBJECT.y] - pose.y) < SAME_M;
    }
  }
}

/** How far the box at a place reaches to the side and up, however it is turned, pixels. */
function reachOf(view, values, at, layout) {
  const [w, d] = [(values[at + layout.w] * view.scale) / 2, (values[at + layout.d] * view.scale) / 2];
  const [cos, sin] = [Math.abs(Math.cos(values[at + layout.yaw])), Math.abs(Math.sin(values[at + layout.yaw]))];
  return [d * cos + w * sin, d * sin + w * cos];
}

/** Each measurement of an object: whose it is, and where it lies if its frame is still known. */
export function contributorsOf(store, frame, k) {
  const { frames, starts, items } = frame.contributors;
  const found = [];
  for (let at = starts[k]; at < starts[k + 1]; at += 2) {
    const [place, sequence] = frames[items[at]];
    const agent = store.agents.get(frame.names[place]);
    if (!agent) continue;
    const source = agent.frames.find((each) => each.sequence === sequence, 200, frame.received);
    const from = items[at + 1] * DETECTION.size;
    const values = source?.values;
    const detection = values && from < values.length ? {
      x: values[from + DETECTION.x], y: values[from + DETECTION.y], w: values[from + DETECTION.w],
      d: values[from + DETECTION.d], yaw: values[from + DETECTION.yaw], class: values[from + DETECTION.class],
    } : null;
    found.push({ agent, sequence, detection, pose: source?.pose ?? null, delay: source ? source.received - source.captured : null, captured: source?.captured ?? null });
  }
  return found;
}
