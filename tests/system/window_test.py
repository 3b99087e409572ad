"""Tests that the window shows the scene and can be used with a mouse. The colours of its images are checked under Xvfb.
"""

import colorsys
import glob
import itertools
import json
import math
import os
import subprocess
import time
import unittest

from support import PATIENCE_S, SOURCE, ProgramTest, Server, finish, program, start_client
from window_support import (HEIGHT, WIDTH, Picture, WindowTest, is_blue, is_cream, is_green, is_orange, is_pink,
                            is_red, is_white, is_yellow)


def is_lime(r, g, b):
    return 120 < r < 200 and g > 180 and b < 0.75 * g and r > 1.2 * b


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

    def settled_picture(self, is_wanted):
        """Waits for an expected image that does not change for two seconds, because a thread prepares the content of
        the window. Returns the image."""
        last, same, end = self.display.picture(), 0, time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            time.sleep(1)
            picture = self.display.picture()
            same = same + 1 if changed(last, picture) < 500 else 0
            last = picture
            if same >= 2 and is_wanted(picture):
                return picture
        self.fail("the window does not show the expected picture")

    def pictures_before_each(self, key, names):
        """Takes an image of molecules before each press of a key. Returns the images by these names, and the settings
        that the window stored."""
        pictures = {}
        with Server("--scene", "docking_helices") as server:
            client = self.start(server, "--hand", "rest")
            self.wait_for_window()
            server.wait_for_log("joined")
            pictures[names[0]] = self.settled_picture(lambda picture: picture.count(is_blue) > 4000)
            self.display.do("key", key)
            for before, name in itertools.pairwise(names):
                pictures[name] = self.settled_picture(lambda picture, old=pictures[before]: changed(old, picture) > 1000)
                self.display.do("key", key)
            time.sleep(1)
            self.display.do("key", "ctrl+q")
            self.assertEqual(finish(client)[0], 0)
        with open(os.path.join(self.display.folder.name, "tandem", "window.json")) as file:
            return pictures, json.load(file)

    def test_the_key_m_shows_molecules_as_balls_sticks_surface_and_ribbon(self):
        pictures, remembered = self.pictures_before_each("m", ("balls", "sticks", "surface", "ribbon", "balls again"))
        self.assertEqual(remembered["molecules"], "sticks", "for the next window")
        blue, orange = ({style: picture.count(is_it) for style, picture in pictures.items()} for is_it in (is_blue, is_orange))
        for colored in (blue, orange):
            self.assertLess(colored["sticks"], 0.6 * colored["balls"], "sticks are thin")
            self.assertGreater(colored["surface"], 0.7 * colored["balls"], "the surface covers the balls; its dark parts count as no colour")
            self.assertGreater(colored["ribbon"], 0.2 * colored["balls"], "in the molecule's colour")
            self.assertAlmostEqual(colored["balls again"], colored["balls"], delta=0.1 * colored["balls"])
        for is_it, name in ((is_red, "oxygens"), (is_white, "hydrogens")):
            self.assertGreater(pictures["surface"].count(is_it), 500, name)
            self.assertLess(pictures["ribbon"].count(is_it), 0.3 * pictures["balls"].count(is_it), f"no {name} in a ribbon")
        self.assertGreater(changed(pictures["balls"], pictures["surface"]), 4000, "but it is not them")
        self.assertLess(changed(pictures["balls"], pictures["balls again"]), 1000)

    def test_the_key_n_colours_molecules_by_chain_and_residue(self):
        pictures, remembered = self.pictures_before_each("n", ("element", "chain", "residue", "again"))
        self.assertEqual(remembered["molecule_colors"], "chain", "for the next window")
        element, chain, residue, again = pictures.values()
        self.assertGreater(chain.count(is_rose), 3 * element.count(is_rose) + 1000, "the scene's second chain")
        self.assertGreater(changed(chain, residue), 4000)
        self.assertLess(changed(element, again), 1000)

    def test_a_click_on_an_atom_marks_its_residue_and_escape_removes_the_marks(self):
        with Server("--scene", "docking_helices") as server:
            client = self.start(server, "--hand", "rest")
            self.wait_for_window()
            server.wait_for_log("joined")
            before = self.settled_picture(lambda picture: picture.count(is_blue) > 4000)
            blue = set(before.places(is_blue))
            x, y = next((x, y) for x, y in sorted(blue) if all((x + i, y + j) in blue for i in (-4, 4) for j in (-4, 4)))
            self.display.do("mousemove", x, y, "sleep", 1, "mousedown", 1, "sleep", 0.5, "mouseup", 1)
            self.settled_picture(lambda picture: picture.count(is_lime) > before.count(is_lime) + 30)
            self.display.do("key", "Escape")
            self.settled_picture(lambda picture: picture.count(is_lime) <= before.count(is_lime) + 5)
            self.display.do("key", "ctrl+q")
            self.assertEqual(finish(client)[0], 0)

    def test_a_soft_pad_is_there(self):
        with Server("--scene", "soft_pad") as server:
            picture = self.picture(server, "--hand", "rest")
        self.assertGreater(picture.count(is_pink), 4000, "the pad")
        self.assertGreater(picture.count(is_red), 700, "the ball")

    def test_a_soft_mesh_is_there_and_yields(self):
        """Tests a soft ball on which a tool presses from above."""
        rings, sides, radius_m = 12, 24, 0.03
        with open(self.path("ball.obj"), "w") as file:
            for ring in range(rings + 1):
                up = math.pi * ring / rings
                for around in (2 * math.pi * side / sides for side in range(sides)):
                    x, y, z = math.sin(up) * math.cos(around), math.sin(up) * math.sin(around), math.cos(up)
                    file.write(f"v {radius_m * x:.9f} {radius_m * y:.9f} {radius_m * z:.9f}\n")
            for ring, side in itertools.product(range(rings), range(sides)):
                a, b = 1 + sides * ring + side, 1 + sides * ring + (side + 1) % sides
                file.write(f"f {a} {a + sides} {b + sides}\nf {a} {b + sides} {b}\n")
        with open(self.path("ball.json"), "w") as file:
            json.dump({"name": "ball",
                       "bodies": [{"name": "table", "shapes": [{"box": {"size_m": [0.5, 0.4, 0.02]}}],
                                   "placement": {"position_m": [0, 0, -0.01]}}],
                       "soft_bodies": [{"name": "ball", "mesh": {"file": "ball.obj"}, "mass_kg": 0.3, "stiffness": 0.5,
                                        "placement": {"position_m": [0, 0, 0.03]}, "anchored": ["-z"],
                                        "color_rgb": [0.2, 0.3, 0.9]}],
                       "tools": [{"name": "left", "placement": {"position_m": [0, 0, 0.085]},
                                  "shapes": [{"sphere": {"radius_m": 0.01}}]}],
                       "coupling": {"law": "spring-damper", "stiffness_n_per_m": 300, "damping_n_s_per_m": 5}}, file)
        def top_of_middle(picture, x):
            """Returns the top of the ball at x. If the drawn ball did not yield, it would hide the tool there."""
            return min(y for at, y in picture.places(is_blue) if abs(at - x) <= 1)
        with Server("--scene", self.path("ball.json")) as server:
            rest = self.picture(server, "--hand", "rest")
            pressed = self.picture(server, "--hand", "press-down", after="4s")
        self.assertGreater(rest.count(is_blue), 4000, "the ball")
        self.assertGreater(pressed.count(is_yellow), 10, "it is felt")
        x = rest.middle(is_blue)[0]
        self.assertGreater(top_of_middle(pressed, x), top_of_middle(rest, x) + 5, "its top goes before the tool")


