"""A hostile server for the real client: a proxy in front of a real server that falsifies messages from a given time on.

Before that time the hand presses on a real wall, so that a force is displayed when the falsification begins.
"""
import os
import select
import signal
import socket
import struct
import subprocess
import tempfile
import threading
import time

import bench
import wire
from wire import HUGE, NAN, part, rigid_state, whole

LIES_AFTER_S = 2.5
LIES_FOR_S = 6.0
ZERO_WITHIN_S = 5.0
MEMORY_MB = 200
COUPLING, STIFFNESS = 5, 2  # field numbers in Scene and Coupling (proto/tandem/scene.proto)
STEPPED = 2  # field number in ServerUpdate: server time of the step (proto/tandem/state.proto)


def raw_fields(data):
    """Yields (number, bytes of the field including its key) for each field in order."""
    at = 0
    while at < len(data):
        start = at
        key, at = wire._read_varint(data, at)
        kind = key & 7
        if kind == 0:
            _, at = wire._read_varint(data, at)
        elif kind == 2:
            size, at = wire._read_varint(data, at)
            at += size
        else:
            at += 8 if kind == 1 else 4
        yield key >> 3, data[start:at]


def replaced(data, number, field):
    """Returns `data` with all fields of this number replaced by `field`."""
    return b"".join(raw for n, raw in raw_fields(data) if n != number) + field


class Lies:
    """Falsifications of a scenario. Messages are forwarded unchanged unless a subclass overrides a method."""

    def __init__(self):
        self.is_lying = False
        self.sequence = 0

    def joined(self, body):
        return body

    def state(self, payload):
        """Returns the falsified payload of a ServerUpdate, or None to drop it."""
        return payload

    def control(self):
        """Returns additional control bytes. They are sent to the client repeatedly while messages are falsified."""
        return b""


class Frozen(Lies):
    """Repeats one state with increasing sequence numbers."""

    kept = None

    def state(self, payload):
        self.kept = self.kept or payload if self.is_lying else None
        return self.kept or payload


class Timeless(Lies):
    """The step numbers increase, but the time of the simulated world is constant."""

    first = None

    def state(self, payload):
        if not self.is_lying:
            return payload
        self.first = self.first or [raw for number, raw in raw_fields(payload) if number == STEPPED][0]
        return replaced(payload, STEPPED, self.first)


class Silent(Lies):
    def state(self, payload):
        return None if self.is_lying else payload


class Replacing(Lies):
    """Replaces one field of each state by absurd numbers."""

    def __init__(self, number, field):
        super().__init__()
        self.number, self.field = number, field

    def state(self, payload):
        return replaced(payload, self.number, self.field) if self.is_lying else payload


class Saying(Lies):
    """Sends a control message as fast as the client can read it."""

    def __init__(self, text):
        super().__init__()
        self.text = text

    def control(self):
        return self.text


class Joined(Lies):
    """Falsifies the reply to a request to join."""

    def __init__(self, change):
        super().__init__()
        self.joined = change


def with_asset(size):
    info = part(1, b"h" * 32) + whole(2, size) + part(3, b"contact") + part(4, b"huge")
    return lambda body: body + part(5, info) * 1000


def with_mass(number):
    return lambda body: replaced(body, 6, part(6, wire.double(1, number) + wire.doubles(2, [0, 0, 0, 1, 0, 0, 0]) +
                                                  wire.doubles(3, [1, 1, 1])))


def with_stiffness(number):
    def change(body):
        scene = next(value for key, value in wire.fields(body) if key == 3)
        coupling = b"".join(raw for key, raw in raw_fields(scene) if key == COUPLING)
        ((_, numbers),) = wire.fields(coupling)
        absurd = replaced(numbers, STIFFNESS, wire.double(STIFFNESS, number))
        return replaced(body, 3, part(3, replaced(scene, COUPLING, part(COUPLING, absurd))))
    return change


