"""Attackers of a server. `attackers.py NAME PORT SECONDS` attacks 127.0.0.1:PORT and prints {"sent": number of
messages, "ended": number of connections that the server ended}. Each attack is limited in time; run.py starts each in a
separate process.
"""
import json
import os
import select
import socket
import subprocess
import sys
import time

import wire
from wire import OBSERVER, OPERATOR, RawClient

FLOOD = os.path.join(os.environ.get("TANDEM_BIN", "build/release/bin"), "attack-flood")
AT_ONCE_BYTES = 1 << 18
NAME = "eve"


class Count:
    def __init__(self, seconds):
        self.sent = self.ended = 0
        self._end = time.monotonic() + seconds

    def is_running(self):
        return time.monotonic() < self._end


def flood_stream(client, message, count, keep_alive=False, reads=True):
    """Sends a message at the highest possible rate, until the server ends the connection or the time is over."""
    blob, pending = message * max(1, AT_ONCE_BYTES // len(message)), b""
    client.stream.setblocking(False)
    alive_at = 0.0
    while count.is_running():
        if keep_alive and time.monotonic() > alive_at:
            client.send_state()
            alive_at = time.monotonic() + 0.1
        readable, writable, _ = select.select([client.stream] if reads else [], [client.stream], [], 0.05)
        try:
            if readable and not client.stream.recv(1 << 20):
                raise ConnectionError("closed")
            if writable:
                pending = pending or blob
                size = client.stream.send(pending)
                count.sent += size / len(message)
                pending = pending[size:]
        except BlockingIOError:
            continue
        except OSError:
            count.ended += 1
            return


def join_and_flood(port, count, name, role, message_of, **how):
    """Floods a connection, and reconnects whenever the server ends it."""
    while count.is_running():
        try:
            client = RawClient(port)
            if role is not None:
                client.join(name, role)
            flood_stream(client, message_of(client), count, keep_alive=role is not None, **how)
            client.close()
        except OSError:
            count.ended += 1
            time.sleep(0.005)


def ping_flood(port, count):
    join_and_flood(port, count, NAME, OBSERVER, lambda _: wire.ping())


def ping_flood_before_joining(port, count):
    """Sends a hello and then pings, without joining."""
    while count.is_running():
        try:
            client = RawClient(port)
            client.stream.sendall(wire.hello())
            client.receive()
            flood_stream(client, wire.ping(), count)
            client.close()
        except OSError:
            count.ended += 1
            time.sleep(0.005)


def many_pings_at_the_limit(port, count):
    """Opens forty connections with 95 pings per second each. Each rate is below the limit of one connection, but the
    total is a flood."""
    clients = {}
    while count.is_running():
        begin = time.monotonic()
        for slot in range(40):
            try:
                if slot not in clients:
                    clients[slot] = RawClient(port, 1.0)
                    clients[slot].stream.sendall(wire.hello())
                    clients[slot].stream.setblocking(False)
                clients[slot].stream.send(wire.ping() * 9)
                count.sent += 9
                if not clients[slot].stream.recv(1 << 16):
                    raise ConnectionError
            except BlockingIOError:
                pass
            except OSError:
                count.ended += 1
                clients.pop(slot, None)
        time.sleep(max(0.0, begin + 0.095 - time.monotonic()))


def parameter_flood(port, count):
    message = wire.set_parameter("coupling.force_limit_n", 50.0)
    join_and_flood(port, count, NAME, OPERATOR, lambda _: message)


def _tell_a_slow_reader(port, count, message_of):
    """One client sends 90 broadcasts per second, and another client never reads. The server's memory must not grow, and
    the server must not disconnect the slow reader."""
    slow = RawClient(port)
    slow.stream.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    slow.join("slow", OBSERVER)
    setter = RawClient(port)
    setter.join(NAME, OPERATOR)
    while count.is_running():
        setter.stream.sendall(message_of(count.sent))
        setter.stream.recv(1 << 16)
        for client in (slow, setter):
            client.send_state()
        count.sent += 1
        time.sleep(1 / 90)


def parameters_to_a_slow_reader(port, count):
    _tell_a_slow_reader(port, count, lambda turn: wire.set_parameter("coupling.force_limit_n", 50.0 + turn % 2))


def resets_to_a_slow_reader(port, count):
    _tell_a_slow_reader(port, count, lambda _: wire.control(wire.RESET_ROOM))


def slow_reader(port, count):
    """Joins, requests assets and never reads."""
    join_and_flood(port, count, NAME, OBSERVER, lambda client: wire.get_asset(largest_asset(client)), reads=False)


def largest_asset(client):
    return max(client.assets, key=lambda asset: asset.get(2, 0))[1] if client.assets else b"?" * 32


def asset_flood(port, count):
    """Requests assets at the highest possible rate and reads them."""
    join_and_flood(port, count, NAME, OBSERVER, lambda client: wire.get_asset(largest_asset(client)))


def big_messages(port, count):
    """Sends hello messages with the maximum number of fields, which are slow to parse."""
    words = wire.part(3, b"") * ((1 << 18) // 2 - 32)
    join_and_flood(port, count, NAME, None, lambda _: wire.control(wire.HELLO, words))


def _stay(port, count, at_once, hello=b"", secure=False):
    """Connects repeatedly, sends `hello` and keeps the connections open, `at_once` at a time."""
    silent = []
    while count.is_running():
        try:
            client = RawClient(port, 1.0, secure)
            client.stream.sendall(hello)
            silent.append(client)
            count.sent += 1
        except OSError:
            count.ended += 1
        if len(silent) >= at_once:
            silent.pop(0).close()
        time.sleep(0.0005)
    for client in silent:
        client.close()


def half_open(port, count):
    """Connects without sending anything; 200 connections are open at a time."""
    _stay(port, count, 200)


def silent_64(port, count):
    """Keeps sixty-four silent connections open."""
    silent = [RawClient(port, 1.0) for _ in range(64)]
    count.sent += 64
    while count.is_running():
        for client in list(silent):
            readable, _, _ = select.select([client.stream], [], [], 0)
            if readable and not client.stream.recv(4096):
                count.ended += 1
                client.close()
                silent.remove(client)
                silent.append(RawClient(port, 1.0))
                count.sent += 1
        time.sleep(0.02)


def join_and_leave(port, count):
    while count.is_running():
        try:
            client = RawClient(port, 1.0)
            client.join(NAME, OBSERVER)
            client.stream.sendall(wire.control(wire.LEAVE))
            client.close()
            count.sent += 1
        except OSError:
            count.ended += 1


def state_over_tcp_flood(port, count):
    def message(client):
        return wire.frame(wire.part(wire.STATE_DATAGRAM, client.datagram()))
    while count.is_running():
        try:
            client = RawClient(port)
            client.join(NAME, OBSERVER, "state-tcp")
            flood_stream(client, message(client), count)
            client.close()
        except OSError:
            count.ended += 1


def datagrams(port, count, template, *options):
    seconds = max(0.5, count._end - time.monotonic())
    done = subprocess.run([FLOOD, str(port), f"{seconds:.2f}", "0", template.hex(), *options], capture_output=True, text=True,
                          check=True, timeout=90)
    count.sent += json.loads(done.stdout)["sent"]


def datagram_garbage(port, count):
    datagrams(port, count, bytes([0xFF]) * 140)


def datagram_unknown(port, count):
    datagrams(port, count, wire.header(wire.CLIENT_UPDATE, 0x1234567890ABCDEF, 0, 1) + wire.client_update(1, 1))


def datagram_of_a_user(port, count):
    """Sends a user's valid datagrams with increasing sequence numbers at the highest possible rate."""
    while count.is_running():
        client = RawClient(port)
        try:
            client.join(NAME, OBSERVER)
            client.send_state()
            datagrams(port, count, client.datagram(), "--count")
            client.stream.setblocking(False)
            while client.stream.recv(1 << 20):
                pass
            count.ended += 1
        except BlockingIOError:
            pass
        except OSError:
            count.ended += 1
        client.close()


def tls_handshakes(port, count):
    """Completes TLS handshakes and sends nothing more. A handshake is the most expensive operation that an
    unauthenticated peer can cause."""
    _stay(port, count, 16, secure=True)


def tls_half_hello(port, count):
    """Sends only the first half of a ClientHello; 200 connections are open at a time."""
    _stay(port, count, 200, hello=bytes.fromhex("1603010200010001fc0303") + bytes(100))


def tls_joins_by_guess(port, count):
    """Joins with random tokens, which have no valid signature."""
    while count.is_running():
        try:
            client = RawClient(port, 1.0, True)
            for _ in range(100):
                count.sent += 1
                client.join(NAME, OBSERVER, "state-tcp", os.urandom(180))
        except OSError:
            count.ended += 1


def datagram_sealed_by_nobody(port, count):
    """Sends random datagrams of the usual length, addressed to an unknown connection."""
    datagrams(port, count, wire.header(wire.CLIENT_UPDATE, 0x1234567890ABCDEF, 0, 1) + os.urandom(120))


# Attacks on a server with the default security. All other attacks are directed at a server with --insecure.
OF_SECURE_SERVERS = {function.__name__: function for function in (
    tls_handshakes, tls_half_hello, tls_joins_by_guess, datagram_sealed_by_nobody)}
ATTACKS = {function.__name__: function for function in (
    ping_flood_before_joining, ping_flood, many_pings_at_the_limit, parameter_flood, parameters_to_a_slow_reader,
    resets_to_a_slow_reader, slow_reader, asset_flood, big_messages, state_over_tcp_flood, join_and_leave, silent_64, half_open, datagram_garbage, datagram_unknown,
    datagram_of_a_user)} | OF_SECURE_SERVERS


def main():
    name, port, seconds = sys.argv[1], int(sys.argv[2]), float(sys.argv[3])
    count = Count(seconds)
    ATTACKS[name](port, count)
    print(json.dumps({"sent": int(count.sent), "ended": count.ended}))


if __name__ == "__main__":
    main()
