"""The engine of a hub, in this process: frames in, a list of objects out. It reads no clock and no network."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _v2x
from .arrays import DETECTION, OBJECT, as_records

#: The methods of fusion, as in `[hub] method`.
METHODS: tuple[str, ...] = tuple(_v2x.METHODS)

_BY_CONTENT = ""
_JSON = "application/json"


@dataclass(frozen=True, slots=True)
class Handled:
    """What became of a frame. It is true where the frame was accepted.

    A refused frame is no error of yours: on a network frames are late or come twice. `reason` is one of those in
    deploy/docs/wire.md (`too_late`, `duplicate`, …), `message` says it in words.
    """

    accepted: bool
    out_of_sequence: bool = False
    reason: str | None = None
    message: str | None = None

    def __bool__(self) -> bool:
        return self.accepted


_ACCEPTED = Handled(True)
_OUT_OF_SEQUENCE = Handled(True, out_of_sequence=True)


class MalformedFrame(ValueError):
    """A frame or a description that no agent should send: its message names the field and the value."""

    def __init__(self, message: str, reason: str) -> None:
        super().__init__(message)
        #: The reason's name, as the hub counts it: `bad_json`, `absurd_value`, `wrong_time_unit`, …
        self.reason = reason


class Engine:
    """A hub's engine.

    `config` is the `[hub]` table of a settings or scenario file, as a dict or as TOML text; a text or a dict with a table
    `hub` is taken by that table. `method` is over it (one of `METHODS`). What is wrong in it is a `ValueError` that names
    the key.

    >>> engine = Engine({"delta_max_ms": 500}, method="ours")
    >>> second = 1_000_000_000
    >>> for tenth in range(10):
    ...     now = 1_795_314_000 * second + tenth * second // 10
    ...     frame = {"captured_at": now // 1000, "detections": [{"class": "car", "x": float(tenth), "y": 5.0}]}
    ...     handled = engine.handle(frame, now, agent="camera")
    >>> len(engine.objects(now))
    1

    Times are integers of nanoseconds since 1970 (`time.time_ns()`), except within a dict or JSON, where `captured_at` is in
    microseconds, as on the network. The same calls give the same bits. Several threads may call one engine; it takes one
    call after the other, and other threads of Python run meanwhile.
    """

    def __init__(
        self,
        config: Mapping[str, Any] | str | None = None,
        *,
        method: str | None = None,
        lineage: int = 1,
    ) -> None:
        toml = config if isinstance(config, str) else None
        table = json.dumps(config, default=_plain) if isinstance(config, Mapping) else None
        if config is not None and toml is None and table is None:
            raise TypeError(f"config is a {type(config).__name__}, expected a dict or TOML text")
        self._core = _v2x.Engine(toml, table, method, lineage)

    def handle(
        self,
        frame: Mapping[str, Any] | bytes | npt.NDArray[np.void],
        now: int,
        *,
        agent: str | None = None,
        captured_at: int | None = None,
        sensor_pose: tuple[float, float, float] | None = None,
        epoch: int = 0,
        sequence: int | None = None,
        map_frame: str | None = None,
        sensor_revision: int = 0,
    ) -> Handled:
        """Takes in a frame that arrived at `now` (ns since 1970, by the hub's clock).

        `frame` is one of

        - a dict in the JSON shape of the network (deploy/docs/wire.md), with `captured_at` in **microseconds**;
        - the bytes of a payload, JSON or postcard;
        - an array of `v2x.DETECTION`, which is fastest. Then `agent` and `captured_at` (**ns** since 1970) are required,
          and the other keywords say what the dict would: `sensor_pose` (x, y, yaw; m, rad), the agent's boot `epoch`, the
          frame's number `sequence` (without it the capture time stands in), `map_frame`, `sensor_revision`.

        `agent` is the one of the network's key; a dict or payload that names its agent needs none.

        A frame that is refused is a result (`Handled`); one that is malformed is a `MalformedFrame`, which names the field.
        A single detection with an impossible value is dropped and counted (`agents()`), and the frame is used, as on the
        network.
        """
        if isinstance(frame, np.ndarray):
            if agent is None or captured_at is None:
                raise TypeError("a frame as an array needs agent=… and captured_at=… (ns since 1970)")
            records = frame.tobytes() if frame.dtype is DETECTION and frame.ndim == 1 else as_records(frame, DETECTION, "frame")
            head = (agent, captured_at, epoch, sequence, sensor_pose, map_frame, sensor_revision)
            return _handled(self._core.handle_records(records, now, head))
        given = {
            "captured_at": captured_at, "sensor_pose": sensor_pose, "epoch": epoch or None, "sequence": sequence,
            "map_frame": map_frame, "sensor_revision": sensor_revision or None,
        }  # fmt: skip
        names = [name for name, value in given.items() if value is not None]
        if names:
            raise TypeError(f"{', '.join(names)} is for arrays: a dict or a payload has it in itself")
        if isinstance(frame, Mapping):
            payload, encoding = json.dumps(frame, default=_plain).encode(), _JSON
        elif isinstance(frame, (bytes, bytearray, memoryview)):
            payload, encoding = bytes(frame), _BY_CONTENT
        else:
            raise TypeError(f"frame is a {type(frame).__name__}, expected a dict, bytes, or an array of v2x.DETECTION")
        return _handled(self._core.handle_payload(payload, now, (encoding, agent)))

    def describe(self, agent: str, description: Mapping[str, Any] | bytes) -> None:
        """Takes in an agent's sensor description: a dict in the JSON shape of the network, or a payload.

        With it missed detections count as evidence, and the agent's clock and pose are corrected within what it declares. A
        wrong one is a `MalformedFrame` that names the field; the one before it holds then.
        """
        if isinstance(description, Mapping):
            payload, encoding = json.dumps(description, default=_plain).encode(), _JSON
        else:
            payload, encoding = bytes(description), _BY_CONTENT
        refused = self._core.describe(payload, (encoding, agent))
        if refused is not None:
            raise MalformedFrame(refused[1], refused[0])

    def objects(self, now: int) -> npt.NDArray[np.void]:
        """The objects as of `now` (ns since 1970), as an array of `v2x.OBJECT`, by track.

        Times never go back: an earlier `now` than that of another call counts as that. With a lag (`lag_ms`) the objects
        are as they were that long before.
        """
        return np.frombuffer(self._core.objects(now), OBJECT)

    def lagged(self, now: int) -> npt.NDArray[np.void] | None:
        """The second list (`lagged` in the settings), a lag before `now`, by all that is known by then; `None` without one."""
        records = self._core.lagged(now)
        return None if records is None else np.frombuffer(records, OBJECT)

    def fused(self, now: int) -> dict[str, Any]:
        """The whole fused frame as of `now`, as a dict in the JSON shape of the network: with all class probabilities,
        contributors, the agents, and the frames that are new in it since the last call. Its times are in microseconds."""
        frame: dict[str, Any] = json.loads(self._core.fused(now)[0])
        return frame

    def agents(self) -> dict[str, dict[str, Any]]:
        """What is counted of each agent: accepted frames, refused ones by reason, dropped detections by field and cause,
        unknown names of classes, the normalised innovation squared (1 where its stated accuracy is right)."""
        agents: dict[str, dict[str, Any]] = json.loads(self._core.agents())
        return agents

    @property
    def settings(self) -> dict[str, Any]:
        """All settings that hold, checked, with their defaults; times are in nanoseconds. They are named as in the code."""
        settings: dict[str, Any] = json.loads(self._core.settings())
        return settings


def _handled(outcome: _v2x.Outcome) -> Handled:
    accepted, out_of_sequence, reason, message, is_malformed = outcome
    if accepted:
        return _OUT_OF_SEQUENCE if out_of_sequence else _ACCEPTED
    if is_malformed:
        raise MalformedFrame(message or "", reason or "")
    return Handled(False, False, reason, message)


def _plain(value: Any) -> Any:
    """NumPy's numbers and arrays as those of JSON."""
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return value.tolist()
    raise TypeError(f"a {type(value).__name__} is no value of JSON")
