"""100 000 filter updates from numpy against the same by InverseDepthFilterBatch in a C++ program."""
import os
import pathlib
import subprocess
import tempfile
import time
import unittest

import numpy as np

import depthservo as ds
from tracks import general_motion

IMAGES, POINTS = 101, 1000


class Speed(unittest.TestCase):
    def test_updates_take_at_most_one_and_a_half_times_those_of_cpp(self):
        xy, _, twist = general_motion(points=POINTS, images=IMAGES)
        times = [k / 32 for k in range(IMAGES)]
        python, cpp = [], []
        with tempfile.TemporaryDirectory() as folder:
            given, found = pathlib.Path(folder, "in"), pathlib.Path(folder, "out")
            np.concatenate([[IMAGES, POINTS, 1 / 32, 0.5 / 600], twist, xy.ravel()]).tofile(given)
            for _ in range(5):  # in turn: both meet the same machine
                reference = subprocess.run([os.environ["DEPTHSERVO_REFERENCE"], given, found], check=True,
                                           capture_output=True, text=True)
                cpp.append(float(reference.stdout))
                for _ in range(25):
                    depths = ds.DepthFilter(POINTS)
                    depths.step(times[0], xy[0])
                    start = time.perf_counter()
                    for k in range(1, IMAGES):
                        depths.step(times[k], xy[k], twist)
                    python.append(time.perf_counter() - start)
            z = np.fromfile(found)[:POINTS]
        updates = (IMAGES - 1) * POINTS
        print(f"C++ {min(cpp) / updates * 1e9:.1f} ns an update, from numpy {min(python) / updates * 1e9:.1f} ns: "
              f"{min(python) / min(cpp):.2f} times")
        np.testing.assert_allclose(depths.z, z, rtol=1e-12)
        self.assertLess(min(python), 1.5 * min(cpp))


if __name__ == "__main__":
    unittest.main()
