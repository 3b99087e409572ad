"""Measures exit code, time, memory and output of a server that loads a hostile file (tests/system/hostile_files.py)."""
import os
import sys
import tempfile

import bench

sys.path.insert(0, os.path.join(os.path.dirname(bench.HERE), "system"))
import hostile_files  # noqa: E402  found through the line above

REFUSED_WITHIN_S, MEMORY_MB = 5.0, 1024
BUILD_LIMIT = ("--build-limit", "2s")  # a valid file that takes longer to build must be refused


def load(case):
    """Returns the table row of one file: exit code, seconds, peak memory of the server and its readers, last line."""
    with tempfile.TemporaryDirectory() as folder:
        seen = hostile_files.load(folder, case, os.path.join(bench.BIN, "tandem-server"), "--duration", "100ms",
                                  *(BUILD_LIMIT if case in hostile_files.SHAPES else ()))
        said = seen["err"].replace(folder + os.sep, "").strip().splitlines()
        return {"case": case, "code": seen["code"], "took_s": seen["took_s"], "memory_mb": seen["memory_kib"] / 1024,
                "said": said[-1] if said else ""}


def problems_of(row):
    allowed = (0, 2) if row["case"] in hostile_files.ODDITIES else (2,)
    limit_s = REFUSED_WITHIN_S + (10 if row["case"] in hostile_files.SHAPES else 0)
    found = [] if row["code"] in allowed else [f"exit code {row['code']}"]
    found += [f"{row['took_s']:.1f} s"] if row["took_s"] > limit_s and row["case"] not in hostile_files.ODDITIES else []
    return found + ([f"{row['memory_mb']:.0f} MB"] if row["memory_mb"] > MEMORY_MB else [])
