"""Tests the start screen with mouse and keyboard. A user opens a scene and touches it, opens a mesh file, and hosts a
session; a second user joins the session by pasting an invitation. Buttons are found by their colour."""

import json
import os
import shutil
import signal
import subprocess
import time
import unittest
from unittest import mock

from support import BIN, PATIENCE_S, SOURCE, ProgramTest, finish, free_port, program
from window_support import Display, WindowTest, is_cream, is_orange, is_yellow
from window_use_test import blocks, is_arrow_button

import needs  # from tests/support; support.py adds this folder to the path

#: Distance from a button of the forms to the field on its left, in pixels.
TO_FIELD = 120
#: Time-out for opening a scene [s]. A mesh is first prepared for contact, which takes long on a busy machine.
OPENING_S = 3 * PATIENCE_S
CUBE = """OFF
8 12 0
0 0 0
1 0 0
1 1 0
0 1 0
0 0 1
1 0 1
1 1 1
0 1 1
3 0 2 1
3 0 3 2
3 4 5 6
3 4 6 7
3 0 1 5
3 0 5 4
3 1 2 6
3 1 6 5
3 2 3 7
3 2 7 6
3 3 0 4
3 3 4 7
"""


def children_of(process):
    """Returns (id, name) of the child processes of a process."""
    found = subprocess.run(["ps", "-o", "pid=,comm=", "--ppid", str(process)], capture_output=True, text=True).stdout
    return [(int(line.split()[0]), line.split()[1]) for line in found.splitlines()]


def is_running(process):
    state = subprocess.run(["ps", "-o", "stat=", "-p", str(process)], capture_output=True, text=True).stdout.strip()
    return bool(state) and not state.startswith("Z")


