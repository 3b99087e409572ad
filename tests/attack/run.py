"""The attack suite: `python3 tests/attack/run.py` runs all attacks, prints the tables and fails if a bound is violated.

--short    some attacks for 1.5 s each, with only the bounds that do not depend on the speed of the machine
--write    also writes tables without violations into RESULTS.md
NAME ...   only these attacks
The programs are those of $TANDEM_BIN, or build/release/bin. Sends to loopback only, for about four minutes.
"""
import argparse
import os
import sys
import tempfile

import attackers
import bench
import hostile_file
import hostile_server

SECONDS, SHORT_SECONDS = 5.0, 1.5
SHORT_ATTACKS = ("ping_flood", "parameter_flood", "slow_reader", "silent_64", "datagram_garbage", "datagram_of_a_user", "tls_handshakes",
                 "tls_half_hello")
SHORT_SCENARIOS = ("frozen step, rising sequence", "users without end")
NOT_REAL_TIME = ("--rt-priority", "0")
WITHOUT_RIGHTS = ("datagram_garbage",)

KEPT, SILENCE_MS, FORCE_STEP_N_PER_MS, GROWTH_MB, JOIN_MS = 0.95, 60, 0.1, 100, 2000
FLOOD_PER_S = 150_000  # a row with a lower flood rate is not meaningful


def attack_problems(row, is_short, may_be_late):
    found = [f"ended: {line}" for line in row["others_ended"]]
    if not row["is_alive"]:
        found.append("the well-behaved user was ended")
    if row["growth_mb"] > GROWTH_MB:
        found.append(f"the server grew by {row['growth_mb']:.0f} MB")
    if row["joins"] == 0:
        found.append("no newcomer could join")
    if row["force_step_n_per_ms"] > (bench.SLEW_N_PER_MS if is_short or may_be_late else FORCE_STEP_N_PER_MS):
        found.append(f"a force step of {row['force_step_n_per_ms']:.2f} N/ms")
    if row["force_n"] < 1 and not is_short:
        found.append("the hand felt no wall")
    return found + ([] if is_short else speed_problems(row))


def speed_problems(row):
    found = [f"{what} kept: {100 * row[what + '_kept']:.1f} %" for what in ("states", "inputs") if row[what + "_kept"] < KEPT]
    if row["silence_ms"] > SILENCE_MS:
        found.append(f"a silence of {row['silence_ms']:.0f} ms")
    if row["join_ms"] > JOIN_MS:
        found.append(f"a newcomer waited {row['join_ms']:.0f} ms")
    if row["attack"].startswith("datagram") and row["sent_per_s"] < FLOOD_PER_S:
        found.append(f"only {row['sent_per_s']:.0f} datagrams/s were sent")
    return found


ATTACK_HEAD = ("attack", "messages/s sent", "connections ended, all the attacker's", "states kept %", "inputs kept %",
               "longest silence ms", "largest force step N/ms", "server growth MB", "a newcomer joins within ms")


def attack_cells(row):
    return (row["attack"], f"{row['sent_per_s']:.0f}", str(row["ended"]), f"{100 * row['states_kept']:.1f}",
            f"{100 * row['inputs_kept']:.1f}", f"{row['silence_ms']:.1f}", f"{row['force_step_n_per_ms']:.3f}",
            f"{row['growth_mb']:.1f}", f"{row['join_ms']:.0f}" + (f" ({row['refused']} refused)" if row["refused"] else ""))


SCENARIO_HEAD = ("the server says", "force before N", "zero after s", "largest force later N", "largest force step N/ms", "client growth MB",
                 "client ended", "its last word")


def scenario_cells(row):
    return (row["scenario"], f"{row['force_before_n']:.2f}", f"{row['zero_after_s']:.2f}", f"{row['force_later_n']:.2f}", f"{row['force_step_n_per_ms']:.3f}",
            f"{row['growth_mb']:.1f}", f"exit code {row['code']}" if row["ended"] else "no", row["said"].replace("|", "/")[:110])


FILE_HEAD = ("the file", "exit code", "refused after s", "most memory MB", "what the server says")


def file_cells(row):
    return (row["case"], str(row["code"]), f"{row['took_s']:.1f}", f"{row['memory_mb']:.0f}",
            row["said"].replace("|", "/").removeprefix("tandem-server: ")[:150])


def table(head, rows):
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines) + "\n"


def run_attacks(names, is_short):
    rows, failures = [], []
    jobs = [(name, ()) for name in names]
    if not is_short:
        jobs = [("", ())] + jobs + [(name, NOT_REAL_TIME) for name in names if name in WITHOUT_RIGHTS]
    for name, rights in jobs:
        with tempfile.TemporaryDirectory() as folder:
            row = bench.run_attack(name, SHORT_SECONDS if is_short else SECONDS, folder, rights)
        problems = attack_problems(row, is_short, bool(rights))
        if rights:
            row["attack"] += ", server without real-time rights"
            # Without real-time permissions, the room's loop is late under any attack, so that states are lost. The
            # user's inputs must arrive nevertheless.
            problems = [problem for problem in problems if not problem.startswith("states")]
        rows.append(attack_cells(row))
        failures += [f"{row['attack']}: {problem}" for problem in problems]
        print(" | ".join(rows[-1]), *problems, flush=True)
    return table(ATTACK_HEAD, rows), failures


def run_scenarios(names, is_short):
    rows, failures = [], []
    for name in names:
        make = {**hostile_server.SCENARIOS, **hostile_server.GROWING}[name]
        row = hostile_server.run_scenario(name, make, 2.0 if is_short else hostile_server.LIES_FOR_S)
        problems = hostile_server.problems_of(row)
        rows.append(scenario_cells(row))
        failures += [f"{name}: {problem}" for problem in problems]
        print(" | ".join(rows[-1]), *problems, flush=True)
    return table(SCENARIO_HEAD, rows), failures


def run_files(names, _is_short):
    rows, failures = [], []
    for name in names:
        row = hostile_file.load(name)
        problems = hostile_file.problems_of(row)
        rows.append(file_cells(row))
        failures += [f"{name}: {problem}" for problem in problems]
        print(" | ".join(rows[-1]), *problems, flush=True)
    return table(FILE_HEAD, rows), failures


def write_table(name, text, path=os.path.join(bench.HERE, "RESULTS.md")):
    begin, end = f"<!-- {name} -->\n", f"<!-- end of {name} -->\n"
    with open(path) as file:
        whole = file.read()
    before, rest = whole.split(begin)
    with open(path, "w") as file:
        file.write(before + begin + text + end + rest.split(end)[1])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--short", action="store_true")
    parser.add_argument("--write", action="store_true")
    parser.add_argument("names", nargs="*")
    options = parser.parse_args()
    attacks = options.names or (SHORT_ATTACKS if options.short else attackers.ATTACKS)
    scenarios = options.names or (SHORT_SCENARIOS if options.short else [*hostile_server.SCENARIOS, *hostile_server.GROWING])
    files = options.names or ([] if options.short else [*hostile_file.hostile_files.FILES])
    failures = []
    for title, run, names, known in (
            ("attacks on the server", run_attacks, attacks, attackers.ATTACKS),
            ("hostile servers", run_scenarios, scenarios, {**hostile_server.SCENARIOS, **hostile_server.GROWING}),
            ("hostile files", run_files, files, hostile_file.hostile_files.FILES)):
        chosen = [name for name in names if name in known]
        if not chosen:
            continue
        text, failed = run(chosen, options.short)
        failures += failed
        if options.write and not failed:
            write_table(title, text)
    for failure in failures:
        print("FAILED: " + failure, file=sys.stderr)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
