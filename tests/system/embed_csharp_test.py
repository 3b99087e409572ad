"""Tests C# programs that use the installed library through Tandem.cs, under Mono. The structs of Tandem.cs must have the
layout of tandem.h, and the forces and poses that a program reads must equal those in the recording."""

import json
import os
import re
import subprocess
import unittest

import embedded
from embedded import CONSUMER, SAMPLES
from support import PATIENCE_S, SOURCE, Server, run

HEADER = os.path.join(SOURCE, "client", "embed", "c", "tandem.h")
UNITY_SCRIPT = os.path.join(SOURCE, "client", "embed", "csharp", "unity", "TandemHand.cs")

# Opens a client and a device without the library, and runs the finalizers of both.
MISSING = """
using System;

static class Program {
  static void Open(Action open) {
    try {
      open();
    } catch (Exception error) {
      Console.WriteLine(error.GetType().Name);
    }
  }
  static void OpenBoth() {
    Open(() => new Tandem.Client(new Tandem.ClientSettings { Server = "127.0.0.1:9", IsInsecure = true }));
    Open(() => new Tandem.OwnDevice());
  }
  static void Main() {
    OpenBoth();
    for (int i = 0; i < 3; ++i) {
      GC.Collect();
      GC.WaitForPendingFinalizers();
    }
    Console.WriteLine("alive");
  }
}
"""


