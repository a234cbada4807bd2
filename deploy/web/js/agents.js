// Agents on the map: fields of view, detections, marks, and what became of their newest frames.

import { BOLD, PLATE, drawPlate, shortened } from "./labels.js";
import { drawMark, markOf } from "./marks.js";
import { palette } from "./palette.js";
import { traceBoxes, traceSector } from "./shapes.js";
import { DETECTION } from "./store.js";

/** How long a ring is seen: that of a frame out of order, which is used all the same, fades; that of a refused one stands. */
const RING_MS = { late: 700, refused: 2500 };
/** Where no motion is wanted no ring fades, and it stands for so long, so that frequent events do not make it flicker. */
const CALM_MS = 5000;
const MARK_PIXELS = 8.5;
/** From so many pixels a metre on a mark is as large as that; farther away it is smaller, down to a share. */
const MARK_SCALE = 6;
const LEAST_MARK = 0.75;
const RINGS = [15, 19];
/** Where many are refused for one reason, which the page's first line says, the map keeps to what it is for: one thin ring each. */
const RING_OF_MANY = 12;
/** More agents than so many at once are many: their reasons stand on the map only where they differ, and there is room. */
const MOST_IN_FULL = 3;
/** From the left edge of a plate to its text. */
const PLATE_TEXT = 20;
/** A plate with the name of an agent: its height, and the letters of a name that are shown. */
const NAME_HEIGHT = 17;
const MOST_LETTERS = 16;
/** Where more agents than so many are in sight, only the one that stands out is named. */
const MOST_NAMES = 60;
/** In a narrower picture a reason has no “refused” before it: the cross says it. */
const NARROW_FOR_REASONS = 500;
/** Link delays are left out of a picture that is so narrow for its agents, pixels for each. */
const NARROW = 60;
/** Share of an area's colour that all fields of view together may have. */
const VEIL = 0.09;
const calm = matchMedia("(prefers-reduced-motion: reduce)");

/** The edges of all fields of view; filled is the one of the agent that is pointed at, and few at once. */
export function drawViews(context, view, agents, highlighted) {
  const seen = agents.filter(({ agent, frame }) => agent.sensor && frame.pose);
  for (const { agent, frame } of seen) {
    const isHighlighted = agent.name === highlighted;
    context.beginPath();
    traceSector(context, view, frame.pose, agent.sensor.field_of_view);
    const { colour, dash } = markOf(agent);
    context.strokeStyle = context.fillStyle = colour;
    context.globalAlpha = isHighlighted ? 0.12 : seen.length > 4 ? 0 : Math.min(0.05, VEIL / seen.length);
    if (context.globalAlpha > 0) context.fill();
    context.globalAlpha = isHighlighted ? 1 : highlighted ? 0.3 : 0.55;
    context.lineWidth = isHighlighted ? 2 : 1;
    context.setLineDash(dash);
    context.stroke();
  }
  context.setLineDash([]);
  context.globalAlpha = 1;
}

export function drawDetections(context, view, { agent, frame, isFresh }, highlighted) {
  const { colour, dash } = markOf(agent);
  context.beginPath();
  traceBoxes(context, view, frame.values, DETECTION);
  context.globalAlpha = !isFresh || (highlighted && highlighted !== agent.name) ? 0.25 : 1;
  context.strokeStyle = colour;
  context.lineWidth = highlighted === agent.name ? 2 : view.isCoarse ? 0.9 : 1.25;
  context.setLineDash(dash);
  context.stroke();
  context.setLineDash([]);
  context.globalAlpha = 1;
}

/** Marks and names of all agents, with what became of their newest frames; returns whether something moves by itself. */
export function drawMarks(context, view, agents, { labels, highlighted, time, figuresAt, events }) {
  const placed = agents.filter(({ frame }) => frame.pose && view.sees(frame.pose.x, frame.pose.y, 0))
    .map((each) => ({ ...each, x: view.x(each.frame.pose.x), y: view.y(each.frame.pose.y), event: newestEvent(events, each.agent, time) }));
  // No label lies under a mark.
  for (const { x, y } of placed) labels.reserve(x - 11, y - 11, 22, 22);
  const refused = placed.filter(({ event }) => event?.level === "refused");
  const nRefused = refused.length;
  const areManyForOne = nRefused > MOST_IN_FULL && new Set(refused.map(({ event }) => event.text.replace(/ ×\d+$/, ""))).size === 1;
  const hasDelays = view.width > NARROW * placed.length;
  // Reasons of refusals are looked at first.
  placed.sort((one, other) => (other.event?.level === "refused") - (one.event?.level === "refused"));
  const name = (each) => {
    if (placed.length <= MOST_NAMES || each.agent.name === highlighted) each.name = nameOf(labels, view, each, hasDelays ? figuresAt : NaN);
  };
  const say = (each) => { if (!areManyForOne && each.event?.level === "refused") each.plate = plateOf(labels, view, each, nRefused > MOST_IN_FULL); };
  // Of few agents the reason stands under the name whatever is there, of many where there is room.
  if (nRefused > MOST_IN_FULL) [name, say].forEach((place) => placed.forEach(place));
  else placed.forEach((each) => { name(each); say(each); });
  for (const each of placed) if (each.name) drawLeader(context, each);
  const size = MARK_PIXELS * Math.max(LEAST_MARK, Math.min(1, view.scale / MARK_SCALE));
  for (const { agent, frame, isFresh, isFused, x, y, event } of placed) {
    context.globalAlpha = isFresh ? 1 : 0.5;
    drawMark(context, markOf(agent), { x, y, yaw: frame.pose.yaw, size, edge: isFused ? view.colour : palette.panel });
    context.globalAlpha = 1;
    if (agent.name === highlighted) drawRing(context, x, y, 19, palette.ink, 1.5);
    if (event && areManyForOne && event.level === "refused") drawRing(context, x, y, RING_OF_MANY, palette.bad, 1.25);
    else if (event) drawEvent(context, x, y, event, calm.matches ? 0 : (time - event.at) / RING_MS[event.level]);
  }
  for (const { agent, name } of placed) if (name) drawName(context, markOf(agent), name);
  labels.use(BOLD);
  for (const { plate } of placed) if (plate) drawRefusal(context, plate);
  return !calm.matches && placed.some(({ event }) => event);
}

