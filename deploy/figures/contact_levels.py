"""Draws the states of the level policy of a contact search, for common/contact/SEARCH.md."""
from drawing import BLUE, GREEN, GREY, INK, ORANGE, RED, Drawing

PATH = "common/contact/levels.svg"
CAPACITY, PER_CANDIDATE = 384, 1.3  # contact candidates of the second direction of a pair; queries per candidate
LIMITS = {"first": 16, "fine": 4, "coarse": 8, "trial": 4}  # limits of a tree traversal, in multiples of PER_CANDIDATE · CAPACITY queries


def limit(state):
    return f"walk: {LIMITS[state]} × {int(PER_CANDIDATE * CAPACITY)} queries"


def notes(d, x, y, lines, colour=INK, anchor="start"):
    for row, words in enumerate(lines):
        d.text(x, y + 15 * row, words, 12, colour, anchor)


def draw():
    d = Drawing(1080, 470, "States of the level policy of a contact search")
    d.labelled_box(30, 30, 190, 62, ["First cut", "kFirstCut", limit("first")], GREY, size=12)
    d.labelled_box(30, 200, 190, 62, ["Fine", "kFine, level −1", limit("fine")], GREEN, size=12)
    d.labelled_box(640, 200, 250, 76, ["Coarse", "kCoarse, level 0 … coarsest", limit("coarse"), "later steps: 4 ×"], ORANGE, size=12)
    d.labelled_box(320, 30, 190, 62, ["Trial", "kTrial", limit("trial")], BLUE, size=12)
    d.labelled_box(640, 380, 250, 62, ["Dividing", "kDividing", "+ the unused queries of a step"], RED, size=12)
    d.arrow(125, 92, 125, 200)
    notes(d, 134, 140, ["the walk has room"])
    d.arrow(350, 92, 200, 200, GREEN)
    notes(d, 300, 150, ["room at level −1"], GREEN)
    d.arrow(220, 231, 640, 231, ORANGE)
    notes(d, 236, 252, ["no room for contacts or cut,", "too many queries, or", "dense for more than 4 steps"], ORANGE)
    notes(d, 236, 306, ["too many contacts: to level 0", "otherwise: to level 1;", "in a band ≤ 0.2 mm: to level 5"], GREY)
    d.arrow(690, 200, 510, 80, BLUE)
    notes(d, 650, 130, ["may_be_finer(): 64 steps later,", "16 where few points are near"], BLUE)
    d.path([(510, 50), (960, 50), (960, 218)], ORANGE)
    d.arrow(960, 218, 890, 218, ORANGE)
    notes(d, 530, 40, ["room at a finer coarse level; no room: the former cut returns, interval × 2"], ORANGE)
    d.arrow(720, 276, 720, 380, RED)
    notes(d, 710, 310, ["steps_to_divide_ over,", "≤ 0.4 of contacts and", "≤ 0.45 of the cut used"], RED, "end")
    d.arrow(820, 380, 820, 276, ORANGE)
    notes(d, 830, 318, ["no room: joined again,", "steps_to_divide_ × 2"], ORANGE)
    d.path([(640, 411), (470, 411), (470, 110)], BLUE)
    d.arrow(470, 110, 470, 92, BLUE)
    notes(d, 482, 400, ["nothing left to divide"], BLUE)
    d.path([(890, 245), (960, 245), (960, 264)], ORANGE)
    d.arrow(960, 264, 890, 264, ORANGE)
    notes(d, 970, 252, ["no room:", "level + 1 or + 2"], ORANGE)
    return d
