"""Measures the service of a server under attack for a well-behaved user: states, forces and joining."""
import csv
import json
import os
import re
import signal
import subprocess
import sys
import threading
import time

import attackers
import wire
from wire import OBSERVER, RawClient

HERE = os.path.dirname(os.path.abspath(__file__))
SOURCE = os.path.dirname(os.path.dirname(HERE))
BIN = os.environ.setdefault("TANDEM_BIN", os.path.join(SOURCE, "build/release/bin"))
PATIENCE_S = 60
STEPS_PER_S = 1000
SLEW_N_PER_MS = 4.0  # slew limit of the simulated device
SETTLED_S = 2.5  # time until the hand has reached the wall and rests
AFTER_S = 0.7
PRESSES = {"points": [{"t_s": 0, "position_m": [0, 0, 0], "phase": "approach"},
                      {"t_s": 1.5, "position_m": [0.073, 0, 0], "phase": "hold"},
                      {"t_s": 600, "position_m": [0.073, 0, 0]}]}


def write_scene(folder):
    """Writes the wall scene with additional user slots for attackers, and with an asset that they can request."""
    with open(os.path.join(SOURCE, "server/scenes/wall.json")) as file:
        scene = json.load(file)
    scene["tools"] += [{"name": f"other {i}", "placement": {"position_m": [-0.05, 0.3 * i, 0]}, "mass_kg": 0.03} for i in (1, 2)]
    scene["limits"] = {"observers": 8, "manipulators": 3}
    with open(os.path.join(folder, "big.obj"), "w") as file:
        file.write("# " + "x" * 300_000 + "\nv 0 1 0\nv 0.01 1 0\nv 0 1.01 0\nv 0 1 0.01\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    scene["bodies"].append({"name": "far away", "shapes": [{"mesh": {"file": "big.obj"}}], "placement": {"position_m": [1, 1, 1]}})
    path = os.path.join(folder, "scene.json")
    with open(path, "w") as file:
        json.dump(scene, file)
    return path


def write_hand(folder):
    path = os.path.join(folder, "hand.json")
    with open(path, "w") as file:
        json.dump(PRESSES, file)
    return path


class Server:
    def __init__(self, scene, *arguments, state=None):
        """Starts the server. `state` is the folder of its keys, or None for a server without encryption."""
        self.log, self.state = [], state
        security = ["--state", state, "--bind", "127.0.0.1"] if state else ["--insecure"]
        self.process = subprocess.Popen([os.path.join(BIN, "tandem-server"), *security, "--scene", scene, "--port", "0", "--cache", "",
                                         *arguments],
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.port = int(re.search(r"listening on 127\.0\.0\.1:(\d+)", self.process.stdout.readline()).group(1))
        self._reader = threading.Thread(target=self._read_log, daemon=True)
        self._reader.start()

    def _read_log(self):
        for line in self.process.stderr:
            self.log.append(line.rstrip())

    def invitation(self):
        done = subprocess.run([os.path.join(BIN, "tandem-token"), "--state", self.state, "--server", f"127.0.0.1:{self.port}"],
                              capture_output=True, text=True, check=True, timeout=PATIENCE_S)
        return done.stdout.split("--join ")[1].strip()

    def how_to_join(self):
        """Returns the options of tandem-client for joining this server."""
        return ("--join", self.invitation()) if self.state else ("--insecure", "--server", f"127.0.0.1:{self.port}")

    def memory_mb(self):
        with open(f"/proc/{self.process.pid}/status") as file:
            return int(re.search(r"VmRSS:\s+(\d+) kB", file.read()).group(1)) / 1024

    def stop(self):
        if self.process.poll() is None:
            self.process.terminate()
        self.process.wait(PATIENCE_S)
        self._reader.join(2)
        self.process.stdout.close()
        self.process.stderr.close()


def clock_ns():
    """Returns the current time on the clock of the trace's column local_ns [ns]."""
    return time.clock_gettime_ns(time.CLOCK_BOOTTIME)


class Newcomer(threading.Thread):
    """Joins and leaves repeatedly, and measures the time that a new user needs to join during an attack."""

    def __init__(self, server):
        super().__init__(daemon=True)
        self.server, self.waits_s, self.refused = server, [], 0
        self.is_over = threading.Event()

    def run(self):
        while not self.is_over.wait(0.4):
            token = self._token() if self.server.state else b""
            begin = time.monotonic()
            try:
                client = RawClient(self.server.port, 3.0, bool(token))
                if token:
                    client.join("newcomer", OBSERVER, "state-tcp", token)
                    self._await_state_of_stream(client)
                else:
                    client.join("newcomer", OBSERVER)
                    self._await_state(client)
                self.waits_s.append(time.monotonic() - begin)
                client.close()
            except OSError:
                self.refused += 1

    def _token(self):
        return wire.token_bytes(self.server.invitation().split("/")[2])

    @staticmethod
    def _await_state_of_stream(client):
        client.stream.sendall(wire.frame(wire.part(wire.STATE_DATAGRAM, client.datagram())))
        for _ in range(100):
            if any(number == wire.STATE for number, _ in wire.fields(client.receive())):
                return
        raise TimeoutError("no state was received")

    def _await_state(self, client):
        client.datagrams.settimeout(0.002)
        for _ in range(1500):
            client.send_state()
            try:
                client.datagrams.recv(2048)
                return
            except TimeoutError:
                continue
        raise TimeoutError("no state was received")


def force_n(row):
    return [float(row[f"displayed_force_{axis}_n"]) for axis in "xyz"]


def read_trace(path, begin_ns, end_ns):
    with open(path) as file:
        return [row for row in csv.DictReader(file) if begin_ns <= int(row["local_ns"]) < end_ns]


def describe(rows):
    largest = 0.0
    for before, row in zip(rows, rows[1:]):
        ms = max(1.0, (int(row["local_ns"]) - int(before["local_ns"])) * 1e-6)
        step = sum((a - b) ** 2 for a, b in zip(force_n(row), force_n(before))) ** 0.5
        largest = max(largest, step / ms)
    return {"silence_ms": max(float(row["state_age_s"] or "inf") for row in rows) * 1e3,
            "force_step_n_per_ms": largest,
            "force_n": sum(number ** 2 for number in force_n(rows[-1])) ** 0.5}


def last_group(log, pattern, default=""):
    found = [match.group(1) for match in (re.search(pattern, line) for line in log) if match]
    return found[-1] if found else default


def start_client(*arguments):
    return subprocess.Popen([os.path.join(BIN, "tandem-client"), "--headless", "--json", *arguments],
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def run_attack(name, seconds, folder, rights=()):
    """Runs one attack. Returns its row of the table. `rights` are server options that control real-time permissions."""
    trace = os.path.join(folder, "trace.csv")
    state = os.path.join(folder, "state") if name in attackers.OF_SECURE_SERVERS else None
    server = Server(write_scene(folder), *rights, state=state)
    try:
        ada = start_client(*server.how_to_join(), "--name", "ada", "--hand", write_hand(folder), "--trace", trace)
        time.sleep(SETTLED_S)
        memory = server.memory_mb()
        newcomer = Newcomer(server)
        newcomer.start()
        begin_ns = clock_ns()
        attacker = None
        if name:
            attacker = subprocess.Popen([sys.executable, os.path.join(HERE, "attackers.py"), name, str(server.port), str(seconds)],
                                        stdout=subprocess.PIPE, text=True, preexec_fn=lambda: os.nice(5))
        growth = 0.0
        while clock_ns() < begin_ns + seconds * 1e9 or (attacker and attacker.poll() is None):
            growth = max(growth, server.memory_mb() - memory)
            time.sleep(0.05)
        end_ns = clock_ns()
        newcomer.is_over.set()
        newcomer.join()
        done = json.loads(attacker.communicate()[0]) if attacker else {"sent": 0, "ended": 0}
        time.sleep(AFTER_S)
        still_there = ada.poll() is None
        ada.send_signal(signal.SIGINT)
        summary = json.loads(ada.communicate(timeout=PATIENCE_S)[0])
        time.sleep(0.2)
    finally:
        server.stop()
    took_s = (end_ns - begin_ns) * 1e-9
    row = describe(read_trace(trace, begin_ns, end_ns))
    steps = [int(row["newest_step"]) for row in read_trace(trace, 0, 1 << 63) if row["newest_step"] != "0"]
    lost = steps[-1] - steps[0] + 1 - summary["datagrams"]["received"]
    row["states_kept"] = 1 - max(0, lost) / (STEPS_PER_S * took_s)
    taken = int(last_group(server.log, r'"ada" left room .*?; (\d+) inputs', "0"))
    row["inputs_kept"] = 1 - max(0, summary["datagrams"]["sent"] - taken) / (STEPS_PER_S * took_s)
    gone = [line for line in server.log if re.search(r'" left room', line)]
    row["others_ended"] = [line for line in gone if re.search('"ada"|"newcomer"|"slow"', line) and
                           not re.search("left on request|connection was lost|silen|nothing heard", line)]
    row |= {"attack": name or "nobody", "sent_per_s": done["sent"] / took_s, "growth_mb": growth, "ended": done["ended"],
            "is_alive": still_there and summary["reconnects"] == 0, "joins": len(newcomer.waits_s), "refused": newcomer.refused,
            "join_ms": max(newcomer.waits_s, default=float("inf")) * 1e3, "log_lines": len(server.log)}
    return row
