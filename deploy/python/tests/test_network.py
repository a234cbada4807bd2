"""The client against a real hub, the hub's fixture, and a recording of what passed between them."""

import gc
import json
import os
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import v2x
from v2x import testing
from v2x.client import Agent, Consumer, NoHub, Stream
from v2x.messages import Detection, DetectionFrame, FieldOfView, FusedFrame, SensorDescription
from v2x.recording import Recording

DESCRIPTION = SensorDescription(FieldOfView(100.0), 20.0)
TILES = {"tiles": {"latitude_deg": 48.137, "longitude_deg": 11.575}}
AREA = "120230002213"


class Sending:
    """A car that an agent sends twenty times a second, until it is ended."""

    def __init__(self, agent):
        self.agent, self.sent, self.ended = agent, [], threading.Event()
        self.thread = threading.Thread(target=self.run)

    def run(self):
        begin = time.time_ns()
        while not self.ended.wait(0.05):
            at = time.time_ns()
            x = (at - begin) * 1e-9 * 5.0
            self.sent.append(self.agent.publish([Detection("car", x, 5.0, yaw=0.0)], captured_at=at))

    def __enter__(self):
        assert self.agent.wait_until_heard()
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.ended.set()
        self.thread.join()


def first(stream, is_it, patience):
    """The first message that is it."""
    until = time.monotonic() + patience
    while time.monotonic() < until:
        message = stream.next(timeout=patience)
        if is_it(message):
            return message
    raise AssertionError(f"no such message in {patience} s")


def has_car(frame):
    return any(one.cls == "vehicle.car" and abs(one.vx - 5.0) < 2.0 for one in frame.objects)


