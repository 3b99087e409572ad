"""Draws the end of the network at which each client stage closes the control loop. The stiff spring is at that end."""
from drawing import BLUE, GREEN, GREY, INK, LIGHT, ORANGE, Drawing

PATH = "client/stages.svg"
ROW, TOP = 92, 62
HAND, NEAR, NET, FAR = 205, 330, 520, 700
# Columns: names, at the client, to the server, to the client, at the server, end at which the coupling is drawn.
ROWS = [
    (["local-model"], ["tool and bodies", "(local model)"], "handle, buttons", "state: slow correction", ["tool and bodies"], "client"),
    (["god-object"], ["ball, bodies", "as last received"], "handle", "poses of bodies", ["tool and bodies"], "client"),
    (["late-pose"], ["tool as", "last received"], "handle", "pose of the tool", ["tool and bodies"], "client"),
    (["hold, linear,", "ar, ar-spline"], ["wrench, held", "or continued"], "handle", "wrench on the hand", ["tool and bodies"], "server"),
    (["wave"], ["wave port", "(impedance b)"], "integral of wave u", "integral of wave v", ["port, tool,", "bodies"], "server"),
]


def spring(drawing, x1, x2, y, colour):
    """Adds a zigzag from x1 to x2, the symbol of the virtual coupling."""
    points = [(x1, y), (x1 + 8, y)]
    count = 7
    for index in range(count):
        points.append((x1 + 8 + (x2 - x1 - 16) * (index + 0.5) / count, y + (7 if index % 2 else -7)))
    drawing.path(points + [(x2 - 8, y), (x2, y)], colour, 2.0)


def draw():
    height = TOP + ROW * len(ROWS) + 34
    drawing = Drawing(960, height, "Where each stage closes the loop")
    for x, words in ((HAND, "hand"), (NEAR + 55, "client, 1 kHz"), (NET + 65, "network"), (FAR + 110, "server")):
        drawing.text(x, 28, words, 14, INK, "middle", "bold")
    drawing.box(NET - 40, 42, 210, height - 78, LIGHT, 1.0, "#f6f7f9", 0)
    for index, (names, near, forth, back, far, coupled_at) in enumerate(ROWS):
        y = TOP + ROW * index + ROW / 2 - 8
        if index > 0:
            drawing.line(20, y - ROW / 2, 940, y - ROW / 2, LIGHT, 1.0)
        for line, name in enumerate(names):
            drawing.text(24, y + 5 + 18 * (line - (len(names) - 1) / 2), name, 14, weight="bold")
        drawing.circle(HAND, y, 13, INK, 2.0, "white")
        drawing.labelled_box(NEAR - 10, y - 26, 130, 52, near)
        drawing.arrow(NET - 30, y - 10, NET + 160, y - 10, BLUE)
        drawing.text(NET + 65, y - 17, forth, 12, BLUE, "middle")
        drawing.arrow(NET + 160, y + 12, NET - 30, y + 12, ORANGE)
        drawing.text(NET + 65, y + 29, back, 12, ORANGE, "middle")
        if coupled_at == "client":
            spring(drawing, HAND + 13, NEAR - 10, y, GREEN)
            drawing.labelled_box(FAR + 110, y - 26, 125, 52, far)
        else:
            drawing.line(HAND + 13, y, NEAR - 10, y, GREY, 1.5)
        if names[0] != "wave" and coupled_at == "client":
            drawing.circle(FAR + 15, y, 8, GREY, 1.5, "white")
            spring(drawing, FAR + 23, FAR + 110, y, GREY)
        elif coupled_at == "server":
            drawing.circle(FAR + 15, y, 8, GREEN, 1.5, "white")
            spring(drawing, FAR + 23, FAR + 110, y, GREEN)
            drawing.labelled_box(FAR + 110, y - 26, 125, 52, far)
    drawing.text(20, height - 12, "green: the coupling that the hand feels; small circle at the server: the handle as received there", 12, GREY)
    return drawing
