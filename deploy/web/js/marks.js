// How agents are told apart: by colour, shape, dash and number, the same on the map, in the panel and in the charts.

import { svgElement } from "./nodes.js";
import { N_COLOURS, palette } from "./palette.js";

/** Corners of each shape for a half size of 1, x to the right and y down; the first one is round. */
const SHAPES = [
  null,
  [[-0.9, -0.9], [0.9, -0.9], [0.9, 0.9], [-0.9, 0.9]],
  [[0, -1.3], [1.3, 0], [0, 1.3], [-1.3, 0]],
  [[-0.6, -1.05], [0.6, -1.05], [1.2, 0], [0.6, 1.05], [-0.6, 1.05], [-1.2, 0]],
];
const NAMES = ["circle", "square", "diamond", "hexagon"];
const DASHES = [[], [3, 2], [1, 2], [6, 2, 1, 2]];
const NOSE = 0.85;

/** The mark of the agent of a number. */
export function markOf(number) {
  const round = Math.floor(number / N_COLOURS) % SHAPES.length;
  const colour = palette.agents[number % N_COLOURS];
  return { colour, shape: NAMES[round], corners: SHAPES[round], dash: DASHES[round], text: String(number + 1), ink: inkOn(colour) };
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

/** Draws a mark on a canvas, with a nose that points to the heading. */
export function drawMark(context, mark, x, y, yaw, size) {
  const [cos, sin] = [Math.cos(yaw), -Math.sin(yaw)];
  const nose = (along, across) => context.lineTo(x + size * (along * cos - across * sin), y + size * (along * sin + across * cos));
  context.fillStyle = mark.colour;
  context.strokeStyle = palette.panel;
  context.lineWidth = 1.5;
  context.beginPath();
  nose(0.6, NOSE);
  nose(1.95, 0);
  nose(0.6, -NOSE);
  context.closePath();
  context.stroke();
  context.fill();
  context.beginPath();
  if (mark.corners) {
    for (const [right, down] of mark.corners) context.lineTo(x + size * right, y + size * down);
    context.closePath();
  } else {
    context.arc(x, y, size, 0, 2 * Math.PI);
  }
  context.stroke();
  context.fill();
  // The nose has no edge to its own mark.
  context.beginPath();
  nose(0.5, 0.45);
  nose(1.3, 0);
  nose(0.5, -0.45);
  context.fill();
  context.fillStyle = mark.ink;
  context.font = `700 ${mark.text.length > 2 ? 8 : 11}px system-ui, 'DejaVu Sans', sans-serif`;
  context.textAlign = "center";
  context.fillText(mark.text, x, y + 4);
  context.textAlign = "left";
}

const templates = new Map();

/** The same as an element. */
export function markNode(number) {
  const mark = markOf(number);
  const key = `${mark.text} ${mark.colour}`;
  if (!templates.has(key)) templates.set(key, newNode(mark));
  return templates.get(key).cloneNode(true);
}

function newNode(mark) {
  const svg = svgElement("svg", { class: "mark", width: 20, height: 20, viewBox: "-10 -10 20 20", "data-shape": mark.shape, "data-colour": mark.colour, "aria-hidden": "true" });
  const size = 7.4;
  if (mark.corners) {
    svg.append(svgElement("polygon", { fill: mark.colour, points: mark.corners.map((corner) => corner.map((value) => (size * value).toFixed(1)).join()).join(" ") }));
  } else {
    svg.append(svgElement("circle", { fill: mark.colour, r: size }));
  }
  const text = svgElement("text", { y: 3.5, "text-anchor": "middle", "font-size": mark.text.length > 2 ? 7 : 10, "font-weight": 700, fill: mark.ink });
  text.textContent = mark.text;
  svg.append(text);
  return svg;
}
