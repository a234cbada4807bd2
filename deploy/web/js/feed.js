// The messages of the program, as server-sent events; the browser connects again by itself.

import { noteReading } from "./timing.js";

export function follow(store, onChange) {
  const source = new EventSource("/events");
  source.onopen = () => { store.online = true; onChange(); };
  source.onerror = () => { store.online = false; onChange(); };
  source.onmessage = (event) => {
    const begun = performance.now();
    store.handle(JSON.parse(event.data), begun);
    noteReading(performance.now() - begun);
    onChange();
  };
}
