"""Tests that each rule detects a violation, in a tree that the test creates."""
import importlib.machinery
import importlib.util
import json
import pathlib
import sys
import tempfile
import unittest

import bounds
import compare_results
import count_types
import grammar
import includes
import links
import members
import messages
import same_code
import skips
import words


class Tree(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.root = pathlib.Path(self.folder.name)

    def tearDown(self):
        self.folder.cleanup()

    def write(self, name, text):
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
        return path


def script(name):
    """Returns a script of deploy/ as a module."""
    loader = importlib.machinery.SourceFileLoader(name.replace("-", "_"), str(links.sources.ROOT / "deploy" / name))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(loader.name, loader))
    loader.exec_module(module)
    return module


class References(unittest.TestCase):
    SCHEMA = """// A body.
message Body {
  double mass_kg = 1;           // 1e-6..1e4; default 0: static
  // Pressure of the surface.
  optional double stiffness = 2;  // 1e5..1e13; default 1e+10; per depth,
                                  // in series
  oneof kind {  // one of two
    Ball ball = 3;
  }
  repeated string names = 4;    // 1 to 3; required
  bytes hash = 5;               // set by the server: 32 bytes
}

message Ball { double radius_m = 1; double length_m = 2; }  // axis z
"""

    @classmethod
    def setUpClass(cls):
        sys.dont_write_bytecode = True
        cls.script = script("write-references")

    def test_a_comment_belongs_to_its_field(self):
        messages = self.script.read_messages(self.SCHEMA)
        body, ball = messages["Body"], messages["Ball"]
        self.assertEqual((body.comment, ball.comment), ("A body.", " Axis z."))
        mass, stiffness, shape, names, _ = body.fields
        self.assertEqual(self.script.columns(mass.comment), ("1e-6..1e4", "0: static", ""))
        self.assertEqual(stiffness.above, "Pressure of the surface.")
        self.assertEqual(self.script.columns(stiffness.comment), ("1e5..1e13", "1e+10", "per depth, in series"))
        self.assertEqual((shape.above, names.above), ("One of two.", ""))
        self.assertEqual(self.script.columns(names.comment), ("1 to 3", "required", ""))
        self.assertEqual([field.name for field in ball.fields], ["radius_m", "length_m"])

    def test_a_page_that_differs_from_its_source_is_found(self):
        with tempfile.TemporaryDirectory() as folder:
            page = pathlib.Path(folder, "page.md")
            module = self.script
            root, pages, arguments = module.ROOT, module.PAGES, sys.argv
            try:
                module.ROOT, module.PAGES, sys.argv = pathlib.Path(folder), {"page.md": lambda: "table\n"}, ["write-references"]
                page.write_text(f"before\n{module.BEGIN}\n{module.END}\nafter\n", encoding="utf-8")
                sys.argv.append("--check")
                self.assertEqual(module.main(), 1)
                del sys.argv[1:]
                self.assertEqual(module.main(), 0)
                self.assertEqual(page.read_text(encoding="utf-8"), f"before\n{module.BEGIN}\ntable\n{module.END}\nafter\n")
                sys.argv.append("--check")
                self.assertEqual(module.main(), 0)
            finally:
                module.ROOT, module.PAGES, sys.argv = root, pages, arguments


