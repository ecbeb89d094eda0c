"""Every example runs and draws what it says."""
import contextlib
import importlib.util
import io
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

EXAMPLES = pathlib.Path(os.environ["DEPTHSERVO_EXAMPLES"])
if any(importlib.util.find_spec(module) is None for module in ("matplotlib", "pandas")):
    print("skipped: needs python3-matplotlib and python3-pandas")
    sys.exit(77)


class Examples(unittest.TestCase):
    def words_of(self, name):
        with tempfile.TemporaryDirectory() as folder:
            done = subprocess.run([sys.executable, EXAMPLES / f"{name}.py"], cwd=folder, capture_output=True, text=True)
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            picture = pathlib.Path(folder, f"{name}.png").read_bytes()
            self.assertEqual(picture[:4], b"\x89PNG")
            self.assertGreater(len(picture), 10000)
            return done.stdout

    def test_code_of_the_guide(self):
        guide = (EXAMPLES.parent.parent / "doc" / "python.md").read_text()
        blocks = re.findall(r"```python\n(.*?)```", guide, re.DOTALL)
        self.assertEqual(len(blocks), 2)
        for block in blocks:
            known = {}
            with contextlib.redirect_stdout(io.StringIO()):
                exec(block, known)
            if "depths" in known:
                for z, expected in zip(known["depths"].z, (2, 4)):
                    self.assertAlmostEqual(z / expected, 1, delta=0.05)
            else:
                self.assertLess(known["worst"], 0.02)

    def test_all_are_tested(self):
        self.assertEqual({file.stem for file in EXAMPLES.glob("*.py")},
                         {"own_tracks", "compare_estimators", "read_run"})

    def test_own_tracks(self):
        words = self.words_of("own_tracks")
        error, claimed = (float(word.rstrip("%")) for word in words.split() if "%" in word)
        self.assertLess(error, 2 * claimed)
        self.assertLess(claimed, 10)

    def test_compare_estimators(self):
        words = self.words_of("compare_estimators")
        ends = {line.split()[0]: float(line.split()[1].rstrip("%")) for line in words.splitlines()[1:]}
        self.assertLess(ends["filter"], 1)
        self.assertGreater(ends["constant"], 20)

    def test_read_run(self):
        words = self.words_of("read_run")
        self.assertIn("unicycle-4dots: timeout", words)
        self.assertIn("valid", words)


if __name__ == "__main__":
    unittest.main()
