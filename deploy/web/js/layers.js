// What is drawn, and the key that toggles it.

import { recall, remember } from "./palette.js";

export const LAYERS = [
  { id: "fused", name: "Fused", key: "1", on: true },
  { id: "truth", name: "Truth", key: "2", on: true },
  { id: "detections", name: "Detections", key: "3", on: true },
  { id: "views", name: "Fields of view", key: "4", on: true },
  { id: "velocity", name: "Velocity, 1\u00a0s", key: "5", on: true },
  { id: "covariance", name: "Ellipses, 2σ", key: "6", on: true },
  { id: "trails", name: "Trails, 6\u00a0s", key: "7", on: true },
  { id: "labels", name: "Labels", key: "8", on: true },
  { id: "roads", name: "Roads", key: "9", on: true },
  { id: "classes", name: "Classes", key: "c", on: true },
  { id: "grid", name: "Grid", key: "g", on: true },
];

/** Whether each layer is drawn. */
export const layers = {};
const off = new Set((recall("layers-off") ?? "").split(","));
for (const layer of LAYERS) layers[layer.id] = layer.on && !off.has(layer.id);

export function toggleLayer(id) {
  layers[id] = !layers[id];
  remember("layers-off", LAYERS.filter((layer) => !layers[layer.id]).map((layer) => layer.id).join(","));
}
