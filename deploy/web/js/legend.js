// The legend: each mark as it is on the map.

import { groups, tints } from "./classes.js";
import { LAYERS, layers, toggleLayer } from "./layers.js";
import { element, svgElement } from "./nodes.js";
import { palette } from "./palette.js";

/** How a layer looks, drawn small. */
function sample(id, { isCoarse, nHubs }) {
  const svg = svgElement("svg", { width: 22, height: 14, "aria-hidden": "true" });
  const shape = (name, attributes) => svg.append(svgElement(name, attributes));
  const box = (stroke, more = {}) => shape("rect", { x: 3, y: 3, width: 16, height: 8, stroke, fill: "none", "stroke-width": 1.6, ...more });
  const line = (stroke, more = {}) => shape("line", { x1: 2, y1: 7, x2: 20, y2: 7, stroke, "stroke-width": 1.6, ...more });
  const [one, other] = palette.agents;
  // The second hub is in ink.
  if (id === "fused" && nHubs > 1) [[palette.ours, 1], [palette.ink, 12]].forEach(([stroke, x]) => box(stroke, { x, width: 9 }));
  else if (id === "fused") box(palette.ours, layers.classes ? {} : { fill: palette.ours, "fill-opacity": 0.25 });
  else if (id === "truth") box(palette.truth, isCoarse ? { "stroke-width": 1.6, "stroke-dasharray": "3 1.5" } : { "stroke-width": 2, "stroke-dasharray": "6 2" });
  else if (id === "detections") box(one, { y: 2, width: 13, "stroke-width": 1.25 }), box(other, { x: 7, y: 5, width: 13, height: 7, "stroke-width": 1.25 });
  else if (id === "views") [[one, 8], [other, 14]].forEach(([stroke, cx]) => shape("circle", { cx, cy: 7, r: 6, fill: stroke, "fill-opacity": 0.08, stroke }));
  else if (id === "velocity") shape("path", { d: "M2 7H18M14 3.5 18 7 14 10.5", fill: "none", stroke: palette.ink, "stroke-width": 1.4 });
  else if (id === "covariance") shape("ellipse", { cx: 11, cy: 7, rx: 8, ry: 5, fill: palette.ours, "fill-opacity": 0.3 });
  else if (id === "trails") line(palette.ours, { "stroke-opacity": 0.4, "stroke-width": 2 });
  else if (id === "roads") line(palette.road, { "stroke-width": 12 }), line(palette.marking, { "stroke-width": 1, "stroke-dasharray": "4 3" });
  else if (id === "grid") shape("path", { d: "M2 4.5H20M2 9.5H20M7 1V13M15 1V13", stroke: palette.line });
  else if (id === "classes") tints.forEach((fill, k) => shape("rect", { x: 1 + 5 * k, y: 3, width: 5, height: 8, fill, "fill-opacity": palette.tintOpacity }));
  else shape("text", { x: 0, y: 11, "font-size": 10, fill: palette.ours }), (svg.lastChild.textContent = "C12");
  return svg;
}

/** Fills the legend, whose entries switch their layers. */
export function showLayers(roots, state, onChange) {
  roots.layers.replaceChildren(...LAYERS.map((layer) => {
    const box = element("input");
    box.type = "checkbox";
    box.checked = layers[layer.id];
    box.addEventListener("change", () => { toggleLayer(layer.id); onChange(); });
    const isUnseen = layer.id === "covariance" && state.isCoarse;
    const label = element("label", isUnseen ? "unseen" : "", box, sample(layer.id, state), layer.name);
    label.title = `key ${layer.key}${isUnseen ? "; seen from nearer" : ""}`;
    return label;
  }));
  // Classes of one colour are in one row: the letter tells them apart.
  const colours = [...new Set(groups.map(({ colour }) => colour))];
  roots.letters.replaceChildren(...colours.map((colour) => {
    const svg = svgElement("svg", { width: 16, height: 12 });
    svg.append(svgElement("rect", { x: 1, y: 1, width: 14, height: 10, rx: 1.5, fill: colour ?? "none", "fill-opacity": palette.tintOpacity, stroke: palette.ours, "stroke-width": 1.5 }));
    const named = groups.filter((each) => each.colour === colour).flatMap(({ letter, meaning }, k) => [k ? ", " : "", element("b", "", letter), `\u00a0${meaning}`]);
    return element("p", "", svg, element("span", "", ...named));
  }));
}
