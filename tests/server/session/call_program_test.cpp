// Tests the program of --on-call: its arguments, its time limit, and its failures.
#include "server/session/call_program.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <mutex>
#include <thread>

namespace tandem::server {
namespace {

using ::testing::HasSubstr;

class CallProgramTest : public ::testing::Test {
 protected:
  CallProgramTest() { std::filesystem::create_directories(folder); }
  ~CallProgramTest() override { std::filesystem::remove_all(folder); }

  std::filesystem::path script(const std::string& body) const {
    const std::filesystem::path file = folder / "call me";
    std::ofstream(file) << "#!/bin/sh\n" << body << "\n";
    ::chmod(file.c_str(), S_IRWXU);
    return file;
  }
  std::function<void(const std::string&)> to_news() {
    return [this](const std::string& line) {
      const std::lock_guard lock(mutex);
      news.push_back(line);
    };
  }
  /// Returns whether a process runs. A zombie, i.e. a terminated process whose exit code nobody has read, does not run.
  static bool is_running(const std::string& process) {
    const std::string stat = text_of("/proc/" + process + "/stat");
    const std::size_t state = stat.rfind(')') + 2;
    return state < stat.size() && stat[state] != 'Z' && stat[state] != 'X';
  }
  /// Waits until `count` messages for the operator have arrived.
  void await(std::size_t count) {
    for (int i = 0; i < 10'000; ++i) {
      {
        const std::lock_guard lock(mutex);
        if (news.size() >= count) return;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    FAIL() << "the program did not end";
  }
  static std::string text_of(const std::filesystem::path& file) {
    std::ifstream in(file);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("tandem_call" + std::to_string(::getpid()));
  std::mutex mutex;
  std::vector<std::string> news;
};

TEST_F(CallProgramTest, ItsArgumentsAreRoomAndReasonWithoutAShell) {
  const std::filesystem::path out = folder / "out";
  CallProgram program(script("printf '%s|' \"$@\" >> '" + out.string() + "'"), to_news());
  program.call("a b; exit 3", "$(time) limit");
  await(1);
  EXPECT_EQ(text_of(out), "a b; exit 3|$(time) limit|");
  EXPECT_THAT(news[0], HasSubstr("exit code 0"));
  program.finish();
  EXPECT_EQ(news.size(), 1U) << "one run for one call";
}

TEST_F(CallProgramTest, AFailureIsReported) {
  CallProgram program(script("exit 7"), to_news());
  program.call("room", "time-limit");
  await(1);
  EXPECT_THAT(news[0], HasSubstr("failed: exit code 7"));
}

TEST_F(CallProgramTest, AProgramThatDoesNotEndIsKilledWithItsChildren) {
  const std::filesystem::path child = folder / "child";
  CallProgram program(script("sleep 100 & echo $! > '" + child.string() + "'; wait"), to_news(),
                      std::chrono::milliseconds(500));
  program.call("room", "time-limit");
  await(1);
  EXPECT_THAT(news[0], HasSubstr("killed after"));
  std::string process = text_of(child);
  ASSERT_FALSE(process.empty()) << "the program has not begun its child within its time";
  process.pop_back();
  for (int i = 0; i < 5000 && is_running(process); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_FALSE(is_running(process)) << "child " << process;
}

TEST_F(CallProgramTest, TheProgramInheritsNoFilesOfTheServer) {
  int pipe_ends[2];
  // Like the server's sockets, the pipe is not closed automatically when a program is started (no O_CLOEXEC).
  ASSERT_EQ(::pipe(pipe_ends), 0);
  const std::filesystem::path out = folder / "out";
  CallProgram program(script("for file in /proc/$$/fd/*; do readlink \"$file\"; done > '" + out.string() + "'"),
                      to_news());
  program.call("room", "time-limit");
  await(1);
  for (const int end : pipe_ends) {
    std::error_code error;
    const auto name = std::filesystem::read_symlink("/proc/self/fd/" + std::to_string(end), error).string();
    EXPECT_EQ(text_of(out).find(name), std::string::npos) << name << " among\n" << text_of(out);
    ::close(end);
  }
}

TEST_F(CallProgramTest, AnEndIsSeenEvenIfSigchldIsIgnored) {
  const auto before = ::signal(SIGCHLD, SIG_IGN);
  CallProgram program(script("exit 0"), to_news(), std::chrono::seconds(5));
  program.call("room", "time-limit");
  await(1);
  ::signal(SIGCHLD, before);
  EXPECT_THAT(news[0], HasSubstr("unknown exit code"));
}

TEST_F(CallProgramTest, CallsThatWaitAtTheStopAreReported) {
  CallProgram program(script("sleep 100"), to_news());
  for (const char* room : {"first", "second", "third"}) program.call(room, "time-limit");
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  program.finish();
  ASSERT_EQ(news.size(), 3U);
  EXPECT_THAT(news[1], HasSubstr("for room second (time-limit) was not run: the server stops"));
  EXPECT_THAT(news[2], HasSubstr("for room third"));
}

TEST_F(CallProgramTest, MoreCallsThanItsQueueHoldsAreReported) {
  CallProgram program(script("sleep 100"), to_news());
  for (std::size_t i = 0; i < CallProgram::kMaxWaiting + 3; ++i) program.call("room", "time-limit");
  await(1);
  EXPECT_THAT(news[0], HasSubstr("too many calls"));
}

TEST_F(CallProgramTest, AFileThatCannotBeExecutedIsASetUpError) {
  for (const std::filesystem::path& wrong : {folder, folder / "absent", std::filesystem::path("/etc/passwd")}) {
    try {
      CallProgram program(wrong, to_news());
      FAIL() << wrong;
    } catch (const std::invalid_argument& error) {
      EXPECT_THAT(error.what(), HasSubstr("--on-call: " + wrong.string() + " cannot be executed; give"));
    }
  }
}

}  // namespace
}  // namespace tandem::server
