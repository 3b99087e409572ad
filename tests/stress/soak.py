"""The soak test. `python3 tests/stress/soak.py` runs clients over bad links against a server that is repeatedly stopped
and killed. It fails if a client does not rejoin automatically, a force exceeds its bounds, memory grows, a checkpoint
is lost or a sanitizer reports an error. README.md lists the criteria and contains the table of the last long run.

--seconds S   duration of the events [600]; start, end and evaluation take one to three minutes more
--seed N      seed of events, links and hands [random; printed]
--clients N, --rooms N   number of clients and of rooms
--all         all clients, not only some, are of $TANDEM_BIN and have real-time rights: for machines with many cores
--keep DIR    stores traces, logs, recordings and the checkpoint in DIR
--write       also writes the table to README.md
The programs are those of $TANDEM_BIN, or build/asan/bin. tandem-lab and tandem-replay are not under test and may be
those of build/release/bin, as may most clients.
"""
import argparse
import collections
import concurrent.futures
import json
import os
import secrets
import signal
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
SOURCE = os.path.dirname(os.path.dirname(HERE))
os.environ.setdefault("TANDEM_SOURCE", SOURCE)
os.environ.setdefault("TANDEM_BIN", os.path.join(SOURCE, "build/asan/bin"))
sys.path += [os.path.join(SOURCE, "tests", folder) for folder in ("system", "attack")]

import run as attack_suite  # noqa: E402
import soak_judge as judge  # noqa: E402
import soak_world as world  # noqa: E402
from support import BIN, PATIENCE_S, free_port  # noqa: E402

LINK = ("--delay", "20ms", "--jitter", "200ms", "--reorder", "--loss", "25%", "--duplication", "25%")
BACK_S = 20          # time limit from an event until the client has rejoined and receives states
JOINED_S = 60        # time limit for a restarted client to join while a server runs, even if processor time is short
SHORT_S = 120        # a run longer than this must include a displayed force and every kind of event
LEAST_FORCE_N = 0.5  # minimum of the largest force; if it is smaller, the bounds are not tested
ENDED = (0,)


def tool(name):
    for folder in (BIN, os.path.join(SOURCE, "build/release/bin")):
        if os.path.exists(os.path.join(folder, name)):
            return os.path.join(folder, name)
    sys.exit(f"soak: there is no {name} in {BIN} or build/release/bin; build it: deploy/build release --target {name}")


def other_client():
    released = os.path.join(SOURCE, "build/release/bin/tandem-client")
    return released if os.path.exists(released) else os.path.join(BIN, "tandem-client")


def sanitize(folder):
    """Sets the options of the sanitizers: a quarantine of only a few megabytes, so that growth is visible, and reports
    in files."""
    os.makedirs(folder)
    options = f"log_path={folder}/report:print_stacktrace=1"
    os.environ["ASAN_OPTIONS"] = options + ":quarantine_size_mb=8:malloc_context_size=12:detect_leaks=1"
    os.environ["UBSAN_OPTIONS"] = options


def read_limits():
    with open(os.path.join(SOURCE, "devices/profiles.json")) as file:
        return judge.Limits(next(one for one in json.load(file)["profiles"] if one["name"] == "sim"))


def judge_life(name, path, ended_at):
    with open(path) as file:
        return judge.judge_trace(file, name, read_limits(), ended_at)


def lines_of(path):
    with open(path, errors="replace") as file:
        return file.readlines()


def judge_recording(path):
    done = subprocess.run([tool("tandem-replay"), "info", path, "--json"], capture_output=True, text=True, timeout=PATIENCE_S)
    # A killed program may leave an incomplete record at the end of its recording.
    is_good = done.returncode == 0 or done.returncode == 3 and "within a record" in done.stderr
    return [] if is_good else [f"{os.path.basename(os.path.dirname(path))}: {done.stderr.strip()[:200]}"]


