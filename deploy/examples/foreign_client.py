# Your detector in another language: any Zenoh client that puts JSON. `pip install eclipse-zenoh`
# python3 foreign_client.py [--once] [ENDPOINT ...]: it waits for a hub; with --once it does not
import json, signal, sys, time

signal.signal(signal.SIGINT, signal.SIG_DFL)  # Ctrl-C ends it
try:
    import zenoh
except ImportError:
    sys.exit("this needs Zenoh for Python: pip install eclipse-zenoh")

endpoints = [one for one in sys.argv[1:] if one != "--once"] or ["tcp/127.0.0.1:7447"]
if {"-h", "--help"} & set(endpoints):
    sys.exit(print("python3 foreign_client.py [--once] [ENDPOINT ...]   an ENDPOINT is tcp/HOST:7447; --once: do not wait for a hub"))
for one in endpoints:
    if one.startswith("-") or "/" not in one:
        sys.exit(f"{one} is no endpoint, which names its protocol: tcp/HOST:PORT, such as tcp/127.0.0.1:7447")
config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("connect/endpoints", json.dumps(endpoints))


def connected():
    missing = f"no hub answers at {', '.join(endpoints)}: start one with `v2x hub` (or `cargo v2x hub`) in another terminal"
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


with connected() as session:
    show = lambda sample: print(json.loads(sample.payload.to_string())["objects"], flush=True)
    # Every hub; with the name of one in place of `*` that one alone is believed.
    fused = session.declare_subscriber("v2x/demo/hub/*/fused/json", show)
    camera = session.declare_publisher("v2x/demo/agent/camera/detections")
    epoch = time.time_ns()  # another one at each start: two that run under one name are noticed
    for tenth in range(300):  # for half a minute: `v2x check` listens for ten seconds
        car = {"class": "car", "x": 10 + tenth / 10, "y": 5.0}  # driving east at 1 m/s
        camera.put(json.dumps({"epoch": epoch, "captured_at": time.time_ns() // 1000, "detections": [car]}))
        time.sleep(0.1)
