// The page: messages in, one drawing for each frame of the screen that has something new.

import { Camera } from "./camera.js";
import { Charts } from "./charts.js";
import { follow } from "./feed.js";
import * as gestures from "./gestures.js";
import * as keyboard from "./keyboard.js";
import { layers } from "./layers.js";
import { restoreTheme, toggleTheme, readPalette } from "./palette.js";
import { showAgents, showLayers, showSelected } from "./panel.js";
import { Scene, contributorsOf } from "./scene.js";
import { OBJECT, Store } from "./store.js";
import { Timeline } from "./timeline.js";
import { noteFrame, timing } from "./timing.js";
import { emptyState, facts, verdict } from "./verdict.js";

const PANEL_EVERY_MS = 500;
/** New data is drawn at most so often; what the user does is drawn at once. */
const DRAW_EVERY_MS = 30;
const REACH_PIXELS = 18;
const $ = (id) => document.getElementById(id);

class View {
  store = new Store();
  camera = new Camera();
  selection = null;
  isFollowing = false;
  #chosenHubs = [null, null];
  #isDirty = true;
  #hasNews = true;
  #drawnAt = -Infinity;
  #panelAt = -Infinity;
  #chartsAt = -Infinity;
  #fitted = 0;

  constructor() {
    restoreTheme();
    this.scene = new Scene($("canvas"), this.store, this.camera);
    this.charts = new Charts($("charts"));
    this.timeline = new Timeline(this.store, () => this.changed());
    gestures.listen($("canvas"), this.camera, {
      onChange: () => this.changed(),
      onMove: () => { this.isFollowing = false; },
      onClick: (x, y) => this.#click(x, y),
    });
    keyboard.listen(this);
    keyboard.fillHelp($("keys"));
    this.#wire();
    follow(this.store, () => { this.#hasNews = true; });
    new ResizeObserver(() => this.#resized()).observe($("map"));
    requestAnimationFrame(() => this.#tick());
    // A tab in the background draws nothing; it starts again with what is new.
    setInterval(() => { this.#hasNews = true; }, 1000);
  }

  #wire() {
    $("theme").addEventListener("click", () => this.toggleTheme());
    $("help-open").addEventListener("click", () => this.openHelp());
    $("zoom-in").addEventListener("click", () => this.zoom(1.4));
    $("zoom-out").addEventListener("click", () => this.zoom(1 / 1.4));
    $("fit").addEventListener("click", () => this.fit());
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { readPalette(); this.#recolour(); });
    ["hub-left", "hub-right"].forEach((id, k) => $(id).addEventListener("change", (event) => {
      this.#chosenHubs[k] = event.target.value;
      this.changed();
    }));
    this.#recolour();
  }

  #recolour() {
    showLayers($("layers"), $("letters"), () => this.changed());
    this.changed();
  }

  /** Something is to be drawn, and the panel with it. */
  changed() {
    this.#isDirty = true;
    this.#panelAt = -Infinity;
    this.#chartsAt = -Infinity;
  }

  get time() { return this.timeline.time; }

  /** The hubs that are shown: one, or two side by side. */
  get hubs() {
    const names = [...this.store.hubs.values()].filter((hub) => hub.frames.newest || hub.status).map((hub) => hub.name).sort();
    const alive = names.filter((name) => this.store.presence?.hubs.has(name) ?? true);
    const order = alive.length ? alive : names;
    const left = names.includes(this.#chosenHubs[0]) ? this.#chosenHubs[0] : order[0];
    const second = this.#chosenHubs[1] ?? order.find((name) => name !== left);
    return [left, second].filter((name, k, all) => names.includes(name) && all.indexOf(name) === k).map((name) => this.store.hubs.get(name));
  }

  #tick() {
    requestAnimationFrame(() => this.#tick());
    const begun = performance.now();
    if (!this.#isDirty && !(this.#hasNews && begun - this.#drawnAt >= DRAW_EVERY_MS)) return;
    this.#isDirty = false;
    this.#hasNews = false;
    this.#drawnAt = begun;
    this.#draw(begun);
    noteFrame(performance.now() - begun);
  }

  #draw(here) {
    const hubs = this.hubs;
    this.timeline.hub = hubs[0];
    const time = this.time;
    this.#fitByItself(hubs, time);
    if (this.isFollowing) this.#centreOnSelected(hubs, time);
    const moves = this.scene.draw(time, hubs, this.selection);
    if (moves && !this.store.paused) this.#hasNews = true;
    // In turn, so that no single frame takes long.
    if (here - this.#panelAt >= PANEL_EVERY_MS) {
      this.#panelAt = here;
      this.#showPanel(hubs, time);
    } else if (here - this.#chartsAt >= PANEL_EVERY_MS) {
      this.#chartsAt = here;
      const hasTruth = Boolean(hubs[0]?.frames.newest?.truth);
      this.charts.draw({ agents: this.store.agents, shown: hubs, time, hasTruth });
    }
  }

  #showPanel(hubs, time) {
    const { store } = this;
    showVerdict(verdict(store, hubs[0], time), facts(store, hubs[0], time));
    showEmpty(emptyState(store, hubs[0]));
    showSelected($("selected-body"), this);
    showAgents($("agents-body"), this);
    this.#showHubs(hubs);
    this.timeline.show();
    const { median, p95 } = timing();
    const skipped = store.skipped ? ` · ${store.skipped} skipped` : "";
    $("stats").textContent = `script ${median.toFixed(1)} / ${p95.toFixed(1)} ms${skipped}`;
  }

  #showHubs(hubs) {
    const names = [...this.store.hubs.keys()].sort();
    $("hubs").hidden = names.length < 2;
    [["hub-left", hubs[0]?.name ?? ""], ["hub-right", hubs[1]?.name ?? ""]].forEach(([id, chosen], k) => {
      const options = k === 1 ? ["", ...names] : names;
      const select = $(id);
      if ([...select.options].map((option) => option.value).join() !== options.join()) {
        select.replaceChildren(...options.map((name) => new Option(name || "none", name)));
      }
      if (document.activeElement !== select) select.value = chosen;
    });
  }

  #bounds(hubs, time) {
    const box = { left: Infinity, right: -Infinity, bottom: Infinity, top: -Infinity };
    const add = (x, y, reach) => {
      box.left = Math.min(box.left, x - reach);
      box.right = Math.max(box.right, x + reach);
      box.bottom = Math.min(box.bottom, y - reach);
      box.top = Math.max(box.top, y + reach);
    };
    for (const hub of hubs) {
      const frame = hub.frames.at(time);
      for (let k = 0; k < (frame?.values.length ?? 0); k += OBJECT.size) add(frame.values[k + OBJECT.x], frame.values[k + OBJECT.y], 5);
    }
    for (const agent of this.store.agents.values()) {
      const pose = agent.frames.at(time)?.pose;
      if (pose) add(pose.x, pose.y, 12);
    }
    return Number.isFinite(box.left) ? box : null;
  }

  /** Until the user moves the map, the first seconds decide what is in it. */
  #fitByItself(hubs, time) {
    if (this.camera.moved || this.isFollowing || this.#fitted > 12) return;
    const bounds = this.#bounds(hubs, time);
    if (!bounds || performance.now() - (this.fittedAt ?? -Infinity) < 250) return;
    this.fittedAt = performance.now();
    this.#fitted += 1;
    this.#fitTo(bounds);
  }

  #fitTo(bounds) {
    const n = Math.max(1, this.scene.panes.length);
    const { width, height } = this.scene;
    const isTall = n > 1 && width < 640;
    this.camera.fit(bounds, isTall ? width : width / n, isTall ? height / n : height);
  }

  #resized() {
    this.scene.resize($("map").clientWidth, $("map").clientHeight);
    this.#fitted = Math.min(this.#fitted, 11);
    this.changed();
  }

  fit() {
    this.isFollowing = false;
    this.#fitTo(this.#bounds(this.hubs, this.time));
    this.changed();
  }

  zoom(factor) { this.camera.zoom(factor); this.changed(); }
  pan([dx, dy]) { this.isFollowing = false; this.camera.pan(dx, dy); this.changed(); }
  togglePause() { this.timeline.toggle(); }
  goLive() { this.timeline.goLive(); }
  step(direction) { this.timeline.step(direction); }
  openHelp() { $("help").showModal(); }
  toggleTheme() { toggleTheme(); this.#recolour(); }

  select(selection) {
    this.selection = selection;
    if (!selection) this.isFollowing = false;
    this.changed();
  }

  toggleFollow() {
    this.isFollowing = !this.isFollowing && Boolean(this.selection);
    this.changed();
  }

  selectNext(direction) {
    const hub = this.hubs[0];
    const frame = hub?.frames.at(this.time);
    if (!frame?.n) return;
    const k = this.selection?.hub === hub.name ? frame.tracks.indexOf(this.selection.track) : direction > 0 ? -1 : 0;
    this.select({ hub: hub.name, track: frame.tracks[(k + direction + frame.n) % frame.n] });
  }

  #centreOnSelected(hubs, time) {
    const at = this.#placeOfSelected(hubs, time);
    if (!at) return;
    this.camera.x = at.x;
    this.camera.y = at.y;
  }

  #placeOfSelected(hubs, time) {
    const { hub: name, track, agent } = this.selection ?? {};
    if (agent) return this.store.agents.get(agent)?.frames.at(time)?.pose ?? null;
    const frame = hubs.find((hub) => hub.name === name)?.frames.at(time);
    const k = frame ? frame.tracks.indexOf(track) : -1;
    return k < 0 ? null : { x: frame.values[k * OBJECT.size + OBJECT.x], y: frame.values[k * OBJECT.size + OBJECT.y] };
  }

