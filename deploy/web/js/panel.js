// The side panel: what is selected, and the agents.

import { markNode } from "./marks.js";
import { button, element, renew, rows } from "./nodes.js";
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
  const pm = (field, digits = 2) => `\u00a0±\u00a0${value(field).toFixed(digits)}`;
  const table = rows([
    ["track", frame.tracks[k]],
    ["position\u00a0m", `${(value("x") + origin.x).toFixed(2)}, ${(value("y") + origin.y).toFixed(2)}`],
    ["±\u00a0m (1σ)", `${Math.sqrt(value("xx")).toFixed(2)}, ${Math.sqrt(value("yy")).toFixed(2)}`],
    ["speed\u00a0m/s", Math.hypot(value("vx"), value("vy")).toFixed(1) + `\u00a0±\u00a0${Math.hypot(value("sVx"), value("sVy")).toFixed(1)}`],
    ["heading\u00a0°", `${degrees(value("yaw"))}\u00a0±\u00a0${degrees(value("sYaw"))}`],
    ["width\u00a0m", value("w").toFixed(2) + pm("sW")],
    ["length\u00a0m", value("d").toFixed(2) + pm("sD")],
    ["exists, probability", `${(100 * value("existence")).toFixed(1)}\u00a0%`],
    ["tracked for\u00a0s", value("age").toFixed(1)],
    ["newest measurement", `${Math.round(value("since"))}\u00a0ms before`],
  ]);
  const found = contributorsOf(store, frame, k);
  const list = element("table");
  list.id = "contributors";
  const head = list.insertRow();
  head.append(element("th", "", "contributor"), element("th", "", "link\u00a0ms"), element("th", "", "age\u00a0ms"), element("th", "", "distance\u00a0m"));
  for (const { agent, detection, delay, captured } of found) {
    const row = list.insertRow();
    const off = detection ? Math.hypot(detection.x - value("x"), detection.y - value("y")).toFixed(2) : "–";
    row.append(
      element("td", "", markNode(agent), agent.name),
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
    ["declared rate", sensor ? `${sensor.rate_hz}\u00a0Hz` : "–"],
    ["view", sensor ? `${sensor.field_of_view.range_max_m}\u00a0m, ${Math.round((sensor.field_of_view.width_rad * 180) / Math.PI)}°` : "–"],
    ["frames accepted", status ? String(status.accepted) : "–"],
    ["out of order", status ? String(status.out_of_sequence) : "–"],
    ["refused", status ? String(total(status.refused)) : "–"],
    ["NIS", status?.nis_per_dof != null ? status.nis_per_dof.toFixed(2) : "–"],
  ];
  for (const [reason, count] of Object.entries(status?.refused ?? {})) pairs.push([`· ${reason.replaceAll("_", " ")}`, String(count)]);
  const learnt = status?.learnt?.detection_probability;
  if (learnt != null) pairs.push(["detects", `${Math.round(100 * learnt)}\u00a0%${sensor ? `, declares ${Math.round(100 * sensor.detection_probability)}\u00a0%` : ""}`]);
  if (status?.registration && status.registration.pairs > 0 && !status.registration.reference) {
    const { dx_m: dx, dy_m: dy, dyaw_deg: yaw, clock_ms: clock } = status.registration;
    pairs.push(["pose error\u00a0m", `${dx.toFixed(2)}, ${dy.toFixed(2)}`], ["heading error\u00a0°", yaw.toFixed(2)], ["clock error\u00a0ms", clock.toFixed(0)]);
  }
  const nodes = [heading([markNode(agent), agent.name], view), rows(pairs)];
  if (status?.last_refusal) nodes.push(element("p", "hint", `newest refusal: ${status.last_refusal}`));
  const classes = Object.entries(status?.unmapped_names ?? {}).slice(0, MOST_NAMES);
  if (classes.length) nodes.push(element("p", "hint", `classes that no table knows: ${classes.map(([name, count]) => `${name} (${count})`).join(", ")}`));
  return nodes;
}

/** Lists all agents, each a button that selects it. */
export function showAgents(root, view) {
  const { store } = view;
  const list = [...store.agents.values()].sort((one, other) => one.number - other.number).slice(0, MOST_AGENTS).map((agent) => agentRow(view, agent));
  const whose = view.hubs.length > 1 ? [element("p", "hint whose", `out of order and refused: as ${view.hubs[0].name} counts them`)] : [];
  renew(root, [...(list.length ? list : [element("p", "hint", "none so far")]), ...whose, ...invalidNames(view.hubs[0]?.status)]);
}

function agentRow(view, agent) {
  const { store } = view;
  const delay = agent.delay.recent(view.figuresAt);
  const late = view.hubs[0]?.lates.get(agent.name)?.total(view.figuresAt) ?? 0;
  const made = button("", "select", view.selection?.agent === agent.name);
  made.className = "agent";
  made.dataset.agent = agent.name;
  if (late) made.title = `${late} frames out of order in the last minute, as is usual where links differ; used all the same`;
  // Each in place of another, so that no row changes its height under a pointer; the mark shows the kind, too.
  const isRefused = agent.reason && store.now() - agent.lastRefusedAt < 5000;
  const detections = agent.reports.recent(view.figuresAt);
  const state = store.isAlive(agent.name) ? `${Number.isFinite(detections) ? Math.round(detections) : "–"} detections` : "has left";
  const kind = late ? `${late} out of order` : agent.sensor?.kind ?? "no description";
  const below = element("span", isRefused ? "remark" : "sub", isRefused ? `refused: ${agent.reason}` : kind);
  if (isRefused) below.title = agent.lastRefusal ?? "";
  made.replaceChildren(
    markNode(agent),
    element("b", "", agent.name),
    element("span", "value", Number.isFinite(delay) ? `link ${Math.round(delay)}\u00a0ms` : "–"),
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
