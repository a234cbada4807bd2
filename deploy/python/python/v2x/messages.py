"""The messages of a network as dataclasses: what agents send and what hubs publish, in the shape of its JSON.

Metres, radians, x east, y north. Times are integers of **nanoseconds** since 1970; JSON has microseconds, so that `to_json`
rounds them down and what `from_json` reads is a multiple of 1000. 64-bit ids are integers here and strings there.

What is `None` in a detection is left out, and filled by the hub's settings.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from .arrays import AXIS, BY_YAW, CLASSES, DETECTION, KNOWN, OBJECT, UNKNOWN

Json: TypeAlias = dict[str, Any]
Heading: TypeAlias = Literal["known", "axis", "unknown"]

_HEADINGS: dict[str, int] = {"known": KNOWN, "axis": AXIS, "unknown": UNKNOWN}
_HEADING_NAMES: dict[int, Heading] = {KNOWN: "known", AXIS: "axis", UNKNOWN: "unknown"}
# Rows and columns of the covariance of (x, y, vx, vy) as JSON lists them.
_UPPER = np.triu_indices(4)


def _number(name: str, value: Any) -> None:
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise TypeError(f"{name} is {value!r}, expected a number")
    if not np.isfinite(value):
        raise ValueError(f"{name} is {value!r}, expected a finite number; what is not known is left out (None)")


def _integer(name: str, value: Any, meaning: str, bits: int = 64) -> None:
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, np.integer)):
        raise TypeError(f"{name} is {value!r}, expected an integer {meaning}")
    if not 0 <= int(value) < 1 << bits:
        raise ValueError(f"{name} is {value!r}, expected an integer {meaning}, from 0 to 2^{bits} - 1")


def _of_kind(name: str, value: Any, kind: type) -> None:
    if not isinstance(value, kind):
        raise TypeError(f"{name} is {value!r}, expected a v2x.messages.{kind.__name__}")


def _all_numbers(prefix: str, json: Any) -> None:
    """Every number of a message."""
    for name, value in json.items():
        if isinstance(value, dict):
            _all_numbers(f"{prefix}{name}.", value)
        elif not isinstance(value, str):
            _number(prefix + name, value)


def _numbers(prefix: str, of: Any) -> None:
    """Every field of numbers; one that is left out is none."""
    for name in of.__slots__:
        value = getattr(of, name)
        if value is not None:
            _number(f"{prefix}.{name}", value)


def _given(**values: Any) -> Json:
    return {name: value for name, value in values.items() if value is not None}


@dataclass(frozen=True, slots=True)
class Pose:
    """A place (m) and a heading (rad) in the map frame."""

    x: float
    y: float
    yaw: float = 0.0

    def to_json(self) -> Json:
        """As JSON of the network."""
        return {"x": self.x, "y": self.y, "yaw": self.yaw}

    @classmethod
    def from_json(cls, json: Json) -> Pose:
        """From JSON of the network."""
        return cls(json["x"], json["y"], json.get("yaw", 0.0))


@dataclass(frozen=True, slots=True)
class Sigma:
    """Standard deviations of a detection (m, rad), and the correlation of x and y."""

    x: float | None = None
    y: float | None = None
    rho: float | None = None
    w: float | None = None
    d: float | None = None
    yaw: float | None = None

    def to_json(self) -> Json:
        """As JSON of the network."""
        return _given(x=self.x, y=self.y, rho=self.rho, w=self.w, d=self.d, yaw=self.yaw)


@dataclass(frozen=True, slots=True)
class Velocity:
    """A measured velocity with its standard deviations (m/s) and their correlation."""

    x: float
    y: float
    sigma_x: float
    sigma_y: float
    rho: float = 0.0

    def to_json(self) -> Json:
        """As JSON of the network."""
        return _given(x=self.x, y=self.y, sigma_x=self.sigma_x, sigma_y=self.sigma_y, rho=self.rho)


@dataclass(frozen=True, slots=True)
class Detection:
    """One object as a sensor reports it. `cls` is a nuScenes name or a common one, such as `car`."""

    cls: str
    x: float
    y: float
    w: float | None = None
    d: float | None = None
    yaw: float | None = None
    score: float | None = None
    heading: Heading | None = None
    sigma: Sigma | None = None
    velocity: Velocity | None = None
    source_track: int | None = None

    def check(self, name: str = "detection") -> None:
        """Raises a `TypeError` or a `ValueError` that names the field and its value where a number is none."""
        if not isinstance(self.cls, str):
            raise TypeError(f"{name}.cls is {self.cls!r}, expected the name of a class, such as 'car'")
        if self.heading is not None and self.heading not in _HEADINGS:
            raise ValueError(f"{name}.heading is {self.heading!r}, expected one of {', '.join(_HEADINGS)}")
        for field_name in ("x", "y"):
            _number(f"{name}.{field_name}", getattr(self, field_name))
        for field_name in ("w", "d", "yaw", "score"):
            if getattr(self, field_name) is not None:
                _number(f"{name}.{field_name}", getattr(self, field_name))
        for of_name, of, kind in (("sigma", self.sigma, Sigma), ("velocity", self.velocity, Velocity)):
            if of is not None:
                _of_kind(f"{name}.{of_name}", of, kind)
                _numbers(f"{name}.{of_name}", of)
        if self.source_track is not None:
            _integer(f"{name}.source_track", self.source_track, "that names a track")

    def to_json(self) -> Json:
        """As JSON of the network."""
        return _given(
            **{"class": self.cls}, x=self.x, y=self.y, w=self.w, d=self.d, yaw=self.yaw, score=self.score,
            heading=self.heading,
            sigma=None if self.sigma is None else self.sigma.to_json(),
            velocity=None if self.velocity is None else self.velocity.to_json(),
            source_track=None if self.source_track is None else str(self.source_track),
        )  # fmt: skip

    @classmethod
    def from_json(cls, json: Json) -> Detection:
        """From JSON of the network."""
        sigma, velocity, track = json.get("sigma"), json.get("velocity"), json.get("source_track")
        return cls(
            json["class"], json["x"], json["y"], json.get("w"), json.get("d"), json.get("yaw"), json.get("score"),
            json.get("heading"),
            None if sigma is None else Sigma(**sigma),
            None if velocity is None else Velocity(**velocity),
            None if track is None else int(track),
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class DetectionFrame:
    """All that one sensor detected at one time; an empty list says that it detected nothing."""

    captured_at: int
    detections: tuple[Detection, ...] = ()
    agent: str | None = None
    epoch: int | None = None
    sequence: int | None = None
    sensor_pose: Pose | None = None
    sensor_revision: int = 0
    map_frame: str | None = None

    def check(self) -> None:
        """Raises a `TypeError` or a `ValueError` that names the field and its value where a number is none: a time that is a
        float, a position that is NaN or infinite. Whether values are possible (a width of 0) the hub judges."""
        _integer("captured_at", self.captured_at, "of nanoseconds since 1970, such as time.time_ns()", 63)
        for name in ("epoch", "sequence"):
            if getattr(self, name) is not None:
                _integer(name, getattr(self, name), "that counts")
        _integer("sensor_revision", self.sensor_revision, "that counts", 32)
        if self.sensor_pose is not None:
            _of_kind("sensor_pose", self.sensor_pose, Pose)
            _numbers("sensor_pose", self.sensor_pose)
        for n, one in enumerate(self.detections):
            _of_kind(f"detections[{n}]", one, Detection)
            one.check(f"detections[{n}]")

    def to_json(self) -> Json:
        """As JSON of the network."""
        return _given(
            captured_at=self.captured_at // 1000, agent=self.agent,
            epoch=None if self.epoch is None else str(self.epoch),
            sequence=None if self.sequence is None else str(self.sequence),
            sensor_pose=None if self.sensor_pose is None else self.sensor_pose.to_json(),
            sensor_revision=self.sensor_revision or None, map_frame=self.map_frame,
            detections=[one.to_json() for one in self.detections],
        )  # fmt: skip

    @classmethod
    def from_json(cls, json: Json) -> DetectionFrame:
        """From JSON of the network."""
        pose, epoch, sequence = json.get("sensor_pose"), json.get("epoch"), json.get("sequence")
        return cls(
            json["captured_at"] * 1000, tuple(map(Detection.from_json, json["detections"])), json.get("agent"),
            None if epoch is None else int(epoch), None if sequence is None else int(sequence),
            None if pose is None else Pose.from_json(pose), json.get("sensor_revision", 0), json.get("map_frame"),
        )  # fmt: skip

    def to_array(self) -> npt.NDArray[np.void]:
        """The detections as an array of `v2x.DETECTION`; an unknown class name becomes `unknown`, as at a hub."""
        from .arrays import detections as blank
        from ._v2x import class_code

        array = blank(len(self.detections))
        for row, one in zip(array, self.detections, strict=True):
            sigma, velocity = one.sigma or Sigma(), one.velocity
            row["class"] = class_code(one.cls) or 0
            row["heading"] = BY_YAW if one.heading is None else _HEADINGS[one.heading]
            values = _given(
                x=one.x, y=one.y, yaw=one.yaw, w=one.w, d=one.d, score=one.score, sigma_x=sigma.x, sigma_y=sigma.y,
                rho=sigma.rho, sigma_w=sigma.w, sigma_d=sigma.d, sigma_yaw=sigma.yaw, source_track=one.source_track,
            )  # fmt: skip
            if velocity is not None:
                values |= {"vx": velocity.x, "vy": velocity.y, "sigma_vx": velocity.sigma_x}
                values |= {"sigma_vy": velocity.sigma_y, "rho_v": velocity.rho}
            for name, value in values.items():
                row[name] = value
        return array


def detections_of(array: npt.NDArray[np.void]) -> tuple[Detection, ...]:
    """The detections of an array of `v2x.DETECTION`."""
    if array.dtype.names != DETECTION.names:
        raise TypeError(f"detections is an array of {array.dtype}, expected one of v2x.DETECTION: v2x.detections(…) makes it")

    def detection(row: np.void) -> Detection:
        values: dict[str, Any] = {
            name: float(row[name])
            for name in DETECTION.names or ()
            if DETECTION[name].kind == "f" and not np.isnan(row[name])
        }
        get = values.get
        sigma = Sigma(get("sigma_x"), get("sigma_y"), get("rho"), get("sigma_w"), get("sigma_d"), get("sigma_yaw"))
        velocity = None
        if "vx" in values:
            try:
                velocity = Velocity(values["vx"], values["vy"], values["sigma_vx"], values["sigma_vy"], get("rho_v", 0.0))
            except KeyError as missing:
                raise ValueError(f"{missing.args[0]} is nan: a velocity needs vx, vy, sigma_vx and sigma_vy") from None
        track = int(row["source_track"])
        return Detection(
            CLASSES[int(row["class"])], float(row["x"]), float(row["y"]), get("w"), get("d"), get("yaw"), get("score"),
            _HEADING_NAMES.get(int(row["heading"])), None if sigma == Sigma() else sigma, velocity,
            None if track < 0 else track,
        )  # fmt: skip

    return tuple(map(detection, array))


@dataclass(frozen=True, slots=True)
class FieldOfView:
    """The annular sector in which a sensor sees, relative to its pose (m, rad)."""

    range_max_m: float
    range_min_m: float | None = None
    azimuth_rad: float | None = None
    width_rad: float | None = None


@dataclass(frozen=True, slots=True)
class SizeNoise:
    """Relative errors of sizes: a normal about 1 of this standard deviation, truncated below."""

    sigma: float
    lower: float


@dataclass(frozen=True, slots=True)
class Body:
    """The body of a vehicle agent about its pose (m)."""

    cls: str
    w: float
    d: float


@dataclass(frozen=True, slots=True)
class Accuracy:
    """How well an agent knows where it is and what time it is: standard deviations (m, rad, s)."""

    position_m: float
    yaw_rad: float
    clock_s: float


@dataclass(frozen=True, slots=True)
class SensorDescription:
    """What an agent says of its sensor. With it missed detections count, and its clock and pose are corrected."""

    field_of_view: FieldOfView
    rate_hz: float
    kind: Literal["vehicle", "roadside-unit"] = "roadside-unit"
    detection_probability: float = 0.9
    clutter_per_m2: float = 1e-6
    accuracy: Accuracy = field(default_factory=lambda: Accuracy(0.1, 0.01, 0.005))
    size_noise: SizeNoise | None = None
    body: Body | None = None
    revision: int = 1

    def check(self) -> None:
        """Raises a `TypeError` or a `ValueError` that names the field and its value where a number is none."""
        _integer("revision", self.revision, "that counts", 32)
        _all_numbers("", self.to_json())

    def to_json(self) -> Json:
        """As JSON of the network."""
        view, noise, body, accuracy = self.field_of_view, self.size_noise, self.body, self.accuracy
        return _given(
            revision=self.revision, kind=self.kind,
            field_of_view=_given(
                range_max_m=view.range_max_m, range_min_m=view.range_min_m,
                azimuth_rad=view.azimuth_rad, width_rad=view.width_rad,
            ),
            detection_probability=self.detection_probability, clutter_per_m2=self.clutter_per_m2,
            size_noise=None if noise is None else {"sigma": noise.sigma, "lower": noise.lower},
            body=None if body is None else {"class": body.cls, "w": body.w, "d": body.d},
            accuracy={"position_m": accuracy.position_m, "yaw_rad": accuracy.yaw_rad, "clock_s": accuracy.clock_s},
            rate_hz=self.rate_hz,
        )  # fmt: skip

    @classmethod
    def from_json(cls, json: Json) -> SensorDescription:
        """From JSON of the network."""
        noise, body = json.get("size_noise"), json.get("body")
        return cls(
            FieldOfView(**json["field_of_view"]), json["rate_hz"], json["kind"], json["detection_probability"],
            json["clutter_per_m2"], Accuracy(**json["accuracy"]), None if noise is None else SizeNoise(**noise),
            None if body is None else Body(body["class"], body["w"], body["d"]), json["revision"],
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Measurement:
    """One detection of one frame of one agent."""

    agent: str
    epoch: int
    sequence: int
    index: int

    @classmethod
    def from_json(cls, json: Json) -> Measurement:
        """From JSON of the network."""
        return cls(json["agent"], int(json["epoch"]), int(json["sequence"]), json["index"])


@dataclass(frozen=True, slots=True, eq=False)
class FusedObject:
    """One object of a hub's list, valid at the frame's `fused_at`.

    `covariance` is 4 × 4, of (x, y, vx, vy): m², m²/s, m²/s². `sigma_w`, `sigma_d` (m) and `sigma_yaw` (rad) are standard
    deviations. `age` is since its first measurement (ns), `last_measured_at` by the clock of the agent. `contributors` are
    the last measurement of each agent.
    """

    track: int
    cls: str
    class_probabilities: tuple[tuple[str, float], ...]
    class_conflict: float
    x: float
    y: float
    w: float
    d: float
    yaw: float
    vx: float
    vy: float
    covariance: npt.NDArray[np.float64]
    sigma_w: float
    sigma_d: float
    sigma_yaw: float
    heading: Heading
    existence: float
    age: int
    last_measured_at: int
    contributors: tuple[Measurement, ...]

    @classmethod
    def from_json(cls, json: Json) -> FusedObject:
        """From JSON of the network."""
        covariance = np.zeros((4, 4))
        covariance[_UPPER] = json["kinematic_covariance"]
        covariance.T[_UPPER] = json["kinematic_covariance"]
        sigma = json["sigma"]
        return cls(
            int(json["track"]), json["class"], tuple((name, p) for name, p in json["class_probabilities"]),
            json.get("class_conflict", 0.0), json["x"], json["y"], json["w"], json["d"], json["yaw"], json["vx"], json["vy"],
            covariance, sigma["w"], sigma["d"], sigma["yaw"], json.get("heading", "known"), json["existence"],
            json["age_us"] * 1000, json["last_measured_at"] * 1000,
            tuple(map(Measurement.from_json, json["contributors"])),
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class AgentHealth:
    """How an agent fares at a hub: counts of frames since the hub's start."""

    agent: str
    epoch: int
    newest_captured_at: int
    accepted: int
    refused: int
    out_of_sequence: int

    @classmethod
    def from_json(cls, json: Json) -> AgentHealth:
        """From JSON of the network."""
        return cls(
            json["agent"], int(json["epoch"]), json["newest_captured_at"] * 1000, json["accepted"], json["refused"],
            json["out_of_sequence"],
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Inclusion:
    """A detection frame that a fused frame is the first to contain: by it every consumer measures latency."""

    agent: str
    epoch: int
    sequence: int
    captured_at: int
    received_at: int

    @classmethod
    def from_json(cls, json: Json) -> Inclusion:
        """From JSON of the network."""
        times = json["captured_at"] * 1000, json["received_at"] * 1000
        return cls(json["agent"], int(json["epoch"]), int(json["sequence"]), *times)


@dataclass(frozen=True, slots=True, eq=False)
class FusedFrame:
    """A hub's list of objects, valid at `fused_at` by the hub's clock."""

    hub: str
    lineage: int
    sequence: int
    fused_at: int
    objects: tuple[FusedObject, ...]
    agents: tuple[AgentHealth, ...] = ()
    includes: tuple[Inclusion, ...] = ()
    map_frame: str | None = None

    @classmethod
    def from_json(cls, json: Json) -> FusedFrame:
        """From JSON of the network."""
        return cls(
            json["hub"], json["lineage"], int(json["sequence"]), json["fused_at"] * 1000,
            tuple(map(FusedObject.from_json, json["objects"])), tuple(map(AgentHealth.from_json, json["agents"])),
            tuple(map(Inclusion.from_json, json["includes"])), json.get("map_frame"),
        )  # fmt: skip

    def to_array(self) -> npt.NDArray[np.void]:
        """The objects as an array of `v2x.OBJECT`."""
        return objects_array(self.objects)


def objects_array(objects: Sequence[FusedObject]) -> npt.NDArray[np.void]:
    """Objects as an array of `v2x.OBJECT`."""
    array = np.zeros(len(objects), OBJECT)
    names = set(OBJECT.names or ()) - {"id", "class", "heading", "class_probability"}
    for row, one in zip(array, objects, strict=True):
        row["id"], row["class"], row["heading"] = one.track, CLASSES.index(one.cls), _HEADINGS[one.heading]
        row["class_probability"] = next((p for name, p in one.class_probabilities if name == one.cls), 1.0)
        for name in names:
            row[name] = getattr(one, name)
    return array


@dataclass(frozen=True, slots=True, eq=False)
class DeltaFrame:
    """A hub's list by what has changed since the key frame `key_sequence`."""

    hub: str
    lineage: int
    sequence: int
    fused_at: int
    key_sequence: int
    changed: tuple[FusedObject, ...]
    gone: tuple[int, ...]
    map_frame: str | None = None

    @classmethod
    def from_json(cls, json: Json) -> DeltaFrame:
        """From JSON of the network."""
        return cls(
            json["hub"], json["lineage"], int(json["sequence"]), json["fused_at"] * 1000, int(json["key_sequence"]),
            tuple(map(FusedObject.from_json, json["changed"])), tuple(map(int, json["gone"])), json.get("map_frame"),
        )  # fmt: skip


def list_message(json: Mapping[str, Any]) -> FusedFrame | DeltaFrame:
    """A key frame or a delta frame of JSON."""
    return DeltaFrame.from_json(dict(json)) if "key_sequence" in json else FusedFrame.from_json(dict(json))