class SameCode(unittest.TestCase):
    def same(self, one, two, name="a.cpp", renamed=None, ignores_strings=False):
        found, self.strings = same_code.difference(same_code.tokens_of(name, one), same_code.tokens_of(name, two), renamed or {},
                                                   ignores_strings)
        return found is None

    def test_comments_and_lines_are_no_code(self):
        self.assertTrue(self.same("int a = 1;  // one\n", "/* the\n first */\nint a\n  = 1;\n"))
        self.assertTrue(self.same('f("a" "b");', 'f("ab");  // joined'))
        self.assertTrue(self.same("#define A 1\nint b;", "#define A 1  // one\n\nint b;"))

    def test_other_code_is_found(self):
        self.assertFalse(self.same("int a = 1;", "int a = 2;"))
        self.assertFalse(self.same("int a;", "// int a;"))
        self.assertFalse(self.same('f("// no comment");', 'f("");'))
        self.assertFalse(self.same("#define A 1\nint b;", "#define A 1 int b;"))
        self.assertFalse(self.same("x = R\"(a // b)\";", "x = R\"(a)\";"))
        self.assertFalse(self.same("c = '\"'; // a", "c = '\"';  b"))
        self.assertTrue(self.same("n = 1'000; // a", "n = 1'000;"))

    def test_names_and_strings_change_only_where_that_is_allowed(self):
        self.assertFalse(self.same("told();", "received();"))
        self.assertTrue(self.same("told();", "received();", renamed={"told": "received"}))
        self.assertFalse(self.same('f("a");', 'f("b");'))
        self.assertTrue(self.same('f("a");', 'f("b");', ignores_strings=True))
        self.assertEqual(self.strings, [('"a"', '"b"')])

    def test_docstrings_of_python_are_prose(self):
        self.assertTrue(self.same('def f():\n    """One."""\n    return 1\n', 'def f():\n    """Two."""\n    return 1  # 1\n', "a.py"))
        self.assertFalse(self.same('x = "a"\n', 'x = "b"\n', "a.py"))
        self.assertFalse(self.same("if a:\n    b()\nc()\n", "if a:\n    b()\n    c()\n", "a.py"))


class Grammar(Tree):
    def count(self, text):
        self.write("common/base/a.hpp", text)
        count = grammar.measure(self.root, ["common/base"])["common/base"]
        return count["comments"], len(count["bare"]), len(count["clause"])

    def test_comments_without_a_subject_are_counted(self):
        self.assertEqual(self.count("/// What is told.\nint a;  ///< of the last\n"), (2, 2, 1))
        self.assertEqual(self.count("// The bound of what\n// was sent.\n"), (1, 0, 1))
        self.assertEqual(self.count("// So many\n\n// Who joined\n"), (2, 2, 1))

    def test_plain_ones_are_not(self):
        self.assertEqual(self.count("/// The last state that was received [s].\nint a;  ///< its age\n"), (2, 0, 0))
        self.assertEqual(self.count('f("// what");\n'), (0, 0, 0))
        self.assertEqual(self.count("/// Copies it.\n/// In      name  the user who joined\n"), (2, 0, 0))

    def test_a_ceiling_is_held(self):
        self.write("common/base/a.hpp", "/// What is told.\n")
        counts = grammar.measure(self.root, ["common/base"])
        self.assertEqual(len(list(grammar.breaches(counts, {"common/base": {"bare": 0, "clause": 0}}))), 2)
        self.assertEqual(list(grammar.breaches(counts, {"common/base": {"bare": 100, "clause": 100}})), [])


