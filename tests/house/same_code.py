#!/usr/bin/env python3
"""Proves that only comments have changed: compares the tokens of every source in two commits, without comments.

BEFORE and AFTER are commits of this repository; without AFTER the working tree is compared. C++ and .proto files are
compared by tokens (adjacent string literals are one token), Python files by tokens without docstrings, CMake and shell
files by lines without comments. Other files are not code. --map FILE gives a JSON object of old to new identifiers;
such a renaming does not count as a difference. --strings lists string literals that differ and counts them separately.
Exit code 0: the code is the same, 1: it is not (the first difference of each file is printed), 2: wrong arguments.
"""
import argparse
import io
import json
import pathlib
import re
import subprocess
import sys
import tokenize

import sources

C_FAMILY = (".cpp", ".hpp", ".inc", ".h", ".c", ".cu", ".proto", ".js")
LINES = (".cmake", ".sh", "CMakeLists.txt")
TOKEN = re.compile(
    r"""(?P<comment>//(?:\\\n|[^\n])*|/\*.*?\*/)
      | (?P<raw>\b(?:u8|[uUL])?R"(?P<mark>[^()\\\s]{0,16})\(.*?\)(?P=mark)")
      | (?P<string>(?:\b(?:u8|[uUL]))?"(?:[^"\\\n]|\\.)*")
      | (?P<number>\.?\d(?:'?[\w.]|(?<=[eEpP])[+-])*)
      | (?P<char>(?:\b(?:u8|[uUL]))?'(?:[^'\\\n]|\\.)+')
      | (?P<word>[A-Za-z_]\w*)
      | (?P<line>\n)
      | (?P<other>[^\s])""",
    re.VERBOSE | re.DOTALL)


def c_tokens(text):
    """Returns words, numbers and symbols. The end of a line is a token only after a preprocessor directive."""
    tokens, in_directive, at_start = [], False, True
    for found in TOKEN.finditer(text.replace("\\\n", " ")):
        kind, value = found.lastgroup, found.group(0)
        if kind == "mark":
            kind = "raw"
        if kind == "comment":
            continue
        if kind == "line":
            if in_directive:
                tokens.append("\n")
            in_directive, at_start = False, True
            continue
        if at_start and value == "#":
            in_directive = True
        at_start = False
        is_text = kind == "string" and value.startswith('"')
        if is_text and tokens and tokens[-1].startswith('"') and not in_directive:
            tokens[-1] = tokens[-1][:-1] + value[1:]
        else:
            tokens.append(value)
    return tokens


def python_tokens(text):
    tokens, is_statement = [], True
    skipped = {tokenize.COMMENT, tokenize.NL, tokenize.ENCODING}
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type in skipped:
            continue
        is_docstring = token.type == tokenize.STRING and is_statement
        is_statement = token.type in (tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT)
        if is_docstring:
            is_statement = True
            continue
        # The layout is part of the code: joining two statements changes the code.
        layout = (tokenize.INDENT, tokenize.DEDENT, tokenize.NEWLINE)
        if token.type != tokenize.ENDMARKER:
            tokens.append(tokenize.tok_name[token.type] if token.type in layout else token.string)
    return tokens


def line_tokens(text):
    return [word for line in text.splitlines() for word in re.sub(r"(^|\s)#(?!!).*", "", line).split()]


def tokens_of(name, text):
    """Returns the tokens of a file, or None if the file is not code."""
    path = pathlib.PurePosixPath(name)
    if path.suffix in C_FAMILY:
        return c_tokens(text)
    if path.suffix == ".py" or text.startswith("#!/usr/bin/env python3"):
        return python_tokens(text)
    if path.name.endswith(LINES) or text.startswith("#!/"):
        return line_tokens(text)
    return None


def git(root, *arguments):
    return subprocess.run(["git", "-C", str(root), *arguments], check=True, capture_output=True).stdout


def changed_files(root, before, after):
    ends = [before] + ([after] if after else [])
    names = git(root, "diff", "--no-renames", "--name-only", "-z", *ends).decode().split("\0")
    return [name for name in names if name]


def text_at(root, commit, name):
    """Returns the content of a file, or an empty text if it does not exist there."""
    try:
        data = git(root, "show", f"{commit}:{name}") if commit else (root / name).read_bytes()
    except (subprocess.CalledProcessError, FileNotFoundError):
        return ""
    return data.decode("utf-8", errors="replace")


def is_string(token):
    return token.endswith('"') and '"' in token[:4]


def difference(one, two, renamed, ignores_strings):
    """Returns a description of the first difference of two lists of tokens (None if they are equal), and the strings
    that differ."""
    strings = []
    for n in range(max(len(one), len(two))):
        a = one[n] if n < len(one) else "(end)"
        b = two[n] if n < len(two) else "(end)"
        if a == b or renamed.get(a) == b:
            continue
        if ignores_strings and is_string(a) and is_string(b):
            strings.append((a, b))
            continue
        return f"{' '.join(one[max(0, n - 4):n + 5])}\n    in place of it: {' '.join(two[max(0, n - 4):n + 5])}", strings
    return None, strings


def compare(root, before, after, renamed, ignores_strings):
    """Returns (name, first difference) for each file whose code differs, and the strings that differ."""
    breaches, strings = [], []
    for name in changed_files(root, before, after):
        old, new = text_at(root, before, name), text_at(root, after, name)
        one, two = tokens_of(name, old) or [], tokens_of(name, new) or []
        found, texts = difference(one, two, renamed, ignores_strings)
        strings += [(name, *pair) for pair in texts]
        if found:
            breaches.append((name, found))
    return breaches, strings


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("before", help="a commit")
    parser.add_argument("after", nargs="?", default="", help="a later commit; default: the working tree")
    parser.add_argument("--map", type=pathlib.Path, help="JSON object of renamed identifiers, old to new")
    parser.add_argument("--strings", action="store_true", help="list string literals that differ, and allow them")
    arguments = parser.parse_args()
    renamed = json.loads(arguments.map.read_text(encoding="utf-8")) if arguments.map else {}
    try:
        breaches, strings = compare(sources.ROOT, arguments.before, arguments.after, renamed, arguments.strings)
    except subprocess.CalledProcessError as error:
        parser.error(error.stderr.decode().strip())
    for name, found in breaches:
        print(f"{name}: {found}")
    for name, old, new in strings:
        print(f"{name}: string {old} is now {new}")
    print(f"same_code: {len(breaches)} files with other code, {len(strings)} other strings")
    return 1 if breaches else 0


if __name__ == "__main__":
    sys.exit(main())
