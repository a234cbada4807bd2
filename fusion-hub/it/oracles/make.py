"""Makes the fixtures beside it from independent implementations: scipy, shapely, Stone Soup, filterpy.

pip install numpy==2.4.6 scipy==1.17.1 shapely==2.2.0 stonesoup==1.9.1 filterpy==2.0.0
python make.py
"""

import datetime
import json
import pathlib

import numpy as np
import shapely
from filterpy.kalman import KalmanFilter
from scipy.optimize import linear_sum_assignment, minimize_scalar
from shapely.affinity import rotate, translate
from stonesoup.models.measurement.linear import LinearGaussian
from stonesoup.types.detection import GaussianDetection
from stonesoup.types.hypothesis import SingleHypothesis
from stonesoup.types.prediction import GaussianStatePrediction
from stonesoup.updater.chernoff import ChernoffUpdater

HERE = pathlib.Path(__file__).resolve().parent


def write(name, cases):
    lines = ",\n".join(json.dumps(case) for case in cases)
    (HERE / f"{name}.json").write_text(f"[\n{lines}\n]\n")


def covariance(rng, low, high):
    sx, sy = rng.uniform(low, high, 2)
    rho = rng.uniform(-0.95, 0.95)
    return np.array([[sx * sx, rho * sx * sy], [rho * sx * sy, sy * sy]])


def upper(matrix):
    """A symmetric matrix as its upper triangle, by rows."""
    return [float(matrix[i, j]) for i in range(len(matrix)) for j in range(i, len(matrix))]


def assignments(rng):
    """Sparse costs; a row may stay alone. The optimum is that of the dense matrix with a lone column for each row."""
    for n_rows, n_cols, density in [(3, 3, 1), (5, 2, 0.7), (8, 12, 0.5), (20, 20, 0.3), (40, 30, 0.15), (60, 80, 0.1),
                                    (100, 100, 0.03), (30, 30, 1), (50, 5, 1)]:
        alone = round(rng.uniform(2, 12), 3)
        candidates = [
            [row, col, round(rng.uniform(-1, 10), 2)]
            for row in range(n_rows) for col in range(n_cols) if rng.uniform() < density
        ]
        dense = np.full((n_rows, n_cols + n_rows), 1e6)
        for row in range(n_rows):
            dense[row, n_cols + row] = alone
        for row, col, cost in candidates:
            dense[row, col] = cost
        optimum = float(dense[linear_sum_assignment(dense)].sum())
        yield {"rows": n_rows, "cols": n_cols, "alone": alone, "candidates": candidates, "optimum": optimum}


def box(x, y, w, d, yaw):
    polygon = shapely.box(-d / 2, -w / 2, d / 2, w / 2)
    return translate(rotate(polygon, yaw, origin=(0, 0), use_radians=True), x, y)


def overlaps(rng):
    pairs = []
    for _ in range(150):
        a = [*rng.uniform(-50, 50, 2), *rng.uniform(0.4, 12, 2), rng.uniform(-np.pi, np.pi)]
        pairs.append((a, [*(np.array(a[:2]) + rng.normal(0, 3, 2)), *rng.uniform(0.4, 12, 2), rng.uniform(-np.pi, np.pi)]))
    for _ in range(20):  # nearly the same box, as of two sensors
        a = [*rng.uniform(-50, 50, 2), 1.8, 4.5, rng.uniform(-np.pi, np.pi)]
        pairs.append((a, [a[0] + rng.normal(0, 0.2), a[1] + rng.normal(0, 0.2), 1.7, 4.7, a[4] + rng.normal(0, 0.05)]))
    for turn in [0, np.pi / 2, np.pi, 1e-9, 0.3, np.pi / 4]:
        a = [3.0, -2.0, 2.0, 4.0, 0.0]
        pairs.append((a, [3.0, -2.0, 2.0, 4.0, turn]))  # identical, or turned about the centre
        pairs.append((a, [3.2, -1.9, 0.5, 0.6, turn]))  # contained
        pairs.append((a, [7.0, -2.0, 2.0, 4.0, turn]))  # touching along an edge, where not turned
        pairs.append((a, [7.0, 0.0, 2.0, 4.0, turn]))  # touching at a corner
        pairs.append((a, [5.0, -2.0, 2.0, 4.0, turn]))  # half
    for _ in range(20):  # thin as a line
        pairs.append(([0.0, 0.0, 1e-6, 10.0, rng.uniform(-3, 3)], [*rng.normal(0, 1, 2), 1e-3, 8.0, rng.uniform(-3, 3)]))
        pairs.append(([0.0, 0.0, 1e-3, 10.0, rng.uniform(-3, 3)], [*rng.normal(0, 1, 2), 2.0, 5.0, rng.uniform(-3, 3)]))
    for _ in range(20):  # far
        a = [*rng.uniform(-1e4, 1e4, 2), *rng.uniform(0.4, 12, 2), rng.uniform(-3, 3)]
        pairs.append((a, [*rng.uniform(-1e4, 1e4, 2), *rng.uniform(0.4, 12, 2), rng.uniform(-3, 3)]))
    for a, b in pairs:
        a, b = ([round(float(value), 7) for value in bev] for bev in (a, b))
        # Relative to the first box, where shapely loses nothing to large coordinates.
        one, other = box(0, 0, *a[2:]), box(b[0] - a[0], b[1] - a[1], *b[2:])
        intersection = one.intersection(other).area
        union = a[2] * a[3] + b[2] * b[3] - intersection
        hull = shapely.MultiPoint([*one.exterior.coords, *other.exterior.coords]).convex_hull.area
        yield {
            "a": a, "b": b, "iou": intersection / union, "giou": intersection / union - (hull - union) / hull,
        }


