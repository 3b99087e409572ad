"""Rules for the figures of a report, checked on the SVG that was written.

A figure is wrong if an axis has no unit, if two series of the legend differ in less than two of colour, dash and marker,
if a text is cut by the edge or overlaps another, or if nothing is drawn. The size of text is estimated.
"""

import itertools
import re
import xml.etree.ElementTree as ElementTree

CHARACTER_EM = 0.58
SIZES = {"axis-label": 13}
END = ("y-tick", "limit-label")
MIDDLE = ("x-tick", "axis-label", "band-label")


class Box:
    def __init__(self, text, left, top, right, bottom):
        self.text, self.left, self.top, self.right, self.bottom = text, left, top, right, bottom

    def overlaps(self, other):
        return (min(self.right, other.right) - max(self.left, other.left) > 1 and
                min(self.bottom, other.bottom) - max(self.top, other.top) > 1)


def classes(element):
    return element.get("class", "").split()


def tag(element):
    return element.tag.rsplit("}", 1)[-1]


def figures_of(page):
    """Returns the SVG elements of a page or an SVG file."""
    return [ElementTree.fromstring(text) for text in re.findall(r"<svg[ >].*?</svg>", page, re.DOTALL)]


def box_of(text):
    """Returns the estimated bounding box of a text, whose y is its baseline."""
    kind = classes(text)[0]
    size = SIZES.get(kind, 12)
    words = "".join(text.itertext())
    width = CHARACTER_EM * size * len(words)
    start = -width if kind in END else -width / 2 if kind in MIDDLE else 0
    turned = re.match(r"translate\(([-\d.]+) ([-\d.]+)\) rotate\(-90\)", text.get("transform", ""))
    if turned:
        x, y = float(turned[1]), float(turned[2])
        return Box(words, x - 0.75 * size, y - start - width, x + 0.25 * size, y - start)
    x, y = float(text.get("x")), float(text.get("y"))
    return Box(words, x + start, y - 0.75 * size, x + start + width, y + 0.25 * size)


def styles_of(page):
    """Returns the colour and the dash of each style, from the style sheet."""
    colors = dict(re.findall(r"\.plot \.(s\d) \{ stroke: (#\w+); \}", page))
    dashes = {}
    for names, dash in re.findall(r"((?:\.plot \.line\.s\d,? ?)+)\{ stroke-dasharray: ([\d. ]+); \}", page):
        for name in re.findall(r"s\d", names):
            dashes[name] = dash
    return colors, dashes


def look_of(key, page):
    """Returns the colour, the dash and the marker of an entry of the legend."""
    colors, dashes = styles_of(page)
    color, dash, marker = None, None, None
    for part in key:
        style = next((name for name in classes(part) if re.fullmatch(r"s\d", name)), None)
        color = colors.get(style, color)
        if tag(part) == "line":
            dash = dashes.get(style, "solid")
        if tag(part) == "path":
            marker = part.get("d").lstrip("M0123456789.,-")
    return color, dash, marker


def legend_problems(figure, page):
    keys = [element for element in figure.iter() if "key" in classes(element)]
    named = [("".join(key.itertext()).strip(), look_of(key, page)) for key in keys]
    for (one, look), (other, other_look) in itertools.combinations(named, 2):
        different = sum(a != b for a, b in zip(look, other_look))
        if different < 2:
            yield f'the series "{one}" and "{other}" differ in {different} of colour, dash and marker'


def text_problems(figure):
    width, height = (float(number) for number in figure.get("viewBox").split()[2:])
    boxes = [box_of(element) for element in figure.iter() if tag(element) == "text"]
    for box in boxes:
        if box.left < 0 or box.top < 0 or box.right > width or box.bottom > height:
            yield f'the text "{box.text}" is cut by the edge'
    for one, other in itertools.combinations(boxes, 2):
        if one.overlaps(other):
            yield f'the texts "{one.text}" and "{other.text}" overlap'


def problems_of(figure, page):
    """Yields the problems of a figure on a page."""
    labels = ["".join(text.itertext()) for text in figure.iter() if "axis-label" in classes(text)]
    if len(labels) != 2:
        yield f"{len(labels)} axes have a label"
    for label in labels:
        if not re.fullmatch(r"\S.* \[[^\[\]]+\]", label):
            yield f'the axis "{label}" has no unit'
    if not any(tag(element) == "polyline" or "marker" in classes(element) for element in figure.iter()):
        yield "nothing is drawn"
    yield from legend_problems(figure, page)
    yield from text_problems(figure)


def report_problems(page):
    """Yields the problems of a report: its figures, its first page, and missing data for a repetition."""
    for number, figure in enumerate(figures_of(page), 1):
        for problem in problems_of(figure, page):
            yield f"figure {number}: {problem}"
    first_page = page.split('<section class="appendix">')[0]
    if len(figures_of(first_page)) > 3:
        yield f"{len(figures_of(first_page))} figures are on the first page"
    if 'class="question"' not in first_page:
        yield "the first page asks nothing"
    if 'class="answer"' not in first_page and 'class="verdict' not in first_page:
        yield "the first page answers nothing"
    if not re.search(r'class="origin"><code>tandem-lab .+?</code><br>Tandem [\d.]+, \d{4}-\d\d-\d\d', first_page):
        yield "the first page names no command, version and date"
