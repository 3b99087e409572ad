"""Tests that the figures in reports of tandem-lab satisfy the rules in figures.py, which are those of a journal."""

import glob
import os
import re
import tempfile
import unittest
import xml.etree.ElementTree as ElementTree

import figures
from support import ProgramTest, Server, finish, run, start_client

GOOD = """<svg class="plot" viewBox="0 0 400 200" xmlns="http://www.w3.org/2000/svg"><style>
.plot .s0 { stroke: #0072b2; } .plot .s1 { stroke: #d55e00; }
.plot .line.s1, .plot .line.s6 { stroke-dasharray: 7 3; }</style>
<text class="axis-label" x="200" y="190">time [s]</text>
<text class="axis-label" transform="translate(14 100) rotate(-90)">force [N]</text>
<text class="y-tick" x="60" y="40">2.0</text>
<polyline class="line s0" points="60,50 300,60"/>
<g class="key"><line class="line s0"/><path class="marker s0" d="M5,5m-4,0z"/><text class="legend" x="90" y="20">anna</text></g>
<g class="key"><line class="line s1"/><path class="marker s1" d="M5,5h7z"/><text class="legend" x="190" y="20">ben</text></g>
</svg>"""


def problems(page):
    return [problem for figure in figures.figures_of(page) for problem in figures.problems_of(figure, page)]


class Rules(unittest.TestCase):
    def assert_found(self, before, after, problem):
        self.assertIn(before, GOOD)
        self.assertEqual(problems(GOOD.replace(before, after)), [problem])

    def test_a_good_figure_has_no_problem(self):
        self.assertEqual(problems(GOOD), [])

    def test_an_axis_without_unit_is_found(self):
        self.assert_found("force [N]", "force", 'the axis "force" has no unit')

    def test_series_that_differ_in_their_colour_alone_are_found(self):
        self.assert_found('<line class="line s1"/><path class="marker s1" d="M5,5h7z"/>', '<line class="line s0"/>'
                          '<path class="marker s1" d="M5,5m-4,0z"/>',
                          'the series "anna" and "ben" differ in 1 of colour, dash and marker')

    def test_a_cut_text_is_found(self):
        self.assert_found('x="190" y="20">ben', 'x="385" y="20">ben', 'the text "ben" is cut by the edge')
        self.assert_found('<text class="y-tick" x="60"', '<text class="y-tick" x="10"',
                          'the text "2.0" is cut by the edge')

    def test_texts_on_each_other_are_found(self):
        self.assert_found('x="190" y="20">ben', 'x="110" y="20">ben', 'the texts "anna" and "ben" overlap')

    def test_an_empty_figure_is_found(self):
        polyline = '<polyline class="line s0" points="60,50 300,60"/>'
        empty = re.sub(r'<path class="marker.*?/>', "", GOOD.replace(polyline, ""))
        self.assertIn("nothing is drawn", problems(empty))

    def test_a_report_without_question_answer_and_origin_is_found(self):
        found = list(figures.report_problems(GOOD * 4))
        self.assertEqual(found, ["4 figures are on the first page", "the first page asks nothing",
                                 "the first page answers nothing",
                                 "the first page names no command, version and date"])


class Reports(ProgramTest):
    def assert_good(self, folder, least_figures):
        with open(os.path.join(folder, "report.html"), encoding="utf-8") as file:
            page = file.read()
        self.assertEqual(list(figures.report_problems(page)), [])
        self.assertGreaterEqual(len(figures.figures_of(page)), least_figures)
        links = re.findall(r'href="(figures/[^"]+)"', page)
        self.assertEqual(len(links), 2 * len(figures.figures_of(page)))
        for link in links:
            with open(os.path.join(folder, link), encoding="utf-8") as file:
                text = file.read()
            if link.endswith(".svg"):
                self.assertEqual(list(figures.problems_of(ElementTree.fromstring(text), text)), [])
            else:
                self.assertRegex(text, r'^series,"[^"\[]+ \[[^\]]+\]","[^"\[]+ \[[^\]]+\]",low,high\n.*,')

    def report_of(self, least_figures, *arguments):
        with tempfile.TemporaryDirectory() as folder:
            code, _, err = run("tandem-lab", *arguments, "--out", folder)
            self.assertIn(code, (0, 1), err)
            self.assert_good(folder, least_figures)

    def test_a_study_over_the_delay(self):
        self.report_of(3, "run", "wall", "--stage", "late-pose,hold,local-model", "--set", "link.rtt_ms=0,50",
                       "--set", "duration_s=6", "--seeds", "2")

    def test_a_trial_of_two_users(self):
        self.report_of(5, "run", "squeeze", "--single", "--set", "link.rtt_ms=50", "--set", "duration_s=3")

    def test_reproductions(self):
        for name in ("saturation", "growth", "displacement"):
            self.report_of(1, "reproduce", name)

    def test_a_calibration(self):
        self.report_of(2, "calibrate", "--profile", "omega.6", "--masses", "0.05,0.1,0.2")

    def test_a_check_of_a_coupling(self):
        self.report_of(1, "check", "--stiffness", "500")

    def test_a_bench_of_contact(self):
        self.report_of(3, "bench", "contact", "--a", "sphere", "--b", "cube", "--steps", "1500", "--no-peer")

    def test_a_session_of_a_person(self):
        with Server("--scene", "ring", "--record", self.path("rec")) as server:
            code, _, err = finish(start_client(server.port, "--hand", "grab-and-lift", "--duration", "5s"))
            self.assertEqual(code, 0, err)
        recording, = glob.glob(self.path("rec/*.mcap"))
        folder = ("--data", self.path("data"))
        for arguments in (("new", "PERSON-1"), ("add", "PERSON-1", recording, "--calibration-s", "3"),
                          ("report", "PERSON-1", "--out", self.path("out"))):
            code, _, err = run("tandem-lab", "therapy", *arguments, *folder)
            self.assertEqual(code, 0, err)
        self.assert_good(self.path("out"), 5)
        with open(self.path("out/report.html"), encoding="utf-8") as file:
            self.assertIn("Not a medical device", file.read().split('<section class="appendix">')[0])


if __name__ == "__main__":
    unittest.main()
