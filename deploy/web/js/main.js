// The page: messages in, one drawing for each frame of the screen that has something new.

import { Camera } from "./camera.js";
import { Charts } from "./charts.js";
import { follow } from "./feed.js";
import * as gestures from "./gestures.js";
import { HubChoice } from "./hubs.js";
import * as keyboard from "./keyboard.js";
import { layers, toggleLayer } from "./layers.js";
import { showLayers } from "./legend.js";
import { element, renew } from "./nodes.js";
import { restoreTheme, toggleTheme, readPalette } from "./palette.js";
import { showAgents, showSelected } from "./panel.js";
import { pick } from "./picking.js";
import { probe } from "./probe.js";
import { Readout } from "./readout.js";
import { Scene } from "./scene.js";
import { eachEdgePoint } from "./shapes.js";
import { OBJECT, Store } from "./store.js";
import { Timeline } from "./timeline.js";
import { noteFrame, noteReading, timing } from "./timing.js";
import { emptyState, facts, verdict } from "./verdict.js";

const PANEL_EVERY_MS = 500;
/** New data is drawn at most so often; what the user does is drawn at once. */
const DRAW_EVERY_MS = 30;
/** “Everything” has the fields of view, too, but those of so great a range would make all else small. */
const FARTHEST_VIEW_M = 100;
const $ = (id) => document.getElementById(id);

class View {
  store = new Store();
  camera = new Camera();
  selection = null;
  isFollowing = false;
  /** The agent that is pointed at: on the map, in the list or in a chart. */
  #pointedAt = null;
  #isDirty = true;
  #isChartDirty = false;
  #hasNews = true;
  #drawnAt = -Infinity;
  #panelAt = -Infinity;
  #chartsAt = -Infinity;
  #fitted = 0;
  #wasCoarse = false;
  #nHubs = 0;
  /** The moment of all figures on the map, in the panel and in the charts, ms: one value is the same wherever it stands. */
  figuresAt = 0;

