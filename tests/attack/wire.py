"""A minimal implementation of proto/WIRE.md for clients and servers that violate the protocol."""
import base64
import math
import socket
import ssl
import struct

PROTOCOL_VERSION = 3
HEADER_BYTES = 33
CLIENT_UPDATE, SERVER_UPDATE = 0, 1
MANIPULATOR, OBSERVER, OPERATOR = 1, 2, 3
# Field numbers of ClientControl and ServerControl (proto/tandem/control.proto).
HELLO, JOIN, GRAB, RELEASE, SET_PARAMETER, GET_ASSET, LEAVE, STATE_DATAGRAM, PING, KICK, RESET_ROOM, ASK_POSE, POINT = range(2, 15)
WELCOME, JOINED, GRABBED, RELEASED, USER_JOINED, USER_LEFT, ASSET_CHUNK, PARAMETER_SET, ERROR, GOODBYE, STATE = range(2, 13)
PONG = 13
KEPT_POSE, POSE_TAKEN, POINTED, POSE_DELETED, POSE_PROGRESS = 17, 18, 19, 20, 21


# Encoders of one Protobuf field each.
def varint(value):
    out = b""
    while value > 0x7F:
        out += bytes([value & 0x7F | 0x80])
        value >>= 7
    return out + bytes([value])


def whole(number, value):
    return varint(number << 3) + varint(value)


def double(number, value):
    return varint(number << 3 | 1) + struct.pack("<d", value)


def fixed64(number, value):
    return varint(number << 3 | 1) + struct.pack("<Q", value)


def part(number, data):
    """Encodes a field that contains a string, bytes or a message."""
    return varint(number << 3 | 2) + varint(len(data)) + data


def doubles(number, values):
    return part(number, struct.pack(f"<{len(values)}d", *values))


def floats(number, values):
    return part(number, struct.pack(f"<{len(values)}f", *values))


def fields(data):
    """Yields (number, value) for each field. The value is an int or bytes."""
    at = 0
    while at < len(data):
        key, at = _read_varint(data, at)
        kind = key & 7
        if kind == 0:
            value, at = _read_varint(data, at)
        elif kind == 2:
            size, at = _read_varint(data, at)
            value, at = data[at:at + size], at + size
        else:
            size = 8 if kind == 1 else 4
            value, at = int.from_bytes(data[at:at + size], "little"), at + size
        yield key >> 3, value


def _read_varint(data, at):
    value = shift = 0
    while True:
        byte = data[at]
        value |= (byte & 0x7F) << shift
        at, shift = at + 1, shift + 7
        if byte < 0x80:
            return value, at


# Control messages.
def frame(message):
    return struct.pack(">I", len(message)) + message


def receive_frame(stream):
    """Receives the next message. Raises ConnectionError at the end of the stream."""
    (size,) = struct.unpack(">I", receive_exactly(stream, 4))
    return receive_exactly(stream, size)


def receive_exactly(stream, count):
    data = bytearray()
    while len(data) < count:
        more = stream.recv(count - len(data))
        if not more:
            raise ConnectionError("closed")
        data += more
    return bytes(data)


def control(kind, body=b"", request=0):
    return frame((whole(1, request) if request else b"") + part(kind, body))


def hello(state="state-udp"):
    return control(HELLO, whole(1, PROTOCOL_VERSION) + part(2, b"attack") + part(3, state.encode()), 1)


def join(name, role, token=b""):
    return control(JOIN, part(2, name.encode()) + whole(3, role) + (part(6, token) if token else b""), 2)


def token_bytes(text):
    """Decodes the text of a token from tandem-token or from a server's invitation into JoinRoom.token."""
    return base64.urlsafe_b64decode(text + "=" * (-len(text) % 4))


def ping(token=1):
    return control(PING, whole(1, token))


def set_parameter(name, value):
    return control(SET_PARAMETER, part(1, name.encode()) + double(2, value))


def get_asset(sha256, offset=0):
    return control(GET_ASSET, part(1, sha256) + whole(2, offset))


# Datagrams.
def header(kind, connection, epoch, sequence):
    return struct.pack(">BQQ16x", PROTOCOL_VERSION << 5 | kind << 3 | epoch, connection, sequence)


def rigid_state(number, position_m=(0.0, 0.0, 0.0), rotation=(1.0, 0.0, 0.0, 0.0)):
    p = b"".join(double(i + 1, value) for i, value in enumerate(position_m))
    q = b"".join(double(i + 1, value) for i, value in enumerate(rotation))
    return part(number, part(1, p) + part(2, q))


def client_update(tick, sent_ns, position_m=None):
    """Returns a ClientUpdate with the hand at `position_m`; None gives an invalid handle."""
    place = position_m or (0.0, 0.0, 0.0)
    return whole(1, tick) + rigid_state(2, place) + whole(4, int(position_m is not None)) + fixed64(5, sent_ns)


def server_update(step, time_ns, position_m, force_n=(0.0, 0.0, 0.0), bodies=b""):
    wrench = b"".join(double(i + 1, value) for i, value in enumerate(force_n))
    return (whole(1, step) + fixed64(2, time_ns) + fixed64(6, time_ns) + rigid_state(7, position_m) + part(8, wrench) +
            bodies)


def tls(stream):
    """Wraps a stream in TLS. The server's certificate is not verified."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    context.set_alpn_protocols(["tandem/2"])
    return context.wrap_socket(stream)


class RawClient:
    """A client that sends arbitrary messages. It connects to loopback only."""

    def __init__(self, port, timeout_s=5.0, is_secure=False):
        self.port = port
        self.stream = socket.create_connection(("127.0.0.1", port), timeout=timeout_s)
        self.stream.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if is_secure:
            self.stream = tls(self.stream)
        self.datagrams = None
        self.connection = self.epoch = self.sequence = self.tick = 0
        self.assets = []

    def join(self, name, role=OBSERVER, state="state-udp", token=b""):
        """Joins the server. Raises ConnectionError if the server refuses."""
        self.stream.sendall(hello(state))
        for number, value in fields(self.receive_kind(WELCOME)):
            self.connection = value if number == 4 else self.connection
            self.epoch = value if number == 5 else self.epoch
        self.stream.sendall(join(name, role, token))
        for number, value in fields(self.receive_kind(JOINED)):
            if number == 5:
                self.assets.append(dict(fields(value)))
        self.datagrams = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.datagrams.connect(("127.0.0.1", self.port))

    def receive_kind(self, kind):
        """Returns the body of the next message, which must be of this kind. Otherwise raises ConnectionError with the
        received message."""
        for number, value in fields(self.receive()):
            if number == kind:
                return value
            if number > 1:
                raise ConnectionError(f"refused: {value!r}")
        raise ConnectionError("an empty message")

    def receive(self):
        return receive_frame(self.stream)

    def datagram(self, position_m=None):
        """Returns the next datagram that a correct client would send."""
        self.sequence += 1
        self.tick += 1
        return (header(CLIENT_UPDATE, self.connection, self.epoch, self.sequence) +
                client_update(self.tick, self.tick * 1_000_000, position_m))

    def send_state(self, position_m=None):
        self.datagrams.send(self.datagram(position_m))

    def close(self):
        self.stream.close()
        if self.datagrams is not None:
            self.datagrams.close()


NAN, HUGE = math.nan, 1e300
