#!/usr/bin/env python3
"""Compares the results of two versions of tandem-lab: results.json of every experiment in two folders, byte by byte.

Names that were changed on purpose (renamed.json, {"old": "new"}) are first replaced in BEFORE, wherever they are a key
or a whole string. Every difference is listed with experiment, trial, key and both values. Differences that EXPECTED
lists ({"experiment": {"key": "why"}}; "*" is any experiment) are counted separately. Exit code: 0 equal, 1 different, 2
invalid input.

    tandem-lab run --out BEFORE    # with the program before the change
    tandem-lab run --out AFTER     # with the program after the change
"""
import argparse
import json
import pathlib
import sys

RENAMED = pathlib.Path(__file__).with_name("renamed.json")


def renamed(value, names):
    if isinstance(value, dict):
        return {names.get(key, key): renamed(item, names) for key, item in value.items()}
    if isinstance(value, list):
        return [renamed(item, names) for item in value]
    return names.get(value, value) if isinstance(value, str) else value


def differences(before, after, at=""):
    """Yields (path of the value, before, after) for each leaf value that differs."""
    if isinstance(before, dict) and isinstance(after, dict):
        for key in list(before) + [key for key in after if key not in before]:
            yield from differences(before.get(key, "absent"), after.get(key, "absent"), f"{at}/{key}")
    elif isinstance(before, list) and isinstance(after, list) and len(before) == len(after):
        for index, pair in enumerate(zip(before, after)):
            yield from differences(*pair, f"{at}/{label_of(pair[1]) or index}")
    elif before != after or isinstance(before, bool) != isinstance(after, bool):
        yield at, before, after


def label_of(item):
    """Returns a label for a trial, made of the values that distinguish it from other trials. The label of any other
    item is empty."""
    keys = ("experiment", "stage", "predictor", "rtt_ms", "jitter_ms", "loss", "seed", "overrides")
    if not isinstance(item, dict) or "seed" not in item:
        return ""
    return " ".join(f"{key}={item[key]}" for key in keys if item.get(key) not in (None, {})).replace("number ", "")


def load(path, names):
    try:
        # Numbers are compared as text, so that equal values have equal bytes.
        text = json.loads(path.read_text(encoding="utf-8"), parse_float=lambda number: "number " + number)
    except (OSError, ValueError) as error:
        raise SystemExit(f"compare_results: {path}: {error}") from error
    return renamed(text, names)


def is_expected(experiment, place, expected):
    keys = {**expected.get("*", {}), **expected.get(experiment, {})}
    return any(key in place.split("/") for key in keys)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("before", type=pathlib.Path)
    parser.add_argument("after", type=pathlib.Path)
    parser.add_argument("--renamed", type=pathlib.Path, default=RENAMED, help="{old name: new name} (default: renamed.json)")
    parser.add_argument("--expected", type=pathlib.Path, help="{experiment: {key: why}} of differences that are meant")
    parser.add_argument("--most", type=int, default=40, help="differences listed an experiment (default: 40)")
    arguments = parser.parse_args()
    names = json.loads(arguments.renamed.read_text(encoding="utf-8")) if arguments.renamed.exists() else {}
    expected = json.loads(arguments.expected.read_text(encoding="utf-8")) if arguments.expected else {}
    files = sorted(path.relative_to(arguments.before) for path in arguments.before.rglob("results.json"))
    if not files:
        print(f"compare_results: no results.json under {arguments.before}", file=sys.stderr)
        return 2
    unequal = 0
    for file in files:
        experiment = file.parent.as_posix()
        if not (arguments.after / file).exists():
            print(f"{experiment}: missing after")
            unequal += 1
            continue
        found = list(differences(load(arguments.before / file, names), load(arguments.after / file, {})))
        meant = [item for item in found if is_expected(experiment, item[0], expected)]
        unmeant = [item for item in found if not is_expected(experiment, item[0], expected)]
        unequal += len(unmeant)
        print(f"{experiment}: {'equal' if not found else f'{len(unmeant)} differences, {len(meant)} that are meant'}")
        for place, old, new in unmeant[: arguments.most]:
            print(f"    {place}: {old} -> {new}")
    print(f"compare_results: {len(files)} files, {unequal} differences that are not meant")
    return 1 if unequal else 0


if __name__ == "__main__":
    sys.exit(main())
