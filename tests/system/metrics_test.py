"""Tests an operator's HTTP queries to a running server. Invalid requests must not affect the server."""

import http.client
import json
import re
import signal
import socket
import time
import unittest

import prometheus
from support import PATIENCE_S, ProgramTest, Server, finish, free_port, run, start_client

MAX_CONNECTIONS = 16  # value of kMaxHttpConnections
WITHIN_S = 2.0        # value of kHttpWithin


class Watched(Server):
    """A server with --metrics, and functions that query its metrics port."""

    def __init__(self, *arguments):
        super().__init__("--metrics", "0", *arguments)
        self.wait_for_log("metrics at http")
        line = next(line for _, line in self.log if "metrics at http" in line)
        self.metrics_port = int(re.search(r"127\.0\.0\.1:(\d+)/metrics", line).group(1))

    def get(self, path):
        """Sends a GET request to the metrics port. Returns (status, headers, body)."""
        connection = http.client.HTTPConnection("127.0.0.1", self.metrics_port, timeout=PATIENCE_S)
        connection.request("GET", path)
        answer = connection.getresponse()
        body = answer.read().decode()
        connection.close()
        return answer.status, dict(answer.getheaders()), body

    def metrics(self):
        status, headers, body = self.get("/metrics")
        assert status == 200 and headers["Content-Type"].startswith("text/plain; version=0.0.4"), headers
        return prometheus.parse(body)

    def wait_for_metric(self, wanted, name, **labels):
        """Waits until this metric is at least `wanted`. Returns the metric families."""
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            families = self.metrics()
            if prometheus.value(families, name, **labels) >= wanted:
                return families
            time.sleep(0.05)
        raise AssertionError(f"{name}{labels} stays below {wanted}")

    def exchange(self, data):
        """Sends data. Returns all bytes received before the connection ends."""
        with socket.create_connection(("127.0.0.1", self.metrics_port), PATIENCE_S) as peer:
            peer.sendall(data)
            answer = b""
            try:
                while True:
                    part = peer.recv(65536)
                    if not part:
                        return answer
                    answer += part
            except ConnectionResetError:
                return answer


class Metrics(ProgramTest):
    def test_two_clients_are_seen_and_counters_never_fall(self):
        with Watched("--scene", "two_boxes", "--room", "a \"room\"") as server:
            before = server.metrics()
            clients = [start_client(server.port, "--name", name, "--hand", "press-down", "--duration", "4s", "--json")
                       for name in ("anna", "ben")]
            server.wait_for_metric(2, "tandem_users", room='a \\"room\\"', role="manipulator")
            newest = prometheus.counts(before)
            for _ in range(15):
                families = server.metrics()
                now = prometheus.counts(families)
                self.assertEqual(now.keys(), newest.keys(), "no label comes with users or time")
                for key, value in now.items():
                    self.assertGreaterEqual(value, newest[key], key)
                newest = now
                time.sleep(0.1)
            room = {"room": 'a \\"room\\"'}
            for name, labels in (("tandem_room_steps_total", room), ("tandem_datagrams_sent_total", {}),
                                 ("tandem_datagrams_received_total", {"result": "accepted"}),
                                 ("tandem_room_step_seconds_count", room), ("tandem_room_lateness_seconds_count", room),
                                 ("tandem_round_trip_seconds_count", {}), ("process_cpu_seconds_total", {}),
                                 ("process_resident_memory_bytes", {}), ("process_open_fds", {})):
                self.assertGreater(prometheus.value(families, name, **labels), 0, name)
            self.assertEqual(prometheus.value(families, "tandem_room_awake", **room), 1)
            self.assertEqual(prometheus.value(families, "tandem_ready"), 1)
            self.assertNotIn("anna", str(families), "no names of users")
            summaries = [json.loads(finish(client)[1]) for client in clients]
            after = server.wait_for_metric(2, "tandem_disconnects_total", reason="left")
        self.assertGreaterEqual(prometheus.value(after, "tandem_datagrams_sent_total"),
                                sum(one["datagrams"]["received"] for one in summaries))
        self.assertEqual(prometheus.value(after, "tandem_users", role="manipulator", **room), 0)
        self.assertEqual(prometheus.value(after, "tandem_joins_total"), 2)

    def test_what_is_refused_or_dropped_is_counted_by_its_reason(self):
        with Watched("--scene", "wall") as server:
            finish(start_client(server.port, "--room", "nowhere", "--duration", "1s"))
            stranger = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            stranger.sendto(b"x", ("127.0.0.1", server.port))
            stranger.close()
            server.wait_for_metric(1, "tandem_refusals_total", reason="unknown_room")
            server.wait_for_metric(1, "tandem_datagrams_received_total", result="too_short")

    def test_recordings_and_checkpoints_are_counted(self):
        with Watched("--scene", "wall", "--record", self.path("rec"), "--resume", "--state", self.path("state")) as server:
            client = start_client(server.port, "--duration", "3s")
            families = server.wait_for_metric(1, "tandem_checkpoint_writes_total")
            self.assertEqual(prometheus.value(families, "tandem_checkpoint_failures_total"), 0)
            self.assertEqual(prometheus.value(families, "tandem_recording_steps_lost_total", room="wall"), 0)
            server.wait_for_metric(1, "tandem_recording_bytes_total", room="wall")
            finish(client)

    def test_health_and_readiness_follow_the_server_to_its_end(self):
        with Watched("--scene", "wall") as server:
            self.assertEqual(server.get("/healthz")[0], 200)
            server.wait_for_metric(1, "tandem_ready")
            self.assertEqual(server.get("/readyz")[0], 200)
            # A peer that does not read its goodbye message delays the end of the server by 1 s, long enough for a
            # query.
            with socket.create_connection(("127.0.0.1", server.port)):
                server.process.send_signal(signal.SIGTERM)
                server.wait_for_log("stopping on a signal")
                status, _, reason = server.get("/readyz")
                self.assertEqual((status, reason), (503, "the server is stopping\n"))
                self.assertEqual(server.get("/healthz")[0], 200, "it still steps")
            self.assertEqual(server.process.wait(PATIENCE_S), 0)


