#!/usr/bin/env python3
"""Creates the table of lab/TOUCH.md: error of each stage in each case, relative to the server's touch at zero delay.

Usage: lab/make_touch_table.py [--lab PROGRAM] [--out DIR] [--seeds 30] [--other-seeds 5]
       [--cases NAME,...] [--write]
Prints the table. With --write it also replaces the table in lab/TOUCH.md; with --cases only the rows of these cases.
Finished runs are stored in DIR and not repeated. Exit code: 0 success, 1 tandem-lab failed, 2 wrong arguments.
"""

import argparse
import json
import math
import pathlib
import subprocess
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
PAGE = HERE / "TOUCH.md"
BEGIN, END = "<!-- touch table: made by lab/make_touch_table.py -->", "<!-- end of the touch table -->"
CASES = ["wall", "push", "curve", "rim", "mass", "soft", "peg", "docking", "squeeze", "squeeze_slippery",
         "carry_along", "carry_along_fast", "carry_across", "carry_across_fast", "tug_of_war", "turn_together",
         "turn_squeezed", "two_carry", "two_blocks", "two_plates", "box_on_box", "three_hands", "four_hands"]
DEFAULT = "local-model"
OTHERS = ["late-pose", "hold", "ar-spline", "wave"]
LINK = ["--set", "link.rtt_ms=100", "--set", "link.jitter_ms=10", "--set", "link.loss=0.05", "--set", "passivity=true"]
LONG_SILENCE_MS = 110


def trials(lab, out, stages, cases, first_seed, seeds):
    """Runs the trials and returns their rows by stage and case. All stages share the reference run of a case and seed.
    """
    if seeds < 1:
        return {stage: {case: [] for case in cases} for stage in stages}
    command = [lab, "run", *cases, "--single", "--json", "--truth-alone", "--stage", ",".join(stages),
               "--seed", str(first_seed), "--seeds", str(seeds), "--out", str(out / f"seeds-from-{first_seed}")]
    done = subprocess.run(command + LINK, stdout=subprocess.PIPE, check=False)
    if done.returncode > 1:
        sys.exit(f"make_touch_table: {' '.join(command)} ended with {done.returncode}")
    rows = {stage: {case: [] for case in cases} for stage in stages}
    for row in json.loads(done.stdout)["trials"]:
        rows[row["stage"]][row["experiment"]].append(row)
    return rows


def values(rows, name, scale=1.0):
    return [row[name] * scale for row in rows if row.get(name) is not None]


def mean_and_worst(numbers, worst, digits):
    if not numbers:
        return "–"
    mean = math.fsum(numbers) / len(numbers)
    return f"{mean:.{digits}f} ({worst(numbers):.{digits}f})"


def outcomes(rows):
    failed = [row["outcome"] for row in rows if row["outcome"] != "completed"]
    return "" if not failed else ", ".join(f"{failed.count(name)} {name}" for name in sorted(set(failed)))


def default_cells(rows):
    judged = [row for row in rows if row["silence_max_ms"] <= LONG_SILENCE_MS]
    return [mean_and_worst(values(judged, "path_error_of_peak", 100), max, 1),
            mean_and_worst(values(judged, "path_torque_error_of_peak", 100), max, 1),
            mean_and_worst(values(judged, "hold_force_least_ratio"), min, 2),
            mean_and_worst(values(judged, "limit_cycle_m_per_s", 1e3), max, 2),
            mean_and_worst(values(judged, "force_step_max_n_per_ms"), max, 2),
            mean_and_worst(values(judged, "energy_created_max_j", 1e3), max, 1),
            mean_and_worst(values(judged, "energy_of_late_display_j", 1e3), min, 0),
            silent_cell(rows), outcomes(judged) or "–"]


def silent_cell(rows):
    """Returns the number of trials with a long silence, and the largest force step at the end of these silences."""
    silent = [row for row in rows if row["silence_max_ms"] > LONG_SILENCE_MS]
    steps = values(silent, "return_step_max_n_per_ms")
    return f"{len(silent)}" + (f": {max(steps):.2f}" if steps else "")


