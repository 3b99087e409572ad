"""An independent reader of recordings. It follows the public specification (https://mcap.dev/spec) and shares no code
or language with the project. It checks checksums, lengths, indexes and the summary. The program zstd decompresses the
chunks."""

import struct
import subprocess
import zlib

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX = range(1, 9)
STATISTICS, DATA_END = 11, 15


class Bad(Exception):
    """Raised if the file violates the specification."""


class Cursor:
    def __init__(self, data, at=0):
        self.data, self.at = data, at

    def take(self, size):
        if self.at + size > len(self.data):
            raise Bad(f"{size} bytes at {self.at} of {len(self.data)}")
        self.at += size
        return self.data[self.at - size:self.at]

    def number(self, letter):
        return struct.unpack("<" + letter, self.take(struct.calcsize(letter)))[0]

    def text(self):
        return self.take(self.number("I")).decode()

    def map_of(self, key, value):
        part = Cursor(self.take(self.number("I")))
        result = {}
        while part.at < len(part.data):
            name = part.number(key)
            result[name] = part.number(value)
        return result

    def record(self):
        op = self.number("B")
        return op, Cursor(self.take(self.number("Q")))


def unpacked(name, data, size):
    if name == "":
        return data
    if name != "zstd":
        raise Bad(f"compression {name}")
    result = subprocess.run(["zstd", "-dc"], input=data, capture_output=True, check=True).stdout
    if len(result) != size:
        raise Bad(f"a chunk of {size} bytes has {len(result)}")
    return result


class Recording:
    """The content of a file. `messages` contains (topic, log time [ns], data). `is_whole` is true if the file is
    complete and its summary is correct."""

    def __init__(self, path):
        with open(path, "rb") as file:
            self.data = file.read()
        self.schemas, self.channels, self.messages = {}, {}, []
        self.chunks = {}  # maps offset to (length, first time, last time, {channel: entries of its index})
        self.is_whole = False
        cursor = Cursor(self.data)
        if cursor.take(8) != MAGIC:
            raise Bad("magic")
        if cursor.record()[0] != HEADER:
            raise Bad("no header")
        self.read_data(cursor)
        if self.is_whole:
            self.check_summary(cursor)

    def read_data(self, cursor):
        last_chunk = None
        while True:
            begin = cursor.at
            try:
                op, content = cursor.record()
            except Bad:
                return  # the file ends here, because the program that wrote it was killed
            if op == CHUNK:
                last_chunk = begin
                self.read_chunk(content, begin, cursor.at - begin)
            elif op == MESSAGE_INDEX:
                self.check_index(content, last_chunk)
            elif op == DATA_END:
                self.is_whole = True
                return
            else:
                self.take(op, content)

    def take(self, op, content):
        if op == SCHEMA:
            number, name, encoding = content.number("H"), content.text(), content.text()
            self.schemas[number] = (name, encoding, content.take(content.number("I")))
        elif op == CHANNEL:
            number, schema, topic, encoding = content.number("H"), content.number("H"), content.text(), content.text()
            if schema not in self.schemas or encoding != "protobuf":
                raise Bad(f"channel {topic}")
            self.channels[number] = (topic, schema)
        elif op == MESSAGE:
            channel, _, log_time, _ = (content.number(letter) for letter in "HIQQ")
            self.messages.append((self.channels[channel][0], log_time, content.data[content.at:]))

    def read_chunk(self, content, begin, length):
        first, last, size, crc = (content.number(letter) for letter in "QQQI")
        name = content.text()
        records = unpacked(name, content.take(content.number("Q")), size)
        if crc and crc != zlib.crc32(records):
            raise Bad("a chunk's sum is wrong")
        inside, entries = Cursor(records), {}
        while inside.at < len(records):
            at = inside.at
            op, part = inside.record()
            self.take(op, Cursor(part.data))
            if op == MESSAGE:
                channel, _, log_time = part.number("H"), part.number("I"), part.number("Q")
                entries.setdefault(channel, []).append((log_time, at))
                if not first <= log_time <= last:
                    raise Bad("a message's time is outside of its chunk's")
        self.chunks[begin] = (length, first, last, entries)

    def check_index(self, content, chunk):
        channel = content.number("H")
        part = Cursor(content.take(content.number("I")))
        entries = []
        while part.at < len(part.data):
            entries.append((part.number("Q"), part.number("Q")))
        if entries != self.chunks[chunk][3][channel]:
            raise Bad(f"the index of channel {channel} is not of the chunk before it")

    def check_summary(self, cursor):
        begin, indexed, statistics = cursor.at, {}, None
        while True:
            at = cursor.at
            op, content = cursor.record()
            if op == CHUNK_INDEX:
                first, last, offset, length = (content.number("Q") for _ in range(4))
                indexed[offset] = (length, first, last)
                for channel, place in content.map_of("H", "Q").items():
                    index_op, index = Cursor(self.data, place).record()
                    if index_op != MESSAGE_INDEX or index.number("H") != channel:
                        raise Bad("a chunk's index is not where its entry says")
            elif op == STATISTICS:
                statistics = content
            elif op == FOOTER:
                break
        if {offset: chunk[:3] for offset, chunk in self.chunks.items()} != indexed:
            raise Bad("the summary's chunks are not those of the file")
        messages = statistics.number("Q")
        if messages != len(self.messages):
            raise Bad(f"{messages} messages by the summary, {len(self.messages)} in the file")
        summary_start, _, crc = content.number("Q"), content.number("Q"), content.number("I")
        if summary_start != begin or crc != zlib.crc32(self.data[begin:at + 1 + 8 + 8 + 8]):
            raise Bad("the summary is not where or what the footer says")
        if cursor.take(8) != MAGIC or cursor.at != len(self.data):
            raise Bad("no magic at the end")

    def of(self, topic):
        return [(time, data) for name, time, data in self.messages if name == topic]


def fields(data):
    """Parses a protobuf message. Returns {number: [values]}. Varints become whole numbers; values of 4 and 8 bytes stay
    raw; all other values are bytes."""
    cursor, result = Cursor(data), {}

    def varint():
        value = shift = 0
        while True:
            byte = cursor.number("B")
            value |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                return value

    while cursor.at < len(data):
        key = varint()
        kind = key & 7
        if kind == 0:
            value = varint()
        elif kind == 1:
            value = cursor.take(8)
        elif kind == 2:
            value = cursor.take(varint())
        elif kind == 5:
            value = cursor.take(4)
        else:
            raise Bad(f"wire type {kind}")
        result.setdefault(key >> 3, []).append(value)
    return result
