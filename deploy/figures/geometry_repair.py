"""Draws mean winding numbers of both sides of faces, and the decisions of mesh repair: common/geometry/REPAIR.md.

The picture is a section of a square with a wall inside and a fin outside. The number at an edge is the winding number
of all other edges at its midpoint. Mesh repair computes the corresponding number for triangles.
"""
from math import atan2, pi

from drawing import BLUE, GREEN, GREY, INK, LIGHT, ORANGE, RED, Drawing

PATH = "common/geometry/repair.svg"
UNCLEAR = 0.1
SQUARE = [(0, 0), (2, 0), (4, 0), (4, 3), (3, 3), (0, 3), (0, 0)]
EDGES = list(zip(SQUARE, SQUARE[1:])) + [((2, 0), (2, 2.2)), ((4, 3), (5.6, 3.9))]


def winding(p, edges):
    total = 0.0
    for a, b in edges:
        (ax, ay), (bx, by) = (a[0] - p[0], a[1] - p[1]), (b[0] - p[0], b[1] - p[1])
        total += atan2(ax * by - ay * bx, ax * bx + ay * by)
    return total / (2 * pi)


def sides(edges, asked):
    """Returns {edge: (winding number, side, whether the side is clear)} for the queried edges. The number at an edge is
    computed from all other edges."""
    found = {}
    for edge in asked:
        middle = tuple((u + v) / 2 for u, v in zip(*edge))
        number = abs(winding(middle, [other for other in edges if other != edge]))
        side = "outside" if number < 0.25 else "border" if number < 0.75 else "inside"
        is_clear = number > 1 - UNCLEAR or number < UNCLEAR or abs(number - 0.5) < UNCLEAR
        found[edge] = (number, side, is_clear)
    return found


def draw_section(d, y0, words, found, left_out):
    x0, scale = 40.0, 52.0
    at = lambda p: (x0 + scale * p[0], y0 - scale * p[1])
    d.text(20, y0 - scale * 3.9 - 16, words, 14, weight="bold")
    colours = {"border": GREEN, "inside": RED, "outside": BLUE}
    d.path([at(p) for p in SQUARE], LIGHT, 0.0, None, "#f2f4f6", True)
    for edge in EDGES:
        a, b = at(edge[0]), at(edge[1])
        number, side, is_clear = found[edge]
        colour = GREY if edge in left_out else colours[side]
        d.line(*a, *b, colour, 2.0 if edge in left_out else 4.0, "4 4" if not is_clear else None)
        mx, my = (a[0] + b[0]) / 2, (a[1] + b[1]) / 2
        is_level = abs(a[1] - b[1]) < 1
        words = "left out" if edge in left_out else f"{number:.2f}"
        d.text(mx + (0 if is_level else 8), my + (-8 if is_level else 4), words, 12, colour, "middle" if is_level else "start")


def draw_flow(d):
    x, w, mid = 430.0, 250.0, 555.0
    d.text(x, 26, "Decisions of repaired()", 14, weight="bold")
    boxes = [(44, ["check, weld, connect, close slits", "parts of a manifold"]),
             (118, ["orientable, room inside,", "holes < 5 % of the area?"]),
             (212, ["does any other part end", "at an unpaired edge?"]),
             (306, ["sides_of(): winding number", "of the others at each middle"]),
             (400, ["mouth: rays leave from > 5 %,", "or no room inside?"])]
    for y, lines in boxes:
        d.labelled_box(x, y, w, 50, lines, INK, size=12)
    for (y, _), (below, _) in zip(boxes, boxes[1:]):
        d.arrow(mid, y + 50, mid, below)
    right = 740.0
    for y, lines, colour in [(118, ["solid", "holes closed, turned outwards"], GREEN), (212, ["sheet", "felt as a plate"], BLUE),
                             (292, ["outside on both sides: sheet"], BLUE), (334, ["inside on both sides: inner"], RED),
                             (400, ["sheet", "the rest is classified again"], BLUE), (480, ["solid of the border triangles"], GREEN)]:
        d.labelled_box(right, y, 200, 50 if len(lines) > 1 else 32, lines, colour, size=12)
    for y, word in [(143, "yes"), (237, "no"), (425, "yes")]:
        d.arrow(x + w, y, right, y)
        d.text(x + w + 30, y - 6, word, 12, anchor="middle")
    d.arrow(x + w, 322, right, 310)
    d.arrow(x + w, 338, right, 350)
    for y, word in [(190, "no"), (284, "yes"), (378, "border")]:
        d.text(mid + 10, y + 6, word, 12)
    d.path([(mid, 450), (mid, 496)], INK)
    d.arrow(mid, 496, right, 496)
    d.text(mid + 10, 470, "no", 12)


def draw():
    d = Drawing(970, 560, "Winding numbers of faces, and the decisions of mesh repair")
    first = sides(EDGES, EDGES)
    left_out = [edge for edge, (_, side, is_clear) in first.items() if is_clear and side != "border"]
    unsure = [edge for edge, (_, _, is_clear) in first.items() if not is_clear]
    rest = [edge for edge in EDGES if edge not in left_out]
    second = {**first, **sides(rest, unsure)}
    draw_section(d, 250, "First pass: dashed numbers are unclear", first, [])
    draw_section(d, 520, "Second pass, without wall and fin", second, left_out)
    return draw_flow(d) or d