def other_cell(rows):
    error = mean_and_worst(values(rows, "path_error_of_peak", 100), max, 0)
    return f"{error} {outcomes(rows)}".strip()


def row_of(case, default, others):
    cells = default_cells(default[case]) + [other_cell(others[stage][case]) for stage in OTHERS]
    return "| " + " | ".join([f"`{case}`", *cells]) + " |"


def table(default, others, cases, seeds, other_seeds):
    lines = [f"{seeds} seeds of the default stage, {other_seeds} of each other stage. Each cell has the mean over the seeds, "
             "and the worst seed in brackets.", "",
             "| case | force error over the path, % of the peak | torque error, % | least force in the hold, of the reference's "
             "| speed in the settled hold, mm/s | additional force step, N/ms | energy created, mJ "
             "| energy created by a perfect display that is only late, mJ (least) | silent seeds: step after the silence, N/ms | not completed | "
             + " | ".join(f"{stage}: error, %" for stage in OTHERS) + " |",
             "|" + "---|" * (10 + len(OTHERS))]
    return "\n".join(lines + [row_of(case, default, others) for case in cases])


def with_rows(text, rows):
    """Returns the text of the page with the table rows of some cases replaced by `rows`."""
    lines = text.split("\n")
    for row in rows:
        case = row.split("|")[1]
        places = [i for i, line in enumerate(lines) if line.startswith(f"|{case}|") and line.count("|") == row.count("|")]
        if len(places) != 1:
            sys.exit(f"make_touch_table: {PAGE} has {len(places)} rows of{case}; make the whole table first")
        lines[places[0]] = row
    return "\n".join(lines)


def replaced(text, new, file=PAGE, begins=BEGIN, ends=END):
    """Returns the text of a file in which the part between two marker lines is replaced by `new`."""
    before, begin, rest = text.partition(begins)
    _, end, after = rest.partition(ends)
    if not begin or not end:
        sys.exit(f"{file} has no place for the table: {begins} … {ends}")
    return f"{before}{begins}\n{new}\n{ends}{after}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--lab", default=str(HERE.parent / "build/release/bin/tandem-lab"), help="the program tandem-lab")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("out/touch-table"), help="folder of the trials")
    parser.add_argument("--seeds", type=int, default=30, help="of the default stage")
    parser.add_argument("--other-seeds", type=int, default=5, help="of each other stage: the first of those")
    parser.add_argument("--cases", default=",".join(CASES), metavar="NAME,...", help="of the table's, all if not said")
    parser.add_argument("--write", action="store_true", help="replace the table of lab/TOUCH.md, or these rows of it")
    options = parser.parse_args()
    if not pathlib.Path(options.lab).is_file():
        parser.error(f"--lab {options.lab}: no such program; build it first (README.md)")
    cases = options.cases.split(",")
    if not 1 <= options.other_seeds <= options.seeds:
        parser.error(f"--other-seeds {options.other_seeds}: they are the first of the default stage's, so 1 to {options.seeds}")
    if set(cases) - set(CASES):
        parser.error(f"--cases {options.cases}: the table has {', '.join(CASES)}")
    begin = time.monotonic()
    first = trials(options.lab, options.out, [DEFAULT, *OTHERS], cases, 1, options.other_seeds)
    rest = trials(options.lab, options.out, [DEFAULT], cases, options.other_seeds + 1, options.seeds - options.other_seeds)
    default = {case: first[DEFAULT][case] + rest[DEFAULT][case] for case in cases}
    text = table(default, first, cases, options.seeds, options.other_seeds)
    print(text)
    print(f"make_touch_table: {(time.monotonic() - begin) / 60:.1f} minutes", file=sys.stderr)
    if not options.write:
        return
    page = PAGE.read_text(encoding="utf-8")
    rows = text.split("\n")[-len(cases):]
    PAGE.write_text(replaced(page, text) if cases == CASES else with_rows(page, rows), encoding="utf-8")


if __name__ == "__main__":
    main()
