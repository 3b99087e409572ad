"""Tests pointing: the place to which a user points is sent to all users in the room, and displayed as a force to the
others."""

import math
import struct
import time
import unittest

from support import ProgramTest, Server, finish, read_trace, start_client

import wire  # from tests/attack; support.py adds this folder to the path


def point(place, body=0):
    packed = b"".join(struct.pack("<d", number) for number in place)
    return wire.whole(1, body) + wire.part(2, packed) + wire.part(3, packed)


class Pointing(ProgramTest):
    def say(self, client, message, *answers):
        client.stream.sendall(wire.control(wire.POINT, message, 7))
        while True:
            for number, value in wire.fields(client.receive()):
                if number in answers:
                    return dict(wire.fields(value))

    def test_the_others_are_nudged_towards_it_and_told(self):
        trace = self.path("trace.csv")
        with Server("--scene", "two_boxes") as server:
            partner = start_client(server.port, "--json", "--duration", "5s", "--hand", "rest", "--trace", trace)
            server.wait_for_log("user 1 .* joined")
            time.sleep(2)
            ada = wire.RawClient(server.port)
            ada.join("ada", wire.MANIPULATOR)
            answer = self.say(ada, point((0, 5, 0)), wire.POINTED)
            self.assertEqual(answer[1], 2, "the user who points")
            time.sleep(1.5)
            code, _, err = finish(partner)
            ada.close()
        self.assertEqual(code, 0, err)
        self.assertIn('ada points at a place', err)
        rows = read_trace(trace)
        away = [row["displayed_force_y_n"] for row in rows]
        self.assertGreater(max(away), 0.1)
        self.assertLess(max(math.hypot(*(row[f"displayed_force_{axis}_n"] for axis in "xyz")) for row in rows), 0.4)
        self.assertLess(max(abs(b - a) for a, b in zip(away, away[1:])), 0.05, "no step is felt")
        self.assertLess(abs(away[-1]), 0.05, "and it is over")

    def forces_while_others_point(self, *arguments):
        """Two users point as often as they can. Returns the forces that a third client displays in addition to those of
        the scene, by time, and its output lines."""
        trace = self.path("trace.csv")
        with Server("--scene", "two_boxes") as server:
            partner = start_client(server.port, "--json", "--duration", "5s", "--hand", "rest", "--trace",
                                   trace, *arguments)
            server.wait_for_log("user 1 .* joined")
            time.sleep(1.5)
            ada = wire.RawClient(server.port)
            ada.join("ada", wire.MANIPULATOR)
            for i in range(30):
                self.say(ada, point((0, 5, 0.1 * i)), wire.POINTED, wire.ERROR)
                time.sleep(0.1)
            code, _, err = finish(partner)
            ada.close()
        self.assertEqual(code, 0, err)
        return [(row["t_s"], row["displayed_force_y_n"]) for row in read_trace(trace)], err

    def test_who_is_pointed_at_things_again_and_again_is_nudged_once(self):
        forces, _ = self.forces_while_others_point()
        pushed = [at for at, force in forces if force > 0.1]
        self.assertTrue(pushed, "the first place is felt")
        self.assertLess(pushed[-1] - pushed[0], 0.8, "and none of those that follow within 5 s")

    def test_who_mutes_it_sees_the_place_and_feels_nothing(self):
        forces, err = self.forces_while_others_point("--nudge", "off")
        self.assertIn("ada points at a place", err)
        self.assertLess(max(abs(force) for _, force in forces), 0.05)

    def test_what_is_no_place_is_refused(self):
        with Server("--scene", "two_boxes") as server:
            ada = wire.RawClient(server.port)
            ada.join("ada", wire.MANIPULATOR)
            self.assertIn(b"three numbers", self.say(ada, point((1, 2)), wire.ERROR)[2])
            self.assertIn(b"three numbers", self.say(ada, point((1, 2, 1e9)), wire.ERROR)[2])
            self.assertIn(b"no body", self.say(ada, point((1, 2, 3), 99), wire.ERROR)[2])
            answers = [self.say(ada, point((1, 2, 3)), wire.POINTED, wire.ERROR).get(2) for _ in range(20)]
            refused = [text for text in answers if text and b"you point too often" in text]
            self.assertGreaterEqual(len(refused), 17, "one a second, two at once")
            ben = wire.RawClient(server.port)
            ben.join("ben", wire.MANIPULATOR)
            self.assertIn(1, self.say(ben, point((1, 2, 3)), wire.POINTED), "she does not use up what others may")
            otto = wire.RawClient(server.port)
            otto.join("otto", wire.OBSERVER)
            self.assertIn(b"observers do not point", self.say(otto, point((1, 2, 3)), wire.ERROR)[2])
            for client in (ada, ben, otto):
                client.close()


if __name__ == "__main__":
    unittest.main()
