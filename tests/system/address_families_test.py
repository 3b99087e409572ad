"""Tests servers that have only IPv6 addresses, and servers with addresses of both families, one of which does not work.
Server and client are in separate network namespaces, which are connected by one virtual cable for each family.
"""

import json
import os
import re
import subprocess
import sys
import time
import unittest

from support import PATIENCE_S, ProgramTest, finish, program

import needs  # from tests/support; support.py adds this folder to the path

INSIDE = "TANDEM_TEST_INSIDE"
PORT = 47800
SIX, FOUR = "fd77::1", "10.77.9.1"  # addresses of the server
NOBODY = "fd77::dead"  # an address to which packets are lost
UNSHARE = ["unshare", "-Urnm"]


def is_permitted():
    try:
        probe = "ip link add tandem0 type veth peer name tandem1 && mount --bind /etc/hosts /etc/hosts"
        return subprocess.run([*UNSHARE, "sh", "-c", probe], capture_output=True).returncode == 0
    except FileNotFoundError:
        return False


def ip(*arguments):
    subprocess.run(["ip", *arguments], check=True)


class TwoCables(ProgramTest):
    """The client is in this network namespace, and the server in a second one. Cable six0 connects them for IPv6, cable
    four0 for IPv4."""

    def setUp(self):
        super().setUp()
        needs.skip_unless_of_machine(self, INSIDE in os.environ, "the right to networks of one's own (unshare -Urnm, ip link)")
        self.has_names = False
        self.keeper = subprocess.Popen(["unshare", "-n", "sleep", "600"])
        self.addCleanup(lambda: (self.keeper.kill(), self.keeper.wait()))
        while os.readlink(f"/proc/{self.keeper.pid}/ns/net") == os.readlink("/proc/self/ns/net"):
            time.sleep(0.01)
        ip("link", "set", "lo", "up")

    def cable(self, name, here, there):
        ip("link", "add", f"{name}0", "type", "veth", "peer", "name", f"{name}1", "netns", str(self.keeper.pid))
        self.addCleanup(lambda: subprocess.run(["ip", "link", "del", f"{name}0"], capture_output=True))
        no_wait = ["nodad"] if ":" in here else []
        ip("addr", "add", here, "dev", f"{name}0", *no_wait)
        ip("link", "set", f"{name}0", "up")
        self.there("ip", "addr", "add", there, "dev", f"{name}1", *no_wait)
        self.there("ip", "link", "set", f"{name}1", "up")

    def cable_of_six(self):
        self.cable("six", "fd77::2/64", f"{SIX}/64")
        # Without this entry, a packet to the address would be answered as unreachable. With it, the packet is lost.
        ip("-6", "neigh", "add", NOBODY, "lladdr", "02:00:00:00:00:01", "dev", "six0", "nud", "permanent")

    def cable_of_four(self):
        self.cable("four", "10.77.9.2/24", f"{FOUR}/24")

    def command_there(self, *arguments):
        return ["nsenter", "--target", str(self.keeper.pid), "--net", *arguments]

    def there(self, *arguments):
        subprocess.run(self.command_there(*arguments), check=True)

    def name(self, *addresses):
        """Makes rig.example resolve to these addresses, in the mount namespace of this test."""
        hosts = self.path("hosts")
        with open(hosts, "w") as file:
            file.writelines(f"{address} rig.example\n" for address in addresses)
            file.write("127.0.0.1 localhost\n::1 localhost\n")
        if not self.has_names:
            subprocess.run(["mount", "--bind", hosts, "/etc/hosts"], check=True)
        self.has_names = True

    def tearDown(self):
        if self.has_names:
            subprocess.run(["umount", "/etc/hosts"], check=True)
        super().tearDown()

    def start_server(self, bind, *arguments):
        self.log_file = open(self.path("server.log"), "w+")
        self.addCleanup(self.log_file.close)
        server = subprocess.Popen(
            self.command_there(program("tandem-server"), "--scene", "wall", "--bind", bind, "--port", str(PORT), "--state",
                               self.path("state"), "--invite", "4", *arguments), stdout=self.log_file, stderr=self.log_file)
        self.addCleanup(lambda: (server.kill(), server.wait()))
        self.wait_for_log("listening on")
        self.wait_for_log("--join", 4)
        return re.findall(r"--join (\S+)", self.server_log())

    def server_log(self):
        with open(self.path("server.log")) as file:
            return file.read()

    def wait_for_log(self, pattern, times=1):
        deadline = time.monotonic() + PATIENCE_S
        while len(re.findall(pattern, self.server_log())) < times:
            self.assertLess(time.monotonic(), deadline, f"{pattern}: {self.server_log()}")
            time.sleep(0.02)

    def start_client(self, invitation, duration="2s"):
        client = subprocess.Popen([program("tandem-client"), "--headless", "--device", "sim", "--json", "--duration", duration,
                                   "--join", invitation], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(lambda: (client.kill(), client.communicate()))
        return client

    def joins(self, invitation):
        code, out, err = finish(self.start_client(invitation))
        self.assertEqual(code, 0, err)
        self.assertGreater(json.loads(out)["datagrams"]["received"], 100, err)

    def test_a_host_with_ipv6_alone_invites_by_its_address_and_takes_a_zone(self):
        self.cable_of_six()
        first, second, *_ = self.start_server("::")
        self.assertIn("listening on [::]:47800", self.server_log())
        self.assertTrue(first.startswith(f"[{SIX}]:{PORT}/"), first)
        self.joins(first)
        link_local = subprocess.run(self.command_there("ip", "-6", "-o", "addr", "show", "dev", "six1", "scope", "link"),
                                    capture_output=True, text=True, check=True).stdout
        address = re.search(r"inet6 (\S+)/", link_local).group(1)
        self.joins(second.replace(f"[{SIX}]", f"[{address}%six0]"))
        code, _, err = finish(self.start_client(second.replace(f"[{SIX}]", f"[{address}]")))
        self.assertEqual(code, 2)
        self.assertIn("a link-local address needs an interface of this machine", err)

    def test_where_one_family_vanishes_the_other_one_is_used(self):
        self.cable_of_six()
        self.cable_of_four()
        self.name(NOBODY, FOUR)
        for invitation in self.start_server("::", "--address", "rig.example")[:2]:
            self.joins(invitation)

    def test_where_one_family_is_refused_the_other_one_is_used(self):
        self.cable_of_six()
        self.cable_of_four()
        self.name(SIX, FOUR)
        first, second, *_ = self.start_server("0.0.0.0", "--address", "rig.example")
        self.joins(first)
        self.name(NOBODY, "10.77.9.99")
        code, _, err = finish(self.start_client(second))
        self.assertEqual(code, 2, "neither family leads to a server")
        self.assertIn(f"{NOBODY}: no answer", err)
        self.assertIn("10.77.9.99: ", err)

    def test_who_loses_one_cable_comes_back_over_the_other_one(self):
        self.cable_of_six()
        self.cable_of_four()
        self.name(SIX, FOUR)
        client = self.start_client(self.start_server("::", "--address", "rig.example")[0], "12s")
        self.wait_for_log("joined room")
        time.sleep(1)
        ip("link", "set", "six0", "down")
        self.wait_for_log("joined room", 2)
        time.sleep(1)
        ip("link", "set", "four0", "down")
        ip("link", "set", "six0", "up")
        # The kernel removed the address when the cable was disconnected.
        ip("addr", "add", "fd77::2/64", "dev", "six0", "nodad")
        self.wait_for_log("joined room", 3)
        code, out, err = finish(client)
        self.assertEqual(code, 0, err)
        report = json.loads(out)
        self.assertEqual(report["reconnects"], 2, err)
        self.assertTrue(report["all_forces_finite"])


if __name__ == "__main__":
    if not os.environ.get(INSIDE) and is_permitted():
        os.execvpe("unshare", [*UNSHARE, sys.executable, *sys.argv], {**os.environ, INSIDE: "1"})
    unittest.main()