def user_joined(user):
    return wire.control(wire.USER_JOINED, whole(1, user) + part(2, b"x" * 60) + whole(3, 1) + whole(4, user % 16))


def many_users():
    return b"".join(user_joined(user) for user in range(1, 5000))


# In these scenarios, the force must become zero, or the program must end with an error message.
SCENARIOS = {
    "frozen step, rising sequence": Frozen,
    "frozen time, rising steps": Timeless,
    "nothing any more": Silent,
    "pose of NaN": lambda: Replacing(7, rigid_state(7, (NAN, 0.0, 0.0))),
    "pose of 1e300 m": lambda: Replacing(7, rigid_state(7, (HUGE, 0.0, 0.0))),
    "force of 1e300 N": lambda: Replacing(8, part(8, wire.double(1, HUGE))),
    "rotation of length 0": lambda: Replacing(7, rigid_state(7, rotation=(0.0, 0.0, 0.0, 0.0))),
    "no tool at all": lambda: Replacing(7, b""),
    "a frame of 4 GiB": lambda: Saying(b"\xff\xff\xff\xff"),
    "a message that is none": lambda: Saying(wire.frame(b"\xff" * 100)),
    "welcome again": lambda: Saying(wire.control(wire.WELCOME, whole(1, 2) + wire.fixed64(4, 1))),
    "a stiffness of 1e300 N/m": lambda: Joined(with_stiffness(HUGE)),
    "a mass of NaN": lambda: Joined(with_mass(NAN)),
    "a mass of 1e300 kg": lambda: Joined(with_mass(HUGE)),
    "assets of 2^40 bytes": lambda: Joined(with_asset(1 << 40)),
}
# In these scenarios, the force may continue: the client displays it from the server's states or the remaining assets.
HARMLESS = {"assets of 2^40 bytes", "a mass of 1e300 kg"}
GROWING = {"users without end": lambda: Saying(many_users())}


class Proxy:
    def __init__(self, server_port, lies):
        self.lies, self.server_port = lies, server_port
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        self.down = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.down.bind(("127.0.0.1", 0))
        self.up = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.up.connect(("127.0.0.1", server_port))
        self.client_at = None
        self.is_over = threading.Event()
        self.threads = [threading.Thread(target=work, daemon=True) for work in (self._accept, self._relay_datagrams)]
        for thread in self.threads:
            thread.start()

    def close(self):
        self.is_over.set()
        for thread in self.threads:
            thread.join(2)
        for each in (self.listener, self.down, self.up):
            each.close()

    def _accept(self):
        self.listener.settimeout(0.1)
        while not self.is_over.is_set():
            try:
                client, _ = self.listener.accept()
            except TimeoutError:
                continue
            try:
                with client, socket.create_connection(("127.0.0.1", self.server_port)) as server:
                    self._relay_control(client, server)
            except OSError:
                continue

    def _relay_control(self, client, server):
        pending = bytearray()
        while not self.is_over.is_set():
            readable, _, _ = select.select([client, server], [], [], 0.02)
            for source in readable:
                data = source.recv(1 << 16)
                if not data:
                    return
                if source is client:
                    server.sendall(data)
                else:
                    pending += data
                    self._pass_frames(pending, client)
            if self.lies.is_lying and self.lies.control():
                client.settimeout(0.5)
                client.sendall(self.lies.control())

    def _pass_frames(self, pending, client):
        while len(pending) >= 4:
            (size,) = struct.unpack(">I", pending[:4])
            if len(pending) < 4 + size:
                return
            message = bytes(pending[4:4 + size])
            del pending[:4 + size]
            client.sendall(wire.frame(b"".join(self._changed(number, raw) for number, raw in raw_fields(message))))

    def _changed(self, number, raw):
        if number not in (wire.WELCOME, wire.JOINED):
            return raw
        ((_, body),) = wire.fields(raw)
        if number == wire.WELCOME:
            return part(number, replaced(body, 6, whole(6, self.down.getsockname()[1])))
        return part(number, self.lies.joined(body))

    def _relay_datagrams(self):
        while not self.is_over.is_set():
            readable, _, _ = select.select([self.down, self.up], [], [], 0.1)
            try:
                if self.down in readable:
                    data, self.client_at = self.down.recvfrom(2048)
                    self.up.send(data)
                if self.up in readable:
                    self._pass_state(self.up.recv(2048))
            except OSError:
                continue

    def _pass_state(self, datagram):
        payload = self.lies.state(datagram[wire.HEADER_BYTES:])
        if payload is not None and self.client_at is not None:
            self.down.sendto(datagram[:wire.HEADER_BYTES] + payload, self.client_at)


