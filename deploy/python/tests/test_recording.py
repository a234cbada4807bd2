"""Recordings of what foreign agents have sent: what can be read is read, and the rest is counted."""

import json

import pytest
from mcap.writer import CompressionType, Writer

from v2x import _v2x
from v2x.recording import Recording, Unreadable

KEY = "v2x/demo/agent/camera/detections"
FRAME = {"captured_at": 1_795_314_000_000_000, "sequence": "7", "detections": [{"class": "car", "x": 12.0, "y": 5.0}]}
POSTCARD = ("x-v2x-postcard", "application/vnd.v2x.postcard")


def written(path, samples):
    """A recording of these samples: how MCAP labels each, its Zenoh encoding, and its payload."""
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.NONE)
        writer.start()
        for n, ((label, encoding), payload) in enumerate(samples):
            channel = writer.register_channel(KEY, label, 0, {"zenoh_encoding": encoding})
            writer.add_message(channel, n, payload, n, n)
        writer.finish()
    return path


def test_json_that_was_sent_without_an_encoding_is_read_whatever_its_label_says(tmp_path):
    text = json.dumps(FRAME).encode()
    compact = _v2x.encode_detections(text, "camera")
    samples = [
        (("x-v2x-postcard", "zenoh/string"), text), (("json", "zenoh/bytes"), b"  " + text), (("json", "text/json"), text),
        (POSTCARD, compact), (("x-v2x-postcard", "zenoh/bytes"), compact),
    ]  # fmt: skip
    with Recording(written(tmp_path / "run.mcap", samples)) as recording:
        frames = [frame for _, frame in recording.detection_frames()]
        assert len(frames) == 5 and not recording.unreadable
        assert {(frame.agent, frame.sequence, frame.detections[0].x) for frame in frames} == {("camera", 7, 12.0)}


def test_frames_that_cannot_be_read_are_counted_and_those_after_them_are_read(tmp_path):
    text = json.dumps(FRAME).encode()
    bad = [b"{", b"[1]", b'{"detections": []}', b'{"captured_at": "x", "detections": 7}']
    samples = [(("json", "application/json"), one) for one in (text, *bad, text)]
    samples += [(POSTCARD, b"\x01\x02"), (POSTCARD, b""), (("json", "application/json"), text)]
    with Recording(written(tmp_path / "run.mcap", samples)) as recording:
        with pytest.warns(UserWarning, match=f"6 payloads cannot be read; the first under {KEY}"):
            assert len(list(recording.detection_frames())) == 3
        assert recording.unreadable == {KEY: 6}
        with pytest.warns(UserWarning):
            unreadable = [one.message for one in recording.entries() if isinstance(one.message, Unreadable)]
        assert [one.payload for one in unreadable[:4]] == bad and all(one.reason for one in unreadable)
