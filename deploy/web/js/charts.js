// Small charts of the last minute. What is under the pointer is read out (readout.js).

import { markOf } from "./marks.js";
import { palette } from "./palette.js";
import { POINTS, STEP_MS } from "./series.js";

const RATE_STEPS = 4;
/** A second and a half without a value is a gap. */
const GAP_STEPS = 6;
const N_VALUES = POINTS - 6;
const TOP = 14;
const FONT = "10px system-ui, 'DejaVu Sans', sans-serif";

/** Lines of all agents, as the first hub that is shown has them. */
const ofAgents = (pick) => (state) =>
  [...state.store.agents.values()].sort((one, other) => one.number - other.number).map((agent) => {
    const { colour, dash } = markOf(agent.number);
    return { name: agent.name, agent, colour, dash, value: (time, back) => pick(agent, { ...state, time, back }) };
  });
/** A line for each hub that is shown; the second one is dashed. */
const ofHubs = (series, what) => ({ shown }) =>
  shown.map((hub, k) => ({
    name: shown.length > 1 ? `${hub.name}: ${what}` : what, colour: palette.ours, isWide: true, dash: k > 0 ? [5, 3] : [],
    value: (time, back) => hub[series].mean(time, back),
  }));

/** Counts of an agent a second, over a second; nothing before it was there and while the page was paused. */
const perSecond = (series, agent, { store, time, back }) => {
  if (!(time - (back + RATE_STEPS) * STEP_MS > agent.since)) return NaN;
  const end = (Math.floor(time / STEP_MS) - back + 1) * STEP_MS;
  if (store.wasPausedBetween(end - RATE_STEPS * STEP_MS, end)) return NaN;
  let sum = 0;
  for (let k = 0; series && k < RATE_STEPS; k += 1) sum += series.perSecond(time, back + k);
  return sum / RATE_STEPS;
};

const CHARTS = [
  { name: "Latency", unit: "ms", digits: 0, title: "From capture to this list (thick), and the part in the hub (thin)",
    lines: (state) => [...ofHubs("latency", "capture to list")(state), ...ofHubs("inHub", "in the hub")(state).map((line) => ({ ...line, colour: palette.muted, isWide: false }))] },
  { name: "Age of information", unit: "ms", digits: 0, title: "Time since the capture of the newest data in the list", lines: ofHubs("age", "age") },
  { name: "Error", unit: "m", digits: 2, title: "Mean distance to the nearest true object", needsTruth: true,
    lines: (state) => [...ofHubs("error", "fused")(state), ...ofAgents((agent, { time, back }) => agent.error.mean(time, back))(state)] },
  { name: "Rate", unit: "Hz", digits: 1, title: "Frames of each agent in a second", lines: ofAgents((agent, at) => perSecond(agent.rate, agent, at)) },
  { name: "Refused", unit: "/s", digits: 1, hasSum: true, title: "Frames that the hub refused in a second, by agent",
    lines: ofAgents((agent, at) => perSecond(at.shown[0]?.refusals.get(agent.name), agent, at)) },
  { name: "NIS, ideal 1", unit: "", digits: 2, title: "Normalised innovation squared of each degree of freedom: 1 where the stated accuracy is right", mark: 1,
    lines: ofAgents((agent, { shown, time, back }) => shown[0]?.nis.get(agent.name)?.mean(time, back) ?? NaN) },
];

export class Charts {
  /** Steps before the end that are pointed at in all charts; null where nothing is. */
  back = null;
  highlighted = null;

