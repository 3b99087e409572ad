"""Draws, on the left, the split of a potential at the cut-off. Draws, on the right, clusters and the grid of the first
molecule."""
import math

from drawing import BLUE, Drawing, GREEN, GREY, INK, LIGHT, ORANGE, RED

PATH = "common/docking/molecular_field.svg"

START, CUTOFF = 6.0, 8.0  # Å; kSwitchWidthAngstrom is 2
ALPHA = 1.0  # exponent α of the Coulomb energy r^−α with a constant dielectric
LEAF = 8  # atoms per cluster in this figure; 16 in the code


def force_switch():
    """Returns the coefficients A, B and C of field_model.cpp."""
    r1, rc, width = START, CUTOFF, CUTOFF - START
    scale = ALPHA / (rc ** (ALPHA + 2) * width ** 2)
    a = -scale * ((ALPHA + 4) * rc - (ALPHA + 1) * r1)
    b = scale * ((ALPHA + 3) * rc - (ALPHA + 1) * r1) / width
    return a, b, rc ** -ALPHA - a / 3 * width ** 3 - b / 4 * width ** 4


def near(r):
    """Returns the energy of pairs within the cut-off."""
    if r >= CUTOFF:
        return 0.0
    a, b, c = force_switch()
    x = max(r - START, 0.0)
    return r ** -ALPHA - a / 3 * x ** 3 - b / 4 * x ** 4 - c


def ball(x, y, radius, count):
    """Returns points spread evenly over a disc."""
    golden = math.pi * (3 - math.sqrt(5))
    spread = [(radius * math.sqrt((i + 0.5) / count), i * golden) for i in range(count)]
    return [(x + r * math.cos(t), y + r * math.sin(t)) for r, t in spread]


def boxes(points):
    """Returns the boxes of clusters, made by halving along the longer side down to LEAF points."""
    low, high = [min(p[k] for p in points) for k in (0, 1)], [max(p[k] for p in points) for k in (0, 1)]
    if len(points) <= LEAF:
        return [(*low, *high)]
    axis = 0 if high[0] - low[0] > high[1] - low[1] else 1
    ordered = sorted(points, key=lambda p: p[axis])
    return boxes(ordered[:len(ordered) // 2]) + boxes(ordered[len(ordered) // 2:])


def apart(a, b):
    """Returns the distance between two boxes."""
    gaps = [max(a[k] - b[k + 2], b[k] - a[k + 2], 0.0) for k in (0, 1)]
    return math.hypot(*gaps)


def draw_split(d):
    left, top, width, height = 60, 50, 330, 320

    def at(r, v):
        return left + width * (r - 2) / 12, top + height * (1 - v / 0.45)
    d.text(20, 28, "Energy of two unit charges, 1/r, split at 8 Å", 14, INK, weight="bold")
    d.line(left, top, left, top + height)
    d.line(left, top + height, left + width, top + height)
    for r in (2, 4, 6, 8, 10, 12, 14):
        d.text(at(r, 0)[0], top + height + 18, f"{r}", 12, INK, "middle")
    d.text(left + width / 2, top + height + 38, "r [Å]", 12, INK, "middle")
    for r, words in ((START, "switch"), (CUTOFF, "cut-off")):
        d.line(at(r, 0)[0], top, at(r, 0)[0], top + height, GREY, 1, "4 3")
        d.text(at(r, 0)[0] + 4, top + 12, words, 12, GREY)
    rs = [2.3 + 11.7 * i / 200 for i in range(201)]
    for law, colour, size in ((lambda r: r ** -ALPHA, INK, 1.5), (near, BLUE, 2.5), (lambda r: r ** -ALPHA - near(r), ORANGE, 2.5)):
        d.path([at(r, law(r)) for r in rs if law(r) <= 0.45], colour, size)
    d.text(at(3.7, 0.30)[0], at(3.7, 0.30)[1], "all pairs", 13, INK)
    d.text(at(8.6, 0.02)[0], at(8.6, 0.02)[1], "near: clusters", 13, BLUE)
    d.text(at(8.6, 0.14)[0], at(8.6, 0.14)[1], "far: grid", 13, ORANGE)


def draw_search(d):
    left, top, pixels = 450, 50, 5.2  # pixels per Å
    d.text(430, 28, "Clusters within the cut-off, nodes of the grid", 14, INK, weight="bold")
    nodes = [(3.0 * i, 3.0 * j) for i in range(29) for j in range(22)]
    first, second = ball(30, 32, 17, 64), ball(59, 32, 10, 32)
    a, b = boxes(first), boxes(second)
    pairs = [(p, q) for p in a for q in b if apart(p, q) < CUTOFF]
    for x, y in nodes:
        d.circle(left + pixels * x, top + pixels * y, 0.8, ORANGE, 0.0, ORANGE)
    for side, own in ((0, a), (1, b)):
        for box in own:
            is_near = any(pair[side] == box for pair in pairs)
            d.box(left + pixels * box[0] - 3, top + pixels * box[1] - 3, pixels * (box[2] - box[0]) + 6, pixels * (box[3] - box[1]) + 6,
                  BLUE if is_near else GREY, 2.0 if is_near else 1.0, "#dbe9f6" if is_near else "none", 2)
    for points, colour in ((first, GREEN), (second, RED)):
        for x, y in points:
            d.circle(left + pixels * x, top + pixels * y, 2.2, colour, 0.0, colour)
    for x, words, colour in ((30, "first molecule", GREEN), (62, "second molecule", RED)):
        d.box(left + pixels * x - 58, top + pixels * 8 - 15, 116, 20, LIGHT, 0.0, "white", 2)
        d.text(left + pixels * x, top + pixels * 8, words, 13, colour, "middle")
    d.text(left, top + pixels * 63 + 24, "blue: clusters with a box of the other molecule within 8 Å", 12, INK)
    d.text(left, top + pixels * 63 + 41, "orange: nodes of the grid, to 40 Å around the first molecule or farther", 12, INK)


def draw():
    d = Drawing(920, 430, "Split of a potential at the cut-off; near clusters and the grid of the far part")
    draw_split(d)
    draw_search(d)
    return d
