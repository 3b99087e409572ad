#!/usr/bin/env python3
"""Checks proto/BOUNDS.md against the source tree: each source location, each constant kName and each test in it must
exist."""
import argparse
import pathlib
import re
import sys

import sources

PAGE = "proto/BOUNDS.md"
CODE = re.compile(r"`([^`]+)`")
PATH = re.compile(r"^[a-z_]+(/[\w.]+)+$")
CONSTANT = re.compile(r"^k[A-Z]\w*$")
COLUMNS = 4


def rows(text):
    """Returns the cells of each row of each table, without header rows and separator lines."""
    for line in text.splitlines():
        cells = [cell.strip() for cell in line.strip().strip("|").split(" | ")]
        if line.startswith("| `") and len(cells) == COLUMNS:
            yield cells


def places(cell):
    """Returns (path, symbol) for each place in the first cell. A symbol refers to the path before it."""
    path = None
    for code in CODE.findall(cell):
        if PATH.match(code):
            path = code
        elif path is not None:
            yield path, code


def line_of(text, symbol):
    """Returns the line in which a function, class or template with that name is defined; 0 if there is none."""
    name = rf"^(?!\s*(?://|if\b|for\b|while\b|return\b|}}))[^\n;{{}}]*\b{re.escape(symbol)}"
    found = re.search(rf"{name}(?:\([^;{{}}]*(?:\{{[^;{{}}]*\}}[^;{{}}]*)*\{{|\b[^;(){{}}]*\{{)", text, re.MULTILINE)
    return text.count("\n", 0, found.start()) + 1 if found else 0


def tests_in(root):
    return {path.stem for path in (root / "tests").rglob("*") if path.suffix in (".cpp", ".py")}


def breaches(root):
    text = (root / PAGE).read_text(encoding="utf-8")
    constants = set()
    for path in sources.sources(root):
        constants.update(re.findall(r"\bk[A-Z]\w*", (root / path).read_text(encoding="utf-8")))
    tests = tests_in(root)
    count = 0
    for where, _, bound, shown in rows(text):
        count += 1
        if not list(places(where)):
            yield f"{where}: names no place as `path` `symbol`"
        for path, symbol in places(where):
            if not (root / path).is_file():
                yield f"{path} does not exist"
            elif not line_of((root / path).read_text(encoding="utf-8"), symbol):
                yield f"{path} has no {symbol}"
        for code in CODE.findall(bound):
            if CONSTANT.match(code) and code not in constants:
                yield f"{where}: there is no constant {code}"
        names = CODE.findall(shown)
        if not names and not shown.startswith("no test: "):
            yield f"{where}: names no test, and not why"
        for name in names:
            if name not in tests:
                yield f"{where}: there is no test {name}"
    if count == 0:
        yield f"{PAGE} has no rows"


def lines(root):
    for where, fed_by, bound, shown in rows((root / PAGE).read_text(encoding="utf-8")):
        for path, symbol in places(where):
            line = line_of((root / path).read_text(encoding="utf-8"), symbol)
            yield f"{path}:{line} {symbol} | {fed_by} | {bound} | {shown}"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--root", type=pathlib.Path, default=sources.ROOT, help="top of the tree (default: this one)")
    parser.add_argument("--lines", action="store_true", help="print every place as file:line, with what its row says")
    arguments = parser.parse_args()
    if arguments.lines:
        print("\n".join(lines(arguments.root)))
        return 0
    found = list(breaches(arguments.root))
    for line in found:
        print(line)
    count = len(list(rows((arguments.root / PAGE).read_text(encoding="utf-8"))))
    print(f"bounds: {count} rows, {len(found)} that are not true")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