  constructor(root) {
    this.charts = CHARTS.map((chart) => {
      const figure = document.createElement("figure");
      const caption = document.createElement("figcaption");
      const name = document.createElement("span");
      const value = document.createElement("b");
      const canvas = document.createElement("canvas");
      name.textContent = chart.unit ? `${chart.name}, ${chart.unit}` : chart.name;
      name.title = chart.title;
      canvas.setAttribute("role", "img");
      canvas.tabIndex = 0;
      caption.append(name, value);
      figure.append(caption, canvas);
      root.append(figure);
      const made = { ...chart, caption: name.textContent, canvas, value, context: canvas.getContext("2d"), width: 0, height: 0, lines: [], linesOf: chart.lines };
      // The size is asked for when it changes only: asking makes the browser lay out.
      new ResizeObserver(() => { resize(made); this.#paint(made); }).observe(canvas);
      return made;
    });
  }

  /** Takes in the minute before `time`; `cursor` is the moment that the map shows. */
  draw({ store, shown, time, cursor }) {
    this.time = time;
    this.cursorBack = (time - cursor) / STEP_MS;
    const hasTruth = shown.some((hub) => hub.frames.newest?.truth);
    for (const chart of this.charts) {
      chart.lacksTruth = Boolean(chart.needsTruth) && !hasTruth;
      chart.lines = chart.lacksTruth ? [] : chart.linesOf({ store, shown }).map((line) => ({ ...line, ...sampled(line, time) }));
    }
    this.paint();
  }

  /** Draws what was taken in. */
  paint() {
    for (const chart of this.charts) this.#paint(chart);
  }

  #paint(chart) {
    const { canvas, context, width, height, ratio, lines } = chart;
    if (!width) return;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    context.font = FONT;
    if (!lines.some((line) => line.n > 0)) {
      chart.value.textContent = "–";
      context.fillStyle = palette.muted;
      context.fillText(chart.lacksTruth ? "no ground truth known" : "nothing yet", 0, height / 2);
      canvas.setAttribute("aria-label", `${chart.name}: nothing yet`);
      return;
    }
    chart.top = niceCeiling(Math.max(chart.mark ? 1.5 * chart.mark : 0, ...lines.map((line) => line.most)) || 1);
    drawFrame(chart);
    if (this.cursorBack > 1) drawUpright(chart, this.cursorBack, palette.ink, [3, 3]);
    if (this.back !== null) drawUpright(chart, this.back, palette.muted, []);
    const isHighlighted = (line) => line.agent && line.agent.name === this.highlighted;
    const hasHighlight = lines.some(isHighlighted);
    for (const line of lines) drawLine(chart, line, hasHighlight && line.agent && !isHighlighted(line) ? 0.2 : 1, isHighlighted(line));
    lines.filter(isHighlighted).forEach((line) => drawLine(chart, line, 1, true));
    if (this.back !== null) drawPoints(chart, this.back);
    chart.value.textContent = recent(chart);
    if (document.activeElement !== canvas) canvas.setAttribute("aria-label", `${chart.caption}: ${chart.value.textContent}; arrow keys read values`);
  }
}

/** The value of a line so many steps before the end: the nearest one that is not beyond a gap. */
export function valueAt(line, back) {
  for (let distance = 0; distance < GAP_STEPS / 2; distance += 1) {
    for (const place of [back + distance, back - distance]) {
      if (Number.isFinite(line.values[place])) return line.values[place];
    }
  }
  return NaN;
}

export const stepsBefore = ({ width }, x) => Math.min(N_VALUES - 1, Math.max(0, Math.round(((width - x) / width) * (N_VALUES - 1))));
export const xOf = ({ width }, back) => width - (back * width) / (N_VALUES - 1);
export const yOf = ({ height, top }, value) => height - 2 - (Math.min(value, top) / top) * (height - TOP);
export const LAST_STEP = N_VALUES - 1;

function drawFrame(chart) {
  const { context, width, height, top } = chart;
  context.strokeStyle = palette.line;
  context.lineWidth = 1;
  context.beginPath();
  for (const at of [TOP - 2, height - 2]) {
    context.moveTo(0, Math.round(at) + 0.5);
    context.lineTo(width, Math.round(at) + 0.5);
  }
  context.stroke();
  context.fillStyle = palette.muted;
  context.fillText(String(top), 0, 9);
  context.textAlign = "right";
  context.fillText("last 60 s", width, 9);
  context.textAlign = "left";
  if (!chart.mark) return;
  context.setLineDash([2, 3]);
  context.strokeStyle = palette.muted;
  context.beginPath();
  context.moveTo(0, yOf(chart, chart.mark));
  context.lineTo(width, yOf(chart, chart.mark));
  context.stroke();
  context.setLineDash([]);
}

function drawUpright(chart, back, colour, dash) {
  const { context, height } = chart;
  const x = Math.round(xOf(chart, back)) + 0.5;
  context.strokeStyle = colour;
  context.lineWidth = 1;
  context.setLineDash(dash);
  context.beginPath();
  context.moveTo(x, TOP - 2);
  context.lineTo(x, height);
  context.stroke();
  context.setLineDash([]);
}

function drawPoints(chart, back) {
  const { context } = chart;
  for (const line of chart.lines) {
    const value = valueAt(line, back);
    if (!Number.isFinite(value)) continue;
    context.beginPath();
    context.arc(xOf(chart, back), yOf(chart, value), line.isWide ? 3.2 : 2.4, 0, 2 * Math.PI);
    context.fillStyle = line.colour;
    context.fill();
  }
}

function resize(chart) {
  const { canvas } = chart;
  chart.ratio = Math.min(devicePixelRatio || 1, 2);
  [chart.width, chart.height] = [canvas.clientWidth, canvas.clientHeight];
  canvas.width = Math.round(chart.width * chart.ratio);
  canvas.height = Math.round(chart.height * chart.ratio);
}

/** The values of a line from the newest back, without the step that is not over. */
function sampled(line, time) {
  const values = new Float64Array(N_VALUES);
  let [most, n, newest] = [0, 0, NaN];
  for (let back = 0; back < values.length; back += 1) {
    const value = line.value(time, back + 1);
    values[back] = value;
    if (!Number.isFinite(value)) continue;
    most = Math.max(most, value);
    n += 1;
    if (Number.isNaN(newest) && back < 20) newest = value;
  }
  return { values, most, n, newest };
}

function drawLine(chart, line, alpha, isHighlighted) {
  const { context } = chart;
  const { values } = line;
  context.beginPath();
  let gap = Infinity;
  for (let back = 0; back < values.length; back += 1) {
    if (!Number.isFinite(values[back])) { gap += 1; continue; }
    const [x, y] = [xOf(chart, back), yOf(chart, values[back])];
    if (gap > GAP_STEPS) context.moveTo(x, y); else context.lineTo(x, y);
    gap = 0;
  }
  context.strokeStyle = line.colour;
  context.globalAlpha = alpha;
  context.lineWidth = line.isWide || isHighlighted ? 1.8 : 1.1;
  context.lineJoin = "round";
  context.setLineDash(line.dash);
  context.stroke();
  context.setLineDash([]);
  context.globalAlpha = 1;
}

/** What a chart's title says: the newest value of each hub's line, else the mean or the sum of all agents. */
function recent({ lines, digits, hasSum }) {
  const text = (value) => (Number.isFinite(value) ? value.toFixed(digits) : "–");
  const own = lines.filter((line) => line.isWide);
  if (own.length) return own.map((line) => text(line.newest)).join(" · ");
  const known = lines.map((line) => line.newest).filter(Number.isFinite);
  const sum = known.reduce((all, value) => all + value, 0);
  if (known.length < 2) return text(known[0] ?? NaN);
  return hasSum ? `sum ${text(sum)}` : `mean ${text(sum / known.length)}`;
}

function niceCeiling(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return Number(([1, 1.5, 2, 3, 5, 7, 10].find((digit) => digit * power >= value * 1.02) * power).toPrecision(2));
}
