"""Points seen by a camera that moves, by numpy alone: the truth for tests."""
import numpy as np


def general_motion(points=8, images=60, dt=1 / 32, seed=1, noise=0.5 / 600):
    """(xy (images, points, 2), z (images, points), twist (6,)): a constant twist past still points."""
    rng = np.random.default_rng(seed)
    twist = np.array([0.3, -0.1, 0.15, 0.02, -0.05, 0.03])
    p = np.stack([rng.uniform(-0.5, 0.5, points), rng.uniform(-0.4, 0.4, points), np.ones(points)], 1)
    p *= rng.uniform(1.5, 4, points)[:, None]
    steps = 200
    xy, z = [], []
    for _ in range(images):
        xy.append(p[:, :2] / p[:, 2:] + noise * rng.standard_normal((points, 2)))
        z.append(p[:, 2].copy())
        for _ in range(steps):  # dp/dt = -v - w x p, Runge-Kutta of the second order
            h = dt / steps
            middle = p + h / 2 * (-twist[:3] - np.cross(twist[3:], p))
            p = p + h * (-twist[:3] - np.cross(twist[3:], middle))
    return np.array(xy), np.array(z), twist
