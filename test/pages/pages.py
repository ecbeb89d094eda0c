"""Every code block of README and doc is run, compiled or read, and every link leads somewhere.

    pages.py ROOT --tool DEPTHSERVO [--python FOLDER] [--long]
    pages.py ROOT --links               the links alone: of an installed tree

A block is of a language, and on its way by it:

    sh        each command is run, in a temporary folder of its page with `data` in it; exit code 0
    console   the same for lines after `$ `; the other lines must be printed; ... stands for anything
    python    run with the package in FOLDER (skipped without one)
    cpp       compiled, by the test program that includes <page>_md/<number>.inc (cmake/ExtractCode.cmake)
    yaml      read, by a command in a comment before the block
    text, {...}, cmake  nothing to run

What the page does not show stands before a block in comments, which no reader sees:

    <!-- not run: REASON -->                none of the block
    <!-- not run: REASON: /PATTERN/ -->     commands that match
    <!-- long: /PATTERN/ -->                commands that match, only with --long
    <!-- run by: SUITE.TEST -->             another test does
    <!-- first: COMMAND -->                 what the block takes for granted
    <!-- read by: COMMAND -->               of a yaml block: {} is a file with it
"""
import argparse
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time

COMMENT = re.compile(r"<!-- (not run|long|run by|first|read by): (.*?) -->$")
LANGUAGES = {"sh", "console", "python", "cpp", "yaml", "text", "cmake"}


class Block:
    def __init__(self, page, line, language, code, comments):
        self.page, self.line, self.language, self.code, self.comments = page, line, language, code, comments

    def said(self, kind):
        return [text for name, text in self.comments if name == kind]

    def patterns(self, kind):
        return [re.search(r"/(.*)/$", text).group(1) for text in self.said(kind) if re.search(r"/(.*)/$", text)]

    def isLeftOut(self):
        return any(not re.search(r"/(.*)/$", text) for text in self.said("not run"))


def blocks_of(page):
    """The blocks of a page with the comments before each."""
    blocks, comments, current = [], [], None
    for number, line in enumerate(page.read_text().splitlines(), 1):
        if current is not None:
            if line.strip() == "```":
                blocks.append(current)
                current = None
            else:
                current.code += line + "\n"
        elif line.lstrip().startswith("```"):
            current = Block(page, number, line.strip()[3:], "", comments)
            comments = []
        elif match := COMMENT.match(line.strip()):
            comments.append(match.groups())
        elif line.strip():
            comments = []
    return blocks


def commands_of(block):
    """Commands with the lines that the page shows of what they print."""
    commands = []
    if block.language == "console":
        for line in block.code.splitlines():
            if line.startswith("$ "):
                commands.append((line[2:], []))
            elif commands:
                commands[-1][1].append(line)
    else:
        for line in block.code.replace("\\\n", " ").splitlines():
            if line.strip() and not line.startswith("#"):
                commands.append((line, []))
    return commands


class Runner:
    def __init__(self, root, tool, python, is_long):
        self.root, self.python, self.is_long = root, python, is_long
        self.faults, self.counts = [], {}
        self.bin = pathlib.Path(tempfile.mkdtemp())
        if tool:
            (self.bin / "depthservo").symlink_to(pathlib.Path(tool).resolve())
        self.environment = {**os.environ, "PATH": f"{self.bin}:{os.environ['PATH']}"}
        if python:
            self.environment["PYTHONPATH"] = str(python)
        self.sources = "".join(file.read_text() for file in root.glob("test/**/*.cpp"))

    def fault(self, block, text):
        self.faults.append(f"{block.page.relative_to(self.root)}:{block.line}: {text}")

    def count(self, what):
        self.counts[what] = self.counts.get(what, 0) + 1

    def call(self, block, command, folder, shown=()):
        done = subprocess.run(["bash", "-o", "pipefail", "-c", command], cwd=folder, env=self.environment,
                              stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=3000 if self.is_long else 300)
        self.count("commands run")
        if done.returncode != 0:
            return self.fault(block, f"{command}\n    exit code {done.returncode}: {done.stdout.strip()[-600:]}")
        for line in shown:
            pattern = ".*".join(re.escape(part) for part in line.rstrip().split("..."))
            if not re.search(f"^{pattern}$", done.stdout, re.MULTILINE):
                self.fault(block, f"{command}\n    does not print: {line}\n    but: {done.stdout.strip()[:1500]}")

    def shell(self, block, folder):
        for command in block.said("first"):
            self.call(block, command, folder)
        not_run, long = block.patterns("not run"), [] if self.is_long else block.patterns("long")
        used = set()
        for command, shown in commands_of(block):
            left_out = [pattern for pattern in not_run + long if re.search(pattern, command)]
            used.update(left_out)
            if left_out:
                self.count("commands left out")
            else:
                self.call(block, command, folder, shown)
        for pattern in not_run + long:
            if pattern not in used:
                self.fault(block, f"no command is like /{pattern}/")

    def cpp(self, block, number):
        name = re.sub(r"\W", "_", block.page.name.lower())
        if f'"{name}/{number}.inc"' not in self.sources:
            self.fault(block, f"is compiled by no test: expected #include \"{name}/{number}.inc\"")
        self.count("blocks compiled")

    def run_by(self, block):
        for name in block.said("run by"):
            suite, test = name.split(".", 1)
            if not re.search(rf"TEST(_F|_P)?\({suite},\s*{test}\)", self.sources):
                self.fault(block, f"no test {name}")
        self.count("blocks run by another test")

    def yaml(self, block, folder):
        file = folder / f"block-{block.line}.yaml"
        file.write_text(block.code)
        for command in block.said("first"):
            self.call(block, command, folder)
        for command in block.said("read by"):
            self.call(block, command.replace("{}", file.name), folder)
        if not block.said("read by"):
            self.fault(block, "is read by nothing: say by which command (read by)")

    def page(self, page, folder):
        compiled = 0
        for block in blocks_of(page):
            compiled += block.language == "cpp"
            if block.language.startswith("{"):
                continue
            if block.language not in LANGUAGES:
                self.fault(block, f"a block of language '{block.language}': expected one of {', '.join(sorted(LANGUAGES))}")
            elif block.isLeftOut():
                self.count("blocks not run, with a reason")
            elif block.said("run by"):
                self.run_by(block)
            elif block.language in ("sh", "console"):
                self.shell(block, folder)
            elif block.language == "cpp":
                self.cpp(block, compiled)
            elif block.language == "yaml":
                self.yaml(block, folder)
            elif block.language == "python" and self.python:
                file = folder / f"block-{block.line}.py"
                file.write_text(block.code)
                self.call(block, f"{sys.executable} -B {file.name}", folder)

    def run(self, pages):
        for page in pages:
            folder = pathlib.Path(tempfile.mkdtemp())
            start = time.monotonic()
            try:
                (folder / "data").symlink_to(self.root / "data")
                self.page(page, folder)
            finally:
                shutil.rmtree(folder)
            print(f"{time.monotonic() - start:6.1f} s  {page.relative_to(self.root)}")
        shutil.rmtree(self.bin)


