"""Draws playout over a link with jitter and a burst of losses: the newest input compared with playout, and the distribution of
waiting times from which the delay is chosen. The rules are those of common/net/playout.cpp. The link is an example of 50 ms
with a jitter of 6 ms (standard deviation).
"""
import math
import random

from drawing import BLUE, GREEN, GREY, INK, LIGHT, ORANGE, RED, Drawing

PATH = "common/net/playout.svg"
QUANTILE, LONGEST, BIN = 0.98, 60.0, 0.5
COUNT, FROM, TO = 3000, 2450, 2585
LOST = range(2475, 2509)


def packets():
    """Returns (time stamp, arrival) [ms] in the order of arrival, for one datagram per millisecond. A burst of 34 is
    lost."""
    source = random.Random(5)
    last, found = 0.0, []
    for stamp in range(COUNT):
        normal = math.sqrt(-2 * math.log(1 - source.random())) * math.cos(2 * math.pi * source.random())
        arrival = max(last, stamp + 50 + max(-30.0, 6 * normal))
        if stamp in LOST:
            continue
        last = arrival
        found.append((stamp, arrival))
    return found


def waiting_times(found, base):
    """Returns (waiting time, length) of each gap [ms], by the rule of PlayoutDelay::add()."""
    return [(max(0.0, arrival - before - base), stamp - before)
            for (before, _), (stamp, arrival) in zip(found, found[1:])]


def delay_of(waits):
    total, reached = sum(gap for _, gap in waits), 0.0
    for index in range(int(LONGEST / BIN)):
        reached += sum(gap for wait, gap in waits if int(wait / BIN) == index)
        if reached >= QUANTILE * total:
            return BIN * (index + 1)
    return LONGEST


def draw():
    found = packets()
    base = min(arrival - stamp for stamp, arrival in found)
    waits = waiting_times(found, base)
    delay = delay_of(waits)
    drawing = Drawing(980, 400, "Played time against the newest stamp, and the waiting times that choose the delay")
    left, top, wide, high = 60, 40, 520, 290
    first, last = FROM + 35, TO + 35

    def x(time):
        return left + wide * (time - first) / (last - first)

    def y(stamp):
        return top + high * (1 - (stamp - (FROM - 45)) / (TO - 10 - (FROM - 45)))

    drawing.box(left, top, wide, high, GREY, 1.0, corner=0)
    drawing.text(left, top - 14, "sender's time against receiver's time", 14, weight="bold")
    shown = [(stamp, arrival) for stamp, arrival in found if first <= arrival <= last]
    newest = max(stamp for stamp, arrival in found if arrival <= first)
    steps = [(x(first), y(newest))]
    for stamp, arrival in shown:
        steps += [(x(arrival), y(newest)), (x(arrival), y(stamp))]
        newest = stamp
    drawing.path(steps + [(x(last), y(newest))], ORANGE, 2.0)
    offset = base + delay
    drawing.line(x(first), y(first - offset), x(last), y(last - offset), BLUE, 2.5)
    drawing.line(x(first), y(first - base), x(last - 8), y(last - 8 - base), GREY, 1.0, "4 4")
    drawing.text(x(first + 70) - 8, y(first + 70 - base), "stamp of the least delayed sample", 11, GREY, "end")
    for time in range(first, last):
        arrived = max(stamp for stamp, arrival in found if arrival <= time)
        if time - offset > arrived:
            drawing.line(x(time), y(arrived), x(time), y(time - offset), RED, 2.0)
    at = last - 30
    drawing.arrow(x(at), y(at - base), x(at), y(at - offset), GREEN, 1.5)
    drawing.text(x(at) + 8, y(at - offset) + 18, f"delay {delay:.1f} ms", 12, GREEN)
    for stamp, name in ((LOST[0], "first lost stamp"), (LOST[-1] + 1, "first stamp after the burst")):
        drawing.line(left, y(stamp), left + wide, y(stamp), LIGHT, 1.0)
        drawing.text(left + wide - 6, y(stamp) + 14, name, 11, GREY, "end")
    drawing.text(left + wide / 2, top + high + 22, f"receiver's time, {last - first} ms", 12, anchor="middle")
    for index, (colour, words) in enumerate(((ORANGE, "newest received stamp (newest wins)"), (BLUE, "played stamp"),
                                             (RED, "underrun"))):
        place = left + (0, 270, 390)[index]
        drawing.line(place, top + high + 46, place + 24, top + high + 46, colour, 2.5)
        drawing.text(place + 30, top + high + 50, words, 12)
    left, wide, most = 640, 310, 50
    drawing.text(left, top - 14, "waiting times of 3 s, weighted by gap", 14, weight="bold")
    drawing.box(left, top, wide, high, GREY, 1.0, corner=0)
    bins = [sum(gap for wait, gap in waits if index <= wait < index + 1) for index in range(most)]
    for index, weight in enumerate(bins):
        size = (high - 20) * (weight / max(bins)) ** 0.5
        if size > 0:
            drawing.box(left + wide * index / most, top + high - size, wide / most - 1, size, INK, 0.0, LIGHT if index < delay else RED, 0)
    place = left + wide * delay / most
    drawing.line(place, top, place, top + high, GREEN, 2.0)
    drawing.text(place - 6, top + 18, f"{100 * QUANTILE:.0f} % quantile", 12, GREEN, "end")
    drawing.text(left + wide / 2, top + high + 22, f"waiting time, 0 to {most} ms (heights: square roots)", 12, anchor="middle")
    return drawing
