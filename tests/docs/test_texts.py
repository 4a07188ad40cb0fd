#!/usr/bin/env python3
"""The texts of the project and of its programs can be read by people and tools alike.

usage: test_texts.py BUILD_DIR
"""
import glob
import os
import re
import shutil
import subprocess
import sys
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
BUILD = ""
CONTROL = re.compile(rb"[\x00-\x08\x0b-\x1f\x7f]")
NO_TEXTS = {f"tests/config/bad/{name}.toml" for name in ("binary", "utf16")}  # that must be refused


def files_of_project():
    """Those that git tracks; in a copy without git, those that are no build and no result."""
    git = shutil.which("git")
    tracked = git and subprocess.run([git, "-C", ROOT, "ls-files", "-z"], capture_output=True, check=False)
    if tracked and tracked.returncode == 0:
        return [name for name in tracked.stdout.decode().split("\0") if name]
    found = []
    for folder, folders, names in os.walk(ROOT):
        at_root = folder == ROOT
        folders[:] = [name for name in folders if name not in (".git", "__pycache__")
                      and not (at_root and (name == "out" or name.startswith("build")))]
        found += [os.path.relpath(os.path.join(folder, name), ROOT) for name in names]
    return found


def help_of(*words):
    return subprocess.run([*words, "--help"], capture_output=True, check=False).stdout


def helps():
    """(command, its help) of every program and of its subcommands."""
    for program in sorted(glob.glob(f"{BUILD}/bin/*")):
        if not os.path.isfile(program) or not os.access(program, os.X_OK):
            continue
        text = help_of(program)
        yield os.path.basename(program), text
        _, _, jobs = text.partition(b"Subcommands:\n")
        for job in re.findall(rb"^  (\w+)", jobs, re.MULTILINE):
            yield f"{os.path.basename(program)} {job.decode()}", help_of(program, job.decode())


class Texts(unittest.TestCase):
    def test_no_file_holds_a_control_character(self):
        names = [name for name in files_of_project() if name not in NO_TEXTS and not name.endswith(".png")]
        self.assertGreater(len(names), 500)
        for name in names:
            if os.path.isfile(os.path.join(ROOT, name)):
                with self.subTest(name), open(os.path.join(ROOT, name), "rb") as file:
                    self.assertIsNone(CONTROL.search(file.read()))

    def test_help_is_plain(self):
        all_of_them = dict(helps())
        self.assertIn("vantage-plugins new", all_of_them)
        for command, text in all_of_them.items():
            with self.subTest(command):
                self.assertTrue(text)
                self.assertIsNone(CONTROL.search(text))
                self.assertNotRegex(text, rb"\{(false|true)\}")  # a flag is shown by its name

    def test_flags_are_not_negated(self):
        for name in files_of_project():  # CLI11 shows "!--no-x" as "--no-x{false}"
            if name.endswith((".cpp", ".hpp")):
                with self.subTest(name), open(os.path.join(ROOT, name), encoding="utf-8") as file:
                    self.assertNotIn("!--no", file.read())

    def test_vantage_says_what_each_program_does(self):
        text = help_of(f"{BUILD}/bin/vantage").decode()
        for program in glob.glob(f"{BUILD}/bin/vantage-*"):
            job = os.path.basename(program).removeprefix("vantage-")
            first = help_of(program).decode().split("\n")[0]
            self.assertRegex(first, r"^[A-Z].*\.$")
            self.assertRegex(text, rf"(?m)^  {job}  +{re.escape(first)}$")


if __name__ == "__main__":
    BUILD = os.path.abspath(sys.argv.pop(1))
    unittest.main()