def judge_clients(soak, over_s):
    """Evaluates all clients. Returns traces, the longest times to return and to rejoin, silences caused by a lack of
    processor time, and problems."""
    problems, traces = [], []
    with concurrent.futures.ProcessPoolExecutor(os.cpu_count()) as pool:
        for client in soak.clients:
            for number, life in enumerate(client.lives):
                problems += judge.judge_end(f"{client.name} ({os.path.basename(life['err'])})", life["code"],
                                            life["expected"], lines_of(life["err"]))
                if os.path.exists(life["trace"]):
                    ended = min(life.get("end", over_s), over_s)
                    traces.append((client, life, pool.submit(judge_life, f"{client.name}.{number}", life["trace"], ended)))
        traces = [(client, life, trace.result()) for client, life, trace in traces]
    back_s, anew_s, starved = 0.0, 0.0, 0
    for client, life, trace in traces:
        windows = [event.window(over_s) for event in soak.events if event.client in (None, client)]
        problems += trace.problems
        for begin, end in judge.unexplained(trace.silences, windows, BACK_S):
            if begin < soak.began_s or end - begin < judge.SILENCE_NOTED_S:
                continue
            paces = [world.pace_of(server.steps.get(client.room, []), begin, end) for server in soak.servers]
            is_room_slow = any(pace is not None and pace < world.STEP_RATE_HZ * judge.LEAST_SHARE for pace in paces)
            if is_room_slow or not trace.has_run(begin, end):
                starved += 1
                continue
            problems.append(f"{client.name}: no state from {begin:.1f} to {end:.1f} s of the clock, not within {BACK_S} s after an event")
        back_s = max(back_s, judge.time_back([one for one in trace.silences if trace.has_run(*one)], windows))
    downs = [event.window(over_s) for event in soak.events if event.client is None]
    for client in soak.clients:
        lives = [(life, trace) for one, life, trace in traces if one is client]
        last = lives[-1][1] if lives else None
        if last is None or last.ended is None or last.ended < over_s - 2 or (last.silences and last.silences[-1][1] >= over_s):
            problems.append(f"{client.name}: it was not there in the end")
        # Checks the time from the event that ended a process to the first state of the next process.
        for event in soak.events:
            if event.client is client and event.kind in ("kill", "leave") and event.end is not None:
                joined = [judge.time_to_join(event.end, trace.began, downs) for _, trace in lives
                          if trace.began is not None and trace.began >= event.end]
                anew_s = max([anew_s, *joined[:1]])
                if not joined or joined[0] > JOINED_S:
                    problems.append(f"{client.name}: did not join within {JOINED_S} s of being started again")
    return [trace for _, _, trace in traces], back_s, anew_s, starved, problems


def judge_memory(soak):
    grown, problems = [("", 0, 0)], []
    lives = [(client.name, life["memory"]) for client in soak.clients for life in client.lives]
    lives += [(f"server {server.number}", server.memory) for server in soak.servers]
    for name, samples in lives:
        found = judge.judge_memory(name, samples)
        if found is not None:
            grown.append((name, *found[:2]))
            problems += found[2]
    servers = max((one for one in grown if one[0].startswith("server")), key=lambda one: one[2] - one[1], default=None)
    clients = max((one for one in grown if one[0].startswith("user")), key=lambda one: one[2] - one[1], default=None)
    return clients, servers, problems


def judge_servers(soak):
    problems, resumed = [], 0
    for server, down_ms, killed in soak.restarts:
        found, number = judge.judge_restart(server.number, server.log, soak.rooms, down_ms, killed)
        problems += found
        resumed += number
    for server in soak.servers:
        expected = (-9,) if server.killed else ENDED
        problems += judge.judge_end(f"server {server.number}", server.process.returncode, expected, server.log)
        for room, samples in server.steps.items():
            problems += judge.judge_steps(f"{room} of server {server.number}", samples)
        failed = server.total("tandem_checkpoint_failures_total")
        if failed:
            problems.append(f"server {server.number}: {failed:.0f} checkpoints could not be written")
    return resumed, problems


def text_of_memory(one):
    return "no life was long enough" if one is None else f"{one[1]:.0f}, {one[2]:.0f} ({one[0]})"


