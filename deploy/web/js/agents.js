// Agents on the map: fields of view, detections, marks, and what became of their newest frames.

import { BOLD } from "./labels.js";
import { drawMark, markOf } from "./marks.js";
import { palette } from "./palette.js";
import { traceBoxes, traceSector } from "./shapes.js";
import { DETECTION } from "./store.js";

const FLASH_MS = { late: 700, refused: 2500 };
/** Where no motion is wanted a ring stands still for so long, so that frequent events do not make it flicker. */
const CALM_MS = 5000;
const MARK_PIXELS = 8.5;
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
    const { colour, dash } = markOf(agent.number);
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
  const { colour, dash } = markOf(agent.number);
  context.beginPath();
  traceBoxes(context, view, frame.values, DETECTION);
  context.globalAlpha = !isFresh || (highlighted && highlighted !== agent.name) ? 0.25 : highlighted ? 1 : 0.75;
  context.strokeStyle = colour;
  context.lineWidth = highlighted === agent.name ? 1.8 : 1;
  context.setLineDash(dash);
  context.stroke();
  context.setLineDash([]);
  context.globalAlpha = 1;
}

export function drawMarks(context, view, agents, { labels, highlighted, time }) {
  const placed = agents.filter(({ frame }) => frame.pose && view.sees(frame.pose.x, frame.pose.y, 0));
  // No label lies under a mark.
  for (const { frame } of placed) labels.take(view.x(frame.pose.x) - 8, view.y(frame.pose.y) - 8, 16, 16);
  labels.use(BOLD);
  for (const { agent, frame } of placed) {
    const delay = agent.delay.recent(time);
    labels.writeBeside(`${agent.name}${Number.isFinite(delay) ? `  ${Math.round(delay)} ms` : ""}`, view.x(frame.pose.x), view.y(frame.pose.y), palette.ink);
  }
  for (const { agent, frame, isFresh } of placed) {
    const [x, y] = [view.x(frame.pose.x), view.y(frame.pose.y)];
    context.globalAlpha = isFresh ? 1 : 0.5;
    drawMark(context, markOf(agent.number), x, y, frame.pose.yaw, MARK_PIXELS);
    context.globalAlpha = 1;
    if (agent.name !== highlighted) continue;
    context.beginPath();
    context.arc(x, y, 19, 0, 2 * Math.PI);
    context.strokeStyle = palette.ink;
    context.lineWidth = 1.5;
    context.stroke();
  }
}

/** The newest late or refused frame of each agent, with the reason; returns whether something moves. */
export function drawFlashes(context, view, agents, { labels, events, time }) {
  let moves = false;
  labels.use(BOLD);
  for (const { agent, frame } of agents) {
    if (!frame.pose || !view.sees(frame.pose.x, frame.pose.y, 0)) continue;
    const isShown = (event) => event.agent === agent.name && time >= event.at && time - event.at < (calm.matches ? CALM_MS : FLASH_MS[event.level]);
    const shown = events.filter(isShown);
    const event = shown.findLast((each) => each.level === "refused") ?? shown.at(-1);
    if (!event) continue;
    drawFlash(context, labels, event, view.x(frame.pose.x), view.y(frame.pose.y), calm.matches ? 0 : (time - event.at) / FLASH_MS[event.level]);
    moves ||= !calm.matches;
  }
  return moves;
}

function drawFlash(context, labels, event, x, y, share) {
  const isRefused = event.level === "refused";
  const colour = isRefused ? palette.bad : palette.warn;
  context.globalAlpha = (1 - share) * (isRefused ? 1 : 0.8);
  context.strokeStyle = colour;
  context.lineWidth = isRefused ? 3 : 1.5;
  context.beginPath();
  context.arc(x, y, 15 + 12 * share, 0, 2 * Math.PI);
  context.stroke();
  labels.writeBeside(isRefused ? `refused: ${event.text}` : event.text, x, y + 4, colour);
  context.globalAlpha = 1;
}
