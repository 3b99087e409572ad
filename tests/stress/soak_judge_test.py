"""Tests that soak_judge.py accepts correct data and finds each injected fault."""
import os
import sys
import tempfile
import unittest

sys.path.append(os.path.dirname(os.path.abspath(__file__)))

import soak_judge as judge  # noqa: E402

LIMITS = judge.Limits({"limits": {"force_n": 7, "torque_n_m": 0.17, "slew_n_per_s": 4000, "slew_n_m_per_s": 200}})
HEAD = ("tick,local_ns,state_age_s,displayed_force_x_n,displayed_force_y_n,displayed_force_z_n,"
        "displayed_torque_x_n_m,displayed_torque_y_n_m,displayed_torque_z_n_m\n")


def row(tick, force_n=0.0, age_s=0.01, at_s=None, torque_n_m=0.0):
    at_ns = round((tick * 0.001 if at_s is None else at_s) * 1e9)
    age = "" if age_s is None else age_s
    return f"{tick},{at_ns},{age},0,{force_n},0,0,0,{torque_n_m}\n"


def judged(rows, until_s=1e9):
    return judge.judge_trace([HEAD, *rows], "user", LIMITS, until_s)


def after_start(*rows):
    """Returns `rows` after so many quiet ticks that the exemption at the start has ended."""
    return [row(tick) for tick in range(1, judge.LATE_TICKS + 5)] + [*rows]


FIRST = judge.LATE_TICKS + 5


class Forces(unittest.TestCase):
    def assert_found(self, rows, words):
        problems = judged(rows).problems
        self.assertTrue(any(words in problem for problem in problems), problems)

    def assert_fine(self, rows):
        self.assertEqual(judged(rows).problems, [])

    def test_that_rise_and_fall_in_time_are_fine(self):
        self.assert_fine(after_start(row(FIRST, 3.9), row(FIRST + 1, 6.9), row(FIRST + 2, 4), row(FIRST + 3, 0.5)))

    def test_that_are_not_finite_are_found(self):
        self.assert_found(after_start(row(FIRST, float("nan"))), "not finite")
        self.assert_found(after_start(row(FIRST, float("inf"))), "not finite")

    def test_above_the_device_are_found(self):
        self.assert_found(after_start(row(FIRST, 3.9), row(FIRST + 1, 7.01)), "above the device's limit")
        self.assert_found(after_start(row(FIRST, torque_n_m=0.1701)), "above the device's limit")

    def test_that_step_are_found(self):
        self.assert_found(after_start(row(FIRST, 4.01)), "a step of")
        self.assert_found(after_start(row(FIRST, 3), row(FIRST + 1, -1.01)), "a step of")

    def test_may_fall_faster_in_a_longer_tick_but_not_rise(self):
        begin, later = FIRST * 0.001, (FIRST + 3) * 0.001
        up = after_start(row(FIRST, 3), row(FIRST + 1, 6), row(FIRST + 2, 0, at_s=later))
        self.assertGreater(later, begin)
        self.assert_fine(up)
        self.assert_found(after_start(row(FIRST, 0), row(FIRST + 1, 5, at_s=later)), "a step of")

    def test_fall_in_steps_after_a_late_tick(self):
        late = FIRST * 0.001 + 0.2
        self.assert_fine(after_start(row(FIRST, 4), row(FIRST + 1, 6), row(FIRST + 2, 5.6, 0.01, late)))
        self.assert_found(after_start(row(FIRST, 4), row(FIRST + 1, 6), row(FIRST + 2, 0, 0.01, late)), "a step of")

    def test_without_a_row_between_are_not_compared(self):
        self.assert_fine(after_start(row(FIRST, 0), row(FIRST + 10, 6)))

    def test_after_a_silence_are_found(self):
        grown = [row(FIRST + i, 1, 0.125 + 0.001 * i) for i in range(judge.LATE_TICKS + 1)]
        self.assert_fine(after_start(*grown))
        self.assert_found(after_start(*grown, row(FIRST + judge.LATE_TICKS + 1, 1, 0.151)), "after the last arrival")

    def test_after_a_late_tick_are_found_only_when_they_last(self):
        late_s = FIRST * 0.001 + 0.5
        held = [row(FIRST, 1)] + [row(FIRST + 1 + i, 1 - 0.01 * i, 0.5 + 0.001 * i, late_s + 0.001 * i) for i in range(judge.LATE_TICKS)]
        self.assert_fine(after_start(*held))
        tick = FIRST + 1 + judge.LATE_TICKS
        self.assert_found(after_start(*held, row(tick, 0.5, 0.5 + 0.001 * judge.LATE_TICKS, late_s + 0.001 * judge.LATE_TICKS)), "after the last arrival")

    def test_after_a_state_that_was_old_when_it_came_are_found_only_when_they_last(self):
        held = [row(FIRST, 1, 0.1)] + [row(FIRST + 1 + i, 1 - 0.01 * i, 0.16 + 0.001 * i) for i in range(judge.LATE_TICKS)]
        self.assert_fine(after_start(*held))
        self.assert_found(after_start(*held, row(FIRST + 1 + judge.LATE_TICKS, 0.5, 0.2 - 0.015)), "after the last arrival")

    def test_of_a_row_that_was_cut_off_are_none(self):
        self.assertEqual(judged([row(1), row(2)[:-9]]).rows, 1)


