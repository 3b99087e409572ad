#!/usr/bin/env python3
"""Fuzzes all readers of external bytes with Clang's libFuzzer under AddressSanitizer and UndefinedBehaviorSanitizer.

The targets are built in build/fuzz. Each starts from the seeds of the real writers, the earlier inputs in
corpus/TARGET.txt and the corpus of the last run (build/fuzz/corpus). Inputs that cause a failure are stored in
build/fuzz/findings; the exit code is then 1.
"""

import argparse
import concurrent.futures
import glob
import os
import pathlib
import re
import shutil
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
SOURCE = HERE.parents[1]
BUILD = SOURCE / "build" / "fuzz"
README = HERE / "README.md"
MARKS = ("<!-- runs -->\n", "<!-- end of runs -->")
# Limits for one input. No message, datagram or file of a test is longer. An input that exceeds the time or the memory
# is a finding.
MAX_BYTES, MAX_SECONDS, MAX_MEMORY_MB = 65536, 60, 2048
# Limits for the committed inputs: only small inputs that reach new code are stored.
KEPT_INPUTS, KEPT_BYTES = 150, 600
COLUMNS = ("target", "minutes", "inputs", "inputs/s", "edges reached", "findings")


def build():
    flags = ["-DCMAKE_CXX_COMPILER=clang++", "-DCMAKE_BUILD_TYPE=RelWithDebInfo", "-DTANDEM_WERROR=OFF", "-DTANDEM_PCH=OFF",
             "-DTANDEM_SANITIZE=fuzzer-no-link,address,undefined", "-DTANDEM_FUZZER_FLAGS=-fsanitize=fuzzer",
             "-DCMAKE_CXX_FLAGS=-DFUZZING_BUILD_MODE_UNSAFE_FOR_PRODUCTION"]
    subprocess.run(["cmake", "-S", SOURCE, "-B", BUILD, "-G", "Ninja", *flags], check=True, stdout=subprocess.DEVNULL)
    lines = [line.split() for line in (BUILD / "tests" / "fuzz" / "targets.txt").read_text().splitlines()]
    writers = [line[1:] for line in lines if line[0] == "seeds"]
    targets = {line[1]: pathlib.Path(line[2]) for line in lines if line[0] == "target"}
    subprocess.run(["cmake", "--build", BUILD, "--target", *targets, *(name for name, *_ in writers)], check=True)
    for name, *arguments in writers:
        subprocess.run([BUILD / "bin" / name, *arguments], check=True, stdout=subprocess.DEVNULL)
    return targets


def inputs_of(target, seeds):
    """Creates the folder with all raw inputs for the start of a target, and returns it."""
    folder = BUILD / "corpus" / target
    folder.mkdir(parents=True, exist_ok=True)
    lines = [file.read_text() for file in sorted(seeds.glob("*.hex"))]
    kept = HERE / "corpus" / f"{target}.txt"
    if kept.exists():
        lines += kept.read_text().splitlines()
    for number, line in enumerate(lines):
        (folder / f"seed{number}").write_bytes(bytes.fromhex("".join(line.split())))
    return folder


def fuzz(target, seeds, seconds):
    """Fuzzes one target. Returns its row of the table."""
    folder = inputs_of(target, seeds)
    findings = BUILD / "findings" / target
    findings.mkdir(parents=True, exist_ok=True)
    command = [BUILD / "bin" / target, f"-max_total_time={seconds}", f"-max_len={MAX_BYTES}", f"-timeout={MAX_SECONDS}",
               f"-rss_limit_mb={MAX_MEMORY_MB}", f"-artifact_prefix={findings}/", "-print_final_stats=1", folder]
    with open(BUILD / f"{target}.log", "w", encoding="utf-8") as log:
        code = subprocess.run(command, stdout=log, stderr=subprocess.STDOUT, check=False).returncode
    text = (BUILD / f"{target}.log").read_text(errors="replace")
    stat = {name: int(number) for name, number in re.findall(r"stat::(\w+):\s+(\d+)", text)}
    edges = [int(number) for number in re.findall(r" cov: (\d+) ", text)]
    runs = stat.get("number_of_executed_units", 0)
    if code != 0:
        print(f"{target}: see {BUILD}/{target}.log and {findings}/", file=sys.stderr)
    return [target, f"{seconds / 60:.3g}", runs, stat.get("average_exec_per_sec", 0), max(edges, default=0), int(code != 0)]


def keep(target):
    """Writes a minimal set of small inputs with the same coverage to corpus/TARGET.txt."""
    least = BUILD / "least" / target
    shutil.rmtree(least, ignore_errors=True)
    least.mkdir(parents=True)
    subprocess.run([BUILD / "bin" / target, "-merge=1", f"-max_len={KEPT_BYTES}", least, BUILD / "corpus" / target], check=True,
                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    inputs = sorted((pathlib.Path(name).read_bytes() for name in glob.glob(f"{least}/*")), key=lambda data: (len(data), data))
    lines = [data.hex() for data in inputs if 0 < len(data) <= KEPT_BYTES]
    (HERE / "corpus").mkdir(exist_ok=True)
    (HERE / "corpus" / f"{target}.txt").write_text("".join(line + "\n" for line in lines[:KEPT_INPUTS]))


def table(rows):
    lines = [COLUMNS, ["---"] * len(COLUMNS), *rows]
    return "".join("| " + " | ".join(map(str, line)) + " |\n" for line in lines)


def rows_with(old, rows, targets):
    """Returns the rows of the existing table, updated by those of this run, in the order of the targets."""
    cells = [[cell.strip() for cell in line.strip("| ").split("|")] for line in old.splitlines()[2:]]
    of = {row[0]: row for row in cells + rows}
    return [of[name] for name in targets if name in of]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("targets", nargs="*", metavar="TARGET", help="a file of this folder without .cpp (default: all)")
    parser.add_argument("--seconds", type=int, default=600, help="for each target [s] (default 600)")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="targets at a time (default: as many as processors)")
    parser.add_argument("--keep", action="store_true", help="put the smallest inputs that reach most into corpus/")
    parser.add_argument("--write", action="store_true", help="put the table into README.md")
    arguments = parser.parse_args()
    if arguments.seconds < 1 or arguments.jobs < 1:
        parser.error("--seconds and --jobs must be at least 1")
    if shutil.which("clang++") is None:
        parser.error("no clang++; install Debian package clang")
    targets = build()
    unknown = set(arguments.targets) - set(targets)
    if unknown:
        parser.error(f"no such target: {', '.join(sorted(unknown))}; there are {', '.join(targets)}")
    chosen = arguments.targets or list(targets)
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        rows = list(pool.map(lambda name: fuzz(name, targets[name], arguments.seconds), chosen))
    if arguments.keep:
        for name in chosen:
            keep(name)
    print(table(rows), end="")
    if arguments.write:
        before, rest = README.read_text().split(MARKS[0])
        old, after = rest.split(MARKS[1])
        README.write_text(before + MARKS[0] + table(rows_with(old, rows, list(targets))) + MARKS[1] + after)
    return int(any(row[-1] for row in rows))


if __name__ == "__main__":
    sys.exit(main())
