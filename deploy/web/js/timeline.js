// Pause, step, and the slider over the last minute.

import { SPAN_MS } from "./frames.js";

export class Timeline {
  #pausedAt = 0;
  #time = 0;

  constructor(store, onChange) {
    this.store = store;
    this.onChange = onChange;
    this.pauseButton = document.getElementById("pause");
    this.slider = document.getElementById("slider");
    this.clock = document.getElementById("clock");
    this.pauseButton.addEventListener("click", () => this.toggle());
    document.getElementById("back").addEventListener("click", () => this.step(-1));
    document.getElementById("forth").addEventListener("click", () => this.step(1));
    this.slider.addEventListener("input", () => this.#slide(Number(this.slider.value)));
  }

  /** The moment that is shown, by the program's clock, ms. */
  get time() {
    return this.store.paused ? this.#time : this.store.now();
  }

  /** The newest moment that is kept: that of the pause, or now. */
  get end() {
    return this.store.paused ? this.#pausedAt : this.store.now();
  }

  toggle() {
    if (this.store.paused) this.goLive(); else this.pause();
  }

  pause() {
    if (this.store.paused) return;
    this.#pausedAt = this.#time = this.store.now();
    this.store.pause();
    this.onChange();
  }

  goLive() {
    this.store.resume();
    this.onChange();
  }

  /** Shows a moment, ms, of those that are kept. */
  seek(time) {
    this.pause();
    const oldest = this.hub?.frames.oldest?.received ?? this.#pausedAt;
    this.#time = Math.min(this.#pausedAt, Math.max(oldest, time));
    this.onChange();
  }

  /** Shows a moment so many seconds (negative) before the pause. */
  #slide(seconds) {
    this.pause();
    this.seek(this.#pausedAt + seconds * 1000);
  }

  /** One list on or back. */
  step(direction, hub = this.hub) {
    this.pause();
    const frames = hub?.frames;
    const shown = frames?.at(this.#time);
    const next = !shown ? frames?.oldest : direction > 0 ? frames.after(shown.received) : frames.before(shown.received);
    if (next) this.#time = next.received;
    this.onChange();
  }

  show() {
    const { paused } = this.store;
    const seconds = paused ? (this.#time - this.#pausedAt) / 1000 : 0;
    this.pauseButton.lastChild.textContent = paused ? "Go on" : "Pause";
    this.pauseButton.firstChild.textContent = paused ? "▶" : "❚❚";
    this.pauseButton.setAttribute("aria-pressed", String(paused));
    if (document.activeElement !== this.slider || !paused) this.slider.value = String(Math.max(-SPAN_MS / 1000, seconds));
    this.clock.textContent = paused ? `${seconds.toFixed(2).replace("-", "−")}\u00a0s` : "live";
    this.slider.setAttribute("aria-valuetext", this.clock.textContent);
    // Filled is only what is kept.
    const kept = Math.min(SPAN_MS, this.end - (this.hub?.frames.oldest?.received ?? this.end));
    this.slider.style.setProperty("--from", `${(100 * (1 - kept / SPAN_MS)).toFixed(1)}%`);
  }
}
