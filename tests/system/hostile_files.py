"""Files that a scene may refer to and that are designed to harm their reader. Each is small, but declares or causes a
large amount of data or work.

`FILES` maps the name of a case to (name of the file, its bytes or a function that writes it). `scene_of(path)` returns
a scene that refers to the file. A program that reads such a file must end soon, with one clear line and with bounded
memory.
"""

import json
import os
import random
import struct
import subprocess
import time

MANY = 2_000_000_000
SHORT_SCENE_TAIL = {"tools": [{"name": "a", "mass_kg": 0.1}]}


def ply(form, elements, body=b""):
    return f"ply\nformat {form} 1.0\n{elements}end_header\n".encode() + body


PLY_VERTEX = "element vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
PLY_FACE = "element face {}\nproperty list {} int vertex_indices\n"
CORNERS = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
PLY_CORNERS = b"".join(struct.pack("<fff", *corner) for corner in CORNERS)


def stl(count):
    return b"x" * 80 + struct.pack("<I", count)


def gltf(count):
    accessors = [{"componentType": 5126, "type": "VEC3", "count": count, "bufferView": 0},
                 {"componentType": 5125, "type": "SCALAR", "count": count}]
    return json.dumps({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
                       "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
                       "accessors": accessors, "bufferViews": [{"buffer": 0, "byteLength": count}],
                       "buffers": [{"byteLength": count, "uri": "data:application/octet-stream;base64,AAAA"}]}).encode()


def glb(length):
    text = b"{\"asset\": {\"version\": \"2.0\"}}"
    return b"glTF" + struct.pack("<III", 2, length, length) + b"JSON" + text


def nested(opening, closing, depth, begin="", end=""):
    return (begin + opening * depth + closing * depth + end).encode()


def polygon(corners):
    """Returns one face with many corners. The time to triangulate it grows with the square of their number."""
    points = random.Random(1)
    lines = [f"v {points.random():.4f} {points.random():.4f} 0\n" for _ in range(corners)]
    return ("".join(lines) + "f " + " ".join(map(str, range(1, corners + 1))) + "\n").encode()


def soup(triangles):
    """Returns random triangles that are as long as the whole mesh. Each of them intersects a large part of the distance
    grid."""
    points = random.Random(1)
    lines = ["v %g %g %g\n" % (points.random(), points.random(), points.random()) for _ in range(3 * triangles)]
    lines += [f"f {3 * i + 1} {3 * i + 2} {3 * i + 3}\n" for i in range(triangles)]
    return "".join(lines).encode()


def tetrahedron(size):
    return [(0, 0, 0), (size, 0, 0), (0, size, 0), (0, 0, size)], [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]


def nested_solids(count):
    """Returns closed surfaces, each inside the next one."""
    lines = []
    for i in range(count):
        corners, _ = tetrahedron(4.0 * (i + 1))
        lines += ["v %g %g %g\n" % tuple(x - (i + 1) for x in corner) for corner in corners]
    for i in range(count):
        _, faces = tetrahedron(1)
        lines += ["f %d %d %d\n" % tuple(4 * i + corner + 1 for corner in face) for face in faces]
    return "".join(lines).encode()


def crowd(vertices):
    """Returns many different vertices within 1e-5 of the mesh's size."""
    points = random.Random(1)
    lines = ["v 0 0 0\nv 1 0 0\nv 0 1 0\n"]
    lines += ["v %.9f %.9f %.9f\n" % tuple(points.random() * 8e-6 for _ in range(3)) for _ in range(vertices)]
    lines += ["f 1 2 3\n"] + [f"f {i} {i + 1} {i + 2}\n" for i in range(4, vertices, 3)]
    return "".join(lines).encode()


