"""Programs of a soak run: a server that is restarted repeatedly, links, and clients that run throughout."""
import json
import os
import random
import re
import signal
import subprocess
import time
import urllib.request

import prometheus
from resume_test import KeptServer
from secure_test import SecureServer
from support import program

STEP_RATE_HZ = 60
PRESS_PERIOD_S = 6
# Two cores can run some of the sixteen haptic loops in real time, but hardly one loop of a sanitizer build in contact.
# SANITIZED lists the rooms with one client of the sanitizer build. FEELING lists the rooms with one client of the other
# build that has real-time rights. The clients of a room are on different sides of the block.
SANITIZED, FEELING = (0, 1), (2, 3)
# Stages of the clients by side of the block: with a local model, or rendering received states.
STAGES = ("local-model", "local-model", "ar-spline", "late-pose")
JUST_BEGUN_S = 5
# only every fifth tick is written, because writing a row of a trace takes as much time as a tick
OTHERS_TRACE_EVERY = 5
ALL_JOINED_S = 120
ENDED_S = 300  # a leak check needs a few seconds of processor time on a shared processor
STARTED_AGAIN_AFTER_S = 2.5  # after this time the server has detected the loss of the killed client


def clock_s():
    """Returns the time on the clock of the trace's column local_ns [s]."""
    return time.clock_gettime(time.CLOCK_BOOTTIME)


def stand_back():
    os.nice(5)


def keep_time():
    """Requests real-time priority for the calling process, because the emulated network must not wait for a
    processor."""
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(50))
    except PermissionError:
        pass


def memory_mb(process):
    """Returns the resident memory of a process [MB], or None if it has ended."""
    try:
        with open(f"/proc/{process.pid}/status") as file:
            return int(re.search(r"VmRSS:\s+(\d+) kB", file.read()).group(1)) / 1024
    except (OSError, AttributeError):
        return None


def scene(name, is_solid):
    """Returns a scene for a room. Either a block on a spring has a tool on each side and is pressed, pushed and held,
    or wind in a viscous fluid causes forces without contacts. Shapes are small, because their surface is sampled when a
    client joins."""
    block = {"name": "block", "shapes": [{"box": {"size_m": [0.02, 0.02, 0.02]}}], "mass_kg": 0.2, "anchor": {},
             "graspable": True, "placement": {"position_m": [0, 0, 0 if is_solid else -0.1]}}
    tools = [{"name": side, "placement": {"position_m": [0.04 * x, 0.04 * y, 0]}, "mass_kg": 0.03,
              "shapes": [{"sphere": {"radius_m": 0.003}}]}
             for side, x, y in (("left", -1, 0), ("right", 1, 0), ("near", 0, -1), ("far", 0, 1), ("left again", -1, 0.3))]
    effects = [{"label": "bath", "viscosity": {"damping_n_s_per_m": 8}}, {"label": "wind", "constant_field": {"force_n": [0.8, 0.4, 0]}}]
    return {"name": name, "bodies": [block], "tools": tools, "step_rate_hz": STEP_RATE_HZ,
            "limits": {"reset_after_s": 3600}, "effects": [] if is_solid else effects,
            "coupling": {"law": "spring-damper", "stiffness_n_per_m": 500, "damping_n_s_per_m": 5,
                         "stiffness_n_m_per_rad": 0.5, "damping_n_m_s_per_rad": 0.005}}


def hand(side, seconds, is_solid):
    """Returns the path of a hand that repeatedly presses towards the centre of the block and retreats. Some hands grab
    the block while they press."""
    direction = ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0))[side % 4]
    # The start is 40 mm away. Two hands press, one grabs and one only approaches, because contacts need most of the
    # computing time.
    depth = (0.030, 0.030, 0.0285, 0.020)[side % 4] if is_solid else 0.033
    grabs = ["grab"] if is_solid and side % 4 == 2 else []
    points, at = [{"t_s": 0, "position_m": [0, 0, 0], "phase": "approach"}], 1.5 * side
    while at < seconds:
        pressed = [depth * axis for axis in direction]
        points += [{"t_s": at + 1, "position_m": pressed, "buttons": grabs, "phase": "press"},
                   {"t_s": at + 2, "position_m": pressed, "buttons": []},
                   {"t_s": at + PRESS_PERIOD_S - 3, "position_m": [0, 0, 0], "phase": "free"}]
        at += PRESS_PERIOD_S
    return {"points": points}


