"""Makes detection.json beside it from independent implementations: nuscenes-devkit for AP at centre distances and errors of
true positives; for AP at overlaps OpenCOOD's evaluation over shapely's polygons, reimplemented.

pip install numpy==1.26.4 shapely==2.0.7 nuscenes-devkit==1.2.0
python make_detection.py                    # Python 3.11
"""

import importlib.metadata
import json
import math
import pathlib

import numpy as np
from nuscenes.eval.common.config import config_factory
from nuscenes.eval.common.data_classes import EvalBoxes
from nuscenes.eval.common.utils import center_distance
from nuscenes.eval.detection.algo import accumulate, calc_ap, calc_tp
from nuscenes.eval.detection.data_classes import DetectionBox
from pyquaternion import Quaternion
from shapely.geometry import Polygon

HERE = pathlib.Path(__file__).resolve().parent
# Ours, and the devkit's name of it.
CATEGORIES = [("vehicle.car", "car"), ("human.pedestrian.adult", "pedestrian"), ("vehicle.bus.bendy", "bus"),
              ("movable_object.barrier", "barrier"), ("movable_object.trafficcone", "traffic_cone"),
              ("vehicle.bicycle", "bicycle")]
P_CATEGORY = [0.45, 0.2, 0.1, 0.1, 0.1, 0.05]
SIZES = [(1.8, 4.5), (0.7, 0.7), (2.6, 15.0), (2.0, 0.5), (0.4, 0.4), (0.6, 1.8)]
ERRORS = ["trans_err", "scale_err", "orient_err", "vel_err"]
OVERLAPS = [0.3, 0.5, 0.7]


# Rows of true boxes: [category, x, y, w, d, yaw, velocity or null]; of reported ones the same, and the score.


def a_scene(rng, n_instants, n_objects, sigma, p_clutter):
    scene, scores = [], set()

    def a_score():
        """Distinct: the order of equal scores is not defined."""
        while True:
            score = round(float(rng.uniform(0.02, 1)), 6)
            if score not in scores:
                scores.add(score)
                return score

    for _ in range(n_instants):
        truth, reported = [], []
        for _ in range(n_objects):
            category = int(rng.choice(len(CATEGORIES), p=P_CATEGORY))
            w, d = (side * rng.uniform(0.85, 1.2) for side in SIZES[category])
            velocity = [*rng.normal(0, 4, 2)] if rng.uniform() < 0.8 else None
            row = [category, *rng.uniform(-30, 30, 2), w, d, rng.uniform(-math.pi, math.pi), velocity]
            truth.append(row)
            for _ in range(rng.choice([0, 1, 1, 1, 1, 2])):
                flip = math.pi if rng.uniform() < 0.2 else 0.0
                measured = velocity and [v + rng.normal(0, 0.5) for v in velocity]
                confused = int(rng.choice(len(CATEGORIES))) if rng.uniform() < 0.1 else category
                reported.append([confused, *(row[1:3] + rng.normal(0, sigma, 2)), *(np.array(row[3:5]) * rng.normal(1, 0.1, 2)),
                                 row[5] + rng.normal(0, 0.1) + flip, measured, a_score()])
        for _ in range(rng.poisson(p_clutter)):
            category = int(rng.choice(len(CATEGORIES), p=P_CATEGORY))
            reported.append([category, *rng.uniform(-30, 30, 2), *SIZES[category], rng.uniform(-3, 3), [0.0, 0.0], a_score()])
        scene.append(([rounded(row) for row in truth], [rounded(row) for row in reported]))
    return scene


def rounded(row):
    return [[round(float(v), 4) for v in one] if isinstance(one, list) else one if one is None or isinstance(one, int)
            else round(float(one), 6) for one in row]