class CSharp(embedded.EmbeddedTest):
    components = ("runtime-library", "development", "tandem-common")
    programs = ("mcs", "mono", "cc")

    def compile(self, *sources):
        """Builds a program with the installed Tandem.cs, without warnings."""
        binding = os.path.join(self.prefix, "share", "tandem", "csharp", "Tandem.cs")
        done = subprocess.run(["mcs", "-warn:4", "-warnaserror", f"-out:{self.path('program.exe')}", binding, *sources],
                              capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return self.path("program.exe")

    def test_sample_is_short_and_holds_a_body(self):
        sample = os.path.join(SAMPLES, "05_touch_a_room.cs")
        with open(sample, encoding="utf-8") as file:
            self.assertLessEqual(len(file.readlines()), 60)
        program = self.compile(sample)
        with Server("--scene", "crate", "--record", self.path("recording")) as server:
            out = self.run_program("mono", program, f"127.0.0.1:{server.port}")
        self.assertIn("grabbed body 2", out)
        self.assertIn("crate is", out)
        self.assertEqual(self.held_bodies(self.path("recording")), {2})

    def test_no_server_is_an_error_with_a_reason(self):
        program = self.compile(os.path.join(SAMPLES, "05_touch_a_room.cs"))
        done = subprocess.run(["mono", program, "127.0.0.1:9"], env=self.environment, capture_output=True, text=True,
                              timeout=PATIENCE_S)
        self.assertEqual(done.returncode, 2)
        self.assertIn("refused", done.stderr)

    def test_missing_library_is_an_exception_and_does_not_end_the_program(self):
        program = self.compile(self.write("missing.cs", MISSING))
        environment = {name: value for name, value in self.environment.items() if name != "LD_LIBRARY_PATH"}
        done = subprocess.run(["mono", program], env=environment, capture_output=True, text=True, timeout=PATIENCE_S)
        self.assertEqual((done.returncode, done.stdout), (0, "DllNotFoundException\nDllNotFoundException\nalive\n"),
                         done.stderr)

    def test_objects_stay_alive_during_native_calls(self):
        """A finalizer may close a handle that a native call still uses, unless the object is kept alive after the call."""
        with open(os.path.join(self.prefix, "share", "tandem", "csharp", "Tandem.cs"), encoding="utf-8") as file:
            binding = re.sub(r"//.*", "", file.read())
        for name in ("OwnDevice", "Client"):
            (body,) = re.findall(rf"^public sealed class {name} : .*?^}}", binding, re.M | re.S)
            self.assertIn("Checked(Native.", body)
            kept = body.replace("GC.KeepAlive(this);\n    if (status == Status.TimedOut) return false;\n    Native.Check(", "")
            kept = kept.replace("GC.KeepAlive(this);\n    return Native.Check(status);", "")
            self.assertNotIn("Native.Check(", kept, name)

    def test_forces_equal_the_ticks_and_poses_equal_the_recording(self):
        program = self.compile(os.path.join(CONSUMER, "check.cs"))
        with Server("--scene", "crate", "--record", self.path("recording")) as server:
            read = json.loads(self.run_program("mono", program, f"127.0.0.1:{server.port}"))
        self.check_against_recording(read, self.path("recording"))
        self.assertEqual((read["room"], read["stage"], read["lost"]), ("crate", "late-pose", 0))
        self.assertEqual(len(read["bodies"]), read["body_count"])
        self.assertIn("crate", read["bodies"])
        self.assertLessEqual({"Joined", "Grabbed"}, set(read["kinds"]))
        self.assertEqual(read["after_close"], "BadHandle")
        self.assertEqual(read["version"], run("tandem-client", "--version")[1].split()[-1])

    def test_structs_have_the_layout_of_the_header(self):
        program = self.compile(os.path.join(CONSUMER, "check.cs"))
        layout = [line.split() for line in self.run_program("mono", program, "layout").splitlines()]
        with open(HEADER, encoding="utf-8") as file:
            structs = set(re.findall(r"^typedef struct (\w+)", file.read(), re.M))
        self.assertEqual({struct for struct, _, _ in layout}, structs)
        source = ["#include <stddef.h>", "#include <tandem/tandem.h>"]
        for struct, field, offset in layout:
            value = f"sizeof({struct})" if field == "sizeof" else f"offsetof({struct}, {field})"
            source.append(f'_Static_assert({value} == {offset}, "{struct}.{field}");')
        done = subprocess.run(["cc", "-std=c11", f"-I{self.prefix}/include", "-c", "-o", self.path("layout.o"),
                               self.write("layout.c", "\n".join(source) + "\n")], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        # In C# the sizes of all structs and the offsets of all fields equal those of the header, and no struct has
        # padding. Therefore each field of the header occurs in C#.
        self.assertGreater(len(layout), 100)

    def test_functions_and_constants_are_those_of_the_header(self):
        with open(HEADER, encoding="utf-8") as file:
            header = file.read()
        with open(os.path.join(self.prefix, "share", "tandem", "csharp", "Tandem.cs"), encoding="utf-8") as file:
            binding = file.read()
        self.assertEqual(set(re.findall(r"^TANDEM_API [\w* ]*?\*?(tandem_\w+)\(", header, re.M)),
                         set(re.findall(r"static extern \w+ (\w+)\(", binding)))
        constants = dict(re.findall(r"^  TANDEM_(\w+) = (-?\d+)", header, re.M))
        constants |= dict(re.findall(r"(?:, |\{ )TANDEM_(\w+) = (-?\d+)", header))
        of_enums = {}
        for body in re.findall(r"enum \w+(?: : uint)? \{([^}]*)\}", binding):
            for name, value in re.findall(r"(\w+) = (-?\d+)", body):
                of_enums.setdefault(name.upper(), set()).add(value)
        prefixes = ("EVENT_", "SAFETY_", "POSE_", "BUTTON_", "SESSION_", "")
        for name, value in constants.items():
            plain = {name[len(prefix):] for prefix in prefixes if name.startswith(prefix)}
            found = set().union(*(of_enums.get(one.replace("_", ""), set()) for one in plain))
            self.assertIn(value, found, f"TANDEM_{name}")

    def test_unity_script_follows_the_room_and_holds_a_body(self):
        program = self.compile(UNITY_SCRIPT, os.path.join(CONSUMER, "unity.cs"))
        with Server("--scene", "crate") as server:
            read = json.loads(self.run_program("mono", program, f"127.0.0.1:{server.port}"))
            server.wait_for_log("user 1 .* left on request")
        self.assertEqual((read["held"], read["errors"]), (2, 0))
        # The crate's centre is 25 mm above the table. Height is y in Unity, and 1 m is 10 units, so y is 0.25.
        self.assertAlmostEqual(read["crate"][1], 0.25, delta=0.05)
        # A rotation about x by the angle a becomes a rotation by -a in Unity's left-handed frame.
        self.assertEqual([round(one, 6) for one in read["turn"]], [0.8, -0.6, 0, 0])


if __name__ == "__main__":
    unittest.main()
