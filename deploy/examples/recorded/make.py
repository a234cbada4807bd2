"""Writes junction.csv: 40 s of traffic at a junction of three arms, as a tracker over a camera could record it.

Usage: python3 make.py > junction.csv
"""

import math

STEP_S = 0.2


def line(x0, y0, x1, y1, start_s, speed_mps):
    """From one point to another at constant speed; yields t, x, y, yaw."""
    length, yaw = math.hypot(x1 - x0, y1 - y0), math.atan2(y1 - y0, x1 - x0)
    for k in range(int(length / speed_mps / STEP_S) + 1):
        share = k * STEP_S * speed_mps / length
        yield start_s + k * STEP_S, x0 + share * (x1 - x0), y0 + share * (y1 - y0), yaw


def turn(start_s, speed_mps):
    """Out of the side road, and right to the east."""
    radius, (cx, cy) = 8.0, (9.75, -9.75)
    rows = list(line(1.75, -80, 1.75, cy, start_s, speed_mps))
    t = rows[-1][0]
    for k in range(1, int(radius * math.pi / 2 / speed_mps / STEP_S) + 1):
        angle = math.pi - k * STEP_S * speed_mps / radius
        rows.append((t + k * STEP_S, cx + radius * math.cos(angle), cy + radius * math.sin(angle), angle - math.pi / 2))
    t, x, y, _ = rows[-1]
    return rows + list(line(x, y, 100, -1.75, t + STEP_S, speed_mps))


def stand(x, y, yaw):
    """There all the time."""
    return [(0.0, x, y, yaw), *[(float(t), x, y, yaw) for t in range(1, 41)]]


OBJECTS = {
    "veh1": ("car", 1.8, 4.5, line(-100, -1.75, 100, -1.75, 0, 11)),
    "veh2": ("car", 1.8, 4.2, line(-100, -1.75, 100, -1.75, 4, 11.5)),
    "veh3": ("car", 1.9, 4.8, line(100, 1.75, -100, 1.75, 2, 12)),
    "veh4": ("truck", 2.5, 8.0, line(100, 1.75, -100, 1.75, 7, 9)),
    "veh5": ("car", 1.8, 4.4, turn(5, 6)),
    "veh6": ("car", 1.8, 4.5, line(-100, -1.75, 100, -1.75, 17, 10)),
    "veh7": ("bus", 2.55, 12.0, line(100, 1.75, -100, 1.75, 20, 10)),
    "bike1": ("bicycle", 0.6, 1.8, line(-70, -4.2, 70, -4.2, 6, 4.5)),
    "ped1": ("pedestrian", 0.6, 0.6, line(-9, 8, -9, -8, 10, 1.4)),
    "ped2": ("pedestrian", 0.6, 0.6, line(30, 6.5, -10, 6.5, 3, 1.2)),
    "parked1": ("car", 1.8, 4.3, stand(-30, 5.2, math.pi)),
    "parked2": ("van", 2.0, 5.4, stand(42, -5.4, 0.0)),
}

rows = [
    (t, name, kind, x, y, yaw, w, d)
    for name, (kind, w, d, way) in OBJECTS.items()
    for t, x, y, yaw in way
    if t <= 40
]
print("t,id,class,x,y,yaw,w,d")
for t, name, kind, x, y, yaw, w, d in sorted(rows):
    print(f"{t:.1f},{name},{kind},{x:.2f},{y:.2f},{yaw:.4f},{w},{d}")