def anchors_of(page):
    """As GitHub names headings."""
    anchors, known, is_code = set(), {}, False
    for line in page.read_text().splitlines():
        if line.lstrip().startswith("```"):
            is_code = not is_code
        if is_code or not re.match(r"#{1,6} ", line):
            continue
        words = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", line.lstrip("#").strip()).lower()
        anchor = re.sub(r"[^\w\- ]", "", words).replace(" ", "-")
        count = known.get(anchor, 0)
        known[anchor] = count + 1
        anchors.add(f"{anchor}-{count}" if count else anchor)
    return anchors


def links_of(page):
    text = re.sub(r"^ *```.*?^ *```", lambda m: "\n" * m.group().count("\n"), page.read_text(), flags=re.DOTALL | re.MULTILINE)
    for match in re.finditer(r"\]\(([^()\s]+)\)", re.sub(r"`[^`\n]*`", lambda m: " " * len(m.group()), text)):
        yield text[:match.start()].count("\n") + 1, match.group(1)


def faulty_links(root, pages):
    faults, count = [], 0
    for page in pages:
        for line, link in links_of(page):
            if re.match(r"[a-z]+:", link):
                continue
            count += 1
            path, _, anchor = link.partition("#")
            target = (page.parent / path).resolve() if path else page
            if not target.exists():
                faults.append(f"{page.relative_to(root)}:{line}: {link}: there is no such file")
            elif anchor and target.suffix == ".md" and anchor not in anchors_of(target):
                faults.append(f"{page.relative_to(root)}:{line}: {link}: no such heading")
    return faults, count


def unknown_pictures(root):
    """Pictures that no page shows, or that no script draws."""
    pages = "".join(file.read_text() for file in [root / "README.md", *root.glob("doc/*.md")])
    scripts = "".join(file.read_text() for file in root.glob("scripts/draw-*"))
    for picture in sorted((root / "doc" / "images").glob("*")):
        if f"images/{picture.name}" not in pages:
            yield f"doc/images/{picture.name}: no page shows it"
        if picture.stem not in scripts:
            yield f"doc/images/{picture.name}: no scripts/draw-* draws it"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("root", type=pathlib.Path)
    parser.add_argument("--tool")
    parser.add_argument("--python")
    parser.add_argument("--long", action="store_true")
    parser.add_argument("--links", action="store_true")
    arguments = parser.parse_args()
    root = arguments.root.resolve()
    pages = [root / "README.md", *sorted((root / "doc").glob("*.md"))]
    if arguments.links:
        faults, count = faulty_links(root, pages)
        print(f"{count} links\n" + "\n".join(faults))
        return 1 if faults or count == 0 else 0
    runner = Runner(root, arguments.tool, arguments.python, arguments.long)
    runner.run(pages)
    linked = [*pages, *root.glob("*.md"), *root.glob("src/*/README.md"), *root.glob("data/**/*.md"), *root.glob("ros/**/*.md")]
    links, count = faulty_links(root, sorted(set(linked)))
    faults = runner.faults + links + list(unknown_pictures(root))
    print(f"{', '.join(f'{n} {what}' for what, n in runner.counts.items())}, {count} links")
    print("".join(f"{fault}\n" for fault in faults), end="")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
