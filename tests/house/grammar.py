#!/usr/bin/env python3
"""Measures how many comments lack a noun: those that begin without one, and those with a relative clause without one.

A comment is a run of // lines in the product and its tests, or a comment after code. Tags such as "In" and "Fails" are
not counted as words. Two percentages are measured for each folder in grammar.json. They must not exceed the ceilings
there, which may only be lowered:
  bare    begins with what, who, whoever, of, as, by, such, so or likewise
  clause  has a relative clause without a noun before it: "of what", "who has", "of those that", "by which"
--list FOLDER prints the comments that count. Exit code 0: all percentages are below the ceilings, 1: one is not.
"""
import argparse
import json
import pathlib
import re
import sys

import sources

CEILINGS = pathlib.Path(__file__).with_name("grammar.json")
FOLDERS = (*sources.PRODUCT, "tests")
STRING = re.compile(r'"(?:[^"\\\n]|\\.)*"')
LINE = re.compile(r"^(?P<code>[^\n]*?)//[/!]?<?(?P<text>[^\n]*)$")
TAG = re.compile(r"^\s*(In|Out|Fails|Model|Source|Thread|Cost|Throws|Invariant|Example)\s{2,}(\S+\s{2,})?")
BARE = re.compile(r"^(what|who|whoever|of|as|by|such|so|likewise)\b", re.IGNORECASE)
CLAUSE = re.compile(
    r"\bwhat(ever)?\b(?! if\b)|\bwhoever\b|(?:^|[.;:,(] |\b(?:of|for|to|from|by|than|and|or|with) )who\b"
    r"|\b(?:of|from|to|for|than|in|at|with|by) (?:those|that|these) (?:that|which|who|of|there)\b|(?:^|[.;] )(?:by|of|in|at|for|from) which\b"
    r"|\bso that what\b|\bas (?:they|it) (?:was|were|is|are)\b", re.IGNORECASE)


def comments_of(text):
    """Returns (number of the first line, text) for each comment."""
    found, last = [], None
    for number, line in enumerate(text.splitlines(), 1):
        match = LINE.match(STRING.sub(lambda s: '"' + "_" * (len(s.group(0)) - 2) + '"', line))
        if not match or "://" in line:
            last = None
            continue
        alone = not match["code"].strip()
        words = line[match.start("text"):].strip()
        tag = TAG.match(words + " ")
        if alone and last is not None and not tag and words:
            found[-1][1] += " " + words
        elif words:
            found.append([number, TAG.sub("", words + " ").strip() if tag else words])
        last = number if alone and words else None
    return [(number, words) for number, words in found if re.search(r"[A-Za-z]{3}", words)]


def folder_for(path, folders):
    """Returns the longest of `folders` that contains `path`."""
    name = path.as_posix()
    return max((f for f in folders if name.startswith(f + "/")), key=len, default=None)


def measure(root, folders):
    """Returns, for each folder, the number of comments, and the comments that are bare or have a clause without a noun,
    as (path, number, text)."""
    counts = {folder: {"comments": 0, "bare": [], "clause": []} for folder in folders}
    for path in sources.sources(root, folders=FOLDERS):
        folder = folder_for(path, folders)
        if folder is None:
            continue
        for number, text in comments_of((root / path).read_text(encoding="utf-8")):
            counts[folder]["comments"] += 1
            if BARE.search(text):
                counts[folder]["bare"].append((path, number, text))
            if CLAUSE.search(text):
                counts[folder]["clause"].append((path, number, text))
    return counts


def breaches(counts, ceilings):
    for folder, count in counts.items():
        for kind in ("bare", "clause"):
            share = 100 * len(count[kind]) / max(1, count["comments"])
            if share > ceilings[folder][kind]:
                yield f"{folder}: {share:.1f} % of comments are {kind}, allowed are {ceilings[folder][kind]} %"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--list", metavar="FOLDER", help="print the comments of one folder that count")
    arguments = parser.parse_args()
    ceilings = json.loads(CEILINGS.read_text(encoding="utf-8"))
    if arguments.list:
        count = measure(sources.ROOT, [arguments.list])[arguments.list]
        for kind in ("bare", "clause"):
            for path, number, text in count[kind]:
                print(f"{path}:{number}: {kind}: {text}")
        print(f"{count['comments']} comments, {len(count['bare'])} bare, {len(count['clause'])} with a clause")
        return 0
    counts = measure(sources.ROOT, ceilings)
    for folder, count in counts.items():
        total = max(1, count["comments"])
        print(f"{folder:20} {count['comments']:5} comments, bare {100 * len(count['bare']) / total:4.1f} %, "
              f"clause {100 * len(count['clause']) / total:4.1f} %")
    found = list(breaches(counts, ceilings))
    print("\n".join(found) if found else "grammar: below all ceilings")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
