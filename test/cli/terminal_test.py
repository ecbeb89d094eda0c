"""What needs somebody at a terminal: the questions of `depthservo new`, completion in a real zsh.

    terminal_test.py TOOL FOLDER      FOLDER: has `zsh`, what the tool describes of itself
"""
import os
import pathlib
import pty
import re
import select
import shutil
import sys
import tempfile
import time
import unittest

TOOL, DESCRIBED = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2])


class Terminal:
    """A program that believes to be before a person."""

    def __init__(self, command, folder, **environment):
        self.text = ""
        self.pid, self.end = pty.fork()
        if self.pid == 0:
            os.chdir(folder)
            os.execvpe(command[0], [str(part) for part in command], {**os.environ, "TERM": "xterm", **environment})

    def expect(self, pattern, within_s=60):
        """Reads until the pattern is there, and returns what came up to it."""
        until = time.monotonic() + within_s
        while not (match := re.search(pattern, self.text)):
            left = until - time.monotonic()
            assert left > 0 and select.select([self.end], [], [], left)[0], f"no {pattern!r} in {self.text!r}"
            try:
                self.text += os.read(self.end, 4096).decode(errors="replace")
                self.text = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]|[\x00\r]", "", self.text)  # cursor and colours
            except OSError:  # it has ended
                assert re.search(pattern, self.text), f"no {pattern!r} in {self.text!r}"
        read, self.text = self.text[:match.end()], self.text[match.end():]
        return read

    def type(self, text):
        os.write(self.end, text.encode())

    def exit_code(self):
        code = os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])
        os.close(self.end)
        return code


class Person(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)

    def answered(self, *answers):
        terminal = Terminal([TOOL, "new", "mine.yaml"], self.folder)
        for question, answer in zip(("unicycle, omni, free", "dots, apriltag", "1.5 to 6 m"), answers):
            terminal.expect(question + r"\? \[\w+\] ")
            terminal.type(answer + "\n")
        terminal.expect(r"written: mine\.yaml|expected [^\n]*\n")
        code = terminal.exit_code()
        file = self.folder / "mine.yaml"
        return code, file.read_text() if file.exists() else None

    def test_new_takes_the_answers(self):
        code, text = self.answered("omni", "apriltag", "2")
        self.assertEqual(code, 0)
        for line in ("name: omni-apriltag", "  type: omni", "  tracker: apriltag", "initial: {x: -2, "):
            self.assertIn(line, text)

    def test_new_takes_its_defaults_for_an_empty_line(self):
        code, text = self.answered("", "", "")
        self.assertEqual(code, 0)
        for line in ("name: unicycle-dots", "initial: {x: -3, "):
            self.assertIn(line, text)

    def test_new_refuses_an_answer_and_writes_nothing(self):
        self.assertEqual(self.answered("omni", "dots", "60"), (2, None))

    @unittest.skipUnless(shutil.which("zsh"), "needs zsh")
    def test_zsh_completes(self):
        (self.folder / "functions").mkdir()
        shutil.copy(DESCRIBED / "zsh", self.folder / "functions" / "_depthservo")
        (self.folder / ".zshrc").write_text("PS1='ready> '\nfpath=($HOME/functions $fpath)\n"
                                            "autoload -Uz compinit\ncompinit -u -D\nsetopt no_beep\n")
        terminal = Terminal(["zsh", "-d", "-i"], self.folder, PATH=f"{TOOL.parent}:{os.environ['PATH']}",
                            HOME=str(self.folder), ZDOTDIR=str(self.folder))
        terminal.expect("ready> ")
        terminal.type("depthservo gai\t")
        terminal.expect("gains")
        terminal.type(" --la\t")
        terminal.expect("--law")
        terminal.type(" obs\t")
        terminal.expect("observer")
        terminal.type("\x15depthservo rep\t\t")  # three of them
        terminal.expect(r"(?s)replay\s+report\s+reproduce")
        terminal.type("\x15exit\n")
        self.assertEqual(terminal.exit_code(), 0)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
