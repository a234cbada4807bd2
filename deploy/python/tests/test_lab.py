"""The laboratory in Python is the laboratory: its numbers are those of `lab tables`, `lab export` and `lab score`.

The files in tests/fixtures were made by the program `lab`: python3 tests/make_fixtures.py target/debug/lab
"""

import csv
import itertools
import json
import math
import pathlib

import numpy as np
import pytest

import v2x
from v2x import lab

FIXTURES = pathlib.Path(__file__).resolve().parent / "fixtures"
SOURCE = f"csv:{FIXTURES / 'scenes.csv'}"
ROWS = json.loads((FIXTURES / "tables.json").read_text())


def study(noise, **more):
    return lab.Study(lab.scenes(SOURCE), noise=noise, trials=2, seed=7, **more)


def mine(keyframe):
    """deploy/examples/own_method.py: of agents 1 and 2, the nearest boxes of a class within 5 m are averaged."""
    one, two = (report.detections for report in keyframe.reports)
    far = np.hypot(one["x"][:, None] - two["x"], one["y"][:, None] - two["y"])
    far[one["class"][:, None] != two["class"]] = np.inf
    pairs, left = [], [set(range(len(one))), set(range(len(two)))]
    for i, j in sorted(itertools.product(*left), key=lambda pair: far[pair]):
        if far[i, j] < 5 and i in left[0] and j in left[1]:
            left[0].remove(i)
            left[1].remove(j)
            pairs.append((i, j))
    boxes = lab.boxes(len(pairs) + len(left[0]) + len(left[1]))
    groups = [*pairs, *[(i, None) for i in left[0]], *[(None, j) for j in left[1]]]
    for box, members in zip(boxes, groups, strict=True):
        rows = [array[k] for array, k in zip((one, two), members, strict=True) if k is not None]
        box["class"] = rows[0]["class"]
        for name in "xywd":
            box[name] = sum(row[name] for row in rows) / len(rows)
        box["yaw"] = math.atan2(*[sum(f(row["yaw"]) for row in rows) for f in (math.sin, math.cos)])
        ids = [-1 if k is None else report.det_ids[k] for report, k in zip(keyframe.reports, members, strict=True)]
        box["det_ids"] = ids
    return boxes


@pytest.mark.parametrize("method", ["single-1", "nms", "csba-wls", "ours", "mine"])
@pytest.mark.parametrize("noise", ["N1-N3", "N3-N3"])
def test_the_numbers_are_those_of_the_tables(noise, method):
    score = study(noise).score(mine if method == "mine" else method)
    expected = [row for row in ROWS if (row["noise"], row["method"]) == (noise, method)]
    assert len(expected) == 6
    for row in expected:
        found = score.row(row["counting"], row["subset"])
        assert {name: row[name] for name in found} == found, (row["counting"], row["subset"])


def test_the_detections_are_those_of_the_export_bit_for_bit():
    scenes = lab.scenes(SOURCE)
    place = [scene.name for scene in scenes].index("south")
    keyframes = study("N1-N3").observe(place, trial=1)
    with (FIXTURES / "N1-N3-trial-1-south.csv").open() as file:
        exported = list(csv.DictReader(file))
    assert len(exported) == sum(len(report) for one in keyframes for report in one.reports)
    for row in exported:
        agent, frame, index = row["det_id"].split(":")
        keyframe = keyframes[int(frame)]
        report = keyframe.reports[["agent-1", "agent-2"].index(agent)]
        one = report.detections[int(index)]
        assert v2x.nanoseconds(float(row["t"])) == keyframe.t
        assert v2x.CLASSES[one["class"]] == row["class"]
        names = {"x": "x", "y": "y", "w": "w", "d": "d", "yaw": "yaw", "sx": "sigma_x", "sy": "sigma_y"}
        names |= {"sw": "sigma_w", "sd": "sigma_d", "st": "sigma_yaw"}
        assert {name: float(row[name]) for name in names} == {name: one[field] for name, field in names.items()}
        assert report.pose[:2] == (float(row["sensor_x"]), float(row["sensor_y"]))


def test_an_agent_alone_in_python_is_the_row_of_the_tables():
    of_lab = study("N1-N3").score("single-1")
    of_ours = study("N1-N3").score(lambda keyframe: lab.boxes_of(keyframe.reports[0]))
    for counting, subset in itertools.product(["table", "printed", "first-boxes"], ["all", "static", "moving"]):
        assert of_lab.row(counting, subset) == of_ours.row(counting, subset)


def test_a_method_with_memory_is_made_for_each_scene_and_gets_its_keyframes_in_order():
    seen = []

    class Tracker:
        def __init__(self):
            seen.append([])

        def __call__(self, keyframe):
            seen[-1].append(keyframe.frame)
            return lab.boxes_of(keyframe.reports[1], agent=1)

    study("N1-N1").score(make=Tracker)
    assert seen == [list(range(6))] * 4


