"""Draws reconciliation at matched time. The server's answer to input k is compared with the model at input k, and the
sum of the corrections since then is subtracted. The lower curves are computed by the rule of
client/model/reconciler.cpp.
"""
from drawing import BLUE, GREEN, GREY, INK, LIGHT, ORANGE, RED, Drawing

PATH = "client/model/reconciliation.svg"
STEP_S, LOOP_S, OFFSET_M = 0.001, 0.1, 0.010
TIME_CONSTANT_S, LOOPS, LIMIT_M_PER_S = 0.1, 5, 0.05
SHOWN_S = 2.0


def corrected(keeps_sums):
    """Returns the correction of the model [m] at each tick. The server's answer is LOOP_S old."""
    given, sums = 0.0, [0.0]
    delay = round(LOOP_S / STEP_S)
    time_constant_s = TIME_CONSTANT_S + (LOOPS * LOOP_S if keeps_sums else 0)
    for tick in range(1, round(SHOWN_S / STEP_S)):
        then = sums[max(0, tick - delay)]
        error = OFFSET_M - then if tick >= delay else 0.0
        missing = then + error - given if keeps_sums and tick >= delay else error
        shift = missing * STEP_S / time_constant_s
        most = LIMIT_M_PER_S * STEP_S
        given += max(-most, min(most, shift))
        sums.append(given)
    return sums


def lanes(drawing):
    left, wide = 150, 700
    sent, used, back = 0.16, 0.46, 0.76

    def x(share):
        return left + wide * share

    for y, name in ((70, "local model"), (190, "server")):
        drawing.line(left, y, left + wide, y, GREY, 1.5)
        drawing.text(left - 14, y + 5, name, 14, anchor="end", weight="bold")
        for index in range(26):
            drawing.line(x(index / 25), y - 4, x(index / 25), y + 4, GREY, 1.0)
    drawing.arrow(x(sent), 76, x(used - 0.1), 184, BLUE, 2.0)
    drawing.text(x(0.175), 150, "input k", 13, BLUE, "end")
    drawing.box(x(used - 0.1), 183, x(used) - x(used - 0.1), 14, BLUE, 1.0, LIGHT, 2)
    drawing.text(x(used - 0.05), 216, "playout", 12, BLUE, "middle")
    drawing.arrow(x(used), 184, x(back), 76, ORANGE, 2.0)
    drawing.text(x(0.66), 150, "S(k): state, answered input k", 13, ORANGE)
    drawing.circle(x(sent), 70, 6, BLUE, 2.0, "white")
    drawing.circle(x(used), 190, 6, ORANGE, 2.0, "white")
    drawing.circle(x(back), 70, 6, RED, 2.0, "white")
    drawing.text(x(sent), 50, "M(k), C(k) stored", 13, BLUE, "middle")
    drawing.text(x(back), 50, "e = S(k) − M(k), at matched input", 13, RED, "middle")
    drawing.line(x(sent), 24, x(back), 24, GREEN, 1.5)
    for share in (sent, back):
        drawing.line(x(share), 18, x(share), 30, GREEN, 1.5)
    drawing.box(x(0.46) - 62, 14, 124, 20, "none", 0.0, "white", 0)
    drawing.text(x(0.46), 29, "loop delay", 13, GREEN, "middle")


def draw():
    drawing = Drawing(900, 510, "Reconciliation at matched time")
    lanes(drawing)
    left, top, wide, high = 150, 260, 700, 190
    most_m = 0.016
    drawing.box(left, top, wide, high, GREY, 1.0, corner=0)

    def place(tick, value_m):
        return left + wide * tick * STEP_S / SHOWN_S, top + high * (1 - value_m / most_m)

    y = place(0, OFFSET_M)[1]
    drawing.line(left, y, left + wide, y, GREY, 1.0, "4 4")
    drawing.text(left + wide - 8, y - 6, "required: model is 10 mm off", 12, GREY, "end")
    for keeps_sums, colour in ((False, RED), (True, GREEN)):
        drawing.path([place(tick, value) for tick, value in enumerate(corrected(keeps_sums)) if tick % 4 == 0], colour, 2.5)
    drawing.text(left + 250, top + 30, "e applied as it arrives, τ = 0.1 s: overshoots", 13, RED)
    drawing.text(left + 430, top + 140, "C(k) + e − C, τ = 0.1 s + 5 loop delays", 13, GREEN)
    drawing.text(left - 14, top + 14, "correction C", 14, INK, "end", "bold")
    drawing.text(left - 14, y + 5, "10 mm", 12, INK, "end")
    drawing.text(left - 14, top + high + 4, "0", 12, INK, "end")
    for index in range(5):
        drawing.line(left + wide * index / 4, top + high, left + wide * index / 4, top + high + 5, GREY, 1.0)
        drawing.text(left + wide * index / 4, top + high + 20, f"{SHOWN_S * index / 4:.1f} s", 12, INK, "middle")
    drawing.text(left + wide / 2, top + high + 42, "loop delay 0.1 s, limit 0.05 m/s", 12, INK, "middle")
    return drawing
