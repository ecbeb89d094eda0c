"""Bad input raises ValueError that says what was expected."""
import tempfile
import unittest

import numpy as np

import depthservo as ds


class BadInput(unittest.TestCase):
    def refused(self, words, call, *arguments, **options):
        with self.assertRaises(ValueError) as caught:
            call(*arguments, **options)
        for word in words:
            self.assertIn(word, str(caught.exception))
        self.assertNotIn("\n", str(caught.exception))

    def test_shapes(self):
        depths = ds.DepthFilter(4)
        self.refused(["xy", "(4, 2)", "(3, 2)"], depths.step, 0, np.zeros((3, 2)))
        self.refused(["twist", "(6,)"], ds.Motion.from_twist, np.zeros(5), 0.1)
        self.refused(["points", "(n, 3)"], ds.flow, ds.Motion(), np.zeros(3))
        self.refused(["twists", "(2, 6)"], depths.push_twists, [0, 1], np.zeros((3, 6)))

    def test_times(self):
        depths = ds.DepthFilter(1)
        depths.step(1, [[0, 0]])
        self.refused(["not later"], depths.step, 1, [[0, 0]])
        self.refused(["finite"], depths.step, np.nan, [[0, 0]])
        self.refused(["row 1"], ds.DepthFilter(1).push_twists, [1, 1], np.zeros((2, 6)))
        self.refused(["image 1"], ds.DepthFilter(1).observe, [0, 0], np.zeros((2, 1, 2)), [0], np.zeros((1, 6)))

    def test_not_finite(self):
        depths = ds.DepthFilter(1)
        depths.step(0, [[0, 0]])
        self.refused(["twist", "finite"], depths.step, 1, [[0, 0]], np.full(6, np.nan))
        self.refused(["z", "> 0"], ds.interaction_matrix, [[0, 0]], [-1])

    def test_words(self):
        self.refused(["estimator", "'filter'"], ds.DepthFilter, 1, estimator="filtr")
        self.refused(["errors", "typical"], ds.DepthFilter, 1, errors="typcal")
        self.refused(["needs more than points"], ds.DepthFilter, 1, estimator="pose")
        self.refused(["above 0"], ds.DepthFilter, 1, prior=-1)

    def test_files_have_the_text_of_the_tool(self):
        with tempfile.TemporaryDirectory() as folder:
            self.refused([folder], ds.read_sequence, folder)
            self.refused([folder, "run.json"], ds.read_run, folder)
        self.refused(["unicycle-4dot", "did you mean 'unicycle-4dots'"], ds.run, "unicycle-4dot")
        self.refused(["depth.inital", "initial"], ds.run, "unicycle-4dots", {"depth.inital": 3})
        self.assertTrue(issubclass(ds.InputError, ValueError))

    def test_points(self):
        with self.assertRaises(IndexError):
            ds.DepthFilter(2).set_prior(2, 1.0)
        self.refused(["at least one"], ds.DepthFilter, 0)


if __name__ == "__main__":
    unittest.main()
