"""NumPy structured arrays of detections and objects.

One map frame in metres: x is east, y is north. Angles are radians, counter-clockwise from x. `w` is the width across the
heading, `d` the depth along it. Times are integers of nanoseconds. A class is a number: its place in `CLASSES`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _v2x

#: The nuScenes names of the classes; a class in an array is a place in this tuple.
CLASSES: tuple[str, ...] = tuple(_v2x.CLASSES)

#: What is known of a heading, as a number in an array. `BY_YAW` in a detection: known where there is a yaw, else nothing.
BY_YAW, KNOWN, AXIS, UNKNOWN = 0, 1, 2, 3

#: One detection of an agent. NaN is for what the agent does not know: the hub's `report_defaults` fill it, as in JSON.
#: Required are `class`, `x` and `y`; a detection whose position is NaN is dropped and counted.
#:
#: ================================= ======= ==========================================================================
#: `class`                           -       place in `CLASSES`
#: `heading`                         -       `BY_YAW`, `KNOWN`, `AXIS` (the front may be at the other end), `UNKNOWN`
#: `x`, `y`                          m       position in the map frame
#: `yaw`                             rad     heading
#: `w`, `d`                          m       width and depth
#: `score`                           -       the detector's confidence, 0 to 1
#: `sigma_x`, `sigma_y`, `rho`       m, m, - standard deviations and correlation of the position
#: `sigma_w`, `sigma_d`, `sigma_yaw` m, rad  standard deviations of size and heading
#: `vx`, `vy`                        m/s     measured velocity, with
#: `sigma_vx`, `sigma_vy`, `rho_v`   m/s, -  its standard deviations, which it needs, and their correlation
#: `source_track`                    -       the sender's own track number, -1 of a raw detection
#: ================================= ======= ==========================================================================
DETECTION: np.dtype[np.void] = np.dtype(
    [
        ("class", "u1"), ("heading", "u1"),
        ("x", "f8"), ("y", "f8"), ("yaw", "f8"), ("w", "f8"), ("d", "f8"), ("score", "f8"),
        ("sigma_x", "f8"), ("sigma_y", "f8"), ("rho", "f8"),
        ("sigma_w", "f8"), ("sigma_d", "f8"), ("sigma_yaw", "f8"),
        ("vx", "f8"), ("vy", "f8"), ("sigma_vx", "f8"), ("sigma_vy", "f8"), ("rho_v", "f8"),
        ("source_track", "i8"),
    ],
    align=True,
)  # fmt: skip

#: One fused object, valid at the time that was asked for.
#:
#: ================================= ======= ==========================================================================
#: `id`                              -       the track: the same as long as it exists
#: `class`, `class_probability`      -       the most probable class (place in `CLASSES`), and how probable it is
#: `class_conflict`                  -       how much the agents contradict each other about the class, 0 to 1
#: `heading`                         -       `KNOWN`, `AXIS` or `UNKNOWN`
#: `x`, `y`, `yaw`, `w`, `d`         m, rad  the box
#: `vx`, `vy`                        m/s     velocity
#: `covariance`                      SI      4 × 4, of (x, y, vx, vy): m², m²/s, m²/s²
#: `sigma_w`, `sigma_d`, `sigma_yaw` m, rad  standard deviations of size and heading
#: `existence`                       -       probability that it exists
#: `age`                             ns      since its first measurement
#: `last_measured_at`                ns      capture time of its last measurement, since 1970, by the agent's clock
#: ================================= ======= ==========================================================================
OBJECT: np.dtype[np.void] = np.dtype(
    [
        ("id", "u8"), ("class", "u1"), ("heading", "u1"),
        ("x", "f8"), ("y", "f8"), ("yaw", "f8"), ("w", "f8"), ("d", "f8"), ("vx", "f8"), ("vy", "f8"),
        ("covariance", "f8", (4, 4)),
        ("sigma_w", "f8"), ("sigma_d", "f8"), ("sigma_yaw", "f8"),
        ("existence", "f8"), ("class_probability", "f8"), ("class_conflict", "f8"),
        ("age", "i8"), ("last_measured_at", "i8"),
    ],
    align=True,
)  # fmt: skip


def class_code(name: str | int) -> int:
    """The number of a class by its nuScenes name or a common one (`car`, `pedestrian`); a number is returned as it is.

    An unknown name is a `ValueError`. On a network it would become `unknown`, and be counted.
    """
    if isinstance(name, str):
        code = _v2x.class_code(name)
        if code is None:
            raise ValueError(f"class is {name!r}, which is none of {', '.join(CLASSES)}, nor a common name of one")
        return code
    return int(name)


def class_codes(names: str | int | Iterable[str | int]) -> npt.NDArray[np.uint8]:
    """The numbers of several classes, or of one."""
    if isinstance(names, (str, int)):
        return np.array(class_code(names), np.uint8)
    return np.array([class_code(name) for name in names], np.uint8)


def detections(n: int | None = None, *, class_: Any = None, **fields: Any) -> npt.NDArray[np.void]:
    """An array of `DETECTION` in which all that is not given is left open.

    >>> detections(class_="car", x=[12.0, 30.0], y=5.0, yaw=[0.1, 0.2])["x"]
    array([12., 30.])

    `class_` is a name, a number, or a sequence of them (a class is a keyword of Python). `n` is the number of detections
    where no field says it.
    """
    unknown = fields.keys() - set(DETECTION.names or ()) | ({"class"} & fields.keys())
    if unknown:
        raise TypeError(f"no field {', '.join(sorted(unknown))}; there are class_, {', '.join((DETECTION.names or ())[1:])}")
    columns = {name: np.asarray(value) for name, value in fields.items()}
    if class_ is not None:
        columns["class"] = class_codes(class_)
    shape = np.broadcast_shapes(*[column.shape for column in columns.values()], () if n is None else (n,))
    array = np.zeros(shape if shape else (1,), DETECTION)
    for name in DETECTION.names or ():
        if DETECTION[name].kind == "f":
            array[name] = np.nan
    array["source_track"] = -1
    for name, column in columns.items():
        array[name] = column
    return array


def as_records(array: npt.NDArray[np.void], dtype: np.dtype[np.void], what: str) -> bytes:
    """The bytes of a structured array. Fields in another order or of another kind are converted; a missing one is an error."""
    if array.dtype != dtype:
        names: Sequence[str] = array.dtype.names or ()
        missing = [name for name in dtype.names or () if name not in names]
        if missing:
            raise TypeError(f"{what} has no field {', '.join(missing)}: make it of that dtype, such as by v2x.detections(…)")
        converted = np.empty(array.shape, dtype)
        for name in dtype.names or ():
            converted[name] = array[name]
        array = converted
    if array.ndim != 1:
        raise TypeError(f"{what} has {array.ndim} dimensions, expected 1")
    return array.tobytes()


def nanoseconds(seconds: float) -> int:
    """Seconds as a time of this package: integer nanoseconds, rounded.

    For times of a simulation or of a log. A float of seconds since 1970 has steps of 0.2 µs; `time.time_ns()` is exact.
    """
    return round(seconds * 1_000_000_000)
