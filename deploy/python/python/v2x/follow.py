"""Lists that cost less than the whole one, put together again: by what changes, and by tile."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from .messages import DeltaFrame, FusedFrame, FusedObject, list_message

_SECOND = 1_000_000_000
#: A tile of which nothing came for so long is empty: its last, empty frame was lost. ns.
TILE_HOLDS = 3 * _SECOND // 2


class DeltaFollower:
    """Follows a hub's list by its key frames and delta frames; of one hub. A lost message costs nothing but itself.

    Objects name no contributors; `last_measured_at` is that of an object's last transmission, at most a second before.
    """

    def __init__(self) -> None:
        self._key: FusedFrame | None = None
        self._newest: tuple[int, int] | None = None

    def handle(self, message: FusedFrame | DeltaFrame | Mapping[str, Any]) -> FusedFrame | None:
        """Takes in a message; the list as of its time, or `None` where its key frame is missing or it is not new."""
        if isinstance(message, Mapping):
            message = list_message(message)
        if self._newest is not None and message.lineage == self._newest[0] and message.sequence <= self._newest[1]:
            return None
        if isinstance(message, FusedFrame):
            self._key = frame = message
        else:
            known = self._key
            if known is None or (known.hub, known.lineage, known.sequence) != (
                message.hub, message.lineage, message.key_sequence,
            ):  # fmt: skip
                return None
            frame = _list_of(known, message)
        self._newest = (frame.lineage, frame.sequence)
        return frame


def _list_of(key: FusedFrame, delta: DeltaFrame) -> FusedFrame:
    elapsed = delta.fused_at - key.fused_at
    gone = set(delta.gone)
    objects = {one.track: _moved(one, elapsed) for one in key.objects if one.track not in gone}
    objects |= {one.track: one for one in delta.changed}
    by_track = tuple(objects[track] for track in sorted(objects))
    return FusedFrame(
        delta.hub, delta.lineage, delta.sequence, delta.fused_at, by_track, map_frame=delta.map_frame
    )


def _moved(one: FusedObject, elapsed: int) -> FusedObject:
    """The object so much later (ns), at its velocity."""
    seconds = elapsed / _SECOND
    return replace(one, x=one.x + one.vx * seconds, y=one.y + one.vy * seconds, age=one.age + elapsed)


class AreaFollower:
    """One list of the tiles of an area; of one hub."""

    def __init__(self) -> None:
        self._tiles: dict[str, FusedFrame] = {}

    def handle(self, key: str, message: FusedFrame | Mapping[str, Any]) -> FusedFrame | None:
        """Takes in the frame of a tile, by its key; the area's list as of its time, or `None` where it is not new."""
        frame = FusedFrame.from_json(dict(message)) if isinstance(message, Mapping) else message
        held = self._tiles.get(key)
        if held is not None and held.lineage == frame.lineage and frame.sequence <= held.sequence:
            return None
        self._tiles[key] = frame
        self._tiles = {
            tile: one for tile, one in self._tiles.items()
            if one.lineage == frame.lineage and frame.fused_at - one.fused_at < TILE_HOLDS
        }  # fmt: skip
        objects: dict[int, tuple[int, FusedObject]] = {}
        for one in self._tiles.values():
            for of_tile in one.objects:
                # An object that changed its tile is in two of them until the old one's next frame.
                if of_tile.track not in objects or objects[of_tile.track][0] < one.sequence:
                    objects[of_tile.track] = (one.sequence, of_tile)
        by_track = tuple(objects[track][1] for track in sorted(objects))
        return replace(frame, objects=by_track, agents=(), includes=())
