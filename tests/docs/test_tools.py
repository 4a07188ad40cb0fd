#!/usr/bin/env python3
"""The tools of the documentation are held to what they promise: each fault that they are there for makes them fail."""
import contextlib
import io
import os
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE, os.path.join(os.path.dirname(os.path.dirname(HERE)), "docs/site")]

os.environ.pop("VANTAGE_DATA_DIR", None)  # --data of the tests decides

import links  # noqa: E402
import make_site  # noqa: E402
import run_docs  # noqa: E402

DEV = """#!/usr/bin/env bash
echo "usage: ./dev COMMAND"; echo; echo "  demo        what it does"; echo "  test        another"
"""
VANTAGE = """#!/usr/bin/env bash
case "$*" in
  --help) printf 'jobs:\\n  build\\n  plugins\\n' ;;
  "build --help") printf '  --jobs,-j UINT  threads\\n  --print-config  only print\\n' ;;
  "plugins --help") printf 'Usage: vantage plugins [OPTIONS] SUBCOMMAND\\n' ;;
  "plugins new --help") printf '  --out DIR  folder\\n' ;;
  build*--print-config) ! grep -q refused "$2" || { echo "$2:2:1: error: unknown key" >&2; exit 1; } ;;
  *) exit 1 ;;
esac
"""


def write(root, name, text, executable=False):
    path = os.path.join(root, name)
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)
    if executable:
        os.chmod(path, 0o755)


def read(root, name):
    with open(os.path.join(root, name), encoding="utf-8") as file:
        return file.read()