def memory_mb(pid):
    try:
        with open(f"/proc/{pid}/status") as file:
            for line in file:
                if line.startswith("VmRSS:"):
                    return int(line.split()[1]) / 1024
    except OSError:
        pass
    return 0.0


def run_scenario(name, make_lies, lies_for_s=LIES_FOR_S):
    """Runs one scenario. Returns its row of the table."""
    lies = make_lies()
    with tempfile.TemporaryDirectory() as folder:
        trace = os.path.join(folder, "trace.csv")
        server = bench.Server(bench.write_scene(folder))
        proxy = Proxy(server.port, lies)
        try:
            client = bench.start_client("--insecure", "--server", f"127.0.0.1:{proxy.port}", "--hand", bench.write_hand(folder), "--trace", trace)
            time.sleep(LIES_AFTER_S)
            memory = memory_mb(client.pid)
            lies.is_lying, began_ns = True, bench.clock_ns()
            growth = 0.0
            while bench.clock_ns() < began_ns + lies_for_s * 1e9 and client.poll() is None:
                growth = max(growth, memory_mb(client.pid) - memory)
                time.sleep(0.05)
            was_running = client.poll() is None
            end_ns = bench.clock_ns()
            if was_running:
                client.send_signal(signal.SIGINT)
            _, err = client.communicate(timeout=bench.PATIENCE_S)
        finally:
            proxy.close()
            server.stop()
        rows = bench.read_trace(trace, 0, 1 << 63) if os.path.exists(trace) else []
    return summary_of(name, rows, began_ns, end_ns, growth, was_running, client.returncode, err)


def summary_of(name, rows, began_ns, end_ns, growth, was_running, code, err):
    length = lambda row: sum(number ** 2 for number in bench.force_n(row)) ** 0.5
    before = max((length(row) for row in rows if int(row["local_ns"]) < began_ns), default=0.0)
    lied_to = [row for row in rows if began_ns <= int(row["local_ns"]) < end_ns]
    zero_ns = next((int(row["local_ns"]) for row in lied_to if length(row) == 0), end_ns if lied_to else began_ns)
    later = max((length(row) for row in lied_to if int(row["local_ns"]) > zero_ns), default=0.0)
    largest = bench.describe(rows)["force_step_n_per_ms"] if rows else 0.0
    lines = [line for line in err.splitlines() if line.strip() and "real-time" not in line and "locked" not in line]
    return {"scenario": name, "force_before_n": before, "zero_after_s": (zero_ns - began_ns) * 1e-9,
            "force_later_n": later, "force_step_n_per_ms": largest,
            "growth_mb": growth, "ended": not was_running, "code": code, "said": lines[-1] if lines else ""}


def problems_of(row):
    found = []
    if row["growth_mb"] > MEMORY_MB:
        found.append(f"the client grew by {row['growth_mb']:.0f} MB")
    if row["force_step_n_per_ms"] > bench.SLEW_N_PER_MS:
        found.append(f"a force step of {row['force_step_n_per_ms']:.2f} N/ms")
    if row["scenario"] not in HARMLESS and row["scenario"] not in GROWING and row["zero_after_s"] > ZERO_WITHIN_S:
        found.append(f"the force stayed for {row['zero_after_s']:.1f} s")
    if row["ended"] and not row["said"]:
        found.append("it ended without a word")
    return found