class SoakServer(KeptServer):
    """One process of the server, with --resume, recordings and metrics."""

    def __init__(self, folder, port, number, scenes):
        self.records = os.path.join(folder, f"records{number}")
        more = [part for path in scenes[1:] for part in ("--scene", path)]
        SecureServer.__init__(self, folder, "--resume", "--record", self.records, "--metrics", "0", "--cache", "",
                              *more, port=port, scene=scenes[0])
        self.number, self.memory, self.steps, self.metrics = number, [], {}, {}
        self.began, self.lived_s = clock_s(), float("inf")
        line = self.wait_for(r"metrics at http://([\d.]+:\d+)/metrics")
        self._metrics = f"http://{line.group(1)}/metrics"

    def sample(self):
        mb = memory_mb(self.process)
        if mb is not None:
            self.memory.append((clock_s(), mb))
        try:
            with urllib.request.urlopen(self._metrics, timeout=1) as answer:
                families = prometheus.parse(answer.read().decode())
        except (OSError, prometheus.BadText):
            return
        for (name, labels), value in families.get("tandem_room_steps_total", {"samples": {}})["samples"].items():
            self.steps.setdefault(dict(labels)["room"], []).append((clock_s(), value))
        self.metrics = families

    def total(self, name):
        """Returns the last sampled value of a counter without labels."""
        return sum(self.metrics.get(name, {"samples": {}})["samples"].values())

    def recordings(self):
        """Returns the paths of the recordings. If the server ran for less than JUST_BEGUN_S, the list is empty, because
        the recordings may be empty."""
        if self.lived_s < JUST_BEGUN_S:
            return []
        return [os.path.join(self.records, name) for name in sorted(os.listdir(self.records)) if name.endswith(".mcap")]


def pace_of(samples, begin, end):
    """Returns the steps per second from 3 s before `begin` to 2 s after `end`, or None if unknown."""
    within = [(at, steps) for at, steps in samples if begin - 3 <= at <= end + 2]
    if len(within) < 2:
        return None
    return (within[-1][1] - within[0][1]) / (within[-1][0] - within[0][0])


class Links:
    """One process of tandem-lab with a link for each client."""

    def __init__(self, lab, addresses, port, seed, link):
        listen = [part for address in addresses for part in ("--listen", address)]
        self.process = subprocess.Popen([lab, "link", *listen, "--port", str(port), "--seed", str(seed), *link],
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, preexec_fn=keep_time)
        for _ in addresses:
            if "tandem-lab link" not in self.process.stdout.readline():
                raise RuntimeError("tandem-lab link did not start")

    def say(self, word, address):
        self.process.stdin.write(f"{word} {address}\n")
        self.process.stdin.flush()
        self.process.stdout.readline()

    def end(self):
        self.process.terminate()
        self.process.wait(ENDED_S)
        self.process.stdin.close()
        self.process.stdout.close()


class SoakClient:
    """One user during the whole run. Each of its lives is one process."""

    def __init__(self, number, side, feels, folder, room, address, program_file):
        self.number, self.feels, self.folder, self.room, self.address = number, feels, folder, room, address
        self.program_file, self.is_judged = program_file, program_file == program("tandem-client")
        self.name = f"user{number}"
        self.stage = STAGES[side % len(STAGES)]
        self.hand = os.path.join(folder, f"hand{number}.json")
        self.lives, self.process = [], None
        self.is_busy = False  # true while an event is in progress

    def start(self, server):
        life = {"begin": clock_s(), "memory": [], "expected": (0,), "tried": 0}
        base = os.path.join(self.folder, f"{self.name}.{len(self.lives)}")
        life |= {"trace": base + ".csv", "out": base + ".json", "err": base + ".log"}
        invitation = server.invitation("--name", self.name, "--room", self.room, address=self.address)
        with open(life["out"], "w") as out, open(life["err"], "w") as err:
            self.process = subprocess.Popen(
                [self.program_file, "--headless", "--device", "sim", "--json", "--verbose", "--hand", self.hand,
                 "--stage", self.stage, "--deadband", "50%", "--seed", str(self.number), "--trace", life["trace"],
                 *([] if self.feels else ["--rt-priority", "0", "--trace-every", str(OTHERS_TRACE_EVERY)]), "--join", invitation], stdout=out, stderr=err,
                preexec_fn=None if self.is_judged or self.feels else stand_back)
        life["pid"] = self.process.pid
        self.lives.append(life)

    @property
    def life(self):
        return self.lives[-1]

    def has_joined(self):
        with open(self.life["err"], errors="replace") as file:
            return " joined " in file.read()

    def signal(self, number):
        if self.process.poll() is None:
            self.process.send_signal(number)

    def note_end(self):
        """Records exit code and time after the program has ended."""
        self.life["code"], self.life["end"] = self.process.wait(ENDED_S), clock_s()

    def sample(self):
        mb = memory_mb(self.process)
        if mb is not None and self.process.poll() is None:
            self.life["memory"].append((clock_s(), mb))


