// Tests that each command line gets exactly one answer, for any content and any state of the session. The client is
// never started, so its requests are answered only when the session ends.
#include "client/commands/command_run.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <random>
#include <thread>
#include <utility>

#include "client/commands/command.hpp"
#include "common/base/json.hpp"
#include "devices/sim/sim_device.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::client {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class CommandRunTest : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(pipe(lines_.data()), 0);
    ASSERT_EQ(pipe(answers_.data()), 0);
    wire::Joined joined;
    joined.mutable_scene()->add_bodies()->set_name("helix_a");
    joined.mutable_scene()->mutable_molecular_field()->set_metres_per_angstrom(0.01);
    io_.joined = std::make_shared<const wire::Joined>(joined);
    io_.status.state = SessionState::kActive;
    io_.has_state = true;
    view_.has_state = true;
    view_.record.held_body = BodyId{1};
    view_.newest.update.field_energy_kj_per_mol = -12.5;
    proto::BodyState body;
    body.id = BodyId{1};
    view_.received_bodies.push_back(body);
    run_.emplace(client_, std::make_shared<devices::Pointer>(), lines_[0], answers_[1]);
    reader_ = std::thread([this] { read_answers(); });
  }
  void TearDown() override {
    run_.reset();
    close(answers_[1]);
    if (reader_.joinable()) reader_.join();
    for (const int end : {lines_[0], answers_[0]}) close(end);
  }

  void read_answers() {
    std::array<char, 4096> buffer{};
    for (ssize_t count = 0; (count = read(answers_[0], buffer.data(), buffer.size())) > 0;) {
      text_.append(buffer.data(), static_cast<std::size_t>(count));
    }
  }
  /// Sends the lines and returns all answers. `each` is called with the number of the poll before each poll.
  std::vector<boost::json::object> answers_to(const std::string& lines, const std::function<void(int)>& each = {}) {
    std::thread writer([&] {
      for (std::size_t at = 0; at < lines.size();) {
        const ssize_t count = write(lines_[1], lines.data() + at, lines.size() - at);
        if (count <= 0) break;
        at += static_cast<std::size_t>(count);
      }
      close(lines_[1]);
    });
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(120);
    for (int i = 0; !run_->is_over() && std::chrono::steady_clock::now() < end; ++i) {
      now_ += std::chrono::seconds(1);  // virtual time, so that delays and time-outs elapse at once
      if (each) each(i);
      run_->poll(io_, &view_, now_);
      std::this_thread::yield();
    }
    EXPECT_TRUE(run_->is_over());
    run_->finish();
    writer.join();
    close(std::exchange(answers_[1], -1));
    reader_.join();
    std::vector<boost::json::object> answers;
    for (std::size_t at = 0; at < text_.size();) {
      const std::size_t line_end = text_.find('\n', at);
      answers.push_back(boost::json::parse(text_.substr(at, line_end - at)).as_object());
      at = line_end + 1;
    }
    return answers;
  }

  devices::SimDevice device_{devices::SimDevice::default_spec(), devices::HandParameters(),
                             devices::named_hand_path("rest"), 1};
  ClientIo client_{ClientIoSettings(), device_};
  ClientIoSnapshot io_;
  View view_;
  LocalTime now_{std::chrono::seconds(5)};
  std::array<int, 2> lines_{-1, -1}, answers_{-1, -1};
  std::string text_;
  std::optional<CommandRun> run_;
  std::thread reader_;
};

std::string error_in(const boost::json::object& answer) {
  return answer.at("ok").as_bool() ? "ok" : std::string(answer.at("error").as_string());
}

/// Returns a line that a hostile user could send: a command with valid or invalid fields, or random bytes.
std::string generated_line(std::mt19937_64& random) {
  static const auto usages = command_usages();
  const auto any = [&random](std::size_t count) { return static_cast<std::size_t>(random() % count); };
  static const std::vector<std::string> kFields{"0",   "0.1",      "-1", "1e308", "nan", "",
                                                "\"",  "\"a b\"",  "#1", "near",  "1",   "-",
                                                "180", "\\\"\\\\", "\t", "#",     "é",   "9999999999"};
  std::string line;
  if (any(10) == 0) {
    line.resize(any(2000));
    for (char& c : line) c = static_cast<char>(any(256));
    std::erase(line, '\n');
    return line;
  }
  // The command "quit" is excluded, because it would end the run before the remaining lines.
  do {
    line = command_word(usages[any(usages.size())].first);
  } while (line == "quit");
  for (std::size_t i = any(6); i > 0; --i) line += " " + kFields[any(kFields.size())];
  return line;
}

