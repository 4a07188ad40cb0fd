#!/usr/bin/env python3
"""Makes the site from the Markdown files of the project and the comments of its headers.

usage: make_site.py OUT

The pages are the files as they lie in the repository, with the same links: they are copied beside each other
into a folder, together with whatever they link to. Anything wrong is an error: a warning of mkdocs or Doxygen,
a link or an anchor that leads nowhere, a page that loads something from another machine.
"""
import glob
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile

sys.dont_write_bytecode = True  # the sources stay as they are

import links  # noqa: E402

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
PAGES = ("*.md", "docs/**/*.md", "plugins/*/*/README.md", "third_party_notes/*.md")


def fail(message):
    print(f"error: {message}", file=sys.stderr)
    sys.exit(1)


def pages(root):
    """The Markdown files that become pages, relative to `root`."""
    found = {os.path.relpath(path, root) for pattern in PAGES
             for path in glob.glob(os.path.join(root, pattern), recursive=True)}
    return sorted(name for name in found if not name.startswith(os.path.join("docs", "site", "")))


def linked_files(root, names):
    """Files that the pages link to and that are no pages: pictures, sources, configurations."""
    found = set()
    for name in names:
        with open(os.path.join(root, name), encoding="utf-8") as file:
            targets = [target.partition("#")[0] for _, target in links.markdown_links(file.read())
                       if not links.is_outside(target)]
        found.update(os.path.normpath(os.path.join(os.path.dirname(name), target)) for target in targets if target)
    return sorted(path for path in found - set(names)
                  if os.path.isfile(os.path.join(root, path)) and not path.startswith(".."))


def for_mkdocs(text):
    """Lists and tables that follow a paragraph without a blank line, as Markdown allows, get the one that mkdocs wants."""
    lines, fenced = [], False
    for line in text.split("\n"):
        if re.match(r"\s*(```|~~~)", line):
            fenced = not fenced
        before = lines[-1] if lines else ""
        starts = re.match(r"([-*+]|\d+\.) |\|", line)
        goes_on = re.match(r"([-*+]|\d+\.) |\||\s|$", before)
        if starts and not goes_on and not fenced:
            lines.append("")
        lines.append(line)
    return "\n".join(lines)


def copy(root, names, into):
    for name in names:
        target = os.path.join(into, name)
        os.makedirs(os.path.dirname(target), exist_ok=True)
        if name.endswith(".md"):
            with open(os.path.join(root, name), encoding="utf-8") as source, open(target, "w", encoding="utf-8") as page:
                page.write(for_mkdocs(source.read()))
        else:
            shutil.copy(os.path.join(root, name), target)


def run(command, **options):
    """Runs a program; its output is shown only if it fails."""
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **options)
    if done.returncode != 0:
        fail(f"{' '.join(command)}\n{done.stdout}")


def make_api(root, out):
    os.makedirs(out, exist_ok=True)
    with open(os.path.join(root, "docs/site/Doxyfile"), encoding="utf-8") as file:
        settings = file.read() + f'\nOUTPUT_DIRECTORY = "{out}"\n'
    run(["doxygen", "-"], input=settings, cwd=root)


def make_pages(root, sources, out):
    """mkdocs with docs/site/mkdocs.yml over the folder `sources`."""
    config = os.path.join(os.path.dirname(sources), "mkdocs.yml")
    here = os.path.join(root, "docs/site")
    with open(config, "w", encoding="utf-8") as file:
        file.write(f"INHERIT: {here}/mkdocs.yml\ndocs_dir: {sources}\nsite_dir: {out}\n"
                   f"theme:\n  custom_dir: {here}/theme\n")
    run(["mkdocs", "build", "--strict", "--clean", "--quiet", "--config-file", config])


def let_search_work_from_disk(out):
    """A page opened from disk may not fetch the index, but may run it as a script."""
    with open(os.path.join(out, "search/search_index.json"), encoding="utf-8") as file:
        index = json.load(file)
    with open(os.path.join(out, "search/search_index.js"), "w", encoding="utf-8") as file:
        file.write("var __search = {index: Promise.resolve(" + json.dumps(index, separators=(",", ":")) + ")};\n")


def make_site(root, out):
    names = pages(root)
    if faults := links.dead_markdown_links(root, names):
        fail("links that lead nowhere\n" + "\n".join(faults))
    with tempfile.TemporaryDirectory() as work:
        sources, made = os.path.join(work, "pages"), os.path.join(work, "site")
        copy(root, names + linked_files(root, names), sources)
        make_api(root, os.path.join(sources, "api"))
        make_pages(root, sources, made)
        let_search_work_from_disk(made)
        if faults := links.page_faults(made):
            fail("faults of the pages\n" + "\n".join(faults))
        shutil.rmtree(out, ignore_errors=True)
        shutil.move(made, out)


def main(arguments):
    if len(arguments) != 1:
        print("usage: make_site.py OUT", file=sys.stderr)
        return 2
    out = os.path.abspath(arguments[0])
    if os.path.exists(out) and os.listdir(out) and not os.path.exists(os.path.join(out, "search/search_index.js")):
        fail(f"{arguments[0]} is there already and is no site")
    make_site(ROOT, out)
    print(os.path.join(out, "index.html"))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
