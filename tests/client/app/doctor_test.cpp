// Tests the findings of the command `doctor` on simulated machines: each problem must be reported with its remedy.
#include "client/app/doctor.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>

namespace tandem::client {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using testing::HasSubstr;
using testing::SizeIs;

devices::DeviceKind kind(std::string_view name, std::vector<devices::FoundDevice> (*find)()) {
  return {name, "of this test", "sim", nullptr, find};
}

std::vector<devices::FoundDevice> none() {
  return {};
}
std::vector<devices::FoundDevice> one() {
  return {{"port 7", ""}};
}
std::vector<devices::FoundDevice> locked() {
  return {{"port 8", "you may not open it; install the udev rule"}};
}

TEST(Doctor, NamesEachDeviceAndWhyItCannotBeOpened) {
  const auto findings = find_devices({kind("sim", nullptr), kind("a", one), kind("b", locked), kind("c", none)});
  ASSERT_THAT(findings, SizeIs(2));
  EXPECT_EQ(findings[0].verdict, Verdict::kGood);
  EXPECT_THAT(findings[0].text, HasSubstr("a, port 7"));
  EXPECT_EQ(findings[1].verdict, Verdict::kBad);
  EXPECT_THAT(findings[1].remedy, HasSubstr("udev rule"));
  const auto nothing = find_devices({kind("sim", nullptr), kind("c", none)});
  ASSERT_THAT(nothing, SizeIs(1));
  EXPECT_EQ(nothing[0].verdict, Verdict::kWarning);
  EXPECT_THAT(nothing[0].remedy, HasSubstr("--device sim"));
}

TEST(Doctor, AutoSelectsTheFirstUsableDeviceAndReportsWhyOthersFail) {
  const std::vector<devices::DeviceKind> kinds{kind("sim", nullptr), kind("b", locked), kind("a", one)};
  std::vector<std::string> notes;
  const auto note = [&notes](const std::string& line) { notes.push_back(line); };
  EXPECT_EQ(devices::choose_device(false, note, kinds), "sim") << "a requested simulated hand must be selected";
  EXPECT_THAT(notes, SizeIs(0));
  EXPECT_EQ(devices::choose_device(true, note, {kind("b", locked), kind("c", none)}), "sim");
  ASSERT_THAT(notes, SizeIs(1));
  EXPECT_THAT(notes[0], HasSubstr("udev rule"));
  EXPECT_EQ(devices::choose_device(true, note, kinds), "a");
  ASSERT_THAT(notes, SizeIs(3));
  EXPECT_THAT(notes[2], HasSubstr("is used"));
}

TEST(Doctor, RightsThatWereNotGrantedComeWithTheirRemedy) {
  EXPECT_EQ(judge_rights({}, 70)[0].verdict, Verdict::kGood);
  const auto findings = judge_rights({"real-time priority 70 not granted (EPERM): raise the limit"}, 70);
  ASSERT_THAT(findings, SizeIs(1));
  EXPECT_EQ(findings[0].verdict, Verdict::kWarning);
  EXPECT_EQ(findings[0].remedy, "raise the limit");
}

TEST(Doctor, AProcessorThatTheHostTakesIsAWarningWhereItIsNotKeptAwake) {
  EXPECT_EQ(judge_idle(true, true, false).verdict, Verdict::kGood);
  EXPECT_EQ(judge_idle(false, false, true).verdict, Verdict::kGood);
  EXPECT_EQ(judge_idle(true, false, false).verdict, Verdict::kWarning);
  EXPECT_THAT(judge_idle(true, false, false).remedy, HasSubstr("--keep-awake on"));
  EXPECT_EQ(judge_idle(true, true, true).verdict, Verdict::kWarning);
  EXPECT_THAT(judge_idle(true, true, true).remedy, HasSubstr("lift the quota"));
}

TEST(Doctor, ClocksAreJudgedByTheStateOfTheKernel) {
  const auto file = std::filesystem::temp_directory_path() / ("clocksource" + std::to_string(getpid()));
  const auto verdicts = [&file](const char* name, Duration resolution) {
    std::ofstream(file) << name << "\n";
    const auto findings = judge_clocks(file, resolution);
    return std::pair(findings.at(0).verdict, findings.at(1).verdict);
  };
  EXPECT_EQ(verdicts("tsc", Duration(1)), std::pair(Verdict::kGood, Verdict::kGood));
  EXPECT_EQ(verdicts("hpet", Duration(1)), std::pair(Verdict::kWarning, Verdict::kGood));
  EXPECT_EQ(verdicts("tsc", milliseconds(4)), std::pair(Verdict::kGood, Verdict::kBad));
  std::filesystem::remove(file);
  EXPECT_EQ(judge_clocks(file, Duration(1))[0].verdict, Verdict::kWarning);
}

Histogram lateness(Duration usual, Duration rare, int rare_ticks) {
  Histogram result;
  for (int i = 0; i < 10000 - rare_ticks; ++i) result.record(usual);
  for (int i = 0; i < rare_ticks; ++i) result.record(rare);
  return result;
}

TEST(Doctor, LatenessIsJudgedByItsTail) {
  EXPECT_EQ(judge_lateness(lateness(microseconds(60), microseconds(900), 5), 0).verdict, Verdict::kGood);
  EXPECT_EQ(judge_lateness(lateness(microseconds(60), microseconds(700), 20), 0).verdict, Verdict::kWarning);
  EXPECT_EQ(judge_lateness(lateness(microseconds(60), microseconds(1500), 20), 0).verdict, Verdict::kBad);
  EXPECT_EQ(judge_lateness(lateness(microseconds(60), milliseconds(21), 1), 0).verdict, Verdict::kBad)
      << "the force is let go";
  EXPECT_EQ(judge_lateness(lateness(microseconds(60), microseconds(60), 0), 11).verdict, Verdict::kBad);
  const Finding none = judge_lateness({}, 0);
  EXPECT_EQ(none.verdict, Verdict::kBad);
  EXPECT_FALSE(none.remedy.empty());
}

TEST(Doctor, ALinkIsJudgedByItsEffectOnTheForce) {
  const LinkSample good{milliseconds(20), milliseconds(35), milliseconds(12), 3000};
  EXPECT_EQ(judge_link(good).verdict, Verdict::kGood);
  LinkSample link = good;
  link.round_trip_max = milliseconds(60);
  EXPECT_EQ(judge_link(link).verdict, Verdict::kWarning) << "it swings";
  link = {milliseconds(150), milliseconds(160), milliseconds(12), 3000};
  EXPECT_EQ(judge_link(link).verdict, Verdict::kWarning);
  link = good;
  link.longest_gap = milliseconds(115);
  EXPECT_EQ(judge_link(link).verdict, Verdict::kBad) << "the force decays during such a gap";
  link = good;
  link.states = 0;
  EXPECT_THAT(judge_link(link).remedy, HasSubstr("--transport tcp"));
  EXPECT_EQ(judge_link({milliseconds(400), milliseconds(400), milliseconds(10), 100}).verdict, Verdict::kBad);
}

TEST(Doctor, ExitCodeIsOneWhenAnythingIsBad) {
  const Finding good{"a", Verdict::kGood, "is good", "", {}};
  const Finding warning{"b", Verdict::kWarning, "could be better", "do this", {}};
  const Finding bad{"c", Verdict::kBad, "is bad", "do that", {}};
  EXPECT_EQ(doctor_exit_code({good, warning}), 0);
  EXPECT_EQ(doctor_exit_code({good, bad, warning}), 1);
  EXPECT_THAT(doctor_text({warning}),
              AllOf(HasSubstr("warning"), HasSubstr("could be better"), HasSubstr("→ do this")));
  EXPECT_EQ(doctor_json({good, bad}).at("verdict").as_string(), "bad");
}

}  // namespace
}  // namespace tandem::client
