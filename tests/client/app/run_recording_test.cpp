// Tests the file name and the messages of a recording that the user starts in the window.
#include "client/app/run_recording.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>

namespace tandem::client {
namespace {

using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

TEST(RunRecording, TheNextFileIsBesideThatOfTheCommandLineAndNamedByTheTime) {
  // Time stamp of 2026-11-24 04:05:06 UTC.
  const std::chrono::system_clock::time_point at{std::chrono::seconds(1'795'493'106)};
  ClientOptions options;
  EXPECT_EQ(next_recording_file(options, at), std::filesystem::current_path() / "tandem-20261124T040506Z.mcap");
  options.record = "anna.mcap";
  EXPECT_EQ(next_recording_file(options, at), std::filesystem::current_path() / "tandem-20261124T040506Z.mcap");
  options.record = "/some/where/anna.mcap";
  EXPECT_EQ(next_recording_file(options, at), "/some/where/tandem-20261124T040506Z.mcap");
}

TEST(RunRecording, ReportsTheFileItsLengthItsSizeAndOmissions) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "run_recording";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  ClientOptions options;
  options.io.client.session.user_name = "anna";
  {
    ClientRecorder recorder(recording_settings(options, folder / "a.mcap"), [](const std::string&) {});
    recorder.add(TickRecord{}, 0);
    recorder.finish();
    const std::string line = recording_line(recorder, std::chrono::seconds(12));
    char size[32];
    std::snprintf(size, sizeof size, "%.2f MB",
                  static_cast<double>(std::filesystem::file_size(folder / "a.mcap")) / 1e6);
    EXPECT_THAT(line, StartsWith((folder / "a.mcap").string() + ": 12 s, " + size));
    EXPECT_THAT(line, Not(HasSubstr("left out")));
    const boost::json::object json = recording_json(recorder);
    EXPECT_EQ(json.at("messages").to_number<int>(), 2) << "description of the session, and the tick";
    EXPECT_EQ(json.at("bytes").to_number<std::uint64_t>(), std::filesystem::file_size(folder / "a.mcap"));
  }
  EXPECT_THROW(ClientRecorder(recording_settings(options, folder / "a.mcap"), {}), std::invalid_argument)
      << "the file exists";
  // Adds more records at once than the ring buffer holds; the excess must be counted as lost.
  ClientRecorder slow(recording_settings(options, folder / "b.mcap"), [](const std::string&) {});
  for (int i = 0; i < 100'000; ++i) slow.add(TickRecord{}, 0);
  slow.finish();
  EXPECT_GT(slow.lost(), 0U);
  EXPECT_THAT(recording_line(slow, std::chrono::seconds(1)),
              HasSubstr(std::to_string(slow.lost()) + " messages left out"));
  EXPECT_THAT(recording_line(slow, std::chrono::seconds(1)), HasSubstr("does not keep up"));
}

TEST(RunRecordings, AreBegunAndEndedByTheButtonAndNoneIsLostFromTheSummary) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "run_recordings";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  ClientOptions options;
  options.record = folder / "first.mcap";
  RunRecordings recordings(options, [](const std::string&) {});
  EXPECT_EQ(recordings.state(), "");
  recordings.add(TickRecord{}, 0);  // no recording is active, so the record is discarded
  recordings.begin(options.record);
  EXPECT_THAT(recordings.state(), StartsWith("recording " + options.record.string()));
  recordings.add(TickRecord{}, 0);
  EXPECT_THAT(recordings.toggle(), StartsWith("recorded " + options.record.string()));
  EXPECT_FALSE(recordings.is_recording());
  EXPECT_THAT(recordings.toggle(), StartsWith("recording " + (folder / "tandem-").string()));
  recordings.end();
  boost::json::object summary;
  recordings.add_to(summary);
  EXPECT_EQ(summary.at("earlier_recordings").as_array().size(), 1U);
  EXPECT_EQ(summary.at("earlier_recordings").as_array()[0].at("messages").to_number<int>(), 2);
  EXPECT_EQ(recordings.lost(), 0U);
}

TEST(RunRecordings, ReportOneThatCannotBegin) {
  ClientOptions options;
  options.record = "/nonexistent/a.mcap";
  RunRecordings recordings(options, [](const std::string&) {});
  EXPECT_THROW(recordings.begin(options.record), std::invalid_argument);
  EXPECT_THAT(recordings.toggle(), HasSubstr("/nonexistent"));
  EXPECT_THAT(recordings.state(), HasSubstr("/nonexistent"));
  EXPECT_FALSE(recordings.is_recording());
}

}  // namespace
}  // namespace tandem::client
