// Everything that is known, from the messages of the program.
//
// Positions are kept relative to an origin near the first one, so that single precision holds them anywhere on a map.

import { groupsOf } from "./classes.js";
import { History, SPAN_MS, memory } from "./frames.js";
import { Series } from "./series.js";
import { compared } from "./truth.js";

/** Numbers of one object, and their places. */
export const OBJECT = { size: 19, class: 0, x: 1, y: 2, w: 3, d: 4, yaw: 5, vx: 6, vy: 7, xx: 8, xy: 9, yy: 10,
  existence: 11, age: 12, since: 13, sYaw: 14, sW: 15, sD: 16, sVx: 17, sVy: 18 };
/** Of one detection. */
export const DETECTION = { size: 10, class: 0, score: 1, x: 2, y: 3, w: 4, d: 5, yaw: 6, xx: 7, xy: 8, yy: 9 };
/** Of one true object. */
export const TRUTH = { size: 9, id: 0, class: 1, x: 2, y: 3, w: 4, d: 5, yaw: 6, vx: 7, vy: 8 };

const MAX_STREAMS = 512;
const TRAIL_POINTS = 300;
const TRAIL_STEP_MS = 200;
/** A track with more points has been there for more than a second. */
const LASTING_POINTS = 5;
const MAX_TRAILS = 4000;
const MAX_EVENTS = 64;

class Agent {
  constructor(name, number) {
    this.name = name;
    this.number = number;
    this.frames = new History();
    this.sensor = null;
    /** When its first frame came, and when anything of it did, ms. */
    this.since = NaN;
    this.seen = -Infinity;
    this.delay = new Series();
    this.error = new Series();
    this.rate = new Series();
    /** Detections of a frame. */
    this.reports = new Series();
    this.lastRefusal = null;
    this.lastRefusedAt = -Infinity;
    /** Why, in a few words. */
    this.reason = "";
  }
}

class Hub {
  constructor(name) {
    this.name = name;
    this.frames = new History();
    this.status = null;
    this.seen = -Infinity;
    this.trails = new Map();
    this.latency = new Series();
    this.inHub = new Series();
    this.age = new Series();
    this.error = new Series();
    this.objects = new Series();
    /** True objects in the agents' fields of view, those of them that the list lacks, and objects that are not there, of each list. */
    this.covered = new Series();
    this.missed = new Series();
    this.extra = new Series();
    /** Frames that were accepted, of all agents. */
    this.accepted = new Series();
    /** By agent: frames that were refused, that came out of order, and NIS. */
    this.refusals = new Map();
    this.lates = new Map();
    this.nis = new Map();
    this.counts = new Map();
    this.refusedBefore = new Map();
    this.restarts = 0;
    /** Whether an object keeps its track from list to list, as its trails show since a time, ms. */
    this.keepsTracks = true;
    this.trailsSince = Infinity;
  }
}

export class Store {
  hello = null;
  connection = null;
  presence = null;
  agents = new Map();
  hubs = new Map();
  origin = null;
  online = false;
  paused = false;
  /** Frames that were not shown: while paused, and what the program skipped for this browser. */
  held = 0;
  skipped = 0;
  unknown = 0;
  statusError = null;
  /** Recent late and refused frames: { hub, agent, text, level, at }. */
  events = [];
  /** The group of each class, by its number. */
  groups = new Uint8Array(0);
  #names = [];
  #pausedAt = 0;
  /** When nothing was noted because the page was paused: beginnings and ends, ms. */
  #pauses = [];
  /** The newest time of arrival by the program's clock, ms, and when that was by this page's. */
  #newest = 0;
  #newestHere = 0;
  /** When the first message of an agent or a hub came, ms. */
  #oldest = Infinity;

  handle(message, here) {
    const handler = this[`_${message.t}`];
    if (!handler) { this.unknown += 1; return; }
    handler.call(this, message, here);
  }

  /** The time by the program's clock, ms. */
  now(here = performance.now()) {
    return this.#newest ? this.#newest + (here - this.#newestHere) : 0;
  }

