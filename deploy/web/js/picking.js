// What lies at a place of the map.

import { layers } from "./layers.js";
import { OBJECT } from "./store.js";

const REACH_PIXELS = 18;
/** The mark of an agent lies above everything else. */
const MARK_PIXELS = 9;

/** What is nearest: an object (`hub`, `track`) or an agent (`agent`); null where nothing is. */
export function pick(panes, x, y) {
  const pane = panes.find(({ view }) => x >= view.left && x < view.left + view.width && y >= view.top && y < view.top + view.height);
  if (!pane) return null;
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
    if (own.pose) offer(own.pose.x, own.pose.y, MARK_PIXELS, { agent: agent.name });
  }
  return found;
}
