// A value over the last minute, as means of a quarter of a second.

export const STEP_MS = 250;
export const POINTS = 240;

export class Series {
  #sums = new Float64Array(POINTS);
  #counts = new Float64Array(POINTS);
  #numbers = new Float64Array(POINTS);

  /** Adds a value of a time (ms). */
  add(time, value, weight = 1) {
    if (!Number.isFinite(value)) return;
    const number = Math.floor(time / STEP_MS);
    const place = number % POINTS;
    if (this.#numbers[place] !== number) {
      this.#numbers[place] = number;
      this.#sums[place] = 0;
      this.#counts[place] = 0;
    }
    this.#sums[place] += value;
    this.#counts[place] += weight;
  }

  /** The mean of the step that is `back` steps before a time; NaN where nothing was added. */
  mean(time, back) {
    const place = this.#placeOf(time, back);
    return place < 0 ? NaN : this.#sums[place] / this.#counts[place];
  }

  /** The sum of that step, a second; 0 where nothing was added. */
  perSecond(time, back) {
    const place = this.#placeOf(time, back);
    return place < 0 ? 0 : (this.#sums[place] * 1000) / STEP_MS;
  }

  #placeOf(time, back) {
    const number = Math.floor(time / STEP_MS) - back;
    const place = ((number % POINTS) + POINTS) % POINTS;
    return this.#numbers[place] === number && this.#counts[place] > 0 ? place : -1;
  }

  /** The mean of the last second. */
  recent(time) {
    let sum = 0;
    let count = 0;
    for (let back = 0; back < 1000 / STEP_MS + 1; back += 1) {
      const value = this.mean(time, back);
      if (Number.isFinite(value)) { sum += value; count += 1; }
    }
    return count ? sum / count : NaN;
  }
}
