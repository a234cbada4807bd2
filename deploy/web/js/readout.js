// Values of a chart at the pointer, at a finger, or at the place that the arrow keys move to.

import { stepsBefore, valueAt, xOf, yOf } from "./charts.js";
import { markNode } from "./marks.js";
import { element, lineSample, renew } from "./nodes.js";
import { STEP_MS } from "./series.js";

const REACH_PIXELS = 9;
/** Steps that a key moves: a quarter of a second, or two and a half with Shift. */
const FAST = 10;

export class Readout {
  #chart = null;
  #y = NaN;

  constructor(root, charts, { onChange, onHighlight, onSeek }) {
    Object.assign(this, { root, charts, onChange, onHighlight, onSeek });
    for (const chart of charts.charts) this.#listen(chart);
    // A finger that was lifted leaves its values until the next one comes elsewhere.
    addEventListener("pointerdown", (event) => { if (!event.target.closest("#charts")) this.#hide(); });
  }

  #listen(chart) {
    const { canvas } = chart;
    const point = (event) => this.#show(chart, stepsBefore(chart, event.offsetX), event.offsetY);
    canvas.addEventListener("pointermove", point);
    canvas.addEventListener("pointerdown", point);
    canvas.addEventListener("pointerleave", (event) => { if (event.pointerType !== "touch") this.#hide(); });
    // A finger only reads: it comes down to scroll, too.
    canvas.addEventListener("click", (event) => { if (event.pointerType !== "touch") this.#seek(); });
    canvas.addEventListener("focus", () => { if (canvas.matches(":focus-visible")) this.#show(chart, this.charts.back ?? 0); });
    canvas.addEventListener("blur", () => this.#hide());
    canvas.addEventListener("keydown", (event) => this.#key(chart, event));
  }

  #key(chart, event) {
    const back = this.charts.back ?? 0;
    const last = this.charts.span - 1;
    const stride = event.shiftKey ? FAST : 1;
    const to = { ArrowLeft: back + stride, ArrowRight: back - stride, Home: last, End: 0 }[event.key];
    if (event.key === "Enter") this.#seek();
    else if (event.key === "Escape") this.#hide();
    else if (to === undefined) return;
    else this.#show(chart, Math.min(last, Math.max(0, to)));
    // The same keys move the whole page through time elsewhere.
    event.stopPropagation();
    event.preventDefault();
    chart.canvas.setAttribute("aria-label", this.root.hidden ? chart.caption : this.root.innerText.replaceAll("\n", ", "));
  }

  #show(chart, back, y = NaN) {
    this.#chart = chart;
    this.#y = y;
    this.charts.back = back;
    this.update();
    this.onChange();
  }

  /** Shows the moment that is read on the map, too. */
  #seek() {
    if (this.#chart) this.onSeek(this.charts.time - secondsAgo(this.charts.back) * 1000);
  }

  #hide() {
    if (!this.#chart) return;
    this.#chart = null;
    this.charts.back = null;
    this.update();
    this.onHighlight(null);
    this.onChange();
  }

  /** The values move on while the pointer rests. */
  update() {
    const chart = this.#chart;
    this.root.hidden = !chart;
    if (!chart) return;
    const { back, time } = this.charts;
    const ago = secondsAgo(back);
    const clock = new Date(time - ago * 1000).toLocaleTimeString("en-GB");
    const read = chart.lines.map((line) => ({ line, value: valueAt(line, back) }));
    const near = this.#nearest(chart, read);
    this.onHighlight(near?.line.agent?.name ?? null);
    renew(this.root, [
      element("p", "", element("b", "", chart.caption), element("span", "", ` ${ago.toFixed(1)}\u00a0s ago, ${clock}`)),
      table(read, near, chart),
    ]);
    this.#place(chart);
  }

  #nearest(chart, read) {
    let [best, found] = [REACH_PIXELS, null];
    for (const each of read) {
      const distance = Math.abs(yOf(chart, each.value, each.line) - this.#y);
      if (distance < best) [best, found] = [distance, each];
    }
    return found;
  }

  /** Beside the upright line, above the chart; below it where there is no room. */
  #place(chart) {
    const canvas = chart.canvas.getBoundingClientRect();
    const { top } = chart.canvas.parentElement.getBoundingClientRect();
    const own = this.root.getBoundingClientRect();
    const x = canvas.left + xOf(chart, this.charts.back);
    const left = Math.min(innerWidth - own.width - 6, Math.max(6, x - own.width / 2));
    const above = top - own.height - 4;
    this.root.style.left = `${left}px`;
    this.root.style.top = `${above > 4 ? above : Math.min(canvas.bottom + 8, innerHeight - own.height - 4)}px`;
  }
}

/** The step that is not over is left out of a chart. */
const secondsAgo = (back) => ((back + 1) * STEP_MS) / 1000;

function table(read, near, { digits, isCount }) {
  const made = element("table");
  for (const { line, value } of read) {
    const row = made.insertRow();
    if (line === near?.line) row.className = "near";
    row.append(
      element("td", "", line.agent ? markNode(line.agent) : lineSample(line), line.name),
      element("td", "", Number.isFinite(value) ? value.toFixed(isCount ? 1 : digits) : "–"),
    );
  }
  return made;
}
