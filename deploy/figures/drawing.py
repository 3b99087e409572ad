"""A drawing in SVG: lines, curves, arrows, boxes and text, in pixels with y downwards. Uses the standard library only.

Colours are those of the lab's reports: dark text, and one accent colour per quantity. Numbers are written with one decimal,
so that the file is the same on every machine.
"""
from html import escape

INK = "#222222"
GREY = "#9a9a9a"
LIGHT = "#e4e7eb"
BLUE = "#1f77b4"
ORANGE = "#e8842c"
GREEN = "#2a9d5b"
RED = "#c0392b"
FONT = "DejaVu Sans, Arial, sans-serif"


def _number(value):
    return f"{value:.1f}"


class Drawing:
    """Shapes in the order in which they were added. Later shapes cover earlier ones."""

    def __init__(self, width, height, title):
        self._width, self._height, self._title = width, height, title
        self._shapes = []

    def _add(self, name, text=None, **attributes):
        pairs = " ".join(f'{key.replace("_", "-")}="{escape(value if isinstance(value, str) else _number(value))}"'
                         for key, value in attributes.items() if value is not None)
        end = "/>" if text is None else f">{escape(text)}</{name}>"
        self._shapes.append(f"<{name} {pairs}{end}")

    def line(self, x1, y1, x2, y2, colour=INK, width=1.5, dash=None):
        self._add("line", x1=x1, y1=y1, x2=x2, y2=y2, stroke=colour, stroke_width=width, stroke_dasharray=dash)

    def path(self, points, colour=INK, width=1.5, dash=None, fill="none", closed=False):
        """Adds a polyline through points (x, y). If closed, the last point is joined to the first."""
        steps = " L ".join(f"{_number(x)} {_number(y)}" for x, y in points)
        self._add("path", d=f"M {steps}{' Z' if closed else ''}", stroke=colour, stroke_width=width, stroke_dasharray=dash, fill=fill)

    def arrow(self, x1, y1, x2, y2, colour=INK, width=1.5, dash=None, head=7.0):
        """Adds an arrow with its head at (x2, y2)."""
        dx, dy = x2 - x1, y2 - y1
        length = (dx * dx + dy * dy) ** 0.5
        ux, uy = dx / length, dy / length
        bx, by = x2 - head * ux, y2 - head * uy
        self.line(x1, y1, bx, by, colour, width, dash)
        side = 0.45 * head
        self.path([(x2, y2), (bx - side * uy, by + side * ux), (bx + side * uy, by - side * ux)], colour, 0.0, fill=colour, closed=True)

    def circle(self, x, y, radius, colour=INK, width=1.5, fill="none"):
        self._add("circle", cx=x, cy=y, r=radius, stroke=colour, stroke_width=width, fill=fill)

    def box(self, x, y, width, height, colour=INK, stroke=1.5, fill="none", corner=4.0):
        self._add("rect", x=x, y=y, width=width, height=height, rx=corner, stroke=colour, stroke_width=stroke, fill=fill)

    def text(self, x, y, words, size=13.0, colour=INK, anchor="start", weight=None):
        """Adds one line of text; anchor is start, middle or end."""
        self._add("text", words, x=x, y=y, font_family=FONT, font_size=size, fill=colour, text_anchor=anchor, font_weight=weight)

    def labelled_box(self, x, y, width, height, lines, colour=INK, fill="white", size=13.0):
        """Adds a box with centred lines of text."""
        self.box(x, y, width, height, colour, fill=fill)
        first = y + height / 2 - (len(lines) - 1) * 0.65 * size + 0.35 * size
        for index, words in enumerate(lines):
            self.text(x + width / 2, first + index * 1.3 * size, words, size, INK, "middle")

    def svg(self):
        """Returns the text of the SVG file."""
        w, h = _number(self._width), _number(self._height)
        head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{w}" height="{h}" viewBox="0 0 {w} {h}" role="img">'
        return "\n".join([head, f"<title>{escape(self._title)}</title>", '<rect width="100%" height="100%" fill="white"/>',
                          *self._shapes, "</svg>", ""])
