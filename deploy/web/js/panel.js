// The side panel: what is selected, agents, layers. Text only, built from nodes: names come from the network.

import { letterOf } from "./labels.js";
import { LAYERS, layers, toggleLayer } from "./layers.js";
import { agentColour, palette } from "./palette.js";
import { contributorsOf } from "./scene.js";
import { OBJECT } from "./store.js";
import { total } from "./verdict.js";

const SVG = "http://www.w3.org/2000/svg";

function element(name, className, ...content) {
  const made = document.createElement(name);
  if (className) made.className = className;
  made.append(...content);
  return made;
}

function swatch(colour) {
  const made = element("span", "swatch");
  made.style.background = colour;
  return made;
}

function rows(pairs) {
  const table = element("table");
  for (const [key, value] of pairs) {
    const row = table.insertRow();
    row.append(element("td", "key", key), element("td", "", value));
  }
  return table;
}

const degrees = (radians) => ((radians * 180) / Math.PI).toFixed(1);

/** Shows the selected object or agent. */
export function showSelected(root, view) {
  const { store, selection } = view;
  const hub = selection?.hub ? store.hubs.get(selection.hub) : null;
  const frame = hub?.frames.at(view.time);
  const k = frame ? frame.tracks.indexOf(selection.track) : -1;
  if (k >= 0) root.replaceChildren(...objectNodes(view, frame, k));
  else if (selection?.track) root.replaceChildren(element("div", "title", selection.track), element("p", "hint", "not in this list"));
  else if (selection?.agent && store.agents.has(selection.agent)) root.replaceChildren(...agentNodes(view, store.agents.get(selection.agent)));
  else root.replaceChildren(element("p", "hint", "Click an object or an agent to see its values and who contributed."));
}

function heading(text, view) {
  const follow = element("button", "", view.isFollowing ? "Following" : "Follow");
  follow.type = "button";
  follow.setAttribute("aria-pressed", String(view.isFollowing));
  follow.addEventListener("click", () => view.toggleFollow());
  return element("div", "title", element("span", "", text), follow);
}

function objectNodes(view, frame, k) {
  const { store } = view;
  const value = (field) => frame.values[k * OBJECT.size + OBJECT[field]];
  const origin = store.origin ?? { x: 0, y: 0 };
  const name = store.hello?.classes[value("class")] ?? "unknown";
  const pm = (field, digits = 2) => ` ± ${value(field).toFixed(digits)}`;
  const table = rows([
    ["track", frame.tracks[k]],
    ["position m", `${(value("x") + origin.x).toFixed(2)}, ${(value("y") + origin.y).toFixed(2)}`],
    ["± m (1σ)", `${Math.sqrt(value("xx")).toFixed(2)}, ${Math.sqrt(value("yy")).toFixed(2)}`],
    ["speed m/s", Math.hypot(value("vx"), value("vy")).toFixed(1) + ` ± ${Math.hypot(value("sVx"), value("sVy")).toFixed(1)}`],
    ["heading °", `${degrees(value("yaw"))} ± ${degrees(value("sYaw"))}`],
    ["width m", value("w").toFixed(2) + pm("sW")],
    ["length m", value("d").toFixed(2) + pm("sD")],
    ["exists, probability", `${(100 * value("existence")).toFixed(1)} %`],
    ["tracked for s", value("age").toFixed(1)],
    ["newest measurement", `${Math.round(value("since"))} ms before`],
  ]);
  const found = contributorsOf(store, frame, k);
  const list = element("table");
  list.id = "contributors";
  const head = list.insertRow();
  head.append(element("th", "", "contributor"), element("th", "", "link ms"), element("th", "", "age ms"), element("th", "", "distance m"));
  for (const { agent, detection, delay, captured } of found) {
    const row = list.insertRow();
    const off = detection ? Math.hypot(detection.x - value("x"), detection.y - value("y")).toFixed(2) : "–";
    row.append(
      element("td", "", swatch(agentColour(agent.number)), agent.name),
      element("td", "", delay === null ? "–" : String(Math.round(delay))),
      // The object has moved on since: an old measurement is far behind a fast one.
      element("td", "", captured === null ? "–" : String(Math.round(frame.received - captured))),
      element("td", "", off),
    );
  }
  return [heading(name, view), table, list];
}

function agentNodes(view, agent) {
  const { store } = view;
  const status = view.hubs[0]?.status?.agents.find((each) => each.id === agent.name);
  const sensor = agent.sensor;
  const pairs = [
    ["kind", sensor ? sensor.kind : "not described"],
    ["declared rate", sensor ? `${sensor.rate_hz} Hz` : "–"],
    ["view", sensor ? `${sensor.field_of_view.range_max_m} m, ${Math.round((sensor.field_of_view.width_rad * 180) / Math.PI)}°` : "–"],
    ["frames accepted", status ? String(status.accepted) : "–"],
    ["out of order", status ? String(status.out_of_sequence) : "–"],
    ["refused", status ? String(total(status.refused)) : "–"],
    ["NIS", status?.nis_per_dof != null ? status.nis_per_dof.toFixed(2) : "–"],
  ];
  for (const [reason, count] of Object.entries(status?.refused ?? {})) pairs.push([`· ${reason.replaceAll("_", " ")}`, String(count)]);
  const learnt = status?.learnt?.detection_probability;
  if (learnt != null) pairs.push(["detects", `${Math.round(100 * learnt)} %${sensor ? `, declares ${Math.round(100 * sensor.detection_probability)} %` : ""}`]);
  if (status?.registration && status.registration.pairs > 0 && !status.registration.reference) {
    const { dx_m: dx, dy_m: dy, dyaw_deg: yaw, clock_ms: clock } = status.registration;
    pairs.push(["pose error m", `${dx.toFixed(2)}, ${dy.toFixed(2)}`], ["heading error °", yaw.toFixed(2)], ["clock error ms", clock.toFixed(0)]);
  }
  const nodes = [heading(agent.name, view), rows(pairs)];
  if (status?.last_refusal) nodes.push(element("p", "hint", `newest refusal: ${status.last_refusal}`));
  return nodes;
}

