#!/usr/bin/env python3
"""Checks that each message quoted in TROUBLESHOOTING.md exists in a source: the first column of a row may begin with a
text in double quotes, and this text must occur in the string literals of a C++ or Python file or of a shell program."""
import argparse
import pathlib
import re
import sys

import sources

PAGE = "TROUBLESHOOTING.md"
ROW = re.compile(r'^\| "([^"|]+)"', re.MULTILINE)
LITERAL = re.compile(r'"((?:[^"\\\n]|\\.)*)"')


def literals_of(root):
    """Returns the text of all string literals. Adjacent literals, which a compiler joins, are joined."""
    texts = []
    for path in sources.sources(root, folders=sources.PRODUCT):
        text = (root / path).read_text(encoding="utf-8")
        texts.append(re.sub(r'"\s*\n\s*"', "", text))
    return "\n".join(literal for text in texts for literal in LITERAL.findall(text))


def missing(root):
    """Returns the quoted messages that no program prints."""
    literals = literals_of(root)
    return [text for text in ROW.findall((root / PAGE).read_text(encoding="utf-8")) if text not in literals]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--root", type=pathlib.Path, default=sources.ROOT, help="top of the tree (default: this one)")
    found = missing(parser.parse_args().root)
    for text in found:
        print(f'{PAGE}: no program prints "{text}"')
    print(f"messages: {len(found)} that no program prints")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