class StartTest(WindowTest):
    programs = (*WindowTest.programs, "xclip", "ps")
    width, height = 800, 620  # a small window is drawn faster

    def start_screen(self, *arguments, display=None, title="^tandem: start$"):
        """Starts the program without an address, and waits for the start screen, or another title."""
        display = display or self.display
        client = subprocess.Popen(
            [program("tandem-client"), "--window-size", f"{self.width}x{self.height}", *arguments],
            env=display.environment() | {"USER": "anna"}, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(client.communicate)
        self.addCleanup(client.kill)
        self.wait_for_title(title, display)
        time.sleep(2)
        return client

    def wait_for_title(self, title, display=None):
        if not self.has_title(title, display or self.display, OPENING_S):
            self.fail(f"no window with the title {title}")

    def has_title(self, title, display, patience_s):
        """Waits until the window has a title, and gives it the keyboard focus. Returns whether it succeeded."""
        deadline = time.monotonic() + patience_s
        while time.monotonic() < deadline:
            found = subprocess.run(["xdotool", "search", "--onlyvisible", "--name", title, "windowfocus"],
                                   env=display.environment(), capture_output=True, timeout=PATIENCE_S)
            if found.returncode == 0:
                return True
            time.sleep(0.1)
        return False

    def wait_for_picture(self, is_wanted, what, display=None):
        display = display or self.display
        deadline = time.monotonic() + OPENING_S
        while time.monotonic() < deadline:
            if is_wanted(display.picture()):
                return
            time.sleep(0.5)
        self.fail(f"the window does not show {what}")

    def click(self, x, y, display=None):
        display = display or self.display
        display.do("mousemove", int(x), int(y))
        time.sleep(0.5)
        display.do("mousedown", 1)
        time.sleep(0.4)
        display.do("mouseup", 1)
        time.sleep(0.8)

    def buttons(self, display=None):
        """Returns the positions of the buttons Join and Open."""
        display = display or self.display
        display.do("mousemove", self.width // 2, 62)
        time.sleep(0.7)
        found = blocks(display.picture(), is_arrow_button, 22, 60, left=0.9)
        self.assertGreaterEqual(len(found), 2, found)
        return found[:2]

    def press(self, keys, display=None):
        """Presses keys for longer than a frame, because Dear ImGui reads the state of each key only once per frame."""
        for what in ("keydown", "keyup"):
            (display or self.display).do(what, keys)
            time.sleep(0.5)

    def join_by_pasting(self, invitation, display):
        """Pastes an invitation and joins. A long key press pastes repeatedly, and a short one may fall between two
        frames of a busy machine. Therefore the field is replaced until the start screen accepts it."""
        subprocess.run(["xclip", "-selection", "clipboard"], env=display.environment(), input=invitation, text=True,
                       check=True, timeout=PATIENCE_S, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        (x, y), _ = self.buttons(display)
        for _ in range(10):
            self.click(x - TO_FIELD, y, display)
            self.press("ctrl+a", display)
            display.do("keydown", "ctrl+v", "sleep", 0.2, "keyup", "ctrl+v")
            time.sleep(0.5)
            self.press("Return", display)
            if self.has_title("^tandem: anna$", display, patience_s=10):
                return
        self.fail("the invitation is not accepted")

    def type(self, text, display=None):
        (display or self.display).do("type", "--delay", "25", text)
        time.sleep(1.5)  # a key that follows in the same frame would be handled before the last letters

    def open_first_scene(self):
        self.click(self.width // 8, 150)
        self.wait_for_title("^tandem: anna$")

    def server_of(self, client):
        return self.child_of(client, "tandem-server")

    def child_of(self, client, program):
        found = [process for process, name in children_of(client.pid) if name == program]
        self.assertEqual(len(found), 1, program)
        return found[0]

    def copied(self):
        """Waits until the program has copied a text. Returns the text."""
        text, deadline = "", time.monotonic() + PATIENCE_S
        while not text and time.monotonic() < deadline:
            text = subprocess.run(["xclip", "-o", "-selection", "clipboard"], env=self.display.environment(),
                                  capture_output=True, text=True, timeout=PATIENCE_S).stdout
            time.sleep(0.2)
        return text

    def quit(self, client):
        began = time.monotonic()
        self.display.do("key", "ctrl+q")
        code, out, err = finish(client)
        self.assertEqual(code, 0, out + err)
        return time.monotonic() - began


class Local(StartTest):
    def test_a_click_on_the_first_scene_leads_to_a_crate_that_is_lifted_with_the_partner(self):
        client = self.start_screen()
        self.open_first_scene()
        self.wait_for_picture(lambda picture: picture.count(is_orange) > 4000, "the crate")
        server = self.server_of(client)
        time.sleep(7)  # the partner begins 2 s after the user has joined, and lifts 3 s later
        self.drag(0, 50)
        time.sleep(2)
        self.display.do("key", "space")
        time.sleep(2)
        before = self.display.picture().middle(is_orange)
        self.drag(0, -120)
        self.wait_for_picture(lambda picture: picture.middle(is_orange)[1] < before[1] - 15, "the lifted crate")
        self.quit(client)
        self.assertFalse(is_running(server), "the server has ended with the window")
        with open(os.path.join(self.display.folder.name, "tandem", "recent.json")) as file:
            self.assertEqual([choice["scene"] for choice in json.load(file)], ["crate"])

    def test_a_typed_path_opens_a_mesh_and_letters_in_the_field_switch_nothing(self):
        path = self.write("xmgt.off", CUBE)
        client = self.start_screen()
        _, (x, y) = self.buttons()
        self.click(x - TO_FIELD, y)
        self.type(path)
        self.press("Return")
        self.wait_for_title("^tandem: anna$")
        self.wait_for_picture(lambda picture: picture.count(is_cream) > 4000, "the mesh")
        self.quit(client)
        with open(os.path.join(self.display.folder.name, "tandem", "window.json")) as file:
            remembered = json.load(file)
        self.assertEqual((remembered["cuts"], remembered["follows_tool"], remembered["shows_ghosts"]), (False, False, False))

    def test_the_menu_leads_back_to_the_start_screen_and_ends_the_server(self):
        client = self.start_screen()
        self.open_first_scene()
        self.wait_for_picture(lambda picture: picture.count(is_orange) > 4000, "the crate")
        server = self.server_of(client)
        self.click(30, 10)  # menu "Session"
        self.click(60, 36)  # entry "Open something else"
        self.wait_for_title("^tandem: start$")
        self.assertFalse(is_running(server))
        self.quit(client)

    def test_the_server_and_the_partner_end_when_the_program_is_killed(self):
        client = self.start_screen()
        self.open_first_scene()
        server, partner = self.server_of(client), self.child_of(client, "tandem-client")
        client.send_signal(signal.SIGKILL)
        client.wait(PATIENCE_S)
        deadline = time.monotonic() + PATIENCE_S
        while (is_running(server) or is_running(partner)) and time.monotonic() < deadline:
            time.sleep(0.1)
        self.assertFalse(is_running(server), "the server")
        self.assertFalse(is_running(partner), "the partner")


class Dropped(StartTest):
    def drop(self, path):
        """Drops a file onto the window, as a file manager does. Returns whether the window has taken it."""
        window = subprocess.run(["xdotool", "search", "--onlyvisible", "--name", "^tandem"], env=self.display.environment(),
                                capture_output=True, text=True, timeout=PATIENCE_S, check=True).stdout.split()[0]
        done = subprocess.run([program("drop_file"), window, path], env=self.display.environment(), capture_output=True,
                              text=True, timeout=OPENING_S)
        self.assertEqual(done.stderr, "")
        return done.returncode == 0

    def test_a_mesh_that_is_dropped_onto_the_window_is_opened_and_felt(self):
        path = self.write("ein W\u00fcrfel.off", CUBE)
        client = self.start_screen()
        self.assertTrue(self.drop(path))
        self.wait_for_title("^tandem: anna$")
        self.wait_for_picture(lambda picture: picture.count(is_cream) > 4000, "the mesh")
        without_force = self.display.picture().count(is_yellow)

        def is_pressed(picture):
            self.display.do("keydown", "Down", "sleep", 0.4, "keyup", "Down")
            return picture.count(is_yellow) > without_force + 100
        self.wait_for_picture(is_pressed, "the arrow of a force")
        self.quit(client)
        with open(os.path.join(self.display.folder.name, "tandem", "recent.json")) as file:
            self.assertEqual([choice["mesh"] for choice in json.load(file)], [path])

    def test_a_file_of_another_kind_is_refused_with_a_reason_and_the_window_stays(self):
        client = self.start_screen()
        before = self.display.picture().count(is_yellow_text)
        self.assertTrue(self.drop(self.write("notes.txt", "no mesh")))
        self.wait_for_picture(lambda picture: picture.count(is_yellow_text) > before + 100, "a line of warning")
        self.quit(client)


class Guided(StartTest):
    """The guided first minute. Its steps are read from the window's memory, which is written after each step."""

    def memory(self):
        try:
            with open(os.path.join(self.display.folder.name, "tandem", "window.json")) as file:
                return json.load(file)
        except (FileNotFoundError, json.JSONDecodeError):
            return {}

    #: Buttons of the card.
    SKIP, END = (45, StartTest.height - 27), (160, StartTest.height - 27)

    def wait_for(self, is_so, act=lambda: None):
        """Repeats an action until the window's memory satisfies a condition."""
        deadline = time.monotonic() + OPENING_S
        while time.monotonic() < deadline:
            if is_so(self.memory()):
                return
            act()
            time.sleep(0.5)
        self.fail(f"the guide has not gone on: {self.memory()}")

    def wait_for_step(self, step, act=lambda: None):
        self.wait_for(lambda memory: memory.get("guide_step") == step, act)

    def grab(self):
        """Presses the key, and waits longer than a grab takes on a busy machine: a second press would release."""
        self.display.do("key", "space")
        for _ in range(20):
            if self.memory().get("guide_step") != "grasp":
                return
            time.sleep(0.5)

    def hold(self, key, seconds):
        self.display.do("keydown", key, "sleep", seconds, "keyup", key)

    def test_a_missing_server_is_an_error_unless_it_is_awaited(self):
        alone = shutil.copy(program("tandem-client"), self.folder)
        profiles = os.path.join(SOURCE, "devices", "profiles.json")
        counts = []
        for options in (["--await-server"], []):
            client = subprocess.Popen([alone, "--window-size", f"{self.width}x{self.height}", "--guide", *options],
                                      env=self.display.environment() | {"USER": "anna", "TANDEM_DEVICE_PROFILES": profiles})
            self.addCleanup(client.wait)
            self.addCleanup(client.kill)
            self.wait_for_title("^tandem: start$")
            if options:
                time.sleep(3)
                counts.append(self.display.picture().count(is_yellow_text))
            else:
                self.wait_for_picture(lambda picture: picture.count(is_yellow_text) > counts[0] + 100, "the error")
            client.kill()
            client.wait()

    def test_leads_from_the_touch_to_the_lift_and_is_resumed_at_the_next_start(self):
        client = self.start_screen("--guide", title="^tandem: anna$")
        self.wait_for_step("touch")
        # Uses keys, because their effect does not depend on the position of the mouse.
        self.wait_for_step("grasp", lambda: self.hold("Down", 0.4))
        self.wait_for_step("lift", self.grab)
        self.wait_for_step("delay", lambda: self.hold("Up", 0.4))
        self.quit(client)
        self.assertEqual((self.memory()["guide_is_on"], self.memory()["guide_step"]), (True, "delay"))
        client = self.start_screen("--guide", title="^tandem: anna$")
        self.wait_for_picture(lambda picture: picture.count(is_orange) > 2000, "the crate")
        self.assertEqual(self.memory()["guide_step"], "delay")
        # Without a delay there is nothing to feel. Therefore the guide also leaves out the step about the delay.
        self.wait_for_step("hold", lambda: self.click(*self.SKIP))
        self.wait_for(lambda memory: not memory["guide_is_on"], lambda: self.click(*self.END))
        self.quit(client)


class Sounds(StartTest):
    """Sounds at contact. ALSA is configured to write them into a file instead of a sound card."""

    def setUp(self):
        super().setUp()
        needs.files("/usr/share/alsa/alsa.conf")
        self.samples = self.path("samples.raw")
        configuration = self.write("alsa.conf", f'pcm.default {{ type file file "{self.samples}" format raw slave.pcm {{ type null }} }}\n')
        self.enterContext(mock.patch.dict(os.environ, {"ALSA_CONFIG_PATH": configuration}))

    def is_heard(self):
        """Returns whether the file of the sound output contains anything but silence."""
        try:
            with open(self.samples, "rb") as file:
                return any(file.read())
        except FileNotFoundError:
            return False

    def memory(self):
        with open(os.path.join(self.display.folder.name, "tandem", "window.json")) as file:
            return json.load(file)

    def press_on_the_crate(self, *arguments):
        """Opens the crate with the guide, and moves the hand down until the guide has recognised the touch."""
        client = self.start_screen("--guide", *arguments, title="^tandem: anna$")
        deadline = time.monotonic() + OPENING_S
        while time.monotonic() < deadline:
            self.display.do("keydown", "Down", "sleep", 0.4, "keyup", "Down")
            try:
                if self.memory()["guide_step"] == "grasp":
                    return client
            except (FileNotFoundError, json.JSONDecodeError):
                pass
        self.fail("the crate is not touched")

    def test_a_contact_is_heard_unless_the_key_s_has_switched_sounds_off(self):
        client = self.press_on_the_crate()
        deadline = time.monotonic() + OPENING_S
        while not self.is_heard() and time.monotonic() < deadline:
            time.sleep(0.2)
        self.assertTrue(self.is_heard())
        self.display.do("key", "s")
        time.sleep(1)
        self.quit(client)
        memory = self.memory()
        self.assertFalse(memory["has_sound"], "stored for the next run")
        with open(os.path.join(self.display.folder.name, "tandem", "window.json"), "w") as file:
            json.dump(memory | {"guide_step": "touch"}, file)
        os.remove(self.samples)
        self.quit(self.press_on_the_crate())
        self.assertFalse(os.path.exists(self.samples))


class Hosting(StartTest):
    def test_one_user_hosts_and_copies_an_invitation_and_another_joins_by_pasting(self):
        port = free_port()
        guest_display = self.enterContext(Display(self.width, self.height))
        host = self.start_screen()
        (_, join), _ = self.buttons()
        left = self.width - 340
        self.click(left + 10, join + 50)  # option that others may join
        self.click(left + 20, join + 50 + 48)  # field of the port
        self.press("ctrl+a")
        self.type(str(port))
        self.press("Return")
        self.open_first_scene()
        self.wait_for_picture(lambda picture: picture.count(is_orange) > 2000, "the crate")
        time.sleep(1)
        copy = blocks(self.display.picture(), is_arrow_button, 25, 60, left=0)[0]
        self.click(*copy)
        invitation = self.copied()
        self.assertRegex(invitation, rf"^[0-9.]+:{port}/[\w-]+/[\w-]+$")
        # The guest is on this machine too, where each of its addresses reaches the server.
        guest = self.start_screen(display=guest_display)
        self.join_by_pasting(invitation, guest_display)
        self.wait_for_picture(lambda picture: picture.count(is_orange) > 2000, "the crate", guest_display)
        guest_display.do("key", "ctrl+q")
        code, out, err = finish(guest)
        self.assertEqual(code, 0, out + err)
        self.quit(host)

    def test_what_is_no_invitation_is_explained_on_the_start_screen(self):
        client = self.start_screen()
        before = self.display.picture().count(is_yellow_text)
        (x, y), _ = self.buttons()
        self.click(x - TO_FIELD, y)
        self.type("192.0.2.7:47800")
        self.press("Return")
        self.wait_for_picture(lambda picture: picture.count(is_yellow_text) > before + 100, "a line of warning")
        self.quit(client)


def is_yellow_text(r, g, b):
    return r > 190 and 130 < g < 200 and b < 100


class Demo(StartTest):
    def test_opens_the_start_screen(self):
        done = subprocess.run([os.path.join(SOURCE, "deploy/demo"), "--window", "--skip-build", "--programs", BIN, "--out",
                               self.folder, "--picture", self.path("demo.png")], env=self.display.environment(),
                              capture_output=True, text=True, timeout=3 * PATIENCE_S)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertTrue(os.path.getsize(self.path("demo.png")) > 10000)


class WithoutDisplay(ProgramTest):
    def environment(self):
        return {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}

    def test_the_program_says_so_before_anything_starts(self):
        done = subprocess.run([program("tandem-client")], env=self.environment(), capture_output=True, text=True,
                              timeout=PATIENCE_S)
        self.assert_setup_error((done.returncode, done.stdout, done.stderr), "no display", "--headless")

    def test_the_demo_says_so_before_it_builds(self):
        done = subprocess.run([os.path.join(SOURCE, "deploy/demo"), "--window", "--programs", "/nonexistent", "--out",
                               self.folder], env=self.environment(), capture_output=True, text=True, timeout=PATIENCE_S)
        self.assertEqual(done.stdout, "")
        self.assert_setup_error((done.returncode, done.stdout, done.stderr), "needs a display", "DISPLAY")


if __name__ == "__main__":
    unittest.main()
