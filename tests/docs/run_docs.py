#!/usr/bin/env python3
"""Runs every command that the documentation shows, as a reader would: file by file, block by block.

usage: run_docs.py [--root DIR] [--build DIR] [--data DIR] [--update] [--keep DIR] [FILE.md...]

Files are README.md, CONTRIBUTING.md and docs/**/*.md unless named; their commands run in a copy of the project
with what `./dev build` makes, HOME in a folder of its own, $DOCS_BUILD_DIR the build folder. In a file

    ```sh                            is run, in one shell a file, with set -euo pipefail
    ```toml title="out/a.toml"       (any language) is saved under that name, where the reader stands
    <!-- not run: REASON -->         before a block: it is only checked (./dev NAME, options of vantage JOB, configs/)
    <!-- run instead: COMMAND -->    before a block: the same, and COMMAND is run in its place
    <!-- with data: FOLDER -->       before a ```sh block: it is run where the recorded data has this folder
    ```text                          after a ```sh block: lines that this block prints; a line `...` stands for any lines
    <!-- output of: COMMAND -->      before a ```text block: it is all that COMMAND prints, but for lines `...`
    <!-- not compared: REASON -->    before a ```text block: it is only listed
    <!-- needs: FILE.md -->          what that file makes is used here: it runs first

Every ```text block is compared: one that belongs to no command is a fault, one whose command is not run is listed.
What depends on the machine is not compared: numbers before `s`, `ms`, `core-seconds`, `blocking` (scans that waited) or
`MB` (of memory) in a sentence, and rows and columns of tables in [s] or [ms].
--update writes what is printed; of the lines after a ```sh block, it replaces each by the printed line most like it,
and keeps what is not compared.

Commands in `code spans` are checked too, and configurations that are shown whole are parsed. Standard library only.
"""
import argparse
import dataclasses
import difflib
import glob
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import time

SECONDS_A_FILE = 900


@dataclasses.dataclass
class Block:
    file: str
    line: int  # of the fence
    language: str
    title: str
    text: str
    end: int  # the line of the fence that ends it
    not_run: str = ""
    instead: str = ""
    output_of: str = ""
    data: str = ""
    not_compared: str = ""
    printed_by: "Block | None" = None  # the ```sh block that prints this ```text block

    @property
    def place(self):
        return f"{self.file}:{self.line}"


def fenced_blocks(file, text):
    """The fenced blocks of a Markdown text, with the comments before them."""
    blocks, notes, lines = [], {}, text.split("\n")
    number, shell = 0, None
    while number < len(lines):
        line = lines[number]
        fence = re.match(r"(\s*)(```+|~~~+)\s*([\w+-]*)(.*)$", line)
        note = re.match(r"\s*<!--\s*(not run|run instead|output of|with data|not compared):\s*(.*?)\s*-->\s*$", line)
        if fence:
            indent, mark, language, info = fence.groups()
            begin = number + 1
            number = begin
            while number < len(lines) and lines[number].strip() != mark:
                number += 1
            body = "\n".join(inner.removeprefix(indent) for inner in lines[begin:number])
            title = re.search(r'title="([^"]+)"', info)
            blocks.append(Block(file, begin, language, title.group(1) if title else "", body + "\n", number + 1,
                                notes.get("not run", ""), notes.get("run instead", ""), notes.get("output of", ""),
                                notes.get("with data", ""), notes.get("not compared", "")))
            notes = {}
            if language == "text":
                blocks[-1].printed_by = shell
            else:
                shell = blocks[-1] if language == "sh" and not title else None
        elif note:
            notes[note.group(1)] = note.group(2)
        elif line.strip():
            notes = {}
        number += 1
    return blocks


def code_spans(text):
    """(line, content) of the code spans outside fenced blocks; a span may go over a line's end."""
    kept, fence = [], None
    for line in text.split("\n"):
        mark = re.match(r"\s*(```+|~~~+)", line)
        if mark and (fence is None or line.strip() == fence):
            fence = mark.group(1) if fence is None else None
            kept.append("")
        else:
            kept.append("" if fence else line)
    plain = "\n".join(kept)
    for match in re.finditer(r"(?<!`)(`+)(?!`)((?:(?!\n\n).)+?)(?<!`)\1(?!`)", plain, re.DOTALL):
        yield plain.count("\n", 0, match.start()) + 1, " ".join(match.group(2).split())