def test_boxes_without_det_ids_are_matched_by_position():
    def anonymous(keyframe):
        boxes = lab.boxes_of(keyframe.reports[0])
        boxes["det_ids"] = -1
        return boxes

    row = study("N1-N1").score(anonymous).row()
    assert row["precision"] == 1.0 and row["mate_m"] == pytest.approx(study("N1-N1").score("single-1").row()["mate_m"], rel=0.1)
    with pytest.raises(ValueError, match="det_ids"):
        study("N1-N1", conditions="sensors").score(anonymous)


def test_the_synthetic_scenes_are_there_and_a_seed_gives_the_same_detections():
    scenes = lab.scenes(quick=True)
    assert len(scenes) == 12 and len(lab.scenes()) == 150
    draws = [lab.Study(scenes, noise="N2-N2", seed=seed, trials=2) for seed in (1, 1, 2)]
    first, same, other = (draw.observe(3, 1)[5].reports[0].detections.tobytes() for draw in draws)
    assert first == same and first != other
    assert draws[0].observe(3, 0)[5].reports[0].detections.tobytes() != first


def test_a_scene_of_arrays_is_the_scene_of_the_file():
    (north, south) = lab.scenes(SOURCE)
    again = [lab.Scene(scene.name, scene.keyframes, scene.truth) for scene in (north, south)]
    one, other = study("N1-N3"), lab.Study(again, noise="N1-N3", trials=2, seed=7)
    assert one.observe(1, 1)[3].reports[1].detections.tobytes() == other.observe(1, 1)[3].reports[1].detections.tobytes()
    assert one.score("ours").row() == other.score("ours").row()


def test_a_wrong_scene_says_what_is_wrong():
    (scene, _) = lab.scenes(SOURCE)

    def changed(what, field, value):
        arrays = {"keyframes": scene.keyframes, "truth": scene.truth}
        arrays[what][field][1] = value
        return lambda: lab.Scene("a", **arrays)

    for wrong, named in [
        (changed("keyframes", "t", 0), "keyframe 1 is at 0 ns"),
        (changed("keyframes", "x", math.nan), "pose of keyframe 1"),
        (changed("truth", "frame", 99), "true box 1: frame is 99"),
        (changed("truth", "id", 0), "true box 1: id is 0"),
        (changed("truth", "w", 0.0), "true box 1: w is 0"),
        (changed("truth", "x", math.inf), "true box 1: x is inf"),
        (lambda: lab.scenes("csv:no-such-file.csv"), "no-such-file.csv"),
        (lambda: lab.scenes("kitti"), "kitti"),
    ]:
        with pytest.raises(ValueError, match=named):
            wrong()


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"x": math.nan}, "box 0: x is NaN"),
        ({"w": 0.0}, "box 0: w is 0"),
        ({"existence": 2.0}, "box 0: existence is 2"),
        ({"class": 99}, "box 0: class is 99"),
        ({"det_ids": [7, -1]}, "scene north, trial 0: box 0 of keyframe .* names detection .* of agent 1"),
        ({"det_ids": [9 << 32, -1]}, "in keyframe 9"),
    ],
)
def test_a_wrong_box_says_what_is_wrong(change, named):
    def wrong(keyframe):
        boxes = lab.boxes_of(keyframe.reports[0])
        for name, value in change.items():
            boxes[name][0] = value
        if "det_ids" in change and change["det_ids"][0] == 7:
            boxes["det_ids"][0, 0] = keyframe.frame << 32 | 10_000
        return boxes

    with pytest.raises(ValueError, match=named):
        study("N1-N1").score(wrong)


def test_wrong_options_are_named_with_those_that_there_are():
    for call, named in [
        (lambda: study("N4"), "noise: unknown variant `N4`, expected one of `N1-N1`"),
        (lambda: study("N1-N1", shape="round"), "shape: unknown variant `round`"),
        (lambda: study("N1-N1", conditions="fog"), "conditions: unknown variant `fog`"),
        (lambda: study("N1-N1").score("best"), 'method is "best", expected one of single-1'),
        (lambda: study("N1-N1").observe(0, 2), "trial is 2, expected 0 to 1"),
        (lambda: study("N1-N1").observe(9, 0), "scene 9 of 2"),
        (lambda: lab.Study(lab.scenes(SOURCE) * 2), "two scenes have one name"),
        (lambda: study("N1-N1").score_boxes([]), "expected"),
        (lambda: study("N1-N1").score("ours").row("mean"), "counting: unknown variant"),
    ]:
        with pytest.raises(ValueError, match=named):
            call()
    with pytest.raises(TypeError, match="make"):
        study("N1-N1").score()
    assert "ours" in lab.METHODS and "csba-wls" in lab.METHODS


def test_a_method_cannot_see_the_truth():
    report = study("N1-N1").observe(0)[0].reports[0]
    assert {name for name in dir(report) if not name.startswith("_")} == {"pose", "detections", "det_ids"}
    order = report.detections["x"].tolist()
    assert order != sorted(order)
