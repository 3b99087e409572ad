"""Tests a client that is stopped or killed while it displays a force. Its watchdog must write zero to the motors, even
if they accept no data at that time.

`--motors` names a pipe that receives the commands of a simulated device, like the USB descriptor of a real device.
"""

import fcntl
import os
import signal
import struct
import threading
import time
import unittest

from support import PATIENCE_S, ProgramTest, Server, finish, start_client
from stall_test import PRESSES

COMMAND = struct.Struct("3d")
F_SETPIPE_SZ = 1031
SLEW_N = 4.0  # largest force change per tick: the slew limit of the simulated device


class Motors:
    """The other end of a device's line. It records the received commands and their times."""

    def __init__(self, path, pipe_bytes=1 << 20):
        os.mkfifo(path)
        self.path = path
        self.told = []  # list of (time, force [N])
        self.reads = threading.Event()
        self.reads.set()
        self._pipe = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        fcntl.fcntl(self._pipe, F_SETPIPE_SZ, pipe_bytes)
        os.set_blocking(self._pipe, True)
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        data = b""
        while True:
            self.reads.wait()
            more = os.read(self._pipe, 65536)
            if not more:
                time.sleep(0.001)  # no process has opened the line yet
            now = time.monotonic()
            data += more
            whole = len(data) // COMMAND.size * COMMAND.size
            for x, y, z in COMMAND.iter_unpack(data[:whole]):
                self.told.append((now, (x * x + y * y + z * z) ** 0.5))
            data = data[whole:]

    def wait_for(self, is_it, after):
        """Waits for the first command after `after` for whose force `is_it` returns true. Returns its time."""
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            for at, force_n in self.told[:]:
                if at >= after and is_it(force_n):
                    return at
            time.sleep(0.005)
        raise AssertionError("the motors were never told so")


class Pressing(ProgramTest):
    """A client that presses on a wall, and its motors."""
    pipe_bytes = 1 << 20

    def setUp(self):
        super().setUp()
        self.server = Server("--scene", "wall")
        self.addCleanup(self.server.__exit__)
        self.motors = Motors(self.path("motors"), self.pipe_bytes)
        self.trace = self.path("trace.csv")
        self.client = start_client(self.server.port, "--hand", self.write("press.json", PRESSES), "--motors",
                                   self.motors.path, "--trace", self.trace, "--duration", "600s")
        self.addCleanup(self.end_client)
        self.wait_for_force(time.monotonic())

    def end_client(self):
        if self.client.poll() is None:
            self.client.kill()
        self.client.communicate()

    def wait_for_force(self, after):
        return self.motors.wait_for(lambda force_n: force_n > 3, after)

    def wait_for_zero(self, after):
        return self.motors.wait_for(lambda force_n: force_n == 0, after)

    def watchdogs(self):
        """Returns the process ids of the client's children, which are its watchdogs."""
        with open(f"/proc/{self.client.pid}/task/{self.client.pid}/children") as file:
            return [int(word) for word in file.read().split()]

    def check_return(self, forces_n):
        """Checks the forces after a stop. A pending command may still arrive. Then zero must follow at once, and after
        it the ramp begins."""
        late = [force_n for force_n in forces_n[:20] if force_n > 1]
        self.assertLessEqual(len(late), 2, "the old force was shown again")
        ramp = forces_n[20:]
        for before, now in zip(ramp, ramp[1:]):
            self.assertLessEqual(now - before, 0.5, "the force did not come back by its ramp")
        self.assertGreater(len(forces_n), 100, "the force was back at once")


class Watchdog(Pressing):
    def test_says_zero_while_the_client_stands_still_and_the_force_comes_back_by_its_ramp(self):
        for _ in range(3):
            stopped = time.monotonic()
            os.kill(self.client.pid, signal.SIGSTOP)
            self.wait_for_zero(stopped)
            time.sleep(0.2)
            self.assertEqual(self.motors.told[-1][1], 0, "zero was not the last word")
            told = len(self.motors.told)
            os.kill(self.client.pid, signal.SIGCONT)
            back = self.wait_for_force(time.monotonic())
            self.check_return([force_n for at, force_n in self.motors.told[told:] if at <= back])

    def test_says_zero_when_the_client_is_killed_and_ends(self):
        processes = self.watchdogs()
        self.assertEqual(len(processes), 1)
        killed = time.monotonic()
        self.client.kill()
        self.client.wait(PATIENCE_S)
        self.wait_for_zero(killed)
        deadline = time.monotonic() + PATIENCE_S
        while os.path.exists(f"/proc/{processes[0]}") and time.monotonic() < deadline:
            time.sleep(0.01)
        self.assertFalse(os.path.exists(f"/proc/{processes[0]}"), "the watchdog is still there")
        self.assertEqual(self.motors.told[-1][1], 0)

    def test_says_nothing_after_an_end_in_order(self):
        self.client.send_signal(signal.SIGINT)
        self.assertEqual(finish(self.client)[0], 0)
        self.assertEqual(self.motors.told[-1][1], 0)

    def test_is_not_ended_by_what_a_terminal_sends(self):
        (process,) = self.watchdogs()
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGTSTP):
            os.kill(process, number)
        stopped = time.monotonic()
        os.kill(self.client.pid, signal.SIGSTOP)
        self.wait_for_zero(stopped)
        os.kill(self.client.pid, signal.SIGCONT)


class BusyMotors(Pressing):
    """The line accepts no data when the client is stopped or killed, and for one second afterwards."""
    pipe_bytes = 4096

    def end_while_busy(self, number):
        """Sends this signal to the client while its line is full. Begins to read the line one second later. Returns the
        time at which reading began."""
        self.motors.reads.clear()
        time.sleep(0.5)  # 170 commands fill the line in this time
        os.kill(self.client.pid, number)
        time.sleep(1)
        self.motors.reads.set()
        return time.monotonic()

    def test_says_zero_once_they_take_it_after_the_client_was_killed(self):
        self.wait_for_zero(self.end_while_busy(signal.SIGKILL))
        time.sleep(0.1)
        self.assertEqual(self.motors.told[-1][1], 0, "zero was not the last word")

    def test_says_zero_once_they_take_it_while_the_client_is_stopped_and_the_force_comes_back_by_its_ramp(self):
        self.wait_for_zero(self.end_while_busy(signal.SIGSTOP))
        time.sleep(0.1)
        self.assertEqual(self.motors.told[-1][1], 0, "zero was not the last word")
        told = len(self.motors.told)
        os.kill(self.client.pid, signal.SIGCONT)
        back = self.wait_for_force(time.monotonic())
        self.check_return([force_n for at, force_n in self.motors.told[told:] if at <= back])

    def test_an_end_in_order_lets_go_of_them_too(self):
        self.wait_for_zero(self.end_while_busy(signal.SIGINT))
        finish(self.client)
        self.assertEqual(self.motors.told[-1][1], 0)


class WithoutWatchdog(ProgramTest):
    def test_a_missing_watchdog_is_said_before_there_is_a_force(self):
        os.environ["TANDEM_WATCHDOG"] = self.path("nothing")
        self.addCleanup(os.environ.pop, "TANDEM_WATCHDOG")
        client = start_client(9, "--motors", self.path("motors"))
        self.assert_setup_error(finish(client), "nothing", "watchdog", "TANDEM_WATCHDOG")


if __name__ == "__main__":
    unittest.main()
