"""Reads recordings (`v2x record`, `v2x demo --record`) with `mcap` (`pip install './deploy/python[recording]'` in the repository)."""

from __future__ import annotations

import json
import os
import warnings
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from types import TracebackType
from typing import Any, Self, TypeAlias

from . import _v2x
from .messages import DeltaFrame, DetectionFrame, FusedFrame, SensorDescription, list_message

try:
    from mcap.exceptions import EndOfFile
    from mcap.records import Channel, DataEnd, McapRecord, Metadata
    from mcap.records import Message as Stored
    from mcap.stream_reader import StreamReader
except ImportError as error:
    raise ImportError("v2x.recording needs mcap: pip install mcap") from error

_POSTCARD = ("x-v2x-postcard", "application/vnd.v2x.postcard")
_JSON = ("json", "application/json", "text/json")
#: What reading a payload from anywhere can end in.
_UNREADABLE = (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError)


@dataclass(frozen=True, slots=True)
class Unreadable:
    """A payload that is no message of its key, as somebody sent it, and why."""

    payload: bytes
    reason: str


#: What an entry holds: a typed message, JSON of other keys (truth, scenes), or bytes of what has no JSON here (journal, deltas).
Message: TypeAlias = "DetectionFrame | SensorDescription | FusedFrame | DeltaFrame | Unreadable | dict[str, Any] | bytes"


@dataclass(frozen=True, slots=True, eq=False)
class Entry:
    """One payload as it arrived: its key, when it arrived (ns since 1970), and the message."""

    key: str
    received_at: int
    message: Message

    @property
    def agent(self) -> str | None:
        """The agent of the key; `None` where it is of none."""
        chunks = self.key.split("/")
        return chunks[3] if chunks[2:3] == ["agent"] and len(chunks) > 3 else None


class Recording:
    """A recording. A recorder that was killed leaves one that ends early, which is read as far as it goes.

    Fused frames have the `fused_at`, and detection frames the `captured_at`, of the compact format, to the nanosecond; the
    other times in them are to the microsecond.

    What cannot be read, as a frame that an agent wrote wrongly, is an entry with `Unreadable`, is left out of the frames, and
    is counted in `unreadable`; at the end of an iteration a warning says so.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self._file = open(path, "rb")
        #: Payloads that could not be read, by key, of the iteration that was begun last.
        self.unreadable: Counter[str] = Counter()

    def _records(self) -> Iterator[McapRecord]:
        """Its records in order, as far as they are whole."""
        self._file.seek(0)
        try:
            for record in StreamReader(self._file).records:
                if isinstance(record, DataEnd):
                    return
                yield record
        except EndOfFile:
            return

    def facts(self) -> dict[str, str]:
        """What the recorder wrote of itself: version, commit, network."""
        described = (one for one in self._records() if isinstance(one, Metadata) and one.name == "v2x")
        return next((dict(one.metadata) for one in described), {})

    def entries(self, suffix: str | None = None) -> Iterator[Entry]:
        """All entries as they arrived; with a suffix only of keys that end so, such as `/detections` or `/fused`."""
        channels: dict[int, Channel] = {}
        unreadable, first = Counter[str](), ""
        self.unreadable = unreadable
        for record in self._records():
            if isinstance(record, Channel):
                channels[record.id] = record
            elif isinstance(record, Stored):
                channel = channels[record.channel_id]
                if suffix is None or channel.topic.endswith(suffix):
                    read = _read(channel, record.data)
                    if isinstance(read, Unreadable):
                        unreadable[channel.topic] += 1
                        first = first or f"{channel.topic}: {read.reason}"
                    yield Entry(channel.topic, record.log_time, read)
        if unreadable:
            warnings.warn(f"{unreadable.total()} payloads cannot be read; the first under {first}", stacklevel=2)

    def detection_frames(self) -> Iterator[tuple[int, DetectionFrame]]:
        """Every detection frame with the time of its arrival."""
        for entry in self.entries("/detections"):
            if isinstance(entry.message, DetectionFrame):
                yield entry.received_at, entry.message

    def fused_frames(self) -> Iterator[tuple[int, FusedFrame]]:
        """Every whole list with the time of its arrival."""
        for entry in self.entries("/fused"):
            if isinstance(entry.message, FusedFrame):
                yield entry.received_at, entry.message

    def close(self) -> None:
        """Closes the file."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()


def _read(channel: Channel, data: bytes) -> Message:
    # As a hub does it: by the encoding under which it was sent, and by its first character where that says nothing.
    encoding = channel.metadata.get("zenoh_encoding", channel.message_encoding)
    is_json = encoding in _JSON or (encoding not in _POSTCARD and data.lstrip()[:1] == b"{")
    try:
        return _message(channel.topic, data, is_json)
    except _UNREADABLE as error:
        return Unreadable(data, f"{type(error).__name__}: {error}")


def _message(key: str, data: bytes, is_json: bool) -> Message:
    chunks = key.split("/")
    kind = "/".join(chunks[4:])
    if chunks[2:3] == ["agent"] and kind == "detections":
        text, captured_at = (data, None) if is_json else _v2x.decode_detections(data)
        frame = DetectionFrame.from_json(json.loads(text))
        frame = replace(frame, agent=frame.agent or chunks[3])
        return frame if captured_at is None else replace(frame, captured_at=captured_at)
    if chunks[2:3] == ["agent"] and kind == "sensor":
        return SensorDescription.from_json(json.loads(data if is_json else _v2x.decode_sensor(data)))
    if not is_json and kind in ("fused", "fused/lagged"):
        text, fused_at = _v2x.decode_fused(data)
        return replace(FusedFrame.from_json(json.loads(text)), fused_at=fused_at)
    if not is_json:
        return data
    read: dict[str, Any] = json.loads(data)
    return list_message(read) if kind.startswith("fused") and not kind.endswith("scene") else read
