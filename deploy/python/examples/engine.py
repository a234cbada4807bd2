"""Your detector and the engine in one process: NumPy arrays in, NumPy arrays out. No hub, no network.

python3 engine.py: two cameras see a car that drives east at 10 m/s; the second one's frames are 200 ms late.
"""

import numpy as np

import v2x

SECOND = 1_000_000_000
start = 1_795_314_000 * SECOND  # in a live program: time.time_ns()
errors = np.random.default_rng(7)

engine = v2x.Engine({"delta_max_ms": 500})
arrivals = []
for frame in range(40):
    for camera, sigma, delay in (("north", 0.3, 0.04), ("south", 0.5, 0.2)):
        captured_at = start + frame * SECOND // 20
        x = 10.0 * frame / 20 + errors.normal(0, sigma)
        y = 5.0 + errors.normal(0, sigma)
        car = v2x.detections(class_="car", x=[x], y=y, sigma_x=sigma, sigma_y=sigma)
        arrivals.append((captured_at + v2x.nanoseconds(delay), camera, captured_at, car))

for now, camera, captured_at, car in sorted(arrivals, key=lambda arrival: arrival[0]):
    handled = engine.handle(car, now, agent=camera, captured_at=captured_at)
    if not handled:
        print(f"refused: {handled.message}")

for one in engine.objects(now):
    truth = 10.0 * (now - start) / SECOND
    sigma = np.sqrt(one["covariance"][0, 0])
    print(f"{v2x.CLASSES[one['class']]}: x {one['x']:.2f} m (σ {sigma:.2f}, truth {truth:.2f}), vx {one['vx']:.1f} m/s")