def needs(text):
    return re.findall(r"<!--\s*needs:\s*(\S+)\s*-->", text)


class Programs:
    """What the programs say of themselves."""

    def __init__(self, root, vantage):
        self.root, self.vantage, self.texts = root, vantage, {}

    def help(self, *words):
        if words not in self.texts:
            done = subprocess.run([*words, "--help"], capture_output=True, text=True, check=False, cwd=self.root)
            self.texts[words] = done.stdout if done.returncode == 0 else None
        return self.texts[words]

    def dev_commands(self):
        return set(re.findall(r"^  ([a-z]\w*)", self.help("./dev") or "", re.MULTILINE)) | {"help"}

    def jobs(self):
        return set(re.findall(r"^  ([a-z]\w*)", self.help(self.vantage) or "", re.MULTILINE))

    def unknown(self, words):
        """What is wrong with a call of `./dev` or `vantage`, or nothing."""
        program, arguments = os.path.basename(words[0]), words[1:]
        if program == "dev":
            name = next((word for word in arguments if re.fullmatch(r"[a-z]\w*", word)), None)
            if arguments[:1] == [name] and name not in self.dev_commands():
                return f"./dev has no command '{name}'"
        if program == "vantage" and arguments and re.fullmatch(r"[a-z]\w*", arguments[0]):
            return self.unknown_option(arguments)
        return None

    def unknown_option(self, arguments):
        if arguments[0] not in self.jobs():
            return f"vantage has no job '{arguments[0]}'"
        text = self.help(self.vantage, arguments[0])
        if text is None:
            return f"vantage {arguments[0]} --help fails"
        if "SUBCOMMAND" in text and len(arguments) > 1 and re.fullmatch(r"[a-z]\w*", arguments[1]):
            text = self.help(self.vantage, *arguments[:2])
            if text is None:
                return f"vantage {arguments[0]} has no '{arguments[1]}'"
        for word in arguments[1:]:
            option = re.match(r"(--[a-z][\w-]*|-[A-Za-z])(?=$|=|\d)", word)
            if option and not re.search(rf"(?<![\w-]){re.escape(option.group(1))}(?![\w-])", text):
                return f"vantage {arguments[0]} has no option '{option.group(1)}'"
        return None


def simple_commands(text):
    """The commands of a shell text as lists of words, roughly: enough to know program and options."""
    for line in re.sub(r"\\\n\s*", " ", text).split("\n"):
        try:
            lexer = shlex.shlex(line, posix=True, punctuation_chars="();<>|&")
            lexer.whitespace_split = True
            words = list(lexer)
        except ValueError:
            words = line.split()
        command = []
        for word in [*words, ";"]:
            if set(word) <= set(";|&()"):
                while command and (command[0] in ("do", "then", "else", "if", "time", "!", "$") or
                                   re.fullmatch(r"\w+=.*", command[0])):
                    command = command[1:]
                if command:
                    yield command
                command = []
            else:
                command.append(word)


def faults_of_commands(text, root, programs):
    for words in simple_commands(text):
        if (wrong := programs.unknown(words)) is not None:
            yield wrong
        for word in words:
            if word.startswith("configs/") and not re.search(r"[{}*$<>A-Z.]{3}|[{}*$]", word):
                if not os.path.exists(os.path.join(root, word)):
                    yield f"there is no {word}"


def faults_of_page(file, text, blocks, root, programs):
    """What can be known without running anything."""
    for block in blocks:
        if block.language == "sh" and block.not_run:
            for fault in faults_of_commands(block.text, root, programs):
                yield f"{block.place}: error: {fault}"
    for line, span in code_spans(text):
        if re.match(r"(\./dev|(build/bin/)?vantage) ", span):
            for fault in faults_of_commands(span, root, programs):
                yield f"{file}:{line}: error: {fault}"
    if os.path.basename(file) == "commands.md":
        for job in sorted(programs.jobs()):
            if not re.search(rf"^## vantage {job}$", text, re.MULTILINE):
                yield f"{file}: error: there is no section '## vantage {job}'"


