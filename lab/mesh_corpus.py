"""Meshes like those of typical users. They are generated here by class, or found in Debian packages of test models."""

import math
import pathlib
import random
import struct
from typing import NamedTuple

FORMATS = ("obj", "stl", "ply", "off", "gltf", "glb", "3ds", "dae")
PACKAGES = ("/usr/share/assimp/models", "/usr/share/glmark2/models")


class Mesh(NamedTuple):
    """A mesh: vertices in millimetres, and three vertex indices for each triangle."""

    vertices: list
    triangles: list

    def moved(self, x=0.0, y=0.0, z=0.0):
        return Mesh([(a + x, b + y, c + z) for a, b, c in self.vertices], self.triangles)

    def flipped(self):
        return Mesh(self.vertices, [(a, c, b) for a, b, c in self.triangles])


def together(*meshes):
    vertices, triangles = [], []
    for mesh in meshes:
        triangles += [tuple(i + len(vertices) for i in triangle) for triangle in mesh.triangles]
        vertices += mesh.vertices
    return Mesh(vertices, triangles)


def lattice(place, columns, rows, closes_columns=False, closes_rows=False):
    """Returns the mesh of the surface place(u, v), u and v from 0 to 1, on a grid of columns × rows."""
    width, height = columns + (not closes_columns), rows + (not closes_rows)
    vertices = [place(i / columns, k / rows) for k in range(height) for i in range(width)]
    triangles = []
    for k in range(rows):
        for i in range(columns):
            a, b = k * width + i, k * width + (i + 1) % width
            c, d = (k + 1) % height * width + i, (k + 1) % height * width + (i + 1) % width
            triangles += [(a, b, d), (a, d, c)]
    return Mesh(vertices, triangles)


def prism(outline, height, bottom=0.0):
    """Returns a prism over a counter-clockwise polygon that is star-shaped about its centre."""
    n = len(outline)
    x, y = (sum(p[k] for p in outline) / n for k in (0, 1))
    vertices = [(*p, z) for z in (bottom, bottom + height) for p in outline] + [(x, y, bottom), (x, y, bottom + height)]
    triangles = []
    for i in range(n):
        k = (i + 1) % n
        triangles += [(i, k, n + k), (i, n + k, n + i), (k, i, 2 * n), (n + i, n + k, 2 * n + 1)]
    return Mesh(vertices, triangles)


def regular(sides, radius, inner=None):
    """Returns a regular polygon. If `inner` is given, every second corner lies at that radius."""
    radii = [radius if inner is None or i % 2 == 0 else inner for i in range(sides)]
    angles = [2 * math.pi * i / sides for i in range(sides)]
    return [(r * math.cos(angle), r * math.sin(angle)) for r, angle in zip(radii, angles)]


def box(x, y, z):
    return prism([(-x / 2, -y / 2), (x / 2, -y / 2), (x / 2, y / 2), (-x / 2, y / 2)], z, -z / 2)


def turned(profile, sides):
    """Returns a closed solid of revolution about z. The profile, a list of (radius, height), starts and ends on the
    axis."""
    vertices = [(0.0, 0.0, profile[0][1]), (0.0, 0.0, profile[-1][1])]
    rings = []
    for radius, height in profile[1:-1]:
        rings.append(range(len(vertices), len(vertices) + sides))
        vertices += [(radius * math.cos(2 * math.pi * i / sides), radius * math.sin(2 * math.pi * i / sides), height)
                     for i in range(sides)]
    triangles = []
    for i in range(sides):
        k = (i + 1) % sides
        triangles += [(0, rings[0][k], rings[0][i]), (1, rings[-1][i], rings[-1][k])]
        for low, high in zip(rings, rings[1:]):
            triangles += [(low[i], low[k], high[k]), (low[i], high[k], high[i])]
    return Mesh(vertices, triangles)


