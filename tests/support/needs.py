"""Requirements of a test that are outside this source tree: packages and capabilities of the machine. No test may skip
its claim silently (see tests/README.md)."""

import os
import shutil
import sys

# Folders into which Debian's data packages install files, and the package of each program whose package has a different
# name.
FOLDERS = {
    "/usr/share/gromacs/": "gromacs-data",
    "/usr/share/pymol/": "pymol-data",
    "/usr/share/apbs/": "apbs-data",
    "/usr/share/freesasa/": "freesasa",
    "/usr/share/glmark2/": "glmark2-data",
    "/usr/lib/python3/dist-packages/h5py/": "python3-h5py",
    "/usr/share/alsa/": "libasound2",
}
PROGRAMS = {"Xvfb": "xvfb", "xrdb": "x11-xserver-utils", "umockdev-wrapper": "umockdev", "lmp": "lammps", "gmx_d": "gromacs",
            "ip": "iproute2", "mcs": "mono-mcs", "mono": "mono-runtime", "abidiff": "abigail-tools", "abidw": "abigail-tools", "cc": "g++", "man": "man-db", "desktop-file-validate": "desktop-file-utils", "appstreamcli": "appstream", "unshare": "util-linux", "nsenter": "util-linux"}


OPLS = "/usr/share/gromacs/top/oplsaa.ff"


class Missing(AssertionError):
    """A claim cannot be tested, because a package is missing, or a capability of the machine in continuous integration.
    """


def files(*paths):
    """Fails if one of these files or folders is missing. The message names its Debian package."""
    for path in paths:
        if not os.path.exists(path):
            package = next((name for folder, name in FOLDERS.items() if path.startswith(folder)), None)
            _fail(package or "of no package in tests/support/needs.py", f"{path} is missing")


def programs(*names):
    """Fails if one of these programs is missing. The message names its Debian package."""
    for name in names:
        if shutil.which(name) is None:
            _fail(PROGRAMS.get(name, name), f"there is no program {name}")


def _fail(package, why):
    raise Missing(f"needs the Debian package {package}: {why}; deploy/install-deps --all installs it")


def is_all_required():
    """Returns True in continuous integration. A missing capability of the machine is then a failure."""
    return os.environ.get("TANDEM_REQUIRE") == "all"


def has_of_machine(condition, what, test=None):
    """Returns `condition`, which states whether the machine has a capability that no package installs (a permission,
    npm). If it is false, the test is counted as left out. If all capabilities are required, the test fails."""
    if condition:
        return True
    why = f"this machine lacks what the test needs: {what}"
    if is_all_required():
        raise Missing(f"{why} (TANDEM_REQUIRE=all)")
    note_left_out(test or os.path.basename(sys.argv[0]), why)
    return False


def skip_unless_of_machine(test, condition, what):
    """Skips a test of a unittest.TestCase with all its claims unless has_of_machine() returns True."""
    if not has_of_machine(condition, what, test.id()):
        test.skipTest(f"this machine lacks what the test needs: {what}")


def leave_out(test, why):
    """Skips and counts a test of a unittest.TestCase that cannot check its claim at present, for example on a busy
    machine."""
    note_left_out(test.id(), why)
    test.skipTest(why)


def note_left_out(test, why):
    """Prints a claim that was not tested and appends it to the file $TANDEM_LEFT_OUT. deploy/test counts its lines."""
    line = f"{test}: {' '.join(why.split())}\n"
    print("left out: " + line, end="", file=sys.stderr)
    if "TANDEM_LEFT_OUT" in os.environ:
        with open(os.environ["TANDEM_LEFT_OUT"], "a", encoding="utf-8") as file:
            file.write(line)
