"""The dataclasses are the network's JSON: checked against its schemas and its golden files."""

import json
import math
import pathlib
from dataclasses import replace

import numpy as np
import pytest
from jsonschema import Draft202012Validator

import v2x
from v2x import messages, schemas
from v2x.follow import AreaFollower, DeltaFollower
from v2x.messages import (
    Accuracy, Body, DeltaFrame, Detection, DetectionFrame, FieldOfView, FusedFrame, Pose, SensorDescription, Sigma,
    SizeNoise, Velocity,
)  # fmt: skip

COMMON = pathlib.Path(__file__).resolve().parents[3] / "common"
GOLDEN = COMMON / "it/golden"

FULL = DetectionFrame(
    1_795_314_000_000_001_000,
    (
        Detection("car", 12.0, 5.0),
        Detection(
            "human.pedestrian.adult", 1.0, -2.0, 0.6, 0.7, -3.0, 0.5, "axis", Sigma(0.3, 0.4, 0.1, 0.1, 0.2, 0.05),
            Velocity(1.0, 2.0, 0.1, 0.2, -0.5), 2**60,
        ),
    ),
    "camera", 2**63, 7, Pose(1.0, 2.0, 3.0), 4, "EPSG:32632",
)  # fmt: skip
DESCRIPTION = SensorDescription(
    FieldOfView(80.0, 1.0, 0.5, 2.0), 10.0, "vehicle", 0.95, 1e-5, Accuracy(0.2, 0.01, 0.005), SizeNoise(0.2, 0.5),
    Body("vehicle.car", 1.9, 4.6), 3,
)  # fmt: skip


def check(schema, value):
    Draft202012Validator.check_schema(schema)
    errors = list(Draft202012Validator(schema).iter_errors(value))
    assert not errors, errors[0].message


def golden(name):
    files = sorted(GOLDEN.glob(f"*/{name}.json"))
    assert files
    return [json.loads(path.read_text(encoding="utf-8")) for path in files]


def test_what_agents_send_is_as_the_schemas_say():
    for frame in (FULL, DetectionFrame(0), DetectionFrame(5000, (Detection("van", 0.0, 0.0),))):
        check(schemas.DETECTION_FRAME, frame.to_json())
    for description in (DESCRIPTION, SensorDescription(FieldOfView(50.0), 10.0)):
        check(schemas.SENSOR_DESCRIPTION, description.to_json())


def test_what_agents_send_is_read_as_it_was_written():
    assert DetectionFrame.from_json(json.loads(json.dumps(FULL.to_json()))) == FULL
    assert SensorDescription.from_json(json.loads(json.dumps(DESCRIPTION.to_json()))) == DESCRIPTION


NAN, INF = float("nan"), float("inf")


def frame_of(**fields):
    return replace(FULL, **fields)


def frame_with(**fields):
    return replace(FULL, detections=(FULL.detections[0], replace(FULL.detections[1], **fields)))


