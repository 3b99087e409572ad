"""Requirements of a test outside this tree. No test skips its claim silently: see tests/README.md."""

import os
import shutil
import sys

# Folders of Debian's data packages, and the packages of programs with another name.
FOLDERS = {
    "/usr/share/gromacs/": "gromacs-data",
    "/usr/share/pymol/": "pymol-data",
    "/usr/share/apbs/": "apbs-data",
    "/usr/share/freesasa/": "freesasa",
    "/usr/share/glmark2/": "glmark2-data",
}
PROGRAMS = {"Xvfb": "xvfb", "xrdb": "x11-xserver-utils", "umockdev-wrapper": "umockdev", "lmp": "lammps", "gmx_d": "gromacs",
            "ip": "iproute2", "unshare": "util-linux", "nsenter": "util-linux"}


OPLS = "/usr/share/gromacs/top/oplsaa.ff"


class Missing(AssertionError):
    """Missing package, or in continuous integration a missing capability of the machine, without which a claim is
    untested."""


def files(*paths):
    """Fails if one of these files or folders is missing, and names its Debian package."""
    for path in paths:
        if not os.path.exists(path):
            package = next((name for folder, name in FOLDERS.items() if path.startswith(folder)), None)
            _fail(package or "of no package in tests/support/needs.py", f"{path} is missing")


def programs(*names):
    """Fails if one of these programs is missing, and names its Debian package."""
    for name in names:
        if shutil.which(name) is None:
            _fail(PROGRAMS.get(name, name), f"there is no program {name}")


def _fail(package, why):
    raise Missing(f"needs the Debian package {package}: {why}; deploy/install-deps --all installs it")


def is_all_required():
    """Returns whether this is continuous integration, where a missing capability of the machine is a failure."""
    return os.environ.get("TANDEM_REQUIRE") == "all"


def has_of_machine(condition, what, test=None):
    """Returns whether the machine has something that no package installs (a permission, npm). If not, the test
    counts as left out; it fails where everything is required."""
    if condition:
        return True
    why = f"this machine lacks what the test needs: {what}"
    if is_all_required():
        raise Missing(f"{why} (TANDEM_REQUIRE=all)")
    note_left_out(test or os.path.basename(sys.argv[0]), why)
    return False


def skip_unless_of_machine(test, condition, what):
    """Skips a unittest's test, with all its claims, on the condition of has_of_machine."""
    if not has_of_machine(condition, what, test.id()):
        test.skipTest(f"this machine lacks what the test needs: {what}")


def leave_out(test, why):
    """Skips a unittest's test whose claim cannot be tested now, e.g. on a busy machine, and counts it."""
    note_left_out(test.id(), why)
    test.skipTest(why)


def note_left_out(test, why):
    """Prints a claim that is not tested, and appends it to the file $TANDEM_LEFT_OUT, whose lines deploy/test counts."""
    line = f"{test}: {' '.join(why.split())}\n"
    print("left out: " + line, end="", file=sys.stderr)
    if "TANDEM_LEFT_OUT" in os.environ:
        with open(os.environ["TANDEM_LEFT_OUT"], "a", encoding="utf-8") as file:
            file.write(line)
