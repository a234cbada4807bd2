# Your method in the tables, in any language: lab export → this → lab score. Nothing to install.
# python3 own_method.py DETECTIONS FUSED: of agents 1 and 2, the nearest boxes of a class within 5 m are averaged
import csv, itertools, math, pathlib, sys

source, target = map(pathlib.Path, sys.argv[1:])
for path in source.glob("*/trial-*/*.csv"):
    out = target / path.relative_to(source)
    out.parent.mkdir(parents=True, exist_ok=True)
    with path.open() as detections, out.open("w") as fused:
        print("t,track_id,class,x,y,w,d,yaw,det_ids", file=fused)
        for t, frame in itertools.groupby(csv.DictReader(detections), key=lambda row: row["t"]):
            boxes = [row | {key: float(row[key]) for key in ("x", "y", "w", "d", "yaw")} for row in frame]
            far = lambda pair: math.dist(*[(box["x"], box["y"]) for box in pair])
            pairs = [p for p in itertools.combinations(boxes, 2) if p[0]["sensor_id"] != p[1]["sensor_id"]]
            pairs = [p for p in pairs if p[0]["class"] == p[1]["class"] and far(p) < 5]
            left, groups = {box["det_id"]: box for box in boxes}, []
            for a, b in sorted(pairs, key=far):
                if a["det_id"] in left and b["det_id"] in left:
                    groups.append([left.pop(a["det_id"]), left.pop(b["det_id"])])
            for group in groups + [[box] for box in left.values()]:
                mean = [sum(box[key] for box in group) / len(group) for key in ("x", "y", "w", "d")]
                yaw = math.atan2(*[sum(f(box["yaw"]) for box in group) for f in (math.sin, math.cos)])
                ids = ";".join(box["det_id"] for box in group)
                print(t, ids, group[0]["class"], *mean, yaw, ids, sep=",", file=fused)  # no tracks: any name does
