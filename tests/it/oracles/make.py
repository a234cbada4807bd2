"""Makes the fixtures beside it from independent implementations: py-motmetrics, TrackEval, nuscenes-devkit, scipy.

pip install numpy==1.26.4 scipy==1.13.1 pandas==2.2.3 motmetrics==1.4.0 nuscenes-devkit==1.2.0
pip install --no-deps trackeval==1.3.0      # its own bounds want numpy 2, the devkit's numpy 1; it runs with both
python make.py                              # Python 3.11
"""

import importlib.metadata
import json
import math
import pathlib
import warnings

import motmetrics
import numpy as np
from nuscenes.eval.common.config import config_factory
from nuscenes.eval.common.data_classes import EvalBoxes
from nuscenes.eval.common.utils import scale_iou
from nuscenes.eval.detection.data_classes import DetectionBox
from nuscenes.eval.tracking import loaders
from nuscenes.eval.tracking.data_classes import TrackingBox
from nuscenes.eval.tracking.evaluate import TrackingEval
from nuscenes.eval.tracking.utils import category_to_tracking_name
from scipy.stats import chi2
from trackeval.datasets._base_dataset import _BaseDataset
from trackeval.metrics import HOTA

HERE = pathlib.Path(__file__).resolve().parent
GATE_M = 2.0
CATEGORIES = ["vehicle.car", "human.pedestrian.adult", "vehicle.bus.bendy", "vehicle.truck", "vehicle.bicycle",
              "human.pedestrian.child", "vehicle.construction", "movable_object.barrier"]
CLEAR = ["num_objects", "num_matches", "num_switches", "num_false_positives", "num_misses", "num_fragmentations",
         "mota", "motp"]
IDENTITY = ["idtp", "idfp", "idfn", "idf1", "idp", "idr"]
HOTA_FIELDS = ["HOTA", "DetA", "AssA", "LocA", "DetRe", "DetPr", "AssRe", "AssPr"]
NUSCENES = ["amota", "amotp", "motar", "mota", "motp", "recall", "tp", "fp", "fn", "ids", "frag"]


# --- Sequences. A scene is a list of instants (truth, reported): truth has rows [id, category, x, y], reported has rows
# [track, category, score, x, y]. Scores are multiples of 1/64, so that their sums are exact in any order.


