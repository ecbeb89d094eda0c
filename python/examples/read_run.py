#!/usr/bin/python3
"""A run folder into pandas: which depths were how good, and when.

    read_run.py [RUN_DIR [PICTURE.png]]      without a folder: makes a run first
"""
import sys
import tempfile

import matplotlib.pyplot as plt

import depthservo as ds

if len(sys.argv) > 1:
    folder = sys.argv[1]
else:
    folder = tempfile.mkdtemp() + "/run"
    ds.run("unicycle-4dots", {"sensing.source": "geometry", "duration": 10, "expect": None}, out=folder)

run = ds.read_run(folder)
table = run.to_pandas()
table["error"] = (table.Z / table.Z_true - 1).abs()
table["within"] = (1 / table.Z - 1 / table.Z_true).abs() < 2 * table.sigma_Z / table.Z**2

print(f"{run.info['name']}: {run.info.get('outcome', 'a replay')}")
print(table.groupby("id").agg(images=("measured", "size"), hidden=("measured", lambda m: (~m).sum()),
                              worst=("error", "max"), last=("error", "last"), within=("within", "mean")).round(4))
print(table.status.value_counts().to_string())

figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
errors = 100 * table.error.unstack("id")
errors.plot(ax=axes, logy=True, color=["#0072B2", "#D55E00", "#009E73", "#CC79A7"])
axes.set(xlabel="time [s]", ylabel="error of Z [%]", ylim=(0.01, 300), xlim=(0, errors.index[-1]))
axes.set_yticks([0.01, 0.1, 1, 10, 100], ["0.01", "0.1", "1", "10", "100"])
axes.legend(title="point", frameon=False)
figure.savefig(sys.argv[2] if len(sys.argv) > 2 else "read_run.png", dpi=120)
