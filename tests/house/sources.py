"""Functions that all scripts in tests/house share: the product's folders, its sources, and the files that they
include."""
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[2]
PRODUCT = ("common", "proto", "devices", "server", "client", "lab")
INCLUDE = re.compile(r'^\s*#\s*include\s+(?:"([^"]+)"|<([^>]+)>)', re.MULTILINE)


def sources(root=ROOT, suffixes=(".hpp", ".cpp", ".inc"), folders=PRODUCT):
    """Returns the paths of the product's sources, relative to `root`, sorted."""
    found = []
    for folder in folders:
        found += [path.relative_to(root) for path in (root / folder).rglob("*") if path.suffix in suffixes]
    return sorted(found)


def includes(path, root=ROOT):
    """Returns (project includes, other includes) of one source, as written in the file."""
    ours, others = [], []
    for quoted, angled in INCLUDE.findall((root / path).read_text(encoding="utf-8")):
        ours.append(quoted) if quoted else others.append(angled)
    return ours, others


def folder_of(path):
    return pathlib.PurePosixPath(path).parent.as_posix()


def home_of(path):
    """Returns the folder whose namespace a file has, e.g. common/physics for common/physics/joints, or client for
    client/session."""
    parts = pathlib.PurePosixPath(path).parent.parts
    return "/".join(parts[:2]) if parts[0] == "common" else parts[0]


def header_users(root=ROOT):
    """Returns, for each header, the folders with other namespaces whose sources include it."""
    users = {path.as_posix(): set() for path in sources(root, (".hpp",))}
    for path in sources(root):
        for name in includes(path, root)[0]:
            if name in users and home_of(name) != home_of(path):
                users[name].add(home_of(path))
    return users