@pytest.mark.parametrize(("wrong", "error", "named"), [
    (frame_of(captured_at=1.795e18), TypeError, r"captured_at is 1\.795e\+18, expected an integer of nanoseconds"),
    (frame_of(captured_at=np.float64(1.0)), TypeError, "captured_at is"),
    (frame_of(captured_at=True), TypeError, "captured_at is True"),
    (frame_of(captured_at=-1), ValueError, "captured_at is -1"),
    (frame_of(sequence=0.5), TypeError, r"sequence is 0\.5"),
    (frame_of(epoch=2**64), ValueError, "epoch is 18446744073709551616"),
    (frame_of(sensor_pose=Pose(1.0, NAN)), ValueError, r"sensor_pose\.y is nan, expected a finite number"),
    (frame_with(x=NAN), ValueError, r"detections\[1\]\.x is nan, expected a finite number"),
    (frame_with(y=-INF), ValueError, r"detections\[1\]\.y is -inf"),
    (frame_with(x=None), TypeError, r"detections\[1\]\.x is None"),
    (frame_with(x="12"), TypeError, r"detections\[1\]\.x is '12'"),
    (frame_with(w=INF), ValueError, r"detections\[1\]\.w is inf"),
    (frame_with(sigma=Sigma(x=NAN)), ValueError, r"detections\[1\]\.sigma\.x is nan"),
    (frame_with(velocity=Velocity(NAN, 0.0, 1.0, 1.0)), ValueError, r"detections\[1\]\.velocity\.x is nan"),
    (frame_with(source_track=1.5), TypeError, r"detections\[1\]\.source_track is 1\.5"),
    (frame_with(cls=7), TypeError, r"detections\[1\]\.cls is 7"),
    (frame_with(heading="north"), ValueError, r"detections\[1\]\.heading is 'north', expected one of known, axis"),
    (replace(DESCRIPTION, rate_hz=NAN), ValueError, "rate_hz is nan"),
    (replace(DESCRIPTION, field_of_view=FieldOfView(INF)), ValueError, r"field_of_view\.range_max_m is inf"),
    (replace(DESCRIPTION, revision=1.0), TypeError, r"revision is 1\.0"),
])  # fmt: skip
def test_what_is_no_number_is_refused_with_its_field_and_value(wrong, error, named):
    with pytest.raises(error, match=named):
        wrong.check()


def test_numbers_of_numpy_and_integers_are_numbers():
    FULL.check()
    DESCRIPTION.check()
    one = Detection("car", np.float32(12.0), 5, w=np.float64(1.8), source_track=np.int64(3))
    DetectionFrame(np.int64(5000), (one,), sequence=np.uint64(2**63)).check()


def test_the_engine_takes_what_agents_send():
    engine, now = v2x.Engine(), FULL.captured_at
    engine.describe("camera", DESCRIPTION.to_json())
    assert engine.handle(FULL.to_json(), now)
    assert not engine.agents()["camera"]["dropped_detections"]


def test_golden_messages_are_read_with_every_field():
    for json_frame in golden("detections"):
        assert DetectionFrame.from_json(json_frame).to_json() == _without_defaults(json_frame)
    for description in golden("sensor"):
        assert SensorDescription.from_json(description).to_json() == description
    for json_frame in golden("fused"):
        check(schemas.FUSED_FRAME, json_frame)
        frame = FusedFrame.from_json(json_frame)
        assert len(frame.objects) == len(json_frame["objects"]) and len(frame.agents) == len(json_frame["agents"])
        for one, of_json in zip(frame.objects, json_frame["objects"], strict=True):
            assert str(one.track) == of_json["track"] and one.age == of_json["age_us"] * 1000
            upper = [one.covariance[i, j] for i in range(4) for j in range(i, 4)]
            assert upper == of_json["kinematic_covariance"] and (one.covariance == one.covariance.T).all()
            for axis, name in enumerate(["x", "y", "vx", "vy"]):
                assert math.isclose(math.sqrt(one.covariance[axis, axis]), of_json["sigma"][name], rel_tol=1e-6)
    for json_frame in golden("delta"):
        check(schemas.DELTA_FRAME, json_frame)
        assert isinstance(messages.list_message(json_frame), DeltaFrame)


def _without_defaults(frame):
    """What the hub writes out and the dataclass leaves to its default."""
    kept = dict(frame)
    if not kept.get("sensor_revision"):
        kept.pop("sensor_revision", None)
    return kept


def test_an_array_and_dataclasses_are_the_same_detections():
    array = FULL.to_array()
    assert array.dtype == v2x.DETECTION and np.isnan(array["yaw"][0]) and array["source_track"].tolist() == [-1, 2**60]
    back = messages.detections_of(array)
    assert back[1] == FULL.detections[1]
    assert back[0] == Detection("vehicle.car", 12.0, 5.0)
    array["vx"][0] = 1.0
    with pytest.raises(ValueError, match="vy is nan"):
        messages.detections_of(array)