class Includes(Tree):
    folders = {"common/base": [], "server": ["common"], "client": ["common", "server/one.hpp"]}
    libraries = {"bullet/": ["server"]}

    def breaches(self):
        return list(includes.breaches(self.root, self.folders, self.libraries))

    def test_allowed_edges_pass(self):
        self.write("common/base/a.hpp", "#pragma once\n")
        self.write("server/one.hpp", '#include "common/base/a.hpp"\n#include <bullet/b.h>\n')
        self.write("client/c.cpp", '#include "server/one.hpp"\n#include "tandem/scene.pb.h"\n')
        self.assertEqual(self.breaches(), [])

    def test_an_edge_backwards_fails(self):
        self.write("server/one.hpp", "")
        self.write("common/base/a.hpp", '#include "server/one.hpp"\n')
        self.assertIn("common/base may not include server/one.hpp", self.breaches()[0])

    def test_a_header_beside_the_allowed_one_fails(self):
        self.write("server/two.hpp", "")
        self.write("client/c.cpp", '#include "server/two.hpp"\n')
        self.assertEqual(len(self.breaches()), 1)

    def test_a_library_outside_its_folder_and_a_folder_without_a_line_fail(self):
        self.write("client/c.cpp", "#include <bullet/b.h>\n")
        self.write("lab/l.cpp", "")
        self.assertEqual(len(self.breaches()), 2)

    def test_a_circle_of_folders_is_found(self):
        self.assertEqual(includes.cycles({"a": ["b"], "b": ["a"], "c": ["a"]}), ["a", "b"])

    def test_a_header_with_a_line_of_its_own_is_held_by_that_line(self):
        self.folders = {"common": [], "common/low.hpp": [], "common/part": ["common/low.hpp"]}
        self.write("common/high.hpp", "")
        self.write("common/part/p.cpp", '#include "common/low.hpp"\n')
        self.write("common/low.hpp", "")
        self.assertEqual(self.breaches(), [])
        self.write("common/low.hpp", '#include "common/high.hpp"\n')
        self.assertIn("common/low.hpp may not include common/high.hpp", self.breaches()[0])

    def test_a_circle_through_a_header_is_found(self):
        self.assertEqual(includes.cycles({"a": ["a/low.hpp", "b"], "a/low.hpp": [], "b": ["a/low.hpp"]}), [])
        self.assertEqual(includes.cycles({"a": [], "a/low.hpp": ["b"], "b": ["a/low.hpp"]}), ["a/low.hpp", "b"])

    def test_edges_against_the_layers_of_contact_fail(self):
        self.folders = includes.read_table(includes.TABLE)[0]
        layers = ("contact_shape_options.hpp", "contact_point.hpp", "round/rod.hpp", "field/f.hpp", "points/p.hpp", "contact_shape.hpp",
                  "shell/s.hpp", "flat/l.hpp", "closed_form_contacts.hpp", "contact_pair.hpp")
        for low, high in ((low, high) for i, low in enumerate(layers) for high in layers[i + 1:]):
            with self.subTest(low=low, high=high), tempfile.TemporaryDirectory() as folder:
                self.root = pathlib.Path(folder)
                self.write(f"common/contact/{high}", "")
                self.write(f"common/contact/{low}", f'#include "common/contact/{high}"\n')
                self.assertEqual(len(self.breaches()), 1)


class Counts(Tree):
    def test_types_are_counted_nested_ones_too_and_declarations_not(self):
        text = "class A;\nstruct B final : C {\n  enum class D { k };\n};\n// struct E {\ntemplate <class T>\nstruct F {\n};\n"
        self.assertEqual(count_types.types_of(text), ["B", "D", "F"])

    def test_functions_are_measured_between_their_braces(self):
        text = "int f(int a,\n      int b) {\n  return a;\n}\n\nnamespace n {\nvoid g() {\n  a();\n  b();\n}\n}\nstruct S {\n  int x;\n};\n"
        self.assertEqual(count_types.function_lengths(text), [1, 2])

    def test_a_type_is_shared_by_use_from_another_top_level_folder(self):
        self.write("common/base/a.hpp", "namespace tandem {\nstruct A {\n};\n}\n")
        self.write("common/net/b.hpp", '#include "common/base/a.hpp"\nstruct B {\n};\n')
        self.write("server/c.cpp", '#include "common/net/b.hpp"\n\n// nothing\nint f() {\n  return 0;\n}\n')
        figures = count_types.measure(self.root)[0]
        self.assertEqual((figures["types_shared_by_folders"], figures["types_directly_in_tandem"]), (1, 1))
        self.assertEqual((figures["code_lines_of_common"], figures["code_lines_of_server"]), (7, 4))


class Members(Tree):
    TEXT = """
struct Settings {
  double a = 1;
  int b{2};
  std::string c;
};
class Whole : public Base<int> {
 public:
  Whole(int a, int b) : a_(a) { f(); }
  void f() const { int local = 1; }
  std::function<void(int)> on_event;  // not a function
  static constexpr int kNone = 3;
  using Name = int;

 private:
  struct Part {
    explicit Part(int x) : x_(x) {}
    int x_;
    Whole* whole = nullptr;
  };
  enum class Kind { kOne, kTwo };
  int a_;
  std::vector<Part> parts_{};
  Kind kind_ = Kind::kOne;
};
"""

    def test_data_is_counted_with_that_of_nested_structs_and_settings_are_exempt(self):
        self.write("client/a.hpp", self.TEXT)
        self.assertEqual(members.counts(self.root), [(6, "client/a.hpp", "Whole"), (2, "client/a.hpp", "Whole::Part")])


