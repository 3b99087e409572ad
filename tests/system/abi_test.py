"""Tests the binary interface of libtandem. abidiff compares it with the description of its first version; a change that
breaks programs fails the test. A program that was built with the first header must run with today's library, and with a
later library that has longer structs and a new function (embed_later).

The description embed_first/tandem.abi was made by abidw (Abi.describe) from a library with the header
embed_first/tandem.h, whose functions do nothing. A description of the real library would be a hundred times longer. The
description does not change when functions or fields are added."""

import json
import os
import re
import shutil
import subprocess
import unittest

import embedded
from embedded import BUILD
from support import PATIENCE_S, SOURCE, Server

FIRST = os.path.join(SOURCE, "tests", "system", "embed_first")
LATER = os.path.join(SOURCE, "tests", "system", "embed_later")
BUILT_LATER = os.path.join(BUILD, "tests", "system", "embed_later")
EMBED = os.path.join(SOURCE, "client", "embed")
# Lines of the report of abidiff that describe an allowed change: a new function, or new fields at the end of a struct
# with struct_size. Every other line is a break.
ALLOWED = [re.compile(pattern) for pattern in (
    r"", r"\S.* summary: .*", r"\d+ Added functions?:", r"  \[A\] 'function .*",
    r"  \d+ data member insertions?:")]
STRUCT = re.compile(r"'struct (\w+)(?: at .*)?' changed:")
SIZE = re.compile(r"  type size changed from (\d+) to (\d+) \(in bits\)")
FIELD = re.compile(r"    '.*', at offset (\d+) \(in bits\).*")


def read(*names):
    with open(os.path.join(*names), encoding="utf-8") as file:
        return file.read()


def growing_structs():
    """Returns the structs of the first header that begin with struct_size."""
    return set(re.findall(r"typedef struct (\w+) \{\n  uint32_t struct_size;", read(FIRST, "tandem.h")))


def breaks_of(report):
    """Returns the lines of a report of abidiff that describe a change that is not allowed."""
    found, size = [], None
    for line in report.splitlines():
        struct, sizes, field = STRUCT.fullmatch(line), SIZE.fullmatch(line), FIELD.fullmatch(line)
        if struct:
            size = None
            is_allowed = struct[1] in growing_structs()
        elif sizes:
            size = int(sizes[1])
            is_allowed = int(sizes[2]) > size and int(sizes[2]) % 64 == 0
        elif field:
            is_allowed = size is not None and int(field[1]) >= size
        else:
            is_allowed = any(pattern.fullmatch(line) for pattern in ALLOWED)
        if not is_allowed:
            found.append(line)
    return found


