"""Tests the Debian packages: their files, the manual pages and completions made from --help, the desktop files, and the
version. The nightly deploy/check-packages tests the built packages."""

import glob
import json
import os
import re
import subprocess
import tempfile
import unittest

from support import PATIENCE_S, SOURCE, ProgramTest, run

import needs  # from tests/support; support.py adds this folder to the path

BUILD = os.environ["TANDEM_BUILD"]
PROGRAMS = {
    "tandem-server": ["tandem-server", "tandem-token"],
    "tandem-client": ["tandem-client", "tandem-doctor", "tandem-signal"],
    "tandem-lab": ["tandem-lab", "tandem-replay", "tandem-eeg"],
    "tandem-common": ["tandem-mesh-reader", "tandem-watchdog"],
}
FILES = {
    "tandem-server": ["etc/tandem/tandem-server.conf", "usr/lib/systemd/system/tandem-server.service"],
    "tandem-client": ["usr/lib/udev/rules.d/70-tandem.rules", "usr/share/applications/tandem-client.desktop",
                      "usr/share/icons/hicolor/scalable/apps/tandem.svg", "usr/share/metainfo/tandem-client.metainfo.xml"],
    "tandem-lab": [],
    "tandem-common": ["usr/share/tandem/devices/profiles.json"],
}
FOLDERS = {"tandem-common": {"server/scenes": "scenes"},
           "tandem-client": {"client/view/pictures/scenes": "pictures"},
           "tandem-lab": {"lab/experiments": "experiments", "lab/paths": "paths", "lab/links": "links"}}


def read(*names):
    with open(os.path.join(SOURCE, *names), encoding="utf-8") as file:
        return file.read()


def expected_files(package):
    files = list(FILES[package])
    for program in PROGRAMS[package]:
        files += [f"usr/bin/{program}", f"usr/share/man/man1/{program}.1", f"usr/share/bash-completion/completions/{program}"]
    for folder, place in FOLDERS.get(package, {}).items():
        files += [f"usr/share/tandem/{place}/{os.path.basename(one)}" for one in glob.glob(os.path.join(SOURCE, folder, "*"))
                  if not one.endswith(".py")]
    return sorted(files)


def files_below(folder):
    return sorted(os.path.relpath(os.path.join(place, name), folder) for place, _, names in os.walk(folder) for name in names)


def all_help(program, *commands):
    """Returns the help texts of a program and its subcommands."""
    code, out, err = run(program, *commands, "--help")
    assert code == 0, err
    found = [out]
    listed = re.search(r"^Subcommands:\n((?:  .*\n)+)", out, re.M)
    for name in re.findall(r"^  ([a-z][a-z-]*) ", listed.group(1), re.M) if listed else []:
        found += all_help(program, *commands, name)
    return found


