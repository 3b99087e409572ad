"""What a test needs beside this tree. No test leaves out its claim in silence: see tests/README.md."""

import os
import shutil
import sys

# Where Debian's packages of data put their files, and which package has a program that is not named as it.
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
    """A package, or in continuous integration something of the machine, without which a claim cannot be tested."""


def files(*paths):
    """Fails where one of these files or folders is missing, and names its Debian package."""
    for path in paths:
        if not os.path.exists(path):
            package = next((name for folder, name in FOLDERS.items() if path.startswith(folder)), None)
            _fail(package or "of no package in tests/support/needs.py", f"{path} is missing")


def programs(*names):
    """Fails where one of these programs is missing, and names its Debian package."""
    for name in names:
        if shutil.which(name) is None:
            _fail(PROGRAMS.get(name, name), f"there is no program {name}")


def _fail(package, why):
    raise Missing(f"needs the Debian package {package}: {why}; deploy/install-deps --all installs it")


def is_all_required():
    """In continuous integration: what a machine lacks is a failure there."""
    return os.environ.get("TANDEM_REQUIRE") == "all"


def has_of_machine(condition, what, test=None):
    """Whether the machine has something that no package installs (a right, npm). If not: counted as left out; a failure
    where all is required."""
    if condition:
        return True
    why = f"this machine lacks what the test needs: {what}"
    if is_all_required():
        raise Missing(f"{why} (TANDEM_REQUIRE=all)")
    note_left_out(test or os.path.basename(sys.argv[0]), why)
    return False


def skip_unless_of_machine(test, condition, what):
    """As has_of_machine, of all that a unittest's test claims."""
    if not has_of_machine(condition, what, test.id()):
        test.skipTest(f"this machine lacks what the test needs: {what}")


def leave_out(test, why):
    """Skips a unittest's test whose claim could not be tested now, as on a machine that is too busy: counted."""
    note_left_out(test.id(), why)
    test.skipTest(why)


def note_left_out(test, why):
    """Prints a claim that is not tested, and appends it to the file $TANDEM_LEFT_OUT, whose lines deploy/test counts."""
    line = f"{test}: {' '.join(why.split())}\n"
    print("left out: " + line, end="", file=sys.stderr)
    if "TANDEM_LEFT_OUT" in os.environ:
        with open(os.environ["TANDEM_LEFT_OUT"], "a", encoding="utf-8") as file:
            file.write(line)
