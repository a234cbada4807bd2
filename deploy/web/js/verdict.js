// What matters first: is all well, and with what. And what to do where nothing can be shown.

import { shortened } from "./labels.js";

const STALE_MS = 3000;
/** Letters of the network's name that are shown: those of v2x demo have 21. */
const MOST_LETTERS = 14;
/** The name of a hub that was given none says nothing. */
const USUAL_HUB = "hub";
/** For so many seconds fused objects have to be no better than the agents alone before it is said; and what is no better, as a share of the agents' error. */
const LASTING_S = 8;
const NO_BETTER = 0.95;
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
  return troubleOf(store, hubs, store.now()) ?? noGain(store, hubs) ?? allWell(store, hubs);
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

/** Hubs whose objects are, for some seconds, no nearer to the truth than those of the mean agent alone; null where there are none. */
function noGain(store, hubs) {
  const now = store.now();
  const alone = meanOf(store, (agent) => agent.error.lasting(now, LASTING_S));
  const poor = hubs.map((hub) => ({ name: hub.name, error: hub.error.lasting(now, LASTING_S) })).filter(({ error }) => error >= NO_BETTER * alone);
  if (!poor.length) return null;
  const why = `${poor.map(({ name, error }) => `${shortened(name, MOST_LETTERS)} ${error.toFixed(2)}`).join(", ")}, agent ${alone.toFixed(2)}${NBSP}m`;
  return { level: "warn", word: "Fused no better", why, whole: `Error of the fused objects over ${LASTING_S} s, and of the mean agent alone: ${why}` };
}

/** Without truth nobody can say that all is well: only that all is running. What was judged is said where there is room. */
function allWell({ hello: { scenario, network } }, hubs) {
  const said = (name) => (scenario && scenario !== network ? `${scenario}, network ${name}` : `network ${name}`);
  const hasTruth = hubs.some((hub) => hub.frames.newest?.truth);
  const judged = hasTruth ? ", and fused objects are nearer to the truth than those of the mean agent" : "; without truth the fused objects are not judged";
  return {
    level: "good", word: hasTruth ? "All well" : "Running", why: said(shortened(network, MOST_LETTERS)),
    whole: `${said(network)}: hubs and agents send, no frame is refused${judged}`,
  };
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
  const alone = meanOf(store, (agent) => agent.error.recent(time));
  if (!Number.isFinite(alone) || !hubs.some((hub) => Number.isFinite(hub.error.recent(time)))) return [];
  const radius = store.hello?.radius_m ?? 3;
  return [["error fused / mean agent", hubs.map((hub) => `${fixed(hub.error.recent(time), 2)} / ${alone.toFixed(2)}${NBSP}m`),
    `Mean distance to the nearest true object, of those that have one within ${radius} m; the agents' errors are averaged`]];
}

/** Against truth, one to one: what could be seen, and what of it each list lacks or has too much. */
function comparisons(hubs, time) {
  if (!hubs.some((hub) => Number.isFinite(hub.covered.recent(time)))) return [];
  const of = (hub) => ["covered", "missed", "extra"].map((name) => fixed(hub[name].recent(time), 0)).join(" / ");
  return [[`true${NBSP}/${NBSP}missed / extra`, hubs.map(of),
    "True objects in the agents' fields of view, also those that something hides; those of them that the list lacks; and objects of the list without a true one of their own, as a second box on one car"]];
}

function meanOf({ agents }, pick) {
  const known = [...agents.values()].map(pick).filter(Number.isFinite);
  return known.reduce((sum, each) => sum + each, 0) / known.length;
}

const fixed = (value, digits) => (Number.isFinite(value) ? value.toFixed(digits) : "–");

function seconds(ms) {
  return `${Math.round(ms / 1000)}${NBSP}s`;
}

/** Name, values and explanation of what the header says: one value, or one of each hub that is shown. */
export function facts(store, hubs, time) {
  const alive = [...store.agents.keys()].filter((name) => store.isAlive(name)).length;
  const ofEach = (value) => (hubs.length ? hubs.map(value) : ["–"]);
  const inHub = ({ latency_ms: latency }) => `${fixed(latency.p50 ?? NaN, 1)} / ${fixed(latency.p95 ?? NaN, 1)}${NBSP}ms`;
  return [
    ...(hubs.length > 1 || hubs[0]?.name !== USUAL_HUB ? [[hubs.length > 1 ? "hubs" : "hub", ofEach((hub) => shortened(hub.name, MOST_LETTERS))]] : []),
    ["objects", ofEach((hub) => fixed(hub.objects.recent(time), 0)), "Mean number over a second"],
    ...comparisons(hubs, time),
    ["agents alive", [`${alive} of ${store.agents.size}`]],
    ...errors(store, hubs, time),
    ["time in hub p50 / p95", ofEach((hub) => (hub.status ? inHub(hub.status) : "–"))],
    [`refused in ${Math.round(store.secondsKnown(time))}${NBSP}s`, ofEach((hub) => refused(hub, time)), sinceStart(hubs)],
  ];
}

/** Frames that a hub has refused in the last minute, or since the page is open, and their share of those that came. */
function refused(hub, time) {
  if (!hub.counts.size) return "–";
  const recent = [...hub.refusals.values()].reduce((sum, series) => sum + series.total(time), 0);
  const share = (100 * recent) / (recent + hub.accepted.total(time));
  return recent ? `${recent}, ${share < 1 ? "under 1" : Math.round(share)}${NBSP}%` : "0";
}

function sinceStart(hubs) {
  const all = (hub) => [...hub.counts.values()].reduce((sum, each) => sum + each.refused, 0);
  return `Since the start: ${hubs.map((hub) => `${hub.name} ${all(hub)}`).join(", ")}`;
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
