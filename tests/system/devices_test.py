"""Tests whole sessions with simulated devices: the real server and the real client, including all system calls.

umockdev provides a Falcon and a SpaceMouse, which a simulator drives (tests/devices/fake_device_main.cpp). An Inverse3
is a WebSocket service on this machine.
"""

import base64
import hashlib
import json
import os
import re
import signal
import socket
import struct
import subprocess
import threading
import time
import unittest

from support import PATIENCE_S, ProgramTest, Server, finish, program, start_client

FIRMWARE_SIZE = 7914
GREEN_AND_HOME, BLUE_AND_HOME = 3, 5


class Session:
    """A client whose output lines are read as they arrive."""

    def __init__(self, command, environment=None):
        self.lines = []
        self._told = 0
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                        text=True, env=environment, start_new_session=True)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        for line in self.process.stderr:
            self.lines.append(line.rstrip())

    def do(self, line):
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()

    def wait_for(self, pattern):
        """Waits for a line that matches, after the line of the previous match. Returns the match."""
        self._told, found = self._find(pattern, self._told)
        return found

    def tell(self):
        begin = len(self.lines)
        self.do("tell")
        words = self._find("^fake: (.*)", begin)[1].group(1).split()
        return dict(zip(words[0::2], map(int, words[1::2])))

    def _find(self, pattern, begin):
        """Returns (index of the line after the match, the match)."""
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            has_ended = self.process.poll() is not None
            for i, line in enumerate(list(self.lines)[begin:], begin):
                found = re.search(pattern, line)
                if found:
                    return i + 1, found
            if has_ended:
                break
            time.sleep(0.01)
        raise AssertionError(f"no line after {begin} matches {pattern!r}: {self.lines}")

    def until(self, is_so):
        deadline = time.monotonic() + PATIENCE_S
        while not is_so(state := self.tell()):
            if time.monotonic() > deadline:
                raise AssertionError(f"{state}: {self.lines}")
            time.sleep(0.02)
        return state

    def kill(self):
        try:
            os.killpg(self.process.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
        self.process.wait(PATIENCE_S)
        self._close()

    def end(self):
        """Ends the client. Returns (exit code, the JSON object that it printed)."""
        if self.process.poll() is None:
            self.do("stop")
        out = self.process.stdout.read()
        code = self.process.wait(PATIENCE_S)
        self._close()
        return code, json.loads(out) if out else None

    def _close(self):
        self._reader.join(1)
        for pipe in (self.process.stdin, self.process.stdout, self.process.stderr):
            pipe.close()


class FakeDevice(ProgramTest):
    programs = ("umockdev-wrapper",)

    def begin(self, server, kind, *arguments):
        session = Session(["umockdev-wrapper", program("fake_device"), kind, program("tandem-client"), "--insecure", "--server",
                           f"127.0.0.1:{server.port}", "--headless", "--json", "--device", kind, *arguments])
        self.addCleanup(session.kill)
        return session

    def assert_good(self, ended):
        code, report = ended
        self.assertEqual(code, 0)
        self.assertTrue(report["all_forces_finite"])
        self.assertTrue(report["became_quiet"])
        return report


class Falcon(FakeDevice):
    def begin_falcon(self, server):
        with open(self.path("firmware.bin"), "wb") as file:
            file.write(bytes((i * 31 + i // 256) % 256 for i in range(FIRMWARE_SIZE)))
        return self.begin(server, "falcon", "--firmware", self.path("firmware.bin"))

    def home(self, falcon):
        falcon.wait_for("device falcon is homing: pull its grip out to you, then push")
        falcon.do("grip 0 0 0.078")
        falcon.until(lambda state: state["light"] == BLUE_AND_HOME)
        falcon.do("grip 0 0 0.175")
        falcon.wait_for("device falcon is ready")

    def press(self, falcon):
        """Moves the handle down and against the border of its workspace, until a force is displayed."""
        for i in range(50):
            falcon.do(f"grip 0 {-0.001 * i:.4f} {0.175 - 0.001 * i:.4f}")
            time.sleep(0.02)
        falcon.until(lambda state: state["motors"] > 20)

    def test_from_firmware_that_fails_twice_to_a_session_with_faults(self):
        with Server("--scene", "two_boxes") as server:
            falcon = self.begin_falcon(server)
            falcon.do("fault corrupt 2")
            self.home(falcon)
            self.assertEqual(falcon.tell()["uploads"], 3)
            in_the_air = falcon.until(lambda state: state["light"] == GREEN_AND_HOME)["motors"]
            self.assertLess(in_the_air, 10, "a trembling hand moves a tool in the air, and nothing else is felt")
            self.press(falcon)
            begin = len(falcon.lines)
            for fault in ("garbage 1", "split 1", "delay 2"):
                falcon.do("fault " + fault)
            time.sleep(1)
            falcon.until(lambda state: state["motors"] > 0)
            self.assertFalse([line for line in falcon.lines[begin:] if " is lost" in line], "nothing is lost by that")
            for fault in ("garbage 0", "split 0", "delay 0"):
                falcon.do("fault " + fault)
            report = self.assert_good(falcon.end())
        self.assertGreater(report["ticks_run"], 1000)
        self.assertGreater(report["force_n"]["max"], 0.3)

    def test_frozen_encoders_let_the_force_go_until_they_move(self):
        with Server("--scene", "two_boxes") as server:
            falcon = self.begin_falcon(server)
            self.home(falcon)
            self.press(falcon)
            falcon.do("fault frozen 1")
            falcon.wait_for("encoders do not move")
            falcon.until(lambda state: state["motors"] == 0)
            falcon.do("fault frozen 0")
            falcon.do("grip 0 -0.0495 0.124")
            falcon.until(lambda state: state["motors"] > 0)
            self.assert_good(falcon.end())

    def test_unplugged_it_is_lost_and_plugged_in_again_it_is_armed_again(self):
        with Server("--scene", "two_boxes") as server:
            falcon = self.begin_falcon(server)
            self.home(falcon)
            self.press(falcon)
            falcon.do("unplug")
            falcon.wait_for("device falcon is lost: it was unplugged")
            falcon.do("power")
            falcon.do("grip 0 0 0.125")
            falcon.do("plug")
            falcon.wait_for("device falcon is homing")
            self.assertEqual(falcon.tell()["motors"], 0)
            falcon.do("grip 0 0 0.078")
            falcon.until(lambda state: state["light"] == BLUE_AND_HOME)
            falcon.do("grip 0 0 0.175")
            falcon.wait_for("device falcon is ready")
            self.press(falcon)
            report = self.assert_good(falcon.end())
        self.assertIn("invalid_sample", report["safety_faults"])
        self.assertGreater(report["invalid_samples"], 0)


class SpaceMouse(FakeDevice):
    def test_its_cap_moves_a_tool_and_it_may_be_unplugged(self):
        with Server("--scene", "two_boxes") as server:
            mouse = self.begin(server, "spacemouse")
            mouse.wait_for("device spacemouse shows no force")
            mouse.until(lambda state: state["light"] == 1)
            mouse.do("report 01 5e 01 00 00 00 00")  # a deflection of 350 units to the right
            time.sleep(1)
            mouse.do("report 01 00 00 00 00 00 00")
            mouse.do("unplug")
            mouse.wait_for("device spacemouse is lost: it was unplugged")
            mouse.do("plug")
            mouse.wait_for("device spacemouse is ready")
            report = self.assert_good(mouse.end())
        self.assertGreater(report["invalid_samples"], 0)
        self.assertEqual(report["force_n"]["max"], 0)


class Service:
    """Simulates the Inverse3 service. It answers each command with the state of a cursor that the test moves."""

    def __init__(self, port=0, receive_bytes=None):
        self.listener = socket.create_server(("127.0.0.1", port))
        if receive_bytes is not None:
            self.listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_bytes)
        self.port = self.listener.getsockname()[1]
        self.place = [0.0, 0.0, 0.0]
        self.force = [0.0, 0.0, 0.0]
        self.commands = 0
        self.delay_s = 0
        self.reads = True  # if false, the service sends states without reading commands
        self.answers = True  # if false, the service reads commands without sending states
        self.is_broken = False  # true after the service received data other than whole commands
        self.connection = None
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self):
        while True:
            try:
                self.connection, _ = self.listener.accept()
                self._talk(self.connection)
            except OSError:
                if self.connection is not None:
                    self.connection.close()
                if self.listener.fileno() < 0:
                    return

    def _talk(self, connection):
        request = b""
        while b"\r\n\r\n" not in request:
            request += connection.recv(4096)
        key = re.search(rb"(?i)sec-websocket-key: *(\S+)", request).group(1)
        accept = base64.b64encode(hashlib.sha1(key + b"258EAFA5-E914-47DA-95CA-C5AB0DC85B11").digest())
        connection.sendall(b"HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                           b"Sec-WebSocket-Accept: " + accept + b"\r\n\r\n")
        self._send(connection)
        while True:
            try:
                while not self.reads:
                    self._send(connection)
                    time.sleep(0.0003)
                self._take(self._receive(connection))
                if self.answers:
                    time.sleep(0.001 + self.delay_s)
                    self._send(connection)
            except (ConnectionResetError, BrokenPipeError):
                self._take_rest(connection)

    def _take(self, message):
        try:
            force = json.loads(message)["inverse3"][0]["commands"]["set_cursor_force"]["values"]
        except (ValueError, KeyError):
            self.is_broken = True
            raise
        self.force = [force["x"], force["y"], force["z"]]
        self.commands += 1

    def _take_rest(self, connection):
        """Reads the commands of a peer that accepts no more states, until an OSError at the end of the stream."""
        while True:
            self._take(self._receive(connection))

    def _send(self, connection):
        place = dict(zip("xyz", self.place))
        text = json.dumps({"inverse3": [{"device_id": "0417", "state": {
            "cursor_position": place, "cursor_velocity": {"x": 0.0, "y": 0.0, "z": 0.0}}}]}).encode()
        connection.sendall(bytes([0x81, 126]) + struct.pack(">H", len(text)) + text)

    @staticmethod
    def _exactly(connection, count):
        data = b""
        while len(data) < count:
            more = connection.recv(count - len(data))
            if not more:
                raise OSError("closed")
            data += more
        return data

    def _receive(self, connection):
        head = self._exactly(connection, 2)
        size = head[1] & 127
        if size == 126:
            (size,) = struct.unpack(">H", self._exactly(connection, 2))
        if head[0] & 15 == 8:
            raise OSError("closed")
        mask = self._exactly(connection, 4)
        return bytes(byte ^ mask[i % 4] for i, byte in enumerate(self._exactly(connection, size)))

    def end(self):
        self.listener.close()
        if self.connection is not None:
            self.connection.close()

    def hang_up(self):
        self.connection.shutdown(socket.SHUT_RDWR)


class Inverse3(ProgramTest):
    def until(self, is_so, what):
        deadline = time.monotonic() + PATIENCE_S
        while not is_so():
            self.assertLess(time.monotonic(), deadline, what)
            time.sleep(0.01)

    def press(self, service):
        for i in range(48):
            service.place[2] = -0.001 * i
            time.sleep(0.02)
        self.until(lambda: service.force[2] > 0.1, "what is below pushes up")

    def pressing(self, server, service):
        """Returns a client that uses the service's device and presses on an object."""
        session = Session([program("tandem-client"), "--insecure", "--server", f"127.0.0.1:{server.port}", "--headless", "--json",
                           "--device", "inverse3", "--service", f"127.0.0.1:{service.port}"])
        self.addCleanup(session.kill)
        session.wait_for("joined two_boxes")
        self.press(service)
        return session

    def test_a_session_through_a_service_that_hangs_up_and_is_slow(self):
        service = Service()
        self.addCleanup(service.end)
        with Server("--scene", "two_boxes") as server:
            session = self.pressing(server, service)
            service.hang_up()
            session.wait_for("device inverse3 is lost: its service has ended the connection")
            service.force = [0.0, 0.0, 0.0]
            session.wait_for("device inverse3 is ready")
            self.until(lambda: service.force[2] > 0.1, "armed again")
            service.delay_s = 0.06
            session.wait_for("time stamp of its samples")
            self.until(lambda: service.force == [0, 0, 0], "samples that old let it go")
            service.delay_s = 0
            self.until(lambda: service.force[2] > 0.1, "and quick ones give it back")
            session.process.terminate()
            code, report = session.end()
        self.assertEqual(code, 0, session.lines)
        self.assertTrue(report["all_forces_finite"])
        self.assertEqual(service.force, [0, 0, 0], "its end is zero")

    def test_a_client_that_is_stopped_or_killed_leaves_no_force(self):
        service = Service()
        self.addCleanup(service.end)
        with Server("--scene", "two_boxes") as server:
            session = self.pressing(server, service)
            for _ in range(3):
                session.process.send_signal(signal.SIGSTOP)
                stopped = time.monotonic()
                self.until(lambda: service.force == [0, 0, 0], "its watchdog says zero")
                self.assertLess(time.monotonic() - stopped, 2, "and not the end of the connection")
                session.process.send_signal(signal.SIGCONT)
                self.until(lambda: service.force[2] > 0.1, "the force comes back")
            session.process.kill()
            self.until(lambda: service.force == [0, 0, 0], "its watchdog says zero")


    def unsent_bytes(self, service):
        """Returns the number of bytes that the client has written and the service has not received."""
        with open("/proc/net/tcp") as file:
            fields = [line.split() for line in file.readlines()[1:]]
        queues = [line[4] for line in fields if int(line[2].split(":")[1], 16) == service.port]
        return max((int(queue.split(":")[0], 16) for queue in queues), default=0)

    def wait_until_full(self, service):
        unsent = -1
        while (now := self.unsent_bytes(service)) != unsent or unsent < 1000:
            unsent = now
            time.sleep(0.5)

    def test_a_client_that_is_killed_while_its_service_reads_nothing_leaves_no_force_and_no_half_frame(self):
        service = Service(receive_bytes=4096)
        self.addCleanup(service.end)
        with Server("--scene", "two_boxes") as server:
            session = self.pressing(server, service)
            service.reads = False
            self.wait_until_full(service)
            session.process.kill()
            time.sleep(1)
            service.answers = False
            service.reads = True
            self.until(lambda: service.force == [0, 0, 0] or service.is_broken, "its watchdog writes zero")
            self.assertFalse(service.is_broken, "a part of a frame stands in the stream")


class TwoDevices(ProgramTest):
    def test_one_person_holds_a_peg_by_both_ends(self):
        with Server("--scene", "peg_in_hole") as server:
            code, out, err = finish(start_client(
                server.port, "--json", "--duration", "12s", "--hand", "peg-left", "--second-device", "sim",
                "--second-hand", "peg-right", "--verbose"))
        self.assertEqual(code, 0, err)
        report = json.loads(out)
        second = report["second"]
        self.assertIn(f'second device: user 1 "{report["user"]}" is here', err)
        self.assertEqual([report["events_dropped"], second["events_dropped"]], [0, 0])
        self.assertIn("with tool near", err)
        self.assertIn("second device: joined peg_in_hole as user 2, with tool far", err)
        self.assertEqual((second["hand"], second["user"]), ("peg-right", report["user"] + " 2"))
        for hand in (report, second):
            self.assertTrue(hand["all_forces_finite"])
            self.assertGreater(hand["force_n"]["max"], 0.3, "both are felt")
            self.assertTrue(hand["became_quiet"])
        self.assertGreater(report["watched_body"]["displacement_m"], 0.02, "and the peg goes with them")

    def test_a_second_device_that_is_not_there_is_said_at_once(self):
        with Server("--scene", "peg_in_hole") as server:
            self.assert_setup_error(finish(start_client(server.port, "--second-device", "wand")), "--second-device",
                                    "wand")
            self.assert_setup_error(finish(start_client(server.port, "--second-device", "inverse3", "--service",
                                                        "127.0.0.1:1")), "inverse3")


if __name__ == "__main__":
    unittest.main()
