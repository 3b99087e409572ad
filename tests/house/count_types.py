#!/usr/bin/env python3
"""Measures the size of the product: shared types, modules, functions and lines of code. Fails above limits.json.

A type is a match of `class|struct|enum class NAME … {` in a header, including nested types. It is shared if another
top-level folder includes its header. A module is the name that a header and a source share in one folder. The length of
a function is the number of lines between its braces, for functions at the outermost level of a source. Lines of code
are neither blank nor only a comment; each top-level folder has a ceiling. There is no limit for the length of a file or
the number of all types: it could be met by splitting classes, without any benefit. members.py measures classes.
"""
import argparse
import collections
import json
import pathlib
import re
import statistics
import sys

import sources

LIMITS = pathlib.Path(__file__).with_name("limits.json")
TYPE = re.compile(r"^[ \t]*(?:template\s*<[^;{]*>\s*)?(?:class|struct|enum class)\s+(?:\[\[\w+\]\]\s*)?(\w+)[^;{}()]*\{", re.MULTILINE)
NO_FUNCTION = re.compile(r"(namespace|class|struct|enum|union|extern)\b")
NAMESPACE = re.compile(r"^namespace ([\w:]+) \{", re.MULTILINE)


def types_of(text):
    """Returns the names of the types that a header defines, including nested ones."""
    return TYPE.findall(re.sub(r"//[^\n]*", "", text))


def outer_types_of(text):
    """Returns the names of the types at the outermost level, whose line is not indented."""
    return [match.group(1) for match in TYPE.finditer(re.sub(r"//[^\n]*", "", text)) if match.group(0)[0] not in " \t"]


def function_lengths(text):
    """Returns the number of lines between the braces of each function at the outermost level of a source, in the layout
    of clang-format."""
    lengths, begin, signature = [], None, ""
    for number, line in enumerate(text.splitlines()):
        if begin is not None:
            if line.startswith("}"):
                lengths.append(number - begin - 1)
                begin = None
            continue
        is_continued = signature and line.startswith(" ")
        signature = signature + line if is_continued else line
        if not is_continued and (not line or line[0] in " \t#/}" or NO_FUNCTION.match(line)):
            signature = ""
        elif signature.endswith("{"):
            if "(" in signature and not signature.endswith("= {"):
                begin = number
            signature = ""
        elif signature.endswith(";"):
            signature = ""
    return lengths


def code_lines(text):
    """Returns the number of lines of a source that are neither blank nor only a comment."""
    return sum(1 for line in re.sub(r"//[^\n]*", "", text).splitlines() if line.strip())


def shared_headers(root):
    """Returns the headers that a source of another top-level folder includes."""
    return {name for path in sources.sources(root) for name in sources.includes(path, root)[0]
            if name.split("/")[0] in sources.PRODUCT and name.split("/")[0] != path.parts[0]}


def measure(root):
    shared_by = shared_headers(root)
    modules, shared, outer = collections.defaultdict(set), 0, 0
    by_folder, code = collections.Counter(), collections.Counter()
    lengths = []
    for path in sources.sources(root):
        text = (root / path).read_text(encoding="utf-8")
        code[path.parts[0]] += code_lines(text)
        if path.suffix in (".hpp", ".cpp"):
            modules[sources.folder_of(path)].add(path.stem)
        if path.suffix == ".hpp":
            count = len(types_of(text))
            by_folder[sources.folder_of(path)] += count
            shared += count if path.as_posix() in shared_by else 0
            if NAMESPACE.findall(text) and set(NAMESPACE.findall(text)) == {"tandem"}:
                outer += len(outer_types_of(text))
        elif path.suffix == ".cpp":
            lengths += function_lengths(text)
    lengths.sort()
    widest = max(modules, key=lambda folder: len(modules[folder]))
    return {
        "types_shared_by_folders": shared,
        "types_directly_in_tandem": outer,
        "modules_in_largest_folder": len(modules[widest]),
        "function_lines_median": statistics.median(lengths),
        "function_lines_p90": lengths[int(0.9 * len(lengths))],
        **{f"code_lines_of_{folder}": code[folder] for folder in sources.PRODUCT},
    }, by_folder, (widest, len(lengths))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", type=pathlib.Path, default=sources.ROOT, help="top of the tree (default: this one)")
    parser.add_argument("--folders", action="store_true", help="types in headers, folder by folder")
    arguments = parser.parse_args()
    limits = json.loads(LIMITS.read_text(encoding="utf-8"))
    figures, by_folder, (widest, functions) = measure(arguments.root)
    if arguments.folders:
        for folder, count in sorted(by_folder.items(), key=lambda item: -item[1]):
            print(f"{count:4} {folder}")
    broken = 0
    for name, value in figures.items():
        is_broken = value > limits[name]
        broken += is_broken
        print(f"{name:28} {value:6}  limit {limits[name]:6}{'   TOO MANY' if is_broken else ''}")
    print(f"largest folder: {widest}; functions measured: {functions}")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
