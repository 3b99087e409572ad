"""The window shows what there is, and a person with a mouse can use it: under Xvfb, by the colours of its pictures.

No picture is compared with another machine's: what is looked for are colours, how much of them there is, and where.
"""

import json
import os
import shutil
import struct
import subprocess
import time
import unittest
import zlib

from support import BIN, PATIENCE_S, SOURCE, ProgramTest, Server, finish, program, start_client

WIDTH, HEIGHT = 720, 504
NEEDED = ("Xvfb", "xdotool")


class Picture:
    """A PNG file of eight bits a channel, as the program writes them."""

    def __init__(self, path):
        with open(path, "rb") as file:
            data = file.read()
        assert data[:8] == b"\x89PNG\r\n\x1a\n", "no PNG file"
        packed, at = b"", 8
        while at < len(data):
            (size,) = struct.unpack(">I", data[at:at + 4])
            kind, chunk = data[at + 4:at + 8], data[at + 8:at + 8 + size]
            if kind == b"IHDR":
                self.width, self.height, depth, color = struct.unpack(">IIBB", chunk[:10])
                assert (depth, color) == (8, 2), "three channels of eight bits"
            if kind == b"IDAT":
                packed += chunk
            at += 12 + size
        self.rows = self._unfiltered(zlib.decompress(packed))

    def _unfiltered(self, data):
        stride, rows, before = 3 * self.width, [], bytearray(3 * self.width)
        for y in range(self.height):
            start = y * (stride + 1)
            kind, row = data[start], bytearray(data[start + 1:start + 1 + stride])
            for i in range(stride):
                left = row[i - 3] if i >= 3 else 0
                up, corner = before[i], before[i - 3] if i >= 3 else 0
                if kind == 1:
                    row[i] = (row[i] + left) & 255
                elif kind == 2:
                    row[i] = (row[i] + up) & 255
                elif kind == 3:
                    row[i] = (row[i] + (left + up) // 2) & 255
                elif kind == 4:
                    guess = left + up - corner
                    by = min((abs(guess - left), 0, left), (abs(guess - up), 1, up), (abs(guess - corner), 2, corner))[2]
                    row[i] = (row[i] + by) & 255
            rows.append(row)
            before = row
        return rows

    def places(self, is_it, right=0.62):
        """(x, y) of the pixels of the scene, left of the panels, whose (red, green, blue) are it."""
        end = 3 * int(self.width * right)
        return [(x, y) for y, row in enumerate(self.rows)
                for x, color in enumerate(zip(row[0:end:3], row[1:end:3], row[2:end:3])) if is_it(*color)]

    def count(self, is_it):
        return len(self.places(is_it))

    def middle(self, is_it):
        places = self.places(is_it)
        assert places, "there is none of that colour"
        return sum(x for x, _ in places) / len(places), sum(y for _, y in places) / len(places)


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
    """A display of its own that nobody sees."""

    def __init__(self):
        read, write = os.pipe()
        self.process = subprocess.Popen(
            ["Xvfb", "-displayfd", str(write), "-screen", "0", f"{WIDTH}x{HEIGHT}x24", "-nolisten", "tcp"],
            pass_fds=[write], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(write)
        with os.fdopen(read) as told:
            self.name = ":" + told.readline().strip()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait(PATIENCE_S)

    def environment(self):
        variables = {key: value for key, value in os.environ.items() if key != "WAYLAND_DISPLAY"}
        # Mesa's drawing in software, whatever the machine has.
        return variables | {"DISPLAY": self.name, "LIBGL_ALWAYS_SOFTWARE": "1"}

    def do(self, *arguments):
        subprocess.run(["xdotool", *map(str, arguments)], env=self.environment(), check=True, timeout=PATIENCE_S,
                       stdout=subprocess.DEVNULL)


@unittest.skipUnless(all(map(shutil.which, NEEDED)), "needs " + " and ".join(NEEDED) + " (deploy/install-deps)")
class WindowTest(ProgramTest):
    def setUp(self):
        super().setUp()
        self.display = self.enterContext(Display())

    def start(self, server, *arguments):
        client = subprocess.Popen(
            [program("tandem-client"), "--server", f"127.0.0.1:{server.port}", "--window-size", f"{WIDTH}x{HEIGHT}",
             *arguments], env=self.display.environment(), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(client.communicate)
        self.addCleanup(client.kill)
        return client

    def picture(self, server, *arguments, after="2s", name="picture.png"):
        done = finish(self.start(server, "--screenshot", self.path(name), "--after", after, *arguments))
        self.assertEqual(done[0], 0, done[2])
        return Picture(self.path(name))


class Scenes(WindowTest):
    def test_two_users_share_a_peg_and_the_force_has_an_arrow(self):
        with Server("--scene", "peg_in_hole") as server:
            partner = start_client(server.port, "--name", "ben", "--hand", "peg-right", "--duration", "60s", "--json")
            server.wait_for_log("ben.*joined|joined.*ben")
            picture = self.picture(server, "--hand", "rest", after="4s")
            partner.terminate()
            finish(partner)
        self.assertEqual((picture.width, picture.height), (WIDTH, HEIGHT))
        self.assertGreater(picture.count(is_blue), 4000, "the block")
        self.assertGreater(picture.count(is_orange), 900, "the peg")
        self.assertGreater(picture.count(is_yellow), 100, "the partner pulls: a force's arrow")
        peg, block = picture.middle(is_orange), picture.middle(is_blue)
        self.assertLess(peg[1], block[1], "the peg is above the block")
        self.assertLess(peg[0], block[0], "and left of it")

    def test_the_bunny_comes_as_an_asset(self):
        with Server("--scene", "bunny") as server:
            picture = self.picture(server, "--hand", "rest")
        self.assertGreater(picture.count(is_cream), 6000, "the bunny")
        self.assertGreater(picture.count(is_red), 700, "the ball")
        self.assertLess(picture.middle(is_cream)[0], picture.middle(is_red)[0], "the ball lies to its right")
        self.assertLess(picture.count(is_yellow), 20, "nothing is touched")

    def test_a_stage_that_needs_no_assets_draws_them_all_the_same(self):
        with Server("--scene", "bunny") as server:
            picture = self.picture(server, "--hand", "rest", "--stage", "hold")
        self.assertGreater(picture.count(is_cream), 6000, "the bunny")

    def test_molecules_have_the_colours_of_their_elements(self):
        with Server("--scene", "docking_helices") as server:
            picture = self.picture(server, "--hand", "rest")
        self.assertGreater(picture.count(is_blue), 4000, "carbons of one, nitrogens of both")
        self.assertGreater(picture.count(is_orange), 1000, "carbons of the other")
        self.assertGreater(picture.count(is_red), 1000, "oxygens")
        self.assertGreater(picture.count(is_white), 1000, "hydrogens")

    def test_a_soft_pad_is_there(self):
        with Server("--scene", "soft_pad") as server:
            picture = self.picture(server, "--hand", "rest")
        self.assertGreater(picture.count(is_pink), 4000, "the pad")
        self.assertGreater(picture.count(is_red), 700, "the ball")


class Demo(WindowTest):
    def test_shows_you_and_a_partner_who_hold_one_peg(self):
        done = subprocess.run([os.path.join(SOURCE, "deploy/demo"), "--window", "--skip-build", "--programs", BIN, "--out",
                               self.folder, "--picture", self.path("demo.png")], env=self.display.environment(),
                              capture_output=True, text=True, timeout=3 * PATIENCE_S)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        picture = Picture(self.path("demo.png"))
        self.assertGreater(picture.count(is_blue), 8000, "the block")
        self.assertGreater(picture.count(is_orange), 2000, "the peg")
        with open(self.path("window/server.log")) as file:
            log = file.read()
        self.assertRegex(log, "stop", "the server was told to stop: " + log)


class Hands(WindowTest):
    def wait_for_window(self):
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            # Nobody else gives it the keyboard where there is no window manager; refused until it is shown.
            found = subprocess.run(["xdotool", "search", "--onlyvisible", "--name", "^tandem:", "windowfocus"],
                                   env=self.display.environment(), capture_output=True, timeout=PATIENCE_S)
            if found.returncode == 0:
                return
            time.sleep(0.1)
        self.fail("no window opened")

    def drag(self, right, down, button=1):
        """From the middle of the scene; slowly, for a busy machine draws few frames a second."""
        x, y, steps = WIDTH // 4, HEIGHT // 2, 16
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

    def test_a_mouse_joins_grabs_lifts_and_quits(self):
        with Server("--scene", "two_boxes") as server:
            client = self.start(server, "--name", "anna", "--json")
            self.wait_for_window()
            server.wait_for_log("anna.*joined|joined.*anna")
            time.sleep(1)
            self.drag(0, 75)
            self.display.do("key", "space")
            time.sleep(2)
            self.drag(0, -100)
            self.display.do("key", "ctrl+q")
            code, out, err = finish(client)
        self.assertEqual(code, 0, err)
        report = json.loads(out)
        self.assertEqual(report["driver"], "mouse")
        self.assertGreater(report["watched_body"]["displacement_m"], 0.03, "the box is lifted")
        self.assertGreater(report["force_n"]["max"], 1, "and its weight is felt")

    def test_the_picture_follows_the_hand(self):
        with Server("--scene", "free") as server:
            tool = [self.picture(server).middle(is_green)]
            client = self.start(server, "--screenshot", self.path("after.png"), "--after", "14s")
            self.wait_for_window()
            self.drag(80, 50)
            code, _, err = finish(client)
            self.assertEqual(code, 0, err)
            tool.append(Picture(self.path("after.png")).middle(is_green))
        self.assertAlmostEqual(tool[1][0] - tool[0][0], 80, delta=25)
        self.assertAlmostEqual(tool[1][1] - tool[0][1], 50, delta=20)


@unittest.skipUnless(all(map(shutil.which, NEEDED)), "needs " + " and ".join(NEEDED) + " (deploy/install-deps)")
class NoDisplay(ProgramTest):
    def test_is_one_line_that_says_what_would_do(self):
        variables = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}
        done = subprocess.run([program("tandem-client")], env=variables, capture_output=True, text=True, timeout=PATIENCE_S)
        self.assert_setup_error((done.returncode, done.stdout, done.stderr), "display", "--headless")


if __name__ == "__main__":
    unittest.main()
