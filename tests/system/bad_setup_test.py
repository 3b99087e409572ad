"""Tests that every invalid set-up ends with exit code 2 and one clear line that names the error and the remedy."""

import json
import socket
import threading
import unittest

from support import ProgramTest, Server, finish, free_port, run, start_client
from wire import ERROR, HELLO, control, part, receive_frame, whole

ERROR_WRONG_VERSION = 1

BOX = {"name": "box", "mass_kg": 0.1, "shapes": [{"box": {"size_m": [0.02, 0.02, 0.02]}}]}


class ServerSetup(ProgramTest):
    def start_with(self, scene):
        return run("tandem-server", "--port", "0", "--scene", self.write("bad.json", json.dumps(scene)))

    def test_a_scene_that_does_not_exist(self):
        self.assert_setup_error(run("tandem-server", "--port", "0", "--scene", "no_such_scene"), "no_such_scene")

    def test_a_scene_that_is_not_json(self):
        path = self.write("broken.json", '{"name": "x", ')
        self.assert_setup_error(run("tandem-server", "--port", "0", "--scene", path), "broken.json")

    def test_a_field_that_no_scene_has(self):
        self.assert_setup_error(self.start_with({"name": "x", "gravitas": 3}), "bad.json", "gravitas")

    def test_a_negative_mass(self):
        scene = {"name": "x", "bodies": [dict(BOX, mass_kg=-1)], "tools": [{"name": "a"}]}
        self.assert_setup_error(self.start_with(scene), "bad.json", "bodies[0].mass_kg", "-1")

    def test_a_missing_mesh(self):
        mesh = {"name": "m", "shapes": [{"mesh": {"file": "/nowhere/bunny.obj"}}]}
        self.assert_setup_error(self.start_with({"name": "x", "bodies": [mesh], "tools": [{"name": "a"}]}),
                                "bodies[0].shapes[0].mesh.file", "/nowhere/bunny.obj")

    def start_with_molecules(self, limits):
        """Starts a server with two molecules of 4,000 atoms each. A step evaluates 16 million pairs, which takes some
        milliseconds on any core."""
        names = ("N", "CA", "C", "O", "CB")
        lines = ["ATOM  %5d  %-3s ALA A%4d    %8.3f%8.3f%8.3f  1.00  0.00           %s" %
                 (i + 1, names[i % 5], i // 5 + 1, 1.5 * (i % 16), 1.5 * (i // 16 % 16), 1.5 * (i // 256), names[i % 5][0])
                 for i in range(4000)]
        shape = {"molecule": {"file": self.write("large.pdb", "\n".join(lines) + "\nEND\n"), "hydrogens": "given"}}
        bodies = [{"name": name, "shapes": [shape], "mass_kg": 0.2, "placement": {"position_m": [x, 0, 0]}}
                  for name, x in (("a", -0.5), ("b", 0.5))]
        return self.start_with({"name": "large", "bodies": bodies, "tools": [{"name": "t"}], "limits": limits})

    def test_more_pairs_of_atoms_than_a_step_may_have(self):
        self.assert_setup_error(self.start_with_molecules({}), "limits.atom_pairs", "1.6e+07", "chains")

    def test_a_scene_that_this_machine_cannot_step_in_time(self):
        code, out, err = self.start_with_molecules({"atom_pairs": 20_000_000})
        # The computation of the force scale for 16 million pairs may take longer than 2 s. In that case progress lines
        # precede the error.
        lines = err.splitlines()
        progress = [line for line in lines if line.startswith("finding the scale of the forces between 4000 and 4000 atoms: ")]
        self.assertTrue(progress and progress[-1].endswith("100 %"), err)
        rest = "\n".join(line for line in lines if line not in progress)
        self.assert_setup_error((code, out, rest), "large", "on this machine", "of the 1 ms")

    def test_a_port_in_use(self):
        with socket.socket() as holder:
            holder.bind(("127.0.0.1", 0))
            holder.listen()
            port = str(holder.getsockname()[1])
            self.assert_setup_error(run("tandem-server", "--port", port, "--scene", "two_boxes"), port, "in use")

    def test_an_address_that_is_not_loopback_without_encryption(self):
        result = run("tandem-server", "--insecure", "--port", "0", "--bind", "0.0.0.0", "--scene", "two_boxes")
        self.assert_setup_error(result, "0.0.0.0", "loopback", "--insecure")

    def test_keys_that_are_none(self):
        self.assert_setup_error(run("tandem-server", "--scene", "two_boxes", "--key", self.write("k.pem", "none")), "--cert")
        self.assert_setup_error(run("tandem-server", "--scene", "two_boxes", "--cert", "/nowhere/c.pem", "--key",
                                    self.write("k.pem", "none")), "k.pem", "private key")
        self.assert_setup_error(run("tandem-server", "--scene", "two_boxes", "--issuer", "none"), "--issuer", "none")
        self.assert_setup_error(run("tandem-server", "--scene", "two_boxes", "--insecure", "--invite", "1"), "--invite")


class ClientSetup(ProgramTest):
    def test_no_server_there(self):
        port = free_port()
        self.assert_setup_error(finish(start_client(port, "--duration", "1s")), str(port), "refused")

    def test_an_address_that_is_not_loopback(self):
        # The client must refuse before it sends a packet. The address (TEST-NET-1) has no route.
        result = run("tandem-client", "--headless", "--insecure", "--server", "192.0.2.1:47800", "--duration", "1s")
        self.assert_setup_error(result, "192.0.2.1", "loopback")

    def test_a_server_that_nothing_vouches_for(self):
        self.assert_setup_error(run("tandem-client", "--headless", "--duration", "1s"), "--join", "--insecure")
        self.assert_setup_error(run("tandem-client", "--headless", "--join", "127.0.0.1:1/x/y"), "--join")
        self.assert_setup_error(run("tandem-client", "--headless", "--pin", "x"), "--pin")
        self.assert_setup_error(run("tandem-client", "--headless", "--insecure", "--ca", "a.pem"), "only one")

    def test_an_unknown_room(self):
        with Server("--scene", "two_boxes") as server:
            result = finish(start_client(server.port, "--room", "attic", "--duration", "1s"))
            self.assert_setup_error(result, "attic", "two_boxes")

    def test_a_full_room(self):
        with Server("--scene", "two_boxes") as server:
            first = [start_client(server.port, "--duration", "20s", "--name", name) for name in ("a", "b")]
            server.wait_for_log("joined.*\n?", 0.0)
            server.wait_for_log(r"\bb\b.*joined|joined.*\bb\b")
            result = finish(start_client(server.port, "--duration", "1s", "--name", "c"))
            for process in first:
                process.kill()
                process.communicate()
            self.assert_setup_error(result, "full")

    def test_options_that_make_no_sense(self):
        for arguments, word in [(["--stage", "telepathy"], "late-pose"), (["--delay", "25"], "ms"),
                                (["--loss", "120%"], "loss"), (["--hand", "no_such_hand"], "no_such_hand"),
                                (["--profile", "wand"], "sim"),
                                (["--device", "touch"], "--device sim --profile touch"),
                                (["--device", "inverse3", "--service", "192.0.2.1:1"], "this machine"),
                                (["--device", "falcon", "--firmware", "/nowhere/f.bin"], "/nowhere/f.bin")]:
            with self.subTest(arguments=arguments):
                self.assert_setup_error(run("tandem-client", "--headless", "--insecure", *arguments), word)

    def test_without_headless(self):
        self.assert_setup_error(run("tandem-client", "--insecure"), "--headless")


class WrongVersion(ProgramTest):
    def test_the_server_names_its_version_to_an_old_client(self):
        with Server("--scene", "two_boxes") as server, socket.create_connection(("127.0.0.1", server.port)) as peer:
            peer.settimeout(20)
            peer.sendall(control(HELLO, whole(1, 999), 1))
            answer = receive_frame(peer)
            error = part(ERROR, b"")[:1]  # first byte (tag) of the field ServerControl.error
            self.assertIn(error, answer)
            self.assertIn(whole(1, ERROR_WRONG_VERSION), answer)
            self.assertIn(b"999", answer)

    def test_the_client_ends_with_the_servers_words(self):
        listener = socket.create_server(("127.0.0.1", 0))

        def refuse():
            connection, _ = listener.accept()
            with connection:
                receive_frame(connection)
                text = b"this server speaks protocol version 999"
                connection.sendall(control(ERROR, whole(1, ERROR_WRONG_VERSION) + part(2, text), 1))
                connection.recv(1000)

        thread = threading.Thread(target=refuse)
        thread.start()
        result = finish(start_client(listener.getsockname()[1], "--duration", "2s"))
        thread.join()
        listener.close()
        self.assert_setup_error(result, "version 999")


if __name__ == "__main__":
    unittest.main()
