// Tests the files of a recording: they rotate, never overwrite a file, and stay valid when the disk is full.
#include "common/recording/recording_file.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <fstream>

#include "common/recording/mcap_reader.hpp"
#include "common/recording/recorder_thread.hpp"

namespace tandem::recording {
namespace {

namespace fs = std::filesystem;

Bytes octets_of_text(const std::string& text) {
  return {text.begin(), text.end()};
}

class RecordingFileTest : public ::testing::Test {
 protected:
  RecordingFileTest() {
    const char* const name = ::testing::UnitTest::GetInstance()->current_test_info()->name();
    folder_ = fs::temp_directory_path() / ("tandem_" + std::string(name) + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  ~RecordingFileTest() override { fs::remove_all(folder_); }

  RecordingFile open(const RotationSettings& rotation = {}) {
    return RecordingFile(folder_ / "r.mcap", McapWriter({{"/head", "H", {}}, {"/m", "M", {}}}, "test"), rotation,
                         [](std::uint32_t part) { return octets_of_text("part " + std::to_string(part)); });
  }
  static std::vector<std::string> messages_in(const fs::path& file, bool expects_end = true) {
    std::ifstream in(file, std::ios::binary);
    McapReader reader(in);
    std::vector<std::string> messages;
    while (const auto message = reader.next()) messages.emplace_back(message->data.begin(), message->data.end());
    EXPECT_EQ(reader.end() == McapReader::End::kWhole, expects_end) << file << ": " << reader.why();
    return messages;
  }

  fs::path folder_;
};

TEST_F(RecordingFileTest, FlushedMessagesAreReadableBeforeTheEnd) {
  RecordingFile file = open();
  file.add(1, 10, octets_of_text("first"));
  file.flush(10);
  file.add(1, 11, octets_of_text("not yet"));
  EXPECT_EQ(messages_in(folder_ / "r.mcap", false), (std::vector<std::string>{"part 1", "first"}));
  file.finish();
  EXPECT_EQ(messages_in(folder_ / "r.mcap").back(), "not yet");
}

TEST_F(RecordingFileTest, RotatesBySizeAndEachPartDescribesItself) {
  RecordingFile file = open({.max_bytes = 2000, .max_age = Duration(0)});
  std::uint64_t state = 1;
  for (std::uint64_t i = 1; i <= 20; ++i) {
    std::string noise;  // incompressible random bytes
    for (int k = 0; k < 300; ++k) noise += static_cast<char>((state = state * 6364136223846793005U + 1) >> 56U);
    file.add(1, i, octets_of_text(noise));
    file.flush(i);
  }
  file.finish();
  ASSERT_GT(file.parts(), 2U);
  std::size_t messages = 0;
  for (std::uint32_t part = 1; part <= file.parts(); ++part) {
    const fs::path path = folder_ / (part == 1 ? "r.mcap" : "r-00" + std::to_string(part) + ".mcap");
    const auto in_part = messages_in(path);
    if (in_part.empty()) continue;  // the last part may be empty
    EXPECT_EQ(in_part.front(), "part " + std::to_string(part));
    messages += in_part.size() - 1;
    EXPECT_LT(fs::file_size(path), 4000U);
  }
  EXPECT_EQ(messages, 20U);
}

TEST_F(RecordingFileTest, RotatesByAge) {
  RecordingFile file = open({.max_bytes = 0, .max_age = std::chrono::seconds(1)});
  for (const std::uint64_t s : {100, 101, 102, 103}) {
    file.add(1, s * 1'000'000'000U, octets_of_text("at " + std::to_string(s)));
    file.flush(s * 1'000'000'000U);
  }
  file.finish();
  EXPECT_EQ(file.parts(), 2U);
  EXPECT_EQ(messages_in(folder_ / "r-002.mcap"), (std::vector<std::string>{"part 2", "at 103"}));
}

TEST_F(RecordingFileTest, OverwritesNothing) {
  std::ofstream(folder_ / "r.mcap") << "somebody else's";
  EXPECT_THROW(open(), std::invalid_argument);
  fs::remove(folder_ / "r.mcap");
  std::ofstream(folder_ / "r-002.mcap") << "somebody else's";
  RecordingFile file = open({.max_bytes = 1, .max_age = Duration(0)});
  file.add(1, 1, octets_of_text("one"));
  file.flush(1);
  file.add(1, 2, octets_of_text("two"));
  file.finish();
  EXPECT_EQ(fs::file_size(folder_ / "r-002.mcap"), 15U);
  EXPECT_EQ(messages_in(folder_ / "r-003.mcap"), (std::vector<std::string>{"part 2", "two"}));
}

/// While an object exists, it limits the file size. A full disk has the same effect, except for the value of errno.
class SmallDisk {
 public:
  explicit SmallDisk(rlim_t bytes) : before_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &limit_);
    rlimit small = limit_;
    small.rlim_cur = bytes;
    setrlimit(RLIMIT_FSIZE, &small);
  }
  ~SmallDisk() {
    setrlimit(RLIMIT_FSIZE, &limit_);
    std::signal(SIGXFSZ, before_);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;

 private:
  rlimit limit_{};
  void (*before_)(int);
};

TEST_F(RecordingFileTest, AFullDiskLosesMessagesAndIsReportedOnce) {
  RecordingFile file = open();
  file.add(1, 1, octets_of_text("before"));
  file.flush(1);
  EXPECT_EQ(file.pop_news(), "");
  {
    const SmallDisk small(file.bytes_written() + 20);  // space for only a part of the chunk
    for (const std::uint64_t i : {2, 3}) {
      file.add(1, i, octets_of_text("lost"));
      file.flush(i);
    }
    const std::string news = file.pop_news();
    EXPECT_NE(news.find("cannot be written"), std::string::npos) << news;
    EXPECT_EQ(file.pop_news(), "");
    EXPECT_EQ(messages_in(folder_ / "r.mcap", false).back(), "before") << "whole chunks alone stay";
  }
  constexpr std::uint64_t kSecondNs = 1'000'000'000;
  file.add(1, 4, octets_of_text("after"));
  file.flush(4 * kSecondNs);
  EXPECT_EQ(file.pop_news(), "") << "a small chunk must fit on a disk that is nearly full";
  {
    const SmallDisk small(file.bytes_written() + 20);
    file.add(1, 5, octets_of_text("lost"));
    file.flush(5 * kSecondNs);
    EXPECT_EQ(file.pop_news(), "") << "reported before";
  }
  file.add(1, 6, octets_of_text("and"));
  file.flush(6 * kSecondNs);
  EXPECT_EQ(file.pop_news(), "");
  file.add(1, 7, octets_of_text("on"));
  file.flush(10 * kSecondNs);
  EXPECT_NE(file.pop_news().find("again"), std::string::npos);
  EXPECT_EQ(file.messages_lost(), 3U);
  file.finish();
  EXPECT_EQ(messages_in(folder_ / "r.mcap"), (std::vector<std::string>{"part 1", "before", "after", "and", "on"}));
}

TEST(RecorderThread, WorksOnceMoreAfterItWasStopped) {
  std::atomic<int> calls{0};
  RecorderThread thread(std::chrono::milliseconds(1), [&calls] { ++calls; });
  while (calls < 3) std::this_thread::yield();
  const int before = calls;
  thread.stop();
  EXPECT_GT(calls, before);
}

}  // namespace
}  // namespace tandem::recording
