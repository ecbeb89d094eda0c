#!/usr/bin/python3
"""Estimators on the same measurements, beside the Cramer-Rao bound.

    compare_estimators.py [PICTURE.png]
"""
import sys

import matplotlib.pyplot as plt
import numpy as np

import depthservo as ds

compared = ds.compare("unicycle-4dots", ["constant", "two-frame", "nonlinear", "filter", "joint"],
                      {"sensing.source": "geometry", "duration": 8, "depth.initial": 6, "expect": None})

figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
colours = ("#999999", "#E69F00", "#009E73", "#0072B2", "#D55E00")
for (name, curves), colour in zip(compared["estimators"].items(), colours):
    axes.semilogy(compared["time"], 100 * curves["error"], color=colour, label=name)
for (name, curves), style in zip(compared["limits"].items(), ("--", ":")):
    axes.semilogy(compared["time"], 100 * curves["error"], color="black", linestyle=style, label=name)
axes.set(xlabel="time [s]", ylabel="error of Z, rms over the points [%]", ylim=(0.01, 300),
         xlim=(0, compared["time"][-1]))
axes.set_yticks([0.01, 0.1, 1, 10, 100], ["0.01", "0.1", "1", "10", "100"])
axes.legend(ncols=2, frameon=False)
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "compare_estimators.png", dpi=120)

print(compared["verdict"])
for name, curves in compared["estimators"].items():
    print(f"{name:10} {curves['error'][-1]:8.2%} at the end, {curves['coverage_2sigma']:.0%} within 2 sigma")
