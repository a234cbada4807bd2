# Cheaper lists in another language: what changes, and an area. `pip install eclipse-zenoh`
# python3 delta_and_area.py [--once] ENDPOINT QUADKEY: the hub's [hub.tiles] says where its map is. It waits for a hub; with
# --once it does not
import json, signal, sys, threading, time

signal.signal(signal.SIGINT, signal.SIG_DFL)  # Ctrl-C ends it
try:
    import zenoh
except ImportError:
    sys.exit("this needs Zenoh for Python: pip install eclipse-zenoh")

given = [one for one in sys.argv[1:] if one != "--once"]
if len(given) != 2 or not set(given[1]) <= set("0123"):
    sys.exit("usage: delta_and_area.py [--once] ENDPOINT QUADKEY, such as tcp/127.0.0.1:7447 120230002213")
endpoint, quadkey = given
config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("connect/endpoints", json.dumps([endpoint]))
key, tiles = None, {}
one_line = threading.Lock()  # Zenoh calls each subscriber in a thread of its own


def connected():
    missing = f"no hub answers at {endpoint}: start one with `v2x hub --config FILE`, whose file has a table [hub.tiles]"
    while True:
        try:
            return zenoh.open(config)
        except zenoh.ZError:
            if "--once" in sys.argv:
                sys.exit(missing)
        if missing:
            print(f"{missing}; waiting for it", file=sys.stderr, flush=True)
            missing = ""
        time.sleep(1)


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


with connected() as session:
    deltas = session.declare_subscriber("v2x/demo/hub/*/fused/delta/json", follow)
    within = session.declare_subscriber(f"v2x/demo/hub/*/fused/json/tile/{'/'.join(quadkey)}/**", area)
    time.sleep(5)