def cysteines(count):
    """Returns sulphur atoms in one plane, each of which may be bonded to any other."""
    line = "ATOM  {:5d}  SG  CYS {}{:4d}    {:8.3f}{:8.3f}{:8.3f}  1.00  0.00\n"
    return "".join(line.format(i % 99999, chr(65 + i // 9999 % 26), i % 9999, 0, 9.0 * (i % 300), 9.0 * (i // 300))
                   for i in range(count)).encode()


def sparse(path):
    with open(path, "wb") as file:
        file.truncate(100 << 30)


# Meshes that Assimp can read. They must be refused, because reading them would take too much memory or time.
MESHES = {
    "ply of two billion vertices": ("a.ply", ply("binary_little_endian", PLY_VERTEX.format(MANY) +
                                                 PLY_FACE.format(MANY, "uchar"), PLY_CORNERS)),
    "ply of two billion vertices in text": ("a.ply", ply("ascii", PLY_VERTEX.format(MANY) +
                                                         PLY_FACE.format(MANY, "uchar"), b"0 0 0\n1 0 0\n0 1 0\n")),
    "ply of a face of two billion corners": ("a.ply", ply("binary_little_endian", PLY_VERTEX.format(3) +
                                                          PLY_FACE.format(1, "uint"),
                                                          PLY_CORNERS + struct.pack("<I", MANY))),
    "ply of a strip of two billion corners": ("a.ply", ply("binary_little_endian", PLY_VERTEX.format(3) +
                                                           "element tristrips 1\nproperty list uint int vertex_indices\n",
                                                           PLY_CORNERS + struct.pack("<I", MANY))),
    "ply of an element before its vertices": ("a.ply", ply("ascii", f"element camera {MANY}\nproperty list uchar uchar a\n" +
                                                           PLY_VERTEX.format(3), b"1 " * 1000)),
    "off of a face of two billion corners": ("a.off", f"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n{MANY} 0 1 2\n".encode()),
    "stl of four billion triangles": ("a.stl", stl(0xFFFFFFFF)),
    "stl that lacks its triangles": ("a.stl", stl(1_000_000) + b"\0" * 50),
    "off of two billion vertices": ("a.off", f"OFF\n{MANY} {MANY} 0\n0 0 0\n".encode()),
    "obj of an index beyond its end": ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 2000000000\n"),
    "gltf of two billion vertices": ("a.gltf", gltf(MANY)),
    "glb longer than it is": ("a.glb", glb(0xFFFFFFFF)),
    "3ds of chunks longer than it is": ("a.3ds", b"MM" + struct.pack("<I", 0xFFFFFFF0) +
                                        b"\x3d\x3d" + struct.pack("<I", 0xFFFFFFF0) + b"\x00\x40" +
                                        struct.pack("<I", 0xFFFFFF00) + b"m\0\x00\x41" + struct.pack("<I", 0xFFFFF0) +
                                        b"\x10\x41" + struct.pack("<IH", 0xFFFF0, 0xFFFF)),
    "dae nested 100,000 deep": ("a.dae", nested("<node>", "</node>", 100_000, "<COLLADA version=\"1.4.1\">"
                                                "<library_visual_scenes><visual_scene>",
                                                "</visual_scene></library_visual_scenes></COLLADA>")),
    "x nested 100,000 deep": ("a.x", nested("Frame f {\n", "}\n", 100_000, "xof 0303txt 0032\n")),
    "gltf nested 100,000 deep": ("a.gltf", nested("[", "]", 100_000, '{"asset": ', "}")),
    "larger than any mesh": ("a.stl", sparse),
}
# Files that may be read or refused, but in either case quickly.
ODDITIES = {
    "obj of one face of 200,000 corners": ("a.obj", polygon(200_000)),
}
# Meshes that can be read. They must be refused, because preparing them for contact would take too much memory or time.
SHAPES = {
    "soup of 1000 triangles": ("a.obj", soup(1000)),
    "20,000 solids in each other": ("a.obj", nested_solids(20_000)),
    "200,000 vertices in one place": ("a.obj", crowd(200_000)),
}
STRUCTURES = {
    "pdb of 60,000 cysteines in a plane": ("a.pdb", cysteines(60_000)),
    "pdb larger than any": ("a.pdb", sparse),
    "pdb of one line of 10 MB": ("a.pdb", b"ATOM" + b" " * 10_000_000),
    "pdb that is packed": ("a.pdb", b"\x1f\x8b\x08\0" + b"\0" * 1000),
}
SCENES = {
    "scene nested 60,000 deep": ("a.json", nested('{"bodies": [', "]}", 60_000)),
    "scene of lists in lists": ("a.json", nested("[", "]", 400_000, '{"gravity_m_per_s2": ', "}")),
    "scene larger than any": ("a.json", sparse),
}
FILES = {**MESHES, **ODDITIES, **SHAPES, **STRUCTURES, **SCENES}


def write(folder, case):
    """Writes the file of a case into the folder. Returns its path."""
    name, content = FILES[case]
    path = os.path.join(folder, name)
    if callable(content):
        content(path)
        return path
    with open(path, "wb") as file:
        file.write(content)
    return path


def scene_of(path):
    """Returns the text of a scene that refers to the file."""
    if path.endswith(".pdb"):
        body = {"name": "m", "mass_kg": 0.1, "shapes": [{"molecule": {"file": path}}]}
        return json.dumps({"name": "s", "bodies": [body], "molecular_field": {"metres_per_angstrom": 0.01},
                           **SHORT_SCENE_TAIL})
    body = {"name": "m", "shapes": [{"mesh": {"file": path, "largest_size_m": 0.1}}]}
    return json.dumps({"name": "s", "bodies": [body], **SHORT_SCENE_TAIL})


def scene_file(folder, case):
    """Returns the path of a scene that refers to the file of the case. If the file is a scene, its own path is
    returned."""
    path = write(folder, case)
    if case in SCENES:
        return path
    scene = os.path.join(folder, "evil.json")
    with open(scene, "w") as file:
        file.write(scene_of(path))
    return scene


def load(folder, case, server, *arguments):
    """Runs the program `server` with the case. Returns its exit code and lines, the duration, and the processor time
    and peak memory including its child processes."""
    began = time.monotonic()
    running = subprocess.Popen([server, "--port", "0", "--cache", "", "--scene", scene_file(folder, case), *arguments],
                               stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    with running.stderr:
        err = running.stderr.read()
    _, status, usage = os.wait4(running.pid, 0)
    running.returncode = os.waitstatus_to_exitcode(status)
    return {"code": running.returncode, "err": err, "took_s": time.monotonic() - began,
            "cpu_s": usage.ru_utime + usage.ru_stime, "memory_kib": usage.ru_maxrss}
