"""Runs the Python clients of the documents against a real hub: the car of the guide's comes back fused, and the one for cheaper
lists follows it by what changes and by tile.

Usage: foreign_client.py V2X, where V2X is the built program. Needs the package eclipse-zenoh.
"""

import ast
import json
import math
import pathlib
import re
import signal
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
EXAMPLE = ROOT / "deploy/examples/foreign_client.py"
LISTS = ROOT / "deploy/examples/delta_and_area.py"
# Munich, and the tile of zoom 12 that holds it.
SETTINGS = "[hub]\ntiles = { latitude_deg = 48.137, longitude_deg = 11.575 }\n"
AREA = "120230002213"
GUIDE = ROOT / "deploy/docs/guide.md"


def guide_shows_the_example():
    blocks = re.findall(r"```python\n(.*?)```", GUIDE.read_text(), re.DOTALL)
    assert EXAMPLE.read_text() in blocks, "guide.md does not show deploy/examples/foreign_client.py as it is"


def started(hub):
    """The endpoint of a hub once it is ready."""
    return json.loads(hub.stdout.readline())["locators"][0]


def run_clients(v2x, settings):
    """What the two clients print while both are at one hub."""
    hub = subprocess.Popen(
        [v2x, "hub", "--listen", "tcp/127.0.0.1:0", "--config", settings, "--events", "--exit-with-stdin"],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )
    try:
        endpoint = started(hub)
        command = [sys.executable, str(LISTS), endpoint, AREA]
        lists = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        command = [sys.executable, str(EXAMPLE), endpoint]
        client = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
        followed, _ = lists.communicate(timeout=60)
        assert lists.returncode == 0, "the client for cheaper lists failed"
    finally:
        hub.stdin.close()
        assert hub.wait(timeout=20) == 0, "the hub did not end cleanly"
    return client.stdout.splitlines(), followed.splitlines()


def without_a_hub():
    """Each client says in one line what is missing and which command starts it; it waits, and Ctrl-C ends it."""
    endpoint = "tcp/127.0.0.1:1"
    for command in ([str(EXAMPLE), endpoint], [str(LISTS), endpoint, AREA]):
        command = [sys.executable, *command]
        once = subprocess.run([*command, "--once"], capture_output=True, text=True, timeout=60, check=False)
        assert once.returncode == 1 and "`v2x hub" in once.stderr and len(once.stderr.splitlines()) == 1, once.stderr
        waiting = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        said = waiting.stderr.readline()
        waiting.send_signal(signal.SIGINT)
        _, more = waiting.communicate(timeout=20)
        assert "waiting for it" in said and not more, said + more
    print("ok: without a hub the Python clients say which command starts one, wait for it, and end by Ctrl-C")


def check_fused(lines):
    lists = [objects for objects in map(ast.literal_eval, lines) if objects]
    assert lists, "no fused object came back"
    car = lists[-1][0]
    assert car["class"] == "vehicle.car", car["class"]
    assert [c["agent"] for c in car["contributors"]] == ["camera"], car["contributors"]
    assert abs(car["vx"] - 1.0) < 0.5 and abs(car["y"] - 5.0) < 0.1, (car["vx"], car["y"])
    print(f"ok: the Python client's car came back in {len(lists)} fused frames, at {car['vx']:.2f} m/s")


def check_followed(lines):
    """The list by what changes is within 0.2 m of the tile's, which is not rounded to a tolerance."""
    places = {"delta": {}, "area": {}}
    for line in map(json.loads, lines):
        if line["objects"]:
            places[line["list"]][line["sequence"]] = line["objects"]
    both = places["delta"].keys() & places["area"].keys()
    assert len(both) > 5, f"{len(both)} lists came by both ways"
    for sequence in both:
        (track, x, y), (same, tile_x, tile_y) = places["delta"][sequence][0], places["area"][sequence][0]
        assert track == same and math.dist((x, y), (tile_x, tile_y)) < 0.22, (sequence, x, y, tile_x, tile_y)
    print(f"ok: {len(both)} lists came by what changes and by tile, and are the same within 0.2 m")


def main():
    guide_shows_the_example()
    without_a_hub()
    with tempfile.NamedTemporaryFile("w", suffix=".toml") as settings:
        settings.write(SETTINGS)
        settings.flush()
        fused, followed = run_clients(sys.argv[1], settings.name)
    check_fused(fused)
    check_followed(followed)


main()
