// How agents are distinguished: by number, colour and, where colours begin again, dots, the same on the map, in the panel and in the charts.

import { svgElement } from "./nodes.js";
import { N_COLOURS, palette } from "./palette.js";

/**
 * Corners for a half size of 1, ahead and to the right: an arrow head for what drives, a square for what stands, or is not
 * described. The reports have the same shapes.
 */
const SHAPES = {
  arrow: [[1.9, 0], [-1.2, 1.35], [-0.75, 0], [-1.2, -1.35]],
  square: [[0.95, -0.95], [0.95, 0.95], [-0.95, 0.95], [-0.95, -0.95]],
};
/** Dots, and dots between dashes: dashes alone are truth. */
const DASHES = [[], [1.2, 2.2], [7, 2, 1.2, 2], [7, 2, 1.2, 2, 1.2, 2]];

/** The mark of an agent. */
export function markOf({ number, sensor }) {
  const colour = palette.agents[number % N_COLOURS];
  const shape = sensor?.kind === "vehicle" ? "arrow" : "square";
  return { colour, shape, dash: DASHES[Math.floor(number / N_COLOURS) % DASHES.length], text: String(number + 1), ink: inkOn(colour) };
}

/** Black or white, whichever is easier to read on a colour. */
function inkOn(colour) {
  const linear = (from) => {
    const share = parseInt(colour.slice(from, from + 2), 16) / 255;
    return share <= 0.04045 ? share / 12.92 : ((share + 0.055) / 1.055) ** 2.4;
  };
  // Relative luminance of WCAG 2; at 0.18 black and white have the same contrast.
  return 0.2126 * linear(1) + 0.7152 * linear(3) + 0.0722 * linear(5) > 0.18 ? "#000000" : "#ffffff";
}

/** Draws a mark on a canvas, with an edge of a colour; an arrow head points to the heading. */
export function drawMark(context, mark, { x, y, yaw, size, edge }) {
  const [cos, sin] = mark.shape === "arrow" ? [Math.cos(yaw), -Math.sin(yaw)] : [1, 0];
  context.fillStyle = mark.colour;
  context.strokeStyle = edge;
  context.lineWidth = edge === palette.panel ? 2 : 3.5;
  context.beginPath();
  for (const [ahead, right] of SHAPES[mark.shape]) context.lineTo(x + size * (ahead * cos - right * sin), y + size * (ahead * sin + right * cos));
  context.closePath();
  context.stroke();
  context.fill();
  if (mark.dash.length) {
    context.strokeStyle = mark.ink;
    context.lineWidth = 1.2;
    context.setLineDash(mark.dash);
    context.stroke();
    context.setLineDash([]);
  }
  context.fillStyle = mark.ink;
  context.font = `700 ${mark.text.length > 2 ? 8 : size < 8 ? 10 : 11}px system-ui, 'DejaVu Sans', sans-serif`;
  context.textAlign = "center";
  context.fillText(mark.text, x, y + 4);
  context.textAlign = "left";
}

const templates = new Map();

/** The same as an element. */
export function markNode(agent) {
  const mark = markOf(agent);
  const key = `${mark.text} ${mark.colour} ${mark.shape}`;
  if (!templates.has(key)) templates.set(key, newNode(mark));
  return templates.get(key).cloneNode(true);
}

function newNode(mark) {
  const svg = svgElement("svg", { class: "mark", width: 20, height: 20, viewBox: "-10 -11 20 21", "data-shape": mark.shape, "data-colour": mark.colour, "aria-hidden": "true" });
  // An arrow head points up there.
  const size = mark.shape === "arrow" ? 6.4 : 8;
  const corner = ([ahead, right]) => `${(size * right).toFixed(1)},${(1.6 - size * ahead).toFixed(1)}`;
  const points = SHAPES[mark.shape].map(mark.shape === "arrow" ? corner : ([x, y]) => `${size * x},${size * y}`).join(" ");
  svg.append(svgElement("polygon", { fill: mark.colour, points }));
  if (mark.dash.length) svg.append(svgElement("polygon", { fill: "none", points, stroke: mark.ink, "stroke-width": 1.2, "stroke-dasharray": mark.dash.join(" ") }));
  const text = svgElement("text", { y: mark.shape === "arrow" ? 6 : 3.5, "text-anchor": "middle", "font-size": mark.text.length > 2 ? 7 : mark.shape === "arrow" ? 9 : 10, "font-weight": 700, fill: mark.ink });
  text.textContent = mark.text;
  svg.append(text);
  return svg;
}