def test_a_car_comes_back_by_every_list(hub_factory, patience):
    hub = hub_factory(TILES)
    with (
        Consumer(connect=hub.locator) as consumer,
        Agent("camera", connect=hub.locator, description=DESCRIPTION) as camera,
        consumer.frames() as whole, consumer.deltas() as deltas, consumer.area(AREA) as area, Sending(camera) as sending,
    ):  # fmt: skip
        frame = first(whole, has_car, patience)
        for other in (deltas, area):
            followed = first(other, has_car, patience)
            assert isinstance(followed, FusedFrame) and not followed.agents
        (car,) = frame.objects
        assert [one.agent for one in car.contributors] == ["camera"] and car.contributors[0].epoch == camera.epoch
        assert abs(car.y - 5.0) < 1.0 and frame.to_array().dtype == v2x.OBJECT
        assert abs(time.time_ns() - frame.fused_at) < 60 * 10**9
        sent = {one.sequence: one.captured_at // 1000 * 1000 for one in sending.sent}
        assert all(sent[one.sequence] == one.captured_at <= one.received_at for one in frame.includes)
        assert consumer.agents() == ["camera"]
        (status,) = consumer.status().values()
        (of_camera,) = status["agents"]
        assert (of_camera["id"], of_camera["alive"], of_camera["refused"]) == ("camera", True, {})
        assert of_camera["sensor"]["field_of_view"]["range_max_m"] == 100.0


def test_the_engine_in_this_process_gives_the_list_of_a_hub(hub, tmp_path, patience):
    """What a hub took in, given to `v2x.Engine` at the same times, makes the same objects."""
    received = []
    with Consumer(connect=hub.locator) as consumer, Agent("camera", connect=hub.locator) as camera:
        frames = consumer.frames()
        assert frames.wait_until_fed(patience)
        with Sending(camera) as sending:
            while len(received) < 30:
                received.append(frames.next(timeout=patience))
    sent = {one.sequence: one for one in sending.sent}
    engine = v2x.Engine(lineage=received[0].lineage)
    for frame in received:
        for one in frame.includes:
            assert engine.handle(sent[one.sequence].to_json(), one.received_at)
        objects = engine.objects(frame.fused_at)
    theirs = frame.to_array()
    assert len(objects) == len(theirs) == 1 and objects["id"].tolist() == theirs["id"].tolist()
    # The hub's clock has nanoseconds, its JSON has microseconds: 5 m/s and some rounding.
    for name in ("x", "y", "vx", "vy", "w", "d", "existence"):
        assert objects[name][0] == pytest.approx(theirs[name][0], abs=1e-3), name


def test_an_array_is_published_as_well(hub, patience):
    with Consumer(connect=hub.locator) as consumer, Agent("camera", connect=hub.locator) as camera:
        frames = consumer.frames()
        assert camera.wait_until_heard(patience) and frames.wait_until_fed(patience)
        sent = camera.publish(v2x.detections(class_="truck", x=[1.0], y=2.0, sigma_x=0.2))
        frame = first(frames, lambda frame: frame.includes, patience)
        assert [one.captured_at for one in frame.includes] == [sent.captured_at // 1000 * 1000]
        assert [health.accepted for health in frame.agents] == [1]


def test_what_is_no_number_is_not_published(hub, patience):
    with Consumer(connect=hub.locator) as consumer, Agent("camera", connect=hub.locator) as agent:
        frames = consumer.frames(timeout=patience)
        assert agent.wait_until_heard()
        with pytest.raises(TypeError, match="captured_at is 1"):
            agent.publish([], captured_at=time.time())
        with pytest.raises(ValueError, match=r"detections\[0\]\.x is nan"):
            agent.publish([Detection("car", float("nan"), 5.0)])
        with pytest.raises(ValueError, match=r"detections\[0\]\.y is inf"):
            agent.put(DetectionFrame(time.time_ns(), (Detection("car", 1.0, float("inf")),)))
        # No number was spent on them.
        assert agent.publish([Detection("car", np.float32(1.0), 5)]).sequence == 0
        health = first(frames, lambda frame: any(one.agent == "camera" for one in frame.agents), patience).agents[0]
        assert (health.accepted, health.refused) == (1, 0)


def test_times_of_another_unit_and_single_detections_are_not_published(hub):
    with Agent("camera", connect=hub.locator) as camera:
        now = time.time_ns()
        for at in (now // 1000, now // 1_000_000_000, 12_000_000_000):
            with pytest.raises(ValueError, match=f"captured_at is {at}, expected nanoseconds"):
                camera.publish([], captured_at=at)
        with pytest.raises(TypeError, match="expected a list of them"):
            camera.publish(Detection("car", 1.0, 2.0))
        assert camera.publish([], captured_at=now).sequence == 0


def test_an_endpoint_without_a_protocol_is_named():
    with pytest.raises(ValueError, match="connect is '127.0.0.1:7447', expected an endpoint such as 'tcp/"):
        Agent("camera", connect="127.0.0.1:7447")


def test_a_recording_is_read_as_it_was_sent(hub_factory, tmp_path, patience):
    hub = hub_factory(record=tmp_path / "run.mcap")
    with Consumer(connect=hub.locator) as consumer, Agent("camera", connect=hub.locator, description=DESCRIPTION) as camera:
        with consumer.frames() as frames, Sending(camera) as sending:
            begin = first(frames, has_car, patience)
            # A recorder writes a chunk a second.
            first(frames, lambda frame: frame.fused_at > begin.fused_at + 2_500_000_000, patience)
    hub.close()
    with Recording(tmp_path / "run.mcap") as recording:
        assert recording.facts()["network"] == "demo"
        frames = list(recording.detection_frames())
        read = {frame.sequence: frame for _, frame in frames}
        sent = {frame.sequence: frame for frame in sending.sent}
        assert len(read) > 2 and all(isinstance(at, int) and at >= read[0].captured_at for at, _ in frames)
        for sequence, frame in read.items():
            assert frame == DetectionFrame.from_json(sent[sequence].to_json())
        lists = [frame for _, frame in recording.fused_frames()]
        assert any(map(has_car, lists)) and [frame.sequence for frame in lists] == sorted(frame.sequence for frame in lists)
        assert _of_a_killed_recorder(tmp_path / "run.mcap", lists)
        descriptions = {entry.agent: entry.message for entry in recording.entries("/sensor")}
        assert descriptions == {"camera": DESCRIPTION}


def _of_a_killed_recorder(path, lists):
    """Whether a recording without its end has the same beginning."""
    whole = path.read_bytes()
    path.with_name("cut.mcap").write_bytes(whole[: len(whole) * 3 // 4])
    with Recording(path.with_name("cut.mcap")) as recording:
        read = [frame.sequence for _, frame in recording.fused_frames()]
        assert recording.facts()["network"] == "demo"
    return 0 < len(read) < len(lists) and read == [frame.sequence for frame in lists][: len(read)]


def test_a_slow_consumer_gets_the_newest_and_knows_what_it_missed(hub_factory, patience, monkeypatch):
    monkeypatch.setattr("v2x.client.MAX_WAITING", 3)
    hub = hub_factory({"publish": {"mode": "fixed", "rate_hz": 100}})
    with Consumer(connect=hub.locator) as consumer:
        slow, quick = consumer.frames(), consumer.frames()
        newest = first(quick, lambda frame: slow.dropped > 5, patience)
        assert slow.next(timeout=patience).sequence > newest.sequence - 10
        slow.close()
        with pytest.raises(EOFError):
            while True:
                slow.next(timeout=patience)


def test_a_stream_without_messages_times_out_and_a_closed_one_ends(hub):
    with Consumer(connect=hub.locator, hub="nobody") as consumer:
        with pytest.raises(TimeoutError, match=r"0\.05 s"):
            next(iter(consumer.frames(timeout=0.05)))
        ends = consumer.frames()
        ends.close()
        assert list(ends) == [] and consumer.status(timeout_s=0.2) == {}


def test_networks_do_not_hear_each_other(hub_factory):
    hub = hub_factory(network="one")
    with Agent("a", network="two", connect=hub.locator) as agent:
        assert not agent.wait_until_heard(0.2)
    with Agent("a", network="one", connect=hub.locator) as agent:
        assert agent.wait_until_heard()


def test_a_missing_hub_is_an_error_that_says_what_to_do():
    with pytest.raises(NoHub, match=r"tcp/127\.0\.0\.1:1: start one \(`v2x hub`\)"):
        Agent("camera", connect="tcp/127.0.0.1:1", patience_s=0.2)


@pytest.mark.parametrize(("call", "named"), [
    (lambda: Agent("cam/north"), "name is 'cam/north'"),
    (lambda: Consumer(network="a b"), "network is 'a b'"),
    (lambda: Consumer(hub=""), "hub is ''"),
])  # fmt: skip
def test_a_wrong_name_is_named(call, named):
    with pytest.raises(ValueError, match=named):
        call()


def test_a_wrong_area_is_named(hub):
    with Consumer(connect=hub.locator) as consumer, pytest.raises(ValueError, match="quadkey is '124'"):
        consumer.area("124")


def test_without_the_program_the_fixture_says_where_to_get_it(monkeypatch):
    monkeypatch.setenv("V2X_BINARY", "/no/such/v2x")
    with pytest.raises(testing.HubError, match=r"\$V2X_BINARY is '/no/such/v2x', which is no program"):
        testing.Hub()
    monkeypatch.delenv("V2X_BINARY")
    monkeypatch.setenv("PATH", "")
    with pytest.raises(testing.HubError, match="no program v2x on the path.*cargo install"):
        testing.Hub()


def test_a_hub_that_cannot_start_says_why():
    with pytest.raises(testing.HubError, match="delta_max_ms"):
        testing.Hub({"delta_max_ms": 0})


def test_no_hub_is_left_behind(hub_factory):
    hub = hub_factory()
    process = hub._process
    hub.close()
    assert process.returncode == 0


def test_a_hub_ends_with_the_process_that_started_it(patience):
    """However that ends: here it is killed."""
    script = (
        "import os, signal, sys\nfrom v2x.testing import Hub\nhub = Hub()\n"
        "print(hub._process.pid, flush=True)\nos.kill(os.getpid(), signal.SIGKILL)\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=patience, check=False)
    pid, until = int(done.stdout), time.monotonic() + patience
    while time.monotonic() < until and _runs(pid):
        threading.Event().wait(0.02)
    assert not _runs(pid)


def _runs(pid):
    """Whether a process runs; one that nobody has waited for does not."""
    try:
        os.kill(pid, 0)
        with open(f"/proc/{pid}/stat", encoding="utf-8") as stat:
            return stat.read().rsplit(")", 1)[1].split()[0] != "Z"
    except (ProcessLookupError, FileNotFoundError):
        return False


def test_the_fixtures_are_found_by_pytest_without_a_conftest(tmp_path):
    (tmp_path / "test_one.py").write_text("def test_one(hub):\n    assert hub.locator.startswith('tcp/127.0.0.1:')\n")
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_stream_that_nobody_holds_ends_and_leaves_no_subscriber(hub, patience):
    with Consumer(connect=hub.locator) as consumer:
        for _ in range(3):
            for _ in consumer.frames(timeout=patience):
                break
        gc.collect()
        assert len(consumer._streams) == 0
        # One that is held goes on after a loop, too.
        stream = consumer.frames(timeout=patience)
        for _ in stream:
            break
        assert isinstance(stream.next(timeout=patience), FusedFrame) and len(consumer._streams) == 1


def test_what_cannot_be_read_ends_no_stream():
    stream = Stream(lambda _, message: FusedFrame.from_json(message), timeout=0.1)
    hub = {"hub": "hub", "lineage": 1, "sequence": "1", "fused_at": 5}
    for payload in (b"{", b"[]", b"{}", b'{"objects": 7}', json.dumps(hub).encode()):
        stream._mailbox.push("v2x/demo/hub/hub/fused/json", payload)
    with pytest.raises(TimeoutError):
        for _ in stream:
            pass
    assert stream.unreadable >= 4 and stream.last_error
