// Labels that overlap neither each other nor an object: an object's label that finds no room is left out.

import { palette } from "./palette.js";

/** Rectangles are looked for in squares of so many pixels. */
const SQUARE = 48;
/** Measured texts that are kept: measuring costs more than drawing. */
const MOST_WIDTHS = 4000;
/** Labels whose side is known; the others begin on the right. */
const MOST_SIDES = 4000;
/** From a mark to its plate, pixels, and the directions in which one is looked for: beside it first. */
const REACHES = [15, 26, 42, 62, 86];
const DIRECTIONS = [0, 180, 25, -25, 155, -155, 50, -50, 130, -130, 90, -90].map((degrees) => [Math.cos((degrees * Math.PI) / 180), Math.sin((degrees * Math.PI) / 180)]);
/** What an object under a plate costs, or a mark or label under its line, in pixels farther away; and how much better a place has to be for the plate to jump. */
const COST_OF_UNDERLYING = 40;
/** Half the side of a mark. */
const MARK_REACH = 13;
const RELUCTANCE = 25;
/** Pixels between two labels, and from a label to another object: its own is farther than this. */
const GAP = 4;
const NEAR = 2;
const NONE = [];

export const FONT = "11px system-ui, 'DejaVu Sans', sans-serif";
export const BOLD = "600 12px system-ui, 'DejaVu Sans', sans-serif";
export const PLATE = "600 11px system-ui, 'DejaVu Sans', sans-serif";

/** Rectangles in a plane. */
class Space {
  #squares = new Map();

  clear() { this.#squares.clear(); }

  add(x, y, width, height) {
    const rectangle = [x, y, x + width, y + height];
    for (let column = Math.floor(x / SQUARE); column <= Math.floor((x + width) / SQUARE); column += 1) {
      for (let row = Math.floor(y / SQUARE); row <= Math.floor((y + height) / SQUARE); row += 1) {
        const key = column * 65_536 + row;
        const square = this.#squares.get(key);
        if (square) square.push(rectangle); else this.#squares.set(key, [rectangle]);
      }
    }
  }

  /** How many rectangles have a part of this one, at most `most`; one that lies in several squares may count more than once. */
  count(x, y, width, height, most = 1) {
    const [right, bottom] = [x + width, y + height];
    let n = 0;
    for (let column = Math.floor(x / SQUARE); column <= Math.floor(right / SQUARE); column += 1) {
      for (let row = Math.floor(y / SQUARE); row <= Math.floor(bottom / SQUARE); row += 1) {
        for (const each of this.#squares.get(column * 65_536 + row) ?? NONE) {
          if (each[0] < right && each[2] > x && each[1] < bottom && each[3] > y && (n += 1) >= most) return n;
        }
      }
    }
    return n;
  }
}

export class Labels {
  #taken = new Space();
  #objects = new Space();
  #labelled = new Space();
  #widths = { [FONT]: new Map(), [BOLD]: new Map(), [PLATE]: new Map() };
  #font = FONT;
  /** On which side each label was in the last picture, so that it does not jump. */
  #sides = new Map();
  /** What is written in this picture: left and top edge, width, height, and whether an object is under it. */
  placed = [];

  constructor(context) {
    this.context = context;
  }

  /** Begins another picture. */
  clear(view) {
    this.view = view;
    this.#taken.clear();
    this.#objects.clear();
    this.#labelled.clear();
    this.placed.length = 0;
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

  /** No label lies over this rectangle. */
  reserve(x, y, width, height) {
    this.#taken.add(x, y, width, height);
  }

  /** There is an object: a label lies over it only where its agent would have none otherwise. One that has a label itself is farther from those of others. */
  avoid(x, y, width, height, isLabelled) {
    this.#objects.add(x, y, width, height);
    if (isLabelled) this.#labelled.add(x, y, width, height);
  }

  #take(x, y, width, height) {
    this.reserve(x, y, width, height);
    this.placed.push([x, y, width, height, this.#objects.count(x, y, width, height) > 0]);
  }

  #isInside(x, y, width, height) {
    const { left, top, width: wide, height: high } = this.view;
    return x >= left + 2 && x + width <= left + wide - 2 && y >= top + 2 && y + height <= top + high - 2;
  }

  /** Whether no label is there. */
  isUntaken(x, y, width, height) {
    return this.#isInside(x, y, width, height) && !this.#taken.count(x, y, width, height);
  }

  #isFree(x, y, width, height) {
    return this.isUntaken(x, y, width, height) && !this.#objects.count(x, y, width, height);
  }

