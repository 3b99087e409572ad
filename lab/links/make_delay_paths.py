#!/usr/bin/env python3
"""Creates the shipped delay paths. A path is the delay that one direction of a link adds to its minimum delay, for one
minute.

    python3 lab/links/make_delay_paths.py FOLDER     writes drift.json, steps.json and wifi.json there

drift   slowly varying load: the sum of two slow waves, 0 to 40 ms
steps   a change of route every 4 to 10 s, after which the added delay is 0, 20, 50 or 100 ms
wifi    a shared radio channel: a floor of 1 to 4 ms, and about two spikes per second. A spike rises within 10 ms, is
        10 to 60 ms high (Pareto, shape 1.5), and falls over 20 to 60 ms, as when a queue drains
"""

import json
import math
import pathlib
import random
import sys

LENGTH_S = 60.0


def drift():
    times = [0.1 * i for i in range(601)]
    wave = [math.sin(2 * math.pi * t / 20) + 0.6 * math.sin(2 * math.pi * t / 7.5 + 1) for t in times]
    low, high = min(wave), max(wave)
    return "a load that comes and goes: 0 to 40 ms", [(t, 40 * (w - low) / (high - low)) for t, w in zip(times, wave)]


def steps(source):
    points, now, delay = [(0.0, 0.0)], 0.0, 0.0
    while True:
        now += source.uniform(4, 10)
        if now >= LENGTH_S - 1:
            break
        points.append((now, delay))
        delay = source.choice([d for d in (0.0, 20.0, 50.0, 100.0) if d != delay])
        points.append((now, delay))
    points += [(LENGTH_S - 1, delay), (LENGTH_S - 1, 0.0), (LENGTH_S, 0.0)]
    return "a change of route every 4 to 10 s: 0, 20, 50 or 100 ms more", points


def wifi(source):
    points, now = [(0.0, 1.0)], 0.0
    while True:
        quiet_s = 0.05 + source.expovariate(1 / 0.4)
        if now + quiet_s >= LENGTH_S - 0.2:
            break
        now += quiet_s
        points.append((now, source.uniform(1, 4)))
        now += source.uniform(0.002, 0.01)
        points.append((now, min(60.0, 10 * source.paretovariate(1.5))))
        now += source.uniform(0.02, 0.06)
        points.append((now, source.uniform(1, 4)))
    points.append((LENGTH_S, 1.0))
    return "a radio channel that others use: spikes of 10 to 60 ms, some twice a second", points


def text_of(description, points):
    fields = [
        f'  "description": {json.dumps(description)}',
        '  "starts_anywhere": true',
        f'  "times_s": {json.dumps([round(t, 4) for t, _ in points])}',
        f'  "delays_ms": {json.dumps([round(d, 3) for _, d in points])}',
    ]
    return "{\n" + ",\n".join(fields) + "\n}\n"


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    folder = pathlib.Path(sys.argv[1])
    made = {"drift": drift(), "steps": steps(random.Random(1)), "wifi": wifi(random.Random(2))}
    for name, (description, points) in made.items():
        (folder / f"{name}.json").write_text(text_of(description, points), encoding="utf-8")


if __name__ == "__main__":
    main()
