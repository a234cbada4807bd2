// Labels that do not overlap: one that finds no room is left out.

import { palette } from "./palette.js";

const CELL = 8;
/** Measured texts that are kept: measuring costs more than drawing. */
const MOST_WIDTHS = 4000;
/** Labels whose side is known; the others begin on the right. */
const MOST_SIDES = 4000;

export const FONT = "11px system-ui, 'DejaVu Sans', sans-serif";
export const BOLD = "600 12px system-ui, 'DejaVu Sans', sans-serif";

export class Labels {
  #taken = new Set();
  #widths = { [FONT]: new Map(), [BOLD]: new Map() };
  #font = FONT;
  /** On which side each label was in the last picture, so that it does not jump. */
  #sides = new Map();

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
    const cells = cellsOf(x, y, width, height);
    if (cells.some((cell) => this.#taken.has(cell))) return false;
    cells.forEach((cell) => this.#taken.add(cell));
    return true;
  }

  /** Takes a rectangle, whoever else has a part of it. */
  reserve(x, y, width, height) {
    cellsOf(x, y, width, height).forEach((cell) => this.#taken.add(cell));
  }

  /** Writes a text on any ground if it is whole within the picture and there is room for it. */
  write(text, x, y, colour) {
    const { context } = this;
    const { left, top, width, height } = this.view;
    const length = this.width(text);
    if (x < left + 2 || x + length > left + width - 2 || y < top + 12 || y > top + height - 4) return false;
    if (!this.take(x, y - 10, length, 12)) return false;
    context.lineWidth = 3;
    context.strokeStyle = palette.ground;
    context.strokeText(text, x, y);
    context.fillStyle = colour;
    context.fillText(text, x, y);
    return true;
  }

  /** Writes a text at one of these places, first at the one that it had before; returns the place, or null where none is free. */
  #writeAt(key, text, places, colour) {
    const last = this.#sides.get(key) ?? 0;
    for (let k = 0; k < places.length; k += 1) {
      const side = k === 0 ? last : k <= last ? k - 1 : k;
      if (!this.write(text, ...places[side], colour)) continue;
      if (this.#sides.size >= MOST_SIDES) this.#sides.clear();
      if (side !== last) this.#sides.set(key, side);
      return places[side];
    }
    return null;
  }

  /** Writes a text beside an object that reaches so many pixels from its middle to the side and up. */
  writeAround(key, text, [x, y], [across, up], colour) {
    const length = this.width(text);
    const places = [[x + across + 3, y - 4], [x - across - 3 - length, y - 4], [x - length / 2, y - up - 4], [x - length / 2, y + up + 13]];
    return this.#writeAt(key, text, places, colour);
  }

  /** Writes a text beside a mark. */
  writeBeside(key, text, x, y, colour) {
    const length = this.width(text);
    const [after, before] = [x + 20, x - 20 - length];
    const places = [[after, y - 9], [after, y + 17], [before, y - 9], [before, y + 17], [after, y + 4], [before, y + 4], [x - length / 2, y + 28], [x - length / 2, y - 18]];
    return this.#writeAt(key, text, places, colour);
  }
}

function cellsOf(x, y, width, height) {
  const cells = [];
  for (let column = Math.floor(x / CELL); column <= Math.floor((x + width) / CELL); column += 1) {
    for (let row = Math.floor(y / CELL); row <= Math.floor((y + height) / CELL); row += 1) cells.push(column * 65_536 + row);
  }
  return cells;
}

/** A plate for a text: what is under it does not matter. */
export function drawPlate(context, x, y, width, height) {
  context.fillStyle = palette.panel;
  context.globalAlpha = 0.88;
  context.beginPath();
  context.roundRect(x, y, width, height, 5);
  context.fill();
  context.globalAlpha = 1;
}

/** The counter of a track id, which is enough within a run. */
export function shortTrack(track) {
  return track.slice(track.indexOf("-") + 1);
}