def intersections(rng):
    """Covariance intersection at the weight of least determinant, found by search, fused by Stone Soup."""
    for _ in range(40):
        a, b = covariance(rng, 0.1, 3), covariance(rng, 0.1, 3)
        za, zb = rng.normal(0, 3, 2), rng.normal(0, 3, 2)

        def determinant(omega):
            return 1 / np.linalg.det(omega * np.linalg.inv(a) + (1 - omega) * np.linalg.inv(b))

        found = minimize_scalar(determinant, bounds=(0, 1), method="bounded", options={"xatol": 1e-12})
        omega = min([found.x, 0.0, 1.0], key=determinant)
        fused = None
        if 1e-3 < omega < 1 - 1e-3:
            now = datetime.datetime(2020, 1, 1)
            model = LinearGaussian(2, (0, 1), np.zeros((2, 2)))
            report = GaussianDetection(zb, covar=b, timestamp=now, measurement_model=model)
            prior = GaussianStatePrediction(za, covar=a, timestamp=now)
            # Stone Soup weighs the report with omega.
            posterior = ChernoffUpdater(measurement_model=model, omega=1 - omega).update(SingleHypothesis(prior, report))
            fused = {"mean": [float(v) for v in posterior.mean.ravel()], "covariance": upper(posterior.covar)}
        yield {"a": upper(a), "b": upper(b), "za": za.tolist(), "zb": zb.tolist(), "omega": float(omega),
               "determinant": float(determinant(omega)), "fused": fused}


def kalman(rng):
    """A constant-velocity filter over irregular steps, with the integral of white acceleration as noise."""
    psd, sigma_velocity = 1.5, 7.0
    r0, z0 = covariance(rng, 0.3, 1.5), rng.normal(0, 10, 2)
    filter = KalmanFilter(dim_x=4, dim_z=2)
    filter.x = np.array([*z0, 0.0, 0.0])
    filter.P = np.block([[r0, np.zeros((2, 2))], [np.zeros((2, 2)), sigma_velocity**2 * np.eye(2)]])
    steps = []
    for step in range(24):
        dt = float(rng.choice([0.0, 0.01, 0.05, 0.1, 0.1, 0.35, 1.2]))
        is_velocity = step in (7, 15)
        z = filter.x[2:] + rng.normal(0, 1, 2) if is_velocity else filter.x[:2] + rng.normal(0, 1, 2)
        r = covariance(rng, 0.1, 2)
        f = np.eye(4)
        f[0, 2] = f[1, 3] = dt
        q = psd * np.kron([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]], np.eye(2))
        filter.predict(F=f, Q=q)
        h = np.eye(4)[2:] if is_velocity else np.eye(4)[:2]
        filter.update(z, R=r, H=h)
        steps.append({"dt": dt, "velocity": is_velocity, "z": z.tolist(), "r": upper(r),
                      "mean": filter.x.tolist(), "covariance": upper(filter.P)})
    yield {"accel_psd": psd, "sigma_velocity": sigma_velocity, "z0": z0.tolist(), "r0": upper(r0), "steps": steps}


def main():
    for name, cases in [("assignment", assignments), ("overlap", overlaps), ("intersection", intersections),
                        ("kalman", kalman)]:
        write(name, cases(np.random.default_rng(20260722)))


if __name__ == "__main__":
    main()
