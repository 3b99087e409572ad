#!/usr/bin/env python3
"""Checks which folder may include which. Reads every #include of the product and fails if includes.txt does not permit
it.

includes.txt has a line for each group of folders, in the order of dependency. An entry for a folder applies to all
folders below it. Files of one folder may always include each other.

    FOLDER: WHAT IT MAY INCLUDE ...              folders, or single headers
    HEADER: WHAT IT MAY INCLUDE ...              a header of a lower layer than the rest of its folder
    library PREFIX: FOLDERS THAT MAY INCLUDE IT  for headers of other projects
"""
import argparse
import pathlib
import sys

import sources

TABLE = pathlib.Path(__file__).with_name("includes.txt")


def read_table(path):
    """Returns ({folder: [allowed folders]}, {library prefix: [folders]}) from includes.txt."""
    folders, libraries = {}, {}
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        line = line.split("#")[0].strip()
        if not line:
            continue
        name, colon, allowed = line.partition(":")
        if not colon:
            raise SystemExit(f"{path}:{number}: expected 'FOLDER: FOLDERS', found '{line}'")
        if name.startswith("library "):
            libraries[name.split()[1]] = allowed.split()
        else:
            folders[name.strip()] = allowed.split()
    return folders, libraries


def is_below(folder, parent):
    return folder == parent or folder.startswith(parent + "/")


def rule_for(path, folders):
    """Returns the longest entry of the table that is this path or a folder above it; None if there is none."""
    return max((name for name in folders if is_below(path, name)), key=len, default=None)


def breaches(root, folders, libraries):
    for path in sources.sources(root):
        folder = sources.folder_of(path)
        rule = rule_for(path.as_posix(), folders)
        if rule is None:
            yield f"{path}: no line of includes.txt speaks of its folder"
            continue
        ours, others = sources.includes(path, root)
        for name in ours:
            target = sources.folder_of(name)
            if not (root / name).exists():
                # Generated headers are exempt: those of the Protobuf schema, and a list that CMake writes beside its
                # only reader.
                if not name.startswith(("tandem/", "google/protobuf/")) and "/" in name:
                    yield f'{path}: "{name}" is not a path from the top of the tree'
            elif not is_below(target, rule) and not any(name == allowed or is_below(target, allowed) for allowed in folders[rule]):
                yield f"{path}: {rule} may not include {name}"
        for name in others:
            for prefix, allowed in libraries.items():
                if name.startswith(prefix) and not any(is_below(folder, place) for place in allowed):
                    yield f"{path}: <{name}> belongs in {', '.join(allowed)} alone"


def cycles(folders):
    """Returns the folders of the table that depend on themselves, directly or through other folders."""
    def reached(start):
        seen, stack = set(), list(folders[start])
        while stack:
            name = stack.pop()
            # A header without an entry of its own may have fewer dependencies than its folder.
            rule = name if name in folders else None if name.endswith(".hpp") else rule_for(name, folders)
            for known in [rule] if rule else []:
                if known not in seen:
                    seen.add(known)
                    stack += folders[known]
        return seen

    return [name for name in folders if name in reached(name)]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", type=pathlib.Path, default=sources.ROOT, help="top of the tree (default: this one)")
    parser.add_argument("--edges", action="store_true", help="print the edges that there are instead of judging them")
    arguments = parser.parse_args()
    folders, libraries = read_table(TABLE)
    if arguments.edges:
        edges = {}
        for path in sources.sources(arguments.root):
            for name in sources.includes(path, arguments.root)[0]:
                if sources.folder_of(name) != sources.folder_of(path) and (arguments.root / name).exists():
                    edges.setdefault((sources.folder_of(path), sources.folder_of(name)), []).append(path.name)
        for (source, target), files in sorted(edges.items()):
            print(f"{source} -> {target}: {' '.join(sorted(set(files)))}")
        return 0
    found = list(breaches(arguments.root, folders, libraries))
    found += [f"includes.txt: {name} depends on itself" for name in cycles(folders)]
    for line in found:
        print(line)
    print(f"includes: {len(sources.sources(arguments.root))} files, {len(found)} edges that the table does not allow")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
