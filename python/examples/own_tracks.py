#!/usr/bin/python3
"""Depth from your own tracks: points of any tracker and the camera's twists go in, Z with its band comes out.

    own_tracks.py [PICTURE.png]
"""
import sys

import matplotlib.pyplot as plt
import numpy as np

import depthservo as ds

camera = ds.Camera(640, 480, 600, 600, 319.5, 239.5)
rate, images = 30, 150
rng = np.random.default_rng(1)

# What your tracker and your robot would give: pixels of three points, one of them hidden for a second, and twists.
points = np.array([[-0.4, -0.2, 2.0], [0.3, 0.1, 3.0], [0.1, 0.3, 4.5]])
twist = np.array([0.12, 0.02, 0.05, 0.0, 0.03, 0.0])
motion = ds.Motion.from_twist(twist, 1 / rate)
times, tracks, truth = np.arange(images) / rate, [], []
for k in range(images):
    uv = camera.to_pixel(points[:, :2] / points[:, 2:]) + 0.5 * rng.standard_normal((3, 2))
    if 60 <= k < 90:
        uv[1] = np.nan
    tracks.append(uv)
    truth.append(points[:, 2])
    points = points @ motion.R.T + motion.t

# The estimator: first guess 1 m for all, whatever they are.
depths = ds.DepthFilter(3, focal=camera.focal, pixel_noise=0.5, prior=1.0)
z, low, high = (np.empty((images, 3)) for _ in range(3))
for k, uv in enumerate(tracks):
    depths.step(times[k], camera.normalise(uv), twist + [0.002, 0.002, 0.002, 0.001, 0.001, 0.001] * rng.standard_normal(6))
    z[k], low[k], high[k] = depths.z, depths.z_low, depths.z_high

figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
for i, colour in enumerate(("#0072B2", "#D55E00", "#009E73")):
    axes.fill_between(times, low[:, i], np.minimum(high[:, i], 100), color=colour, alpha=0.2, linewidth=0)
    axes.plot(times, z[:, i], color=colour, label=f"point {i}, 2 sigma")
axes.plot(times, np.array(truth), color="black", linestyle="--", linewidth=1, label=["truth", None, None])
axes.axvspan(2, 3, color="grey", alpha=0.15, linewidth=0, label="point 1 hidden")
axes.set(xlabel="time [s]", ylabel="Z [m]", xlim=(0, times[-1]), ylim=(0, 7))
axes.legend(loc="upper right", ncols=2, frameon=False)
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "own_tracks.png", dpi=120)

error = z[-1] / truth[-1] - 1
print(f"error {np.abs(error).max():.1%} at most, claimed {(2 * depths.sigma_z / depths.z).max():.1%} (2 sigma)")
