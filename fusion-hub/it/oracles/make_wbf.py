"""Makes wbf.json from the published weighted box fusion.

pip install numpy==2.4.6 ensemble-boxes==1.0.9
python make_wbf.py
"""

import json
import pathlib

import numpy as np
from ensemble_boxes import weighted_boxes_fusion

HERE = pathlib.Path(__file__).resolve().parent
# Their boxes lie in the unit square; ours are 100 times as large.
SCALE = 100.0
# Classes as ours number them: a car and an adult.
LABELS = [17, 2]


def agent(rng, objects):
    """One agent's detections of the objects: corners, score, label."""
    detected = [one for one in objects if rng.uniform() < 0.85]
    boxes = [np.clip(np.array(one[:4]) + rng.normal(0, 0.6, 4), 0, SCALE) for one in detected]
    boxes = [[min(x1, x2), min(y1, y2), max(x1, x2) + 0.1, max(y1, y2) + 0.1] for x1, y1, x2, y2 in boxes]
    return [
        {"corners": [round(float(v), 4) for v in box], "score": round(float(rng.uniform(0.05, 1)), 6), "label": one[4]}
        for box, one in zip(boxes, detected)
    ]


def case(rng, n_agents, n_objects, threshold):
    objects = []
    for _ in range(n_objects):
        x, y = rng.uniform(1, 60, 2)
        w, h = rng.uniform(1, 12, 2)
        objects.append([x, y, x + w, y + h, int(rng.choice(LABELS))])
    agents = [agent(rng, objects) for _ in range(n_agents)]
    boxes, scores, labels = weighted_boxes_fusion(
        [[[v / SCALE for v in box["corners"]] for box in one] for one in agents],
        [[box["score"] for box in one] for one in agents],
        [[box["label"] for box in one] for one in agents],
        iou_thr=threshold, skip_box_thr=0.0,
    )
    fused = [
        {"corners": [float(v) * SCALE for v in box], "score": float(score), "label": int(label)}
        for box, score, label in zip(boxes, scores, labels)
    ]
    return {"threshold": threshold, "agents": agents, "fused": fused}


def main():
    rng = np.random.default_rng(20260722)
    sizes = [(1, 6), (2, 3), (2, 12), (2, 40), (3, 15), (4, 10)]
    cases = [case(rng, *size, threshold) for size in sizes for threshold in (0.3, 0.5, 0.55)]
    (HERE / "wbf.json").write_text("[\n" + ",\n".join(json.dumps(one) for one in cases) + "\n]\n")


if __name__ == "__main__":
    main()
