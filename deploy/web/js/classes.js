// Classes in groups, each with a letter and a colour. The letter alone is enough: no colour has to be told from another one.

/**
 * Pattern, letter, meaning and colour of each group. Cars, of which there are most, have the colour of fused objects. The
 * colours are those of P. Tol's scheme "light", which is made for areas and for all kinds of sight.
 */
const GROUPS = [
  [/^vehicle\.car/, "C", "car", null],
  [/^vehicle\.(truck|trailer)/, "T", "truck or trailer", "#EE8866"],
  [/^vehicle\.bus/, "B", "bus", "#EEDD88"],
  [/^vehicle\.motorcycle/, "M", "motorcycle", "#77AADD"],
  [/^vehicle\.bicycle/, "Y", "bicycle", "#99DDFF"],
  [/^vehicle\./, "E", "special vehicle", "#AAAA00"],
  [/^human/, "P", "pedestrian", "#44BB99"],
  [/^animal/, "A", "animal", "#BBCC33"],
  [/^(movable|static)/, "O", "cone or other", "#B8BCC2"],
  [/^/, "U", "unknown", "#FFAABB"],
];

/** All groups. */
export const groups = GROUPS.map(([, letter, meaning, colour]) => ({ letter, meaning, colour }));

/** The group of a class, by its place. */
export function groupOf(className = "") {
  return GROUPS.findIndex(([pattern]) => pattern.test(className));
}

/** The groups of all classes, by their numbers. */
export function groupsOf(classNames) {
  return Uint8Array.from(classNames, groupOf);
}