/** The newest frame of an agent that was late or refused, if it is still shown; a refused one comes first. */
function newestEvent(events, agent, time) {
  const isShown = (event) => event.agent === agent.name && time >= event.at && time - event.at < (calm.matches ? CALM_MS : RING_MS[event.level]);
  const shown = events.filter(isShown);
  return shown.findLast((each) => each.level === "refused") ?? shown.at(-1);
}

function drawRing(context, x, y, radius, colour, width) {
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.strokeStyle = colour;
  context.lineWidth = width;
  context.stroke();
}

function drawEvent(context, x, y, { level }, share) {
  if (level === "refused") {
    drawRing(context, x, y, RINGS[0], palette.bad, 2);
    drawRing(context, x, y, RINGS[1], palette.bad, 2);
    return;
  }
  context.globalAlpha = 1 - share;
  drawRing(context, x, y, RINGS[0], palette.muted, 1);
  context.globalAlpha = 1;
}

/** The name of an agent with its link delay at a time, and where it stands; null where there is no room. */
function nameOf(labels, view, { agent, x, y }, figuresAt) {
  const delay = agent.delay.recent(figuresAt);
  const text = `${shortened(agent.name, MOST_LETTERS)}${Number.isFinite(delay) ? `  ${Math.round(delay)}\u00a0ms` : ""}`;
  labels.use(PLATE);
  // The width of the digits does not matter: a plate that changes its width would jump.
  const width = tabOf(markOf(agent)) + labels.width(text.replace(/\d/g, "0")) + 11;
  const place = labels.placeNear(`${view.left} ${view.top} ${agent.name}`, x, y, width, NAME_HEIGHT);
  return place && { text, left: place[0], top: place[1], width };
}

/** The width of the part with the number. */
const tabOf = ({ text }) => 8 + 7 * text.length;

/** From a mark to its name, where another mark may be nearer to that. */
function drawLeader(context, { agent, x, y, name: { left, top, width } }) {
  const [toX, toY] = [Math.max(left, Math.min(left + width, x)), Math.max(top, Math.min(top + NAME_HEIGHT, y))];
  context.strokeStyle = markOf(agent).colour;
  context.lineWidth = 2;
  context.beginPath();
  context.moveTo(x, y);
  context.lineTo(toX, toY);
  context.stroke();
}

/** A plate with the agent's number in its colour. */
function drawName(context, mark, { text, left, top, width }) {
  context.font = PLATE;
  const tab = tabOf(mark);
  context.fillStyle = palette.panel;
  context.strokeStyle = mark.colour;
  context.lineWidth = 1.5;
  context.beginPath();
  context.roundRect(left, top, width, NAME_HEIGHT, 4);
  context.fill();
  context.save();
  context.clip();
  context.fillStyle = mark.colour;
  context.fillRect(left, top, tab, NAME_HEIGHT);
  context.restore();
  context.setLineDash(mark.dash);
  context.stroke();
  context.setLineDash([]);
  context.fillStyle = mark.ink;
  context.textAlign = "center";
  context.fillText(mark.text, left + tab / 2, top + 12.5);
  context.textAlign = "left";
  context.fillStyle = palette.ink;
  context.fillText(text, left + tab + 5, top + 12.5);
}

/** Where the reason of a refusal stands: under or over the name of its agent; null where it is one of many and has no room. */
function plateOf(labels, view, { x, y, name, event }, isShort) {
  const text = isShort || view.width < NARROW_FOR_REASONS ? event.text : `refused: ${event.text}`;
  labels.use(BOLD);
  const width = labels.width(text) + PLATE_TEXT + 6;
  const [near, above, below] = name ? [name.left, name.top - 22, name.top + NAME_HEIGHT + 2] : [x - width / 2, y - 42, y + 22];
  const inside = (value, from, to) => Math.max(from, Math.min(to, value));
  const left = inside(near, view.left + 2, view.left + view.width - width - 2);
  const tops = [below, above, below + 22, above - 22, below + 44].map((top) => inside(top, view.top + 2, view.top + view.height - 22));
  const free = tops.find((top) => labels.isUntaken(left, top, width, 20));
  if (free === undefined && isShort) return null;
  const at = { text, width, x: left, y: free ?? tops[0] };
  labels.reserve(at.x, at.y, width, 20);
  return at;
}

function drawRefusal(context, { text, width, x, y }) {
  drawPlate(context, x, y, width, 20);
  context.fillStyle = palette.bad;
  context.fillText("✕", x + 6, y + 14);
  context.fillStyle = palette.ink;
  context.fillText(text, x + PLATE_TEXT, y + 14);
}