TEST_F(CommandRunTest, EachOfManyGeneratedLinesGetsExactlyOneAnswer) {
  std::mt19937_64 random(test::test_seed(20261130));
  constexpr std::size_t kLines = 1000;
  std::string lines;
  std::vector<std::string> words;
  for (std::size_t i = 0; i < kLines; ++i) {
    const std::string line = generated_line(random);
    words.push_back(command_word(line));
    lines += line + "\n";
  }
  // The session ends in every 20th poll, which answers the pending requests. The hand holds a body in three of seven
  // polls.
  const auto answers = answers_to(lines, [&](int i) {
    io_.status.state = i % 20 == 19 ? SessionState::kEnded : SessionState::kActive;
    view_.record.held_body = BodyId{i % 7 < 3 ? 1U : 0U};
    view_.record.sample.is_valid = i % 5 != 0;
  });
  ASSERT_EQ(answers.size(), kLines);
  std::size_t good = 0;
  for (std::size_t i = 0; i < kLines; ++i) {
    EXPECT_EQ(answers[i].at("line").to_number<std::size_t>(), i + 1);
    EXPECT_EQ(answers[i].at("command").as_string(), words[i]);
    EXPECT_EQ(answers[i].at("ok").as_bool(), !answers[i].contains("error"));
    good += answers[i].at("ok").as_bool() ? 1 : 0;
  }
  EXPECT_GT(good, kLines / 50);
  EXPECT_LT(good, kLines);
  EXPECT_THAT(run_->problem(), HasSubstr(std::to_string(kLines - good) + " of 1000 commands failed"));
}

TEST_F(CommandRunTest, TheStateOfTheRoomIsReadWithItsUnits) {
  const auto answers = answers_to("state\nenergy\nwait 0.5\nhelp\nquit\nnever read\n");
  ASSERT_EQ(answers.size(), 5U);
  for (const auto& answer : answers) EXPECT_EQ(error_in(answer), "ok");
  EXPECT_EQ(answers[0].at("holds").as_string(), "helix_a");
  EXPECT_EQ(answers[0].at("bodies").at(0).at("name").as_string(), "helix_a");
  EXPECT_EQ(answers[0].at("bodies").at(0).at("position_m").as_array().size(), 3U);
  EXPECT_EQ(answers[0].at("energy_kj_per_mol").as_double(), -12.5);
  EXPECT_EQ(answers[1].at("energy_kj_per_mol").as_double(), -12.5);
  EXPECT_EQ(answers[3].at("commands").as_array().size(), command_usages().size());
  EXPECT_EQ(run_->problem(), "");
}

TEST_F(CommandRunTest, WithoutARoomEachCommandFailsWithThatReason) {
  io_.status = {SessionState::kWaiting, "unplugged", false};
  const auto answers = answers_to("state\nvisit near\nmove 0 0 0\nwait 1\nhelp\n");
  ASSERT_EQ(answers.size(), 5U);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(error_in(answers[i]), "not in a room: unplugged");
  EXPECT_EQ(error_in(answers[4]), "ok");
}

TEST_F(CommandRunTest, ACommandThatIsNotDoneAtTheEndIsAnsweredWithAnError) {
  std::jthread writer([this] {
    const std::string line = "keep near\nkeep far\n";
    EXPECT_GT(write(lines_[1], line.data(), line.size()), 0);
  });
  for (int i = 0; i < 200; ++i) {
    now_ += std::chrono::milliseconds(10);
    run_->poll(io_, &view_, now_);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_FALSE(run_->is_over());
  run_->finish();
  close(std::exchange(lines_[1], -1));
  EXPECT_THAT(run_->problem(), HasSubstr("1 of 1 commands failed"));
  close(std::exchange(answers_[1], -1));
  reader_.join();
  EXPECT_THAT(text_, AllOf(HasSubstr("the program ends before this is done"), Not(HasSubstr("far"))));
}

TEST_F(CommandRunTest, APlaceBeyondTheDevicesReachIsRefusedWithTheNumbers) {
  view_.workspace.position_scale = 2;
  view_.workspace.X_WD.p = Vec3(1, 0, 0);
  const auto answers = answers_to("move 1 1.1 0\nmove-by 0 0 -1.2\nturn 0 0 0 9\n");
  EXPECT_THAT(error_in(answers.at(0)), AllOf(HasSubstr("0.55 m"), HasSubstr("reaches 0.5 m"), HasSubstr("1 0 0")));
  EXPECT_THAT(error_in(answers.at(1)), HasSubstr("0.6 m"));
  EXPECT_THAT(error_in(answers.at(2)), HasSubstr("AX AY AZ"));
}

}  // namespace
}  // namespace tandem::client
