// The keyboard, and the table that explains it.

import { LAYERS } from "./layers.js";

/** Keys, words and actions; an action is called with the view. Letters are read in either case. */
const KEYS = [
  [["Space"], "pause, go on", (view) => view.togglePause(), " "],
  [["←", "→"], "one frame back, on", (view, key) => view.step(key === "ArrowLeft" ? -1 : 1), "ArrowLeft", "ArrowRight"],
  [["l"], "live", (view) => view.goLive(), "l"],
  [["+", "−"], "closer, farther", (view, key) => view.zoom(key === "-" ? 1 / 1.3 : 1.3), "+", "=", "-"],
  [["w", "a", "s", "d"], "look farther up, left, down, right", (view, key) => view.pan({ w: [0, 60], a: [60, 0], s: [0, -60], d: [-60, 0] }[key]), "w", "a", "s", "d"],
  [["0"], "fit everything", (view) => view.fit(), "0"],
  [["n", "p"], "next, previous object", (view, key) => view.selectNext(key === "n" ? 1 : -1), "n", "p"],
  [["f"], "follow what is selected", (view) => view.toggleFollow(), "f"],
  [["Esc"], "select nothing", (view) => view.select(null), "Escape"],
  [["t"], "dark or light", (view) => view.toggleTheme(), "t"],
  [["?"], "this help", (view) => view.openHelp(), "?"],
];

export function listen(view) {
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.closest("select")) return;
    const isControl = event.target.closest("input, button");
    if (isControl && [" ", "ArrowLeft", "ArrowRight"].includes(event.key)) return;
    const pressed = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    const layer = LAYERS.find((each) => each.key === pressed);
    const key = KEYS.find((each) => each.slice(3).includes(pressed));
    if (!layer && !key) return;
    // Who tries a key while the help is open sees what it does.
    const help = event.target.closest("dialog");
    if (help) {
      help.close();
      if (pressed === "Escape" || pressed === "?") return event.preventDefault();
    }
    if (layer) view.toggleLayer(layer.id); else key[2](view, pressed);
    event.preventDefault();
  });
}

export function fillHelp(table) {
  const row = (keys, words) => {
    const line = table.insertRow();
    const cell = line.insertCell();
    for (const key of keys) {
      const kbd = document.createElement("kbd");
      kbd.textContent = key;
      cell.append(kbd, " ");
    }
    line.insertCell().textContent = words;
  };
  KEYS.forEach(([keys, words]) => row(keys, words));
  row(["Tab"], "to a chart: ← → Home End read its values, Enter shows that moment");
  row(["1", "…", "9", "c", "g"], LAYERS.map((layer) => layer.name.toLowerCase()).join(", "));
}
