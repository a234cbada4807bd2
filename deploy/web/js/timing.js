// How long this page's script takes for each drawn frame.

const CAPACITY = 600;
const taken = new Float64Array(CAPACITY);
const drawing = new Float64Array(CAPACITY);
let count = 0;
let reading = 0;

/** Time that was used to read messages, ms. */
export function noteReading(ms) {
  reading += ms;
}

/** A frame was drawn in this time, ms; what was read for it counts too. */
export function noteFrame(ms) {
  taken[count % CAPACITY] = ms + reading;
  drawing[count % CAPACITY] = ms;
  reading = 0;
  count += 1;
}

function quantile(values, share) {
  const sorted = values.slice(0, Math.min(count, CAPACITY)).sort();
  return sorted.length ? sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))] : 0;
}

/** Of the last frames drawn, ms: all script, and the part that draws. */
export function timing() {
  return {
    frames: count,
    median: quantile(taken, 0.5), p95: quantile(taken, 0.95),
    drawMedian: quantile(drawing, 0.5), drawP95: quantile(drawing, 0.95),
  };
}