class Installed(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.place = tempfile.TemporaryDirectory()
        for package in PROGRAMS:
            subprocess.run(["cmake", "--install", BUILD, "--prefix", "/usr", "--component", package], check=True,
                           capture_output=True, env={**os.environ, "DESTDIR": cls.folder(package)})

    @classmethod
    def tearDownClass(cls):
        cls.place.cleanup()

    @classmethod
    def folder(cls, package):
        return os.path.join(cls.place.name, package)

    def share(self, package, *names):
        return os.path.join(self.folder(package), "usr", "share", *names)

    def test_each_package_has_its_files_and_no_others(self):
        for package in PROGRAMS:
            with self.subTest(package=package):
                self.assertEqual(files_below(self.folder(package)), expected_files(package))

    def test_every_installed_program_is_in_one_package(self):
        whole = os.path.join(self.place.name, "whole")
        subprocess.run(["cmake", "--install", BUILD, "--prefix", "/usr"], check=True, capture_output=True, env={**os.environ, "DESTDIR": whole})
        programs = sorted(name for names in PROGRAMS.values() for name in names)
        self.assertEqual(sorted(os.listdir(os.path.join(whole, "usr", "bin"))), programs)

    def test_a_manual_page_names_every_option_and_subcommand(self):
        for package, programs in PROGRAMS.items():
            for program in programs:
                with self.subTest(program=program):
                    with open(self.share(package, "man", "man1", program + ".1"), encoding="utf-8") as file:
                        page = file.read().replace(r"\-", "-").replace(r"\:", "")
                    helps = all_help(program)
                    options = set(re.findall(r"^  (?:-\w,)?(--[a-z][a-z-]*)", "\n".join(helps), re.M))
                    self.assertTrue(options)
                    for option in options:
                        self.assertRegex(page, rf"(?m)^\.B (-\w,)?{option}\b")
                    for text in helps:
                        self.assertIn(re.search(r"^Usage: (.*)$", text, re.M).group(1), page)

    def test_manual_pages_render_without_warnings(self):
        needs.programs("man")
        for page in glob.glob(os.path.join(self.place.name, "tandem-*/usr/share/man/man1/*")):
            done = subprocess.run(["man", "--warnings", "-E", "UTF-8", "-l", "-Tutf8", "-Z", page], capture_output=True, text=True,
                                  env={**os.environ, "LC_ALL": "C.UTF-8", "MANWIDTH": "80", "MANROFFSEQ": ""}, timeout=PATIENCE_S, check=False)
            self.assertEqual((done.returncode, done.stderr), (0, ""), page)

    def test_a_manual_page_does_not_depend_on_the_home_folder(self):
        for package in PROGRAMS:
            for page in glob.glob(self.share(package, "man", "man1", "*")):
                with open(page, encoding="utf-8") as file:
                    self.assertNotIn(os.path.expanduser("~") + "/", file.read(), page)

    def complete(self, package, program, *words):
        script = (f"source {self.share(package, 'bash-completion', 'completions', program)}; compopt() {{ :; }}\n"
                  f"COMP_WORDS=({program} {' '.join(repr(word) for word in words)}); COMP_CWORD={len(words)}\n"
                  f"_{program.replace('-', '_')}; printf '%s\\n' \"${{COMPREPLY[@]}}\"")
        done = subprocess.run(["bash", "-eu", "-c", script], capture_output=True, text=True, check=False)
        self.assertEqual(done.stderr, "")
        return done.stdout.split()

    def test_bash_completes_options_values_and_subcommands(self):
        self.assertEqual(self.complete("tandem-client", "tandem-client", "--tra"), ["--transport", "--trace", "--trace-every"])
        self.assertEqual(self.complete("tandem-client", "tandem-client", "--transport", ""), ["udp", "tcp"])
        self.assertEqual(self.complete("tandem-client", "tandem-client", "--trace", ""), [], "left to bash: files")
        self.assertEqual(self.complete("tandem-lab", "tandem-lab", "re"), ["reproduce", "redock", "report"])
        self.assertEqual(self.complete("tandem-lab", "tandem-lab", "bench", "contact-s"), ["contact-scaling"])
        self.assertIn("--single", self.complete("tandem-lab", "tandem-lab", "run", "--"))
        self.assertEqual(self.complete("tandem-lab", "tandem-lab", "mesh", "--up", ""), ["y", "z"])

    def test_desktop_files_are_valid(self):
        needs.programs("desktop-file-validate", "appstreamcli")
        for command in (["desktop-file-validate", self.share("tandem-client", "applications", "tandem-client.desktop")],
                        ["appstreamcli", "validate", "--no-net", self.share("tandem-client", "metainfo", "tandem-client.metainfo.xml")]):
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)


class Version(unittest.TestCase):
    version = re.search(r"^project\(tandem VERSION (\S+) ", read("CMakeLists.txt"), re.M).group(1)

    def make_changelog(self, version):
        return subprocess.run([os.path.join(SOURCE, "deploy", "debian", "make_changelog"), version], input=read("CHANGELOG.md"),
                              capture_output=True, text=True, env={**os.environ, "SOURCE_DATE_EPOCH": "0"}, check=False)

    def test_programs_and_changelog_and_pages_have_the_version_of_the_build(self):
        for program in ("tandem-server", "tandem-token", "tandem-client", "tandem-doctor", "tandem-lab", "tandem-replay",
                        "tandem-signal"):
            self.assertEqual(run(program, "--version")[1], f"{program} {self.version}\n")
        self.assertIn(f"\nversion: {self.version}\n", read("CITATION.cff"))
        for name in ("README.md", "kubernetes/Containerfile", "kubernetes/fleet.yaml"):
            self.assertEqual(set(re.findall(r"tandem-server:(\d+\.\d+\.\d+)", read("deploy", *name.split("/")))), {self.version}, name)
        done = self.make_changelog(self.version)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue(done.stdout.startswith(f"tandem ({self.version}) "), done.stdout[:80])
        self.assertGreater(done.stdout.count("\n  * "), 10)

    def test_a_version_without_a_section_in_the_changelog_is_refused(self):
        done = self.make_changelog("99.0.0")
        self.assertEqual(done.returncode, 1)
        self.assertIn("99.0.0", done.stderr)
        self.assertIn("CHANGELOG.md", done.stderr)


