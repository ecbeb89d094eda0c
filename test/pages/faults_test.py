"""What pages.py must not let pass, page by page."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

PROGRAM = pathlib.Path(__file__).with_name("pages.py")


def said_of(text):
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        for name in ("doc/images", "test", "data"):
            (root / name).mkdir(parents=True)
        (root / "README.md").write_text(text)
        done = subprocess.run([sys.executable, "-B", PROGRAM, root], capture_output=True, text=True)
        return done.returncode, done.stdout + done.stderr


class Faults(unittest.TestCase):
    def passes(self, text):
        code, said = said_of(text)
        self.assertEqual(code, 0, said)

    def fails(self, text, words):
        code, said = said_of(text)
        self.assertEqual(code, 1, said)
        self.assertIn(words, said)

    def test_commands(self):
        self.passes("```sh\ntrue\n```\n")
        self.fails("a\n```sh\nfalse\n```\n", "README.md:2: false")
        self.passes("<!-- not run: needs a robot -->\n```sh\nfalse\n```\n")
        self.fails("<!-- not run: needs a robot -->\nA word.\n```sh\nfalse\n```\n", "exit code 1")
        self.passes("<!-- not run: needs a robot: /fal/ -->\n```sh\ntrue\nfalse\n```\n")
        self.fails("<!-- not run: needs a robot: /fool/ -->\n```sh\ntrue\n```\n", "no command is like /fool/")
        self.passes("<!-- long: /fal/ -->\n```sh\nfalse\n```\n")
        self.passes("<!-- first: echo a > file -->\n```sh\ncat file\n```\n")

    def test_what_is_printed(self):
        self.passes("```console\n$ printf 'one 1\\ntwo'\none ...\n```\n")
        self.fails("```console\n$ echo one\ntwo\n```\n", "does not print: two")

    def test_languages(self):
        self.fails("```\nfalse\n```\n", "language")
        self.fails("```bash\nfalse\n```\n", "language")
        self.passes("```text\nfalse\n```\n")
        self.fails("```cpp\nint x;\n```\n", "is compiled by no test")
        self.fails("```yaml\na: b\n```\n", "is read by nothing")
        self.passes("<!-- read by: grep b {} -->\n```yaml\na: b\n```\n")
        self.fails("<!-- read by: grep c {} -->\n```yaml\na: b\n```\n", "grep c")
        self.fails("<!-- run by: Suite.test -->\n```sh\ntrue\n```\n", "no test Suite.test")

    def test_links(self):
        self.passes("# A head: b\n[x](#a-head-b) [y](README.md#a-head-b) [z](https://nowhere) `[q](none)`\n")
        self.fails("[x](none.md)\n", "there is no such file")
        self.fails("[x](#none)\n", "no such heading")


if __name__ == "__main__":
    unittest.main()
