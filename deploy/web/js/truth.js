// Lists against truth, one to one: what is missed, and what is too much.

/** Whether an agent's sensor, at its pose, reaches a place. What stands in the way is not asked for. */
function reaches({ pose, field }, x, y) {
  const [dx, dy] = [x - pose.x, y - pose.y];
  const distance = Math.hypot(dx, dy);
  if (distance < field.range_min_m || distance > field.range_max_m) return false;
  const off = Math.atan2(dy, dx) - pose.yaw - field.azimuth_rad;
  return Math.abs(Math.atan2(Math.sin(off), Math.cos(off))) <= field.width_rad / 2 + 1e-6;
}

/** Every pair that is no farther apart than `radius`, the nearest first: [distance², object, true object]. */
function pairsWithin(radius, objects, layout, truth, trueLayout) {
  const pairs = [];
  for (let j = 0; j < truth.length; j += trueLayout.size) {
    const [x, y] = [truth[j + trueLayout.x], truth[j + trueLayout.y]];
    for (let k = 0; k < objects.length; k += layout.size) {
      const [dx, dy] = [objects[k + layout.x] - x, objects[k + layout.y] - y];
      const squared = dx * dx + dy * dy;
      if (squared <= radius * radius) pairs.push([squared, k, j]);
    }
  }
  return pairs.sort((one, other) => one[0] - other[0]);
}

/**
 * How many true objects the agents' fields of view cover, how many of those have no object of the list within `radius`, and how
 * many objects have no true one. A true object takes one object only: a second box on a car is too much.
 */
export function compared({ objects, layout, truth, trueLayout, radius, views }) {
  const taken = new Set();
  const found = new Set();
  for (const [, k, j] of pairsWithin(radius, objects, layout, truth, trueLayout)) {
    if (taken.has(k) || found.has(j)) continue;
    taken.add(k);
    found.add(j);
  }
  let [covered, missed] = [0, 0];
  for (let j = 0; j < truth.length; j += trueLayout.size) {
    if (!views.some((view) => reaches(view, truth[j + trueLayout.x], truth[j + trueLayout.y]))) continue;
    covered += 1;
    if (!found.has(j)) missed += 1;
  }
  return { covered, missed, extra: objects.length / layout.size - taken.size };
}