  /** Selects what is nearest: an object, or an agent's arrow. */
  #click(x, y) {
    $("canvas").focus({ preventScroll: true });
    const pane = this.scene.panes.find(({ view }) => x >= view.left && x < view.left + view.width && y >= view.top && y < view.top + view.height);
    if (!pane) return;
    const { view, hub, frame, agents } = pane;
    let [best, found] = [REACH_PIXELS, null];
    const offer = (px, py, allowance, selection) => {
      const distance = Math.hypot(view.x(px) - x, view.y(py) - y) - allowance;
      if (distance < best) [best, found] = [distance, selection];
    };
    for (let k = 0; layers.fused && k < (frame?.n ?? 0); k += 1) {
      const at = k * OBJECT.size;
      const reach = Math.min(frame.values[at + OBJECT.w], frame.values[at + OBJECT.d]) * 0.5 * view.scale;
      offer(frame.values[at + OBJECT.x], frame.values[at + OBJECT.y], reach, { hub: hub.name, track: frame.tracks[k] });
    }
    for (const { agent, frame: own } of agents) {
      if (own.pose) offer(own.pose.x, own.pose.y, 4, { agent: agent.name });
    }
    this.select(found);
  }
}

function showVerdict({ level, word, why }, pairs) {
  $("verdict").dataset.level = level;
  if ($("verdict-word").textContent !== word) $("verdict-word").textContent = word;
  $("verdict-why").textContent = why;
  const list = $("facts");
  if (list.children.length !== pairs.length) {
    list.replaceChildren(...pairs.map(() => {
      const pair = document.createElement("div");
      pair.append(document.createElement("dt"), document.createElement("dd"));
      return pair;
    }));
  }
  pairs.forEach(([name, value], k) => {
    list.children[k].children[0].textContent = name;
    list.children[k].children[1].textContent = value;
  });
}

