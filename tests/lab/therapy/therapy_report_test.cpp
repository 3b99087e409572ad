#include "lab/therapy/therapy_report.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lab/report/csv.hpp"

namespace tandem::lab {
namespace {

using testing::HasSubstr;
using testing::Not;

StoredSession session_of(int number, const std::string& level) {
  StoredSession stored{.number = number, .measures = {}};
  SessionMeasures& session = stored.measures;
  session.begun_utc = "2026-12-0" + std::to_string(number) + "T10:00:00Z";
  session.scene = "ring";
  session.calibration = MotionRange{{-0.1, -0.2, -0.3}, {0.1, 0.2, 0.3}, {0, 0, 0.1}};
  session.parts.push_back({.kind = PartKind::kSession,
                           .outcome = PartOutcome::kReached,
                           .name = "session",
                           .time_s = 60,
                           .moving_s = 20,
                           .path_m = 2.5,
                           .score = 14,
                           .force_mean_n = 1.5,
                           .force_peak_n = 4,
                           .smoothness = -2.0 + 0.2 * number,
                           .smoothness_low = -2.5,
                           .smoothness_high = -1.5,
                           .movements = 12});
  session.parts.back().range = MotionRange{{-0.05, -0.1, 0}, {0.05, 0.1, 0.1}, {0, 0, 0}};
  session.parts.push_back({.kind = PartKind::kLevel, .outcome = PartOutcome::kReached, .name = level, .time_s = 30});
  session.parts.push_back({.kind = PartKind::kGoal, .outcome = PartOutcome::kFailed, .name = level, .time_s = 10});
  session.movements = {{1, 0.5, 0.2, 0.75, -1.5}, {3, 0.7, 0.3, 0.8, -1.6}};
  return stored;
}

std::string first_page(const std::string& html) {
  return html.substr(0, html.find("<section class=\"appendix\">"));
}

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t number = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++number;
  return number;
}

TEST(TherapyReport, SaysThatItIsNoMedicalDeviceAndHasThreeFiguresOnItsFirstPage) {
  const std::vector<StoredSession> sessions{session_of(1, "first"), session_of(2, "first")};
  const std::string html = therapy_report("P-1234", sessions, 1).html();
  EXPECT_THAT(first_page(html), HasSubstr("Not a medical device"));
  EXPECT_EQ(count(first_page(html), "<svg"), 3U);
  EXPECT_THAT(first_page(html), HasSubstr("12 movements in 60 s, median smoothness \u22121.60, range of motion "
                                          "100 × 200 × 100 mm. 1 level reached, score 14. Since session 1 the "
                                          "smoothness changed by +0.20."));
  EXPECT_THAT(html, HasSubstr("Of the calibrated range of motion the session used 50 % along x, 50 % along y, 17 %"));
  EXPECT_THAT(measures_csv(sessions), HasSubstr("\"Not a medical device"));
}

TEST(TherapyReport, EscapesEveryText) {
  const std::string evil = "<script>alert(1)</script>\" onload='x'";
  std::vector<StoredSession> sessions{session_of(1, evil)};
  sessions[0].measures.scene = evil;
  const auto files = therapy_report("P-1234", sessions, 0).files();
  for (const auto& [name, text] : files) {
    if (name.ends_with(".csv")) continue;
    EXPECT_THAT(text, Not(HasSubstr("<script"))) << name;
    EXPECT_THAT(text, Not(HasSubstr("onload='x'"))) << name;
  }
  EXPECT_THAT(files.at("report.html"), HasSubstr("&lt;script&gt;"));
}

TEST(TherapyReport, ATableHasNoFormulaForASpreadsheet) {
  for (const std::string name : {"=cmd()", "+1", "-1", "@x"}) {
    const std::string csv = measures_csv(std::vector{session_of(1, name)});
    EXPECT_THAT(csv, HasSubstr("level,\"'" + name + "\","));
  }
  EXPECT_THAT(measures_csv(std::vector{session_of(1, "a\"b\nc")}), HasSubstr("\"a\"\"b"));
}

TEST(TherapyReport, MovementsAreReadBack) {
  const StoredSession stored = session_of(1, "level");
  const CsvTable table = parse_csv(movements_csv(stored.measures), "movements.csv");
  EXPECT_EQ(table.column("smoothness_sparc"), (std::vector{-1.5, -1.6}));
  EXPECT_EQ(table.column("peak_speed_m_per_s"), (std::vector{0.75, 0.8}));
}

TEST(TherapyReport, OfASessionWithoutMovementsHasNoEmptyFigure) {
  StoredSession stored{.number = 1, .measures = {}};
  stored.measures.begun_utc = "2026-12-01T10:00:00Z";
  stored.measures.parts.push_back({.name = "session", .time_s = 1});
  const std::string html = therapy_report("P-1234", std::vector{stored}, 0).html();
  EXPECT_EQ(count(first_page(html), "<svg"), 0U);
  EXPECT_THAT(html, HasSubstr("0 movements in 1 s, median smoothness \u2013"));
}

}  // namespace
}  // namespace tandem::lab
