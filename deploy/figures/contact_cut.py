"""Draws the cut through the tree of a shell, and the motion after which a node is queried again: common/contact/SEARCH.md.

The shell is a parabola above a flat solid. Each node of the tree halves its points; a leaf has eight. Lengths are in mm.
"""
from drawing import BLUE, GREEN, GREY, INK, LIGHT, ORANGE, RED, Drawing

PATH = "common/contact/cut.svg"
POINTS, LEAF, BAND = 64, 8, 0.35


def place(i):
    x = 12.0 * i / (POINTS - 1)
    return x, 0.15 + 0.055 * (x - 3.4) ** 2


def ball(first, count):
    xs, ys = zip(*(place(i) for i in range(first, first + count)))
    x, y = (min(xs) + max(xs)) / 2, (min(ys) + max(ys)) / 2
    return x, y, max(((a - x) ** 2 + (b - y) ** 2) ** 0.5 for a, b in zip(xs, ys))


def walk(first, count, found):
    """Appends (first, count, kind) for each node of the cut at or below a node, and for the visited nodes above the
    cut."""
    x, y, radius = ball(first, count)
    if y - radius > BAND:
        found.append((first, count, "far"))
    elif count <= LEAF:
        found.append((first, count, "leaf"))
    else:
        found.append((first, count, "above"))
        walk(first, count // 2, found)
        walk(first + count // 2, count - count // 2, found)


def draw_shell(d, found):
    scale, left, bottom = 40.0, 30.0, 262.0
    at = lambda x, y: (left + scale * x, bottom - scale * y)
    d.text(20, 24, "Shell above the field's surface, with the balls of the cut", 14, weight="bold")
    d.box(left - 10, bottom, scale * 12 + 20, 20, INK, 0.0, LIGHT, 0)
    d.line(left - 10, bottom, left + scale * 12 + 10, bottom, INK)
    d.line(left - 10, bottom - scale * BAND, left + scale * 12 + 10, bottom - scale * BAND, GREY, 1.0, "4 3")
    d.text(left + scale * 12 + 6, bottom - scale * BAND - 4, "band", 11, GREY, "end")
    d.text(left, bottom + 15, "solid", 11)
    for first, count, kind in found:
        if kind == "above":
            continue
        x, y, radius = ball(first, count)
        d.circle(*at(x, y), scale * radius, BLUE if kind == "far" else ORANGE, 1.5)
    for first, count, kind in found:
        for i in range(first, first + count if kind != "above" else first):
            d.circle(*at(*place(i)), 2.2, INK, 0.0, ORANGE if kind == "leaf" else BLUE)


def draw_tree(d, found):
    left, width, top = 565.0, 320.0, 58.0
    d.text(left, 24, "Tree, with the same cut", 14, weight="bold")
    kinds = {(first, count): kind for first, count, kind in found}
    at = lambda first, count: (left + width * (first + count / 2) / POINTS, top + 52 * (POINTS // count).bit_length() - 52)

    def node(first, count, is_below):
        kind = kinds.get((first, count))
        x, y = at(first, count)
        if count > LEAF:
            for child in (first, first + count // 2):
                d.line(x, y, *at(child, count // 2), LIGHT if is_below or kind == "far" else GREY, 1.5)
                node(child, count // 2, is_below or kind == "far")
        fill = {"far": BLUE, "leaf": ORANGE, "above": GREY}.get(kind, LIGHT)
        d.circle(x, y, 9 if kind in ("far", "leaf") else 6, fill, 1.0, fill)

    node(0, POINTS, False)
    for row, (colour, words) in enumerate([(ORANGE, "leaf of the cut: its points are sampled"), (BLUE, "far node of the cut"),
                                           (GREY, "above the cut: not visited in later steps"), (LIGHT, "below the cut: not visited")]):
        d.circle(left + 8, 240 + 18 * row, 6, colour, 1.0, colour)
        d.text(left + 22, 244 + 18 * row, words, 12)


def draw_motion(d):
    """Draws a node whose accumulated motion is to 75 % an approach; the rest is sideways."""
    left, bottom, per_step, per_m = 70.0, 560.0, 13.0, 0.36
    at = lambda step, m: (left + per_step * step, bottom - per_m * m)
    d.text(20, 326, "Verlet slack of one far node: it is queried only where the two lines meet", 14, weight="bold")
    d.arrow(left, bottom, left + per_step * 62, bottom)
    d.arrow(left, bottom, left, bottom - 220)
    d.text(left + per_step * 62, bottom + 18, "step", 12, anchor="end")
    for m in (0, 200, 400):
        d.text(left - 8, at(0, m)[1] + 4, f"{m} µm", 11, GREY, "end")
    band, gone, bound, steps, motion = 100.0, 0.0, None, [], []
    for step in range(58):
        gone += 4.0 + (4.0 if 20 <= step < 40 else 0.0)
        nearest = 330.0 - 0.75 * gone
        motion.append(at(step, gone + band))
        if bound is None or gone + band >= bound:
            if bound is not None:
                steps.append(at(step, bound))
            if nearest <= band:
                d.circle(*at(step, gone + band), 5, RED, 1.0, RED)
                d.text(at(step, 0)[0] + 6, at(0, gone + band)[1] - 16, "near: the node is opened", 12, RED, "end")
                break
            bound = gone + nearest
            d.circle(*at(step, gone + band), 4, GREEN, 1.0, GREEN)
            steps.append(at(step, bound))
    steps.append(at(step, bound))
    d.path(motion, INK, 2.0)
    d.path(steps, BLUE, 2.0)
    d.text(*at(3, 350), "query_again_at_m = moved_m + distance at the query", 12, BLUE)
    d.text(*at(13, 120), "moved_m + band: accumulated motion of the part, plus the band", 12)
    d.text(left + 8, bottom - 10, "green: a query", 12, GREEN)


def draw():
    d = Drawing(910, 590, "Cut through the tree over a shell, and the motion until a node is queried again")
    found = []
    walk(0, POINTS, found)
    draw_shell(d, found)
    draw_tree(d, found)
    draw_motion(d)
    return d
