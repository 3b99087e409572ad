"""Tests the window with simulated mouse and keyboard events. The user joins, grabs, lifts, changes delay and stage, and
goes to another room, and resizes and closes the window with a real window manager. Controls are found by their colours.
"""

import csv
import json
import math
import os
import shutil
import subprocess
import time
import unittest

import mcap_reader
from support import PATIENCE_S, Server, finish
from window_support import WindowTest, is_orange, is_yellow

#: Colour of the handle of a slider in Dear ImGui's dark style.
HANDLE = (61, 133, 224)
#: Height of a row in a combo box, and height of the rim of the box, in pixels.
ROW, RIM = 18, 8


def is_near(color, to, by):
    return all(abs(a - b) <= by for a, b in zip(color, to))


def is_handle(r, g, b):
    return is_near((r, g, b), HANDLE, 3)


def is_arrow_button(r, g, b):
    return 25 < r < 60 and 60 < g < 100 and 105 < b < 165


def blocks(picture, is_it, shortest, longest, left=0.6):
    """Returns the centres of the blocks of one colour, from top to bottom. A block has a width in this range and a
    height of at least ten pixels. Text may divide it into parts of different widths, which count as one block."""
    width_at = {x: length for x, _, length in picture.runs(is_it, left=left) if shortest <= length <= longest}
    found = []
    for x, width in width_at.items():
        if x - 1 in width_at:
            continue
        first = None
        for y in range(picture.height + 1):
            if y < picture.height and is_it(*picture.at(x + 1, y)):
                first = y if first is None else first
            elif first is not None:
                if y - first >= 10:
                    found.append((x + width / 2, (first + y) / 2))
                first = None
    distinct = []
    for x, y in sorted(found, key=lambda place: place[1]):
        if not any(abs(x - other[0]) < shortest and abs(y - other[1]) < 10 for other in distinct):
            distinct.append((x, y))
    return distinct


