#!/usr/bin/env python3
"""Checks that each concept has one name: fails if identifiers, --help texts or READMEs contain a former private word.

words.json lists the words. "identifiers" are matched against the parts of an identifier (kMaxOver_s has the parts k,
max, over, s) in code without comments and strings. "prose" is matched against READMEs and the string literals of
command lines. Comments are not checked. An entry may apply only to the folders in `under`; it contains the term to
`say` instead.
"""
import argparse
import json
import pathlib
import re
import sys

import sources

WORDS = pathlib.Path(__file__).with_name("words.json")
COMMENT = re.compile(r"//[^\n]*")
STRING = re.compile(r'"(?:[^"\\\n]|\\.)*"')
IDENTIFIER = re.compile(r"\b[A-Za-z_]\w*")
PART = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+")
COMMAND_LINES = ("server/app", "client/app", "lab/cli")


def parts_of(identifier):
    return {part.lower() for part in PART.findall(identifier)}


def is_meant(entry, path, identifier=""):
    if identifier in entry.get("except", ()):
        return False
    return not entry.get("under") or any(path.as_posix().startswith(folder + "/") for folder in entry["under"])


def in_identifiers(path, text, entries):
    code = STRING.sub('""', COMMENT.sub("", text))
    for identifier in set(IDENTIFIER.findall(code)):
        parts = parts_of(identifier)
        for entry in entries:
            if "whole" in entry:
                is_found = re.fullmatch(entry["whole"], identifier)
            else:
                is_found = parts & set(entry["part"].split("|"))
            if is_found and is_meant(entry, path, identifier):
                yield identifier, entry["say"]


def in_prose(path, text, entries):
    for number, line in enumerate(text.splitlines(), 1):
        for entry in entries:
            found = re.search(entry["text"], line, re.IGNORECASE)
            if found and is_meant(entry, path):
                yield f"{number}: {found.group(0)}", entry["say"]


def breaches(root, words):
    for path in sources.sources(root):
        text = (root / path).read_text(encoding="utf-8")
        for found, say in in_identifiers(path, text, words["identifiers"]):
            yield path, found, say
        if path.as_posix().startswith(COMMAND_LINES):
            strings = "\n".join(STRING.findall(COMMENT.sub("", text)))
            for found, say in in_prose(path, strings, words["prose"]):
                yield path, found.split(": ", 1)[1], say
    for folder in sources.PRODUCT + ("tests", "deploy", "."):
        pattern = "*.md" if folder == "." else "**/*.md"
        for path in sorted((root / folder).glob(pattern)):
            for found, say in in_prose(path.relative_to(root), path.read_text(encoding="utf-8"), words["prose"]):
                yield path.relative_to(root), found, say


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", type=pathlib.Path, default=sources.ROOT, help="top of the tree (default: this one)")
    arguments = parser.parse_args()
    words = json.loads(WORDS.read_text(encoding="utf-8"))
    found = sorted(set(breaches(arguments.root, words)), key=str)
    for path, what, say in found:
        print(f"{path}: {what} (say: {say})")
    print(f"words: {len(found)} private words")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
