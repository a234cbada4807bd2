"""Late fusion of bird's-eye-view detections, in Python.

- `Engine`: the engine of a hub, in this process. Frames in (dicts, payloads or NumPy arrays), NumPy arrays of objects out.
- `v2x.lab`: the paper's noise and scores for a method in Python.
- `v2x.client` (needs `eclipse-zenoh`): agents and consumers of a network, with typed frames. `v2x.messages` are the frames.
- `v2x.recording` (needs `mcap`): reads recordings.
- `v2x.testing`: the pytest fixture `hub`, a hub on a free port.

Metres, radians, x east, y north; times are integers of nanoseconds since 1970.
"""

from . import lab
from .arrays import AXIS, BY_YAW, CLASSES, DETECTION, KNOWN, OBJECT, UNKNOWN, class_code, class_codes, detections, nanoseconds
from .engine import METHODS, Engine, Handled, MalformedFrame

__all__ = [
    "AXIS",
    "BY_YAW",
    "CLASSES",
    "DETECTION",
    "KNOWN",
    "METHODS",
    "OBJECT",
    "UNKNOWN",
    "Engine",
    "Handled",
    "MalformedFrame",
    "class_code",
    "class_codes",
    "detections",
    "lab",
    "nanoseconds",
]
