"""A camera at an intersection that is not there: it sends what cam1 or cam2 of hub.toml would, ten times a second.

    python3 camera.py NAME FOLDER [SECONDS] [--once]

FOLDER is the one of its certificate (`v2x certs agent NAME`). It waits for a hub; with --once it does not. Needs `pip install eclipse-zenoh`. For trying an installation without
cameras, and as the frame of a program of your own.
"""

import json
import math
import os
import random
import signal
import sys
import time

signal.signal(signal.SIGINT, signal.SIG_DFL)  # Ctrl-C ends it
try:
    import zenoh
except ImportError:
    sys.exit("this needs Zenoh for Python: pip install eclipse-zenoh")

# Four vehicles on two roads, and two people: class, start (m), velocity (m/s). After 12 s each begins again.
ROADS = [
    ("car", (-60, -2), (10, 0)), ("car", (60, 2), (-9, 0)), ("car", (2, -55), (0, 9)), ("car", (-2, 60), (0, -10)),
    ("pedestrian", (-9, -8), (1.4, 0)), ("pedestrian", (9, 8), (0, -1.3)),
]
POSES = {"cam1": (-16.0, 15.0, -0.75), "cam2": (18.0, -14.0, 2.53)}  # x, y (m), yaw (rad)


def seen(name, now, random_numbers):
    """What is there at a time: class, x, y and heading in the map with a camera's errors, and the standard deviation of x and y."""
    t = now % 12.0
    for kind, (x, y), (vx, vy) in ROADS:
        x, y = x + vx * t, y + vy * t
        sigma = 0.2 + 0.01 * math.dist((x, y), POSES[name][:2])
        noise = [random_numbers.gauss(0, sigma) for _ in range(2)]
        yield kind, x + noise[0], y + noise[1], math.atan2(vy, vx) + random_numbers.gauss(0, 0.05), sigma


def written(name, kind, x, y, yaw, sigma):
    """As this camera writes it."""
    size = {"w": 1.8, "d": 4.5} if kind == "car" else {"w": 0.6, "d": 0.5}
    size["sigma"] = {"x": sigma, "y": sigma}
    if name == "cam1":
        kind = {"car": "Auto", "pedestrian": "Fussgaenger"}[kind]
        return {"class": kind, "x": x, "y": y, "yaw": (90 - math.degrees(yaw)) % 360, **size}
    px, py, turned = POSES[name]
    east, north = x - px, y - py
    ahead = east * math.cos(turned) + north * math.sin(turned)
    left = north * math.cos(turned) - east * math.sin(turned)
    return {"class": kind, "x": ahead, "y": left, "yaw": math.remainder(yaw - turned, 2 * math.pi), **size}


def connected(folder, once):
    missing = (
        f"no hub lets the holder of {folder} in: start one with `v2x hub --zenoh-config certs/hub/hub/zenoh.json5 --config hub.toml`; "
        "if one runs, `v2x certs list` says which certificates are valid"
    )
    os.chdir(folder)  # Zenoh looks there for the files that its configuration names
    config = zenoh.Config.from_file("zenoh.json5")
    while True:
        try:
            return zenoh.open(config)
        except zenoh.ZError:
            if once:
                sys.exit(missing)
        if missing:
            print(f"{missing}; waiting for it", file=sys.stderr, flush=True)
            missing = ""
        time.sleep(1)


def main(name, folder, seconds=math.inf, once=False):
    random_numbers = random.Random(name)
    with connected(folder, once) as session:
        # As long as this is there, the hub knows that the camera is connected.
        _alive = session.liveliness().declare_token(f"v2x/demo/agent/{name}/alive")
        frames = session.declare_publisher(f"v2x/demo/agent/{name}/detections")
        epoch = time.time_ns()  # another one at each start: two that run under one name are noticed
        end = time.time() + seconds
        while (now := time.time()) < end:
            detections = [written(name, *one) for one in seen(name, now, random_numbers)]
            # A real one takes the time of the exposure, not of the end of its computation.
            frame = {"epoch": epoch, "captured_at": round(now * 1e6), "map_frame": "main-and-5th", "detections": detections}
            if name == "cam1":
                # In its own way of writing, too: headings of this camera are degrees from north.
                x, y, yaw = POSES[name]
                frame["sensor_pose"] = {"x": x, "y": y, "yaw": (90 - math.degrees(yaw)) % 360}
            frames.put(json.dumps(frame))
            time.sleep(0.1)


if __name__ == "__main__":
    given = [one for one in sys.argv[1:] if one != "--once"]
    if len(given) not in (2, 3) or given[0] not in POSES or not os.path.isfile(os.path.join(given[1], "zenoh.json5")):
        sys.exit(f"usage: camera.py NAME FOLDER [SECONDS] [--once], where NAME is one of {', '.join(POSES)} and FOLDER has its zenoh.json5")
    main(*given[:2], float(given[2]) if given[2:] else math.inf, "--once" in sys.argv)
