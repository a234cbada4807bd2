"""The JSON schemas (draft 2020-12) of the network's messages, as dicts."""

from __future__ import annotations

import json
from typing import Any

from . import _v2x

DETECTION_FRAME: dict[str, Any]
SENSOR_DESCRIPTION: dict[str, Any]
FUSED_FRAME: dict[str, Any]
DELTA_FRAME: dict[str, Any]
DETECTION_FRAME, SENSOR_DESCRIPTION, FUSED_FRAME, DELTA_FRAME = map(json.loads, _v2x.SCHEMAS)
