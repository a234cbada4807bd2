# Cheaper lists in another language: what changes, and an area. `pip install eclipse-zenoh`
# python3 delta_and_area.py ENDPOINT QUADKEY: the hub's [hub.tiles] says where its map is
import json, sys, threading, time, zenoh

endpoint, quadkey = sys.argv[1:]
config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("connect/endpoints", json.dumps([endpoint]))
key, tiles = None, {}
one_line = threading.Lock()  # Zenoh calls each subscriber in a thread of its own


def follow(sample):
    """A key frame is the whole list; a delta frame is relative to it: what is not in it moves as the key frame says."""
    global key
    frame = json.loads(sample.payload.to_string())
    if "key_sequence" not in frame:
        key, objects = frame, frame["objects"]
    elif key and (key["hub"], key["lineage"], key["sequence"]) == (frame["hub"], frame["lineage"], frame["key_sequence"]):
        dt = (frame["fused_at"] - key["fused_at"]) * 1e-6
        known = {o["track"]: o | {"x": o["x"] + o["vx"] * dt, "y": o["y"] + o["vy"] * dt} for o in key["objects"]}
        known |= {o["track"]: o for o in frame["changed"]}
        objects = [o for track, o in known.items() if track not in frame["gone"]]
    else:
        return  # its key frame was lost: the next one comes within a second
    show("delta", frame, objects)


def area(sample):
    """Every tile with objects comes with every list; one that became empty comes once more, empty."""
    frame = json.loads(sample.payload.to_string())
    tiles[str(sample.key_expr)] = frame
    live = {k: f for k, f in tiles.items() if frame["fused_at"] - f["fused_at"] < 1_500_000}  # a lost empty frame
    show("area", frame, [o for f in live.values() for o in f["objects"]])


def show(what, frame, objects):
    places = [[o["track"], round(o["x"], 2), round(o["y"], 2)] for o in objects]
    with one_line:
        print(json.dumps({"list": what, "sequence": frame["sequence"], "objects": places}), flush=True)


with zenoh.open(config) as session:
    deltas = session.declare_subscriber("v2x/demo/hub/*/fused/delta/json", follow)
    within = session.declare_subscriber(f"v2x/demo/hub/*/fused/json/tile/{'/'.join(quadkey)}/**", area)
    time.sleep(5)
