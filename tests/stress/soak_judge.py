"""Criteria of a soak run. They are evaluated from the output of its programs: traces, logs, exit codes, memory,
checkpoints.

Each function returns its findings; `problems` contains one line for each violated criterion. No function runs a
program.
"""
import math
import os
import re
import statistics

SILENT_S = 0.150         # if the newest state is older, the force must be zero
FRESH_S = 0.150          # if a client has a younger state, it has returned
SILENCE_NOTED_S = 1.0    # an event must explain a silence that is longer than this
LATE_S = 0.021  # if the interval between two ticks is longer, the force falls in steps (SafetySettings::late_tick)
AGE_JUMP_S = 0.002       # permitted increase of a state's age beyond the elapsed time
LATE_TICKS = 25          # number of ticks until the force is zero: 20, plus those until the next full tick
LEAST_SHARE = 0.5        # share of the nominal rate; a slower loop lacks processor time, so that connections are lost
PACE_S, TICKS_PER_S = 0.25, 1000
ROUNDING = 1e-6          # tolerance for numbers with nine digits
MEMORY_GROWTH = 1.15     # limit for memory in the last quarter of a program's life, relative to its second quarter
MEMORY_SPARE_MB = 30     # margin that is added to this limit, for a model of the scene and a memory pool
STEPS_LIVED_S = 30       # if a server ran for a shorter time, the step rate of its rooms is not evaluated
# minimum duration for the evaluation of memory: a client's memory grows only during its first three sessions
MEMORY_LIVED_S = 120
CHECKPOINT_LATE_MS = 1500
STEPS_KEPT = 0.7         # minimum step rate in the last quarter, relative to the second quarter
REPORT = re.compile(r"ERROR: (Address|Leak|Undefined)\w*Sanitizer|runtime error:|AddressSanitizer:DEADLYSIGNAL")


class Limits:
    def __init__(self, profile):
        limits = profile["limits"]
        self.force_n, self.torque_n_m = limits["force_n"], limits["torque_n_m"]
        self.slew_n_per_s, self.slew_n_m_per_s = limits["slew_n_per_s"], limits["slew_n_m_per_s"]


def columns(names, wanted):
    return [names.index(name) for name in wanted]


def rows_of(lines):
    """Yields (tick, time [s], age of the newest state [s], force, torque) for each complete row."""
    names = next(lines, "").strip().split(",")
    if names == [""]:
        return
    head = columns(names, ("tick", "local_ns", "state_age_s"))
    force = columns(names, [f"displayed_force_{axis}_n" for axis in "xyz"])
    torque = columns(names, [f"displayed_torque_{axis}_n_m" for axis in "xyz"])
    for line in lines:
        if not line.endswith("\n"):
            return  # the program was killed while it wrote this row
        cells = line.split(",")
        tick, local_ns, age = (cells[i] for i in head)
        yield (int(tick), int(local_ns) * 1e-9, float(age) if age else math.inf,
               tuple(float(cells[i]) for i in force), tuple(float(cells[i]) for i in torque))


def length(vector):
    return math.sqrt(sum(number * number for number in vector))


def step(now, before):
    return length([a - b for a, b in zip(now, before)])