def changed(before, after):
    """Returns the number of pixels of the scene whose colour has changed."""
    end = int(before.width * 0.62)
    return sum(max(abs(a - b) for a, b in zip(old, new)) > 60
               for rows in zip(before.rows, after.rows) for old, new in zip(*(row[:end] for row in rows)) if old != new)


def hue_of(r, g, b):
    """Returns (hue from 0 to 1, saturation from 0 to 1, value)."""
    return colorsys.rgb_to_hsv(r / 255, g / 255, b / 255)


def is_hue(wanted, by=0.045):
    def is_it(r, g, b):
        hue, saturation, value = hue_of(r, g, b)
        return saturation > 0.3 and value > 0.2 and abs((hue - wanted + 0.5) % 1 - 0.5) < by
    return is_it


is_rose = is_hue(0.971, by=0.03)


def colored_things(scene):
    """Returns (name, hue, position, whether the hue is unique in the scene) for each coloured body."""
    # Tools are green and pink; arrows are yellow and cyan. Molecules are excluded, because only their carbon atoms have
    # the molecule's colour.
    levels = [set(level.get("bodies", [])) for level in scene.get("game", {}).get("levels", [])]
    absent = set().union(*levels) - levels[0] if levels else set()  # bodies of other levels than the first
    things = [thing for thing in scene.get("bodies", []) + scene.get("soft_bodies", [])
              if "color_rgb" in thing and "molecule" not in str(thing) and thing["name"] not in absent]
    hues = [(thing, *hue_of(*[255 * c for c in thing["color_rgb"]])) for thing in things]
    found = []
    for thing, hue, saturation, _ in hues:
        if saturation < 0.3:
            continue
        others = [h for other, h, s, _ in hues if other is not thing and s > 0.25] + [0.45, 0.9]
        is_unique = all(abs((h - hue + 0.5) % 1 - 0.5) > 0.08 for h in others)
        found.append((thing["name"], hue, thing.get("placement", {}).get("position_m", [0, 0, 0]), is_unique))
    return found


