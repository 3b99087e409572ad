"""A virtual display, a window on it, and the evaluation of its images, for tests of the window.

No image is compared with an image of another machine. The tests check colours, the number of their pixels, and their
positions.
"""

import itertools
import mmap
import os
import struct
import subprocess
import tempfile
import time
import unittest
import zlib

from support import PATIENCE_S, ProgramTest, finish, program

WIDTH, HEIGHT = 720, 504


class Picture:
    """An image as rows of pixels, each (red, green, blue). A condition on colours is evaluated only once for each
    colour."""

    def __init__(self, rows):
        """`rows` contains rows of bytes: red, green, blue of each pixel."""
        self.rows = [list(zip(row[0::3], row[1::3], row[2::3])) for row in rows]
        self.width, self.height = len(self.rows[0]), len(self.rows)
        self._colors = set(itertools.chain.from_iterable(self.rows))

    @classmethod
    def of_file(cls, path):
        """Reads a PNG file with eight bits per channel, which is the format of the program."""
        with open(path, "rb") as file:
            data = file.read()
        assert data[:8] == b"\x89PNG\r\n\x1a\n", "no PNG file"
        packed, at = b"", 8
        while at < len(data):
            (size,) = struct.unpack(">I", data[at:at + 4])
            kind, chunk = data[at + 4:at + 8], data[at + 8:at + 8 + size]
            if kind == b"IHDR":
                width, height, depth, color = struct.unpack(">IIBB", chunk[:10])
                assert (depth, color) == (8, 2), "three channels of eight bits"
            if kind == b"IDAT":
                packed += chunk
            at += 12 + size
        return cls(unfiltered(zlib.decompress(packed), 3 * width, height))

    def at(self, x, y):
        return self.rows[y][x]

    def matching(self, is_it):
        """Returns the colours of the image that satisfy the condition."""
        return {color for color in self._colors if is_it(*color)}

    def runs(self, is_it, left=0.0):
        """Returns (x and y of the first pixel, length) for each run of pixels that satisfy the condition, to the right
        of `left` (fraction of the width)."""
        found, colors = [], self.matching(is_it)
        for y, row in enumerate(self.rows):
            first = None
            for x in range(int(self.width * left), self.width + 1):
                if x < self.width and row[x] in colors:
                    first = x if first is None else first
                elif first is not None:
                    found.append((first, y, x - first))
                    first = None
        return found

    def places(self, is_it, right=0.62):
        """Returns (x, y) of the pixels of the scene that satisfy the condition. The scene is left of the panels."""
        end, colors = int(self.width * right), self.matching(is_it)
        return [(x, y) for y, row in enumerate(self.rows) if not colors.isdisjoint(row)
                for x, color in enumerate(row[:end]) if color in colors]

    def count(self, is_it):
        return len(self.places(is_it))

    def middle(self, is_it):
        places = self.places(is_it)
        assert places, "there is none of that colour"
        return sum(x for x, _ in places) / len(places), sum(y for _, y in places) / len(places)


def unfiltered(data, stride, height):
    """Decodes the filtered rows of a PNG file (ISO/IEC 15948, clause 9). Returns rows with three bytes per pixel."""
    rows, before = [], bytes(stride)
    for start in range(0, height * (stride + 1), stride + 1):
        kind, row = data[start], bytearray(data[start + 1:start + 1 + stride])
        for channel in range(3):
            values, above = row[channel::3], before[channel::3]
            if kind == 1:
                row[channel::3] = bytes(value & 255 for value in itertools.accumulate(values))
            elif kind == 2:
                row[channel::3] = bytes(value + up & 255 for value, up in zip(values, above))
            elif kind == 3:
                row[channel::3] = averaged(values, above)
            elif kind == 4:
                row[channel::3] = by_paeth(values, above)
        rows.append(row)
        before = row
    return rows


def averaged(values, above):
    left = 0
    for i, up in enumerate(above):
        values[i] = left = values[i] + (left + up) // 2 & 255
    return values


def by_paeth(values, above):
    left = corner = 0
    for i, up in enumerate(above):
        by_left, by_up, by_corner = abs(up - corner), abs(left - corner), abs(left + up - 2 * corner)
        if by_left <= by_up and by_left <= by_corner:
            guess = left
        else:
            guess = up if by_up <= by_corner else corner
        values[i] = left = values[i] + guess & 255
        corner = up
    return values


def is_yellow(r, g, b):
    return r > 150 and g > 125 and b < 90 and abs(r - g) < 70


def is_cyan(r, g, b):
    return r < 110 and g > 150 and b > 160


