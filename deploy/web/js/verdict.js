// What matters first: is all well, and with what. And what to do where nothing can be shown.

import { shortened } from "./labels.js";

const STALE_MS = 3000;
/** Letters of the network's name that are shown: those of v2x demo have 21. */
const MOST_LETTERS = 14;
/** The name of a hub that was given none says nothing. */
const USUAL_HUB = "hub";
/** A number and its unit stay on one line. */
const NBSP = "\u00a0";

/** The state of the network in a word, its reason, and how bad it is. */
export function verdict(store, hubs) {
  if (!store.online) return { level: "bad", word: "Page is cut off", why: "the program that serves this page has ended" };
  if (!store.connection?.connected) return { level: "warn", word: "No hub yet", why: "" };
  if (!hubs.some((hub) => hub.frames.newest)) return { level: "warn", word: "Waiting", why: "no list of objects so far" };
  const gone = hubs.filter((hub) => store.isGone(hub.name));
  if (gone.length) return { level: "bad", word: "Hub is gone", why: `what is shown of ${names(gone)} is its last list` };
  if (store.paused) return { level: "warn", word: "Paused", why: `${store.held} newer frames skipped` };
  return troubleOf(store, hubs, store.now()) ?? allWell(store.hello);
}

/** What is not well with hubs and agents that are there; null where all is. */
function troubleOf(store, hubs, now) {
  const age = (each) => now - (each.frames.newest?.received ?? now);
  const stale = hubs.filter((hub) => age(hub) > STALE_MS);
  if (stale.length) return { level: "bad", word: "No new list", why: `${names(stale)}: for ${seconds(Math.max(...stale.map(age)))}` };
  const agents = [...store.agents.values()];
  const silent = agents.filter((agent) => age(agent) > STALE_MS);
  if (silent.length) return { level: "warn", word: "Agent silent", why: names(silent) };
  const refused = agents.filter((agent) => now - agent.lastRefusedAt < 5000);
  if (refused.length) return { level: "warn", word: "Frames refused", why: refusalsOf(store, refused, now) };
  return null;
}

function allWell({ scenario, network }) {
  const said = (name) => (scenario && scenario !== network ? `${scenario}, network ${name}` : `network ${name}`);
  return { level: "good", word: "All well", why: said(shortened(network, MOST_LETTERS)), whole: said(network) };
}

function names(list) {
  const all = list.map((each) => each.name);
  return all.length > 3 ? `${all.slice(0, 3).join(", ")} and ${all.length - 3} more` : all.join(", ");
}

/** Whose frames are refused, and why where the hub has said it. */
function refusalsOf(store, agents, now) {
  const newest = store.events.filter((event) => event.level === "refused" && now - event.at < 5000);
  const reasons = [...new Set(newest.map((event) => event.text.replace(/ ×\d+$/, "")))];
  const whose = agents.length > 1 && agents.length === store.agents.size ? "all agents" : names(agents);
  return reasons.length ? `${reasons.join(", ")}: ${whose}` : `of ${whose}`;
}

/** Mean errors against truth, of each list and of the agents alone. */
function errors(store, hubs, time) {
  const alone = [...store.agents.values()].map((agent) => agent.error.recent(time)).filter(Number.isFinite);
  if (!alone.length || !hubs.some((hub) => Number.isFinite(hub.error.recent(time)))) return [];
  const mean = (alone.reduce((sum, each) => sum + each, 0) / alone.length).toFixed(2);
  return [["error fused / mean agent", hubs.map((hub) => `${fixed(hub.error.recent(time), 2)} / ${mean}${NBSP}m`)]];
}

const fixed = (value, digits) => (Number.isFinite(value) ? value.toFixed(digits) : "–");

function seconds(ms) {
  return `${Math.round(ms / 1000)}${NBSP}s`;
}

/** Name and values of what the header says: one value, or one of each hub that is shown. */
export function facts(store, hubs, time) {
  const alive = [...store.agents.keys()].filter((name) => store.isAlive(name)).length;
  const ofEach = (value) => (hubs.length ? hubs.map(value) : ["–"]);
  const inHub = ({ latency_ms: latency }) => `${fixed(latency.p50 ?? NaN, 1)} / ${fixed(latency.p95 ?? NaN, 1)}${NBSP}ms`;
  return [
    ...(hubs.length > 1 || hubs[0]?.name !== USUAL_HUB ? [[hubs.length > 1 ? "hubs" : "hub", ofEach((hub) => shortened(hub.name, MOST_LETTERS))]] : []),
    ["objects", ofEach((hub) => String(hub.frames.at(time)?.n ?? "–"))],
    ["agents alive", [`${alive} of ${store.agents.size}`]],
    ...errors(store, hubs, time),
    ["time in hub p50 / p95", ofEach((hub) => (hub.status ? inHub(hub.status) : "–"))],
    [`refused in 60${NBSP}s`, ofEach((hub) => refused(hub, time))],
  ];
}

/** Frames that a hub has refused in the last minute, and since it started where that is another number. */
function refused(hub, time) {
  if (!hub.counts.size) return "–";
  const recent = [...hub.refusals.values()].reduce((sum, series) => sum + series.total(time), 0);
  const all = [...hub.counts.values()].reduce((sum, each) => sum + each.refused, 0);
  return all > recent ? `${recent} (${all} in all)` : String(recent);
}

export function total(counts) {
  return Object.values(counts).reduce((sum, count) => sum + count, 0);
}

/** What is waited for and what to do; null where there is a picture. */
export function emptyState(store, hub) {
  const network = store.hello?.network;
  if (!store.online) {
    return { title: "Not connected to the program", text: "It has ended, or is being started again. This page connects by itself.", command: "v2x watch --web" };
  }
  if (!store.connection?.connected) {
    const at = store.connection?.endpoints.join(", ") ?? "";
    return { title: "Waiting for a hub", text: `No hub or router answers at ${at} so far. Start a network, or give v2x watch the right --connect.`, command: "v2x up crossing" };
  }
  if (hub?.frames.newest) return null;
  if (!store.presence?.hubs.size) {
    return { title: "Waiting for a hub", text: `Connected, but no hub of the network “${network}” is there. Is --network right?`, command: `v2x hub --network ${network}` };
  }
  if (!store.presence.agents.size) {
    return { title: "Waiting for agents", text: `The hub is there. No agent of the network “${network}” is.`, command: `v2x agent --network ${network} --scenario deploy/scenarios/crossing.toml --id ego` };
  }
  return { title: "Waiting for the first list", text: "Hub and agents are there; the hub has published nothing yet.", command: "" };
}