class HostilePeers(ProgramTest):
    def test_what_is_no_request_is_refused_and_others_are_answered(self):
        long_head = b"GET /metrics HTTP/1.1\r\n" + b"x: " + b"y" * 8000 + b"\r\n\r\n"
        with Watched("--scene", "wall") as server:
            for data, status in ((b"\x00\xff" * 100 + b"\r\n\r\n", 400), (b"\x16\x03\x01\x02\x00\x01\x00\r\n\r\n", 400),
                                 (long_head, 400), (b"GET /metrics\r\n\r\n", 400),
                                 (b"GET /metrics HTTP/1.1\r\nContent-Length: 1000000\r\n\r\n", 400),
                                 (b"GET /metrics HTTP/1.1\r\nContent-Length: -1\r\n\r\n", 400),
                                 (b"POST /metrics HTTP/1.1\r\n\r\n", 405), (b"DELETE /healthz HTTP/1.1\r\n\r\n", 405),
                                 (b"GET / HTTP/1.1\r\n\r\n", 404), (b"GET /../etc/passwd HTTP/1.1\r\n\r\n", 404),
                                 (b"GET /metrics/ HTTP/1.1\r\n\r\n", 404), (b"GET /healthz?verbose HTTP/1.0\r\n\r\n", 200)):
                with self.subTest(data=data[:40]):
                    self.assertTrue(server.exchange(data).startswith(b"HTTP/1.1 %d " % status), data[:40])
                    self.assertEqual(server.get("/healthz")[0], 200)

    def test_who_says_half_a_request_is_ended(self):
        with Watched("--scene", "wall") as server:
            begin = time.monotonic()
            with socket.create_connection(("127.0.0.1", server.metrics_port), PATIENCE_S) as slow:
                slow.settimeout(0.1)
                is_open, sent = True, 0
                while is_open and time.monotonic() < begin + PATIENCE_S:
                    try:
                        slow.sendall(b"G" if sent == 0 else b"E")  # the first line of the request is never complete
                        sent += 1
                        is_open = slow.recv(1) != b""
                    except TimeoutError:
                        pass
                    except (BrokenPipeError, ConnectionResetError):
                        is_open = False
            self.assertFalse(is_open, "it was let be")
            self.assertGreater(time.monotonic() - begin, WITHIN_S / 2, "it had no time to ask")
            self.assertEqual(server.get("/metrics")[0], 200)

    def test_a_hundred_connections_hold_up_nobody(self):
        with Watched("--scene", "wall") as server:
            client = start_client(server.port, "--hand", "press-down", "--duration", "3s", "--json")
            server.wait_for_log("joined")
            held = [socket.create_connection(("127.0.0.1", server.metrics_port), PATIENCE_S) for _ in range(100)]
            for peer in held:
                peer.sendall(b"GET /metrics HTTP/1.1\r\n")
            self.assertEqual(server.get("/healthz")[0], 200)
            families = server.metrics()
            self.assertLess(prometheus.value(families, "process_open_fds"), 100, "few of them are kept")
            code, out, err = finish(client)
            self.assertEqual(code, 0, err)
            for peer in held:
                peer.close()
        self.assertEqual(json.loads(out)["room"], "wall")

    def test_who_does_not_read_his_answer_is_ended(self):
        with Watched("--scene", "wall") as server:
            peers = []
            for _ in range(MAX_CONNECTIONS):
                peer = socket.socket()
                peer.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1)
                peer.connect(("127.0.0.1", server.metrics_port))
                peer.sendall(b"GET /metrics HTTP/1.1\r\n\r\n")
                peers.append(peer)
            self.assertEqual(server.get("/healthz")[0], 200)
            for peer in peers:
                peer.close()


class Setup(ProgramTest):
    def test_addresses_of_others_are_refused(self):
        for address in ("0.0.0.0:9464", "192.0.2.7:9464", "[::]:9464"):
            with self.subTest(address=address):
                self.assert_setup_error(run("tandem-server", "--insecure", "--port", "0", "--scene", "wall", "--metrics", address),
                                        "--metrics", address, "use 127.0.0.1:9464")

    def test_what_is_no_port_is_refused(self):
        for address in ("70000", "metrics", "127.0.0.1", "example.org:9464"):
            with self.subTest(address=address):
                self.assert_setup_error(run("tandem-server", "--insecure", "--port", "0", "--scene", "wall", "--metrics", address),
                                        "--metrics", address, "numeric address")

    def test_a_port_in_use_is_named(self):
        with socket.socket() as holder:
            holder.bind(("127.0.0.1", 0))
            holder.listen()
            address = f"127.0.0.1:{holder.getsockname()[1]}"
            self.assert_setup_error(run("tandem-server", "--insecure", "--port", "0", "--scene", "wall", "--metrics", address),
                                    address, "in use", "--metrics")


if __name__ == "__main__":
    unittest.main()