  constructor() {
    restoreTheme();
    this.scene = new Scene($("canvas"), this.store, this.camera);
    this.charts = new Charts($("charts"));
    this.readout = new Readout($("readout"), this.charts, {
      onChange: () => { this.#isChartDirty = true; },
      onHighlight: (agent) => this.pointAt(agent),
      onSeek: (time) => this.timeline.seek(time),
    });
    this.hubChoice = new HubChoice(this.store, () => this.changed());
    this.timeline = new Timeline(this.store, () => this.changed());
    gestures.listen($("canvas"), this.camera, {
      onChange: () => this.changed(),
      onMove: () => { this.isFollowing = false; },
      onClick: (x, y) => this.#click(x, y),
      onPoint: (x, y) => this.#point(x, y),
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
    $("agents-body").addEventListener("click", (event) => {
      const agent = event.target.closest("[data-agent]")?.dataset.agent;
      if (agent) this.select({ agent });
    });
    $("agents-body").addEventListener("pointerover", (event) => this.pointAt(event.target.closest("[data-agent]")?.dataset.agent ?? null));
    $("agents-body").addEventListener("pointerleave", () => this.pointAt(null));
    $("selected-body").addEventListener("click", (event) => { if (event.target.closest("[data-action=follow]")) this.toggleFollow(); });
    this.#recolour();
  }

  #recolour() {
    showLayers({ layers: $("layers"), letters: $("letters") }, { isCoarse: this.camera.isCoarse, nHubs: this.#nHubs }, () => this.changed());
    this.changed();
  }

  /** Something is to be drawn, and the panel with it. */
  changed() {
    this.#isDirty = true;
    this.#panelAt = -Infinity;
    this.#chartsAt = -Infinity;
  }

  get time() { return this.timeline.time; }

  get hubs() { return this.hubChoice.shown; }

  /** The agent that stands out. */
  get highlighted() { return this.#pointedAt ?? this.selection?.agent ?? null; }

  pointAt(agent) {
    if (agent === this.#pointedAt) return;
    this.#pointedAt = agent;
    this.#isDirty = this.#isChartDirty = true;
  }

  #tick() {
    requestAnimationFrame(() => this.#tick());
    const begun = performance.now();
    if (this.#isChartDirty) this.#paintCharts();
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
    if (this.#wasCoarse !== this.camera.isCoarse || this.#nHubs !== hubs.length) {
      // What hubs come and go decides how their pictures are laid out.
      if (this.#nHubs !== hubs.length) {
        this.#fitted = Math.min(this.#fitted, 11);
        this.scene.arrange(this.#bounds(hubs, time), hubs.length);
      }
      this.#wasCoarse = this.camera.isCoarse;
      this.#nHubs = hubs.length;
      $("map").classList.toggle("has-titles", hubs.length > 1);
      this.#recolour();
    }
    const isPanelDue = here - this.#panelAt >= PANEL_EVERY_MS;
    if (isPanelDue) this.figuresAt = time;
    const moves = this.scene.draw(time, hubs, { selection: this.selection, highlighted: this.highlighted, figuresAt: this.figuresAt });
    if (moves && !this.store.paused) this.#hasNews = true;
    // In turn, so that no single frame takes long.
    if (isPanelDue) {
      this.#panelAt = here;
      this.#chartsAt = -Infinity;
      this.#showPanel(hubs, time);
    } else if (here - this.#chartsAt >= PANEL_EVERY_MS) {
      this.#chartsAt = here;
      this.charts.highlighted = this.highlighted;
      this.charts.draw({ store: this.store, shown: hubs, time: this.store.paused ? this.timeline.end : this.figuresAt, cursor: this.figuresAt });
      this.readout.update();
    }
  }

  #paintCharts() {
    const begun = performance.now();
    this.#isChartDirty = false;
    this.charts.highlighted = this.highlighted;
    this.charts.paint();
    noteReading(performance.now() - begun);
  }

  #showPanel(hubs, time) {
    const { store } = this;
    store.forgetGone();
    showVerdict(verdict(store, hubs));
    showFacts(facts(store, hubs, time));
    showEmpty(emptyState(store, hubs[0]));
    this.charts.say({ store, shown: hubs, at: this.figuresAt });
    showSelected($("selected-body"), this);
    showAgents($("agents-body"), this);
    this.hubChoice.show(hubs);
    this.timeline.show();
    const { median, p95 } = timing();
    $("stats").textContent = `Script of this page: ${median.toFixed(1)}\u00a0ms a drawing (median), ${p95.toFixed(1)}\u00a0ms (95th percentile)`;
    $("skipped").textContent = store.skipped ? `${store.skipped} messages skipped` : "";
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
      if (!pose) continue;
      add(pose.x, pose.y, 12);
      const field = layers.views && agent.sensor?.field_of_view;
      if (field && field.range_max_m <= FARTHEST_VIEW_M) eachEdgePoint(pose, field, (x, y) => add(x, y, 0));
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
    if (bounds) this.scene.fit(bounds, Math.max(1, this.hubs.length));
  }

  #resized() {
    this.scene.resize($("map").clientWidth, $("map").clientHeight);
    this.#fitted = Math.min(this.#fitted, 11);
    this.scene.arrange(this.#bounds(this.hubs, this.time), this.hubs.length);
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
  toggleLayer(id) { toggleLayer(id); this.#recolour(); }

  select(selection) {
    this.selection = selection;
    if (!selection) this.isFollowing = false;
    showTab(selection !== null);
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

  #click(x, y) {
    $("canvas").focus({ preventScroll: true });
    this.select(pick(this.scene.panes, x, y));
  }

  #point(x, y) {
    const found = pick(this.scene.panes, x, y);
    $("canvas").classList.toggle("at-something", found !== null);
    this.pointAt(found?.agent ?? null);
  }
}

function showVerdict({ level, word, why, whole = why }) {
  $("verdict").dataset.level = level;
  if ($("verdict-word").textContent !== word) $("verdict-word").textContent = word;
  if ($("verdict-why").textContent === why && $("verdict").title === whole) return;
  $("verdict-why").textContent = why;
  // A narrow header shows the beginning of a long reason only.
  $("verdict").title = whole;
}

function showFacts(pairs) {
  renew($("facts"), pairs.map(([name, values, explanation = ""]) => {
    const fact = element("div", "", element("dt", "", name), ...values.map((value) => element("dd", "", value)));
    fact.title = explanation;
    return fact;
  }));
}

function showEmpty(state) {
  $("empty").hidden = state === null;
  if (!state) return;
  $("empty").children[0].textContent = state.title;
  $("empty").children[1].textContent = state.text;
  $("empty").children[2].textContent = state.command;
}

/** Below a map without room beside it: what is selected is shown, and afterwards what was shown before. */
function showTab(isSelected) {
  const tab = (name) => document.querySelector(`#tabs [value=${name}]`);
  if (isSelected && !tab("selected").checked) {
    tabBefore = document.querySelector("#tabs :checked").value;
    tab("selected").checked = true;
  } else if (!isSelected && tab("selected").checked) {
    tab(tabBefore).checked = true;
  }
}
let tabBefore = "charts";

window.v2x = probe(new View());
