"""Makes tests/fixtures: a small data set, and what the program `lab` makes of it.

Usage: make_fixtures.py LAB, the built program `lab`. The tests hold the package against these files.
"""

import json
import math
import pathlib
import random
import shutil
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
FIXTURES = HERE / "fixtures"
OWN_METHOD = HERE.parents[1] / "examples/own_method.py"
SEED, TRIALS, NOISE = "7", "2", "N1-N3,N3-N3"
METHODS = "single-1,nms,csba-wls,ours"
KEPT = ("noise", "method", "counting", "subset", "mate_m", "made_m", "maoe_deg", "precision", "recall")


def write_scenes(path):
    """Two scenes of six keyframes: parked and driving cars, a lorry, people."""
    draws = random.Random(3)
    with path.open("w") as out:
        print("scene,frame,t_s,object_id,class,x,y,width,length,yaw,ego_x,ego_y,ego_yaw", file=out)
        for scene in ("north", "south"):
            kinds = [("vehicle.car", 1.9, 4.6, 8.0), ("vehicle.car", 1.8, 4.3, 0.0), ("vehicle.truck", 2.5, 8.0, 5.0)]
            kinds += [("human.pedestrian.adult", 0.7, 0.7, 1.2), ("vehicle.bicycle", 0.6, 1.8, 4.0)]
            objects = [(*kind, *(draws.uniform(-40, 40) for _ in "xy"), draws.uniform(-3, 3)) for kind in kinds * 2]
            for frame in range(6):
                t = frame / 2
                for number, (kind, w, d, speed, x, y, yaw) in enumerate(objects):
                    place = x + speed * t * math.cos(yaw), y + speed * t * math.sin(yaw)
                    row = (scene, frame, t, number, kind, *(round(v, 3) for v in place), w, d, round(yaw, 3), 2 * t, 0, 0)
                    print(*row, sep=",", file=out)


def rows(lab, *arguments):
    """The rows of Table II that a command prints, with the numbers that the tests compare."""
    done = subprocess.run([lab, *arguments, "--table", "II", "--json"], capture_output=True, text=True, check=True)
    found = json.loads(done.stdout.splitlines()[-1])
    found = found["rows"] if isinstance(found, dict) else found
    names = [name for name in found[0] if name in KEPT or name.removesuffix("_std").removesuffix("_trial") in KEPT]
    return [{name: row[name] for name in names} for row in found]


def main():
    lab = sys.argv[1]
    FIXTURES.mkdir(exist_ok=True)
    write_scenes(FIXTURES / "scenes.csv")
    draws = ["--dataset", f"csv:{FIXTURES / 'scenes.csv'}", "--noise", NOISE, "--trials", TRIALS, "--seed", SEED]
    tables = rows(lab, "tables", *draws, "--methods", METHODS)
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        subprocess.run([lab, "export", *draws, "--out", folder / "detections"], check=True, capture_output=True)
        subprocess.run([sys.executable, OWN_METHOD, folder / "detections", folder / "fused"], check=True)
        own = rows(lab, "score", "--name", "mine", folder / "fused", "--export", folder / "detections", "--methods", "single-1")
        shutil.copy(folder / "detections/N1-N3/trial-1/south.csv", FIXTURES / "N1-N3-trial-1-south.csv")
    tables += [row for row in own if row["method"] == "mine"]
    # One row a line, so that a change shows.
    lines = ",\n".join(json.dumps(row) for row in tables)
    (FIXTURES / "tables.json").write_text(f"[\n{lines}\n]\n")


main()
