"""Draws the energy balances at both ends of the network, and the two control laws based on them: gain and brake."""
from drawing import BLUE, Drawing, GREEN, GREY, INK, LIGHT, ORANGE

PATH = "common/haptics/passivity/energy_accounts.svg"

# Parameters of HandPassivityController and ToolPassivityController [mJ, N·s/m].
HAND_MIN, HAND_CREDIT = -2.0, 0.2
TOOL_MIN, TOOL_CREDIT, GENTLE_TO = -50.0, 5.0, 20.0
GENTLE, FIRM = 20.0, 2000.0


def max_gain(balance):
    """Returns the largest permitted gain at a negative balance."""
    return min(1.0, max(0.0, (balance - HAND_MIN) / (-HAND_MIN - HAND_CREDIT)))


def max_brake(missing):
    """Returns the largest permitted brake for the missing energy."""
    share = min(1.0, max(0.0, (missing - GENTLE_TO) / (-TOOL_MIN - TOOL_CREDIT - GENTLE_TO)))
    return GENTLE + share * (FIRM - GENTLE)


class Axes:
    """Linear axes with their origin at the lower left."""

    def __init__(self, d, left, top, width, height, x, y):
        self._d, self._left, self._top, self._width, self._height, self._x, self._y = d, left, top, width, height, x, y
        d.line(left, top, left, top + height)
        d.line(left, top + height, left + width, top + height)

    def at(self, x, y):
        return (self._left + self._width * (x - self._x[0]) / (self._x[1] - self._x[0]),
                self._top + self._height * (1 - (y - self._y[0]) / (self._y[1] - self._y[0])))

    def ticks(self, xs, ys):
        for x in xs:
            px, py = self.at(x, self._y[0])
            self._d.line(px, py, px, py + 4)
            self._d.text(px, py + 18, f"{x:g}", 12, INK, "middle")
        for y in ys:
            px, py = self.at(self._x[0], y)
            self._d.line(px - 4, py, px, py)
            self._d.text(px - 7, py + 4, f"{y:g}", 12, INK, "end")

    def curve(self, law, colour, pieces=100):
        xs = [self._x[0] + (self._x[1] - self._x[0]) * i / pieces for i in range(pieces + 1)]
        self._d.path([self.at(x, law(x)) for x in xs], colour, 2.5)

    def upright(self, x, words, anchor):
        px, py = self.at(x, self._y[1])
        self._d.line(px, py, px, self.at(x, self._y[0])[1], GREY, 1, "4 3")
        self._d.text(px + (6 if anchor == "start" else -6), py + 10, words, 12, INK, anchor)


def draw():
    d = Drawing(920, 560, "Energy accounts at both ends, and the laws of gain and brake")
    d.box(120, 34, 250, 186, LIGHT, 1.5, "#f6f8fa", 8)
    d.box(550, 34, 250, 186, LIGHT, 1.5, "#f6f8fa", 8)
    d.text(245, 54, "client, haptic tick, 1 kHz", 13, INK, "middle", "bold")
    d.text(675, 54, "server, room step", 13, INK, "middle", "bold")
    d.text(460, 54, "network", 13, INK, "middle", "bold")
    d.labelled_box(10, 100, 70, 54, ["hand"], BLUE)
    d.labelled_box(840, 100, 70, 54, ["world"], GREEN)
    d.labelled_box(140, 70, 210, 54, ["HandPassivityController", "scales the displayed wrench"], ORANGE)
    d.labelled_box(140, 150, 210, 54, ["PortWork", "sums work of the hand"], GREY)
    d.labelled_box(570, 70, 210, 54, ["ToolPassivityController", "brakes what the tool moves"], ORANGE)
    d.labelled_box(570, 150, 210, 54, ["ToolHand", "sums work of the coupling"], GREY)
    d.arrow(140, 112, 81, 112, BLUE, 2)
    d.arrow(80, 142, 139, 142, BLUE, 2)
    d.text(110, 98, "work", 12, INK, "middle")
    d.arrow(780, 112, 839, 112, GREEN, 2)
    d.arrow(840, 142, 781, 142, GREEN, 2)
    d.text(810, 98, "work", 12, INK, "middle")
    d.arrow(350, 170, 569, 112, BLUE, 1.5)
    d.arrow(570, 170, 351, 112, GREEN, 1.5)
    for row, (client_sum, server_sum) in enumerate([("energy_from_hand_j", "energy_from_world_j"), ("energy_to_hand_j", "energy_into_world_j")]):
        d.text(460, 190 + 15 * row, client_sum, 11, BLUE, "middle")
        d.text(460, 85 + 15 * row, server_sum, 11, GREEN, "middle")

    d.text(40, 258, "Hand: bound of the gain by the balance E", 13, INK, weight="bold")
    gain = Axes(d, 70, 280, 340, 220, (-3, 1), (0, 1.2))
    gain.ticks((-3, -2, -1, 0, 1), (0, 0.5, 1))
    gain.upright(HAND_MIN, "least balance", "start")
    gain.upright(-HAND_CREDIT, "initial credit", "start")
    gain.curve(max_gain, ORANGE)
    d.text(240, 540, "E [mJ]", 12, INK, "middle")

    d.text(490, 258, "Tool: bound of the brake by the missing energy D [N·s/m]", 13, INK, weight="bold")
    brake = Axes(d, 540, 280, 340, 220, (0, 60), (0, 2400))
    brake.ticks((0, 20, 40, 60), (0, 1000, 2000))
    brake.upright(GENTLE_TO, "gentle up to here", "end")
    brake.upright(-TOOL_MIN - TOOL_CREDIT, "firm", "start")
    brake.curve(max_brake, ORANGE)
    d.text(710, 540, "D [mJ]", 12, INK, "middle")
    return d
