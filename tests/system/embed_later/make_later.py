#!/usr/bin/env python3
"""Makes the sources of a later version of libtandem from today's: two structs have a further field, and there is a new
function. abi_test.py tests that programs of the first version run with it.

Usage: make_later.py EMBED OUT     EMBED: folder client/embed; OUT: folder of the files
"""

import pathlib
import sys


def replaced(text, old, new):
    if text.count(old) != 1:
        sys.exit(f"make_later.py: {old!r} occurs {text.count(old)} times; adapt this script to the sources")
    return text.replace(old, new)


def main():
    embed, out = map(pathlib.Path, sys.argv[1:])
    header = (embed / "c" / "tandem.h").read_text(encoding="utf-8")
    header = replaced(header, "} tandem_tick;", "  double later_n; /* a field of a later version */\n} tandem_tick;")
    header = replaced(header, "} tandem_client_settings;", "  double later_s;\n} tandem_client_settings;")
    header = replaced(header, "#ifdef __cplusplus\n} /* extern",
                      "TANDEM_API tandem_status tandem_client_later(tandem_client client, double* later_s) TANDEM_NOEXCEPT;\n"
                      "\n#ifdef __cplusplus\n} /* extern")
    source = (embed / "c_structs.cpp").read_text(encoding="utf-8")
    source = replaced(source, "  tick.number = record.tick.value;\n", "  tick.number = record.tick.value;\n  tick.later_n = 4711;\n")
    symbols = (embed / "c" / "symbols.map").read_text(encoding="utf-8")
    folder = out / "client" / "embed" / "c"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "tandem.h").write_text(header, encoding="utf-8")
    (out / "c_structs.cpp").write_text(source, encoding="utf-8")
    (out / "symbols.map").write_text(symbols + "TANDEM_1 {\n  global:\n    tandem_client_later;\n} TANDEM_0;\n", encoding="utf-8")


if __name__ == "__main__":
    main()