class Words(Tree):
    def found(self):
        rules = {
            "identifiers": [{"part": "guard", "say": "x", "except": ["lock_guard"]}, {"part": "slot", "say": "y", "under": ["server"]}],
            "prose": [{"text": "\\bastray\\b", "say": "z"}],
        }
        return sorted(str(what) for _, what, _ in words.breaches(self.root, rules))

    def test_identifiers_are_matched_by_their_parts_outside_of_comments_and_strings(self):
        self.write("server/a.cpp", 'int guard_gain, kGuardTime, lock_guard, guardian;  // guard\nauto s = "guard";\n')
        self.assertEqual(self.found(), ["guard_gain", "kGuardTime"])

    def test_a_rule_may_hold_in_one_folder_alone(self):
        self.write("server/a.cpp", "int slot;\n")
        self.write("lab/a.cpp", "int slot;\n")
        self.assertEqual(self.found(), ["slot"])

    def test_readmes_and_help_are_read(self):
        self.write("client/README.md", "a model that is astray\n")
        self.write("lab/cli/run.cpp", 'add("--x", "goes astray");\n')
        self.write("lab/cli/quiet.cpp", "// goes astray\n")
        self.assertEqual(self.found(), ["1: astray", "astray"])


class Messages(Tree):
    def test_a_message_that_no_program_prints_is_found(self):
        self.write(messages.PAGE, '| message |\n|---|\n| "is full: no place" | a |\n| "never printed" | b |\n| a symptom | c |\n')
        self.write("server/a.cpp", 'refuse("room is full: "\n    "no place for");\n')
        self.assertEqual(messages.missing(self.root), ["never printed"])


class Links(Tree):
    def test_dead_links_and_paths_are_found_and_live_ones_are_not(self):
        self.write("common/base/ids.hpp", "")
        self.write("common/README.md", "[a](base/) [b](base/ids.hpp#x) [c](gone.md) [d](https://e) `common/base/ids` `lab/gone`\n")
        self.assertEqual(list(links.dead_ends(self.root)),
                         ["common/README.md: the link gone.md leads nowhere", "common/README.md: there is no lab/gone"])

    def test_anchors_are_headings(self):
        self.write("common/README.md", "# The `base`, 3 [parts](../proto)!\n## Again\n## Again\n```\n# no heading\n```\n")
        self.write("proto/README.md", "[a](../common/README.md#the-base-3-parts) [b](../common/README.md#again-1) "
                   "[c](../common/README.md#no-heading) [d](#there) [e](https://x#y)\n")
        self.assertEqual(list(links.dead_ends(self.root)),
                         ["proto/README.md: ../common/README.md has no heading for #no-heading",
                          "proto/README.md: the page has no heading for #there"])


class Skips(Tree):
    def found(self, name, text):
        self.write(name, text)
        return [line.split(": ")[0] for line in skips.bare_skips(self.root)]

    def test_a_bare_skip_is_found_in_each_language(self):
        for name, line in (("a_test.cpp", "  if (!file) GTEST_SKIP() << 1;"), ("b_test.cpp", "TEST(A, DISABLED_B) {"),
                           ("c.hpp", "GTEST_SKIP();"), ("d_test.py", "@unittest.skipUnless(x, 'y')"),
                           ("e_test.py", "self.skipTest('y')"), ("f.py", "sys.exit(77)"),
                           ("CMakeLists.txt", "set_tests_properties(a PROPERTIES SKIP_RETURN_CODE 77)"),
                           ("g/CMakeLists.txt", "if(Python3_FOUND)")):
            self.assertIn(f"tests/{name}:2", self.found(f"tests/{name}", f"\n{line}\n" + ("def f(): pass\n" if name.endswith(".py") else "")), line)

    def test_the_helpers_and_plain_words_pass(self):
        self.assertEqual(self.found("tests/support/needs.hpp", "GTEST_SKIP() << 1;\n"), [])
        self.assertEqual(self.found("tests/a.py", "needs.leave_out(self, 'busy')\nskipped = 77\n"), [])

    def test_a_claim_that_is_only_made_at_a_speed_is_found(self):
        text = 'if report["tick_rate_hz"] > 950:\n    self.assertGreater(report["force_n"], 0.1)\n'
        self.assertEqual(self.found("tests/a_test.py", text), ["tests/a_test.py:1"])
        self.assertEqual(self.found("tests/a_test.py", text.replace("self.assert", "print")), [])