def to_the_right(place):
    """Returns the coordinate of a place along the image's x axis, in the initial view of the camera."""
    return math.cos(0.45) * place[0] + math.sin(0.45) * place[1]


class ShippedScenes(WindowTest):
    def test_each_shows_its_tools_and_what_moves_in_its_colour_at_its_place(self):
        seen = 0
        for name in sorted(os.path.basename(path) for path in glob.glob(os.path.join(SOURCE, "server/scenes/*.json"))):
            with self.subTest(scene=name), open(os.path.join(SOURCE, "server/scenes", name)) as file:
                scene = json.load(file)
                server = self.enterContext(Server("--scene", name.removesuffix(".json")))
                # In this small window the panel of a game covers some of its objects.
                picture = self.picture(server, "--hand", "rest", *(["--scene-only"] if "game" in scene else []))
                server.kill()
                if "molecule" not in str(scene.get("tools")) and "holds" not in scene["tools"][0]:
                    self.assertGreater(picture.count(is_green), 8, "the own tool")
                places = {}
                for thing, hue, place, is_unique in colored_things(scene):
                    self.assertGreater(picture.count(is_hue(hue)), 40, f"{thing} of hue {hue:.2f}")
                    seen += 1
                    if is_unique:
                        places[thing] = (to_the_right(place), picture.middle(is_hue(hue))[0])
                for a, b in itertools.combinations(places.values(), 2):
                    if abs(a[0] - b[0]) > 0.08:
                        self.assertEqual(a[0] < b[0], a[1] < b[1], places)
        self.assertGreater(seen, 12)


class Operators(WindowTest):
    def test_an_operators_tool_is_seen_by_himself_and_by_others(self):
        with Server("--scene", "two_boxes") as server:
            own = self.picture(server, "--hand", "rest", "--role", "operator")
            self.assertGreater(own.count(is_green), 40, "his own")
            operator = start_client(server.port, "--name", "olga", "--role", "operator", "--hand", "rest", "--duration", "60s")
            server.wait_for_log("olga.*joined")
            others = self.picture(server, "--hand", "rest", "--role", "observer", name="others.png")
            operator.terminate()
            finish(operator)
        self.assertGreater(others.count(is_green), 40, "an observer sees it")


class Hands(WindowTest):
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
            tool.append(Picture.of_file(self.path("after.png")).middle(is_green))
        self.assertAlmostEqual(tool[1][0] - tool[0][0], 80, delta=25)
        self.assertAlmostEqual(tool[1][1] - tool[0][1], 50, delta=20)


class NoDisplay(ProgramTest):
    def test_is_one_line_that_says_what_would_do(self):
        variables = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}
        done = subprocess.run([program("tandem-client"), "--insecure"], env=variables, capture_output=True, text=True, timeout=PATIENCE_S)
        self.assert_setup_error((done.returncode, done.stdout, done.stderr), "display", "--headless")


if __name__ == "__main__":
    unittest.main()