  /** Writes a text beside an object that reaches so many pixels from its middle to the side and up, if there is room for it. */
  writeAround(key, text, [x, y], [across, up], colour) {
    const length = this.width(text);
    const [right, left, middle, above, below] = [x + across + 3, x - across - 3 - length, x - length / 2, y - up - 14, y + up + 3];
    const places = [[right, y - 14], [left, y - 14], [middle, above], [middle, below], [right, y + 2], [left, y + 2], [right, above], [left, above], [right, below], [left, below]];
    const last = this.#sides.get(key) ?? 0;
    for (let k = 0; k < places.length; k += 1) {
      const side = k === 0 ? last : k <= last ? k - 1 : k;
      const [at, top] = places[side];
      // Two names side by side do not look like one, and none is as near to another object as to its own.
      if (!this.#isFree(at - GAP, top, length + 2 * GAP, 11) || this.#labelled.count(at - NEAR, top - NEAR, length + 2 * NEAR, 11 + 2 * NEAR)) continue;
      this.#take(at, top, length, 11);
      this.#remember(key, side, last);
      this.#write(text, at, top + 10, colour);
      return;
    }
  }

  #write(text, x, y, colour) {
    const { context } = this;
    context.lineWidth = 3;
    context.strokeStyle = palette.ground;
    context.strokeText(text, x, y);
    context.fillStyle = colour;
    context.fillText(text, x, y);
  }

  #remember(key, side, last) {
    if (this.#sides.size >= MOST_SIDES) this.#sides.clear();
    if (side !== last) this.#sides.set(key, side);
  }

  /** How many marks and labels lie under the line from a mark to a plate, seen at two places of it. */
  #crossings(x, y, left, top, width, height) {
    const toX = Math.max(left, Math.min(left + width, x)) - x;
    const toY = Math.max(top, Math.min(top + height, y)) - y;
    const length = Math.hypot(toX, toY);
    const isUnder = (share) => share * length > MARK_REACH && this.#taken.count(x + share * toX - 2, y + share * toY - 2, 4, 4) > 0;
    return Number(isUnder(0.55)) + Number(isUnder(0.85));
  }

  /**
   * Takes a rectangle near a mark: where no label is, as near as can be, and over no object if there is such a place. Returns its
   * left and top edge; null where there is no room.
   */
  placeNear(key, x, y, width, height) {
    const last = this.#sides.get(key);
    let [best, found, side] = [Infinity, null, -1];
    for (let k = 0; k < REACHES.length * DIRECTIONS.length; k += 1) {
      const reach = REACHES[Math.floor(k / DIRECTIONS.length)];
      const least = reach - (k === last ? RELUCTANCE : 0);
      if (least >= best) continue;
      const [cos, sin] = DIRECTIONS[k % DIRECTIONS.length];
      // The nearest point of the rectangle is so far away.
      const left = x + reach * cos + (cos > 0.2 ? 0 : cos < -0.2 ? -width : -width / 2);
      const top = y + reach * sin + (sin > 0.8 ? 0 : sin < -0.8 ? -height : -height / 2);
      if (!this.isUntaken(left, top, width, height)) continue;
      const inTheWay = this.#objects.count(left, top, width, height, 4) + this.#crossings(x, y, left, top, width, height);
      const cost = least + COST_OF_UNDERLYING * inTheWay;
      if (cost < best) [best, found, side] = [cost, [left, top], k];
    }
    if (!found) return null;
    this.#take(...found, width, height);
    this.#remember(key, side, last);
    return found;
  }
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

/** A name without its middle where it has more letters than this. */
export function shortened(name, most) {
  if (name.length <= most) return name;
  const kept = most - 1;
  return `${name.slice(0, Math.ceil(kept / 2))}…${name.slice(-Math.floor(kept / 2))}`;
}