/** Lists all agents, each a button that selects it. */
export function showAgents(root, view) {
  const { store } = view;
  const now = store.now();
  const focused = document.activeElement?.dataset?.agent;
  const list = [...store.agents.values()].slice(0, 100).map((agent) => {
    const button = element("button", "agent");
    button.type = "button";
    button.dataset.agent = agent.name;
    button.setAttribute("aria-pressed", String(view.selection?.agent === agent.name));
    const delay = agent.delay.recent(view.time);
    const isAlive = store.isAlive(agent.name);
    button.append(
      element("span", "row", element("span", "", swatch(agentColour(agent.number)), element("b", "", agent.name)),
        element("span", "", Number.isFinite(delay) ? `link ${Math.round(delay)} ms` : "–")),
      element("span", "row sub", element("span", "", agent.sensor?.kind ?? "no description"),
        element("span", "", isAlive ? `${agent.frames.at(view.time)?.n ?? 0} detections` : "not alive")),
    );
    if (agent.lastRefusal && now - agent.lastRefusedAt < 5000) {
      const remark = element("span", "remark", agent.lastRefusal);
      remark.title = agent.lastRefusal;
      button.append(remark);
    }
    button.addEventListener("click", () => view.select({ agent: agent.name }));
    return button;
  });
  root.replaceChildren(...(list.length ? list : [element("p", "hint", "none so far")]));
  if (focused) [...root.children].find((each) => each.dataset.agent === focused)?.focus();
}

/** How a layer looks, drawn small. */
function sample(id) {
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("width", "22");
  svg.setAttribute("height", "14");
  const shape = (name, attributes) => {
    const made = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    svg.append(made);
  };
  const box = (stroke, fill = "none", more = {}) => shape("rect", { x: 3, y: 3, width: 16, height: 8, stroke, fill, "fill-opacity": 0.25, "stroke-width": 1.6, ...more });
  const line = (stroke, more = {}) => shape("line", { x1: 2, y1: 7, x2: 20, y2: 7, stroke, "stroke-width": 1.6, ...more });
  if (id === "fused") box(palette.ours, palette.ours);
  else if (id === "truth") box(palette.truth, "none", { "stroke-dasharray": "6 2" });
  else if (id === "detections") box(agentColour(0));
  else if (id === "views") shape("path", { d: "M3 12 A14 14 0 0 1 19 12 L11 2 Z", transform: "rotate(180 11 7)", fill: agentColour(1), "fill-opacity": 0.25, stroke: agentColour(1) });
  else if (id === "velocity") shape("path", { d: "M2 7H18M14 3.5 18 7 14 10.5", fill: "none", stroke: palette.ink, "stroke-width": 1.4 });
  else if (id === "covariance") shape("ellipse", { cx: 11, cy: 7, rx: 8, ry: 5, fill: palette.ours, "fill-opacity": 0.3 });
  else if (id === "trails") line(palette.ours, { "stroke-opacity": 0.45, "stroke-width": 3 });
  else if (id === "roads") line(palette.muted, { "stroke-opacity": 0.35, "stroke-width": 9 });
  else if (id === "grid") shape("path", { d: "M2 4.5H20M2 9.5H20M7 1V13M15 1V13", stroke: palette.muted, "stroke-opacity": 0.6 });
  else shape("text", { x: 2, y: 11, "font-size": 11, fill: palette.ours }), (svg.lastChild.textContent = "C12");
  return svg;
}

/** The legend, whose entries switch their layers. */
export function showLayers(root, letters, onChange) {
  root.replaceChildren(...LAYERS.map((layer) => {
    const box = element("input");
    box.type = "checkbox";
    box.checked = layers[layer.id];
    box.addEventListener("change", () => { toggleLayer(layer.id); onChange(); });
    const label = element("label", "", box, sample(layer.id), layer.name);
    label.title = `key ${layer.key}`;
    return label;
  }));
  const names = ["vehicle.car", "vehicle.truck", "vehicle.bus", "vehicle.motorcycle", "vehicle.bicycle", "vehicle.other", "human", "animal", "movable"];
  letters.textContent = names.map((name) => letterOf(name)).map(({ letter, meaning }) => `${letter} ${meaning}`).join(" · ");
  letters.textContent += ". Truth without a fused box: no agent sees it, or the hub does not know it yet. An arrow ends where the object will be after 1 s.";
}