def is_orange(r, g, b):
    return r > 110 and 0.4 * r < g < 0.72 * r and b < 0.45 * r


def is_blue(r, g, b):
    return b > 100 and b > 1.25 * g and b > 1.7 * r


def is_red(r, g, b):
    return r > 110 and g < 0.45 * r and b < 0.45 * r


def is_cream(r, g, b):
    return r > 190 and g > 180 and 150 < b < r and r - b < 50


def is_pink(r, g, b):
    return r > 120 and 0.5 * r < g < 0.8 * r and 0.5 * r < b < 0.8 * r


def is_green(r, g, b):
    return g > 90 and g > 1.5 * r and g > 1.1 * b


def is_white(r, g, b):
    return min(r, g, b) > 225


class Display:
    """A virtual display for one test."""

    def __init__(self, width=WIDTH, height=HEIGHT):
        self.folder = tempfile.TemporaryDirectory()
        read, write = os.pipe()
        self.process = subprocess.Popen(
            ["Xvfb", "-displayfd", str(write), "-screen", "0", f"{width}x{height}x24", "-nolisten", "tcp", "-noreset", "-fbdir",
             self.folder.name],
            pass_fds=[write], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(write)
        with os.fdopen(read) as told:
            self.name = ":" + told.readline().strip()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait(PATIENCE_S)
        self.folder.cleanup()

    def picture(self):
        """Returns the current content of the display, which Xvfb stores in a file in xwd format."""
        with open(os.path.join(self.folder.name, "Xvfb_screen0"), "rb") as file:
            with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
                header = struct.unpack(">25I", data[:100])
                width, height, stride = header[4], header[5], header[12]
                start = header[0] + 12 * header[19]
                pixels = data[start:start + stride * height]
        rows = []
        for y in range(height):
            row = bytearray(3 * width)
            line = pixels[y * stride:y * stride + 4 * width]
            row[0::3], row[1::3], row[2::3] = line[2::4], line[1::4], line[0::4]
            rows.append(row)
        return Picture(rows)

    def environment(self):
        variables = {key: value for key, value in os.environ.items() if key != "WAYLAND_DISPLAY"}
        # Mesa renders in software, which works on any machine.
        return variables | {"DISPLAY": self.name, "LIBGL_ALWAYS_SOFTWARE": "1", "XDG_STATE_HOME": self.folder.name}

    def do(self, *arguments):
        subprocess.run(["xdotool", *map(str, arguments)], env=self.environment(), check=True, timeout=PATIENCE_S,
                       stdout=subprocess.DEVNULL)


class WindowTest(ProgramTest):
    programs = ("Xvfb", "xdotool")
    #: Sizes of the display and of the window on it. If `window` is None, the window has the size of the display.
    width, height, window = WIDTH, HEIGHT, None

    def setUp(self):
        super().setUp()
        self.display = self.enterContext(Display(self.width, self.height))

    def start(self, server, *arguments):
        client = subprocess.Popen(
            [program("tandem-client"), "--insecure", "--server", f"127.0.0.1:{server.port}", "--window-size",
             self.window or f"{self.width}x{self.height}", *arguments], env=self.display.environment(), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(client.communicate)
        self.addCleanup(client.kill)
        return client

    def picture(self, server, *arguments, after="2s", name="picture.png"):
        done = finish(self.start(server, "--screenshot", self.path(name), "--after", after, *arguments))
        self.assertEqual(done[0], 0, done[2])
        return Picture.of_file(self.path(name))

    def wait_for_window(self):
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            # Without a window manager, only this command gives the keyboard focus to the window. It fails until the
            # window is visible.
            found = subprocess.run(["xdotool", "search", "--onlyvisible", "--name", "^tandem:", "windowfocus"],
                                   env=self.display.environment(), capture_output=True, timeout=PATIENCE_S)
            if found.returncode == 0:
                return
            time.sleep(0.1)
        self.fail("no window opened")

    def drag(self, right, down, button=1):
        """Drags from the middle of the scene. The motion is slow, because a busy machine draws only a few frames per
        second."""
        x, y, steps = self.width // 4, self.height // 2, 16
        self.display.do("mousemove", x, y)
        time.sleep(0.7)
        self.display.do("mousedown", button)
        time.sleep(0.7)
        for step in range(1, steps + 1):
            self.display.do("mousemove", x + right * step // steps, y + down * step // steps)
            time.sleep(0.2)
        time.sleep(0.7)
        self.display.do("mouseup", button)
        time.sleep(0.7)
