"""Makes score_a_method.ipynb: writes its cells, executes them, and keeps what they print.

Needs `pip install nbclient ipykernel`, and `v2x`.
"""

import pathlib

import nbformat
from nbclient import NotebookClient

NOTEBOOK = pathlib.Path(__file__).with_name("score_a_method.ipynb")

CELLS = [
    ("markdown", """# Score a method of your own

The paper's protocol: two agents report each keyframe of a scene, with errors drawn from keyed seeds. The detections and the
scores are those of `lab export` and `lab tables`, to the last bit; no files are needed between."""),
    ("code", """import numpy as np
import v2x
from v2x import lab

scenes = lab.scenes(quick=True)[::6]       # 2 of the 150 synthetic ones; "csv:FILE" and "nuscenes:FOLDER" are there, too
study = lab.Study(scenes, noise="N1-N3", trials=2, seed=1)
keyframe = study.observe(scene=0, trial=0)[0]
for report in keyframe.reports:
    nearest = np.hypot(report.detections["x"] - report.pose[0], report.detections["y"] - report.pose[1]).argmin()
    one = report.detections[nearest]
    print(f"{len(report)} detections; the nearest is a {v2x.CLASSES[one['class']]} "
          f"at ({one['x']:.1f}, {one['y']:.1f}) m, σ {one['sigma_x']:.2f} m")"""),
    ("markdown", """## A method

A method is a function of a keyframe: two reports in, boxes out. This one pairs the nearest detections of a class, and weights
each pair by the stated accuracies. `det_ids` says which detections a box was made of: the tables score it by them."""),
    ("code", """def weighted(keyframe, gate_m=9.0):
    one, two = (report.detections for report in keyframe.reports)
    far = np.hypot(one["x"][:, None] - two["x"], one["y"][:, None] - two["y"])
    far[one["class"][:, None] != two["class"]] = np.inf
    boxes = lab.boxes_of(keyframe.reports[0])
    alone = np.ones(len(two), bool)
    for i, j in zip(*np.unravel_index(far.argsort(axis=None), far.shape)):
        if far[i, j] > gate_m:
            break
        if alone[j] and boxes["det_ids"][i, 1] == -1:
            alone[j] = False
            boxes["det_ids"][i, 1] = keyframe.reports[1].det_ids[j]
            for name, sigma in [("x", "sigma_x"), ("y", "sigma_y"), ("w", "sigma_w"), ("d", "sigma_d")]:
                a, b = one[sigma][i] ** -2, two[sigma][j] ** -2
                boxes[name][i] = (a * one[name][i] + b * two[name][j]) / (a + b)
                boxes[sigma][i] = (a + b) ** -0.5
    return np.concatenate([boxes, lab.boxes_of(keyframe.reports[1], agent=1)[alone]])"""),
    ("code", """scores = [study.score(weighted), *map(study.score, ["single-1", "dair-v2x", "csba-wls", "unikf-paper", "ours"])]
print(f"{'':12} {'mATE, m':>8} {'mADE, m':>8} {'mAOE, °':>8} {'precision':>10} {'recall':>7}")
for score in scores:
    row = score.row()
    print(f"{score.name:12} {row['mate_m']:8.3f} {row['made_m']:8.3f} {row['maoe_deg']:8.2f} "
          f"{row['precision']:10.3f} {row['recall']:7.3f}")"""),
    ("markdown", """With all of `lab.scenes(quick=True)`, the rows of the tables are those of `lab tables --quick --noise N1-N3`. A method with
memory is made for each scene: `study.score(make=Tracker)`.

## Where it errs

Objects that move and objects that stand are scored apart; so is every divisor of the errors."""),
    ("code", """for subset in ["all", "static", "moving"]:
    print(f"{subset:7}", *[f"{score.name} {score.row(subset=subset)['mate_m']:.3f}" for score in scores[:1] + scores[-1:]])"""),
    ("markdown", """## One keyframe from above

Outlines are true, dots are the detections of both agents, crosses are the method's boxes."""),
    ("code", """from IPython.display import SVG

truth = scenes[0].truth
truth = truth[truth["frame"] == 0]
x0, y0, _ = keyframe.reports[0].pose
near = lambda rows: rows[(abs(rows["x"] - x0) < 30) & (abs(rows["y"] - y0) < 15)]
shapes = [f'<rect x="{-d / 2:.1f}" y="{-w / 2:.1f}" width="{d:.1f}" height="{w:.1f}" fill="none" stroke="black" '
          f'stroke-width=".15" transform="translate({x - x0:.1f} {y0 - y:.1f}) rotate({-np.degrees(yaw):.0f})"/>'
          for x, y, yaw, w, d in near(truth)[["x", "y", "yaw", "w", "d"]]]
for report, colour in zip(keyframe.reports, ["#0072b2", "#d55e00"]):
    shapes += [f'<circle cx="{x - x0:.1f}" cy="{y0 - y:.1f}" r=".4" fill="{colour}"/>'
               for x, y in near(report.detections)[["x", "y"]]]
shapes += [f'<path d="M{x - x0 - .5:.1f} {y0 - y - .5:.1f}l1 1m0-1l-1 1" stroke="black" stroke-width=".2"/>'
           for x, y in near(weighted(keyframe))[["x", "y"]]]
SVG('<svg xmlns="http://www.w3.org/2000/svg" viewBox="-30 -15 60 30" width="720">' + "".join(shapes) + "</svg>")"""),
]  # fmt: skip


def main():
    notebook = nbformat.v4.new_notebook()
    make = {"markdown": nbformat.v4.new_markdown_cell, "code": nbformat.v4.new_code_cell}
    notebook.cells = [make[kind](text) for kind, text in CELLS]
    NotebookClient(notebook, timeout=600, kernel_name="python3").execute()
    for number, cell in enumerate(notebook.cells):
        # The same cells give the same file.
        cell.id, cell.metadata = f"cell-{number}", {}
    notebook.metadata = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}}
    nbformat.write(notebook, NOTEBOOK)


main()
