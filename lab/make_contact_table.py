#!/usr/bin/env python3
"""Creates the table of lab/studies/contact/README.md: contact with meshes like those of typical users, by class.

Usage: lab/make_contact_table.py [--lab PROGRAM] [--out DIR] [--partners self,bunny,box,plate] [--check 20] [--every 1]
       [--steps 0] [--landing] [--write]
Runs `tandem-lab bench contact` for each mesh of lab/mesh_corpus.py (generated or found) with each partner, one after
the other, and prints the table. With --write it also replaces the table in the README. With --landing it runs
`bench contact --landing` instead and creates the table of landings and drops. Finished runs and the assets of the
meshes are stored in DIR, so that an interrupted run continues where it ended. Exit code: 0 success, 2 wrong arguments.
"""

import argparse
import json
import pathlib
import statistics
import subprocess
import sys

import mesh_corpus
from make_touch_table import replaced

HERE = pathlib.Path(__file__).resolve().parent
README = HERE / "studies/contact/README.md"
BEGIN, END = "<!-- contact table: made by lab/make_contact_table.py -->", "<!-- end of the contact table -->"
PARTNERS = ("self", "bunny", "box", "plate")
LANDING_BEGIN, LANDING_END = "<!-- landing table: made by lab/make_contact_table.py --landing -->", "<!-- end of the landing table -->"
MAX_STEP_US, MAX_DEPTH_M = 200, 6e-4
MAX_SEPARATIONS = 1
TIMEOUT_S = 900
HEAD = ["class", "meshes", "loaded", "runs", "step p99, µs: median of meshes, worst", "above 200 µs", "deepest, mm: median, worst",
        "deeper than 0.6 mm", "hand's force moves in a step, N: median, worst", "energy made by contact, mJ: worst", "runs with pop-throughs", "found less than a search of all points", "no end"]
LANDING_HEAD = ["class", "meshes", "runs", "hand's force steps, of a rigid stop's: median, worst", "torque, likewise", "contact lost more than once",
                "energy made by contact, mJ: landings, drops", "drops on a face", "of these, without rest", "landings and drops beyond a bound", "no end"]


def partners_in(folder):
    """Writes the meshes that each mesh touches, except the mesh itself. Returns their files by name."""
    files = {"box": folder / "partner-box.obj", "plate": folder / "partner-plate.obj"}
    files["box"].write_bytes(mesh_corpus.obj(mesh_corpus.box(100, 70, 50)))
    files["plate"].write_bytes(mesh_corpus.obj(mesh_corpus.box(100, 100, 5)))
    files["bunny"] = pathlib.Path("/usr/share/glmark2/models/bunny.obj")
    return files


def run_bench(options, mesh, file, kept, *arguments):
    """Runs the benchmark for a pair, or reads its result from the file `kept` if that exists. Returns the result. If
    the benchmark printed none, the result is {"error": reason}."""
    if kept.exists():
        return json.loads(kept.read_text(encoding="utf-8"))
    command = [options.lab, "bench", "contact", "--a", str(mesh), "--b", str(file), "--json", "--cache", str(options.out / "cache"), *arguments]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
        result = json.loads(done.stdout) if done.returncode in (0, 1) and done.stdout.startswith("{") else {
            "error": done.stderr.strip()[-300:], "code": done.returncode}
    except subprocess.TimeoutExpired:
        result = {"error": f"did not end within {TIMEOUT_S} s", "code": -1}
    kept.write_text(json.dumps(result), encoding="utf-8")
    return result


def run_pair(options, mesh, name, partner, file):
    if options.landing:
        return run_bench(options, mesh, file, options.out / f"{name}-{partner}-landing.json", "--landing")
    return run_bench(options, mesh, file, options.out / f"{name}-{partner}.json", "--no-peer", "--check", str(options.check),
                     "--steps", str(options.steps))