  /** How many seconds of the minute before a time this page has seen. */
  secondsKnown(time) {
    return Math.max(0, Math.min(SPAN_MS, time - this.#oldest)) / 1000;
  }

  #arrived(time, here) {
    this.#oldest = Math.min(this.#oldest, time);
    if (time > this.now(here) || this.#newest === 0) {
      this.#newest = time;
      this.#newestHere = here;
    }
  }

  /** Keeps the last minute as it is: frames and series take nothing in. */
  pause() {
    this.paused = true;
    this.held = 0;
    this.#pausedAt = this.now();
  }

  resume() {
    if (this.paused) this.#pauses.push([this.#pausedAt, this.now()]);
    this.#pauses = this.#pauses.filter(([, end]) => end > this.now() - SPAN_MS);
    this.paused = false;
  }

  /** Whether nothing was noted for a part of a span of time, ms. */
  wasPausedBetween(from, to) {
    return this.#pauses.some(([begin, end]) => begin < to && end > from);
  }

  _hello(message) {
    const isAnother = this.hello && (this.hello.network !== message.network || this.hello.scenario !== message.scenario);
    if (isAnother) this.forget();
    this.hello = message;
    this.groups = groupsOf(message.classes);
  }

  _connection(message) { this.connection = message; }
  _skipped(message) { this.skipped = message.n; }

  _presence(message) {
    this.presence = { hubs: new Set(message.hubs), agents: new Set(message.agents) };
    message.agents.forEach((name) => this.agent(name));
  }

  _sensor(message) {
    const agent = this.agent(message.agent);
    if (agent) agent.sensor = message.description;
  }

  _detections(message, here) {
    this.#arrived(message.received, here);
    const agent = this.agent(message.agent);
    if (!agent) return;
    const { received, captured, sequence } = message;
    agent.seen = received;
    if (this.paused) { this.held += 1; return; }
    if (Number.isNaN(agent.since)) agent.since = received;
    agent.delay.add(received, received - captured);
    agent.rate.add(received, 1);
    if (message.errors) agent.error.add(received, message.errors.mean_m ?? NaN);
    const first = message.pose ?? (message.detections.length ? message.detections.slice(2, 4) : null);
    const origin = this.#originNear(first);
    const values = relative(message.detections, DETECTION, origin);
    const pose = message.pose && { x: message.pose[0] - origin.x, y: message.pose[1] - origin.y, yaw: message.pose[2] };
    const n = values.length / DETECTION.size;
    agent.reports.add(received, n);
    agent.frames.push({ received, captured, sequence, pose, n, values, bytes: values.byteLength + 200 });
  }

  _fused(message, here) {
    this.#arrived(message.received, here);
    const hub = this.hub(message.hub);
    if (!hub) return;
    hub.seen = message.received;
    this.#noteHealth(hub, message);
    if (this.paused) { this.held += 1; return; }
    this.#measure(hub, message);
    const last = hub.frames.newest;
    if (last && last.lineage !== message.lineage) {
      hub.restarts += 1;
      hub.trails.clear();
      hub.trailsSince = message.received;
    }
    const frame = fusedFrame(message, this.#originNear(message.objects.length ? message.objects.slice(1, 3) : null));
    hub.objects.add(frame.received, frame.n);
    if (frame.truth) this.#compare(hub, frame);
    hub.frames.push(frame);
    extendTrails(hub, frame);
  }

  /** Counts what of the truth is missed and what is too much. Agents are where they were when the list was made. */
  #compare(hub, frame) {
    const views = [];
    for (const { sensor, frames } of this.agents.values()) {
      const pose = frames.newest?.pose;
      if (pose && sensor) views.push({ pose, field: sensor.field_of_view });
    }
    // Without a description nobody knows what could be seen.
    if (!views.length) return;
    const counts = compared({ objects: frame.values, layout: OBJECT, truth: frame.truth, trueLayout: TRUTH, radius: this.hello?.radius_m ?? 3, views });
    for (const name of ["covered", "missed", "extra"]) hub[name].add(frame.received, counts[name]);
  }

  #measure(hub, message) {
    const { received } = message;
    for (const [, captured, arrived] of message.includes) {
      hub.latency.add(received, received - captured);
      hub.inHub.add(received, received - arrived);
    }
    let newest = -Infinity;
    // An agent without an accepted frame has no newest one.
    for (const [, accepted, , , captured] of message.agents) if (accepted > 0) newest = Math.max(newest, captured);
    hub.age.add(received, received - newest);
    if (message.errors) hub.error.add(received, message.errors.mean_m ?? NaN);
  }