class Trace:
    """Evaluates the displayed forces of one client row by row."""

    def __init__(self, name, limits):
        self.name, self.limits = name, limits
        self.rows = self.felt_rows = 0
        self.largest_n = self.largest_step = 0.0
        self.silences = []  # list of (from, to) [s]
        self.pace = []      # list of (time [s], number of ticks so far), sampled every PACE_S
        self.problems = []
        self._before = None
        self._late_for = 0
        self._silent_since = self._first = self._fresh = None

    def say(self, at_s, text):
        if len(self.problems) < 5:
            self.problems.append(f"{self.name}: at {at_s:.3f} s {text}")

    def take(self, row):
        tick, at, age, force, torque = row
        self._first = self._first or at
        if not self.pace or at - self.pace[-1][0] >= PACE_S:
            self.pace.append((at, tick))
        self.rows += 1
        size, turn = length(force), length(torque)
        if not math.isfinite(size + turn):
            self.say(at, f"a force that is not finite: {force} N, {torque} N·m")
            return
        self.largest_n = max(self.largest_n, size)
        self.felt_rows += size > 0.05
        if size > self.limits.force_n + ROUNDING or turn > self.limits.torque_n_m + ROUNDING:
            self.say(at, f"{size:.3f} N and {turn:.4f} N·m, above the device's limit")
        self._take_step(tick, at, force, torque)
        if self._before is not None and age > self._before[2] + at - self._before[1] + AGE_JUMP_S:
            # the silence is detected late, because the state was already old when the server sent it
            self._late_for = LATE_TICKS
        self._take_silence(at, age, size + turn)
        self._before = row

    def _take_step(self, tick, at, force, torque):
        """The force may rise by the slew limit of 1 ms, and may fall by the slew limit times the time since the last
        tick."""
        self._late_for = max(0, self._late_for - (1 if self._before is None else tick - self._before[0]))
        elapsed_s = at - self._before[1] if self._before is not None else math.inf
        if elapsed_s > LATE_S:
            self._late_for = LATE_TICKS
        if self._before is None or tick != self._before[0] + 1:
            return  # a step can be computed only from two successive ticks
        fall_s = 0.001 if elapsed_s > LATE_S + 0.001 else max(0.001, elapsed_s)
        for now, before, slew, unit in ((force, self._before[3], self.limits.slew_n_per_s, "N"),
                                        (torque, self._before[4], self.limits.slew_n_m_per_s, "N·m")):
            is_fall = length(now) < length(before)
            size = step(now, before)
            most = slew * (fall_s if is_fall else 0.001)
            if unit == "N":
                self.largest_step = max(self.largest_step, size * (0.001 / fall_s if is_fall else 1))
            if size > most * (1 + ROUNDING) + ROUNDING:
                self.say(at, f"a step of {size:.4f} {unit}; the slew limit allows {most:.4f}")

    def _take_silence(self, at, age, shown):
        if age > SILENT_S and shown > 0 and self._late_for == 0:
            self.say(at, f"a force {age * 1e3:.0f} ms after the last arrival")
        if age > SILENCE_NOTED_S:
            if self._silent_since is None:
                self._silent_since = max(at - age, self._fresh or self._first)
        elif age < FRESH_S:
            if self._silent_since is not None:
                self.silences.append((self._silent_since, at))
            self._silent_since, self._fresh = None, at

    def has_run(self, begin, end):
        """Returns whether the loop ran at LEAST_SHARE of its rate or more from 2 s before `begin` until `end`."""
        within = [(at, tick) for at, tick in self.pace if begin - 2 <= at <= end]
        if len(within) < 2:
            return False
        (first, tick), (last, newest) = within[0], within[-1]
        return newest - tick >= LEAST_SHARE * TICKS_PER_S * (last - first)

    def end(self, at):
        """Closes an open silence at the end of the run or of the program."""
        if self._silent_since is not None:
            self.silences.append((self._silent_since, at))


def judge_trace(lines, name, limits, ended_at):
    trace = Trace(name, limits)
    first = last = None
    for row in rows_of(iter(lines)):
        if trace.rows == 0:
            first = row[1]
        trace.take(row)
        last = row[1]
    trace.end(ended_at)
    trace.began, trace.ended = first, last
    return trace


def unexplained(silences, events, within_s):
    """Returns the silences that no event explains. Each event is extended by the time that a client may take to
    return."""
    covered = []
    for begin, end in sorted(events):
        begin, end = begin - SILENT_S, end + within_s
        if covered and begin <= covered[-1][1]:
            covered[-1] = (covered[-1][0], max(end, covered[-1][1]))
        else:
            covered.append((begin, end))
    return [(begin, end) for begin, end in silences if not any(low <= begin and end <= high for low, high in covered)]