class Scripts(ProgramTest):
    def test_what_the_packages_are_built_with_is_installed_by_the_script_for_it(self):
        listed = re.search(r"^Build-Depends:\n((?: .*\n)+)", read("deploy", "debian", "control"), re.M).group(1)
        table = read("deploy", "install-deps")
        for package in re.findall(r"^ ([a-z0-9.+-]+)", listed, re.M):
            self.assertRegex(table, rf"(?m)^{re.escape({'debhelper-compat': 'debhelper', 'python3': 'python3'}.get(package, package))} ")

    def test_list_of_contents_has_the_licence_of_everything_that_is_compiled_in(self):
        done = subprocess.run([os.path.join(SOURCE, "deploy", "debian", "make_spdx"), "--build", BUILD, "--version-text", "0"],
                              capture_output=True, text=True, env={**os.environ, "SOURCE_DATE_EPOCH": "0"}, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        names = {package["name"] for package in json.loads(done.stdout)["packages"]}
        # Packages whose code is compiled into the programs, the static library of the window (Dear ImGui), and the
        # package for the Python module.
        self.assertLessEqual({"libeigen3-dev", "libssl-dev", "libstdc++-12-dev", "libimgui-dev", "pybind11-dev"}, names)

    def test_files_of_the_library_and_of_python_are_in_their_packages(self):
        expected = {"runtime-library": r"usr/lib/.*libtandem\.so\.[0-9.]+", "python": r"usr/lib/python3/dist-packages/tandem/.*",
                    "development": r"usr/(include/tandem|share/tandem/csharp|lib/.*(cmake/tandem|pkgconfig))/.*|usr/lib/.*libtandem\.so"}
        rules, control = read("deploy", "debian", "rules"), read("deploy", "debian", "control")
        for component, pattern in expected.items():
            package, = re.findall(rf"^component_(\S+) = {component}$", rules, re.M)
            self.assertIn(f"\nPackage: {package}\n", control)
            folder = self.path(component)
            subprocess.run(["cmake", "--install", BUILD, "--prefix", "/usr", "--component", component], check=True, capture_output=True,
                           env={**os.environ, "DESTDIR": folder})
            files = files_below(folder)
            self.assertGreater(len(files), 1)
            for file in files:
                self.assertRegex(file, f"^({pattern})$")

    def test_every_package_of_the_list_of_licences_with_a_notice_is_in_the_copyright_file(self):
        licences = re.findall(r'^    "([^"]+)": "([^"]+)",$', read("deploy", "debian", "make_spdx"), re.M)
        copyright_file = read("deploy", "debian", "copyright")
        statically_used = {"libassimp-dev", "libboost1.81-dev", "libbullet-dev", "libcli11-dev", "libeigen3-dev", "libfmt-dev",
                           "libimgui-dev", "libprotobuf-dev", "libspdlog-dev", "pybind11-dev"}
        self.assertLess(statically_used, {name for name, _ in licences})
        for name in statically_used:
            self.assertIn(f"Comment: {name}, ", copyright_file)

    def test_wrong_arguments_are_named_and_nothing_is_built(self):
        for name, arguments, word in (("package", ("--frob",), "--frob"), ("package", ("--out",), "--out"),
                                      ("package", ("--build", "/nowhere"), "/nowhere"),
                                      ("check-packages", ("--packages", self.folder), self.folder)):
            with self.subTest(arguments=arguments):
                done = subprocess.run([os.path.join(SOURCE, "deploy", name), *arguments], capture_output=True, text=True,
                                      timeout=PATIENCE_S, check=False)
                self.assert_setup_error((done.returncode, done.stdout, done.stderr), word)

    def test_shellcheck_finds_nothing(self):
        needs.programs("shellcheck")
        folder = os.path.join(SOURCE, "deploy")
        for shell, name in (("bash", "package"), ("sh", "debian/tandem-server.postrm")):
            done = subprocess.run(["shellcheck", "-s", shell, os.path.join(folder, name)], capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 0, done.stdout)


if __name__ == "__main__":
    unittest.main()
