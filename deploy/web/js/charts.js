// Small charts of the last minute. What is under the pointer is read out (readout.js).

import { hubStyle } from "./hubs.js";
import { markOf } from "./marks.js";
import { element, lineSample, renew } from "./nodes.js";
import { palette } from "./palette.js";
import { POINTS, STEP_MS } from "./series.js";

/** Refusals are counted over a second; frames over three, in which one more or less does not matter. */
const REFUSAL_STEPS = 4;
const RATE_STEPS = 12;
/** A second and a half without a value is a gap. */
const GAP_STEPS = 6;
const N_VALUES = POINTS - 6;
/** A chart is never of a shorter time. */
const LEAST_STEPS = 40;
const TOP = 14;
const BOTTOM = 13;
/** Lines that are apart stay in the lower part of the chart, below most others. */
const APART = 2.5;
/** Room for the 0 of the upright axis. */
const LEFT = 10;
/** The line before a text of the key, and its distances. */
const KEY_LINE = 13;
const KEY_GAP = 8;
const FONT = "10px system-ui, 'DejaVu Sans', sans-serif";

/** Lines of all agents, as the first hub that is shown has them; `recent` is the value that the title has. */
const ofAgents = (pick, recent) => (state) =>
  [...state.store.agents.values()].sort((one, other) => one.number - other.number).map((agent) => {
    const { colour, dash } = markOf(agent);
    return { name: agent.name, agent, colour, dash, value: (time, back) => pick(agent, { ...state, time, back }), recent: (at) => recent(agent, { ...state, time: at, back: 1 }) };
  });
/** A line for each hub that is shown. */
const ofHubs = (series, what) => ({ shown }) =>
  shown.map((hub, k) => ({
    name: shown.length > 1 ? `${hub.name}: ${what}` : what, hub: hub.name, ...hubStyle(k), isWide: true,
    value: (time, back) => hub[series].mean(time, back), recent: (at) => hub[series].recent(at),
  }));

/** Counts of an agent a second, over some steps; nothing before it was there and while the page was paused. */
const perSecond = (series, agent, steps, { store, time, back }) => {
  if (!(time - (back + steps) * STEP_MS > agent.since)) return NaN;
  const end = (Math.floor(time / STEP_MS) - back + 1) * STEP_MS;
  if (store.wasPausedBetween(end - steps * STEP_MS, end)) return NaN;
  let sum = 0;
  for (let k = 0; series && k < steps; k += 1) sum += series.perSecond(time, back + k);
  return sum / steps;
};
const rateOf = (agent, at) => perSecond(agent.rate, agent, RATE_STEPS, at);
const refusalsOf = (agent, at) => perSecond(at.shown[0]?.refusals.get(agent.name), agent, REFUSAL_STEPS, at);
const OURS = { colour: "ours", width: 1.8 };
const IN_HUB = { colour: "ours", width: 1.1 };
const AGENTS = { colour: "muted", width: 1.1 };

/**
 * `key` says on the chart what its lines are, as long as there is room for it; what `isOfFirst` is of one hub only, whose name is
 * said where two are shown; lines that are `apart` have an axis of their own, whose end the key says.
 */
const CHARTS = [
  { name: "Latency", unit: "ms", digits: 0, key: [[[OURS, "capture to list"], [IN_HUB, "in hub, 0 to "]], [[OURS, "total"], [IN_HUB, "in hub, 0–"]], [[OURS, "total"], [IN_HUB, "hub 0–"]], [[OURS, "total"], [IN_HUB, "hub"]]],
    title: "From capture to this list (thick), and the part in the hub (thin, with an axis of its own)",
    lines: (state) => [...ofHubs("inHub", "in the hub")(state).map((line) => ({ ...line, isApart: true, isWide: false })), ...ofHubs("latency", "capture to list")(state)] },
  { name: "Age of information", unit: "ms", digits: 0, title: "Time since the capture of the newest data in the list", lines: ofHubs("age", "age") },
  { name: "Error", unit: "m", digits: 2, key: [[[OURS, "fused"], [AGENTS, "agents; within 3\u00a0m"]], [[OURS, "fused"], [AGENTS, "agents"]]], title: "Mean distance to the nearest true object, of those that have one within 3 m", needsTruth: true,
    lines: (state) => [...ofAgents((agent, { time, back }) => agent.error.mean(time, back), (agent, { time }) => agent.error.recent(time))(state), ...ofHubs("error", "fused")(state)] },
  { name: "Rate", unit: "Hz", digits: 1, key: [[[AGENTS, "each agent"]]], title: "Frames of each agent a second, over three seconds", lines: ofAgents(rateOf, rateOf) },
  { name: "Refused", unit: "/s", digits: 0, key: [[[AGENTS, "each agent"]]], isOfFirst: true, isCount: true, title: "Frames that the hub refused in a second, by agent; their number in the minute",
    lines: ofAgents(refusalsOf, (agent, { shown, time }) => shown[0]?.refusals.get(agent.name)?.total(time) ?? 0) },
  { name: "NIS", unit: "ideal 1", digits: 2, key: [[[AGENTS, "each agent"]]], isOfFirst: true, title: "Normalised innovation squared of each degree of freedom: 1 where the stated accuracy is right", mark: 1,
    lines: ofAgents((agent, { shown, time, back }) => shown[0]?.nis.get(agent.name)?.mean(time, back) ?? NaN, (agent, { shown, time }) => shown[0]?.nis.get(agent.name)?.recent(time) ?? NaN) },
];