def groups(rng):
    yield "ordinary", [a_scene(rng, 8, 12, 0.5, 3) for _ in range(2)]
    yield "precise", [a_scene(rng, 6, 8, 0.1, 1)]
    yield "coarse", [a_scene(rng, 6, 10, 1.5, 8)]
    yield "nothing reported", [[(truth, []) for truth, _ in a_scene(rng, 2, 4, 0.5, 0)]]


def by_nuscenes(instants):
    config, sides = config_factory("detection_cvpr_2019"), (EvalBoxes(), EvalBoxes())
    for token, instant in enumerate(instants):
        for side, rows in enumerate(instant):
            sides[side].add_boxes(str(token), [
                DetectionBox(str(token), (row[1], row[2], 0.0), (row[3], row[4], 1.0),
                             tuple(Quaternion(axis=(0, 0, 1), radians=row[5]).elements),
                             tuple(row[6]) if row[6] else (np.nan, np.nan), detection_name=CATEGORIES[row[0]][1],
                             detection_score=row[7] if side else -1.0, attribute_name="")
                for row in rows])
    classes = {}
    for name in sorted({CATEGORIES[row[0]][1] for truth, _ in instants for row in truth}):
        curves = [accumulate(*sides, name, center_distance, distance) for distance in config.dist_ths]
        at_2_m = curves[config.dist_ths.index(config.dist_th_tp)]
        absent = {"traffic_cone": ERRORS[2:], "barrier": ERRORS[3:]}.get(name, [])
        classes[name] = {
            "ap": [float(calc_ap(curve, config.min_recall, config.min_precision)) for curve in curves],
            "errors": [None if error in absent else float(calc_tp(at_2_m, config.min_recall, error)) for error in ERRORS]}
    return classes


def polygon(row):
    _, x, y, w, d, yaw = row[:6]
    c, s = math.cos(yaw), math.sin(yaw)
    return Polygon([(x + c * u * d / 2 - s * v * w / 2, y + s * u * d / 2 + c * v * w / 2)
                    for u, v in ((1, 1), (-1, 1), (-1, -1), (1, -1))])


def by_opencood(instants, least):
    outcomes, n_true = [], 0
    for truth, reported in instants:
        free = [polygon(row) for row in truth]
        n_true += len(free)
        for row in sorted(reported, key=lambda row: -row[7]):
            mine = polygon(row)
            overlaps = [mine.intersection(one).area / mine.union(one).area for one in free]
            is_right = bool(free) and max(overlaps) >= least
            if is_right:
                free.pop(int(np.argmax(overlaps)))
            outcomes.append((row[7], is_right))
    rights = np.array([is_right for _, is_right in sorted(outcomes, key=lambda one: -one[0])], dtype=float)
    found, false = np.cumsum(rights), np.cumsum(1 - rights)
    recall, precision = [0.0, *found / n_true, 1.0], [0.0, *found / np.maximum(found + false, 1), 0.0]
    for k in range(len(precision) - 2, -1, -1):
        precision[k] = max(precision[k], precision[k + 1])
    return float(sum((recall[k] - recall[k - 1]) * precision[k] for k in range(1, len(recall))))


def main():
    rng, found = np.random.default_rng(20261128), []
    for name, scenes in groups(rng):
        instants = [instant for scene in scenes for instant in scene]
        found.append({"name": name, "scenes": [[{"truth": t, "reported": r} for t, r in scene] for scene in scenes],
                      "nuscenes": by_nuscenes(instants), "overlap": [by_opencood(instants, least) for least in OVERLAPS]})
    versions = {name: importlib.metadata.version(name) for name in ("nuscenes-devkit", "numpy", "shapely")}
    lines = ",\n".join(json.dumps(group, separators=(",", ":")) for group in found)
    (HERE / "detection.json").write_text(
        f'{{"versions":{json.dumps(versions)},\n"categories":{json.dumps([ours for ours, _ in CATEGORIES])},\n'
        f'"groups":[\n{lines}\n]}}\n')


if __name__ == "__main__":
    main()
