"""Draws contacts of a flat node on a plane, and the depth of a late-found contact: common/contact/PATCHES.md.

The node is a hexagon of 10 mm. It is tilted, so that a part of it penetrates the plane by up to 60 µm and the rest is above
it. As in PlaneContacts, the hexagon is cut into parts, and each part gets four contacts at its mean ± deviations.
"""
from math import cos, pi, sin, sqrt

from drawing import BLUE, GREEN, GREY, INK, LIGHT, ORANGE, RED, Drawing

PATH = "common/contact/patches.svg"
DEPTH, SLOPE, ENDS = -60.0, 36.0, (16.0, 64.0, 256.0, 400.0)  # depth [µm] at the left corner, slope [µm/mm] along x, ends of gap slices [µm]


def distance(p):
    return DEPTH + SLOPE * (p[0] + 5)


def cut(polygon, low, high):
    """Returns the part of a convex polygon with low <= distance <= high."""
    for level, sign in ((low, -1.0), (high, 1.0)):
        kept = []
        for i, p in enumerate(polygon):
            q = polygon[(i + 1) % len(polygon)]
            a, b = sign * (distance(p) - level), sign * (distance(q) - level)
            if a <= 0:
                kept.append(p)
            if a * b < 0:
                kept.append(tuple(u + a / (a - b) * (v - u) for u, v in zip(p, q)))
        polygon = kept
    return polygon


def four(polygon):
    """Returns the mean ± deviations along x and y. The result is exact for shapes that are symmetric about the x axis,
    such as these."""
    n, sums = 240, [0.0] * 5
    low, high = min(x for x, _ in polygon), max(x for x, _ in polygon)
    for i in range(n):
        x = low + (high - low) * (i + 0.5) / n
        half = min(5 * sqrt(3) / 2, max(0.0, sqrt(3) * (5 - abs(x))))
        for k, value in enumerate((1.0, x, x * x, 0.0, half * half / 3)):
            sums[k] += half * value
    mean = sums[1] / sums[0]
    along, across = sqrt(max(0.0, sums[2] / sums[0] - mean * mean)), sqrt(sums[4] / sums[0])
    return [(mean + s * along, t * across) for s in (-1, 1) for t in (-1, 1)]


def draw_slices(d):
    hexagon = [(5 * cos(pi / 3 * k), 5 * sin(pi / 3 * k)) for k in range(6)]
    x0, y0, scale = 240.0, 200.0, 32.0
    at = lambda p: (x0 + scale * p[0], y0 - scale * p[1])
    d.text(20, 24, "Hexagon on a plane: four contacts a slice", 14, weight="bold")
    parts = [(-1e3, 0.0, ORANGE, "presses")] + [(a, b, BLUE, "") for a, b in zip((0.0,) + ENDS, ENDS)]
    for low, high, colour, _ in parts:
        part = cut(hexagon, low, high)
        if len(part) < 3:
            continue
        d.path([at(p) for p in part], INK, 1.0, None, "#fbe3cd" if colour == ORANGE else "#e3eef7", True)
        for p in four(part):
            d.circle(*at(p), 3.5, colour, 1.0, colour)
    # Side view of the node and the plane.
    y, up = 446.0, 0.3
    d.line(x0 - 190, y, x0 + 190, y, INK, 1.5)
    d.text(x0 - 190, y + 34, "plane of the field; heights 0.3 px a µm", 11, GREY)
    d.path([(at((x, 0))[0], y - up * distance((x, 0))) for x in (-5, 5)], INK, 2.5)
    for end in (0.0,) + ENDS[:3]:
        x = (end - DEPTH) / SLOPE - 5
        px = at((x, 0))[0]
        d.line(px, at((0, 4.4))[1] - 2, px, y, GREY, 1.0, "3 3")
    d.text(at((-4.4, 0))[0], 50, "presses", 12, ORANGE)
    d.text(at((-2.6, 0))[0], 50, "gap slices end at 16, 64, 256 µm and at the band", 12, BLUE)
    d.text(at((-5, 0))[0] - 8, y + 18, "60 µm", 11, ORANGE, "end")


def limited(deep, rigid, motion, steps):
    """Returns the depth [µm] after limit_depths() of a contact found late at step 5. motion {step: µm} moves it inwards."""
    shown, depth, true, jumped = [], 0.0, deep, 0.0
    for step in range(steps):
        moved = motion.get(step, 0.0)
        true += moved if step >= 5 else 0
        if step >= 5:
            depth = min(true, max(min(depth + 10.0, rigid) + moved, depth + moved))
        shown.append(depth)
    return shown


def draw_late(d):
    left, bottom, per_step, per_um = 560.0, 400.0, 5.6, 0.5
    d.text(520, 24, "Late-found contact: depth that the solver gets", 14, weight="bold")
    d.arrow(left, bottom, left + 370, bottom)
    d.arrow(left, bottom, left, 60)
    d.text(left + 370, bottom + 18, "step", 12, anchor="end")
    for um in (0, 300, 600):
        d.text(left - 6, bottom - per_um * um + 4, f"{um}", 11, GREY, "end")
    d.text(left - 6, 56, "µm", 11, GREY, "end")
    motion = {45: 300.0}
    at = lambda values: [(left + per_step * i, bottom - per_um * v) for i, v in enumerate(values)]
    true = [0.0] * 5 + [300.0] * 40 + [600.0] * 17
    d.path(at(true), GREY, 1.5, "5 4")
    d.path(at(limited(300.0, 500.0, motion, 62)), GREEN, 2.5)
    d.path(at(limited(300.0, 50.0, motion, 62)), RED, 2.5)
    d.text(left + 40, bottom - 158, "true overlap, found at step 5", 12, GREY)
    d.text(left + 110, bottom - 55, "10 µm a step", 12, GREEN)
    d.text(left + 258, bottom - 284, "rigid depth 500 µm", 12, GREEN)
    d.text(left + 258, bottom - 159, "rigid depth 50 µm", 12, RED)
    d.text(left + 98, bottom - 265, "own motion of 300 µm", 12)
    d.text(left + 98, bottom - 250, "counts at once", 12)


def draw():
    d = Drawing(960, 500, "Contacts of a flat node on a plane, and the depth of a late-found contact")
    draw_slices(d)
    draw_late(d)
    return d