def time_back(silences, events):
    """Returns the longest time from the end of an event that interrupted the stream to the next state."""
    worst = 0.0
    for begin, end in silences:
        if any(e_begin <= end < e_end for e_begin, e_end in events):
            continue  # the next event had already begun
        ends = [e_end for e_begin, e_end in events if e_begin <= end and e_end >= begin - SILENCE_NOTED_S and e_end <= end]
        if ends:
            worst = max(worst, end - max(ends))
    return worst


def time_to_join(begin, joined, downs):
    """Returns the time from `begin` to `joined` without the intervals `downs`: disjoint (begin, end) in which no server
    ran."""
    return joined - begin - sum(max(0.0, min(end, joined) - max(start, begin)) for start, end in downs)


def judge_memory(name, samples):
    """`samples` contains (time [s], MB) of one program. Returns the means of its second and last quarter, and
    problems."""
    if len(samples) < 8 or samples[-1][0] - samples[0][0] < MEMORY_LIVED_S:
        return None
    begin, lived = samples[0][0], samples[-1][0] - samples[0][0]

    def part(low, high):
        return [mb for at, mb in samples if low <= (at - begin) / lived <= high]

    if not part(0.25, 0.5):
        return None  # the machine stalled
    second, last = statistics.mean(part(0.25, 0.5)), statistics.mean(part(0.75, 1.0))
    problems = []
    if last > MEMORY_GROWTH * second + MEMORY_SPARE_MB:
        problems.append(f"{name}: {second:.0f} MB in the second quarter of {lived:.0f} s, {last:.0f} MB in the last: it grows")
    return second, last, problems


def judge_restart(number, log, rooms, down_ms, killed):
    """Checks that every room resumed from the newest checkpoint. Returns problems and the number of resumed rooms."""
    problems, resumed = [], 0
    for room in rooms:
        found = [re.search(rf"room {re.escape(room)} continues from its state of (\d+) ms ago", line) for line in log]
        ages = [int(match.group(1)) for match in found if match]
        if not ages:
            problems.append(f"server {number}: room {room} did not go on from its checkpoint")
            continue
        resumed += 1
        most_ms = down_ms + (CHECKPOINT_LATE_MS if killed else CHECKPOINT_LATE_MS / 2)
        if ages[0] > most_ms:
            problems.append(f"server {number}: room {room} went on from {ages[0]} ms ago; the server was away for {down_ms:.0f} ms")
    problems += [f"server {number}: {line.strip()}" for line in log if "cannot be read" in line or "cannot be written" in line]
    return problems, resumed


def judge_steps(room, samples):
    """`samples` contains (time [s], steps) of one room on one server. Checks that the step rate does not fall."""
    if len(samples) < 8 or samples[-1][0] - samples[0][0] < STEPS_LIVED_S:
        return []
    begin, lived = samples[0][0], samples[-1][0] - samples[0][0]

    def rate(low, high):
        part = [(at, steps) for at, steps in samples if low <= (at - begin) / lived <= high]
        return (part[-1][1] - part[0][1]) / (part[-1][0] - part[0][0]) if len(part) > 1 else None

    second, last = rate(0.25, 0.5), rate(0.75, 1.0)
    if second and last is not None and last < STEPS_KEPT * second:
        return [f"room {room}: {last:.0f} steps a second in the last quarter, {second:.0f} in the second: it falls behind"]
    return []


def judge_end(name, code, expected, log):
    problems = []
    if code not in expected:
        last = next((line.strip() for line in reversed(log) if line.strip()), "nothing")
        problems.append(f"{name}: ended with exit code {code}; its last word: {last}")
    problems += [f"{name}: {line.strip()}" for line in log if REPORT.search(line)][:1]
    return problems


def sanitizer_reports(folder):
    """Returns one line for each sanitizer report. A sanitizer creates a file only if there is an error."""
    problems = []
    for name in sorted(os.listdir(folder)):
        with open(os.path.join(folder, name), errors="replace") as file:
            text = file.read()
        line = next((line for line in text.splitlines() if REPORT.search(line)), text[:200])
        problems.append(f"sanitizer, {name}: {line.strip()}")
    return problems