class UseTest(WindowTest):
    width, height = 800, 700
    #: Parts of the panels by their number (WindowSwitches::is_open). A small window is drawn fast. The curves and the
    # view's switches are closed to leave space for the rest.
    parts = {2: False, 4: False, 7: True}

    def setUp(self):
        super().setUp()
        memory = os.path.join(self.display.folder.name, "tandem")
        os.makedirs(memory)
        with open(os.path.join(memory, "window.json"), "w") as file:
            json.dump({f"part_{part}_is_open": is_open for part, is_open in self.parts.items()}, file)

    def click(self, x, y):
        self.display.do("mousemove", int(x), int(y))
        time.sleep(0.5)
        self.display.do("mousedown", 1)
        time.sleep(0.8)
        self.display.do("mouseup", 1)
        time.sleep(1.2)

    def double_click(self, x, y):
        self.display.do("mousemove", int(x), int(y))
        time.sleep(0.5)
        self.display.do("click", "--repeat", 2, "--delay", 20, 1)
        time.sleep(1)

    def point_away(self):
        """Moves the mouse away, because a control changes its colour while the mouse is over it."""
        self.display.do("mousemove", self.width // 4, self.height - 60)
        time.sleep(1)

    def sliders(self):
        """Returns the positions of the sliders for delay, jitter and loss."""
        self.point_away()
        return blocks(self.display.picture(), is_handle, 6, 16)

    def choices(self):
        """Returns the buttons of the combo boxes, from top to bottom."""
        self.point_away()
        return blocks(self.display.picture(), is_arrow_button, 14, 26, left=0.84)

    def choose(self, choice, entry):
        """Selects an entry of a combo box. `choice` (the combo box) and `entry` are counted from 0."""
        x, y = self.choices()[choice]
        self.click(x, y)
        self.click(x - 60, y + 10 + RIM + ROW * (entry + 0.5))

    def join(self, server, *arguments):
        client = self.start(server, "--name", "anna", "--json", *arguments)
        self.wait_for_window()
        server.wait_for_log("anna.*joined|joined.*anna")
        time.sleep(1.5)
        return client


class ClickThrough(UseTest):
    def test_joins_grabs_lifts_changes_delay_and_stage_and_quits(self):
        with Server("--scene", "two_boxes") as server:
            client = self.join(server)
            self.drag(0, 105)
            self.display.do("key", "space")
            time.sleep(2)
            self.drag(0, -140)
            handles = self.sliders()
            self.assertEqual(len(handles), 3, f"delay, jitter, loss: {handles}")
            x, y = handles[0]
            self.display.do("mousemove", int(x), int(y))
            time.sleep(0.5)
            self.display.do("mousedown", 1)
            time.sleep(0.5)
            self.display.do("mousemove", int(x + 30), int(y))
            time.sleep(0.7)
            self.display.do("mouseup", 1)
            time.sleep(2)
            self.choose(0, 1)
            time.sleep(2)
            self.display.do("key", "ctrl+q")
            code, out, err = finish(client)
        self.assertEqual(code, 0, err)
        report = json.loads(out)
        self.assertGreater(report["watched_body"]["displacement_m"], 0.03, "the box is lifted")
        self.assertGreater(report["round_trip_ms"]["newest"], 20, "the delay has changed")
        self.assertIn("stage late-pose", err)
        self.assertEqual(report["stage"], "late-pose")

    def test_goes_to_another_room_and_back_in_the_same_window(self):
        with Server("--scene", "two_boxes", "--scene", "free") as server:
            client = self.join(server, "--room", "two_boxes")
            deadline = time.monotonic() + PATIENCE_S
            while not (boxes := self.display.picture().count(is_yellow)) and time.monotonic() < deadline:
                time.sleep(1)
            self.choose(0, 1)
            server.wait_for_log("anna.*joined room free")
            time.sleep(2)
            self.assertLess(self.display.picture().count(is_yellow), boxes / 4, "there are no boxes")
            self.choose(0, 0)
            time.sleep(2)
            self.display.do("key", "ctrl+q")
            code, out, err = finish(client)
        self.assertEqual(code, 0, err)
        self.assertEqual(json.loads(out)["room"], "two_boxes")

    def test_an_operator_puts_everything_back(self):
        with Server("--scene", "two_boxes") as server:
            client = self.join(server, "--role", "operator")
            self.drag(0, 105)
            self.display.do("key", "space")
            time.sleep(2)
            self.drag(0, -140)
            buttons = blocks(self.display.picture(), is_arrow_button, 60, 200)
            self.assertTrue(buttons, "a button to reset the room")
            self.click(*buttons[0])
            server.wait_for_log("anna.* reset room two_boxes")
            self.display.do("key", "ctrl+q")
            code, _, err = finish(client)
        self.assertEqual(code, 0, err)
        self.assertIn("reset the room", err)


class Recordings(UseTest):
    def press_record(self):
        """Presses the button that starts a recording: the only wide button in the window of a user without operator
        rights."""
        self.point_away()
        self.click(*blocks(self.display.picture(), is_arrow_button, 60, 200)[0])

    def test_a_button_ends_the_recording_of_the_command_line_and_begins_another(self):
        with Server("--scene", "free") as server:
            client = self.join(server, "--record", self.path("first.mcap"))
            self.press_record()
            self.press_record()
            time.sleep(2)
            self.press_record()
            time.sleep(1)
            self.display.do("key", "ctrl+q")
            code, out, err = finish(client)
        self.assertEqual(code, 0, err)
        second, = (name for name in os.listdir(self.folder) if name.startswith("tandem-"))
        self.assertRegex(err, rf"recording .*{second}")
        self.assertRegex(err, rf"recorded .*{second}: [0-9]+ s, [0-9.]+ MB\n")
        report = json.loads(out)
        self.assertEqual(report["recording"]["file"], self.path(second))
        self.assertEqual([one["file"] for one in report["earlier_recordings"]], [self.path("first.mcap")])
        last_at = 0
        for name, one in (("first.mcap", report["earlier_recordings"][0]), (second, report["recording"])):
            recording = mcap_reader.Recording(self.path(name))
            self.assertTrue(recording.is_whole, name)
            self.assertEqual(one["lost"], 0)
            ticks = recording.of("/tick")
            self.assertGreater(len(ticks), 500, name)
            self.assertGreater(ticks[0][0], last_at, "one after the other")
            last_at = ticks[-1][0]
            self.assertEqual(len(recording.of("/session")), 1)
            self.assertGreaterEqual(len(recording.of("/link")), 1)

    def test_what_cannot_be_recorded_is_said_and_the_session_goes_on(self):
        os.mkdir(self.path("gone"))
        with Server("--scene", "free") as server:
            client = self.join(server, "--record", self.path("gone/first.mcap"))
            shutil.rmtree(self.path("gone"))
            self.press_record()
            self.press_record()
            time.sleep(1)
            self.display.do("key", "ctrl+q")
            code, out, err = finish(client)
        self.assertEqual(code, 0, err)
        self.assertRegex(err, r"gone/tandem-\S+ cannot be written: No such file")
        self.assertEqual(json.loads(out)["recording"]["file"], self.path("gone/first.mcap"))


class Hand(UseTest):
    parts = {0: False, 1: False, 2: False, 3: False, 4: False, 6: True, 7: True}

    def ways(self, since, until):
        """Returns the distances that the device and the tool in the world moved, along x and y."""
        with open(self.path("trace.csv")) as file:
            rows = [row for row in csv.DictReader(file) if since < float(row["t_s"]) < until and row["handle_p_x_m"]]
        self.assertGreater(len(rows), 500)
        return [max(float(row[name]) for row in rows) - min(float(row[name]) for row in rows)
                for name in ("device_p_x_m", "handle_p_x_m", "handle_p_y_m")]

    def test_reach_and_turn_are_changed_while_the_hand_moves(self):
        with open(self.path("sway.json"), "w") as file:
            json.dump({"points": [{"t_s": 0, "position_m": [0, 0, 0]}, {"t_s": 120, "phase": "hold"}],
                       "multisine": {"from_s": 0.5, "to_s": 119, "components": [
                           {"axis": [1, 0, 0], "frequency_hz": 1, "amplitude_m": 0.02}]}}, file)
        with Server("--scene", "free") as server:
            client = self.join(server, "--hand", self.path("sway.json"), "--trace", self.path("trace.csv"))
            begun = time.monotonic()
            time.sleep(3)
            _delay, (reach_x, reach_y), (turn_x, turn_y) = self.sliders()
            self.click(reach_x + 40, reach_y)
            self.click(turn_x + 35, turn_y)
            changed = time.monotonic()
            time.sleep(4)
            self.display.do("key", "ctrl+q")
            code, _, err = finish(client)
        self.assertEqual(code, 0, err)
        device, along_x, along_y = self.ways(0.5, 3)
        self.assertGreater(device, 0.02)
        self.assertAlmostEqual(along_x / device, 1, delta=0.01)
        self.assertLess(along_y, 0.002)
        since = changed - begun + 2.5  # margin, because the user joins before the test finds the controls
        device, along_x, along_y = self.ways(since, since + 2)
        self.assertGreater(math.hypot(along_x, along_y) / device, 1.5, "the reach")
        self.assertGreater(along_y / along_x, 0.5, "the turn")


class WindowManager(UseTest):
    programs = (*UseTest.programs, "openbox")
    width, height, window = 1180, 1000, "700x500"

    def setUp(self):
        super().setUp()
        manager = subprocess.Popen(["openbox", "--sm-disable"], env=self.display.environment(), stdout=subprocess.DEVNULL,
                                   stderr=subprocess.DEVNULL)
        self.addCleanup(manager.wait, PATIENCE_S)
        self.addCleanup(manager.terminate)
        time.sleep(1)

    def test_resizes_and_closes_the_window(self):
        with Server("--scene", "two_boxes") as server:
            client = self.start(server, "--name", "anna", "--json")
            self.wait_for_window()
            server.wait_for_log("anna.*joined|joined.*anna")
            time.sleep(2)
            small = self.display.picture().count(is_yellow)
            window = ["search", "--onlyvisible", "--name", "^tandem:"]
            self.display.do(*window, "windowsize", "1100", "800")
            time.sleep(3)
            large = self.display.picture().count(is_yellow)
            self.display.do(*window, "windowminimize")
            time.sleep(1)
            self.display.do(*["search", "--name", "^tandem:"], "windowmap", "windowactivate")
            time.sleep(2)
            self.display.do("key", "alt+F4")
            code, out, err = finish(client)
        self.assertEqual(code, 0, err)
        self.assertGreater(large, 1.5 * small, "the scene grows with its window")
        self.assertEqual(json.loads(out)["stage"], "local-model")


class FineScreen(UseTest):
    programs = (*UseTest.programs, "xrdb")
    width, height, window = 1440, 1100, "700x540"

    def handle_sizes(self, server, name):
        client = self.start(server, "--name", name)
        self.wait_for_window()
        server.wait_for_log(f"{name}.*joined|joined.*{name}")
        deadline = time.monotonic() + PATIENCE_S
        sizes = []
        while not sizes and time.monotonic() < deadline:
            time.sleep(1)
            sizes = [length for _, _, length in self.display.picture().runs(is_handle) if length > 5]
        self.display.do("key", "ctrl+q")
        self.assertEqual(finish(client)[0], 0)
        return sizes

    def test_letters_and_sliders_are_twice_as_many_pixels_at_twice_the_resolution(self):
        with Server("--scene", "free") as server:
            usual = self.handle_sizes(server, "anna")
            subprocess.run(["xrdb", "-merge"], input="Xft.dpi: 192\n", text=True, env=self.display.environment(), check=True)
            fine = self.handle_sizes(server, "ben")
        self.assertGreater(max(fine), 1.7 * max(usual))


if __name__ == "__main__":
    unittest.main()
