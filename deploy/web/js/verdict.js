// What matters first: is all well, and with what. And what to do where nothing can be shown.

const STALE_MS = 3000;

/** The state of the network in a word, its reason, and how bad it is. */
export function verdict(store, hub, time) {
  if (!store.online) return { level: "bad", word: "Page is cut off", why: "the program that serves this page has ended" };
  if (!store.connection?.connected) return { level: "warn", word: "No hub yet", why: "" };
  const newest = hub?.frames.newest;
  if (!newest) return { level: "warn", word: "Waiting", why: "no list of objects so far" };
  const hubIsGone = store.presence && !store.presence.hubs.has(hub.name);
  if (hubIsGone) return { level: "bad", word: "Hub is gone", why: "what is shown is its last list" };
  if (store.paused) return { level: "warn", word: "Paused", why: `${store.held} newer frames skipped` };
  const now = store.now();
  if (now - newest.received > STALE_MS) return { level: "bad", word: "No new list", why: `for ${seconds(now - newest.received)}` };
  const silent = [...store.agents.values()].filter((agent) => agent.frames.newest && now - agent.frames.newest.received > STALE_MS);
  if (silent.length) return { level: "warn", word: "Agent silent", why: names(silent) };
  const refused = [...store.agents.values()].filter((agent) => now - agent.lastRefusedAt < 5000);
  if (refused.length) return { level: "warn", word: "Frames refused", why: refusalsOf(store, refused, now) };
  const { scenario, network } = store.hello;
  return { level: "good", word: "All well", why: scenario && scenario !== network ? `${scenario}, network ${network}` : `network ${network}` };
}

function names(agents) {
  const all = agents.map((agent) => agent.name);
  return all.length > 3 ? `${all.slice(0, 3).join(", ")} and ${all.length - 3} more` : all.join(", ");
}

/** Whose frames are refused, and why where the hub has said it. */
function refusalsOf(store, agents, now) {
  const newest = store.events.filter((event) => event.level === "refused" && now - event.at < 5000);
  const reasons = [...new Set(newest.map((event) => event.text.replace(/ ×\d+$/, "")))];
  const whose = agents.length > 1 && agents.length === store.agents.size ? "all agents" : names(agents);
  return reasons.length ? `${reasons.join(", ")}: ${whose}` : `of ${whose}`;
}

/** Mean errors against truth, of the list and of the agents alone. */
function errors(store, hub, time) {
  const alone = [...store.agents.values()].map((agent) => agent.error.recent(time)).filter(Number.isFinite);
  const ours = hub ? hub.error.recent(time) : NaN;
  if (!Number.isFinite(ours) || !alone.length) return [];
  const mean = alone.reduce((sum, each) => sum + each, 0) / alone.length;
  return [["error fused / one agent", `${ours.toFixed(2)} / ${mean.toFixed(2)} m`]];
}

function seconds(ms) {
  return `${Math.round(ms / 1000)} s`;
}

/** Name and value of what the header says. */
export function facts(store, hub, time) {
  const frame = hub?.frames.at(time);
  const status = hub?.status;
  const alive = [...store.agents.keys()].filter((name) => store.isAlive(name)).length;
  const refused = status ? status.agents.reduce((sum, agent) => sum + total(agent.refused), 0) : null;
  const ms = (value) => (value === null || value === undefined ? "–" : value.toFixed(1));
  return [
    ["hub", hub?.name ?? "–"],
    ["objects", frame ? String(frame.n) : "–"],
    ["agents alive", `${alive} of ${store.agents.size}`],
    ...errors(store, hub, time),
    ["time in hub p50 / p95", status ? `${ms(status.latency_ms.p50)} / ${ms(status.latency_ms.p95)} ms` : "–"],
    ["refused", refused === null ? "–" : String(refused)],
  ];
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
