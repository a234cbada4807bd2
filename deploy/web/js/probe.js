// For tests and for the curious: what is shown, and what it costs.

import { tints } from "./classes.js";
import { markOf } from "./marks.js";
import { contributorsOf } from "./scene.js";
import { STEP_MS } from "./series.js";
import { OBJECT } from "./store.js";
import { timing } from "./timing.js";

export function probe(view) {
  const { store, scene, camera } = view;
  return {
    tints,
    /** How long the charts are, s. */
    get chartSeconds() { return ((view.charts.span - 1) * STEP_MS) / 1000; },
    get stats() {
      return { ...timing(), memoryBytes: store.memoryBytes, skipped: store.skipped, held: store.held };
    },
    /** The list that is shown of each hub. */
    get shown() {
      return scene.panes.filter((pane) => pane.frame).map(({ hub, frame }) => ({
        hub: hub.name, lineage: frame.lineage, sequence: frame.sequence, objects: frame.n, tracks: [...frame.tracks], restarts: hub.restarts, keepsTracks: hub.keepsTracks,
      }));
    },
    get state() {
      const { selection } = view;
      const pane = scene.panes.find((each) => each.hub?.name === selection?.hub);
      const k = pane?.frame ? pane.frame.tracks.indexOf(selection.track) : -1;
      return {
        online: store.online, paused: store.paused, time: view.time, selection, highlighted: view.highlighted, following: view.isFollowing,
        camera: { x: camera.x, y: camera.y, scale: camera.scale }, agents: [...store.agents.keys()], hubs: [...store.hubs.keys()], events: [...store.events],
        contributors: k < 0 ? [] : contributorsOf(store, pane.frame, k).map(({ agent, detection }) => ({ agent: agent.name, isDrawn: detection !== null })),
      };
    },
    /** Where the agents are in the first picture, in pixels, how they are distinguished, and how much each reports. */
    get agentPlaces() {
      const { view: projection, agents } = scene.panes[0];
      return agents.filter(({ frame }) => frame.pose).map(({ agent, frame }) => {
        const { colour, shape, text, dash } = markOf(agent);
        return { name: agent.name, x: projection.x(frame.pose.x), y: projection.y(frame.pose.y), colour, shape, text, dash: dash.join(), detections: frame.n };
      });
    },
    /** The labels of the last picture: left and top edge, width, height, and whether an object is under it. */
    get labels() { return scene.panes.at(-1).labels.map((each) => [...each]); },
    /** Where an object of a picture is on the canvas, in pixels. */
    placeOf(k, pane = 0) {
      const { view: projection, frame } = scene.panes[pane];
      return { x: projection.x(frame.values[k * OBJECT.size + OBJECT.x]), y: projection.y(frame.values[k * OBJECT.size + OBJECT.y]) };
    },
  };
}
