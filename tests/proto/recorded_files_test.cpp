// Tests reading a rotated recording whose files are damaged, missing, or belong to another recording.
#include "proto/recording/recorded_files.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/recording/mcap_writer.hpp"
#include "proto/recording/schema.hpp"
#include "tandem/recording.pb.h"

namespace tandem::proto {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

class RecordedFiles : public ::testing::Test {
 protected:
  RecordedFiles() { fs::create_directories(folder_); }
  ~RecordedFiles() override { fs::remove_all(folder_); }

  /// Writes a file with three chunks of ten steps of 10 ms each. Without `has_end` the end of the file is missing, as
  /// after a crash of the program.
  void write(const std::string& name, std::uint64_t recording, std::uint32_t part, bool has_end = true) {
    recording::McapWriter writer({channel_of("/room", wire::RecordedRoom()), channel_of("/step", wire::RecordedStep())},
                                 "test");
    recording::Bytes file = writer.begin();
    const auto append = [&file](const recording::Bytes& bytes) { file.insert(file.end(), bytes.begin(), bytes.end()); };
    wire::RecordedRoom room;
    room.set_recording(recording);
    room.set_part(part);
    std::uint64_t time_ns = 1'700'000'000'000'000'000U + (part - 1) * 300'000'000U;
    writer.add(0, time_ns, bytes_of(room));
    chunks_at_.clear();
    for (int chunk = 0; chunk < 3; ++chunk) {
      for (int i = 0; i < 10; ++i) {
        wire::RecordedStep step;
        step.set_step(++step_);
        writer.add(1, time_ns += 10'000'000, bytes_of(step));
      }
      chunks_at_.push_back(file.size());
      append(writer.pop_chunk());
    }
    if (has_end) append(writer.finish());
    std::ofstream(folder_ / name, std::ios::binary)
        .write(reinterpret_cast<const char*>(file.data()), static_cast<std::streamsize>(file.size()));
  }

  void change(const std::string& name, std::uint64_t at) {
    std::fstream file(folder_ / name, std::ios::binary | std::ios::in | std::ios::out);
    file.seekp(static_cast<std::streamoff>(at));
    file.put('x');
  }

  RecordingEnd read() {
    steps_ = 0;
    return read_recording(folder_ / "r.mcap", [this](const std::string& topic, const auto&) {
      steps_ += topic == "/step" ? 1 : 0;
      return true;
    });
  }

  fs::path folder_ = fs::temp_directory_path() / ("recorded_files_" + std::to_string(::getpid()));
  std::vector<std::uint64_t> chunks_at_;
  std::uint64_t step_ = 0;
  int steps_ = 0;
};

TEST_F(RecordedFiles, CompleteFilesAreReadAsOne) {
  write("r.mcap", 7, 1);
  write("r-002.mcap", 7, 2);
  const RecordingEnd end = read();
  EXPECT_EQ(steps_, 60);
  EXPECT_TRUE(end.is_whole);
  EXPECT_FALSE(end.is_damaged);
  EXPECT_EQ(end.why, "");
}

TEST_F(RecordedFiles, AProgramThatWasStoppedLeavesAFileWithoutItsEndThatIsNotDamaged) {
  write("r.mcap", 7, 1, false);
  const RecordingEnd end = read();
  EXPECT_EQ(steps_, 30);
  EXPECT_FALSE(end.is_whole);
  EXPECT_FALSE(end.is_damaged);
  EXPECT_THAT(end.why, HasSubstr("31 messages, the last 0.300 s after the first"));
}

TEST_F(RecordedFiles, DamageIsNamedWithFileByteMessagesTimeAndRemedy) {
  write("r.mcap", 7, 1);
  change("r.mcap", chunks_at_[1] + 60);
  const RecordingEnd end = read();
  EXPECT_EQ(steps_, 10);
  EXPECT_TRUE(end.is_damaged);
  EXPECT_FALSE(end.is_whole);
  EXPECT_THAT(end.why, HasSubstr((folder_ / "r.mcap").string() + ": "));
  EXPECT_THAT(end.why, HasSubstr("at byte " + std::to_string(chunks_at_[1]) + " of " +
                                 std::to_string(fs::file_size(folder_ / "r.mcap"))));
  EXPECT_THAT(end.why, HasSubstr("11 messages, the last 0.100 s after the first"));
  EXPECT_THAT(end.why, HasSubstr("copy the file again"));
}

TEST_F(RecordedFiles, AFileThatWasCutIsDamagedAndTheNextIsStillRead) {
  write("r.mcap", 7, 1);
  fs::resize_file(folder_ / "r.mcap", chunks_at_[2] + 20);
  write("r-002.mcap", 7, 2);
  const RecordingEnd end = read();
  EXPECT_EQ(steps_, 50);
  EXPECT_TRUE(end.is_damaged);
  EXPECT_THAT(end.why, HasSubstr("within a record"));
  EXPECT_THAT(end.why, Not(HasSubstr("r-002.mcap")));
}

TEST_F(RecordedFiles, AMissingPartIsNamed) {
  write("r.mcap", 7, 1);
  write("r-004.mcap", 7, 4);
  const RecordingEnd end = read();
  EXPECT_EQ(steps_, 60);
  EXPECT_TRUE(end.is_damaged);
  EXPECT_THAT(end.why, HasSubstr("r-004.mcap: 2 parts of the recording before it are missing"));
}

TEST_F(RecordedFiles, OfAnotherRecordingBetweenThemAreSkipped) {
  write("r.mcap", 7, 1);
  write("r-002.mcap", 8, 1);
  write("r-003.mcap", 7, 2);
  const RecordingEnd end = read();
  EXPECT_EQ(steps_, 60);
  EXPECT_EQ(end.files.size(), 2U);
  EXPECT_FALSE(end.is_damaged) << end.why;
}

TEST_F(RecordedFiles, ATopicThatWasDamagedInAFileWithoutItsEndIsNoticed) {
  write("r.mcap", 7, 1, false);
  std::fstream file(folder_ / "r.mcap", std::ios::binary | std::ios::in | std::ios::out);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  file.close();
  change("r.mcap", bytes.find("/step") + 1);
  const RecordingEnd end = read();
  EXPECT_EQ(steps_, 0);
  EXPECT_TRUE(end.is_damaged);
  EXPECT_THAT(end.why, HasSubstr("30 of them have a topic that is none of a recording"));
}

TEST_F(RecordedFiles, AMessageThatCannotBeReadIsNoSilence) {
  recording::Message message;
  const recording::Bytes bytes{0xff, 0xff};
  message.data = bytes;
  wire::RecordedStep step;
  EXPECT_THROW(require_recorded(message, step), std::invalid_argument);
}

TEST_F(RecordedFiles, WithoutAMessageIsRefusedWithTheReason) {
  write("r.mcap", 7, 1);
  change("r.mcap", chunks_at_[0] + 60);
  try {
    read();
    FAIL() << "it was read";
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), HasSubstr("no message can be read"));
    EXPECT_THAT(error.what(), HasSubstr("at byte " + std::to_string(chunks_at_[0])));
  }
}

}  // namespace
}  // namespace tandem::proto
