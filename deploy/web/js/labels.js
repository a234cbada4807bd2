// Labels that do not overlap: one that finds no room is left out.

const CELL = 8;

export class LabelSpace {
  #taken = new Set();

  clear() { this.#taken.clear(); }

  /** Takes a rectangle if it is free. */
  take(x, y, width, height) {
    const cells = [];
    for (let column = Math.floor(x / CELL); column <= Math.floor((x + width) / CELL); column += 1) {
      for (let row = Math.floor(y / CELL); row <= Math.floor((y + height) / CELL); row += 1) {
        const cell = column * 65_536 + row;
        if (this.#taken.has(cell)) return false;
        cells.push(cell);
      }
    }
    cells.forEach((cell) => this.#taken.add(cell));
    return true;
  }
}

const LETTERS = [
  [/^vehicle\.car/, "C", "car"], [/^vehicle\.(truck|trailer)/, "T", "truck or trailer"], [/^vehicle\.bus/, "B", "bus"],
  [/^vehicle\.motorcycle/, "M", "motorcycle"], [/^vehicle\.bicycle/, "Y", "bicycle"],
  [/^vehicle\./, "E", "special vehicle"], [/^human/, "P", "pedestrian"], [/^animal/, "A", "animal"],
  [/^(movable|static)/, "O", "cone, barrier or other thing"],
];

/** The letter of a class and what it means. */
export function letterOf(className = "unknown") {
  const found = LETTERS.find(([pattern]) => pattern.test(className));
  return found ? { letter: found[1], meaning: found[2] } : { letter: "U", meaning: "unknown" };
}

/** The counter of a track id, which is enough within a run. */
export function shortTrack(track) {
  return track.slice(track.indexOf("-") + 1);
}
