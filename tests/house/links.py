#!/usr/bin/env python3
"""READMEs lead somewhere: every relative link and every path between backticks that begins with a folder of the tree."""
import argparse
import pathlib
import re
import sys

import sources

LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)]*)?\)")
PATH = re.compile(r"`((?:" + "|".join(sources.PRODUCT + ("tests", "deploy")) + r")/[\w./-]+)`")
SUFFIXES = ("", ".hpp", ".cpp", ".json", ".py", ".proto")


def dead_ends(root):
    for folder in sources.PRODUCT + ("tests", "deploy", "."):
        for page in sorted((root / folder).glob("*.md" if folder == "." else "**/*.md")):
            text = page.read_text(encoding="utf-8")
            for target in LINK.findall(text):
                if "://" not in target and not (page.parent / target).exists():
                    yield f"{page.relative_to(root)}: the link {target} leads nowhere"
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