def fused(sequence, objects, lineage=1, at=None):
    """A frame of a hub with objects (track, x, vx)."""
    base = golden("fused")[0]
    template = {**base["objects"][0], "contributors": []}
    listed = [{**template, "track": str(track), "x": x, "vx": vx} for track, x, vx in objects]
    at = 100_000 * sequence if at is None else at
    return {**base, "sequence": str(sequence), "lineage": lineage, "fused_at": at, "objects": listed, "agents": [], "includes": []}


def delta(sequence, key, changed=(), gone=(), lineage=1):
    frame = fused(sequence, changed, lineage)
    for name in ("objects", "agents", "includes"):
        del frame[name]
    changed_objects = fused(sequence, changed)["objects"]
    return {**frame, "key_sequence": str(key), "changed": changed_objects, "gone": [str(track) for track in gone]}


def places(frame):
    return None if frame is None else [(one.track, round(one.x, 6)) for one in frame.objects]


def test_a_delta_frame_is_relative_to_its_key_frame_alone():
    follower = DeltaFollower()
    assert follower.handle(delta(1, 0)) is None, "before any key frame"
    assert places(follower.handle(fused(2, [(1, 0.0, 10.0), (2, 5.0, 0.0), (3, 9.0, 0.0)]))) == [(1, 0.0), (2, 5.0), (3, 9.0)]
    assert places(follower.handle(delta(4, 2, [(4, 7.0, 0.0), (2, 6.0, 0.0)], [3]))) == [(1, 2.0), (2, 6.0), (4, 7.0)]
    assert places(follower.handle(delta(5, 2))) == [(1, 3.0), (2, 5.0), (3, 9.0)], "nothing of the delta frame before"
    assert follower.handle(delta(5, 2)) is None, "it came before"
    assert follower.handle(delta(7, 6)) is None, "its key frame was lost"
    assert places(follower.handle(fused(1, [(1, 0.0, 0.0)], lineage=2))) == [(1, 0.0)], "the hub was started again"


def test_an_area_is_the_newest_frame_of_each_of_its_tiles():
    follower = AreaFollower()
    assert places(follower.handle("a", fused(1, [(1, 0.0, 0.0)]))) == [(1, 0.0)]
    assert places(follower.handle("b", fused(1, [(2, 9.0, 0.0)]))) == [(1, 0.0), (2, 9.0)]
    assert places(follower.handle("b", fused(2, [(1, 8.0, 0.0), (2, 9.0, 0.0)]))) == [(1, 8.0), (2, 9.0)], "across an edge"
    assert follower.handle("b", fused(2, [])) is None, "it came before"
    assert places(follower.handle("a", fused(3, []))) == [(1, 8.0), (2, 9.0)]
    assert places(follower.handle("a", fused(20, [(5, 1.0, 0.0)]))) == [(5, 1.0)], "b's last frame was lost"


def test_what_is_no_message_where_one_is_expected_is_named_with_its_value():
    def fails(match, **fields):
        with pytest.raises(TypeError, match=match):
            DetectionFrame(1, **fields).check()

    fails(r"detections\[0\] is {'class': 'car'}, expected a v2x.messages.Detection", detections=({"class": "car"},))
    fails(r"detections\[1\].sigma is 0.3, expected a v2x.messages.Sigma",
          detections=(Detection("car", 1.0, 2.0), Detection("car", 1.0, 2.0, sigma=0.3)))  # fmt: skip
    fails(r"detections\[0\].velocity is \(1, 2\)", detections=(Detection("car", 1.0, 2.0, velocity=(1, 2)),))
    fails(r"sensor_pose is \(0, 0, 0\), expected a v2x.messages.Pose", sensor_pose=(0, 0, 0))
    with pytest.raises(TypeError, match="expected one of v2x.DETECTION"):
        messages.detections_of(np.zeros((3, 7)))
    sound = Detection("car", 1.0, 2.0, sigma=Sigma(x=0.3, y=0.3), velocity=Velocity(1.0, 0.0, 0.5, 0.5))
    DetectionFrame(1, (sound,), sensor_pose=Pose(0.0, 0.0)).check()
