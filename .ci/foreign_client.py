"""Runs the guide's Python client against a real hub, and checks that its car comes back fused.

Usage: foreign_client.py V2X, where V2X is the built program. Needs the package eclipse-zenoh.
"""

import ast
import json
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
EXAMPLE = ROOT / "deploy/examples/foreign_client.py"
GUIDE = ROOT / "deploy/docs/guide.md"


def guide_shows_the_example():
    blocks = re.findall(r"```python\n(.*?)```", GUIDE.read_text(), re.DOTALL)
    assert EXAMPLE.read_text() in blocks, "guide.md does not show deploy/examples/foreign_client.py as it is"


def fused_objects(v2x):
    hub = subprocess.Popen(
        [v2x, "hub", "--listen", "tcp/127.0.0.1:0", "--events", "--exit-with-stdin"],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )
    try:
        ready = json.loads(hub.stdout.readline())
        command = [sys.executable, str(EXAMPLE), ready["locators"][0]]
        client = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    finally:
        hub.stdin.close()
        assert hub.wait(timeout=20) == 0, "the hub did not end cleanly"
    return [ast.literal_eval(line) for line in client.stdout.splitlines()]


def main():
    guide_shows_the_example()
    lists = [objects for objects in fused_objects(sys.argv[1]) if objects]
    assert lists, "no fused object came back"
    car = lists[-1][0]
    assert car["class"] == "vehicle.car", car["class"]
    assert [c["agent"] for c in car["contributors"]] == ["camera"], car["contributors"]
    assert abs(car["vx"] - 1.0) < 0.5 and abs(car["y"] - 5.0) < 0.1, (car["vx"], car["y"])
    print(f"ok: the Python client's car came back in {len(lists)} fused frames, at {car['vx']:.2f} m/s")


main()
