"""Starts the real programs as a user does, for the tests in this folder.

The environment variable TANDEM_BIN contains the folder of the programs (ctest sets it).
"""

import json
import os
import re
import socket
import subprocess
import sys
import tempfile
import threading
import time
import unittest

BIN = os.environ["TANDEM_BIN"]
SOURCE = os.environ["TANDEM_SOURCE"]
sys.path.append(os.path.join(SOURCE, "tests", "attack"))  # contains wire.py, which encodes control messages
sys.path.append(os.path.join(SOURCE, "tests", "support"))
import needs  # noqa: E402  (found by the path above)
# Time-out far above any duration in these tests [s]. Only a program that hangs reaches it.
PATIENCE_S = 60
TRIES = 3
# Maximum fraction of the requested processor time that the host of a virtual machine may take. A quiet host takes less
# than 1.5 %; a burst of 100 ms in a test of 10 s is 2 to 5 %.
MOST_TAKEN = 0.02


def program(name):
    return os.path.join(BIN, name)


class Server:
    """A running tandem-server: `with Server("--scene", "two_boxes") as server: ... server.port`.

    It runs on loopback without encryption; secure_test.py tests a server with encryption.
    """

    def __init__(self, *arguments, port=0):
        self.log = []
        self.process = subprocess.Popen(
            [program("tandem-server"), "--insecure", "--port", str(port), *arguments],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self._reader = threading.Thread(target=self._collect_log, daemon=True)
        self._reader.start()
        self.port = None
        for line in self.process.stdout:
            ready = re.search(r"listening on 127\.0\.0\.1:(\d+)", line)
            if ready:
                self.port = int(ready.group(1))
                break
        if self.port is None:
            raise RuntimeError("the server did not start: " + " ".join(line for _, line in self.log))

    def _collect_log(self):
        for line in self.process.stderr:
            self.log.append((time.monotonic(), line.rstrip()))

    def wait_for_log(self, pattern, after=0.0):
        """Waits for a log line after `after` that matches. Returns its time (monotonic)."""
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            for at, line in list(self.log):
                if at >= after and re.search(pattern, line):
                    return at
            time.sleep(0.01)
        raise AssertionError(f"no log line matches {pattern!r}: {self.log}")

    def kill(self):
        self.process.kill()
        self._close()

    def _close(self):
        self.process.wait(PATIENCE_S)
        self._reader.join(1)
        self.process.stdout.close()
        self.process.stderr.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.terminate()
            try:
                self.process.wait(PATIENCE_S)
            except subprocess.TimeoutExpired:
                self.process.kill()
        self._close()


def start_client(port, *arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE):
    return subprocess.Popen(
        [program("tandem-client"), "--insecure", "--server", f"127.0.0.1:{port}", "--headless", "--device", "sim",
         *arguments],
        stdout=stdout, stderr=stderr, text=True)


def finish(process):
    """Waits until a program ends. Returns (exit code, stdout, stderr)."""
    out, err = process.communicate(timeout=PATIENCE_S)
    return process.returncode, out, err


def run(name, *arguments):
    done = subprocess.run([program(name), *arguments], capture_output=True, text=True, timeout=PATIENCE_S)
    return done.returncode, done.stdout, done.stderr


def replay_killed(command, file, *arguments):
    """Runs tandem-replay on the recording of a killed program. Returns (whether it succeeded, stdout, stderr). A kill
    may leave a partly written record, which tandem-replay reports with exit code 3; this counts as success."""
    code, out, err = run("tandem-replay", command, file, *arguments)
    return code == 0 or code == 3 and "within a record" in err, out, err


def read_trace(path):
    """Returns the rows of a client's CSV trace as dictionaries of floats. An incomplete last line is omitted."""
    with open(path) as file:
        names = file.readline().strip().split(",")
        rows = []
        for line in file:
            if not line.endswith("\n"):
                break
            cells = line.strip().split(",")
            rows.append({name: float(cell) if cell else float("nan") for name, cell in zip(names, cells)})
        return rows


def full_pipe():
    """Returns (read end, write end) of a pipe that is full."""
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    for size in (65536, 1):
        try:
            while True:
                os.write(writing, b"x" * size)
        except BlockingIOError:
            pass
    # A child process inherits this flag, because it belongs to the open file description.
    os.set_blocking(writing, True)
    return reading, writing


def _wanted_and_taken():
    """Returns (processor time that programs requested, part of it that the host gave to other machines), in ticks since
    boot."""
    with open("/proc/stat") as file:
        user, nice, system, _idle, _iowait, irq, softirq, taken = map(int, file.readline().split()[1:9])
    return user + nice + system + irq + softirq + taken, taken


class KeptResult(unittest.TestResult):
    """Stores the results of one run of a test. They are reported later or discarded."""

    def __init__(self):
        super().__init__()
        self._told = []

    def pass_on(self, result):
        for name, arguments in self._told:
            getattr(result, name)(*arguments)


def _keeping(name):
    def keep(self, *arguments):
        getattr(super(KeptResult, self), name)(*arguments)
        self._told.append((name, arguments))
    return keep


for _name in ("startTest", "stopTest", "addSuccess", "addFailure", "addError", "addSkip", "addSubTest",
              "addExpectedFailure", "addUnexpectedSuccess"):
    setattr(KeptResult, _name, _keeping(_name))


class ProgramTest(unittest.TestCase):
    """A test in real time. A failure is inconclusive if the host of this virtual machine gave the processors to other
    machines; the test is then repeated. If that happens in all attempts, the test is skipped and counted as left out.

    `files` and `programs` are requirements of all tests of the class (tests/support/needs.py)."""

    files = ()
    programs = ()

    def run(self, result=None):
        for _ in range(TRIES):
            wanted, taken = _wanted_and_taken()
            kept = KeptResult()
            super().run(kept)
            wanted, taken = (now - before for now, before in zip(_wanted_and_taken(), (wanted, taken)))
            if kept.wasSuccessful() or taken <= MOST_TAKEN * wanted:
                return kept.pass_on(result)
            failure = (kept.failures + kept.errors)[-1][1].strip()
            print(f"{self.id()} failed while the host took {taken / wanted:.0%} of the time: {failure}", file=sys.stderr)
        why = f"the host takes {taken / wanted:.0%} of the time that programs want"
        needs.note_left_out(self.id(), f"{why}; failed: {failure.splitlines()[-1]}")
        result.startTest(self)
        result.addSkip(self, why)
        result.stopTest(self)

    def setUp(self):
        needs.files(*self.files)
        needs.programs(*self.programs)
        self._folder = tempfile.TemporaryDirectory()
        self.folder = self._folder.name

    def tearDown(self):
        self._folder.cleanup()

    def path(self, name):
        return os.path.join(self.folder, name)

    def write(self, name, text):
        with open(self.path(name), "w") as file:
            file.write(text)
        return self.path(name)

    def assert_setup_error(self, result, *words):
        """Checks for exit code 2 and exactly one line on stderr that contains these words."""
        code, _, err = result
        lines = [line for line in err.splitlines() if line.strip()]
        self.assertEqual(code, 2, err)
        self.assertEqual(len(lines), 1, f"one clear line expected, got: {err}")
        for word in words:
            self.assertIn(word, lines[0])


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]
