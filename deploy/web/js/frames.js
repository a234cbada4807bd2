// Frames of the last minute, in order of arrival, bounded by time, number and bytes.

export const SPAN_MS = 60_000;
const MAX_FRAMES = 6000;
const MAX_BYTES = 96 << 20;

/** Bytes of all histories together. */
export const memory = { bytes: 0, limit: MAX_BYTES };

export class History {
  #frames = [];
  #first = 0;

  get length() { return this.#frames.length - this.#first; }
  get newest() { return this.#frames[this.#frames.length - 1] ?? null; }
  get oldest() { return this.#frames[this.#first] ?? null; }

  /** Adds a frame with its time of arrival (`received`, ms) and size (`bytes`); the oldest ones leave. */
  push(frame) {
    this.#frames.push(frame);
    memory.bytes += frame.bytes;
    const isTooMuch = () => memory.bytes > MAX_BYTES || this.length > MAX_FRAMES;
    while (this.length > 1 && (this.oldest.received < frame.received - SPAN_MS || isTooMuch())) this.#drop();
    if (this.#first > 512) {
      this.#frames.splice(0, this.#first);
      this.#first = 0;
    }
  }

  clear() {
    while (this.length > 0) this.#drop();
  }

  #drop() {
    memory.bytes -= this.#frames[this.#first].bytes;
    this.#frames[this.#first] = null;
    this.#first += 1;
  }

  /** The newest frame that had arrived at a time; null where there was none. */
  at(time) {
    const place = this.#placeAfter(time) - 1;
    return place >= this.#first ? this.#frames[place] : null;
  }

  /** The frame that arrived next after a time; null where none did. */
  after(time) {
    return this.#frames[this.#placeAfter(time)] ?? null;
  }

  /** The last frame before a time. */
  before(time) {
    let place = this.#placeAfter(time) - 1;
    while (place >= this.#first && this.#frames[place].received >= time) place -= 1;
    return place >= this.#first ? this.#frames[place] : null;
  }

  /** The newest frame that meets a condition, among the last `most` that had arrived at a time. */
  find(condition, most, time) {
    const newest = this.#placeAfter(time) - 1;
    const until = Math.max(this.#first, newest - most);
    for (let place = newest; place >= until; place -= 1) {
      if (condition(this.#frames[place])) return this.#frames[place];
    }
    return null;
  }

  #placeAfter(time) {
    let low = this.#first;
    let high = this.#frames.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.#frames[middle].received <= time) low = middle + 1; else high = middle;
    }
    return low;
  }
}