def is_loaded(options, mesh):
    """Returns whether the mesh can be loaded; None if it has no triangle."""
    try:
        done = subprocess.run([options.lab, "mesh", str(mesh), "--json"], capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
    except subprocess.TimeoutExpired:
        print(f"not loaded: {mesh}: it did not end within {TIMEOUT_S} s", file=sys.stderr)
        return False
    if done.returncode != 0:
        print(f"not loaded: {mesh}: {done.stderr.strip()[-300:]}", file=sys.stderr)
    return None if "no triangle" in done.stderr and done.returncode != 0 else done.returncode == 0


def median_and_worst(numbers, digits):
    return f"{statistics.median(numbers):.{digits}f}, {max(numbers):.{digits}f}" if numbers else "–"


def row(kind, meshes):
    """Returns the table row of a class of meshes. `meshes` contains pairs (whether the mesh was loaded, its runs)."""
    runs = [run for _, its in meshes for run in its]
    good = [run for run in runs if "error" not in run]
    p99 = [run["step_us"]["p99"] for run in good]
    depths = [run["max_penetration_m"] for run in good]
    of_meshes = [max(run["step_us"]["p99"] for run in its if "error" not in run) for _, its in meshes
                 if any("error" not in run for run in its)]
    checked = [run["check"]["checks"] for run in good if "check" in run]
    return [kind, len(meshes), sum(loaded for loaded, _ in meshes), len(runs), median_and_worst(of_meshes, 0),
            sum(value > MAX_STEP_US for value in p99), median_and_worst([1e3 * depth for depth in depths], 3),
            sum(depth > MAX_DEPTH_M for depth in depths),
            median_and_worst([run["hand_force_step_max_n"] for run in good], 2),
            f"{1e3 * max(run['contact_created_j'] for run in good):.3f}" if good else "–", sum(run["pop_throughs"] > 0 for run in good),
            sum(not all(check["holds"] for check in checks) for checks in checked), len(runs) - len(good)]


def landing_row(kind, meshes):
    """Returns the table row of a class of meshes for --landing: the worst values of landings and drops."""
    runs = [run for _, its in meshes for run in its]
    results = [run["landing"] for run in runs if "error" not in run]
    landings = [landing for result in results for landing in result["landings"]]
    drops = [drop for result in results for drop in result["drops"]]
    on_face = [drop for drop in drops if drop["is_on_face"]]
    failed = {(number, check["scope"]) for number, result in enumerate(results) for check in result["checks"] if not check["holds"]}
    made_mj = [f"{1e3 * max(one['contact_created_j'] for one in ones):.3f}" if ones else "–" for ones in (landings, drops)]
    return [kind, len(meshes), len(runs), median_and_worst([landing["force_ratio"] for landing in landings], 2),
            median_and_worst([landing["torque_ratio"] for landing in landings], 2),
            sum(landing["separations"] > MAX_SEPARATIONS for landing in landings), ", ".join(made_mj), len(on_face),
            sum(drop["rest_s"] is None for drop in on_face), f"{len(failed)} of {len(landings) + len(drops)}", len(runs) - len(results)]


def table(by_class, options):
    head, row_of = (LANDING_HEAD, landing_row) if options.landing else (HEAD, row)
    lines = [f"Each mesh, 100 mm long, on {', '.join(options.partners)}" +
             (f"; every {options.every}th mesh" if options.every > 1 else "") +
             (f"; {options.steps} steps of each path" if options.steps else "") + ".", "",
             "| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    rows = [row_of(kind, meshes) for kind, meshes in by_class.items()]
    rows.append(row_of("all", [mesh for meshes in by_class.values() for mesh in meshes]))
    return "\n".join(lines + ["| " + " | ".join(str(cell) for cell in cells) + " |" for cells in rows])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--lab", default=str(HERE.parent / "build/release/bin/tandem-lab"), help="the program tandem-lab")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("out/contact-table"), help="folder of the meshes and runs")
    parser.add_argument("--partners", default=",".join(PARTNERS), metavar="NAME,...", help=f"of {', '.join(PARTNERS)}")
    parser.add_argument("--check", type=int, default=20, help="poses of each pair to compare with a search of all points")
    parser.add_argument("--steps", type=int, default=0, help="of 1 ms of each path; 0: all of it")
    parser.add_argument("--every", type=int, default=1, help="takes each Nth mesh alone")
    parser.add_argument("--landing", action="store_true", help="land and drop each mesh in place of the path")
    parser.add_argument("--write", action="store_true", help=f"replace the table of {README.relative_to(HERE.parent)}")
    options = parser.parse_args()
    if not pathlib.Path(options.lab).is_file():
        parser.error(f"--lab {options.lab}: no such program; build it first (README.md)")
    options.partners = options.partners.split(",")
    if set(options.partners) - set(PARTNERS) or options.every < 1:
        parser.error(f"--partners are of {', '.join(PARTNERS)}; --every is 1 or more")
    corpus = mesh_corpus.write_made(options.out / "meshes") + mesh_corpus.found()
    files = partners_in(options.out)
    by_class = {}
    for number, (kind, mesh) in enumerate(corpus):
        if number % options.every != 0:
            continue
        loaded = is_loaded(options, mesh)
        if loaded is None:
            continue
        name = "-".join(mesh.parts[-3:]).replace("/", "-") if kind == "of others" else mesh.name
        runs = [run_pair(options, mesh, name, partner, files.get(partner, mesh)) for partner in options.partners] if loaded else []
        by_class.setdefault(kind, []).append((loaded, runs))
    text = table(by_class, options)
    print(text)
    if options.write:
        begin, end = (LANDING_BEGIN, LANDING_END) if options.landing else (BEGIN, END)
        README.write_text(replaced(README.read_text(encoding="utf-8"), text, README, begin, end), encoding="utf-8")


if __name__ == "__main__":
    main()
