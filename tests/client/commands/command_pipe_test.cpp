// Tests the pipes for command lines and answers: each line must get its answer, even if a pipe breaks or stalls at
// either end.
#include "client/commands/command_pipe.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <optional>
#include <thread>
#include <utility>

#include "client/commands/command.hpp"

namespace tandem::client {
namespace {

constexpr auto kPatience = std::chrono::seconds(20);

class CommandPipeTest : public ::testing::Test {
 protected:
  void SetUp() override {
    signal(SIGPIPE, SIG_IGN);  // the program ignores SIGPIPE too
    ASSERT_EQ(pipe(lines_.data()), 0);
    ASSERT_EQ(pipe(answers_.data()), 0);
    pipe_.emplace(lines_[0], answers_[1]);
  }
  void TearDown() override {
    pipe_.reset();
    for (const int end : {lines_[0], lines_[1], answers_[0], answers_[1]}) {
      if (end >= 0) close(end);
    }
  }

  void write_line(const std::string& text) const {
    ASSERT_EQ(write(lines_[1], text.data(), text.size()), static_cast<ssize_t>(text.size()));
  }
  void end_lines() { close(std::exchange(lines_[1], -1)); }
  /// Returns the next line, or "" after a time-out.
  std::string taken() {
    const auto end = std::chrono::steady_clock::now() + kPatience;
    while (std::chrono::steady_clock::now() < end) {
      if (const auto line = pipe_->pop_line()) return *line;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return "none";
  }
  bool gets_over() {
    const auto end = std::chrono::steady_clock::now() + kPatience;
    while (!pipe_->is_over() && std::chrono::steady_clock::now() < end) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return pipe_->is_over();
  }
  std::string read_answers(std::size_t bytes) const {
    std::string text(bytes, ' ');
    std::size_t have = 0;
    while (have < bytes) {
      const ssize_t count = read(answers_[0], text.data() + have, bytes - have);
      if (count <= 0) break;
      have += static_cast<std::size_t>(count);
    }
    return text.substr(0, have);
  }

  std::array<int, 2> lines_{-1, -1}, answers_{-1, -1};
  std::optional<CommandPipe> pipe_;
};

TEST_F(CommandPipeTest, ALineIsReadWhenTheAnswerBeforeItIsWritten) {
  write_line("first\nsecond\n\nlast without an end");
  end_lines();
  for (const char* expected : {"first", "second", "", "last without an end"}) {
    EXPECT_EQ(taken(), expected);
    EXPECT_EQ(pipe_->pop_line(), std::nullopt) << "until it is answered";
    EXPECT_FALSE(pipe_->is_over());
    pipe_->answer("to " + std::string(expected));
  }
  EXPECT_TRUE(gets_over());
  EXPECT_EQ(read_answers(46), "to first\nto second\nto \nto last without an end\n");
  EXPECT_EQ(pipe_->problem(), "");
}

TEST_F(CommandPipeTest, OnlyTheStartOfATooLongLineIsStored) {
  const std::string chunk(4000, 'x');
  std::thread writer([&] {
    for (int i = 0; i < 500; ++i) write_line(chunk);
    write_line("\nnext\n");
  });
  EXPECT_EQ(taken().size(), kMaxCommandBytes + 1);
  writer.join();
  pipe_->answer("too long");
  EXPECT_EQ(taken(), "next");
}

TEST_F(CommandPipeTest, NoCommandsAreReadWhileAnswersAreNotRead) {
  const std::string answer(60'000, 'a');
  write_line("1\n2\n3\n");
  for (int i = 0; i < 2; ++i) {
    EXPECT_NE(taken(), "none");
    pipe_->answer(answer);
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_EQ(pipe_->pop_line(), std::nullopt) << "the second answer does not fit into the pipe";
  EXPECT_EQ(read_answers(2 * answer.size() + 2), answer + "\n" + answer + "\n") << "and none of it is lost";
  EXPECT_EQ(taken(), "3");
}

TEST_F(CommandPipeTest, AnswersWithoutAReaderEndIt) {
  write_line("1\n2\n");
  EXPECT_EQ(taken(), "1");
  close(std::exchange(answers_[0], -1));
  pipe_->answer("nobody reads this");
  EXPECT_TRUE(gets_over());
  EXPECT_EQ(pipe_->problem(), "Broken pipe");
}

TEST_F(CommandPipeTest, FinishWritesTheLastAnswerAndWaitsForNoReader) {
  write_line("1\n2\n");
  EXPECT_EQ(taken(), "1");
  pipe_->answer("done");
  pipe_->finish();
  EXPECT_TRUE(pipe_->is_over());
  EXPECT_EQ(read_answers(5), "done\n");
}

TEST_F(CommandPipeTest, FinishWaitsOnlyBrieflyForAReaderThatIsStuck) {
  write_line("1\n");
  EXPECT_EQ(taken(), "1");
  pipe_->answer(std::string(200'000, 'a'));
  const auto begin = std::chrono::steady_clock::now();
  pipe_->finish();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5));
  EXPECT_EQ(pipe_->problem(), "its reader read none before the program ended");
}

TEST_F(CommandPipeTest, AnInputThatCannotBeReadIsOver) {
  constexpr int kNotOpen = 900;
  CommandPipe closed(kNotOpen, answers_[1]);
  const auto end = std::chrono::steady_clock::now() + kPatience;
  while (!closed.is_over() && std::chrono::steady_clock::now() < end) std::this_thread::yield();
  EXPECT_TRUE(closed.is_over());
}

}  // namespace
}  // namespace tandem::client
