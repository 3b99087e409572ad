"""Tests a server with the default security: it has a key, admits users by tokens, and encrypts its traffic."""

import json
import os
import re
import select
import socket
import struct
import subprocess
import threading
import time
import unittest

from support import PATIENCE_S, ProgramTest, finish, free_port, program, run
from wire import PROTOCOL_VERSION, frame, part, receive_exactly, tls, token_bytes, whole

import needs  # from tests/support; support.py adds this folder to the path

HELLO, JOIN, GRAB = 2, 3, 4
JOINED, ERROR, GOODBYE = 3, 10, 11
OBSERVER = 2
SCENE = {"name": "still",
         "bodies": [{"name": "floor", "shapes": [{"box": {"size_m": [0.1, 0.1, 0.1]}}], "placement": {"position_m": [0, 0, -1]}}],
         "tools": [{"name": "a", "placement": {"position_m": [0.3141592653589793, 0.1, 0.2]}},
                                    {"name": "b", "placement": {"position_m": [0, 0.5, 0]}}],
         "coupling": {"law": "spring-damper", "stiffness_n_per_m": 200, "damping_n_s_per_m": 2}}
# Upper four bytes of this coordinate as a double. They determine the number to one part in a million, so that the test
# recognises it in captured datagrams.
POSE = struct.pack("<d", 0.3141592653589793)[4:]


