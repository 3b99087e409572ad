#!/usr/bin/env python3
"""Counts the data members of each class of the product, together with those of the private structs nested in it.

A class above the limit usually has several responsibilities, which could be understood, tested and replaced separately.
A struct whose members are all plain numbers, flags, times or texts describes settings and is exempt. Fails above the
limits of members.json. The file lists classes that exceed the general limit, with their present count as a ceiling that
may only be lowered.
"""
import argparse
import json
import pathlib
import re
import sys

import sources

LIMITS = pathlib.Path(__file__).with_name("members.json")
HEAD = re.compile(r"(?:^|[;{}\s])(?<!enum )(class|struct)\s+(?:\[\[\w+\]\]\s*)?((?:\w+::)*\w+)(?:\s+final)?\s*(?::[^;{}()]*(?:\{\})?[^;{}()]*)?$", re.DOTALL)
NO_MEMBER = re.compile(r"^(using|friend|static|typedef|enum|template|class|struct|union|operator|explicit|virtual|public|private|protected|~)\b")
PLAIN = re.compile(r"^(?:const\s+)?(?:double|float|bool|int|unsigned|char|(?:std::)?(?:u?int\d+_t|size_t|string|string_view|filesystem::path|chrono::\w+)"
                   r"|Duration|LocalTime|ServerTime|Vec3|std::optional<(?:double|Duration|int|std::\w+)>|std::array<(?:double|bool|float|int|char), \w+>)\s")


def bare(text):
    """Returns the text without comments, literals and preprocessor lines."""
    text = re.sub(r"//[^\n]*|/\*.*?\*/", "", text, flags=re.DOTALL)
    text = re.sub(r'R"\((.*?)\)"', '""', text, flags=re.DOTALL)
    text = re.sub(r'"(?:[^"\\\n]|\\.)*"', '""', text)
    text = re.sub(r"'(?:[^'\\\n]|\\.)+'", "0", text)
    return re.sub(r"^\s*#[^\n]*(?:\\\n[^\n]*)*", "", text, flags=re.MULTILINE)


def is_member(statement):
    """Returns whether a statement of a class body declares data."""
    statement = re.sub(r"^(?:(?:public|private|protected)\s*:\s*)+", "", statement.strip())
    statement = re.sub(r"^(?:mutable|inline|constexpr|alignas\([^)]*\))\s+", "", statement)
    if not statement or NO_MEMBER.match(statement):
        return None
    declared = re.split(r"=|\{", statement, maxsplit=1)[0]
    while True:  # removes template arguments, whose parentheses look like a function: std::function<void(int)>
        shorter = re.sub(r"<[^<>]*>", "", declared)
        if shorter == declared:
            break
        declared = shorter
    return None if "(" in declared or len(declared.split()) < 2 else statement


def classes_of(text):
    """Returns (name, members, is_plain) of each class of a source: its own data members as text, and whether all are
    plain."""
    found, stack, begin = [], [], 0
    text = bare(text)
    i = 0
    while i < len(text):
        c = text[i]
        if c == "{":
            head = text[begin:i]
            match = HEAD.search(head) if "(" not in head.split("class ")[0].split("struct ")[0] else None
            in_class = bool(stack) and stack[-1] is not None
            if match and not head.rstrip().endswith("="):
                parent = stack[-1] if in_class else None
                stack.append({"name": match.group(2), "members": [], "parent": parent, "private": match.group(1) == "class"})
                begin = i + 1
            elif re.search(r"\bnamespace\b[^;{}()]*$", head) or head.strip() == 'extern ""':
                stack.append(None)
                begin = i + 1
            else:  # body of a function or an initialiser
                depth, j = 1, i + 1
                while j < len(text) and depth:
                    depth += {"{": 1, "}": -1}.get(text[j], 0)
                    j += 1
                rest = text[j:j + 40].lstrip()
                if not in_class or not rest.startswith((";", ",")):
                    begin = j  # the body ends its statement
                i = j
                continue
        elif c == "}":
            scope = stack.pop() if stack else None
            if scope is not None:
                found.append(scope)
            begin = i + 1
        elif c == ";":
            if stack and stack[-1] is not None:
                statement = is_member(" ".join(text[begin:i].split()))
                if statement:
                    stack[-1]["members"].append(statement)
            begin = i + 1
        i += 1
    return found


def counts(root):
    """Returns the number of data members of each class as (count, path, name), with those of nested structs. Settings
    structs are excluded."""
    result = []
    for path in sources.sources(root):
        if path.suffix == ".inc":
            continue
        classes = classes_of((root / path).read_text(encoding="utf-8"))
        for each in classes:
            nested = sum(len(other["members"]) for other in classes if is_within(other, each))
            plain = each["members"] and all(PLAIN.match(member) for member in each["members"])
            if not plain:
                name = each["name"] if each["parent"] is None else f"{each['parent']['name']}::{each['name']}"
                result.append((len(each["members"]) + nested, path.as_posix(), name))
    return sorted(result, reverse=True)


def is_within(inner, outer):
    while inner["parent"] is not None:
        inner = inner["parent"]
        if inner is outer:
            return True
    return False


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", type=pathlib.Path, default=sources.ROOT, help="top of the tree (default: this one)")
    parser.add_argument("--list", type=int, metavar="N", help="prints the N largest classes")
    arguments = parser.parse_args()
    limits = json.loads(LIMITS.read_text(encoding="utf-8"))
    found = counts(arguments.root)
    for count, path, name in found[:arguments.list or 0]:
        print(f"{count:4} {name}  {path}")
    broken = 0
    known = dict(limits["larger"])
    for count, path, name in found:
        ceiling = known.pop(f"{path} {name}", limits["members"])
        if count > ceiling:
            broken += 1
            print(f"{path}: {name} has {count} data members, allowed are {ceiling}")
    for entry in known:
        broken += 1
        print(f"members.json: {entry} is not there, or is below the limit: remove the entry")
    print(f"members: {len(found)} classes, {sum(1 for count, *_ in found if count > limits['members'])} of them above {limits['members']}")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
