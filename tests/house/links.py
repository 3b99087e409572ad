#!/usr/bin/env python3
"""Checks the links of READMEs: every relative link, every anchor in it, and every path between backticks that begins
with a folder of the tree must exist. An anchor is a heading in lower case without punctuation, with hyphens for
spaces."""
import argparse
import pathlib
import re
import sys

import sources

LINK = re.compile(r"\]\(([^)#\s]*)(?:#([^)\s]*))?\)")
FENCE = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)
HEADING = re.compile(r"^#{1,6}\s+(.*?)\s*#*$", re.MULTILINE)
PATH = re.compile(r"`((?:" + "|".join(sources.PRODUCT + ("tests", "deploy")) + r")/[\w./-]+)`")
SUFFIXES = ("", ".hpp", ".cpp", ".json", ".py", ".proto")


def anchors_of(text):
    """Returns the anchors of a page's headings, as GitHub forms them. A repeated heading gets a number."""
    found = set()
    for heading in HEADING.findall(FENCE.sub("", text)):
        words = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading)
        anchor = re.sub(r"[^\w\- ]", "", words.lower()).replace(" ", "-")
        number = 0
        while (name := anchor if number == 0 else f"{anchor}-{number}") in found:
            number += 1
        found.add(name)
    return found


def dead_ends(root):
    for folder in sources.PRODUCT + ("tests", "deploy", "."):
        for page in sorted((root / folder).glob("*.md" if folder == "." else "**/*.md")):
            text = page.read_text(encoding="utf-8")
            for target, anchor in LINK.findall(text):
                if "://" in target:
                    continue
                file = page.parent / target if target else page
                if not file.exists():
                    yield f"{page.relative_to(root)}: the link {target} leads nowhere"
                elif anchor and file.suffix == ".md" and anchor not in anchors_of(file.read_text(encoding="utf-8")):
                    yield f"{page.relative_to(root)}: {target or 'the page'} has no heading for #{anchor}"
            for path in PATH.findall(text):
                if not any((root / (path.rstrip("/") + suffix)).exists() for suffix in SUFFIXES):
                    yield f"{page.relative_to(root)}: there is no {path}"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--root", type=pathlib.Path, default=sources.ROOT, help="top of the tree (default: this one)")
    found = list(dead_ends(parser.parse_args().root))
    for line in found:
        print(line)
    print(f"links: {len(found)} that lead nowhere")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
