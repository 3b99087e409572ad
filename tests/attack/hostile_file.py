"""A server that is given a file made to hurt who reads it (tests/system/hostile_files.py): what it says, and what it takes."""
import os
import subprocess
import sys
import tempfile
import time

import bench

sys.path.insert(0, os.path.join(os.path.dirname(bench.HERE), "system"))
import hostile_files  # noqa: E402  found through the line above

REFUSED_WITHIN_S, MEMORY_MB = 5.0, 1024
BUILD_LIMIT = ("--build-limit", "2s")  # what is not wrong, but takes long, is refused when this is over


def load(case):
    """One row: exit code, seconds, peak memory of the server and its readers, last line."""
    with tempfile.TemporaryDirectory() as folder:
        scene = hostile_files.scene_file(folder, case)
        began = time.monotonic()
        server = subprocess.Popen([os.path.join(bench.BIN, "tandem-server"), "--port", "0", "--cache", "", "--scene", scene, "--duration", "100ms",
                                   *(BUILD_LIMIT if case in hostile_files.SHAPES else ())],
                                  stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        said = server.stderr.read().replace(folder + os.sep, "").strip().splitlines()
        server.stderr.close()
        _, status, usage = os.wait4(server.pid, 0)
        server.returncode = os.waitstatus_to_exitcode(status)
        return {"case": case, "code": server.returncode, "took_s": time.monotonic() - began,
                "memory_mb": usage.ru_maxrss / 1024, "said": said[-1] if said else ""}


def problems_of(row):
    allowed = (0, 2) if row["case"] in hostile_files.ODDITIES else (2,)
    limit_s = REFUSED_WITHIN_S + (10 if row["case"] in hostile_files.SHAPES else 0)
    found = [] if row["code"] in allowed else [f"exit code {row['code']}"]
    found += [f"{row['took_s']:.1f} s"] if row["took_s"] > limit_s and row["case"] not in hostile_files.ODDITIES else []
    return found + ([f"{row['memory_mb']:.0f} MB"] if row["memory_mb"] > MEMORY_MB else [])