def judge_all(soak, over_s):
    problems = list(soak.problems)
    traces, back_s, anew_s, starved, found = judge_clients(soak, over_s)
    problems += found
    clients_mb, servers_mb, found = judge_memory(soak)
    problems += found
    resumed, found = judge_servers(soak)
    problems += found
    problems += judge.sanitizer_reports(soak.path("sanitizer"))
    recordings = [path for server in soak.servers for path in server.recordings()]
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        problems += [problem for one in pool.map(judge_recording, recordings) for problem in one]
    rows = sum(trace.rows for trace in traces)
    largest = max((trace.largest_n for trace in traces), default=0)
    kinds = collections.Counter(event.kind for event in soak.events)
    reconnects = sum("joined \"" in line for client in soak.clients for life in client.lives for line in lines_of(life["err"]))
    if largest < LEAST_FORCE_N:
        problems.append(f"no force above {largest:.2f} N was displayed: there was none to bound")
    if soak.settings.seconds >= SHORT_S:
        problems += [f"nothing of the kind '{kind}' happened" for kind in (*world.Soak.KINDS, "server killed", "server ended")
                     if kinds[kind] == 0]
    table = [
        ("seed, seconds", f"{soak.settings.seed}, {soak.settings.seconds:.0f}"),
        ("clients in rooms; running the sanitizer build; with real-time rights", f"{len(soak.clients)} in {len(soak.rooms)}; "
         f"{sum(client.is_judged for client in soak.clients)}; {sum(client.feels for client in soak.clients)}"),
        ("link, each way", " ".join(LINK).replace("--", "")),
        ("events", ", ".join(f"{kind} {number}" for kind, number in sorted(kinds.items()))),
        ("programs of clients; of servers", f"{sum(len(client.lives) for client in soak.clients)}; {len(soak.servers)}"),
        ("joined, all together", str(reconnects)),
        ("refused, and started again", str(soak.refused)),
        ("longest time until states arrived again [s] (bound: 20)", f"{back_s:.1f}"),
        ("longest time until a restarted client had joined [s], while there was a server (bound: 60)", f"{anew_s:.1f}"),
        ("silences of clients, or of rooms, that had no processor", str(starved)),
        ("rooms that continued from their checkpoint", f"{resumed} of {len(soak.restarts) * len(soak.rooms)}"),
        ("recordings that can be read", str(len(recordings))),
        ("ticks judged; with a force", f"{rows}; {100 * sum(trace.felt_rows for trace in traces) / max(1, rows):.0f} %"),
        ("largest force [N], of 7", f"{largest:.2f}"),
        ("largest step [N/ms], of 4", f"{max((trace.largest_step for trace in traces), default=0):.2f}"),
        ("a client's memory in the second and last quarter of its life [MB]: the one that grew most", text_of_memory(clients_mb)),
        ("a server's, likewise", text_of_memory(servers_mb)),
    ]
    return table, problems


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=600)
    parser.add_argument("--seed", type=int)
    parser.add_argument("--clients", type=int, default=16)
    parser.add_argument("--rooms", type=int, default=4)
    parser.add_argument("--all", action="store_true")
    parser.add_argument("--keep")
    parser.add_argument("--write", action="store_true")
    settings = parser.parse_args()
    settings.seed = secrets.randbelow(1 << 30) if settings.seed is None else settings.seed
    settings.link, settings.back_s, settings.other_client = LINK, BACK_S, other_client()
    is_short = settings.seconds < SHORT_S
    settings.settled_s = 8 if is_short else 15
    settings.client_every_s = 1.5
    settings.server_every_s = settings.seconds / 3.5 if is_short else 45
    return settings


def run(settings, folder):
    sanitize(os.path.join(folder, "sanitizer"))
    soak = world.Soak(folder, settings, tool("tandem-lab"))
    try:
        soak.open(free_port())
        soak.run()
        over_s = world.clock_s()
        soak.close()
    finally:
        soak.kill()
    return judge_all(soak, over_s)


def main():
    settings = parse()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("soak: told to end"))
    print(f"soak: --seed {settings.seed}, programs of {BIN}", flush=True)
    tool("tandem-replay")
    with tempfile.TemporaryDirectory(prefix="tandem-soak-") as own:
        folder = settings.keep or own
        os.makedirs(folder, exist_ok=True)
        table, problems = run(settings, folder)
    text = attack_suite.table(("what", "this run"), table)
    print(text, flush=True)
    if settings.write:
        attack_suite.write_table("the last long run", text, os.path.join(HERE, "README.md"))
    for problem in problems:
        print("FAILED: " + problem, file=sys.stderr)
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
