"""The laboratory's protocol for a method in Python: the paper's noisy detections, and the scores of its tables.

Two agents report each keyframe of a scene. `Study` draws their errors as `lab tables` and `lab export` do, from keyed seeds:
the same seed, trial, scene, keyframe, agent and object have the same error everywhere. A method is a function of a keyframe:

>>> def mine(keyframe):                       # agent 1 alone
...     return boxes_of(keyframe.reports[0])
>>> study = Study(scenes(quick=True)[:2], noise="N1-N3", trials=2)
>>> study.score(mine).row()["precision"]
1.0
>>> study.score("csba-wls").row()["mate_m"] < study.score(mine).row()["mate_m"]
True
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from . import _v2x
from .arrays import DETECTION, as_records

#: The rows of the tables, by their names; `Study.score` takes them.
METHODS: tuple[str, ...] = tuple(_v2x.TABLE_METHODS)

Noise: TypeAlias = Literal["N1-N1", "N2-N2", "N3-N3", "N1-N3"]
Shape: TypeAlias = Literal["gaussian", "uniform", "laplace", "student-t"]
Conditions: TypeAlias = Literal["paper", "sensors", "lidar", "camera"]
Counting: TypeAlias = Literal["table", "printed", "first-boxes"]
Subset: TypeAlias = Literal["all", "static", "moving"]

#: A true box: the place of its keyframe, its object (numbers from 0, the noise is keyed by them), class, box (m, rad).
TRUTH: np.dtype[np.void] = np.dtype(
    [("frame", "i8"), ("id", "i8"), ("class", "u1"), ("x", "f8"), ("y", "f8"), ("yaw", "f8"), ("w", "f8"), ("d", "f8")],
    align=True,
)

#: A keyframe: ns since the scene's start, and the pose of agent 1 (m, rad).
KEYFRAME: np.dtype[np.void] = np.dtype([("t", "i8"), ("x", "f8"), ("y", "f8"), ("yaw", "f8")], align=True)

#: A box that a method makes of a keyframe. `existence` and the standard deviations may be NaN: 1, and none stated.
#: `det_ids` names, of agents 1 and 2, the newest detection that the box was made of (-1: none): the score goes by them.
BOX: np.dtype[np.void] = np.dtype(
    [
        ("class", "u1"), ("x", "f8"), ("y", "f8"), ("yaw", "f8"), ("w", "f8"), ("d", "f8"), ("existence", "f8"),
        ("sigma_x", "f8"), ("sigma_y", "f8"), ("rho", "f8"), ("sigma_w", "f8"), ("sigma_d", "f8"), ("sigma_yaw", "f8"),
        ("det_ids", "i8", (2,)),
    ],
    align=True,
)  # fmt: skip


class Scene:
    """Keyframes with true boxes.

    `name` keys the noise. `keyframes` is an array of `KEYFRAME`, `truth` one of `TRUTH`. Scenes of data sets: `scenes`.
    """

    def __init__(self, name: str, keyframes: npt.NDArray[np.void], truth: npt.NDArray[np.void]) -> None:
        self._scene = _v2x.Scene(name, as_records(keyframes, KEYFRAME, "keyframes"), as_records(truth, TRUTH, "truth"))

    @classmethod
    def _of(cls, scene: _v2x.Scene) -> Scene:
        made = cls.__new__(cls)
        made._scene = scene
        return made

    @property
    def name(self) -> str:
        """Its name in its data set."""
        return self._scene.name

    @property
    def keyframes(self) -> npt.NDArray[np.void]:
        """Times and poses of agent 1, an array of `KEYFRAME`."""
        return np.frombuffer(self._scene.keyframes(), KEYFRAME)

    @property
    def truth(self) -> npt.NDArray[np.void]:
        """All true boxes, an array of `TRUTH`."""
        return np.frombuffer(self._scene.truth(), TRUTH)

    def __len__(self) -> int:
        return len(self._scene)

    def __repr__(self) -> str:
        return f"Scene({self.name!r}, {len(self)} keyframes)"


def scenes(
    source: str = "synthetic", *, version: str = "v1.0-trainval", split: str = "val", quick: bool = False
) -> list[Scene]:
    """The scenes of a data set, named as for `lab tables --dataset`: `synthetic`, `csv:FILE` or `nuscenes:FOLDER`.

    `version` and `split` are those of nuScenes. `quick` takes at most twelve, spread over all, as `--quick` does.
    """
    return [Scene._of(scene) for scene in _v2x.scenes(source, (version, split), quick)]


@dataclass(frozen=True, slots=True, eq=False)
class Report:
    """What one agent reports of a keyframe.

    `pose` is the agent's (x, y, yaw; m, rad); `detections` is an array of `v2x.DETECTION` in no meaningful order, its
    standard deviations are what the agent knows; `det_ids` are the detections' ids, for `BOX`.
    """

    pose: tuple[float, float, float]
    detections: npt.NDArray[np.void]
    det_ids: npt.NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.detections)


@dataclass(frozen=True, slots=True, eq=False)
class Keyframe:
    """What both agents report of a keyframe: its place in the scene, its time (ns since the scene's start), the reports."""

    frame: int
    t: int
    reports: tuple[Report, Report]


#: A method: the boxes of a keyframe, an array of `BOX`.
Method: TypeAlias = Callable[[Keyframe], npt.NDArray[np.void]]


def boxes(n: int) -> npt.NDArray[np.void]:
    """An array of `BOX` that states no accuracies and names no detections."""
    array = np.zeros(n, BOX)
    for name in BOX.names or ():
        if BOX[name].kind == "f":
            array[name] = np.nan
    array["det_ids"] = -1
    return array


def boxes_of(report: Report, agent: int = 0) -> npt.NDArray[np.void]:
    """An agent's detections as they are, as boxes; `agent` is 0 or 1."""
    array = boxes(len(report))
    for name in ("class", "x", "y", "yaw", "w", "d", "sigma_x", "sigma_y", "rho", "sigma_w", "sigma_d", "sigma_yaw"):
        array[name] = report.detections[name]
    array["existence"] = report.detections["score"]
    array["det_ids"][:, agent] = report.det_ids
    return array


class Score:
    """The errors of a method over all scenes and trials."""

    def __init__(self, name: str, score: _v2x.Score) -> None:
        #: The method's name.
        self.name = name
        self._score = score

    def row(self, counting: Counting = "table", subset: Subset = "all") -> dict[str, float | None]:
        """The numbers of a row of `lab tables --json`, by their names there.

        `mate_m`, `made_m` (m), `maoe_deg` (degrees), `precision` and `recall` (fractions); `_std` is over frames, the
        paper's ±, `_trial_std` over trials. `None` where nothing was counted.

        `counting` is the divisor of the errors: `table` as in the paper's tables, `printed` as in its formula,
        `first-boxes` with only the first box of each object. `subset` is of all objects, or of those that stay within 1 m,
        or of those that do not.
        """
        return dict(self._score.metrics(counting, subset))

    def __repr__(self) -> str:
        row = self.row()
        return f"Score({self.name!r}, " + ", ".join(f"{key}={row[key]}" for key in _SHOWN) + ")"


_SHOWN = ("mate_m", "made_m", "maoe_deg", "precision", "recall")


class Study:
    """Scenes under one setting of noise, as `lab tables` has them.

    `noise` are the levels of agents 1 and 2, `shape` is the distribution of the errors, `conditions` what the agents see and
    miss, `trials` the number of realisations (the paper has 5), `seed` that of all of them.
    """

    def __init__(
        self,
        scenes: Sequence[Scene],
        *,
        noise: Noise = "N1-N1",
        trials: int = 5,
        seed: int = 1,
        shape: Shape = "gaussian",
        conditions: Conditions = "paper",
    ) -> None:
        names = [scene.name for scene in scenes]
        if len(set(names)) < len(names):
            raise ValueError("two scenes have one name: the noise is keyed by it")
        self.scenes: tuple[Scene, ...] = tuple(scenes)
        self.trials = trials
        self._times = [scene.keyframes["t"].tolist() for scene in scenes]
        self._study = _v2x.Study([scene._scene for scene in scenes], (noise, shape, conditions), trials, seed)

    def observe(self, scene: int, trial: int = 0) -> list[Keyframe]:
        """The noisy detections of a scene (its place in `scenes`) in a trial, by keyframe; those of `lab export`."""
        if not 0 <= trial < self.trials:
            raise ValueError(f"trial is {trial}, expected 0 to {self.trials - 1}")
        reports = self._study.reports(scene, trial)
        times = self._times[scene]
        return [Keyframe(frame, times[frame], _both(reports[frame])) for frame in range(len(reports))]

    def keyframes(self) -> Iterator[tuple[int, int, list[Keyframe]]]:
        """Trial, place of the scene, and its keyframes, of all trials and scenes."""
        for trial in range(self.trials):
            for scene in range(len(self.scenes)):
                yield trial, scene, self.observe(scene, trial)

    def score(
        self,
        method: Method | str | None = None,
        *,
        make: Callable[[], Method] | None = None,
        name: str | None = None,
        threads: int | None = None,
    ) -> Score:
        """The score of a method.

        - A function of a keyframe, without memory: `study.score(mine)`.
        - One with memory, such as a tracker: `study.score(make=Tracker)`; it is made anew for each trial and scene, and gets
          the keyframes in order.
        - A row of the tables by its name (`METHODS`): `study.score("ours")`, on `threads` threads; the number changes
          nothing.

        Where no box of a method names a detection (`det_ids`), boxes are matched by position within their class.
        """
        threads = threads or os.cpu_count() or 1
        if isinstance(method, str):
            return Score(name or method, self._study.score_method(method, threads))
        if (method is None) == (make is None):
            raise TypeError("give a method, or make=…, which makes one for each scene")
        made: list[list[list[npt.NDArray[np.void]]]] = [[] for _ in range(self.trials)]
        for trial, _, keyframes in self.keyframes():
            fuse = make() if make is not None else method
            assert fuse is not None
            made[trial].append([fuse(keyframe) for keyframe in keyframes])
        called = name or str(getattr(method or make, "__name__", "mine"))
        return self.score_boxes(made, name=called, threads=threads)

    def score_boxes(
        self,
        made: Sequence[Sequence[Sequence[npt.NDArray[np.void]]]],
        *,
        name: str = "mine",
        threads: int | None = None,
    ) -> Score:
        """The score of boxes that were made elsewhere: of each trial, scene and keyframe an array of `BOX`."""
        outputs = [[_output(keyframes, trial, scene) for scene, keyframes in enumerate(of_trial)]
                   for trial, of_trial in enumerate(made)]  # fmt: skip
        expected = [len(self.scenes)] * self.trials
        if [len(of_trial) for of_trial in outputs] != expected:
            raise ValueError(f"boxes of {[len(of_trial) for of_trial in outputs]} scenes by trial, expected {expected}")
        any_named = any(names for of_trial in outputs for names, _, _ in of_trial)
        outputs = [[(any_named, counts, records) for _, counts, records in of_trial] for of_trial in outputs]
        return Score(name, self._study.score_output(outputs, threads or os.cpu_count() or 1))


def _both(reports: Sequence[tuple[tuple[float, float, float], bytearray, list[int]]]) -> tuple[Report, Report]:
    one, two = (
        Report(pose, np.frombuffer(records, DETECTION), np.array(ids, np.int64)) for pose, records, ids in reports
    )
    return one, two


def _output(keyframes: Sequence[npt.NDArray[np.void]], trial: int, scene: int) -> tuple[bool, list[int], bytes]:
    what = f"the output for scene {scene} in trial {trial}"
    records = [as_records(array, BOX, what) for array in keyframes]
    names_detections = any(bool((array["det_ids"] != -1).any()) for array in keyframes)
    return names_detections, [len(array) for array in keyframes], b"".join(records)