  #noteHealth(hub, message) {
    for (const [place, accepted, refused, late] of message.agents) {
      const name = message.names[place];
      const before = hub.counts.get(name);
      hub.counts.set(name, { accepted, refused, late, lineage: message.lineage });
      if (!before || before.lineage !== message.lineage) continue;
      if (accepted > before.accepted && !this.paused) hub.accepted.add(message.received, accepted - before.accepted);
      const n = refused - before.refused;
      const agent = n > 0 ? this.agent(name) : null;
      if (agent) {
        if (!this.paused) seriesOf(hub.refusals, name).add(message.received, n);
        agent.lastRefusedAt = agent.seen = message.received;
      }
      if (!(late > before.late)) continue;
      if (!this.paused) seriesOf(hub.lates, name).add(message.received, late - before.late);
      this.#event({ hub: hub.name, agent: name, text: "out of order", level: "late", at: message.received });
    }
  }

  /** Refusals come with their reasons in the status. */
  _status(message) {
    this.statusError = message.error;
    const at = this.now();
    for (const status of message.hubs) {
      const hub = this.hub(status.hub);
      if (!hub) continue;
      hub.status = status;
      for (const each of status.agents) {
        this.#noteReasons(hub, each, status.lineage, at);
        // A hub remembers agents that left long ago.
        const agent = each.alive ? this.agent(each.id) : this.agents.get(each.id);
        if (!agent) continue;
        if (each.nis_per_dof !== null && !this.paused) seriesOf(hub.nis, each.id).add(at, each.nis_per_dof);
        agent.lastRefusal = each.last_refusal;
      }
    }
  }

  #noteReasons(hub, { id, refused }, lineage, at) {
    const before = hub.refusedBefore.get(id);
    hub.refusedBefore.set(id, { lineage, refused });
    if (!before || before.lineage !== lineage) return;
    for (const [reason, count] of Object.entries(refused)) {
      const n = count - (before.refused[reason] ?? 0);
      const text = `${reason.replaceAll("_", " ")}${n > 1 ? ` ×${n}` : ""}`;
      if (n <= 0) continue;
      this.#event({ hub: hub.name, agent: id, text, level: "refused", at });
      const agent = this.agent(id);
      if (agent) Object.assign(agent, { reason: text, lastRefusedAt: at, seen: at });
    }
  }

  #event(event) {
    this.events.push(event);
    if (this.events.length > MAX_EVENTS) this.events.shift();
  }

  /** Agents are numbered by name, so that each keeps its colour whoever comes first; one that left keeps its number. */
  agent(name) {
    const known = this.agents.get(name);
    const agent = known ?? this.#of(this.agents, name, () => new Agent(name, 0));
    if (!agent || known) return agent;
    if (this.#names.length >= MAX_STREAMS) this.#names = [...this.agents.keys()];
    else if (!this.#names.includes(name)) this.#names.push(name);
    this.#names.sort().forEach((each, number) => {
      const numbered = this.agents.get(each);
      if (numbered) numbered.number = number;
    });
    return agent;
  }

  hub(name) {
    return this.#of(this.hubs, name, () => new Hub(name));
  }

  #of(map, name, make) {
    if (!map.has(name) && map.size < MAX_STREAMS) map.set(name, make());
    return map.get(name) ?? null;
  }

  isAlive(agent) {
    return this.presence === null || this.presence.agents.has(agent);
  }

  /** Whether a hub has left the network. */
  isGone(hub) {
    return !this.hubs.has(hub) || (this.presence !== null && !this.presence.hubs.has(hub));
  }

  /** Hubs and agents that left are forgotten when the last minute has nothing of them any more. */
  forgetGone() {
    if (this.paused || !this.online || !this.presence) return;
    const oldest = this.now() - SPAN_MS;
    for (const [name, hub] of this.hubs) {
      if (this.isGone(name) && !(hub.frames.newest?.received > oldest)) drop(this.hubs, name);
    }
    for (const [name, agent] of this.agents) {
      if (!this.isAlive(name) && agent.seen < oldest) drop(this.agents, name);
    }
  }

  #originNear(at) {
    if (!this.origin && at) this.origin = { x: Math.round(at[0] / 100) * 100, y: Math.round(at[1] / 100) * 100 };
    return this.origin ?? { x: 0, y: 0 };
  }

  /** Another network: nothing of the old one is shown. */
  forget() {
    [...this.agents.values(), ...this.hubs.values()].forEach((each) => each.frames.clear());
    this.agents.clear();
    this.hubs.clear();
    this.#names = [];
    this.events = [];
    this.#oldest = Infinity;
    this.origin = null;
    this.presence = null;
  }

  get memoryBytes() { return memory.bytes; }
}

