"""Runs, sweeps and what they leave on disk."""
import json
import os
import pathlib
import subprocess
import tempfile
import threading
import unittest

import numpy as np

import depthservo as ds

SHORT = {"sensing.source": "geometry", "duration": 2, "expect": None}
SWEEP = """name: short
scenario: unicycle-4dots
set: [sensing.source=geometry, duration=1, expect=null]
axes:
  - {name: guess, key: depth.initial, values: [1, 3, 9]}
worst: 0
"""


class Runs(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.folder = pathlib.Path(self.temporary.name)

    def tearDown(self):
        self.temporary.cleanup()

    def test_a_run_is_that_of_the_tool(self):
        run = ds.run("unicycle-4dots", set=SHORT)
        settings = [word for key, value in SHORT.items() for word in ("--set", f"{key}={json.dumps(value)}")]
        tool = subprocess.run([os.environ["DEPTHSERVO_TOOL"], "run", "unicycle-4dots", "--json", *settings],
                              check=True, capture_output=True, text=True)
        self.assertEqual(run.result, json.loads(tool.stdout))
        self.assertEqual(run.outcome, "timeout")

    def test_a_folder_reads_as_the_run_that_wrote_it(self):
        run = ds.run("unicycle-4dots", set=SHORT, out=self.folder / "run")
        read = ds.read_run(self.folder / "run")
        self.assertEqual(set(read.features), set(run.features))
        for column, values in run.features.items():
            np.testing.assert_array_equal(read.features[column], values, column)
        np.testing.assert_array_equal(read.frames["error_px"], run.frames["error_px"])
        self.assertEqual(read.info["outcome"], run.outcome)

    def test_other_threads_go_on_during_a_run(self):
        thread = threading.Thread(target=ds.run, args=("unicycle-4dots", {**SHORT, "duration": 20}))
        thread.start()
        turns = 0
        while thread.is_alive():
            turns += 1
        self.assertGreater(turns, 1000)

    def test_images_are_not_copied(self):
        ds.record("unicycle-4dots", self.folder / "images", {"duration": 0.1, "expect": None})
        sequence = ds.read_sequence(self.folder / "images")
        image = sequence.image(0)
        self.assertEqual((image.shape, image.dtype), ((480, 640), np.uint8))
        self.assertFalse(image.flags.owndata)
        self.assertGreater(image.std(), 2)

    def test_a_comparison_has_errors_and_limits(self):
        compared = ds.compare("unicycle-4dots", ["filter", "constant"], SHORT)
        self.assertEqual(list(compared["estimators"]), ["filter", "constant"])
        errors = compared["estimators"]["filter"]["error"]
        self.assertEqual(len(errors), len(compared["time"]))
        self.assertTrue(compared["limits"])

    def test_a_sweep_is_read_while_and_after(self):
        (self.folder / "short.yaml").write_text(SWEEP)
        results = ds.sweep(self.folder / "short.yaml", self.folder / "out", jobs=1)
        self.assertEqual(list(results.columns["guess"]), [1, 3, 9])
        tool = (self.folder / "out" / "runs.csv").read_text().splitlines()
        self.assertEqual(tool[0].split(","), list(results.columns))
        self.assertEqual(ds.read_sweep(self.folder / "out").info, results.info)

    def test_shipped_scenarios_are_found(self):
        self.assertIn("unicycle-4dots", ds.shipped_scenarios())
        self.assertIn("deluca2008/arm", ds.shipped_scenarios())


if __name__ == "__main__":
    unittest.main()