class TemporaryRoot(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = os.path.join(folder.name, "project")
        os.makedirs(self.root)


class RunDocs(TemporaryRoot):
    """run_docs.py over a project of two programs that know little."""

    def setUp(self):
        super().setUp()
        write(self.root, "dev", DEV, executable=True)
        write(self.root, "build/bin/vantage", VANTAGE, executable=True)
        os.makedirs(os.path.join(self.root, "build/lib"))

    def run_pages(self, *arguments, **pages):
        for name, text in pages.items():
            write(self.root, {"readme": "README.md"}.get(name, f"docs/{name}.md"), text)
        with contextlib.redirect_stdout(io.StringIO()) as out:
            code = run_docs.main(["--root", self.root, "--data", "", *arguments])
        return code, out.getvalue()

    def passes(self, text, *arguments):
        code, out = self.run_pages(*arguments, readme=text)
        self.assertEqual(code, 0, out)
        return out

    def fails(self, text, message):
        code, out = self.run_pages(readme=text)
        self.assertEqual(code, 1, out)
        self.assertIn(message, out)
        return out

    def test_commands_that_succeed_pass_and_are_counted(self):
        self.assertIn("2 blocks run, 0 not run, 0 faults", self.passes("```sh\ntrue\n```\n\n```sh\ntrue\n```\n"))

    def test_a_command_that_fails_is_named_with_its_place_and_what_it_prints(self):
        out = self.fails("text\n\n```sh\ntrue\n```\n\n```sh\necho said; false; echo no\n```\n",
                         "README.md:7: error: this block fails (exit code 1)")
        self.assertIn("said\n", out)
        self.assertNotIn("\nno\n", out)

    def test_an_unset_variable_and_a_failure_in_a_pipe_are_failures(self):
        self.fails('```sh\necho "$nowhere"\n```\n', "README.md:1: error")
        self.fails("```sh\nfalse | cat\n```\n", "README.md:1: error")

    def test_what_is_no_shell_script_is_a_fault(self):
        self.fails("```sh\nif true\n```\n", "README.md")

    def test_other_languages_are_not_run(self):
        self.assertIn("0 blocks run", self.passes("```cpp\nfalse\n```\n\n```\nfalse\n```\n"))

    def test_a_file_is_one_shell_and_the_next_file_another(self):
        self.passes("```sh\nx=1; mkdir -p a; cd a\n```\n\n```sh\n[ $x = 1 ] && [ $(basename $PWD) = a ]\n```\n")
        code, out = self.run_pages(second="```sh\n[ -z ${x:-} ] && [ -d a ]\n```\n")
        self.assertEqual(code, 0, out)

    def test_the_project_stays_as_it_is(self):
        self.passes("```sh\necho x >README.md; echo x >new; echo x >~/new\n```\n")
        self.assertIn("```sh", read(self.root, "README.md"))
        self.assertFalse(os.path.exists(os.path.join(self.root, "new")))

    def test_a_block_that_is_not_run_is_listed_with_its_reason(self):
        out = self.passes("<!-- not run: takes an hour -->\n```sh\nfalse\n```\n")
        self.assertIn("not run: README.md:2: takes an hour", out)

    def test_a_note_holds_for_the_next_block_only(self):
        self.fails("<!-- not run: no -->\n```sh\nfalse\n```\n\n```sh\nfalse\n```\n", "README.md:6: error")
        self.fails("<!-- not run: no -->\ntext between\n```sh\nfalse\n```\n", "README.md:3: error")

    def test_instead_of_a_block_another_command_runs(self):
        self.passes("<!-- run instead: touch done -->\n```sh\nfalse\n```\n\n```sh\n[ -e done ]\n```\n")
        self.fails("<!-- run instead: false -->\n```sh\ntrue\n```\n", "README.md:2: error")

    def test_an_unknown_option_is_a_fault_where_nothing_is_run(self):
        for good in ("vantage build a.toml --jobs 2 -j1", "build/bin/vantage build a.toml \\\n  --print-config",
                     "for x in a; do vantage build $x --jobs=1; done", "cd a && vantage plugins new ground x --out y"):
            self.passes(f"<!-- not run: no -->\n```sh\n{good}\n```\n")
        for bad, message in (("vantage build a.toml --job 2", "vantage build has no option '--job'"),
                             ("true && vantage build a \\\n  --config", "vantage build has no option '--config'"),
                             ("vantage biuld a.toml", "vantage has no job 'biuld'"),
                             ("vantage plugins new x --into y", "vantage plugins has no option '--into'"),
                             ("vantage plugins nwe x", "vantage plugins has no 'nwe'")):
            self.fails(f"<!-- not run: no -->\n```sh\n{bad}\n```\n", f"README.md:2: error: {message}")

    def test_commands_in_code_spans_are_checked(self):
        self.passes("`vantage build A --jobs 2`, `vantage JOB --anything`, `./dev demo`, `./dev NAME`\n")
        self.fails("text\n`vantage build A\n--job 2`\n", "README.md:2: error: vantage build has no option '--job'")
        self.fails("`./dev dmeo`\n", "./dev has no command 'dmeo'")

    def test_an_unknown_command_of_dev_is_a_fault(self):
        self.fails("<!-- not run: no -->\n```sh\n./dev dmeo\n```\n", "README.md:2: error: ./dev has no command 'dmeo'")

    def test_a_configuration_that_is_not_there_is_a_fault(self):
        write(self.root, "configs/a.toml", "")
        self.passes("<!-- not run: no -->\n```sh\nvantage build configs/a.toml\n```\n")
        self.fails("<!-- not run: no -->\n```sh\nvantage build configs/b.toml\n```\n", "there is no configs/b.toml")

    def test_a_block_with_a_title_is_saved_where_the_reader_stands(self):
        self.passes('```toml title="in/a.toml"\nx = 1\n```\n\n```sh\n[ "$(cat in/a.toml)" = "x = 1" ]; cd in\n```\n\n'
                    '```sh title="b.sh"\nfalse\n```\n\n```sh\n[ -e b.sh ]\n```\n')

    def test_a_configuration_shown_whole_must_be_accepted(self):
        self.passes("```toml\nschema = 1\n[partitioner]\n```\n")
        self.fails("```toml\nschema = 1\nrefused = 1\n[partitioner]\n```\n", "README.md:1: error: this configuration is refused")

    def test_shown_output_is_what_the_command_prints(self):
        self.passes("<!-- output of: printf 'a\\nb\\nc\\n' -->\n```text\na\n...\nc\n```\n")
        self.fails("<!-- output of: echo there -->\n```text\nhere\n```\n", "README.md:2: error: `echo there` prints")
        self.fails("<!-- output of: echo 'a b' -->\n```text\na.b\n```\n", "prints something else")

    def test_update_writes_what_is_printed_and_nothing_else(self):
        before = "a\n\n<!-- output of: echo one; echo two -->\n```text\n```\nb\n<!-- output of: echo x -->\n```text\n1\n2\n```\nc\n"
        self.passes(before, "--update")
        self.assertEqual(read(self.root, "README.md"),
                         before.replace("```text\n```", "```text\none\ntwo\n```").replace("1\n2\n", "x\n"))

    def test_lines_after_a_block_are_compared_with_what_it_prints(self):
        block = "```sh\nprintf 'going on\\na 1\\nb 2\\nc 3\\nend\\n'\n```\n\nIt prints\n\n"
        for shown in ("a 1\nb 2", "a 1\n...\nc 3", "going on\n...\nend", "c   3"):
            self.passes(f"{block}```text\n{shown}\n```\n")
        for shown in ("a 2", "a 1\nc 3", "b 2\n...\na 1", "b"):
            self.fails(f"{block}```text\n{shown}\n```\n", "README.md:7: error: `the block before` prints something else")

    def test_times_are_not_compared(self):
        for shown, printed in (("made in 0.5 s, 3 of them", "made in 12.75 s, 3 of them"),
                               ("x  align [ms]  y\n----------------\n1         0.75  4", "x  align [ms]  y\n----------------\n1        11.25  4"),
                               ("align [ms]  1.0  2.0", "align [ms]  1.5     20.0"), ("4 switches, 0 blocking", "4 switches, 1 blocking")):
            block = f"```sh\ncat <<'END'\n{printed}\nEND\n```\n"
            self.passes(f"{block}```text\n{shown}\n```\n")
            wrong = shown.replace("3 of", "5 of").replace("  4", "  5").replace("align [ms]  1.0", "other [ms]  1.0").replace("4 s", "5 s")
            self.fails(f"{block}```text\n{wrong}\n```\n", "prints something else")

    def test_update_replaces_lines_after_a_block_by_those_most_like_them_and_keeps_times(self):
        before = "```sh\nprintf 'first\\nerror 2.5 of all\\nmade 7 in 3 s\\n'\n```\n```text\nerror 1 of all\n...\nmade 6 in 9 s\n```\n"
        self.passes(before, "--update")
        self.assertEqual(read(self.root, "README.md"), before.replace("error 1", "error 2.5").replace("made 6", "made 7"))

    def test_every_shown_output_belongs_to_a_command_or_says_why_not(self):
        self.fails("```text\na\n```\n", "README.md:1: error: no command prints this")
        self.fails("```sh\necho a\n```\n```toml\nx = 1\n```\n```text\na\n```\n", "README.md:7: error: no command prints this")
        self.assertIn("not compared: README.md:2: a sketch", self.passes("<!-- not compared: a sketch -->\n```text\na\n```\n"))
        self.assertIn("not compared: README.md:5: its command is not run",
                      self.passes("<!-- not run: no -->\n```sh\necho b\n```\n```text\na\n```\n"))

    def test_a_block_that_needs_recorded_data_runs_where_they_are(self):
        text = "<!-- with data: street -->\n```sh\necho b\n```\n```text\nb\n```\n"
        out = self.passes(text)
        self.assertIn("not run: README.md:2: there is no recorded data street", out)
        self.assertIn("not compared: README.md:5: its command is not run", out)
        write(self.root, "data/street/map", "")
        self.assertIn("1 blocks run, 0 not run", self.passes(text, "--data", os.path.join(self.root, "data")))

    def test_a_page_that_is_needed_runs_first_and_once(self):
        code, out = self.run_pages(a="<!-- needs: z.md -->\n```sh\n[ $(wc -l <log) = 1 ]\n```\n", z="```sh\necho z >>log\n```\n")
        self.assertEqual(code, 0, out)
        with self.assertRaises(SystemExit):
            self.run_pages(a="<!-- needs: z.md -->\n", z="<!-- needs: a.md -->\n")

    def test_every_job_has_its_section(self):
        code, out = self.run_pages(commands="## vantage build\n")
        self.assertEqual(code, 1)
        self.assertIn("there is no section '## vantage plugins'", out)
        self.assertNotIn("'## vantage build'", out)

    def test_without_programs_nothing_is_claimed(self):
        os.remove(os.path.join(self.root, "build/bin/vantage"))
        with contextlib.redirect_stderr(io.StringIO()):
            self.assertEqual(self.run_pages(readme="")[0], 2)


class Links(TemporaryRoot):
    def dead(self, text):
        write(self.root, "docs/a.md", text)
        return links.dead_markdown_links(self.root, ["docs/a.md"])

    def test_links_that_lead_somewhere_are_no_fault(self):
        write(self.root, "b.md", "# A heading: `code` and [a link](x)\n\n## Twice\n\n## Twice\n```\n# no heading\n```\n")
        write(self.root, "docs/p.png", "")
        self.assertEqual(self.dead("[b](../b.md#a-heading-code-and-a-link) [c](../b.md#twice_1) ![p](p.png) [e](#own)\n## Own\n"
                                   "[out](https://example.org/x) [api](../api/index.html) `[no](link)`\n```\n[no](link)\n```\n"), [])

    def test_dead_links_are_named_with_their_place(self):
        write(self.root, "b.md", "# Here\n```\n# not here\n```\n")
        for text, fault in (("\n[b](c.md)", "docs/a.md:2: there is no docs/c.md"),
                            ("[b](../b.md#not-here)", "docs/a.md:1: b.md has no heading #not-here"),
                            ("![b](b.png)", "docs/a.md:1: there is no docs/b.png"),
                            ('<img src="b.png">', "docs/a.md:1: there is no docs/b.png")):
            self.assertEqual(self.dead(text), [fault])
        self.assertEqual(len(self.dead("[folder](../docs)")), 1)
        self.assertEqual(len(self.dead("[outside](../../other.md)")), 1)

    def page(self, body, name="a.html"):
        write(self.root, f"site/{name}", f"<html><body>{body}</body></html>")
        return links.page_faults(os.path.join(self.root, "site"))

    def test_pages_without_faults(self):
        write(self.root, "site/in/b.html", '<h1 id="x">b</h1>')
        write(self.root, "site/s.js", "")
        self.assertEqual(self.page('<a href="in/b.html#x">b</a><a href="https://example.org">out</a><script src="s.js"></script>'
                                   '<img src="data:image/png;base64,AA"><a href="#y" id="y"></a>'), [])

    def test_dead_links_and_anchors_of_pages(self):
        for body, fault in (('<a href="b.html">b</a>', "there is no b.html"),
                            ('<a href="#b">b</a>', "a.html has no anchor #b"), ('<img src="b.png">', "there is no b.png")):
            self.assertEqual(self.page(body), [f"a.html: {fault}"])

    def test_a_list_or_table_that_became_text_is_a_fault(self):
        self.assertEqual(self.page("<p>a - b\nc</p><pre>- x\n| y</pre><ul><li>- z</li></ul>"), [])
        self.assertEqual(len(self.page("<p>text\n- a <b>b</b>\n- c</p>")), 2)
        self.assertEqual(len(self.page("<p>text\n| a | b |</p>")), 1)

    def test_whatever_a_page_loads_from_another_machine_is_a_fault(self):
        for tag in ('<script src="https://example.org/x.js"></script>', '<img src="//example.org/x.png">',
                    '<link rel="stylesheet" href="http://example.org/x.css">', '<iframe src="https://example.org"></iframe>'):
            self.assertEqual(len(self.page(tag)), 1, tag)
        self.page("")
        write(self.root, "site/x.css", "@font-face { src: url('https://example.org/x.woff') }")
        self.assertEqual(links.page_faults(os.path.join(self.root, "site")), ["x.css: loads https://example.org/x.woff"])


class MakeSite(TemporaryRoot):
    def test_a_folder_that_is_no_site_is_not_replaced(self):
        write(self.root, "mine/thesis.txt", "")
        with contextlib.redirect_stderr(io.StringIO()) as err, self.assertRaises(SystemExit):
            make_site.main([os.path.join(self.root, "mine")])
        self.assertIn("is there already and is no site", err.getvalue())
        self.assertTrue(os.path.exists(os.path.join(self.root, "mine/thesis.txt")))

    def test_a_dead_link_makes_no_site(self):
        write(self.root, "README.md", "[b](b.md)\n")
        with contextlib.redirect_stderr(io.StringIO()) as err, self.assertRaises(SystemExit):
            make_site.make_site(self.root, os.path.join(self.root, "out"))
        self.assertIn("README.md:1: there is no b.md", err.getvalue())

    def test_lists_and_tables_get_the_blank_line_that_mkdocs_wants(self):
        self.assertEqual(make_site.for_mkdocs("a\n- b\n  c\n- d\n| e |\nf\n1. g"), "a\n\n- b\n  c\n- d\n| e |\nf\n\n1. g")
        for same in ("a\n\n- b\n- c\n", "```\na\n- b\n```\n", "# a\n\n| b |\n|---|\n| c |\n", "a - b\n-c\n"):
            self.assertEqual(make_site.for_mkdocs(same), same)

    def test_files_that_pages_link_to_go_with_them(self):
        write(self.root, "README.md", "[a](docs/a.md) ![p](docs/p.png) [l](LICENSE) [o](https://example.org)\n")
        for name in ("docs/a.md", "docs/p.png", "docs/unused.png", "LICENSE", "docs/site/api_mainpage.md"):
            write(self.root, name, "")
        self.assertEqual(make_site.pages(self.root), ["README.md", "docs/a.md"])
        self.assertEqual(make_site.linked_files(self.root, make_site.pages(self.root)), ["LICENSE", "docs/p.png"])


if __name__ == "__main__":
    unittest.main()
