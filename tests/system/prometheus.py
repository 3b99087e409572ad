"""A reader of Prometheus' text format 0.0.4, written from the specification. It refuses text that the format does not
permit."""

import math
import re

NAME = re.compile(r"[a-zA-Z_:][a-zA-Z0-9_:]*")
LABEL = re.compile(r'([a-zA-Z_][a-zA-Z0-9_]*)="((?:[^"\\\n]|\\\\|\\"|\\n)*)"')
TYPES = ("counter", "gauge", "histogram", "summary", "untyped")
UNITS = ("_seconds", "_bytes", "_joules", "_info", "_total", "_ratio")


class BadText(Exception):
    pass


def _labels(text, line):
    """Returns the sorted (name, value) pairs between the braces of a line."""
    found, at = [], 0
    while at < len(text):
        label = LABEL.match(text, at)
        if not label:
            raise BadText(f"not a label: {line!r}")
        found.append((label.group(1), label.group(2)))
        at = label.end()
        if at < len(text):
            if text[at] != ",":
                raise BadText(f"no comma between labels: {line!r}")
            at += 1
    names = [name for name, _ in found]
    if len(set(names)) != len(names):
        raise BadText(f"a label stands there twice: {line!r}")
    return tuple(sorted(found))


def _family_of(name, families):
    """Returns the family of samples with that name."""
    for suffix in ("_bucket", "_sum", "_count"):
        base = name.removesuffix(suffix)
        if base != name and families.get(base, {}).get("type") == "histogram":
            return base
    return name


def _sample(line):
    """Returns (name, labels, value) of a line."""
    match = re.fullmatch(r"([^\s{]+)(?:\{(.*)\})? (\S+)", line)
    if not match or not NAME.fullmatch(match.group(1)):
        raise BadText(f"not a sample: {line!r}")
    return match.group(1), _labels(match.group(2) or "", line), float(match.group(3).replace("Inf", "inf"))


def parse(text):
    """Parses a text. Returns {family: {"type", "help", "samples": {(name, labels): value}}}."""
    if not text.endswith("\n"):
        raise BadText("the last line has no end")
    families, open_family, closed = {}, None, set()
    for line in text.split("\n")[:-1]:
        comment = re.fullmatch(r"# (HELP|TYPE) (\S+) (.*)", line)
        if comment:
            what, name, rest = comment.groups()
            if name != open_family:
                if name in closed or not NAME.fullmatch(name):
                    raise BadText(f"a family that was closed, or with no name: {line!r}")
                closed.add(open_family)
                open_family = name
                families[name] = {"samples": {}}
            family = families[name]
            if what.lower() in family or family["samples"] or (what == "TYPE" and rest not in TYPES):
                raise BadText(f"out of place: {line!r}")
            family[what.lower()] = rest
            continue
        name, labels, value = _sample(line)
        family = _family_of(name, families)
        if family != open_family or {"help", "type"} - set(families[family]):
            raise BadText(f"a sample without HELP and TYPE before it: {line!r}")
        samples = families[family]["samples"]
        if (name, labels) in samples:
            raise BadText(f"a sample stands there twice: {line!r}")
        samples[name, labels] = value
    for name, family in families.items():
        _check(name, family)
    return families


def _check(name, family):
    if not family["samples"]:
        raise BadText(f"{name} has no samples")
    if family["type"] == "counter" and not name.endswith("_total"):
        raise BadText(f"{name} is a counter without _total")
    if family["type"] == "histogram":
        _check_histogram(name, family["samples"])
    if any(math.isnan(value) for value in family["samples"].values()):
        raise BadText(f"{name} is not a number")


def _check_histogram(name, samples):
    """Checks that the buckets of each label set increase up to +Inf, and that the value at +Inf is the count."""
    if not name.endswith(UNITS):
        raise BadText(f"{name} has no unit")
    series = {}
    for (sample, labels), value in samples.items():
        rest = tuple(pair for pair in labels if pair[0] != "le")
        one = series.setdefault(rest, {"buckets": []})
        if sample == name + "_bucket":
            one["buckets"].append((float(dict(labels)["le"].replace("Inf", "inf")), value))
        else:
            one[sample] = value
    for one in series.values():
        counts = [count for _, count in one["buckets"]]
        bounds = [bound for bound, _ in one["buckets"]]
        if bounds != sorted(bounds) or counts != sorted(counts) or bounds[-1] != math.inf:
            raise BadText(f"{name}: buckets do not rise to +Inf")
        if counts[-1] != one[name + "_count"] or name + "_sum" not in one:
            raise BadText(f"{name}: _count is not the last bucket, or there is no _sum")


def counts(families):
    """Returns all values that may only increase: {(name, labels): value}."""
    return {key: value for family in families.values() if family["type"] in ("counter", "histogram")
            for key, value in family["samples"].items()}


def value(families, name, **labels):
    return families[_family_of(name, families)]["samples"][name, tuple(sorted(labels.items()))]
