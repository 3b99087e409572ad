"""Functions shared by the scripts in tests/house: the product's folders, its sources, and the files that they include.
"""
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
