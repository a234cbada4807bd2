// A value over the last minute, as means of a quarter of a second.

export const STEP_MS = 250;
export const POINTS = 240;
const SECOND = 4;
/** Steps after which a value is no longer that of now. */
const RECENT = 12;

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

  /** The mean over the second that ends with the step that is `back` steps before a time; NaN where that step has nothing. */
  mean(time, back) {
    return this.#placeOf(time, back) < 0 ? NaN : this.#meanOf(time, back, SECOND);
  }

  /** The mean over so many seconds before a time; NaN where the first of them had nothing. */
  lasting(time, seconds) {
    const steps = seconds * SECOND;
    const isThere = [...Array(SECOND)].some((_, k) => this.#placeOf(time, steps - k) >= 0);
    return isThere ? this.#meanOf(time, 1, steps) : NaN;
  }

  #meanOf(time, back, steps) {
    let [sum, count] = [0, 0];
    for (let k = 0; k < steps; k += 1) {
      const place = this.#placeOf(time, back + k);
      if (place < 0) continue;
      sum += this.#sums[place];
      count += this.#counts[place];
    }
    return sum / count;
  }

  /** The sum over the minute before a time. */
  total(time) {
    let sum = 0;
    for (let back = 0; back < POINTS; back += 1) {
      const place = this.#placeOf(time, back);
      if (place >= 0) sum += this.#sums[place];
    }
    return sum;
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

  /** What is said to be the value at a time: the newest mean over a second, at most some seconds old. */
  recent(time) {
    for (let back = 1; back <= RECENT; back += 1) {
      const value = this.mean(time, back);
      if (Number.isFinite(value)) return value;
    }
    return NaN;
  }
}
