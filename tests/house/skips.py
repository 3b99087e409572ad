#!/usr/bin/env python3
"""Checks that no test omits its claim without a record. Only the helpers may skip a test; they fail, or count the claim
as left out."""
import argparse
import ast
import pathlib
import re
import sys

import sources

# The helpers (tests/README.md), and the examples in tests of these rules.
HELPERS = {"tests/support/needs.hpp", "tests/support/needs.py", "tests/system/support.py", "tests/system/support_test.py"}
SKIPS = {
    ".cpp": r"GTEST_SKIP\b|TEST(?:_F|_P)?\([\w, ]*\bDISABLED_|\bIsSkipped\(",
    ".py": r"\bskip(?:Test|If|Unless)\b|\bunittest\.skip\b|\bSkipTest\b|\baddSkip\b|\bexpectedFailure\b|\b(?:exit|return)\b\W*77\b",
    ".cmake": r"\bSKIP_(?:RETURN_CODE|REGULAR_EXPRESSION)\b|\bDISABLED\b|\bif\s*\(\s*Python3_FOUND",
}
SKIPS[".hpp"] = SKIPS[".cpp"]
SKIPS[".sh"] = r"\bexit 77\b"


# Names of measured speeds. A claim that is made only above some speed would be omitted on a slow machine.
SPEED = re.compile(r"tick_rate|rate_hz|cpu_count|loadavg|elapsed|is_busy|too_slow")


def is_claim(node):
    call = node.func if isinstance(node, ast.Call) else None
    return isinstance(call, ast.Attribute) and (call.attr.startswith("assert") or call.attr == "fail")


def claims_at_a_speed(text):
    """Yields the lines of Python code in which a claim depends on a measured speed."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.If) and SPEED.search(ast.unparse(node.test)):
            if any(is_claim(inner) for statement in node.body + node.orelse for inner in ast.walk(statement)):
                yield node.lineno


def kind_of(path):
    return ".cmake" if path.name == "CMakeLists.txt" else path.suffix


def bare_skips(root):
    """Returns the lines of tests that skip without the helpers."""
    paths = [*(root / "tests").rglob("*"), *(root / "cmake").rglob("*.cmake")]
    for path in sorted(paths):
        name = path.relative_to(root).as_posix()
        pattern = SKIPS.get(kind_of(path))
        if pattern is None or not path.is_file() or name in HELPERS or name.startswith("tests/house/"):
            continue
        text = path.read_text(encoding="utf-8")
        if path.suffix == ".py":
            for number in claims_at_a_speed(text):
                yield f"{name}:{number}: the claim depends on a speed; make it in a form that holds at any"
        for number, line in enumerate(text.splitlines(), 1):
            found = re.search(pattern, line)
            if found:
                yield f"{name}:{number}: {found.group(0)} skips in silence; use tests/support/{'needs.py' if path.suffix == '.py' else 'needs.hpp'}"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--root", type=pathlib.Path, default=sources.ROOT, help="top of the tree (default: this one)")
    found = list(bare_skips(parser.parse_args().root))
    for line in found:
        print(line)
    print(f"skips: {len(found)} that are neither a failure nor counted")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