class Results(Tree):
    def test_what_differs_is_named_and_renamed_keys_are_equal(self):
        before = compare_results.renamed({"guard": True, "trials": [{"seed": 1, "x": 1, "y": "guard"}]}, {"guard": "passivity"})
        after = {"passivity": True, "trials": [{"seed": 1, "x": 2, "y": "passivity"}]}
        self.assertEqual(list(compare_results.differences(before, after)), [("/trials/seed=1/x", 1, 2)])

    def test_a_summary_from_before_suppressed_updates_had_that_name_is_equal(self):
        names = compare_results.json.loads(compare_results.RENAMED.read_text(encoding="utf-8"))
        before = compare_results.renamed({"datagrams": {"sent": 7, "held_back": 3}}, names)
        self.assertEqual(list(compare_results.differences(before, {"datagrams": {"sent": 7, "suppressed": 3}})), [])

    def test_numbers_are_compared_as_they_are_written(self):
        one = compare_results.load(self.write("a.json", '{"x": 0.1}'), {})
        other = compare_results.load(self.write("b.json", '{"x": 0.10000000000000001}'), {})
        self.assertEqual(len(list(compare_results.differences(one, other))), 1)

    def test_what_is_missing_or_new_is_a_difference(self):
        self.assertEqual(len(list(compare_results.differences({"a": 1, "b": [1]}, {"b": [1, 2], "c": 1}))), 3)

    def test_expected_differences_are_told_apart(self):
        self.assertTrue(compare_results.is_expected("wall", "/trials/1/verdict", {"*": {"verdict": "why"}}))
        self.assertFalse(compare_results.is_expected("wall", "/trials/1/force", {"peg": {"force": "why"}}))


class Bounds(Tree):
    row = "| `proto/a.cpp` `read` | counts | `kMaxThings` | `a_test` |\n"

    def breaches(self, page, source="constexpr int kMaxThings = 4;\nint read(int n) {\n  return n;\n}\n"):
        self.write("proto/BOUNDS.md", page)
        self.write("proto/a.cpp", source)
        self.write("tests/a_test.cpp", "")
        return list(bounds.breaches(self.root))

    def test_a_row_of_what_exists_passes(self):
        self.assertEqual(self.breaches(self.row), [])
        self.assertEqual(list(bounds.lines(self.root))[0].split()[0], "proto/a.cpp:2")

    def test_a_place_a_constant_and_a_test_that_do_not_exist_are_seen(self):
        self.assertEqual(self.breaches(self.row.replace("read", "write")), ["proto/a.cpp has no write"])
        self.assertEqual(self.breaches(self.row.replace("a.cpp", "b.cpp")), ["proto/b.cpp does not exist"])
        self.assertEqual(len(self.breaches(self.row.replace("kMaxThings", "kMaxOthers"))), 1)
        self.assertEqual(len(self.breaches(self.row.replace("a_test", "b_test"))), 1)

    def test_a_call_is_no_place(self):
        self.assertEqual(self.breaches(self.row, "int kMaxThings = read(3);\nint other() {\n  return read(4);\n}\n"),
                         ["proto/a.cpp has no read"])

    def test_a_page_without_rows_and_a_row_without_a_test_are_seen(self):
        self.assertEqual(len(self.breaches("none")), 1)
        self.assertEqual(len(self.breaches(self.row.replace("`a_test`", ""))), 1)
        self.assertEqual(self.breaches(self.row.replace("`a_test`", "no test: it needs a screen")), [])


class Tables(unittest.TestCase):
    def test_the_checked_in_tables_can_be_read(self):
        folders, libraries = includes.read_table(includes.TABLE)
        self.assertIn("common/base", folders)
        self.assertIn("CLI/", libraries)
        self.assertEqual(includes.cycles(folders), [])
        json.loads(words.WORDS.read_text(encoding="utf-8"))


if __name__ == "__main__":
    unittest.main()
