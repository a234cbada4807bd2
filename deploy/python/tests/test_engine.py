"""The engine: the three ways to give it a frame, refusals, times, and the arrays that come out."""

import json
import math
import threading

import numpy as np
import pytest

import v2x
from v2x import Engine, Handled, MalformedFrame, _v2x

SECOND = 1_000_000_000
START = 1_795_314_000 * SECOND


def frame(at, **detection):
    """A frame of the network with one car."""
    return {"captured_at": at // 1000, "detections": [{"class": "car", "x": 1.0, "y": 5.0, **detection}]}


def drive(engine, give, n=10):
    """A car at 10 m/s to the east, ten frames a second; `give` hands over one frame."""
    for tenth in range(n):
        now = START + tenth * SECOND // 10
        assert give(engine, float(tenth), now)
    return engine.objects(now)


def as_dict(engine, x, now):
    full = {"yaw": 0.1, "w": 1.9, "d": 4.6, "score": 0.9, "sigma": {"x": 0.3, "y": 0.4, "rho": 0.1, "yaw": 0.05, "w": 0.2, "d": 0.3}}
    full |= {"velocity": {"x": 10.0, "y": 0.0, "sigma_x": 0.5, "sigma_y": 0.6, "rho": 0.2}}
    pose = {"x": 0.0, "y": 0.0, "yaw": 0.0}
    return engine.handle(frame(now, x=x, **full) | {"agent": "camera", "sensor_pose": pose}, now)


def as_array(engine, x, now):
    car = v2x.detections(
        class_="car", x=[x], y=5.0, yaw=0.1, w=1.9, d=4.6, score=0.9, sigma_x=0.3, sigma_y=0.4, rho=0.1, sigma_yaw=0.05,
        sigma_w=0.2, sigma_d=0.3, vx=10.0, vy=0.0, sigma_vx=0.5, sigma_vy=0.6, rho_v=0.2,
    )  # fmt: skip
    return engine.handle(car, now, agent="camera", captured_at=now, sensor_pose=(0.0, 0.0, 0.0))


def as_json(engine, x, now):
    return engine.handle(json.dumps(frame(now, x=x)).encode(), now, agent="camera")


def as_sparse_array(engine, x, now):
    return engine.handle(v2x.detections(class_="car", x=[x], y=5.0), now, agent="camera", captured_at=now)


@pytest.mark.parametrize(("one", "other"), [(as_dict, as_array), (as_json, as_sparse_array)])
def test_an_array_is_the_same_frame_as_json_bit_for_bit(one, other):
    first, second = drive(Engine(), one), drive(Engine(), other)
    assert first.tobytes() == second.tobytes() and len(first) == 1


def test_a_payload_of_the_compact_format_is_taken():
    def compact(engine, x, now):
        return engine.handle(_v2x.encode_detections(json.dumps(frame(now, x=x)).encode(), "camera"), now)

    assert len(drive(Engine(), compact)) == 1


def test_objects_are_as_documented():
    objects = drive(Engine({"report_defaults": {"sigma_position_m": 0.2}}), as_array)
    assert objects.dtype == v2x.OBJECT
    (car,) = objects
    assert v2x.CLASSES[car["class"]] == "vehicle.car" and car["heading"] == v2x.KNOWN
    assert abs(car["x"] - 9.0) < 0.5 and abs(car["vx"] - 10.0) < 1.0 and abs(car["yaw"] - 0.1) < 0.1
    covariance = car["covariance"]
    assert (covariance == covariance.T).all() and (np.linalg.eigvalsh(covariance) > 0).all()
    assert 0.5 < car["existence"] <= 1.0 and 0.0 < car["class_probability"] <= 1.0
    assert car["age"] == 9 * SECOND // 10
    assert car["last_measured_at"] == START + 9 * SECOND // 10
    objects["x"] += 1.0  # the array is the caller's own


def test_the_array_of_objects_is_the_fused_frame():
    engine = Engine()
    drive(engine, as_array)
    (row,) = engine.objects(START + SECOND)
    (one,) = engine.fused(START + SECOND)["objects"]
    from v2x.messages import FusedObject, objects_array

    (same,) = objects_array([FusedObject.from_json(one)])
    for name in v2x.OBJECT.names:
        if name == "age" or name == "last_measured_at":
            assert row[name] // 1000 == same[name] // 1000, name
        else:
            assert np.array_equal(row[name], same[name]) or np.allclose(row[name], same[name], rtol=1e-12), name
    (contributor,) = one["contributors"]
    assert contributor["agent"] == "camera"


def test_times_keep_every_nanosecond():
    engine = Engine()
    car = v2x.detections(class_="car", x=[1.0], y=2.0)
    for k in range(4):
        assert engine.handle(car, START + k * SECOND // 10 + 7, agent="a", captured_at=START + k * SECOND // 10 + 3)
    (one,) = engine.objects(START + SECOND // 2)
    assert one["last_measured_at"] == START + 3 * SECOND // 10 + 3


@pytest.mark.parametrize("time", [1.5, 1e18, np.float64(3.0)])
def test_a_float_is_no_time(time):
    engine, car = Engine(), v2x.detections(class_="car", x=[1.0], y=2.0)
    for call in (
        lambda: engine.objects(time),
        lambda: engine.handle(car, time, agent="a", captured_at=0),
        lambda: engine.handle(car, 0, agent="a", captured_at=time),
    ):
        with pytest.raises(TypeError, match="nanoseconds"):
            call()
    assert engine.objects(np.int64(5)).size == 0
    assert v2x.nanoseconds(1.5) == 1_500_000_000


def test_a_refused_frame_is_a_result_with_its_reason():
    engine = Engine()
    assert engine.handle(frame(START), START, agent="a") == Handled(True)
    again = engine.handle(frame(START), START, agent="a")
    assert not again and again.reason == "duplicate"
    late = engine.handle(frame(START - 2 * SECOND), START, agent="a")
    assert late.reason == "too_late" and "2000 ms" in late.message
    wrong = engine.handle(frame(START) | {"agent": "b"}, START, agent="a")
    assert wrong.reason == "agent_mismatch"
    assert engine.agents()["a"]["refused"] == {"duplicate": 1, "too_late": 1, "agent_mismatch": 1}


def test_a_frame_after_newer_ones_says_so():
    engine = Engine()
    engine.handle(frame(START), START, agent="a")
    assert engine.handle(frame(START - SECOND // 5), START, agent="b") == Handled(True, out_of_sequence=True)


@pytest.mark.parametrize(
    ("malformed", "reason", "named"),
    [
        ({"captured_at": 1, "detections": [{"class": "car", "x": 1}]}, "bad_json", "y"),
        ({"captured_at": 1, "detections": [], "speed": 3}, "bad_json", "speed"),
        ({"captured_at": 1.5, "detections": []}, "wrong_time_unit", "captured_at is 1.5"),
        ({"captured_at": 1, "detections": [], "sensor_pose": {"x": math.nan, "y": 0}}, "absurd_value", "sensor_pose.x"),
        (b"{", "bad_json", "EOF"),
        (b"\x01D", "truncated", "truncated"),
        (b"\x09D", "unknown_version", "version 9"),
    ],
)
def test_a_malformed_frame_is_an_error_that_names_the_field(malformed, reason, named):
    with pytest.raises(MalformedFrame, match=named) as caught:
        Engine().handle(malformed, START, agent="a")
    assert caught.value.reason == reason


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"class": 24}, "detection 1: class is 24"),
        ({"heading": 4}, "detection 1: heading is 4"),
        ({"source_track": -5}, "detection 1: source_track is -5"),
        ({"vx": 1.0}, "detection 1: vy is NaN"),
        ({"vx": 1.0, "vy": 1.0}, "detection 1: sigma_vx is NaN"),
    ],
)
def test_a_wrong_value_of_an_array_is_an_error_that_names_the_detection(change, named):
    cars = v2x.detections(2, class_="car", x=1.0, y=2.0)
    for name, value in change.items():
        cars[name][1] = value
    with pytest.raises(MalformedFrame, match=named):
        Engine().handle(cars, START, agent="a", captured_at=START)


def test_an_impossible_detection_is_dropped_and_counted():
    engine = Engine()
    cars = v2x.detections(3, class_="car", x=[1.0, np.nan, 2.0], y=2.0, w=[1.0, 1.0, 1000.0])
    assert engine.handle(cars, START, agent="a", captured_at=START)
    assert engine.agents()["a"]["dropped_detections"] == {"x not finite": 1, "w out of range": 1}


def test_classes_that_are_not_known_are_counted_and_refused_in_arrays():
    engine = Engine()
    engine.handle(frame(START, **{"class": "spaceship"}), START, agent="a")
    assert engine.agents()["a"]["unmapped_names"] == {"spaceship": 1}
    with pytest.raises(ValueError, match="spaceship"):
        v2x.detections(class_="spaceship", x=[1.0], y=1.0)
    assert v2x.CLASSES[v2x.class_code("pedestrian")] == "human.pedestrian.adult"
    assert v2x.class_codes(["car", 3]).tolist() == [v2x.CLASSES.index("vehicle.car"), 3]


def test_numbers_of_numpy_are_numbers_in_a_dict():
    given = frame(START, x=np.float32(2.0), y=np.array(3.0))
    assert Engine().handle(given | {"captured_at": np.int64(START // 1000)}, START, agent="a")


def test_settings_are_those_of_a_hub():
    text = "[hub]\nmethod = \"nms\"\ndelta_max_ms = 700\n"
    by_text, by_dict = Engine(text), Engine({"delta_max_ms": 700.0}, method="nms")
    assert by_text.settings == by_dict.settings
    assert by_text.settings["engine"]["delta_max"] == 700_000_000
    assert Engine("delta_max_ms = 700", method="nms").settings == by_text.settings
    assert Engine({"hub": {"delta_max_ms": 700}, "name": "a scenario's"}, method="nms").settings == by_text.settings
    assert "ours" in v2x.METHODS


@pytest.mark.parametrize(
    ("config", "method", "named"),
    [
        ({"delta_max": 700}, None, "unknown field `delta_max`"),
        ({"delta_max_ms": 0}, None, "hub.delta_max_ms is 0, expected 1 to 60000"),
        ("delta_max_ms = [", None, "line 1"),
        ({"agents": {"cam": {"frame": "sensor"}}}, None, "hub.agents.cam.*needs pose"),
        ({"hub": 3}, None, "hub is no table"),
        (None, "best", "unknown method `best`"),
    ],
)
def test_a_wrong_setting_is_named(config, method, named):
    with pytest.raises(ValueError, match=named):
        Engine(config, method=method)


def test_an_agents_conventions_hold_for_arrays_too():
    settings = {"agents": {"cam": {"frame": "sensor", "pose": {"x": 100.0, "y": 0.0, "yaw": math.pi / 2}, "sizes": "w-along"}}}
    engine = Engine(settings)
    for tenth in range(10):
        now = START + tenth * SECOND // 10
        car = v2x.detections(class_="car", x=[20.0], y=0.0, w=4.5, d=1.8, yaw=0.0)
        engine.handle(car, now, agent="cam", captured_at=now)
    (one,) = engine.objects(now)
    assert (abs(one["x"] - 100.0), abs(one["y"] - 20.0), abs(one["yaw"] - math.pi / 2)) < (0.1, 0.1, 0.1)
    assert one["d"] > one["w"]


def test_agents_that_are_not_listened_to_are_refused():
    engine = Engine({"only_agents": ["b"]})
    for given in (frame(START), v2x.detections(class_="car", x=[1.0], y=2.0)):
        head = {} if isinstance(given, dict) else {"captured_at": START}
        assert engine.handle(given, START, agent="a", **head).reason == "not_listened_to"


def test_a_description_is_taken_or_refused_by_name():
    description = {
        "revision": 1, "kind": "roadside-unit", "field_of_view": {"range_max_m": 50.0}, "detection_probability": 0.9,
        "clutter_per_m2": 1e-5, "accuracy": {"position_m": 0.1, "yaw_rad": 0.01, "clock_s": 0.01}, "rate_hz": 10.0,
    }  # fmt: skip
    engine = Engine()
    engine.describe("rsu", description)
    for wrong, named in [({"rate_hz": 0}, "rate_hz"), ({"kind": "drone"}, "kind|drone"), ({"range": 1}, "range")]:
        with pytest.raises(MalformedFrame, match=named):
            engine.describe("rsu", description | wrong)
    assert engine.agents()["rsu"]["descriptions_refused"] == 3


def test_the_second_list_is_a_lag_behind():
    engine = Engine({"lagged": {"lag_ms": 300}})
    drive(engine, as_array)
    (now,), (then,) = engine.objects(START + 900_000_000), engine.lagged(START + 900_000_000)
    assert now["id"] == then["id"] and 2.0 < now["x"] - then["x"] < 4.0
    assert Engine().lagged(START) is None


def test_a_track_keeps_its_id_and_another_lineage_has_others():
    engine = Engine()
    first = drive(engine, as_array)["id"].tolist()
    assert engine.objects(START + SECOND)["id"].tolist() == first
    assert drive(Engine(lineage=2), as_array)["id"].tolist() != first


def test_what_belongs_to_arrays_is_refused_elsewhere_and_the_other_way_round():
    engine = Engine()
    with pytest.raises(TypeError, match="captured_at is for arrays"):
        engine.handle(frame(START), START, agent="a", captured_at=START)
    with pytest.raises(TypeError, match="needs agent"):
        engine.handle(v2x.detections(class_="car", x=[1.0], y=1.0), START)
    with pytest.raises(ValueError, match="names no agent"):
        engine.handle(frame(START), START)
    with pytest.raises(TypeError, match="no field.*sigma_x"):
        engine.handle(np.zeros(1, [("x", "f8"), ("y", "f8")]), START, agent="a", captured_at=START)
    with pytest.raises(TypeError, match="frame is a list"):
        engine.handle([], START, agent="a")
    with pytest.raises(TypeError, match="no field clazz"):
        v2x.detections(clazz="car")
    with pytest.raises(ValueError, match="agent: name"):
        engine.handle(frame(START), START, agent="cam/north")


def test_an_empty_frame_says_that_nothing_was_seen():
    assert Engine().handle(v2x.detections(0), START, agent="a", captured_at=START)


def test_threads_share_an_engine():
    engine = Engine()

    def send(agent):
        for tenth in range(20):
            now = START + tenth * SECOND // 100
            engine.handle(v2x.detections(class_="car", x=[float(tenth)], y=5.0), now, agent=agent, captured_at=now)

    threads = [threading.Thread(target=send, args=(name,)) for name in "abcd"]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [counts["accepted"] for counts in engine.agents().values()] == [20] * 4