def a_scene(rng, n_instants, n_objects, arena_m, sigma_m):
    """Objects that come, go and hide; tracks that are late, off, lost, found again, split, and swapped."""
    objects = []
    for number in range(n_objects):
        first = int(rng.integers(0, max(1, n_instants // 3)))
        last = int(rng.integers(2 * n_instants // 3, n_instants + 1))
        hidden = int(rng.integers(first + 1, n_instants)) if rng.uniform() < 0.3 else None
        objects.append({"id": 10 * number + 3, "category": int(rng.choice(len(CATEGORIES), p=P_CATEGORY)),
                        "at": rng.uniform(-arena_m, arena_m, 2), "v": rng.normal(0, 0.6, 2), "life": range(first, last),
                        "hidden": range(hidden, hidden + int(rng.integers(1, 4))) if hidden else range(0),
                        "track": number + 1, "lost": 0, "score": float(rng.integers(20, 64))})
    next_track, clutter, scene = 100, [], []
    for instant in range(n_instants):
        truth, reported = [], []
        present = [one for one in objects if instant in one["life"] and instant not in one["hidden"]]
        rng.shuffle(present)
        if len(present) > 1 and rng.uniform() < 0.15:
            a, b = present[:2]
            a["track"], b["track"] = b["track"], a["track"]
        for one in present:
            one["at"] = one["at"] + one["v"]
            truth.append([one["id"], one["category"], *(round(float(v), 3) for v in one["at"])])
            if one["lost"] == 0 and rng.uniform() < 0.1:
                one["lost"] = int(rng.integers(1, 5))
            if one["lost"] > 0:
                one["lost"] -= 1
                if one["lost"] == 0 and rng.uniform() < 0.4:
                    one["track"], next_track = next_track, next_track + 1
                continue
            at = one["at"] + rng.normal(0, sigma_m * (4 if rng.uniform() < 0.06 else 1), 2)
            category = int(rng.integers(0, 4)) if rng.uniform() < 0.04 else one["category"]
            score = float(np.clip(one["score"] + rng.integers(-6, 7), 1, 64)) / 64
            reported.append([one["track"], category, score, *(round(float(v), 3) for v in at)])
        if rng.uniform() < 0.25:
            clutter.append([next_track, int(rng.integers(0, 5)), float(rng.integers(5, 40)) / 64,
                            rng.uniform(-arena_m, arena_m, 2), int(rng.integers(1, 6))])
            next_track += 1
        for one in clutter:
            if one[4] > 0:
                one[4] -= 1
                reported.append([*one[:3], *(round(float(v), 3) for v in one[3] + rng.normal(0, 0.3, 2))])
        rng.shuffle(reported)
        scene.append((truth, reported))
    return scene


P_CATEGORY = [0.34, 0.2, 0.08, 0.12, 0.08, 0.06, 0.06, 0.06]


def gaps():
    """Made by hand: one track over a hole in the truth, a track lost and found, one lost and replaced, one taken over."""
    def at(x, y):
        return [round(x, 3), round(y, 3)]
    scene = []
    for k in range(12):
        truth, reported = [], []
        if k not in (4, 5, 6):
            truth.append([1, 0, *at(0.5 * k, 0.01 * k)])
        reported.append([7, 0, 0.75, *at(0.5 * k + 0.11, 0.3)])
        truth.append([2, 0, *at(0.4 * k, 10.0)])
        if k not in (3, 4, 8):
            reported.append([8 if k < 8 else 9, 0, 0.5, *at(0.4 * k, 10.2 + 0.013 * k)])
        truth.append([3, 1, *at(20.0, 0.3 * k)])
        if k not in (5,):  # a hole of one, and the replacement for a while of the track by another one, still reported
            reported.append([10, 1, 0.875, *at(20.3 if k < 7 else 22.5, 0.3 * k)])
        if k >= 7:
            reported.append([11, 1, 0.25, *at(20.2, 0.3 * k + 0.1)])
        if k in (0, 9):
            reported.append([12, 3, 0.625, *at(-30.0 + k, 4.0)])  # filled in between by the devkit
        scene.append((truth, reported))
    return scene


def edges():
    """A similarity that is an α up to rounding; two objects that remember one track and are both away from the tables."""
    near = ([1, 0, 0.0, 0.0], [7, 0, 0.5, 0.2, 0.0])
    objects = [[[9, 0, 100.0, 0.0]], [[4, 0, 100.5, 0.0], [9, 0, 110.0, 0.0]], [], [[4, 0, 111.9, 0.0], [9, 0, 102.0, 0.0]]]
    tracks = [[20, 0, 0.75, 100.0, 0.1], [20, 0, 0.75, 100.5, 0.3], [20, 0, 0.75, 106.7, 0.2], [20, 0, 0.75, 150.0, 0.0]]
    return [([near[0], *truth], [near[1], reported]) for truth, reported in zip(objects, tracks)]


def groups(rng):
    """Scenes that are evaluated together."""
    ordinary = [a_scene(rng, 20, 7, 14.0, 0.45) for _ in range(4)]
    yield "ordinary", ordinary
    yield "crowded", [a_scene(rng, 14, 9, 3.0, 0.8) for _ in range(3)]
    yield "precise", [a_scene(rng, 12, 5, 20.0, 0.05) for _ in range(2)]
    short = a_scene(rng, 6, 4, 6.0, 0.4)
    silent = [(truth, []) for truth, _ in a_scene(rng, 4, 3, 6.0, 0.4)]
    haunted = [([], reported) for _, reported in a_scene(rng, 4, 3, 6.0, 0.4)]
    blinking = [frame if k % 3 else ([], []) for k, frame in enumerate(a_scene(rng, 9, 4, 6.0, 0.4))]
    elsewhere = [(truth, [[track, category, score, x + 60.0, y] for track, category, score, x, y in reported])
                 for truth, reported in short]
    yield "special", [short, silent, haunted, blinking, [([], [])] * 3, elsewhere, gaps()]
    yield "gaps alone", [gaps()]
    yield "edges", [edges()]
    yield "nothing reported", [silent]
    yield "nothing true", [haunted]
    yield "nothing near", [elsewhere]


# --- The oracles.


def number(value):
    """A JSON number; null where the oracle has NaN or an infinity. The devkit sums scenes in no fixed order: 12 digits."""
    value = float(f"{value:.12g}")
    return (int(value) if value.is_integer() else value) if math.isfinite(value) else None


def points(rows):
    return np.array([row[-2:] for row in rows], dtype=float).reshape(-1, 2)


def by_motmetrics(scenes):
    """Each scene, and all as one: the library's own combination loses motp where a scene has no match."""
    accumulators = [motmetrics.MOTAccumulator(auto_id=True) for _ in range(len(scenes) + 1)]
    for place, scene in enumerate(scenes):
        for truth, reported in scene:
            distances = np.linalg.norm(points(truth)[:, None] - points(reported)[None], axis=2)
            distances[distances >= GATE_M] = np.nan
            for accumulator in (accumulators[place], accumulators[-1]):
                accumulator.update(*([1000 * place + row[0] for row in rows] for rows in (truth, reported)), distances)
    host = motmetrics.metrics.create()
    tables = [host.compute(accumulator, metrics=CLEAR + IDENTITY, name="it") for accumulator in accumulators]
    return [{name: number(table.loc["it", name]) for name in CLEAR + IDENTITY} for table in tables]


def by_trackeval(scenes, zero_m):
    metric, by_scene = HOTA(), {}
    for place, scene in enumerate(scenes):
        ids = [{name: k for k, name in enumerate(sorted({row[0] for frame in scene for row in frame[side]}))}
               for side in (0, 1)]
        names = [[np.array([ids[side][row[0]] for row in frame[side]], dtype=int) for frame in scene] for side in (0, 1)]
        by_scene[place] = metric.eval_sequence({
            "num_gt_ids": len(ids[0]), "num_tracker_ids": len(ids[1]), "gt_ids": names[0], "tracker_ids": names[1],
            "num_gt_dets": sum(map(len, names[0])), "num_tracker_dets": sum(map(len, names[1])),
            "similarity_scores": [
                _BaseDataset._calculate_euclidean_similarity(points(truth), points(reported), zero_distance=zero_m)
                for truth, reported in scene],
        })
    results = [*by_scene.values(), metric.combine_sequences(by_scene)]
    return [{field: number(np.mean(result[field])) for field in HOTA_FIELDS} for result in results]


class Tables:
    """What the devkit's loader asks of nuScenes' tables, at 2 Hz."""

    def __init__(self, scenes):
        self.records = {}
        for place, scene in enumerate(scenes):
            tokens = [f"{place}-{k}" for k in range(len(scene))]
            self.records["scene", str(place)] = {
                "name": str(place), "first_sample_token": tokens[0], "last_sample_token": tokens[-1]}
            for k, token in enumerate(tokens):
                following = tokens[k + 1] if k + 1 < len(tokens) else ""
                self.records["sample", token] = {
                    "scene_token": str(place), "timestamp": 500_000 * k, "next": following}

    def get(self, table, token):
        return self.records[table, token]


def by_nuscenes(scenes):
    evaluation = object.__new__(TrackingEval)  # its constructor wants nuScenes on disk
    evaluation.cfg, evaluation.verbose = config_factory("tracking_nips_2019"), False
    evaluation.output_dir, evaluation.render_classes = "", []
    tables, boxes = Tables(scenes), (EvalBoxes(), EvalBoxes())
    loaders.get_scenes_of_split = lambda split_name, nusc: [str(k) for k in range(len(scenes))]
    for place, scene in enumerate(scenes):
        for k, frame in enumerate(scene):
            for side, rows in enumerate(frame):
                kept = [(row, category_to_tracking_name(CATEGORIES[row[1]])) for row in rows]
                boxes[side].add_boxes(f"{place}-{k}", [
                    TrackingBox(f"{place}-{k}", (*row[-2:], 0.0), (1.0, 1.0, 1.0), (1.0, 0.0, 0.0, 0.0),
                                tracking_id=str(row[0]), tracking_name=name, tracking_score=row[2] if side else -1.0)
                    for row, name in kept if name is not None])
    evaluation.tracks_gt = loaders.create_tracks(boxes[0], tables, "", gt=True)
    evaluation.tracks_pred = loaders.create_tracks(boxes[1], tables, "", gt=False)
    metrics, _ = evaluation.evaluate()
    by_class = {name: {metric: number(metrics.compute_metric(metric, name)) for metric in NUSCENES}
                for name in metrics.class_names}
    return {"classes": by_class, "all": {metric: number(metrics.compute_metric(metric)) for metric in NUSCENES}}


def sizes(rng):
    """Overlaps of aligned boxes of equal height."""
    for _ in range(25):
        a, b = ([round(float(v), 3) for v in rng.uniform(0.3, 12, 2)] for _ in range(2))
        iou = scale_iou(*(DetectionBox(size=(*side, 1.0), detection_name="car") for side in (a, b)))
        yield {"a": a, "b": b, "ase": float(1 - iou)}


def errors(rng):
    """Errors with their covariances, the mean of eᵀ S⁻¹ e / dof, and the band of that mean for a consistent filter."""
    for dof, n in [(1, 1), (1, 7), (2, 2), (2, 40), (1, 100)]:
        samples, total = [], 0.0
        for _ in range(n):
            root = rng.normal(0, 1, (dof, dof)) + 0.6 * np.eye(dof)
            covariance = np.round(root @ root.T + 0.05 * np.eye(dof), 3)
            error = np.round(rng.multivariate_normal(np.zeros(dof), covariance), 3)
            total += error @ np.linalg.solve(covariance, error)
            samples.append([*error.tolist(), *covariance[np.triu_indices(dof)].tolist()])
        band = [float(chi2.ppf(p, n * dof) / (n * dof)) for p in (0.025, 0.975)]
        yield {"dof": dof, "samples": samples, "mean": total / (n * dof), "band": band}


def main():
    warnings.simplefilter("ignore")
    rng = np.random.default_rng(20261018)
    versions = {name: importlib.metadata.version(name)
                for name in ("motmetrics", "trackeval", "nuscenes-devkit", "numpy", "scipy", "pandas")}
    found = []
    for name, scenes in groups(rng):
        found.append({
            "name": name,
            "scenes": [[{"truth": truth, "reported": reported} for truth, reported in scene] for scene in scenes],
            "motmetrics": by_motmetrics(scenes),
            "hota": {str(zero_m): by_trackeval(scenes, zero_m) for zero_m in (4.0, 2.0)},
            "nuscenes": by_nuscenes(scenes),
        })
    lines = ",\n".join(json.dumps(group, separators=(",", ":")) for group in found)
    (HERE / "tracking.json").write_text(
        f'{{"versions":{json.dumps(versions)},\n"gate_m":{GATE_M},\n"categories":{json.dumps(CATEGORIES)},\n'
        f'"groups":[\n{lines}\n]}}\n')
    for name, cases in [("sizes", sizes(rng)), ("nees", errors(rng))]:
        (HERE / f"{name}.json").write_text("[\n" + ",\n".join(json.dumps(case) for case in cases) + "\n]\n")


if __name__ == "__main__":
    main()