def fault_of_config(block, vantage, folder):
    """A configuration that is shown whole must be one."""
    if not (re.search(r"^schema = 1", block.text, re.MULTILINE) and "[partitioner]" in block.text):
        return None
    path = os.path.join(folder, "shown.toml")
    write(path, block.text)
    done = subprocess.run([vantage, "build", path, "--print-config"], capture_output=True, text=True, check=False)
    return None if done.returncode == 0 else f"{block.place}: error: this configuration is refused\n{done.stderr}"


def write(path, text):
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)


def read(path):
    with open(path, encoding="utf-8", errors="replace") as file:
        return file.read()


def script_of(blocks, work):
    """One shell script for the blocks of a file, and the blocks that are part of it. What the i-th of them prints
    goes to i.out; `reached` holds the number of the one that runs."""
    lines, steps = ["set -euo pipefail"], []
    for block in blocks:
        if block.title:
            saved = os.path.join(work, f"{len(steps)}.file")
            write(saved, block.text)
            target = shlex.quote(block.title)
            command = f'mkdir -p "$(dirname {target})" && cp {shlex.quote(saved)} {target}'
        elif block.output_of:
            command = block.output_of
        elif block.language != "sh":
            continue
        elif block.instead:
            command = block.instead
        elif block.not_run:
            continue
        else:
            command = block.text
        number = len(steps)
        lines += [f"exec >{work}/{number}.out 2>&1", f"echo {number} >{work}/reached", command]
        steps.append(block)
    return "\n".join(lines) + "\n", steps


def without_times(text):
    """The lines of a text without what differs from run to run (`#`), and the spaces and rules that follow from it."""
    lines, columns = [], []  # columns: (begin, end) of those of the table that hold times
    for line in text.rstrip().split("\n"):
        cells = [(match.start(), match.end(), match.group()) for match in re.finditer(r"\S+(?: \S+)*", line)]
        if any(re.search(r"\[m?s\]$", cell) for _, _, cell in cells[1:]):
            columns = [(begin, end) for begin, end, cell in cells if re.search(r"\[m?s\]$", cell)]
        elif not cells:
            columns = []
        elif cells and re.search(r"\[m?s\]$", cells[0][2]):
            line = line[:cells[0][1]] + re.sub(r"\d[\d.,]*", "#", line[cells[0][1]:])
        else:
            for begin, end, _ in reversed(cells):
                if any(begin < last and first < end for first, last in columns) and not set(line[begin:end]) <= set("-"):
                    line = line[:begin] + "#" + line[end:]
        line = re.sub(r"\d[\d.,]*(?= (?:m?s|core-s|core-seconds|core-hours|blocking|MB)\b)", "#", line)
        lines.append(re.sub(r"-{8,}", "---", re.sub(r" +", " ", line)).strip())
    return "\n".join(lines)


def agrees(shown, printed, whole=True):
    """Whether lines that are shown are those that were printed, or with `whole` = False some of them in a row;
    `...` stands for any lines."""
    parts = [re.escape(line) for line in without_times(shown).split("\n")]
    pattern = "\n".join(".*?" if part == re.escape("...") else part for part in parts)
    there = without_times(printed)
    return re.search(rf"\A{pattern}\Z" if whole else rf"(?m:^){pattern}(?m:$)", there, re.DOTALL) is not None


def with_old_times(line, settled, old):
    """A printed line with the times of the one that was shown, if both have as many words."""
    masks, before = settled.split(" "), old.split()
    words = list(re.finditer(r"\S+", line))
    if not len(words) == len(masks) == len(before):
        return line
    for word, mask, there in reversed(list(zip(words, masks, before))):
        if mask == "#":
            line = line[:word.start()] + there.rjust(len(word.group())) + line[word.end():]
    return line


def words_of(line):
    """A line whose numbers, spaces and rules are all alike: what tells which line it is."""
    return re.sub(r"-{8,}", "---", re.sub(r"\d[\d.,]*", "0", " ".join(line.split())))


def nearest_lines(shown, printed):
    """Shown lines, each replaced by the line most like it that was printed after those before it; None without one."""
    there, begin, found = printed.rstrip().split("\n"), 0, []
    settled = without_times(printed).split("\n")
    for line in shown.rstrip().split("\n"):
        if line.strip() in ("...", ""):
            found.append(line)
            continue
        likeness = [difflib.SequenceMatcher(None, words_of(line), words_of(other)).ratio() for other in there[begin:]]
        if not likeness or max(likeness) < 0.6:
            return None
        begin += likeness.index(max(likeness)) + 1
        found.append(with_old_times(there[begin - 1], settled[begin - 1], line))
    return "\n".join(found)