class SecureServer:
    """A tandem-server with default options. `report` is valid only after the server has ended."""

    def __init__(self, folder, *arguments, bind="127.0.0.1", port=0, scene="two_boxes"):
        self.state = os.path.join(folder, "state")
        self.process = subprocess.Popen(
            [program("tandem-server"), "--scene", scene, "--bind", bind, "--port", str(port), "--state", self.state, "--json",
             *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.log, self.invitations, self.report = [], [], None
        for line in self.process.stderr:
            self.log.append(line)
            ready = re.search(r"listening on [^ ]*:(\d+), key ([\w-]+)", line)
            if ready:
                self.port, self.key = int(ready.group(1)), ready.group(2)
                break
        else:
            raise RuntimeError("the server did not start: " + "".join(self.log))
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        for line in self.process.stderr:
            self.log.append(line)

    def wait_for(self, pattern):
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            for line in list(self.log):
                found = re.search(pattern, line)
                if found:
                    return found
            time.sleep(0.01)
        raise AssertionError(f"nothing in the log is like {pattern!r}: {self.log}")

    def invitation(self, *arguments, address="127.0.0.1", port=None):
        code, out, err = run("tandem-token", "--state", self.state, "--server", f"{address}:{port or self.port}", *arguments)
        assert code == 0, err
        return out.split("--join ")[1].strip()

    def token(self, *arguments):
        return self.invitation(*arguments).split("/")[2]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait(PATIENCE_S)
        self._reader.join(PATIENCE_S)
        self.report = json.loads(self.process.stdout.read())
        self.process.stdout.close()
        self.process.stderr.close()


def start_client(*arguments):
    return subprocess.Popen([program("tandem-client"), "--headless", "--device", "sim", "--json", *arguments],
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


class SecureTest(ProgramTest):
    def assert_refused(self, words, *arguments):
        self.assert_setup_error(finish(start_client("--duration", "1s", *arguments)), *words)

    def assert_joined(self, client, states=100):
        code, out, err = finish(client)
        self.assertEqual(code, 0, err)
        report = json.loads(out)
        self.assertGreater(report["datagrams"]["received"], states)
        return report


class Invitations(SecureTest):
    def test_let_two_people_in_at_any_address(self):
        with SecureServer(self.folder, "--invite", "2", bind="0.0.0.0") as server:
            server.wait_for("invitation.*\n?")
            while sum("invitation" in line for line in server.log) < 2:
                time.sleep(0.01)
            codes = [re.search(r"--join (\S+)", line).group(1) for line in server.log if "invitation" in line]
            clients = [start_client("--join", code, "--name", name, "--duration", "2s") for code, name in zip(codes, "ab")]
            for client in clients:
                self.assert_joined(client)
        self.assertEqual(server.report["joins"], 2)
        self.assertEqual(server.report["refusals"], {})

    def test_let_in_both_devices_of_a_person_and_they_come_back(self):
        with SecureServer(self.folder, scene="peg_in_hole") as server:
            client = start_client("--join", server.invitation("--name", "ada"), "--hand", "peg-left", "--second-device",
                                  "sim", "--second-hand", "peg-right", "--duration", "8s")
            server.wait_for(r"ada\W+joined room")
            server.wait_for(r"ada \(2\)\W+joined room")
            report = self.assert_joined(client)
        self.assertEqual(report["second"]["status"]["state"], report["status"]["state"])
        self.assertGreater(report["second"]["datagrams"]["received"], 100)
        self.assertEqual((server.report["joins"], server.report["refusals"]), (2, {}))

    def test_are_read_from_stdin_too(self):
        with SecureServer(self.folder) as server:
            client = subprocess.Popen([program("tandem-client"), "--headless", "--device", "sim", "--json", "--join", "-",
                                       "--duration", "1s"], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                      stderr=subprocess.PIPE, text=True)
            out, err = client.communicate(server.invitation() + "\n", timeout=PATIENCE_S)
        self.assertEqual(client.returncode, 0, err)

    def test_each_that_should_not_let_in_does_not_and_says_why(self):
        with SecureServer(self.folder) as server:
            used = server.invitation()
            self.assert_joined(start_client("--join", used, "--duration", "1s"))
            self.assert_refused(["used before"], "--join", used)
            old = server.invitation("--valid", "200ms")
            time.sleep(0.3)
            self.assert_refused(["expired"], "--join", old)
            self.assert_refused(["another room"], "--join", server.invitation("--room", "attic"), "--room", "two_boxes")
            self.assert_refused(["role"], "--join", server.invitation("--role", "observer"), "--role", "manipulator")
            place, key, token = server.invitation().split("/")
            middle = len(token) // 2
            other = "B" if token[middle] == "A" else "A"
            tampered = token[:middle] + other + token[middle + 1:]
            self.assert_refused([], "--join", "/".join((place, key, tampered)))
            wrong_key = ("B" if key[0] == "A" else "A") + key[1:]
            self.assert_refused(["key is not the one"], "--join", "/".join((place, wrong_key, token)))
            self.assert_refused(["join token"], "--pin", key, "--server", place)
            self.assert_joined(start_client("--pin", key, "--server", place, "--token", token, "--duration", "1s"))
            self.assert_refused(["was lost"], "--insecure", "--server", place)
        refusals = server.report["refusals"]
        self.assertEqual(refusals["ERROR_TOKEN_USED"], 1)
        self.assertEqual(refusals["ERROR_TOKEN_EXPIRED"], 1)
        self.assertEqual(refusals["ERROR_NOT_ALLOWED"], 2)
        self.assertGreaterEqual(server.report["failed_handshakes"], 2, "the wrong key, and what was no TLS")

    def test_let_in_after_a_restart_and_once_over_all_of_them(self):
        with SecureServer(self.folder, "--invite", "1", "--valid", "30d") as server:
            prepared = server.wait_for(r"invitation \(.*--join (\S+)").group(1)
            until = server.wait_for(r"until (\d{4}-\d\d-\d\d) ").group(1)
            port = server.port
        days = (time.mktime(time.strptime(until, "%Y-%m-%d")) - time.time()) / 86400
        self.assertTrue(28 < days < 31, until)
        with SecureServer(self.folder, port=port):
            self.assert_joined(start_client("--join", prepared, "--duration", "1s"))
            self.assert_refused(["used before"], "--join", prepared)
        with SecureServer(self.folder, port=port):
            self.assert_refused(["used before"], "--join", prepared)

    def test_that_are_prepared_before_the_first_start_let_in(self):
        port, state = free_port(), self.path("state")
        code, out, err = run("tandem-token", "--state", state, "--server", f"127.0.0.1:{port}", "--valid", "7d")
        self.assertEqual(code, 0, err)
        with SecureServer(self.folder, port=port):
            self.assert_joined(start_client("--join", out.split("--join ")[1].strip(), "--duration", "1s"))

    def test_from_before_the_list_was_removed_are_refused(self):
        with SecureServer(self.folder) as server:
            used, port = server.invitation(), server.port
            self.assert_joined(start_client("--join", used, "--duration", "1s"))
        os.remove(os.path.join(server.state, "invitations.pb"))
        with SecureServer(self.folder, port=port):
            self.assert_refused(["older than the server's list of used invitations"], "--join", used)

    def test_let_nobody_in_while_their_use_cannot_be_written(self):
        with SecureServer(self.folder) as server:
            invitation, aside = server.invitation(), self.path("aside")
            os.rename(server.state, aside)  # even root, who may write everywhere, cannot use a file as a folder
            with open(server.state, "w") as file:
                file.write("in the way")
            self.assert_refused(["cannot write down", "Not a directory"], "--join", invitation)
            server.wait_for("invitations.pb cannot be written: Not a directory; no invitation is accepted")
            os.remove(server.state)
            os.rename(aside, server.state)
            self.assert_joined(start_client("--join", invitation, "--duration", "1s"))
            server.wait_for("is written again")

    def test_of_a_damaged_list_stop_the_start(self):
        with SecureServer(self.folder) as server:
            port = server.port
        with open(os.path.join(server.state, "invitations.pb"), "r+b") as file:
            file.write(b"damage")
        result = run("tandem-server", "--scene", "free", "--port", str(port), "--state", server.state)
        self.assert_setup_error(result, "invitations.pb is damaged", "remove it")

    def test_for_this_machine_alone_are_said_to_be(self):
        for bind, is_warned in (("127.0.0.1", True), ("0.0.0.0", False)):
            with SecureServer(self.folder, "--invite", bind=bind) as server:
                server.wait_for("invitation")
                server.wait_for("invitation.*--join")
                if is_warned:
                    server.wait_for("on this machine alone.*--bind 0.0.0.0")
            self.assertEqual(any("on this machine alone" in line for line in server.log), is_warned, bind)

    def test_of_impossible_length_are_refused_with_the_limit(self):
        for program_name, arguments in (("tandem-token", ()), ("tandem-server", ("--scene", "free", "--port", "0", "--invite"))):
            for valid, words in (("31d", ["--valid", "31d", "30 days", "30d or less"]), ("0s", ["--valid", "0s"]),
                                 ("-1h", ["--valid"]), ("10", ["--valid", "10min"]), ("soon", ["--valid", "soon"])):
                with self.subTest(program=program_name, valid=valid):
                    code, _, err = run(program_name, "--state", self.path("state"), *arguments, "--valid", valid)
                    self.assertEqual((code, len(err.splitlines())), (2, 1), err)
                    for word in words:
                        self.assertIn(word, err)

    def test_of_a_service_let_in_where_the_server_knows_its_key(self):
        _, public, _ = run("tandem-token", "--new-key", self.path("service.pem"))
        with SecureServer(self.folder, "--issuer", public.strip()) as server:
            _, token, _ = run("tandem-token", "--issuer-key", self.path("service.pem"), "--server-key", server.key)
            self.assert_joined(start_client("--pin", server.key, "--server", f"127.0.0.1:{server.port}", "--token",
                                            token.strip(), "--duration", "1s"))
        with SecureServer(self.folder) as server:
            _, token, _ = run("tandem-token", "--issuer-key", self.path("service.pem"), "--server-key", server.key)
            self.assert_refused(["not valid"], "--pin", server.key, "--server", f"127.0.0.1:{server.port}", "--token",
                                token.strip())


class Certificates(SecureTest):
    def make(self, name):
        code, _, err = run("tandem-server", "--dev-certs", self.path(name))
        self.assertEqual(code, 0, err)
        return self.path(name)

    def test_of_a_private_authority_are_made_in_one_command_and_vouch_for_their_server_only(self):
        ours, others = self.make("ours"), self.make("others")
        files = ("--cert", ours + "/server.pem", "--key", ours + "/server-key.pem")
        with SecureServer(self.folder, *files) as server:
            token = server.token(*files)
            there = ("--server", f"127.0.0.1:{server.port}", "--token", token)
            self.assert_refused(["not vouched for"], "--ca", others + "/ca.pem", *there)
            self.assert_joined(start_client("--ca", ours + "/ca.pem", "--duration", "1s", *there))

    def test_another_program_sees_tls_1_3_alone_without_tickets(self):
        needs.programs("openssl")

        def s_client(port, *arguments):
            done = subprocess.run(["openssl", "s_client", "-connect", f"127.0.0.1:{port}", *arguments], input="",
                                  capture_output=True, text=True, timeout=PATIENCE_S)
            return done.stdout + done.stderr

        with SecureServer(self.folder) as server:
            seen = s_client(server.port, "-alpn", "tandem/2")
            self.assertIn("New, TLSv1.3", seen)
            self.assertNotIn("Session-ID-ctx", re.sub(r"Session-ID-ctx: *\n", "", seen))
            self.assertNotIn("TLS session ticket", seen)
            for old in ("-tls1_2", "-tls1_1"):
                self.assertIn("New, (NONE)", s_client(server.port, old, "-alpn", "tandem/2"), old)
            self.assertIn("alert", s_client(server.port, "-alpn", "http/1.1"))


class TlsPeer:
    """A peer that uses Python's ssl and can send any message."""

    def __init__(self, port):
        self.stream = tls(socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S))

    def say(self, number, body):
        self.stream.sendall(frame(whole(1, 1) + part(number, body)))

    def hear(self):
        """Returns the number of the next message, and its content."""
        (size,) = struct.unpack(">I", receive_exactly(self.stream, 4))
        data = receive_exactly(self.stream, size)
        at = 0
        while data[at] & 7 == 0:  # skips the request number
            at += 2
        return data[at] >> 3, data

    def join(self, ticket):
        """Joins with `ticket`, which contains the fields of JoinRoom except the name."""
        self.say(HELLO, whole(1, PROTOCOL_VERSION) + part(3, b"state-tcp"))
        self.hear()
        self.say(JOIN, part(2, b"eve") + ticket)
        return self.hear()


class Misbehaviour(SecureTest):
    def raw_token(self, server, *arguments):
        """Returns the encoded field JoinRoom.token."""
        return part(6, token_bytes(server.token(*arguments)))

    def test_an_observer_cannot_grab(self):
        with SecureServer(self.folder) as server:
            peer = TlsPeer(server.port)
            self.addCleanup(peer.stream.close)
            self.assertEqual(peer.join(self.raw_token(server, "--role", "observer"))[0], JOINED)
            peer.say(GRAB, whole(1, 1))
            number, body = peer.hear()
            while number not in (ERROR, GOODBYE):
                number, body = peer.hear()
            self.assertEqual(number, ERROR)
            self.assertIn(b"an observer cannot grab", body)

    def test_a_stolen_credential_is_worth_nothing_without_its_key(self):
        with SecureServer(self.folder) as server:
            victim, thief = TlsPeer(server.port), TlsPeer(server.port)
            for peer in (victim, thief):
                self.addCleanup(peer.stream.close)
            number, joined = victim.join(self.raw_token(server) + part(7, bytes(range(32))))
            self.assertEqual(number, JOINED)
            at = joined.rindex(part(9, b"")[:1] + b"\x10") + 2
            resume = part(1, joined[at:at + 16]) + part(2, bytes(64))
            number, answer = thief.join(part(8, resume))
            self.assertEqual(number, ERROR)
            self.assertIn(b"cannot be resumed", answer)
        self.assertEqual(server.report["refusals"], {"ERROR_BAD_CREDENTIAL": 1})

    def test_who_talks_too_long_or_too_slowly_is_ended_and_nobody_else(self):
        with SecureServer(self.folder) as server:
            client = start_client("--join", server.invitation(), "--duration", "5s")
            server.wait_for("joined room")
            peer = TlsPeer(server.port)
            self.addCleanup(peer.stream.close)
            peer.stream.sendall(struct.pack(">I", 5000))
            self.assertEqual(peer.hear()[0], GOODBYE)
            server.wait_for("control message was too long")
            slow = socket.create_connection(("127.0.0.1", server.port), timeout=PATIENCE_S)
            self.addCleanup(slow.close)
            begin = time.monotonic()
            try:
                for byte in b"\x16\x03\x01\x02\x00\x01" + bytes(100):  # a ClientHello that is never completed
                    slow.sendall(bytes([byte]))
                    if select.select([slow], [], [], 0.1)[0] and slow.recv(1000) == b"":
                        break
            except (BrokenPipeError, ConnectionResetError):
                pass
            self.assertLess(time.monotonic() - begin, 6)
            server.wait_for("sent no hello within 2000 ms")
            self.assert_joined(client, 1000)


class Meddler(threading.Thread):
    """A proxy between a client and its server. It forwards TCP unchanged, and calls `mischief(self, datagram)` for each
    datagram to the server. It listens on another address, at the server's port or at `mapped_to`."""

    def __init__(self, port, mischief, mapped_to=None):
        super().__init__(daemon=True)
        self.mischief, self.is_over = mischief, False
        here = mapped_to or port
        self.listener = socket.create_server(("127.0.0.2", here))
        self.client_side = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.client_side.bind(("127.0.0.2", here))
        self.server_side, self.elsewhere = (self.socket_to(port) for _ in range(2))
        self.port, self.client = port, None
        self.counts = {"up": 0, "elsewhere_up": 0, "elsewhere_down": 0}
        self.kept = None
        self.start()

    @staticmethod
    def socket_to(port):
        one = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        one.connect(("127.0.0.1", port))
        return one

    def send(self, datagram):
        self.server_side.send(datagram)

    def send_from_elsewhere(self, datagram):
        self.counts["elsewhere_up"] += len(datagram)
        self.elsewhere.send(datagram)

    def run(self):
        streams = {}
        while not self.is_over:
            readable = select.select([self.listener, self.client_side, self.server_side, self.elsewhere, *streams], [], [], 0.1)[0]
            for one in readable:
                if one is self.listener:
                    accepted, _ = self.listener.accept()
                    beyond = socket.create_connection(("127.0.0.1", self.port))
                    streams[accepted], streams[beyond] = beyond, accepted
                elif one is self.client_side:
                    datagram, self.client = self.client_side.recvfrom(2048)
                    self.counts["up"] += 1
                    self.mischief(self, datagram)
                elif one is self.server_side:
                    self.client_side.sendto(self.server_side.recv(2048), self.client)
                elif one is self.elsewhere:
                    self.counts["elsewhere_down"] += len(self.elsewhere.recv(2048))
                elif one in streams:
                    data = one.recv(65536)
                    if data:
                        streams[one].sendall(data)
                    else:
                        other = streams.pop(one)
                        streams.pop(other, None)
                        one.close()
                        other.close()

    def stop(self):
        self.is_over = True
        self.join(PATIENCE_S)
        for one in (self.listener, self.client_side, self.server_side, self.elsewhere):
            one.close()


class Datagrams(SecureTest):
    def meddle(self, mischief, duration="3s"):
        """Runs a session through the proxy. Returns the reports of server and client, and the counters of the proxy."""
        with SecureServer(self.folder) as server:
            meddler = Meddler(server.port, mischief)
            client = start_client("--join", server.invitation(address="127.0.0.2"), "--duration", duration)
            report = self.assert_joined(client, 1000)
            meddler.stop()
        return server.report, report, meddler.counts

    def test_that_were_replayed_reordered_cut_changed_or_forged_have_their_counters_and_do_no_harm(self):
        def mischief(meddler, datagram):
            number = meddler.counts["up"]
            if number % 7 == 1:  # this datagram is held back and sent after the next one
                meddler.kept = datagram
                return
            meddler.send(datagram)
            if meddler.kept:
                meddler.send(meddler.kept)
                meddler.kept = None
            flipped = bytearray(datagram)
            flipped[33 + number % (len(datagram) - 33)] ^= 1 << number % 8
            flipped[16] ^= 0x40  # gives an unused sequence number
            epoch, stranger = bytearray(flipped), bytearray(flipped)
            epoch[0] ^= 5
            stranger[4] ^= 1
            meddler.send([datagram, datagram[:20], datagram[:-1], bytes(flipped), bytes(epoch), bytes(stranger)][number % 6])

        server, client, counts = self.meddle(mischief)
        drops = server["datagrams"]["received_drops"]
        for reason in ("duplicate", "late", "too_short", "tag", "unknown_connection"):
            self.assertGreater(drops.get(reason, 0), 20, f"{reason}: {drops}")
        self.assertEqual(drops.get("malformed", 0), 0, "nothing that was changed is ever read")
        self.assertEqual(server["joins"], 1)
        self.assertGreater(client["datagrams"]["received"], 2000)

    def test_whose_source_is_forged_send_nobody_more_than_three_times_what_came(self):
        def mischief(meddler, datagram):
            # For one second, each datagram arrives from a new address. The server already knows the client's own
            # address.
            if 1000 < meddler.counts["up"] < 2000:
                meddler.send_from_elsewhere(datagram)
            else:
                meddler.send(datagram)

        server, client, counts = self.meddle(mischief, "4s")
        self.assertGreater(counts["elsewhere_up"], 10_000)
        self.assertGreater(counts["elsewhere_down"], 0, "it was asked")
        self.assertLessEqual(counts["elsewhere_down"], 3 * counts["elsewhere_up"])
        self.assertGreater(client["datagrams"]["received"], 3000, "state went on to the client meanwhile")
        self.assertEqual(server["joins"], 1)

    def test_go_to_the_port_that_the_client_knows_where_it_is_mapped_to_another(self):
        with SecureServer(self.folder) as server:
            mapped_to = free_port()
            meddler = Meddler(server.port, Meddler.send, mapped_to)
            client = start_client("--join", server.invitation(address="127.0.0.2", port=mapped_to), "--duration", "1s")
            self.assert_joined(client, 300)
            meddler.stop()
        self.assertGreater(meddler.counts["up"], 300)

    def test_of_a_stranger_are_answered_by_silence(self):
        with SecureServer(self.folder) as server, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
            stranger.connect(("127.0.0.1", server.port))
            for datagram in (b"", b"x", bytes(33), bytes([PROTOCOL_VERSION << 5]) + bytes(7) + b"\x01" + bytes(7) + b"\x01" + bytes(100)):
                stranger.send(datagram)
            stranger.settimeout(0.5)
            with self.assertRaises(TimeoutError):
                stranger.recv(2048)
        self.assertEqual(server.report["datagrams"]["received_drops"]["unknown_connection"], 1)


class Link(SecureTest):
    """A session through the simulated link of tandem-lab, which runs as a program between client and server."""

    def start_link(self, port, *arguments):
        link = subprocess.Popen([program("tandem-lab"), "link", "--port", str(port), *arguments], stdin=subprocess.PIPE,
                                stdout=subprocess.PIPE, text=True)
        self.addCleanup(lambda: (link.kill(), link.communicate()))
        self.assertIn("tandem-lab link", link.stdout.readline())
        return link

    def say(self, link, word):
        link.stdin.write(word + "\n")
        link.stdin.flush()
        self.assertEqual(link.stdout.readline().strip(), word)

    def capture(self, is_insecure):
        scene, file = self.write("still.json", json.dumps(SCENE)), self.path("capture")
        hidden = ["--insecure"] if is_insecure else []
        port = free_port()
        server = subprocess.Popen([program("tandem-server"), "--scene", scene, "--port", str(port), "--state",
                                   self.path("state"), *hidden], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.assertIn("listening", server.stdout.readline())
        self.addCleanup(lambda: (server.kill(), server.communicate()))
        link = self.start_link(port, "--capture", file)
        how = ["--insecure", "--server", f"127.0.0.2:{port}"]
        if not is_insecure:
            _, out, _ = run("tandem-token", "--state", self.path("state"), "--server", f"127.0.0.2:{port}")
            how = ["--join", out.split("--join ")[1].strip()]
        self.assert_joined(start_client("--duration", "1s", "--name", "whoever-it-is", *how))
        link.terminate()
        link.wait(PATIENCE_S)
        with open(file, "rb") as captured:
            return captured.read()

    def test_who_listens_reads_the_pose_without_encryption_and_nothing_with_it(self):
        for is_insecure in (True, False):
            with self.subTest(is_insecure=is_insecure):
                captured = self.capture(is_insecure)
                self.assertGreater(len(captured), 100_000)
                self.assertEqual(captured.count(POSE) > 100, is_insecure, captured.count(POSE))
                self.assertLess(captured.count(POSE), 10**9 if is_insecure else 2)
                self.assertEqual(b"whoever-it-is" in captured, is_insecure)

    def test_a_user_whose_datagrams_come_from_a_new_port_stays(self):
        with SecureServer(self.folder) as server:
            link = self.start_link(server.port, "--delay", "10ms")
            client = start_client("--join", server.invitation(address="127.0.0.2"), "--duration", "4s")
            server.wait_for("joined room")
            for _ in range(3):
                time.sleep(1)
                self.say(link, "move")
            report = self.assert_joined(client, 3000)
        self.assertEqual(server.report["joins"], 1)
        self.assertEqual(report["silences"], [], "a round trip is no silence")

    def test_a_cut_cable_is_a_session_that_is_resumed(self):
        with SecureServer(self.folder) as server:
            link = self.start_link(server.port, "--delay", "10ms")
            client = start_client("--join", server.invitation(address="127.0.0.2"), "--name", "ada", "--duration", "9s")
            server.wait_for("joined room")
            time.sleep(1)
            self.say(link, "cut")
            time.sleep(3)
            self.say(link, "restore")
            self.assert_joined(client, 2000)
        self.assertEqual(server.report["joins"], 2)
        self.assertEqual(server.report["refusals"], {})
        self.assertEqual(sum('"ada" joined' in line for line in server.log), 2)


if __name__ == "__main__":
    unittest.main()
