// Small charts of the last minute.

import { agentColour, palette } from "./palette.js";
import { POINTS, STEP_MS } from "./series.js";

const RATE_STEPS = 4;

/** Lines of all agents, as the first hub that is shown has them. */
const ofAgents = (pick) => ({ agents, shown }) =>
  [...agents.values()].map((agent) => ({ colour: agentColour(agent.number), value: (time, back) => pick(agent, time, back, shown[0]) }));
/** A line for each hub that is shown; the second one is dashed. */
const ofHubs = (name) => ({ shown }) =>
  shown.map((hub, k) => ({ colour: palette.ours, isWide: true, isDashed: k > 0, value: (time, back) => hub[name].mean(time, back) }));

/** Counts of an agent a second, over a second; nothing before it was there. */
const perSecond = (series, agent, time, back) => {
  if (!(time - (back + RATE_STEPS) * STEP_MS > agent.since)) return NaN;
  let sum = 0;
  for (let k = 0; series && k < RATE_STEPS; k += 1) sum += series.perSecond(time, back + k);
  return sum / RATE_STEPS;
};

const CHARTS = [
  { name: "Latency", unit: "ms", digits: 0, title: "From capture to this list (thick), and the part in the hub (thin)",
    lines: (state) => [...ofHubs("latency")(state), ...ofHubs("inHub")(state).map((line) => ({ ...line, colour: palette.muted, isWide: false }))] },
  { name: "Age of information", unit: "ms", digits: 0, title: "Time since the capture of the newest data in the list", lines: ofHubs("age") },
  { name: "Error", unit: "m", digits: 2, title: "Mean distance to the nearest true object", needsTruth: true,
    lines: (state) => [...ofAgents((agent, time, back) => agent.error.mean(time, back))(state), ...ofHubs("error")(state)] },
  { name: "Rate", unit: "Hz", digits: 1, title: "Frames of each agent in a second", lines: ofAgents((agent, time, back) => perSecond(agent.rate, agent, time, back)) },
  { name: "Refused", unit: "/s", digits: 1, title: "Frames that the hub refused in a second, by agent",
    lines: ofAgents((agent, time, back, hub) => perSecond(hub?.refusals.get(agent.name), agent, time, back)) },
  { name: "NIS, ideal 1", unit: "", digits: 2, title: "Normalised innovation squared of each degree of freedom: 1 where the stated accuracy is right", mark: 1,
    lines: ofAgents((agent, time, back, hub) => hub?.nis.get(agent.name)?.mean(time, back) ?? NaN) },
];

export class Charts {
  constructor(root) {
    this.charts = CHARTS.map((chart) => {
      const figure = document.createElement("figure");
      const caption = document.createElement("figcaption");
      const name = document.createElement("span");
      const value = document.createElement("b");
      const canvas = document.createElement("canvas");
      name.textContent = chart.unit ? `${chart.name}, ${chart.unit}` : chart.name;
      figure.title = chart.title;
      canvas.setAttribute("role", "img");
      caption.append(name, value);
      figure.append(caption, canvas);
      root.append(figure);
      const made = { ...chart, canvas, value, context: canvas.getContext("2d"), width: 0, height: 0 };
      // The size is asked for when it changes only: asking makes the browser lay out.
      new ResizeObserver(() => resize(made)).observe(canvas);
      return made;
    });
  }

  draw(state) {
    for (const chart of this.charts) this.#draw(chart, state);
  }

  #draw(chart, state) {
    const { canvas, context, width, height, ratio } = chart;
    if (!width) return;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    const lines = chart.needsTruth && !state.hasTruth ? [] : chart.lines(state);
    const read = lines.map((line) => sampled(line, state.time));
    const most = Math.max(chart.mark ? 1.5 * chart.mark : 0, ...read.map((points) => points.most));
    context.font = "10px system-ui, 'DejaVu Sans', sans-serif";
    context.fillStyle = palette.muted;
    if (!read.some((points) => points.n > 0)) {
      chart.value.textContent = "–";
      context.fillText(chart.needsTruth && !state.hasTruth ? "no ground truth known" : "nothing yet", 0, height / 2);
      canvas.setAttribute("aria-label", `${chart.name}: nothing yet`);
      return;
    }
    const top = niceCeiling(most || 1);
    const y = (value) => height - 2 - (Math.min(value, top) / top) * (height - 14);
    this.#drawFrame(context, width, height, top, chart.mark ? y(chart.mark) : null);
    read.forEach((points, k) => drawLine(context, points, lines[k], width, y));
    const newest = recent(read, lines);
    chart.value.textContent = Number.isFinite(newest) ? newest.toFixed(chart.digits) : "–";
    canvas.setAttribute("aria-label", `${chart.name}: ${chart.value.textContent} ${chart.unit}`);
  }

  #drawFrame(context, width, height, top, markY) {
    context.strokeStyle = palette.line;
    context.lineWidth = 1;
    context.beginPath();
    for (const at of [12, height - 2]) {
      context.moveTo(0, Math.round(at) + 0.5);
      context.lineTo(width, Math.round(at) + 0.5);
    }
    context.stroke();
    context.fillText(String(top), 0, 9);
    context.textAlign = "right";
    context.fillText("last 60 s", width, 9);
    context.textAlign = "left";
    if (markY !== null) {
      context.setLineDash([2, 3]);
      context.strokeStyle = palette.muted;
      context.beginPath();
      context.moveTo(0, markY);
      context.lineTo(width, markY);
      context.stroke();
      context.setLineDash([]);
    }
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
  const values = new Float64Array(POINTS - 6);
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

function drawLine(context, points, line, width, y) {
  const { values } = points;
  context.beginPath();
  let gap = Infinity;
  for (let back = 0; back < values.length; back += 1) {
    if (!Number.isFinite(values[back])) { gap += 1; continue; }
    const x = width - (back * width) / (values.length - 1);
    // A second and a half without a value is a gap.
    if (gap > 6) context.moveTo(x, y(values[back])); else context.lineTo(x, y(values[back]));
    gap = 0;
  }
  context.strokeStyle = line.colour;
  context.lineWidth = line.isWide ? 1.8 : 1.1;
  context.setLineDash(line.isDashed ? [5, 3] : []);
  context.stroke();
  context.setLineDash([]);
}

/** The value that a chart's title says: of the hub's line, else the mean of all. */
function recent(read, lines) {
  const own = lines.findIndex((line) => line.isWide);
  if (own >= 0) return read[own].newest;
  const known = read.map((points) => points.newest).filter(Number.isFinite);
  return known.length ? known.reduce((sum, value) => sum + value, 0) / known.length : NaN;
}

function niceCeiling(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return Number(([1, 1.5, 2, 3, 5, 7, 10].find((digit) => digit * power >= value * 1.02) * power).toPrecision(2));
}