class Silences(unittest.TestCase):
    def test_begin_with_the_last_arrival_and_end_with_the_next(self):
        rows = [row(1, at_s=10), row(2, age_s=1.5, at_s=11.5), row(3, age_s=2.5, at_s=12.5), row(4, age_s=0.01, at_s=13)]
        self.assertEqual(judged(rows).silences, [(10.0, 13.0)])

    def test_at_the_beginning_are_of_who_has_heard_nothing(self):
        self.assertEqual(judged([row(1, age_s=None, at_s=10), row(2, age_s=0.01, at_s=12)]).silences, [(10.0, 12.0)])

    def test_of_a_new_session_begin_where_the_last_one_ended(self):
        rows = [row(1, age_s=None, at_s=10), row(2, at_s=10.1, age_s=0.0), row(3, at_s=50), row(4, age_s=None, at_s=50.1), row(5, at_s=50.3)]
        self.assertEqual([[round(at, 6) for at in one] for one in judged(rows).silences], [[10.0, 10.1], [50.0, 50.3]])

    def test_in_the_end_are_kept(self):
        self.assertEqual(judged([row(1, at_s=10), row(2, age_s=1.5, at_s=11.5)], until_s=20).silences, [(10.0, 20)])

    def test_are_explained_by_events_alone(self):
        silences = [(10, 13)]
        self.assertEqual(judge.unexplained(silences, [(10.1, 11)], 5), [])
        self.assertEqual(judge.unexplained(silences, [(9, 10.5), (10.4, 10.6)], 5), [])
        self.assertEqual(judge.unexplained(silences, [], 5), silences)
        self.assertEqual(judge.unexplained(silences, [(11, 12)], 5), silences, "it began before")
        self.assertEqual(judge.unexplained(silences, [(10, 10.5)], 2), silences, "it took too long")

    def test_of_a_program_without_a_processor_are_known(self):
        busy = judged([row(tick) for tick in range(1, 3000)])
        starved = judged([row(tick, at_s=0.01 * tick) for tick in range(1, 300)])
        self.assertTrue(busy.has_run(1, 2))
        self.assertFalse(starved.has_run(1, 2))

    def test_are_timed_from_the_events_end(self):
        self.assertEqual(judge.time_back([(10, 13)], [(10, 11.5)]), 1.5)
        self.assertEqual(judge.time_back([(10, 13)], [(1, 2)]), 0)
        self.assertEqual(judge.time_back([(10, 13)], [(10, 11), (12, 14)]), 0, "of the next one")

    def test_leave_out_when_there_was_no_server(self):
        self.assertEqual(judge.time_to_join(10, 30, [(1, 2), (5, 12), (15, 20), (28, 40)]), 11)


class Programs(unittest.TestCase):
    @staticmethod
    def life(last_mb):
        return [(at, 100 if at < 120 else last_mb) for at in range(160)]

    def test_that_grow_are_found(self):
        self.assertEqual(judge.judge_memory("server", self.life(110))[2], [])
        self.assertIn("it grows", judge.judge_memory("server", self.life(150))[2][0])
        self.assertIsNone(judge.judge_memory("server", self.life(150)[:80]))

    def test_that_end_by_themselves_are_found(self):
        self.assertEqual(judge.judge_end("user", 0, (0,), []), [])
        self.assertIn("exit code -11", judge.judge_end("user", -11, (0,), ["a word\n"])[0])

    def test_with_a_report_in_the_log_are_found(self):
        for line in ("==1==ERROR: LeakSanitizer: detected memory leaks", "==1==ERROR: AddressSanitizer: heap-use-after-free",
                     "a.cpp:1:2: runtime error: division by zero"):
            self.assertEqual(len(judge.judge_end("user", 0, (0,), [line])), 1, line)

    def test_with_a_report_in_a_file_are_found(self):
        with tempfile.TemporaryDirectory() as folder:
            self.assertEqual(judge.sanitizer_reports(folder), [])
            with open(os.path.join(folder, "report.1"), "w") as file:
                file.write("\n==1==ERROR: LeakSanitizer: detected memory leaks\n")
            self.assertIn("LeakSanitizer", judge.sanitizer_reports(folder)[0])

    def test_that_do_not_go_on_from_the_checkpoint_are_found(self):
        on = "info room a continues from its state of 900 ms ago\n"
        self.assertEqual(judge.judge_restart(1, [on], ["a"], 500, True), ([], 1))
        self.assertIn("did not go on", judge.judge_restart(1, [on], ["a", "b"], 500, True)[0][0])
        self.assertIn("from 900 ms ago", judge.judge_restart(1, [on], ["a"], 100, False)[0][0])
        damaged = "info state/checkpoint.pb cannot be read: everything begins anew\n"
        self.assertEqual(len(judge.judge_restart(1, [damaged], ["a"], 500, True)[0]), 2)

    def test_whose_rooms_fall_behind_are_found(self):
        steady = [(at, 100 * at) for at in range(60)]
        slower = [(at, 100 * min(at, 45) + 60 * max(0, at - 45)) for at in range(60)]
        self.assertEqual(judge.judge_steps("a", steady), [])
        self.assertIn("falls behind", judge.judge_steps("a", slower)[0])


if __name__ == "__main__":
    unittest.main()
