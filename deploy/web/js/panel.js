// The side panel: what is selected, agents, layers.

import { groups } from "./classes.js";
import { LAYERS, layers, toggleLayer } from "./layers.js";
import { markNode, markOf } from "./marks.js";
import { button, element, renew, rows, svgElement } from "./nodes.js";
import { palette } from "./palette.js";
import { contributorsOf } from "./scene.js";
import { OBJECT } from "./store.js";
import { total } from "./verdict.js";

/** Names that come from outside: no more than these are listed. */
const MOST_AGENTS = 100;
const MOST_NAMES = 5;

const degrees = (radians) => ((radians * 180) / Math.PI).toFixed(1);

/** Shows the selected object or agent. */
export function showSelected(root, view) {
  renew(root, selectedNodes(view));
}

function selectedNodes(view) {
  const { store, selection } = view;
  if (selection?.track) return trackNodes(view, selection);
  const agent = store.agents.get(selection?.agent);
  if (agent) return agentNodes(view, agent);
  if (selection?.agent) return [element("div", "title", selection.agent), element("p", "hint", "This agent has left.")];
  return [element("p", "hint", "Click an object or an agent to see its values and who contributed.")];
}

function trackNodes(view, { hub: name, track }) {
  const hub = view.store.hubs.get(name);
  const frame = hub?.frames.at(view.time);
  const k = frame ? frame.tracks.indexOf(track) : -1;
  const isGone = view.store.isGone(name);
  const gone = element("p", "remark", `Hub gone: ${name} has left the network. ${k < 0 ? "Nothing more is known of this track." : "These values are from its last list."}`);
  if (k >= 0) return [...objectNodes(view, frame, k), ...(isGone ? [gone] : [])];
  const title = element("div", "title", track);
  return [title, isGone ? gone : element("p", "hint", `Not in the list of ${name} at this moment: the hub does not follow it any more, or not yet.`)];
}

function heading(nodes, view) {
  const text = view.isFollowing ? "Following" : "Follow";
  return element("div", "title", element("span", "", ...nodes), button(text, "follow", view.isFollowing));
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
      element("td", "", markNode(agent.number), agent.name),
      element("td", "", delay === null ? "–" : String(Math.round(delay))),
      // The object has moved on since: an old measurement is far behind a fast one.
      element("td", "", captured === null ? "–" : String(Math.round(frame.received - captured))),
      element("td", "", off),
    );
  }
  return [heading([name], view), table, list];
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
  const nodes = [heading([markNode(agent.number), agent.name], view), rows(pairs)];
  if (status?.last_refusal) nodes.push(element("p", "hint", `newest refusal: ${status.last_refusal}`));
  const classes = Object.entries(status?.unmapped_names ?? {}).slice(0, MOST_NAMES);
  if (classes.length) nodes.push(element("p", "hint", `classes that no table knows: ${classes.map(([name, count]) => `${name} (${count})`).join(", ")}`));
  return nodes;
}

/** Lists all agents, each a button that selects it. */
export function showAgents(root, view) {
  const { store } = view;
  const list = [...store.agents.values()].sort((one, other) => one.number - other.number).slice(0, MOST_AGENTS).map((agent) => agentRow(view, agent));
  renew(root, [...(list.length ? list : [element("p", "hint", "none so far")]), ...invalidNames(view.hubs[0]?.status)]);
}

function agentRow(view, agent) {
  const { store } = view;
  const delay = agent.delay.recent(view.time);
  const state = store.isAlive(agent.name) ? `${agent.frames.at(view.time)?.n ?? 0} detections` : "has left";
  const made = button("", "select", view.selection?.agent === agent.name);
  made.className = "agent";
  made.dataset.agent = agent.name;
  // In place of the kind, so that no row changes its height under a pointer.
  const isRefused = agent.reason && store.now() - agent.lastRefusedAt < 5000;
  const below = isRefused ? element("span", "remark", `refused: ${agent.reason}`) : element("span", "sub", agent.sensor?.kind ?? "no description");
  if (isRefused) below.title = agent.lastRefusal ?? "";
  made.replaceChildren(
    markNode(agent.number),
    element("b", "", agent.name),
    element("span", "value", Number.isFinite(delay) ? `link ${Math.round(delay)} ms` : "–"),
    below,
    element("span", "sub value", state),
  );
  return made;
}

/** Agents that the hub cannot use for their names. */
function invalidNames(status) {
  const found = status?.invalid_names ?? [];
  const listed = found.slice(0, MOST_NAMES).map(({ name, reason }) => element("p", "remark", `“${name}” is not used: ${reason}`));
  if (found.length > MOST_NAMES) listed.push(element("p", "hint", `and ${found.length - MOST_NAMES} more names that are not valid`));
  return listed;
}

/** How a layer looks, drawn small. */
function sample(id) {
  const svg = svgElement("svg", { width: 22, height: 14 });
  const shape = (name, attributes) => svg.append(svgElement(name, attributes));
  const box = (stroke, fill = "none", more = {}) => shape("rect", { x: 3, y: 3, width: 16, height: 8, stroke, fill, "fill-opacity": 0.25, "stroke-width": 1.6, ...more });
  const line = (stroke, more = {}) => shape("line", { x1: 2, y1: 7, x2: 20, y2: 7, stroke, "stroke-width": 1.6, ...more });
  const agent = markOf(0).colour;
  if (id === "fused") box(palette.ours, palette.ours);
  else if (id === "truth") box(palette.truth, "none", { "stroke-dasharray": "6 2" });
  else if (id === "detections") box(agent);
  else if (id === "views") shape("path", { d: "M3 12 A14 14 0 0 1 19 12 L11 2 Z", transform: "rotate(180 11 7)", fill: agent, "fill-opacity": 0.15, stroke: agent });
  else if (id === "velocity") shape("path", { d: "M2 7H18M14 3.5 18 7 14 10.5", fill: "none", stroke: palette.ink, "stroke-width": 1.4 });
  else if (id === "covariance") shape("ellipse", { cx: 11, cy: 7, rx: 8, ry: 5, fill: palette.ours, "fill-opacity": 0.3 });
  else if (id === "trails") line(palette.ours, { "stroke-opacity": 0.45, "stroke-width": 3 });
  else if (id === "roads") line(palette.muted, { "stroke-opacity": 0.35, "stroke-width": 9 });
  else if (id === "grid") shape("path", { d: "M2 4.5H20M2 9.5H20M7 1V13M15 1V13", stroke: palette.muted, "stroke-opacity": 0.6 });
  else if (id === "classes") ["#EE8866", "#EEDD88", "#44BB99"].forEach((fill, k) => shape("rect", { x: 2 + 6 * k, y: 3, width: 6, height: 8, fill }));
  else shape("text", { x: 0, y: 11, "font-size": 10, fill: palette.ours }), (svg.lastChild.textContent = "C12");
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
  letters.replaceChildren(...groups.map(({ letter, meaning, colour }) => {
    const svg = svgElement("svg", { width: 16, height: 12 });
    svg.append(svgElement("rect", { x: 1, y: 1, width: 14, height: 10, rx: 1.5, fill: colour ?? palette.ours, "fill-opacity": colour ? 0.6 : 0.25, stroke: palette.ours, "stroke-width": 1.5 }));
    return element("span", "", svg, element("b", "", letter), ` ${meaning}`);
  }));
}