class Abi(embedded.EmbeddedTest):
    components = ("runtime-library", "development", "tandem-common")
    programs = ("abidiff", "cc", "c++")

    def compare(self, library):
        """Returns the report of abidiff, and the breaks in it."""
        done = subprocess.run(["abidiff", "--leaf-changes-only", "--fail-no-debug-info", os.path.join(FIRST, "tandem.abi"), library],
                              capture_output=True, text=True)
        self.assertEqual(done.stderr, "")
        self.assertEqual(done.returncode & 3, 0, "abidiff failed: " + done.stdout)
        return done.stdout, breaks_of(done.stdout)

    def describe(self, library, file):
        """Writes the description of a library, without source positions, so that it depends on the interface only."""
        subprocess.run(["abidw", "--no-show-locs", "--no-corpus-path", "--no-comp-dir-path", "--no-elf-needed",
                        "--no-parameter-names", "--drop-private-types", "--type-id-style", "hash", "--out-file", file, library],
                       check=True)

    def library_of(self, header, symbols):
        """Builds a library with this header, whose functions do nothing."""
        folder = self.path("stub")
        shutil.rmtree(folder, ignore_errors=True)
        os.mkdir(folder)
        plain = re.sub(r"/\*.*?\*/", "", header, flags=re.S)
        source = ['#include "tandem.h"']
        for result, arguments in re.findall(r"TANDEM_API ([^;(]*)\(([^;]*)\) TANDEM_NOEXCEPT;", plain):
            source.append(f"{result}({arguments}) noexcept {{ return 0; }}")
        for name, text in (("tandem.h", header), ("stub.cpp", "\n".join(source) + "\n"), ("symbols.map", symbols)):
            self.write(os.path.join("stub", name), text)
        library = os.path.join(folder, "libtandem.so.0")
        subprocess.run(["c++", "-g", "-shared", "-fPIC", "-w", "-o", library, os.path.join(folder, "stub.cpp"),
                        "-Wl,-soname,libtandem.so.0", f"-Wl,--version-script={folder}/symbols.map"], check=True)
        return library

    def test_description_is_that_of_the_first_header(self):
        symbols = "TANDEM_0 {\n  global:\n    tandem_*;\n  local:\n    *;\n};\n"
        self.describe(self.library_of(read(FIRST, "tandem.h"), symbols), self.path("again.abi"))
        types = re.compile(r"<(?:class-decl|data-member|var-decl|typedef-decl|enumerator|elf-symbol|parameter|return) .*")
        self.assertEqual(types.findall(read(self.path("again.abi"))), types.findall(read(FIRST, "tandem.abi")))

    def test_library_has_the_interface_of_its_first_version(self):
        report, breaks = self.compare(os.path.join(self.libraries, "libtandem.so.0"))
        # The struct has become longer. A report without it shows that abidiff has not read the types of the library.
        self.assertIn("'struct tandem_session", report)
        self.assertEqual(breaks, [], "programs of the first header would break")

    def test_later_library_may_have_longer_structs_and_new_functions(self):
        header, symbols = (read(BUILT_LATER, "sources", name) for name in ("client/embed/c/tandem.h", "symbols.map"))
        report, breaks = self.compare(self.library_of(header, symbols))
        self.assertIn("'struct tandem_session", report, "abidiff reports the additions")
        self.assertEqual(breaks, [])

    def test_every_kind_of_break_is_found(self):
        symbols, header = read(EMBED, "c", "symbols.map"), read(FIRST, "tandem.h")
        self.assertEqual(self.compare(self.library_of(header, symbols))[1], [])
        cases = {
            "a field before others": ("  uint64_t number; ", "  uint64_t before;\n  uint64_t number; "),
            "a field less": ("  double state_age_s; ", "  /* */"),
            "two fields exchanged": ("  double position_m[3];\n  double rotation_wxyz[4];",
                                     "  double rotation_wxyz[4];\n  double position_m[3];"),
            "a field of another type": ("  double state_age_s; ", "  int64_t state_age_s; "),
            "a field of another size": ("  char law[40]; ", "  char law[48]; "),
            "a longer struct without struct_size": ("  double rotation_wxyz[4];\n}", "  double rotation_wxyz[4];\n  double more;\n}"),
            "an argument of another type": ("tandem_client_grab(tandem_client client, uint32_t body)",
                                            "tandem_client_grab(tandem_client client, uint64_t body)"),
            "an argument more": ("tandem_client_release(tandem_client client)", "tandem_client_release(tandem_client client, int how)"),
            "another result": ("TANDEM_API tandem_status tandem_client_release", "TANDEM_API double tandem_client_release"),
            "a handle of another type": ("typedef uint64_t tandem_client;", "typedef uint32_t tandem_client;"),
        }
        for name, (old, new) in cases.items():
            with self.subTest(name=name):
                self.assertIn(old, header)
                self.assertNotEqual(self.compare(self.library_of(header.replace(old, new, 1), symbols))[1], [])
        with self.subTest(name="a function less"):
            less = self.library_of(header, symbols.replace("    tandem_client_grab;\n", ""))
            self.assertNotEqual(self.compare(less)[1], [])
        with self.subTest(name="another version of a symbol"):
            self.assertNotEqual(self.compare(self.library_of(header, symbols.replace("TANDEM_0", "TANDEM_9")))[1], [])

    def test_constants_keep_their_values_and_fields_their_names(self):
        first = read(FIRST, "tandem.h")
        source = ["#include <tandem/tandem.h>"]
        constants = re.findall(r"\b(TANDEM_[A-Z_]+) = (-?\d+)", first)
        self.assertGreater(len(constants), 50)
        source += [f'_Static_assert({name} == {value}, "{name}");' for name, value in constants]
        for struct, body in re.findall(r"typedef struct (\w+) \{(.*?)\}", re.sub(r"/\*.*?\*/", "", first, flags=re.S), re.S):
            for field in re.findall(r"(\w+)(?:\[\d+\])?;", body):
                source.append(f"enum {{ {struct}_{field} = offsetof({struct}, {field}) }};")
        done = subprocess.run(["cc", "-std=c11", f"-I{self.prefix}/include", "-c", "-o", self.path("constants.o"),
                               self.write("constants.c", "\n".join(source) + "\n")], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)

    def build(self, source, headers, library, *options):
        program = self.path("program")
        done = subprocess.run(["cc", "-std=c11", "-Wall", "-Wextra", "-Werror", *options, f"-I{headers}", source, library, "-o",
                               program], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        return program

    def later_environment(self):
        """Returns an environment in which programs find the later library, in a prefix with the same data."""
        prefix = self.path("later")
        shutil.copytree(self.prefix, prefix, symlinks=True)
        libraries = os.path.join(prefix, os.path.relpath(self.libraries, self.prefix))
        for name in os.listdir(libraries):
            if name.startswith("libtandem.so"):
                os.remove(os.path.join(libraries, name))
        shutil.copy(os.path.join(BUILT_LATER, "lib", "libtandem.so.0"), libraries)
        return {**os.environ, "LD_LIBRARY_PATH": libraries}

    def test_program_of_the_first_header_runs_with_todays_and_with_a_later_library(self):
        program = self.build(os.path.join(FIRST, "first.c"), FIRST, os.path.join(self.libraries, "libtandem.so.0"))
        for name, environment in (("today's", self.environment), ("later", self.later_environment())):
            with self.subTest(library=name), Server("--scene", "crate") as server:
                done = subprocess.run([program, f"127.0.0.1:{server.port}"], env=environment, capture_output=True, text=True,
                                      timeout=PATIENCE_S)
                self.assertEqual(done.returncode, 0, done.stderr)
                read_values = json.loads(done.stdout)
                self.assertGreater(read_values.pop("ticks"), 500)
                self.assertEqual(read_values, {"held": 2, "name": "crate", "missing": 0, "room": "crate", "overwritten": 0})

    def test_program_of_a_later_header_runs_with_todays_library_unless_it_uses_something_new(self):
        headers, later = os.path.join(BUILT_LATER, "sources", "client", "embed", "c"), os.path.join(BUILT_LATER, "lib", "libtandem.so.0")
        source = os.path.join(LATER, "later.c")
        today = self.environment

        def start(program, environment, *arguments):
            with Server("--scene", "crate") as server:
                return subprocess.run([program, f"127.0.0.1:{server.port}", *arguments], env=environment, capture_output=True,
                                      text=True, timeout=PATIENCE_S)

        program = self.build(source, headers, later)
        done = start(program, self.later_environment(), "new-setting")
        self.assertEqual(done.returncode, 0, done.stderr)
        values = json.loads(done.stdout)
        self.assertEqual((values["later_n"], values["later_s"]), (4711, 42))
        done = start(program, today)
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("TANDEM_1", done.stderr)
        program = self.build(source, headers, later, "-DOLD_FUNCTIONS")
        done = start(program, today)
        self.assertEqual(done.returncode, 0, done.stderr)
        values = json.loads(done.stdout)
        self.assertGreater(values["tick"], 0)
        self.assertEqual(values["later_n"], 0, "a field that the library does not know is zero")
        done = start(program, today, "new-setting")
        self.assertEqual(done.returncode, 2)
        self.assertIn("install the version", done.stderr)


if __name__ == "__main__":
    unittest.main()
