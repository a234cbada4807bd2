// Classes, each with a letter, and the colour of its group. The letter alone is enough: no colour has to be distinguished from another one.

/**
 * Cars, two-wheelers, people, and what stands. Neither an agent, nor truth, nor what is fused has such a colour, for any kind of
 * sight: `.ci/web_view.py` computes it. The reports have the same ones.
 */
const TINTS = ["#DDF0D1", "#8BF9F2", "#F4FA9E", "#96B691"];
const [FOUR_WHEELED, TWO_WHEELED, MOVING, STATIC] = TINTS;

/** Pattern, letter, meaning and colour. There is no O, which looks like a zero; the unknown is not filled. */
const GROUPS = [
  [/^vehicle\.car/, "C", "car", FOUR_WHEELED],
  [/^vehicle\.(truck|trailer)/, "T", "truck or trailer", FOUR_WHEELED],
  [/^vehicle\.bus/, "B", "bus", FOUR_WHEELED],
  [/^vehicle\.motorcycle/, "M", "motorcycle", TWO_WHEELED],
  [/^vehicle\.bicycle/, "Y", "bicycle", TWO_WHEELED],
  [/^vehicle\./, "E", "special", FOUR_WHEELED],
  [/^human/, "P", "pedestrian", MOVING],
  [/^animal/, "A", "animal", MOVING],
  [/^(movable|static)/, "S", "static, as a cone", STATIC],
  [/^/, "U", "unknown", null],
];

/** All groups. */
export const groups = GROUPS.map(([, letter, meaning, colour]) => ({ letter, meaning, colour }));

/** The colours of all groups, each once. */
export const tints = TINTS;

/** The group of a class, by its place. */
export function groupOf(className = "") {
  return GROUPS.findIndex(([pattern]) => pattern.test(className));
}

/** The groups of all classes, by their numbers. */
export function groupsOf(classNames) {
  return Uint8Array.from(classNames, groupOf);
}