def run_page(blocks, clone, environment, work):
    """Runs the blocks of one file; returns (what was run, printed by each, fault or None)."""
    os.makedirs(work)
    script, steps = script_of(blocks, work)
    path = os.path.join(work, "script.sh")
    write(path, script)
    late = False
    with subprocess.Popen(["bash", path], cwd=clone, env=environment, stdin=subprocess.DEVNULL,
                          stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as shell:
        try:
            _, complaint = shell.communicate(timeout=SECONDS_A_FILE)
        except subprocess.TimeoutExpired:
            shell.kill()
            _, complaint = shell.communicate()
            late = True
    printed = [read(os.path.join(work, f"{i}.out")) if os.path.exists(os.path.join(work, f"{i}.out")) else ""
               for i in range(len(steps))]
    if shell.returncode == 0:
        return steps, printed, None
    reached = os.path.join(work, "reached")
    if not os.path.exists(reached):
        return steps, printed, f"{blocks[0].file}: error: no shell script\n{complaint}"
    number = int(read(reached))
    why = f"more than {SECONDS_A_FILE} s" if late else f"exit code {shell.returncode}"
    return steps, printed, (f"{steps[number].place}: error: this block fails ({why})\n{steps[number].text}"
                            f"--- it prints\n{printed[number]}{complaint}")


def updated(text, block, printed):
    """The page with what a block shows replaced by what its command prints."""
    lines = text.split("\n")
    return "\n".join(lines[:block.line] + printed.rstrip().split("\n") + lines[block.end - 1:])


def make_clone(root, build, data, folder):
    """What a reader has after `git clone` and `./dev build`, and the recorded data beside it."""
    clone = os.path.join(folder, "vantage")
    shutil.copytree(root, clone, symlinks=True,
                    ignore=lambda at, names: [n for n in names if n == "__pycache__" or at == root and
                                              (n in (".git", "out") or n.startswith("build"))])
    os.makedirs(os.path.join(clone, "build"))
    for name in ("bin", "lib"):  # and nothing that a command could build or configure again
        os.symlink(os.path.join(build, name), os.path.join(clone, "build", name))
    if data and os.path.isdir(data):
        os.makedirs(os.path.join(folder, "shared"))
        os.symlink(os.path.abspath(data), os.path.join(folder, "shared/data"))
    os.makedirs(os.path.join(folder, "home"))
    return clone


def in_order(pages, root):
    """Pages with those that they need before them."""
    order = []

    def add(name, path):
        if name in path:
            sys.exit(f"error: pages need each other: {' '.join([*path, name])}")
        if name not in order:
            for needed in needs(read(os.path.join(root, name))):
                add(os.path.normpath(os.path.join(os.path.dirname(name), needed)), [*path, name])
            order.append(name)

    for page in pages:
        add(page, [])
    return order


def arguments_of(words):
    here = os.path.dirname(os.path.abspath(__file__))
    parser = argparse.ArgumentParser(description="Runs the commands of the documentation.")
    parser.add_argument("--root", default=os.path.dirname(os.path.dirname(here)), help="the project")
    parser.add_argument("--build", help="its build folder (build)")
    parser.add_argument("--data", help="recorded data, where $VANTAGE_DATA_DIR names none (../shared/data)")
    parser.add_argument("--update", action="store_true", help="write what commands print into the pages")
    parser.add_argument("--keep", help="run in this new folder and keep it")
    parser.add_argument("files", nargs="*", help="pages, relative to the project")
    chosen = parser.parse_args(words)
    chosen.root = os.path.abspath(chosen.root)
    chosen.build = os.path.abspath(chosen.build or os.path.join(chosen.root, "build"))
    chosen.data = os.environ.get("VANTAGE_DATA_DIR") or chosen.data or os.path.join(chosen.root, "../shared/data")
    return chosen


def pages_of(root):
    found = [name for name in ("README.md", "CONTRIBUTING.md") if os.path.exists(os.path.join(root, name))]
    return found + sorted(os.path.relpath(path, root)
                          for path in glob.glob(os.path.join(root, "docs/**/*.md"), recursive=True))


class Runner:
    def __init__(self, chosen, folder):
        self.chosen, self.folder = chosen, folder
        self.vantage = os.path.join(chosen.build, "bin/vantage")
        self.programs = Programs(chosen.root, self.vantage)
        self.clone = make_clone(chosen.root, chosen.build, chosen.data, folder)
        self.faults, self.not_run, self.not_compared, self.ran = [], [], [], 0
        self.environment = {key: value for key, value in os.environ.items() if not key.startswith("VANTAGE_")}
        self.environment.update(HOME=os.path.join(folder, "home"), CMAKE_GENERATOR="Ninja", LC_ALL="C.UTF-8",
                                DOCS_BUILD_DIR=chosen.build, GIT_CEILING_DIRECTORIES=folder)

    def page(self, name, number):
        text = read(os.path.join(self.chosen.root, name))
        blocks = fenced_blocks(name, text)
        self.faults += faults_of_page(name, text, blocks, self.chosen.root, self.programs)
        self.faults += [fault for block in blocks if (fault := fault_of_config(block, self.vantage, self.folder))]
        for block in blocks:
            if block.data and not os.path.isdir(os.path.join(self.chosen.data or "", block.data)):
                block.not_run = f"there is no recorded data {block.data}"
        self.not_run += [f"{block.place}: {block.not_run or 'instead: ' + block.instead}" for block in blocks
                         if block.language == "sh" and (block.not_run or block.instead)]
        shown = [block for block in blocks if block.language == "text" and not block.output_of]
        self.faults += [f"{block.place}: error: no command prints this; say why with <!-- not compared: REASON -->"
                        for block in shown if not (block.not_compared or block.printed_by)]
        self.not_compared += [f"{block.place}: {block.not_compared or 'its command is not run'}" for block in shown
                              if block.not_compared or block.printed_by and (block.printed_by.not_run or block.printed_by.instead)]
        began = time.monotonic()
        steps, printed, fault = run_page(blocks, self.clone, self.environment, os.path.join(self.folder, f"page{number}"))
        self.ran += len(steps)
        if steps:
            print(f"{name}: {len(steps)} blocks, {time.monotonic() - began:.1f} s", flush=True)
        if fault:
            self.faults.append(fault)
        else:
            self.compare(name, text, blocks, steps, printed)

    def compare(self, name, text, blocks, steps, printed):
        for block in reversed(blocks):  # from the end: lines before stay where they are
            whole, command = bool(block.output_of), block.output_of or "the block before"
            source = block if whole else block.printed_by if not block.not_compared else None
            index = next((i for i, step in enumerate(steps) if step is source), None)
            if block.language != "text" or index is None or agrees(block.text, printed[index], whole):
                continue
            new = printed[index] if whole else nearest_lines(block.text, printed[index])
            if self.chosen.update and new is not None:
                text = updated(text, block, new)
                print(f"{block.place}: updated")
            else:
                self.faults.append(f"{block.place}: error: `{command}` prints something else "
                                   f"(tests/docs/run_docs.py --update {name} writes it)\n{printed[index]}")
        if self.chosen.update:
            write(os.path.join(self.chosen.root, name), text)


def main(words):
    chosen = arguments_of(words)
    if not os.path.exists(os.path.join(chosen.build, "bin/vantage")):
        print(f"error: there is no {chosen.build}/bin/vantage: build first", file=sys.stderr)
        return 2
    with tempfile.TemporaryDirectory() as temporary:
        folder = os.path.abspath(chosen.keep) if chosen.keep else temporary
        os.makedirs(folder, exist_ok=True)
        runner = Runner(chosen, folder)
        for number, name in enumerate(in_order(chosen.files or pages_of(chosen.root), chosen.root)):
            runner.page(name, number)
    for line in runner.not_run:
        print("not run: " + line)
    for line in runner.not_compared:
        print("not compared: " + line)
    for fault in runner.faults:
        print(fault)
    print(f"{runner.ran} blocks run, {len(runner.not_run)} not run, {len(runner.faults)} faults")
    return 1 if runner.faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