export class Charts {
  /** Steps before the end that are pointed at in all charts; null where nothing is. */
  back = null;
  highlighted = null;
  /** Steps that the charts are wide: a minute, or less until there is so much. */
  span = N_VALUES;

  constructor(root) {
    this.charts = CHARTS.map((chart) => {
      const figure = document.createElement("figure");
      const caption = document.createElement("figcaption");
      const name = document.createElement("span");
      const value = document.createElement("b");
      const canvas = document.createElement("canvas");
      name.textContent = `${chart.name}, ${chart.unit}`;
      name.title = chart.title;
      canvas.setAttribute("role", "img");
      canvas.tabIndex = 0;
      caption.append(name, value);
      figure.append(caption, canvas);
      root.append(figure);
      const made = { ...chart, caption: name.textContent, label: name, canvas, value, span: N_VALUES, context: canvas.getContext("2d"), width: 0, height: 0, lines: [], linesOf: chart.lines };
      // The size is asked for when it changes only: asking makes the browser lay out.
      new ResizeObserver(() => { resize(made); this.#paint(made); }).observe(canvas);
      return made;
    });
  }

  /** Says the figures of a moment in the titles. */
  say({ store, shown, at }) {
    const hasTruth = shown.some((hub) => hub.frames.newest?.truth);
    const whose = shown.length > 1 ? `, ${shown[0].name} only` : "";
    for (const chart of this.charts) {
      chart.lacksTruth = Boolean(chart.needsTruth) && !hasTruth;
      chart.caption = `${chart.name}, ${chart.unit}${chart.isOfFirst ? whose : ""}`;
      chart.seconds = store.secondsKnown(at);
      if (chart.label.textContent !== chart.caption) chart.label.textContent = chart.caption;
      const lines = chart.lacksTruth ? [] : chart.linesOf({ store, shown });
      renew(chart.value, figures(chart, lines.map((line) => ({ ...line, newest: line.recent(at) }))));
    }
  }

  /** Takes in the minute before `time`; `cursor` is the moment that the map shows. */
  draw({ store, shown, time, cursor }) {
    this.time = time;
    this.cursorBack = (time - cursor) / STEP_MS;
    for (const chart of this.charts) {
      chart.lines = chart.lacksTruth ? [] : chart.linesOf({ store, shown }).map((line) => ({ ...line, ...sampled(line, time) }));
    }
    const oldest = Math.max(...this.charts.flatMap((chart) => chart.lines.map((line) => line.oldest)));
    this.span = Math.min(N_VALUES, Math.max(LEAST_STEPS, oldest + 1));
    for (const chart of this.charts) Object.assign(chart, { span: this.span, end: store.paused ? "pause" : "now" });
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
      context.fillStyle = palette.muted;
      context.fillText(chart.lacksTruth ? "no ground truth known" : "nothing yet", 0, height / 2);
      canvas.setAttribute("aria-label", `${chart.name}: nothing yet`);
      return;
    }
    const most = (some) => Math.max(chart.mark ? 1.5 * chart.mark : 0, ...some.map((line) => line.most)) || 1;
    chart.top = niceCeiling(most(lines.filter((line) => !line.isApart)));
    chart.topApart = niceCeiling(APART * most(lines.filter((line) => line.isApart)));
    drawFrame(chart);
    if (this.cursorBack > 1) drawUpright(chart, this.cursorBack, palette.ink, [3, 3]);
    if (this.back !== null) drawUpright(chart, this.back, palette.muted, []);
    const isHighlighted = (line) => line.agent && line.agent.name === this.highlighted;
    const hasHighlight = lines.some(isHighlighted);
    const isWithHubs = lines.some((line) => line.isWide);
    const alphaOf = (line) => (!line.agent ? 1 : hasHighlight ? 0.2 : isWithHubs ? 0.6 : 1);
    for (const line of lines) drawLine(chart, line, isHighlighted(line) ? 1 : alphaOf(line), isHighlighted(line));
    lines.filter(isHighlighted).forEach((line) => drawLine(chart, line, 1, true));
    writeNumbers(chart);
    if (this.back !== null) drawPoints(chart, this.back);
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

export const stepsBefore = ({ width, span }, x) => Math.min(span - 1, Math.max(0, Math.round(((width - x) / (width - LEFT)) * (span - 1))));
export const xOf = ({ width, span }, back) => width - (back * (width - LEFT)) / (span - 1);
/** Where a value of a line lies: of one that is apart by its own axis. */
export const yOf = ({ height, top: usual, topApart }, value, { isApart } = {}) => {
  const top = isApart ? topApart : usual;
  return height - BOTTOM - (Math.min(value, top) / top) * (height - TOP - BOTTOM);
};

function drawFrame(chart) {
  const { context, width, height } = chart;
  context.strokeStyle = palette.line;
  context.lineWidth = 1;
  context.beginPath();
  for (const at of [TOP - 2, height - BOTTOM]) {
    context.moveTo(at < TOP ? 0 : LEFT, Math.round(at) + 0.5);
    context.lineTo(width, Math.round(at) + 0.5);
  }
  context.stroke();
  context.fillStyle = palette.muted;
  context.fillText(`−${Math.round((chart.span * STEP_MS) / 1000)}\u00a0s`, 0, height - 2);
  context.textAlign = "right";
  context.fillText(chart.end, width, height - 2);
  context.textAlign = "left";
  writeKey(chart);
  if (!chart.mark) return;
  context.setLineDash([2, 3]);
  context.strokeStyle = palette.muted;
  context.beginPath();
  context.moveTo(LEFT, yOf(chart, chart.mark));
  context.lineTo(width, yOf(chart, chart.mark));
  context.stroke();
  context.setLineDash([]);
}

/** What the lines are, each after a piece of it; in the longest words that there is room for. */
function writeKey(chart) {
  const { context, width, topApart } = chart;
  const hasApart = chart.lines.some((line) => line.isApart);
  const wordsOf = (item) => item.map(([line, words]) => [line, line === IN_HUB && hasApart && words !== "hub" ? `${words}${topApart}` : words]);
  const lengthOf = (item) => item.reduce((sum, [, words]) => sum + KEY_LINE + 3 + context.measureText(words).width, KEY_GAP * (item.length - 1));
  const room = width - context.measureText(String(chart.top)).width - KEY_GAP;
  const item = (chart.key ?? []).map(wordsOf).find((each) => lengthOf(each) <= room);
  if (!item) return;
  let x = width - lengthOf(item);
  for (const [line, words] of item) {
    context.strokeStyle = palette[line.colour];
    context.lineWidth = line.width;
    context.beginPath();
    context.moveTo(x, 5.5);
    context.lineTo(x + KEY_LINE, 5.5);
    context.stroke();
    context.fillText(words, x + KEY_LINE + 3, 9);
    x += KEY_LINE + 3 + context.measureText(words).width + KEY_GAP;
  }
}

/** The ends of the upright axis, beside the lines and above them. */
function writeNumbers({ context, height, top }) {
  context.fillStyle = palette.muted;
  context.fillText(String(top), 0, 9);
  context.fillText("0", 0, height - BOTTOM + 3);
}

function drawUpright(chart, back, colour, dash) {
  const { context, height } = chart;
  const x = Math.round(xOf(chart, back)) + 0.5;
  context.strokeStyle = colour;
  context.lineWidth = 1;
  context.setLineDash(dash);
  context.beginPath();
  context.moveTo(x, TOP - 2);
  context.lineTo(x, height - BOTTOM);
  context.stroke();
  context.setLineDash([]);
}

function drawPoints(chart, back) {
  const { context } = chart;
  for (const line of chart.lines) {
    const value = valueAt(line, back);
    if (!Number.isFinite(value)) continue;
    context.beginPath();
    context.arc(xOf(chart, back), yOf(chart, value, line), line.isWide ? 3.2 : 2.4, 0, 2 * Math.PI);
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
  let [most, n, oldest] = [0, 0, 0];
  for (let back = 0; back < values.length; back += 1) {
    const value = line.value(time, back + 1);
    values[back] = value;
    if (!Number.isFinite(value)) continue;
    most = Math.max(most, value);
    n += 1;
    oldest = back;
  }
  return { values, most, n, oldest };
}

function drawLine(chart, line, alpha, isHighlighted) {
  const { context } = chart;
  const { values } = line;
  context.beginPath();
  let gap = Infinity;
  for (let back = 0; back < values.length; back += 1) {
    if (!Number.isFinite(values[back])) { gap += 1; continue; }
    const [x, y] = [xOf(chart, back), yOf(chart, values[back], line)];
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

/** What a chart's title says of the moment that is shown: the value of each hub's line, else of all agents the mean, or the sum of the minute. */
function figures({ digits, isCount, seconds }, lines) {
  const text = (value) => (Number.isFinite(value) ? value.toFixed(digits) : "–");
  const own = lines.filter((line) => line.isWide);
  if (own.length > 1) return own.map((line) => element("span", "figure", lineSample(line), element("span", "whose", `${line.hub}\u00a0`), text(line.newest)));
  if (own.length) return [text(own[0].newest)];
  const known = lines.map((line) => line.newest).filter(Number.isFinite);
  const sum = known.reduce((all, value) => all + value, 0);
  if (isCount) return [`${text(sum)} in ${Math.round(seconds)}\u00a0s`];
  return [known.length < 2 ? text(known[0] ?? NaN) : `mean ${text(sum / known.length)}`];
}

function niceCeiling(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return Number(([1, 1.5, 2, 3, 5, 7, 10, 15].find((digit) => digit * power >= value * 1.02) * power).toPrecision(2));
}