function showEmpty(state) {
  $("empty").hidden = state === null;
  if (!state) return;
  $("empty").children[0].textContent = state.title;
  $("empty").children[1].textContent = state.text;
  $("empty").children[2].textContent = state.command;
}

const view = new View();

/** For tests and for the curious: what is shown, and what it costs. */
window.v2x = {
  get stats() {
    return { ...timing(), memoryBytes: view.store.memoryBytes, skipped: view.store.skipped, held: view.store.held };
  },
  /** The list that is shown of each hub. */
  get shown() {
    return view.scene.panes.filter((pane) => pane.frame).map(({ hub, frame }) => ({
      hub: hub.name, lineage: frame.lineage, sequence: frame.sequence, objects: frame.n, tracks: [...frame.tracks], restarts: hub.restarts,
    }));
  },
  get state() {
    const { store, selection } = view;
    const pane = view.scene.panes.find((each) => each.hub?.name === selection?.hub);
    const k = pane?.frame ? pane.frame.tracks.indexOf(selection.track) : -1;
    return {
      online: store.online, paused: store.paused, time: view.time, selection, agents: [...store.agents.keys()], events: [...store.events],
      contributors: k < 0 ? [] : contributorsOf(store, pane.frame, k).map(({ agent, detection }) => ({ agent: agent.name, isDrawn: detection !== null })),
    };
  },
  /** Where the agents are in the first picture, in pixels. */
  get agentPlaces() {
    const { view: projection, agents } = view.scene.panes[0];
    return agents.filter(({ frame }) => frame.pose).map(({ frame }) => ({ x: projection.x(frame.pose.x), y: projection.y(frame.pose.y) }));
  },
  /** Where an object of the first picture is on the canvas, in pixels. */
  placeOf(k) {
    const { view: projection, frame } = view.scene.panes[0];
    return { x: projection.x(frame.values[k * OBJECT.size + OBJECT.x]), y: projection.y(frame.values[k * OBJECT.size + OBJECT.y]) };
  },
};
