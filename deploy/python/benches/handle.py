"""How much `Engine.handle` on NumPy arrays costs beside the engine's own call in Rust, on the same frames.

Usage: handle.py [DETECTIONS], in an environment where `v2x` is installed as a release build. Builds the Rust side itself, and
runs both sides in turn. The exit code is 1 where the call from Python costs more than twice the one in Rust.
"""

import json
import pathlib
import random
import statistics
import struct
import subprocess
import sys
import tempfile
import time

import v2x
from v2x import _v2x, messages

PACKAGE = pathlib.Path(__file__).resolve().parents[1]
SECOND = 1_000_000_000
START = 1_795_314_000 * SECOND
AGENTS, FRAMES, ROUNDS = ("rsu", "van"), 600, 5
LIMIT = 2.0


def payloads(n_detections):
    """Two agents at 10 Hz, half a period apart, which see the same cars at 10 m/s with errors of 0.3 m."""
    draws = random.Random(1)
    for number in range(FRAMES):
        at = START + number * SECOND // 20
        cars = []
        for car in range(n_detections):
            x, y = 25.0 * (car % 10) + 0.5 * number, 12.0 * (car // 10)
            errors = [draws.gauss(0.0, 0.3) for _ in "xy"]
            sigma = {"x": 0.3, "y": 0.3, "w": 0.2, "d": 0.3, "yaw": 0.05}
            cars.append({"class": "car", "x": x + errors[0], "y": y + errors[1], "w": 1.9, "d": 4.6, "yaw": 0.0, "sigma": sigma})
        pose = {"x": 100.0, "y": 0.0, "yaw": 0.0}
        frame = {"captured_at": at // 1000, "sequence": str(number), "sensor_pose": pose, "detections": cars}
        yield at + 20_000_000, _v2x.encode_detections(json.dumps(frame).encode(), AGENTS[number % 2])


def rust(binary, file):
    done = subprocess.run([binary, file], capture_output=True, text=True, check=True)
    return list(map(int, done.stdout.split()))


def python(frames):
    engine, times = v2x.Engine(), []
    for now, array, head in frames:
        begin = time.perf_counter_ns()
        handled = engine.handle(array, now, **head)
        times.append(time.perf_counter_ns() - begin)
        assert handled
    return times


def arrays(payloads):
    """What a detector in Python has: arrays, and the head of each frame."""
    for now, payload in payloads:
        text, captured_at = _v2x.decode_detections(payload)
        frame = messages.DetectionFrame.from_json(json.loads(text))
        pose = (frame.sensor_pose.x, frame.sensor_pose.y, frame.sensor_pose.yaw)
        head = {"agent": frame.agent, "captured_at": captured_at, "sensor_pose": pose, "sequence": frame.sequence}
        yield now, frame.to_array(), head


def main():
    n_detections = int(sys.argv[1]) if len(sys.argv) > 1 else 50
    build = ["cargo", "build", "--quiet", "--locked", "--release", "--example", "handle", "--manifest-path", PACKAGE / "Cargo.toml"]
    subprocess.run(build, check=True)
    listed = list(payloads(n_detections))
    frames = list(arrays(listed))
    with tempfile.NamedTemporaryFile() as file:
        for now, payload in listed:
            file.write(struct.pack("<qQ", now, len(payload)) + payload)
        file.flush()
        binary = PACKAGE / "target/release/examples/handle"
        rounds = [(rust(binary, file.name), python(frames)) for _ in range(ROUNDS)]
    # The first frames meet an empty engine.
    settled = slice(FRAMES // 4, None)
    ours, theirs = (min(statistics.median(times[settled]) for times in side) / 1000 for side in zip(*rounds, strict=True))
    print(f"{n_detections} detections: {ours:.1f} us in Rust, {theirs:.1f} us from Python, a factor of {theirs / ours:.2f} (at most {LIMIT})")
    return 0 if theirs <= LIMIT * ours else 1


sys.exit(main())