def ball(radius, sides, rough=None):
    def radius_at(angle):
        return radius * (1 if rough is None else rough(angle))

    angles = [math.pi * (i / (sides // 2) - 0.5) for i in range(sides // 2 + 1)]
    mesh = turned([(radius_at(a) * math.cos(a), radius_at(a) * math.sin(a)) for a in angles], sides)
    return mesh


def rock(seed, sides):
    """Returns a ball whose surface has waves of several lengths."""
    dice = random.Random(seed)
    waves = [(dice.uniform(0.02, 0.07) / k, [dice.uniform(-1.5, 1.5) * k for _ in range(3)], dice.uniform(0, 6))
             for k in range(1, 9)]
    mesh = ball(50, sides)
    vertices = []
    for p in mesh.vertices:
        way = [c / 50 for c in p]
        factor = 1 + sum(a * math.sin(sum(f * w for f, w in zip(wave, way)) + phase) for a, wave, phase in waves)
        vertices.append(tuple(factor * c for c in p))
    return Mesh(vertices, mesh.triangles)


def torus(radius, thickness, columns, rows, twist=0.0):
    """Returns a torus. With `twist` its cross section is a figure eight, so that the surface intersects itself."""
    def place(u, v):
        a, b = 2 * math.pi * u, 2 * math.pi * v
        across, up = thickness * math.cos(b), thickness * math.sin(b if twist == 0 else 2 * b) * (1 if twist == 0 else twist)
        return ((radius + across) * math.cos(a), (radius + across) * math.sin(a), up)
    return lattice(place, columns, rows, True, True)


def wavy(waves, height, cells):
    def place(u, v):
        return (100 * u, 100 * v, height * math.sin(2 * math.pi * waves * u) * math.cos(2 * math.pi * waves * v))
    return lattice(place, cells, cells)


def without(mesh, is_gone):
    """Returns the mesh without the triangles whose centroid satisfies is_gone()."""
    def middle(triangle):
        return [sum(mesh.vertices[i][k] for i in triangle) / 3 for k in range(3)]
    return Mesh(mesh.vertices, [t for t in mesh.triangles if not is_gone(middle(t))])


def finer(mesh):
    """Returns the mesh with each triangle divided into four."""
    vertices, middles, triangles = list(mesh.vertices), {}, []

    def between(a, b):
        key = (min(a, b), max(a, b))
        if key not in middles:
            middles[key] = len(vertices)
            vertices.append(tuple((p + q) / 2 for p, q in zip(vertices[a], vertices[b])))
        return middles[key]
    for a, b, c in mesh.triangles:
        ab, bc, ca = between(a, b), between(b, c), between(c, a)
        triangles += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return Mesh(vertices, triangles)


def cup(wall, sides, depth=60):
    return turned([(0, 0), (30, 0), (35, depth), (35 - wall, depth), (30 - wall, wall), (0, wall)], sides)


def some_flipped(mesh, seed):
    dice = random.Random(seed)
    return Mesh(mesh.vertices, [(a, c, b) if dice.random() < 0.3 else (a, b, c) for a, b, c in mesh.triangles])


def made():
    """Yields (class, name, mesh) of each generated mesh."""
    for k, size in enumerate([(60, 60, 60), (100, 40, 20), (100, 60, 4), (100, 10, 10), (80, 80, 2)]):
        yield "flat faces", f"box{k}", box(*size)
        yield "flat faces", f"box{k}-fine", finer(finer(finer(box(*size))))
    for sides in (3, 5, 6, 8, 12):
        yield "flat faces", f"prism{sides}", prism(regular(sides, 40), 50)
    for teeth in (8, 16, 32):
        yield "flat faces", f"gear{teeth}", prism(regular(2 * teeth, 45, 38), 12)
        yield "flat faces", f"star{teeth}", prism(regular(teeth, 45, 20), 30)
    for k, width in enumerate((10, 20, 30)):
        yield "flat faces", f"cross{k}", together(box(90, width, width), box(width, 90, width), box(width, width, 90))
        yield "flat faces", f"stairs{k}", together(*[box(20, 60, width * (i + 1)).moved(20 * i, 0, width * (i + 1) / 2) for i in range(4)])
    for sides in (16, 32, 64, 128):
        yield "round", f"cylinder{sides}", prism(regular(sides, 30), 80)
        yield "round", f"cone{sides}", turned([(0, 0), (40, 0), (0, 70)], sides)
        yield "round", f"ball{sides}", ball(50, sides)
        yield "round", f"egg{sides}", ball(40, sides, lambda a: 1 + 0.3 * math.sin(a))
        yield "round", f"torus{sides}", torus(35, 14, sides, sides // 2)
    for seed in range(1, 13):
        yield "scans", f"rock{seed}", rock(seed, 24 + 16 * (seed % 6))
    for k, wall in enumerate((0.6, 1, 2, 4)):
        for sides in (16, 64):
            yield "thin walls", f"cup{k}-{sides}", cup(wall, sides)
            yield "thin walls", f"tube{k}-{sides}", lattice(
                lambda u, v, wall=wall: ((30 - wall * (0.25 < v < 0.9)) * math.cos(2 * math.pi * u),
                                         (30 - wall * (0.25 < v < 0.9)) * math.sin(2 * math.pi * u),
                                         80 * (0.1 < v < 0.7)), sides, 4, True, True)
    yield "sheets", "square", Mesh([(0, 0, 0), (100, 0, 0), (100, 100, 0), (0, 100, 0)], [(0, 1, 2), (0, 2, 3)])
    for k, (waves, height) in enumerate([(1, 5), (1, 20), (2, 10), (3, 5)]):
        for cells in (20, 60):
            yield "sheets", f"wavy{k}-{cells}", wavy(waves, height, cells)
    for sides in (24, 64):
        yield "sheets", f"half-ball{sides}", without(ball(50, sides), lambda p: p[2] < 0)
        yield "sheets", f"open-tube{sides}", lattice(
            lambda u, v: (30 * math.cos(2 * math.pi * u), 30 * math.sin(2 * math.pi * u), 80 * v), sides, 20, True)
        yield "sheets", f"saddle{sides}", lattice(
            lambda u, v: (100 * u, 100 * v, 120 * (u - 0.5) ** 2 - 120 * (v - 0.5) ** 2), sides, sides)
        yield "large holes", f"ball{sides}", without(ball(50, sides), lambda p: p[2] > 35 or p[0] > 40)
        yield "large holes", f"rock{sides}", without(rock(3, sides), lambda p: p[2] < -20)
        yield "large holes", f"torus{sides}", without(torus(35, 14, sides, sides // 2), lambda p: p[0] > 30 and p[1] > 0)
        yield "large holes", f"open-box{sides}", without(finer(finer(box(80, 60, sides))), lambda p, top=sides / 2: p[2] > top - 0.1)
        yield "no clean solid", f"flipped{sides}", some_flipped(ball(45, sides), sides)
        yield "no clean solid", f"inside-out{sides}", torus(35, 14, sides, sides // 2).flipped()
        yield "no clean solid", f"eight{sides}", torus(35, 14, sides, sides, 0.7)
        yield "no clean solid", f"overlapping{sides}", together(ball(30, sides), ball(30, sides).moved(25, 8), box(60, 20, 20))
        yield "no clean solid", f"twice{sides}", together(ball(40, sides), ball(40, sides))
    fin = Mesh([(0, -30, 30), (0, 30, 30), (0, 30, 60), (0, -30, 60)], [(0, 1, 2), (0, 2, 3)])
    yield "no clean solid", "fin", together(box(60, 60, 60), fin)
    yield "no clean solid", "inner-wall", together(box(40, 60, 60).moved(-20), box(40, 60, 60).moved(20))
    yield "no clean solid", "closed-and-open", together(ball(25, 32), wavy(1, 5, 20).moved(-50, -50, 40))
    yield "no clean solid", "nested", together(ball(45, 48), box(20, 20, 20))


def obj(mesh):
    lines = [f"v {x:.6g} {y:.6g} {z:.6g}" for x, y, z in mesh.vertices]
    return "\n".join(lines + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh.triangles]).encode() + b"\n"


def off(mesh):
    """Returns the content of an .off file with comments and face colours, which a reader must accept."""
    lines = ["OFF # of the corpus", f"{len(mesh.vertices)} {len(mesh.triangles)} 0", "# places"]
    lines += [f"{x:.6g} {y:.6g} {z:.6g}" for x, y, z in mesh.vertices]
    return "\n".join(lines + [f"3 {a} {b} {c} 200 100 50" for a, b, c in mesh.triangles]).encode() + b"\n"


def stl(mesh):
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *(c for i in triangle for c in mesh.vertices[i]), 0)
                    for triangle in mesh.triangles)
    return b"corpus".ljust(80) + struct.pack("<I", len(mesh.triangles)) + body


def ply(mesh):
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(mesh.vertices)}", "property float x",
              "property float y", "property float z", f"element face {len(mesh.triangles)}",
              "property list uchar int vertex_indices", "end_header"]
    return ("\n".join(header) + "\n").encode() + b"".join(struct.pack("<3f", *p) for p in mesh.vertices) + b"".join(
        struct.pack("<B3i", 3, *triangle) for triangle in mesh.triangles)


WRITERS = {"obj": obj, "off": off, "stl": stl, "ply": ply}


def write_made(folder):
    """Writes all generated meshes; successive meshes cycle through the file formats. Returns (class, file) for each."""
    folder.mkdir(parents=True, exist_ok=True)
    files = []
    for number, (kind, name, mesh) in enumerate(made()):
        ending = list(WRITERS)[number % len(WRITERS)]
        file = folder / f"{kind.replace(' ', '-')}-{name}.{ending}"
        file.write_bytes(WRITERS[ending](mesh))
        files.append((kind, file))
    return files


def found():
    """Returns ("of others", file) for each mesh file in the installed packages."""
    return [("of others", file) for folder in PACKAGES for file in sorted(pathlib.Path(folder).rglob("*"))
            if file.suffix[1:].lower() in FORMATS and file.is_file()]
