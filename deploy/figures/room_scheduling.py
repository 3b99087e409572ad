"""Draws one period of a thread that three rooms share, the io thread, and a move of a room from one thread to another.
"""
from drawing import BLUE, GREEN, GREY, INK, LIGHT, ORANGE, RED, Drawing

PATH = "server/room/scheduling.svg"

# Example values in microseconds. PERIOD, EARLY and the formulas are those of room_scheduler.cpp.
PERIOD, EARLY, WAKING = 1000.0, 50.0, 45.0
PLACE = 0.25  # phase of the first of two workers: (0 + 0.5) / 2
# Name of each room, and its durations: answer, help with sending, finish.
ROOMS = [("A", 40.0, 20.0, 30.0), ("B", 25.0, 15.0, 20.0), ("C", 60.0, 20.0, 60.0)]
COLOURS = [BLUE, ORANGE, GREEN]
LEFT, SCALE, FROM = 120.0, 2.05, 165.0

# Load of each room as a fraction of a thread's time, before and after place_rooms(). Limits are those of room_placement.cpp.
BEFORE, AFTER = [[0.3, 0.3, 0.29], [0.3]], [[0.3, 0.29], [0.3, 0.3]]
TAKES, BEARS = 0.7, 0.85


def deadlines():
    """Returns the phases that settle() gives: each room follows the answer of the previous room after a gap. The gap is
    half of the room's answer time, at most 50 µs and at most the spare time."""
    spare = max(0.0, PERIOD - sum(sum(room[1:]) for room in ROOMS)) / (2 * len(ROOMS))
    at, all_of_them = PLACE * PERIOD, []
    for _, answer, help_us, _ in ROOMS:
        all_of_them.append(at)
        at += answer + help_us + min((answer + help_us) / 2, EARLY, spare)
    return all_of_them


def x_of(time_us):
    return LEFT + SCALE * (time_us - FROM)


def draw_period(drawing):
    due = deadlines()
    thread, io = 92.0, 172.0
    drawing.text(20, 28, "One period (1000 µs) of shared thread 0 of 2, with three rooms", weight="bold")
    for y, name in ((thread, "room thread"), (io, "io thread")):
        drawing.text(20, y + 24, name)
        drawing.line(LEFT, y + 38, x_of(600), y + 38, GREY)
    for (name, *_), colour, at in zip(ROOMS, COLOURS, due):
        drawing.text(x_of(at), 58, f"{name} due", 12, colour, "middle")
        drawing.line(x_of(at), 64, x_of(at), thread + 38, colour, 1.2, "4 3")
    now = due[0] - EARLY + WAKING
    drawing.box(x_of(due[0] - EARLY), thread + 26, SCALE * WAKING, 12, GREY, 1, LIGHT, 1)
    drawing.text(x_of(due[0] - EARLY) - 6, thread + 36, "wake up", 11, INK, "end")
    drawing.text(x_of(now + 15) - 4, io + 34, "wake up", 11, INK, "end")
    for (name, answer, help_us, _), colour, at in zip(ROOMS, COLOURS, due):
        now = max(now, at - EARLY)
        drawing.box(x_of(now), thread, SCALE * answer, 38, colour, 1.2, colour, 2)
        drawing.text(x_of(now + answer / 2), thread + 24, name, 13, "white", "middle", "bold")
        published = now + answer
        for y in (thread, io):
            drawing.box(x_of(published), y, SCALE * help_us, 38, colour, 1.2, "white", 2)
        drawing.arrow(x_of(published), thread + 40, x_of(published), io - 3, colour)
        now = published + help_us
    drawing.box(x_of(now), io, SCALE * 25, 38, GREY, 1.2, LIGHT, 2)
    drawing.text(x_of(now) + SCALE * 25 + 8, io + 24, "read users' datagrams, then sleep", 11)
    for (name, *_, rest), colour in zip(ROOMS, COLOURS):
        drawing.box(x_of(now), thread + 8, SCALE * rest, 30, colour, 1.2, LIGHT, 2)
        drawing.text(x_of(now + rest / 2), thread + 28, name, 12, INK, "middle")
        now += rest
    drawing.text(x_of(now) + 8, thread + 30, "sleep", 11)
    for index, tenth in enumerate(range(200, 601, 50)):
        drawing.line(x_of(tenth), io + 38, x_of(tenth), io + 44, GREY)
        drawing.text(x_of(tenth), io + 58, f"{tenth}" + (" µs" if index == 8 else ""), 11, INK, "middle")
    legend = [("answer", BLUE, BLUE), ("send updates, shared by both threads", BLUE, "white"), ("finish", BLUE, LIGHT)]
    x = LEFT
    for words, colour, fill in legend:
        drawing.box(x, 252, 16, 12, colour, 1.2, fill, 2)
        drawing.text(x + 22, 262, words, 12)
        x += 70 + 7.2 * len(words)


def draw_placement(drawing):
    top, height, width, first = 330.0, 150.0, 70.0, LEFT
    drawing.text(20, 310, "A thread with a load above 0.85 gives a room to the least loaded thread", weight="bold")
    for step, loads in enumerate((BEFORE, AFTER)):
        start = first + 400 * step
        for share, words in ((BEARS, "0.85 gives"), (TAKES, "0.70 takes")):
            y = top + height * (1 - share)
            drawing.line(start - 15, y, start + 2 * width + 55, y, RED if share == BEARS else GREY, 1.2, "5 4")
            drawing.text(start + 2 * width + 60, y + 4, words, 11)
        for worker, rooms in enumerate(loads):
            bottom, x = top + height, start + worker * (width + 40)
            for number, load in enumerate(rooms):
                is_moved = load == 0.3 and (worker, number) == ((0, 0) if step == 0 else (1, 1))
                part = height * load
                bottom -= part
                drawing.box(x, bottom, width, part, INK, 1, ORANGE if is_moved else LIGHT, 1)
                drawing.text(x + width / 2, bottom + part / 2 + 4, f"{load:.2f}", 11, INK, "middle")
            drawing.text(x + width / 2, top + height + 18, f"thread {worker}: {sum(rooms):.2f}", 12, INK, "middle")
        drawing.line(start - 15, top + height, start + 2 * width + 55, top + height, INK)
    drawing.arrow(first + 310, top + 90, first + 370, top + 90, ORANGE, 2)


def draw():
    drawing = Drawing(1030, 510, "Deadlines of rooms on a shared thread, and the placement of rooms")
    draw_period(drawing)
    draw_placement(drawing)
    return drawing