function drop(map, name) {
  map.get(name).frames.clear();
  map.delete(name);
}

function seriesOf(map, name) {
  if (!map.has(name)) map.set(name, new Series());
  return map.get(name);
}

function relative(numbers, layout, origin) {
  const values = new Float32Array(numbers.length);
  for (let k = 0; k < numbers.length; k += layout.size) {
    for (let field = 0; field < layout.size; field += 1) values[k + field] = numbers[k + field];
    values[k + layout.x] = numbers[k + layout.x] - origin.x;
    values[k + layout.y] = numbers[k + layout.y] - origin.y;
  }
  return values;
}

function fusedFrame(message, origin) {
  const values = relative(message.objects, OBJECT, origin);
  const truth = message.truth && relative(message.truth, TRUTH, origin);
  const contributors = packed(message.contributors);
  return {
    hub: message.hub, lineage: message.lineage, sequence: message.sequence,
    fused: message.fused, received: message.received, errors: message.errors,
    n: message.tracks.length, tracks: message.tracks, values, truth,
    names: message.names, contributors,
    bytes: values.byteLength + (truth?.byteLength ?? 0) + contributors.bytes + 40 * message.tracks.length + 600,
  };
}

/** Contributors in a few bytes each: which frame of a list of frames, and which detection in it. */
function packed(lists) {
  const frames = [];
  const starts = new Uint32Array(lists.length + 1);
  for (let k = 0; k < lists.length; k += 1) starts[k + 1] = starts[k] + (2 * lists[k].length) / 3;
  const items = new Uint16Array(starts[lists.length]);
  let next = 0;
  for (const list of lists) {
    for (let at = 0; at < list.length; at += 3) {
      let place = frames.length - 1;
      // The frames of a list are few: each agent's newest ones.
      while (place >= 0 && !(frames[place][1] === list[at + 1] && frames[place][0] === list[at])) place -= 1;
      if (place < 0) place = frames.push([list[at], list[at + 1]]) - 1;
      items[next] = place;
      items[next + 1] = list[at + 2];
      next += 2;
    }
  }
  return { frames, starts, items, bytes: starts.byteLength + items.byteLength + 64 * frames.length };
}

function extendTrails(hub, frame) {
  for (let k = 0; k < frame.n; k += 1) {
    let trail = hub.trails.get(frame.tracks[k]);
    if (!trail) {
      if (hub.trails.size >= MAX_TRAILS) continue;
      trail = { points: new Float32Array(2 * TRAIL_POINTS), times: new Float64Array(TRAIL_POINTS), n: 0, seen: 0 };
      hub.trails.set(frame.tracks[k], trail);
    }
    trail.seen = frame.received;
    const last = trail.n ? trail.times[(trail.n - 1) % TRAIL_POINTS] : -Infinity;
    if (frame.received - last < TRAIL_STEP_MS) continue;
    const place = trail.n % TRAIL_POINTS;
    trail.points[2 * place] = frame.values[k * OBJECT.size + OBJECT.x];
    trail.points[2 * place + 1] = frame.values[k * OBJECT.size + OBJECT.y];
    trail.times[place] = frame.received;
    trail.n += 1;
  }
  hub.trailsSince = Math.min(hub.trailsSince, frame.received);
  const isJudged = frame.n > 0 && frame.received - hub.trailsSince > 2000;
  if (isJudged) hub.keepsTracks = frame.tracks.some((track) => hub.trails.get(track)?.n > LASTING_POINTS);
  if (frame.sequence % 50 === 0) {
    for (const [track, trail] of hub.trails) if (trail.seen < frame.received - 60_000) hub.trails.delete(track);
  }
}

/** Calls `visit` with the points of a trail in a span of time, from the newest back. */
export function eachTrailPoint(trail, from, to, visit) {
  for (let k = trail.n - 1; k >= Math.max(0, trail.n - TRAIL_POINTS); k -= 1) {
    const place = k % TRAIL_POINTS;
    if (trail.times[place] < from) return;
    if (trail.times[place] <= to) visit(trail.points[2 * place], trail.points[2 * place + 1]);
  }
}
