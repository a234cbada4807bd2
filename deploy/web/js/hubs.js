// Which hubs are shown: one, or two side by side; chosen by the user, else by what is there.

import { palette } from "./palette.js";

/** Colour and dash of all that is of the first hub, or of the second one, which is in ink. */
export function hubStyle(k) {
  return k === 0 ? { colour: palette.ours, dash: [] } : { colour: palette.ink, dash: [5, 3] };
}

const $ = (id) => document.getElementById(id);
const SELECTS = ["hub-left", "hub-right"];

export class HubChoice {
  #chosen = [null, null];

  constructor(store, onChange) {
    this.store = store;
    SELECTS.forEach((id, k) => $(id).addEventListener("change", (event) => {
      this.#chosen[k] = event.target.value;
      onChange();
    }));
  }

  /** The hubs that are shown. One that left is shown only where it is chosen or nothing else is there. */
  get shown() {
    const { store } = this;
    const names = [...store.hubs.values()].filter((hub) => hub.frames.newest || hub.status).map((hub) => hub.name).sort();
    const alive = names.filter((name) => !store.isGone(name));
    const order = alive.length ? alive : names;
    const left = names.includes(this.#chosen[0]) ? this.#chosen[0] : order[0];
    const isKnown = this.#chosen[1] === "" || names.includes(this.#chosen[1]);
    const right = isKnown ? this.#chosen[1] : order.find((name) => name !== left);
    return [left, right].filter((name, k, all) => names.includes(name) && all.indexOf(name) === k).map((name) => store.hubs.get(name));
  }

  /** Brings the two lists up to date, with those that left marked. */
  show(shown) {
    const names = [...this.store.hubs.keys()].sort();
    $("hubs").hidden = names.length < 2;
    SELECTS.forEach((id, k) => {
      const options = (k === 1 ? ["", ...names] : names).map((name) => [name, name === "" ? "none" : this.store.isGone(name) ? `${name} (gone)` : name]);
      const select = $(id);
      if ([...select.options].map((option) => option.text).join() !== options.map(([, text]) => text).join()) {
        select.replaceChildren(...options.map(([name, text]) => new Option(text, name)));
      }
      if (document.activeElement !== select) select.value = shown[k]?.name ?? "";
    });
  }
}
