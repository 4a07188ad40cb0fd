"""Links that lead nowhere: between the Markdown files of the project, and in the pages made of them.

`dead_markdown_links` looks at the sources as they are read in the repository, `page_faults` at the built site:
links, anchors, and whether a page asks another machine for anything. Standard library only.
"""
import html.parser
import os
import re
import urllib.parse

MADE_WITH_THE_SITE = "api/"  # exists on the site only: Doxygen's
NO_ANCHORS_OF_OURS = ("#nested-classes",)  # Doxygen 1.9 links it where all nested classes are private


def is_outside(target):
    """Whether a link has a scheme or a host of its own."""
    parts = urllib.parse.urlsplit(target)
    return bool(parts.scheme or parts.netloc)


def without_code(text):
    """The same lines, those of fenced blocks empty and code spans gone."""
    lines, fence = [], None
    for line in text.split("\n"):
        mark = re.match(r"\s*(```+|~~~+)", line)
        if fence is None and mark:
            fence = mark.group(1)
            lines.append("")
        elif fence is not None:
            if line.strip().startswith(fence):
                fence = None
            lines.append("")
        else:
            lines.append(re.sub(r"(`+)(?!`).*?(?<!`)\1(?!`)", "", line))
    return lines


def markdown_links(text):
    """(line number, target) of each link and picture, in order."""
    found = []
    for number, line in enumerate(without_code(text), 1):
        for match in re.finditer(r"\]\(\s*<?([^)\s>]+)>?(?:\s+\"[^\"]*\")?\s*\)", line):
            found.append((number, match.group(1)))
        for match in re.finditer(r"(?:href|src)=\"([^\"]+)\"", line):
            found.append((number, match.group(1)))
    return found


def heading_anchors(text):
    """Anchors of the headings, as both mkdocs and GitHub form them for plain ASCII headings."""
    anchors, fence = {}, None
    for line in text.split("\n"):
        mark = re.match(r"\s*(```+|~~~+)", line)
        if mark and (fence is None or line.strip().startswith(fence)):
            fence = None if fence else mark.group(1)
        if fence is not None:
            continue
        heading = re.match(r"#{1,6}\s+(.*?)\s*#*$", line)
        if heading:
            plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading.group(1)).replace("`", "").replace("\\", "")
            slug = re.sub(r"[-\s]+", "-", re.sub(r"[^\w\s-]", "", plain).strip().lower())
            count = anchors.get(slug, 0)
            anchors[slug] = count + 1
            if count:
                anchors[f"{slug}_{count}"] = 1
    return set(anchors) | set(re.findall(r"<a (?:id|name)=\"([^\"]+)\"", text))


def dead_markdown_links(root, files):
    """One line `file:line: ...` for each link of `files` that leads nowhere in the folder `root`."""
    faults = []
    for name in files:
        with open(os.path.join(root, name), encoding="utf-8") as file:
            text = file.read()
        for line, target in markdown_links(text):
            if is_outside(target):
                continue
            path, _, anchor = target.partition("#")
            there = os.path.normpath(os.path.join(os.path.dirname(name), urllib.parse.unquote(path))) if path else name
            place = f"{name}:{line}: "
            if there.startswith(MADE_WITH_THE_SITE):
                continue
            full = os.path.join(root, there)
            if there.startswith("..") or not os.path.exists(full):
                faults.append(f"{place}there is no {there}")
            elif os.path.isdir(full):
                faults.append(f"{place}{target} is a folder, which a page cannot show: name a file in it")
            elif anchor and there.endswith(".md"):
                with open(full, encoding="utf-8") as file:
                    if anchor not in heading_anchors(file.read()):
                        faults.append(f"{place}{there} has no heading #{anchor}")
    return faults


class Page(html.parser.HTMLParser):
    """What a page links to, what it loads, and what can be linked to in it."""

    LOADS = {"script": ("src",), "img": ("src", "srcset"), "link": ("href",), "iframe": ("src",), "source": ("src", "srcset"),
             "object": ("data",), "embed": ("src",), "video": ("src", "poster"), "audio": ("src",), "input": ("src",)}

    def __init__(self, text):
        super().__init__(convert_charrefs=True)
        self.links, self.loads, self.anchors, self.misread = [], [], set(), []
        self.paragraph, self.in_code = None, False
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        values = {key: value for key, value in attributes if value is not None and not re.match(r"(data|javascript):", value)}
        self.anchors.update(values[key] for key in ("id", "name") if key in values)
        if tag == "p":
            self.paragraph = ""
        elif tag == "code":
            self.in_code = True
        if tag in ("a", "area") and "href" in values:
            self.links.append(values["href"])
        for key in self.LOADS.get(tag, ()):
            if key in values:
                self.loads.append(values[key])

    def handle_endtag(self, tag):
        if tag == "p" and self.paragraph is not None:
            self.misread += re.findall(r"^(?:- |\| |#+ |```|\d+\. ).*", self.paragraph, re.MULTILINE)
            self.paragraph = None
        elif tag == "code":
            self.in_code = False

    def handle_data(self, data):
        if self.paragraph is not None:
            self.paragraph += "code" if self.in_code else data


def page_faults(site):
    """One line a fault of the pages in the folder `site`."""
    pages, faults = {}, []
    for folder, _, names in os.walk(site):
        for name in sorted(names):
            if name.endswith(".html"):
                path = os.path.join(folder, name)
                with open(path, encoding="utf-8") as file:
                    pages[os.path.relpath(path, site)] = Page(file.read())
            elif name.endswith(".css"):
                with open(os.path.join(folder, name), encoding="utf-8") as file:
                    for target in re.findall(r"url\(\s*['\"]?([^'\")]+)", file.read()):
                        if is_outside(target) and not target.startswith("data:"):
                            faults.append(f"{os.path.relpath(os.path.join(folder, name), site)}: loads {target}")
    for name, page in sorted(pages.items()):
        if os.path.basename(name) == "404.html":
            continue  # its links are meant from the root of a server
        if not name.startswith(MADE_WITH_THE_SITE):
            faults += [f"{name}: meant as a list, a table or a block, but is text: {text}" for text in page.misread]
        for target in page.loads:
            if is_outside(target):
                faults.append(f"{name}: loads {target} from another machine")
        for target in page.links + [t for t in page.loads if not is_outside(t)]:
            if is_outside(target) or name.startswith(MADE_WITH_THE_SITE) and target.endswith(NO_ANCHORS_OF_OURS):
                continue
            path, _, anchor = target.partition("#")
            path = urllib.parse.unquote(path.partition("?")[0])
            there = os.path.normpath(os.path.join(os.path.dirname(name), path)) if path else name
            if not os.path.isfile(os.path.join(site, there)):
                faults.append(f"{name}: there is no {target}")
            elif anchor and there in pages and urllib.parse.unquote(anchor) not in pages[there].anchors:
                faults.append(f"{name}: {there} has no anchor #{anchor}")
    return faults
