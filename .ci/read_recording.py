"""Reads a recording with PyPI's `mcap`: a reader that is not ours.

Usage: read_recording.py FILE, a recording of the demo.
"""

import collections
import json
import sys

from mcap.reader import make_reader

with open(sys.argv[1], "rb") as file:
    reader = make_reader(file)
    counts, schemas, scenes, last = collections.Counter(), {}, [], 0
    for schema, channel, message in reader.iter_messages(log_time_order=False):
        kind = channel.topic.split("/", 2)[2]
        counts[kind] += 1
        schemas[kind] = (schema.name, channel.message_encoding)
        assert message.log_time > 0 and message.data, channel.topic
        if kind.startswith("hub/") and kind.endswith("/fused/scene"):
            scenes.append(json.loads(message.data))
    facts = {metadata.name: metadata.metadata for metadata in reader.iter_metadata()}

assert {"version", "commit", "network", "recorded_by"} <= set(facts["v2x"]), facts
expected = {
    "agent/ego/detections": ("v2x.DetectionFrame", "x-v2x-postcard"),
    "agent/rsu/sensor": ("v2x.SensorDescription", "x-v2x-postcard"),
    "hub/hub/fused": ("v2x.FusedFrame", "x-v2x-postcard"),
    "hub/hub/journal": ("v2x.Journal", "x-v2x-postcard"),
    "sim/truth/ego": ("v2x.Truth", "json"),
    "hub/hub/fused/scene": ("foxglove.SceneUpdate", "json"),
    "agent/ego/detections/scene": ("foxglove.SceneUpdate", "json"),
}
for kind, schema in expected.items():
    assert schemas.get(kind) == schema, (kind, schemas)
entities = [len(scene["entities"]) for scene in scenes]
assert max(entities) > 10, entities
cube = scenes[-1]["entities"][0]["cubes"][0]
assert {"pose", "size", "color"} == set(cube), cube
print(f"read by mcap: {sum(counts.values())} messages, {counts['hub/hub/fused']} lists, up to {max(entities)} objects in a scene")
