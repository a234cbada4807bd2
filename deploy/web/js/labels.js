// Labels that do not overlap: one that finds no room is left out.

import { palette } from "./palette.js";

const CELL = 8;
/** Measured texts that are kept: measuring costs more than drawing. */
const MOST_WIDTHS = 4000;

export const FONT = "11px system-ui, 'DejaVu Sans', sans-serif";
export const BOLD = "600 12px system-ui, 'DejaVu Sans', sans-serif";

export class Labels {
  #taken = new Set();
  #widths = { [FONT]: new Map(), [BOLD]: new Map() };
  #font = FONT;

  constructor(context) {
    this.context = context;
  }

  /** Begins another picture. */
  clear(view) {
    this.view = view;
    this.#taken.clear();
  }

  /** Writes in this font from here on. */
  use(font) {
    this.#font = this.context.font = font;
  }

  /** The width of a text, pixels. */
  width(text) {
    const widths = this.#widths[this.#font];
    let width = widths.get(text);
    if (width === undefined) {
      if (widths.size >= MOST_WIDTHS) widths.clear();
      width = this.context.measureText(text).width;
      widths.set(text, width);
    }
    return width;
  }

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

  /** Writes a text on any ground if there is room for it. */
  write(text, x, y, colour) {
    const { context } = this;
    if (!this.take(x, y - 10, this.width(text), 12)) return false;
    context.lineWidth = 3;
    context.strokeStyle = palette.ground;
    context.strokeText(text, x, y);
    context.fillStyle = colour;
    context.fillText(text, x, y);
    return true;
  }

  /** Writes a text beside a place, whole within the picture, where there is room. */
  writeBeside(text, x, y, colour) {
    const { left, top, width, height } = this.view;
    const length = this.width(text);
    const before = x - 16 - length;
    const places = [[x + 16, y - 9], [x + 16, y + 17], [before, y - 9], [before, y + 17], [x + 16, y + 4], [before, y + 4], [x - length / 2, y + 28], [x - length / 2, y - 18]];
    const isInside = ([px, py]) => px > left + 2 && px + length < left + width - 2 && py > top + 12 && py < top + height - 4;
    return places.some((place) => isInside(place) && this.write(text, ...place, colour));
  }
}

/** The counter of a track id, which is enough within a run. */
export function shortTrack(track) {
  return track.slice(track.indexOf("-") + 1);
}
