// The bird's-eye view: one picture for each hub that is shown, side by side.

import { LabelSpace, letterOf, shortTrack } from "./labels.js";
import { layers } from "./layers.js";
import { agentColour, palette } from "./palette.js";
import { Projection, roundLength, traceBox, traceBoxes, traceEllipse, traceSector } from "./shapes.js";
import { DETECTION, OBJECT, TRUTH, eachTrailPoint } from "./store.js";

const TRAIL_MS = 6000;
const FLASH_MS = { late: 700, refused: 2500 };
const FRESH_MS = 1000;
const TRUTH_DASH = [6, 2];
/** Beyond this number of objects in sight there are no labels but the selected one's. */
const MOST_LABELS = 150;
const calm = matchMedia("(prefers-reduced-motion: reduce)");

export class Scene {
  #labels = new LabelSpace();

  constructor(canvas, store, camera) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.store = store;
    this.camera = camera;
    this.panes = [];
    this.resize(canvas.clientWidth, canvas.clientHeight);
  }

  /** The canvas has this size on the screen. It is asked for when it changes only: asking makes the browser lay out. */
  resize(width, height) {
    this.ratio = Math.min(devicePixelRatio || 1, 2);
    Object.assign(this, { width, height });
    this.canvas.width = Math.round(width * this.ratio);
    this.canvas.height = Math.round(height * this.ratio);
  }

  /** Draws the moment `time` for these hubs; returns whether something moves by itself. */
  draw(time, hubs, selection) {
    const { context, width, height } = this;
    context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    context.fillStyle = palette.ground;
    context.fillRect(0, 0, width, height);
    const n = Math.max(1, hubs.length);
    const isTall = n > 1 && width < 640;
    this.panes = [];
    this.flashes = false;
    for (let k = 0; k < n; k += 1) {
      const box = isTall ? [0, (k * height) / n, width, height / n] : [(k * width) / n, 0, width / n, height];
      this.#drawPane(new Projection(this.camera, ...box), hubs[k] ?? null, { time, selection, isOneOfMany: n > 1 });
    }
    return this.flashes;
  }

  #drawPane(view, hub, { time, selection, isOneOfMany }) {
    const { context } = this;
    const frame = hub?.frames.at(time) ?? null;
    const agents = this.#agentsAt(time);
    this.panes.push({ view, hub, frame, agents });
    this.#labels.clear();
    context.save();
    context.beginPath();
    context.rect(view.left, view.top, view.width, view.height);
    context.clip();
    context.lineJoin = "round";
    if (layers.grid) this.#drawGrid(view);
    if (layers.roads) this.#drawRoads(view);
    if (layers.views) this.#drawViews(view, agents);
    if (layers.truth && frame?.truth) this.#drawTruth(view, frame.truth);
    if (layers.detections) agents.forEach((each) => this.#drawDetections(view, each));
    if (frame && layers.fused) this.#drawFused(view, hub, frame, time);
    const chosen = frame && selection?.hub === hub.name ? frame.tracks.indexOf(selection.track) : -1;
    if (chosen >= 0) this.#drawSelected(view, frame, chosen);
    this.#drawAgents(view, agents, { hub, selection, time });
    if (frame && layers.labels && layers.fused) this.#drawLabels(view, frame, chosen);
    this.#drawScale(view);
    if (isOneOfMany) this.#drawTitle(view, hub);
    context.restore();
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

  #drawViews(view, agents) {
    const { context } = this;
    for (const { agent, frame } of agents) {
      if (!agent.sensor || !frame.pose) continue;
      context.beginPath();
      traceSector(context, view, frame.pose, agent.sensor.field_of_view);
      context.strokeStyle = context.fillStyle = agentColour(agent.number);
      context.globalAlpha = palette.isDark ? 0.05 : 0.045;
      context.fill();
      context.globalAlpha = 0.4;
      context.lineWidth = 1;
      context.stroke();
      context.globalAlpha = 1;
    }
  }

  #drawTruth(view, truth) {
    const { context } = this;
    context.beginPath();
    traceBoxes(context, view, truth, TRUTH);
    context.strokeStyle = palette.truth;
    context.lineWidth = 2;
    // Dashes tell it from the detections without colour.
    context.setLineDash(TRUTH_DASH);
    context.stroke();
    context.setLineDash([]);
  }

  #drawDetections(view, { agent, frame, isFresh }) {
    const { context } = this;
    context.beginPath();
    traceBoxes(context, view, frame.values, DETECTION);
    context.globalAlpha = isFresh ? 0.75 : 0.25;
    context.strokeStyle = agentColour(agent.number);
    context.lineWidth = 1;
    context.stroke();
    context.globalAlpha = 1;
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
    if (layers.covariance) {
      each((k) => traceEllipse(context, view, values[k + OBJECT.x], values[k + OBJECT.y], values[k + OBJECT.xx], values[k + OBJECT.xy], values[k + OBJECT.yy]));
      context.fillStyle = palette.ours;
      context.globalAlpha = 0.22;
      context.fill();
      context.globalAlpha = 1;
    }
    context.beginPath();
    traceBoxes(context, view, values, OBJECT);
    context.fillStyle = context.strokeStyle = palette.ours;
    context.globalAlpha = 0.25;
    context.fill();
    context.globalAlpha = 1;
    context.lineWidth = 1.8;
    context.stroke();
    // Where the front is: from the middle to it.
    each((k) => {
      const x = values[k + OBJECT.x];
      const y = values[k + OBJECT.y];
      const half = values[k + OBJECT.d] / 2;
      const yaw = values[k + OBJECT.yaw];
      context.moveTo(view.x(x), view.y(y));
      context.lineTo(view.x(x + half * Math.cos(yaw)), view.y(y + half * Math.sin(yaw)));
    });
    context.lineWidth = 1.4;
    context.stroke();
    if (layers.velocity) this.#drawVelocities(view, each, values);
  }

  /** Where each object will be after a second, if it is faster than a slow walk. */
  #drawVelocities(view, each, values) {
    const { context } = this;
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
      context.lineTo(toX - 6 * Math.cos(turn - 0.45), toY - 6 * Math.sin(turn - 0.45));
      context.moveTo(toX, toY);
      context.lineTo(toX - 6 * Math.cos(turn + 0.45), toY - 6 * Math.sin(turn + 0.45));
    });
    context.strokeStyle = palette.ink;
    context.globalAlpha = 0.75;
    context.lineWidth = 1.2;
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
    context.strokeStyle = palette.ours;
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
      context.strokeStyle = agentColour(agent.number);
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

  #drawAgents(view, agents, { hub, selection, time }) {
    const { context, store } = this;
    context.font = "600 12px system-ui, 'DejaVu Sans', sans-serif";
    for (const { agent, frame, isFresh } of agents) {
      if (!frame.pose) continue;
      const [x, y] = [view.x(frame.pose.x), view.y(frame.pose.y)];
      const colour = agentColour(agent.number);
      context.fillStyle = colour;
      context.globalAlpha = isFresh ? 1 : 0.45;
      traceArrow(context, x, y, frame.pose.yaw);
      context.fill();
      context.strokeStyle = palette.panel;
      context.lineWidth = 1.5;
      context.stroke();
      if (selection?.agent === agent.name) {
        context.beginPath();
        context.arc(x, y, 15, 0, 2 * Math.PI);
        context.strokeStyle = palette.ink;
        context.stroke();
      }
      const delay = agent.delay.recent(time);
      const text = `${agent.name}${Number.isFinite(delay) ? `  ${Math.round(delay)} ms` : ""}`;
      this.#name(text, x, y, colour);
      context.globalAlpha = 1;
    }
    // Names take their room before flashes do.
    for (const { agent, frame } of agents) {
      if (!frame.pose) continue;
      const [x, y] = [view.x(frame.pose.x), view.y(frame.pose.y)];
      const events = store.events.filter((event) => event.agent === agent.name && event.hub === hub?.name && time >= event.at && time - event.at < FLASH_MS[event.level]);
      this.#drawFlashes(x, y, events, time);
    }
  }

  /** The newest late or refused frame of an agent, with the reason. */
  #drawFlashes(x, y, events, time) {
    const event = events.findLast((each) => each.level === "refused") ?? events.at(-1);
    if (!event) return;
    this.flashes = true;
    const { context } = this;
    const share = (time - event.at) / FLASH_MS[event.level];
    context.globalAlpha = (1 - share) * (event.level === "late" ? 0.8 : 1);
    context.strokeStyle = event.level === "refused" ? palette.bad : palette.warn;
    context.lineWidth = event.level === "refused" ? 3 : 1.5;
    context.beginPath();
    context.arc(x, y, calm.matches ? 16 : 12 + 14 * share, 0, 2 * Math.PI);
    context.stroke();
    this.#text(event.level === "refused" ? `refused: ${event.text}` : event.text, x + 13, y + 17, context.strokeStyle);
    context.globalAlpha = 1;
  }

  /** A name beside a place, where there is room. */
  #name(text, x, y, colour) {
    const left = x - 13 - this.context.measureText(text).width;
    const places = [[x + 13, y - 11], [x + 13, y + 17], [left, y - 11], [left, y + 17], [x + 13, y + 4], [left, y + 4]];
    places.some((place) => this.#text(text, ...place, colour));
  }

  #text(text, x, y, colour) {
    const { context } = this;
    const width = context.measureText(text).width;
    if (!this.#labels.take(x, y - 10, width, 12)) return false;
    context.lineWidth = 3;
    context.strokeStyle = palette.ground;
    context.strokeText(text, x, y);
    context.fillStyle = colour;
    context.fillText(text, x, y);
    return true;
  }

  #drawLabels(view, frame, chosen) {
    const { context, store } = this;
    const { values } = frame;
    context.font = "11px system-ui, 'DejaVu Sans', sans-serif";
    const write = (k) => {
      const at = k * OBJECT.size;
      const reach = Math.max(values[at + OBJECT.w], values[at + OBJECT.d]) / 2;
      const { letter } = letterOf(store.hello?.classes[values[at + OBJECT.class]]);
      this.#text(`${letter}${shortTrack(frame.tracks[k])}`, view.x(values[at + OBJECT.x]) + Math.min(reach * view.scale, 14) + 3,
        view.y(values[at + OBJECT.y]) - 4, k === chosen ? palette.ink : palette.ours);
    };
    if (chosen >= 0) write(chosen);
    if (view.scale < 1.5) return;
    const seen = [];
    for (let k = 0; k < frame.n; k += 1) {
      if (k !== chosen && view.sees(values[k * OBJECT.size + OBJECT.x], values[k * OBJECT.size + OBJECT.y], 0)) seen.push(k);
    }
    if (seen.length <= MOST_LABELS) seen.forEach(write);
  }

  #drawScale(view) {
    const { context } = this;
    const metres = roundLength(110 / view.scale);
    const [x, y, length] = [view.left + 14, view.top + view.height - 14, metres * view.scale];
    context.beginPath();
    context.moveTo(x, y - 5);
    context.lineTo(x, y);
    context.lineTo(x + length, y);
    context.lineTo(x + length, y - 5);
    context.strokeStyle = palette.muted;
    context.lineWidth = 1.5;
    context.stroke();
    context.font = "11px system-ui, 'DejaVu Sans', sans-serif";
    context.fillStyle = palette.muted;
    context.fillText(metres >= 1000 ? `${metres / 1000} km` : `${metres} m`, x + 5, y - 5);
  }

  #drawTitle(view, hub) {
    const { context } = this;
    context.font = "600 13px system-ui, 'DejaVu Sans', sans-serif";
    const error = hub.error.recent(this.store.now());
    const isSecond = view.left > 0 || view.top > 0;
    const text = `${hub.name}${Number.isFinite(error) ? `  ·  error ${error.toFixed(2)} m` : ""}${isSecond ? "  ·  dashed in the charts" : ""}`;
    this.#text(text, view.left + 14, view.top + 24, palette.ours);
    context.fillStyle = palette.line;
    if (view.left > 0) context.fillRect(view.left, view.top, 1, view.height);
    if (view.top > 0) context.fillRect(view.left, view.top, view.width, 1);
  }
}

function traceArrow(context, x, y, yaw) {
  const [cos, sin] = [Math.cos(yaw), -Math.sin(yaw)];
  const point = (along, across) => context.lineTo(x + along * cos - across * sin, y + along * sin + across * cos);
  context.beginPath();
  point(10, 0);
  point(-7, 6.5);
  point(-4, 0);
  point(-7, -6.5);
  context.closePath();
}

/** Each measurement of an object: whose it is, and where it lies if its frame is still known. */
export function contributorsOf(store, frame, k) {
  const { frames, starts, items } = frame.contributors;
  const found = [];
  for (let at = starts[k]; at < starts[k + 1]; at += 2) {
    const [place, sequence] = frames[items[at]];
    const agent = store.agent(frame.names[place]);
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