def is_fresh(client):
    """Returns whether the newest row of the trace is recent and its state is younger than 1 s."""
    try:
        with open(client.life["trace"], "rb") as file:
            names = file.readline().decode().strip().split(",")
            file.seek(max(0, os.path.getsize(client.life["trace"]) - 4096))
            cells = file.read().decode().split("\n")[-2].split(",")
        age, at = cells[names.index("state_age_s")], cells[names.index("local_ns")]
        return client.process.poll() is None and float(age) < 1 and clock_s() - int(at) * 1e-9 < 3
    except (OSError, ValueError, IndexError):
        return False


class Event:
    def __init__(self, kind, begin, client=None):
        self.kind, self.begin, self.end, self.client = kind, begin, None, client

    def window(self, until):
        return self.begin, self.end if self.end is not None else until


class Soak:
    """Events and their times, which are drawn from one seed."""

    KINDS = ("cut", "reset", "move", "stop", "kill", "leave")

    def __init__(self, folder, settings, lab):
        self.folder, self.settings, self.lab = folder, settings, lab
        self.random = random.Random(settings.seed)
        self.events, self.servers, self.restarts, self.problems = [], [], [], []
        self.pending = []  # list of (time, action)
        self.refused = 0

    def path(self, name):
        return os.path.join(self.folder, name)

    def note(self, text):
        with open(self.path("events.log"), "a") as file:
            file.write(f"{clock_s():.3f} {text}\n")

    def open(self, port):
        settings = self.settings
        self.rooms = [f"room{number}" for number in range(settings.rooms)]
        self.scenes = []
        for number, room in enumerate(self.rooms):
            self.scenes.append(self.path(room + ".json"))
            with open(self.scenes[-1], "w") as file:
                json.dump(scene(room, number % 2 == 1), file)
        self.port = port
        self.server = self.start_server()
        addresses = [f"127.0.0.{2 + number}" for number in range(settings.clients)]
        self.links = Links(self.lab, addresses, port, settings.seed, settings.link)
        self.clients = []
        for number, address in enumerate(addresses):
            room, side = number % settings.rooms, number // settings.rooms
            is_chosen = side == room % max(1, settings.clients // settings.rooms)
            is_sanitized = settings.all or (is_chosen and room in SANITIZED)
            client = SoakClient(number, side, settings.all or (is_chosen and room in FEELING), self.folder, self.rooms[room],
                                address, program("tandem-client") if is_sanitized else settings.other_client)
            with open(client.hand, "w") as file:
                json.dump(hand(side, settings.seconds + 120, room % 2 == 1), file)
            self.clients.append(client)
            client.start(self.server)
            time.sleep(0.2)
        deadline = clock_s() + ALL_JOINED_S
        while not all(client.has_joined() for client in self.clients):
            if clock_s() > deadline:
                raise RuntimeError("not all clients have joined; the machine is too busy")
            self.look_after_clients(clock_s())
            self.do_what_is_due(clock_s())
            time.sleep(0.1)

    def start_server(self):
        server = SoakServer(self.folder, self.port, len(self.servers), self.scenes)
        self.servers.append(server)
        return server

    def run(self):
        begin = self.began_s = clock_s()
        end = begin + self.settings.seconds
        next_client, next_sample = begin + self.settings.settled_s, begin
        next_server = begin + self.settings.server_every_s
        self.downed = 0
        while clock_s() < end:
            now = clock_s()
            self.do_what_is_due(now)
            self.look_after_clients(now)
            if now >= next_sample:
                self.sample()
                next_sample = now + 1
                self.note(f"{sum(client.has_joined() for client in self.clients)} have joined")
            if self.server is not None and now >= next_server:
                self.end_server(now)
                next_server = now + self.settings.server_every_s * self.random.uniform(0.7, 1.3)
            elif now >= next_client:
                self.trouble_a_client(now)
                next_client = now + self.random.expovariate(1 / self.settings.client_every_s)
            time.sleep(0.02)
        for _, action in sorted(self.pending, key=lambda entry: entry[0]):
            action()
        self.pending = []
        quiet = clock_s() + self.settings.back_s
        # A slow machine gets more time at the end. A client that never returns is nevertheless detected.
        while clock_s() < quiet or (clock_s() < quiet + ALL_JOINED_S and not all(map(is_fresh, self.clients))):
            self.do_what_is_due(clock_s())
            self.look_after_clients(clock_s())
            time.sleep(0.05)

    def later(self, when, action):
        self.pending.append((when, action))

    def do_what_is_due(self, now):
        due = [entry for entry in self.pending if entry[0] <= now]
        self.pending = [entry for entry in self.pending if entry[0] > now]
        for _, action in due:
            action()

    def sample(self):
        if self.server is not None:
            self.server.sample()
        for client in self.clients:
            if client.process.poll() is None:
                client.sample()

    def look_after_clients(self, now):
        """Restarts clients that failed to join, as a user would do. Any other exit without an event is a fault."""
        for client in self.clients:
            if client.is_busy or client.process.poll() is None:
                continue
            if client.has_joined():
                client.note_end()
                client.is_busy = True
                self.problems.append(f"{client.name}: ended by itself with exit code {client.life['code']}")
                self.start_again(client, now + 1, None)
            elif self.server is not None:
                client.note_end()
                client.life["expected"] = (1, 2)
                self.refused += 1
                client.is_busy = True
                self.start_again(client, now + 1, None)

    def start_again(self, client, when, event):
        def start():
            if self.server is None:
                return self.later(clock_s() + 0.5, start)
            client.start(self.server)
            self.note(f"{client.name} started again")
            client.is_busy = False
            if event is not None:
                event.end = clock_s()
        self.later(when, start)

    def end_server(self, now):
        kills = self.downed % 2 == 0
        self.downed += 1
        event = Event("server killed" if kills else "server ended", now)
        self.events.append(event)
        self.note(event.kind)
        server, self.server = self.server, None
        server.killed = kills
        server.sample()
        server.ended_at, server.lived_s = time.time(), clock_s() - server.began
        server.end(signal.SIGKILL if kills else signal.SIGTERM)

        def start():
            self.server = self.start_server()
            event.end = clock_s()
            self.note("server started again")
            # The age of the checkpoint when it is read is the time since the end of the old server, including the start
            # of the new one.
            self.restarts.append((self.server, (time.time() - server.ended_at) * 1e3, kills))
        self.later(now + self.random.uniform(0.2, 3.0), start)

    def trouble_a_client(self, now):
        free = [client for client in self.clients if not client.is_busy and client.has_joined() and client.process.poll() is None]
        if not free:
            return
        client, kind = self.random.choice(free), self.random.choice(self.KINDS)
        lasts_s = self.random.uniform(0.2, 5.0)
        event = Event(kind, now, client)
        self.events.append(event)
        self.note(f"{kind} {client.name}")
        client.is_busy = True
        getattr(self, "_" + kind)(client, event, now, lasts_s)

    def _over(self, client, event):
        client.is_busy = False
        event.end = clock_s()

    def _cut(self, client, event, now, lasts_s):
        self.links.say("cut", client.address)
        self.later(now + lasts_s, lambda: (self.links.say("restore", client.address), self._over(client, event)))

    def _reset(self, client, event, *_):
        self.links.say("reset", client.address)
        self._over(client, event)

    def _move(self, client, event, *_):
        self.links.say("move", client.address)
        self._over(client, event)

    def _stop(self, client, event, now, lasts_s):
        client.signal(signal.SIGSTOP)
        self.later(now + lasts_s, lambda: (client.signal(signal.SIGCONT), self._over(client, event)))

    def _kill(self, client, event, now, _):
        client.signal(signal.SIGKILL)
        client.life["expected"] = (-signal.SIGKILL,)
        client.note_end()
        self.start_again(client, now + STARTED_AGAIN_AFTER_S, event)

    def _leave(self, client, event, now, _):
        client.signal(signal.SIGTERM)
        client.life["expected"] = (0, 1)  # 1 is expected if the client had no session

        def when_ended():
            if client.process.poll() is None:
                return self.later(clock_s() + 0.2, when_ended)
            client.note_end()
            self.start_again(client, clock_s() + STARTED_AGAIN_AFTER_S, event)
        self.later(now + 0.2, when_ended)

    def close(self):
        for client in self.clients:
            client.signal(signal.SIGCONT)
            client.signal(signal.SIGTERM)
        self.note("the end")
        for client in self.clients:
            if "code" not in client.life:
                client.note_end()
        self.links.end()
        server, self.server = self.server, None
        if server is not None:
            server.sample()
            server.killed = False
            server.end(signal.SIGTERM)

    def kill(self):
        """Kills all remaining processes after a fault of the test itself."""
        processes = [client.process for client in getattr(self, "clients", []) if client.process is not None]
        processes += [server.process for server in self.servers]
        if hasattr(self, "links"):
            processes.append(self.links.process)
        for process in processes:
            if process.poll() is None:
                process.kill()
                process.wait()
