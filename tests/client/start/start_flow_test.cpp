#include "client/start/start_flow.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <thread>

#include "tests/client/start/some_invitation.hpp"

namespace tandem::client {
namespace {

namespace fs = std::filesystem;
using State = StartFlow::State;

constexpr auto kPatience = std::chrono::seconds(20);

/// Calls `poll` until `is_done` returns true, at most for kPatience. Returns whether it did.
template <class Poll, class Done>
bool eventually(const Poll& poll, const Done& is_done) {
  const auto give_up = std::chrono::steady_clock::now() + kPatience;
  while (!is_done()) {
    if (std::chrono::steady_clock::now() > give_up) return false;
    poll();
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

/// Returns true if a process has ended. Its state is read from /proc, because an orphan that has ended may remain as a
/// zombie, to which signals can still be sent.
bool has_ended(pid_t process) {
  std::ifstream in("/proc/" + std::to_string(process) + "/stat");
  const std::string stat{std::istreambuf_iterator<char>(in), {}};
  return stat.empty() || stat.find(") Z ") != std::string::npos;
}

/// Creates a folder with a script that replaces tandem-server.
class StartFlowTest : public testing::Test {
 protected:
  fs::path folder_ = fs::path(testing::TempDir()) / "start_flow";

  void SetUp() override {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void serve(const std::string& script) const {
    std::ofstream(folder_ / "tandem-server") << "#!/bin/sh\n" << script << "\n";
    fs::permissions(folder_ / "tandem-server", fs::perms::owner_all);
  }
  StartFlow flow() const { return {folder_, folder_ / "recent.json"}; }
  static bool wait_while_preparing(StartFlow& flow) {
    return eventually([&flow] { flow.poll(); }, [&flow] { return flow.state() != State::kPreparing; });
  }
};

const char* const kListens = "echo \"tandem-server: listening on 127.0.0.1:4711, INSECURE\"; exec sleep 100";

TEST_F(StartFlowTest, AServerBehindTheWindowGivesTheAddressAndEndsWithTheSession) {
  serve("echo $$ >" + (folder_ / "pid").string() + "; " + kListens);
  StartFlow flow = this->flow();
  flow.open({.scene = "wall"});
  EXPECT_EQ(flow.state(), State::kPreparing);
  ASSERT_TRUE(wait_while_preparing(flow));
  ASSERT_EQ(flow.state(), State::kReady) << flow.problem();
  EXPECT_EQ(flow.target().address, "127.0.0.1:4711");
  EXPECT_FALSE(flow.target().invitation);
  pid_t server = 0;
  std::ifstream(folder_ / "pid") >> server;
  EXPECT_EQ(kill(server, 0), 0);
  flow.close("");
  EXPECT_NE(kill(server, 0), 0) << "it has ended";
  EXPECT_EQ(flow.state(), State::kChoosing);
  ASSERT_EQ(flow.recent().size(), 1U);
  EXPECT_EQ(flow.recent()[0].scene, "wall");
}

TEST_F(StartFlowTest, TheProgressOfTheServerIsShownAndCanBeCancelled) {
  serve("echo '12:00:00.000 info scene bunny: 42 %'; exec sleep 100");
  StartFlow flow = this->flow();
  flow.open({.scene = "bunny"});
  EXPECT_TRUE(eventually([&flow] { flow.poll(); }, [&flow] { return flow.progress() == "scene bunny: 42 %"; }));
  flow.cancel();
  EXPECT_EQ(flow.state(), State::kChoosing);
  EXPECT_EQ(flow.problem(), "");
  EXPECT_TRUE(flow.recent().empty()) << "a cancelled choice must not be remembered";
}

TEST_F(StartFlowTest, TheReasonOfAServerThatDoesNotStartIsShown) {
  serve("echo 'tandem-server: port 47800 is taken' >&2; exit 2");
  StartFlow flow = this->flow();
  flow.open({.scene = "wall"});
  ASSERT_TRUE(wait_while_preparing(flow));
  EXPECT_EQ(flow.state(), State::kChoosing);
  EXPECT_EQ(flow.problem(), "port 47800 is taken");
}

TEST_F(StartFlowTest, TheReasonIsShownAlsoIfItComesAfterTheEndOfTheServer) {
  // The server ends at once. Its child process waits until the server is reaped, and only then writes the message.
  serve("(while kill -0 $$; do sleep 0.01; done; echo 'tandem-server: no space is left') 2>/dev/null & exit 2");
  StartFlow flow = this->flow();
  flow.open({.scene = "wall"});
  ASSERT_TRUE(wait_while_preparing(flow));
  EXPECT_EQ(flow.problem(), "no space is left");
}

TEST_F(StartFlowTest, AServerThatCannotBeExecutedIsExplained) {
  std::ofstream(folder_ / "tandem-server") << "a program that is being written";
  StartFlow flow = this->flow();
  flow.open({.scene = "wall"});
  ASSERT_TRUE(wait_while_preparing(flow));
  EXPECT_EQ(flow.problem(), "tandem-server could not be executed; wait until it is built, or install it again");
}

TEST_F(StartFlowTest, APartnerThatCannotBeStartedIsExplainedAndTheServerEnded) {
  serve("echo $$ >" + (folder_ / "pid").string() + "; " + kListens);
  StartFlow flow = this->flow();
  flow.open({.scene = "crate"});
  ASSERT_TRUE(wait_while_preparing(flow));
  EXPECT_EQ(flow.state(), State::kChoosing);
  EXPECT_NE(flow.problem().find("tandem-client is not in " + folder_.string()), std::string::npos) << flow.problem();
  pid_t server = 0;
  std::ifstream(folder_ / "pid") >> server;
  EXPECT_NE(kill(server, 0), 0);
}

TEST_F(StartFlowTest, AMeshWhoseSceneCannotBeWrittenIsExplainedAndLeavesNoFolder) {
  serve(kListens);
  const fs::path mesh = folder_ / "a.stl", temporary = folder_ / "temporary";
  std::ofstream(mesh) << "x";
  fs::create_directories(temporary);
  const char* const before = std::getenv("TMPDIR");
  const std::string previous = before == nullptr ? "" : before;
  setenv("TMPDIR", temporary.c_str(), 1);
  StartFlow flow = this->flow();
  // Simulates a full disk: no file may have content.
  rlimit limit{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &limit), 0);
  const auto on_excess = signal(SIGXFSZ, SIG_IGN);
  const rlimit none{.rlim_cur = 0, .rlim_max = limit.rlim_max};
  setrlimit(RLIMIT_FSIZE, &none);
  flow.open({.kind = StartChoice::Kind::kMesh, .mesh = mesh.string()});
  setrlimit(RLIMIT_FSIZE, &limit);
  signal(SIGXFSZ, on_excess);
  EXPECT_NE(flow.problem().find("mesh.json cannot be written; free some space"), std::string::npos) << flow.problem();
  EXPECT_TRUE(fs::is_empty(temporary));
  flow.open({.kind = StartChoice::Kind::kMesh, .mesh = mesh.string()});
  EXPECT_EQ(flow.state(), State::kPreparing) << flow.problem();
  EXPECT_FALSE(fs::is_empty(temporary));
  flow.cancel();
  EXPECT_TRUE(fs::is_empty(temporary)) << "it is removed with the server";
  if (before == nullptr) {
    unsetenv("TMPDIR");
  } else {
    setenv("TMPDIR", previous.c_str(), 1);
  }
}

TEST_F(StartFlowTest, AMissingServerIsNamedWithItsFolder) {
  StartFlow flow = this->flow();
  flow.open({.scene = "wall"});
  EXPECT_EQ(flow.state(), State::kChoosing);
  EXPECT_NE(flow.problem().find("tandem-server is not in " + folder_.string()), std::string::npos);
}

TEST_F(StartFlowTest, AHostedServerGivesOneInvitationToTheHostAndTheOthersToGuests) {
  const std::string first = test::some_invitation("192.0.2.2:5000", "host");
  const std::string second = test::some_invitation("192.0.2.2:5000", "guest");
  serve(
      "echo 'tandem-server: listening on 0.0.0.0:5000, key K, room wall (1 tool)'; "
      "for one in " +
      first + " " + second +
      "; do "
      "echo \"invitation (one manipulator, until x): tandem-client --join $one\"; done; exec sleep 100");
  StartFlow flow = this->flow();
  flow.open({.scene = "wall", .is_hosted = true});
  ASSERT_TRUE(wait_while_preparing(flow));
  ASSERT_EQ(flow.state(), State::kReady) << flow.problem();
  ASSERT_TRUE(flow.target().invitation);
  EXPECT_EQ(flow.target().invitation->server, "127.0.0.1:5000") << "the host's own way is this machine";
  EXPECT_EQ(proto::peek_token(flow.target().invitation->token)->user_name(), "host");
  EXPECT_EQ(flow.invitations(), std::vector<std::string>{second});
}

TEST_F(StartFlowTest, AHostedServerIsReadyOnceEveryInvitationIsRead) {
  const std::string line = "echo 'invitation (one manipulator, until x): tandem-client --join " +
                           test::some_invitation("192.0.2.2:5000") + "'; ";
  serve("echo 'tandem-server: listening on 0.0.0.0:5000, key K, room wall (1 tool)'; " + line + line +
        "echo 'more follow'; while [ ! -e " + (folder_ / "go").string() + " ]; do sleep 0.01; done; " + line +
        "exec sleep 100");
  StartFlow flow = this->flow();
  flow.open({.scene = "wall", .is_hosted = true, .invited = 2});
  ASSERT_TRUE(eventually([&flow] { flow.poll(); }, [&flow] { return flow.progress() == "more follow"; }));
  EXPECT_EQ(flow.state(), State::kPreparing) << "the second invitation for others is missing";
  std::ofstream(folder_ / "go") << "x";
  ASSERT_TRUE(wait_while_preparing(flow));
  ASSERT_EQ(flow.state(), State::kReady) << flow.problem();
  EXPECT_EQ(flow.invitations().size(), 2U);
}

TEST_F(StartFlowTest, TheSecondDroppedStructureOpensThePair) {
  for (const char* name : {"a.pdb", "b.pdb"}) std::ofstream(folder_ / name) << "x";
  serve(kListens);
  StartFlow flow = this->flow();
  flow.drop(folder_ / "a.pdb");
  EXPECT_EQ(flow.state(), State::kChoosing);
  flow.drop(folder_ / "b.pdb");
  ASSERT_TRUE(wait_while_preparing(flow));
  EXPECT_EQ(flow.state(), State::kReady) << flow.problem();
  EXPECT_EQ(flow.title(), "a.pdb and b.pdb");
}

TEST_F(StartFlowTest, AFailedSessionIsExplainedAndNotRemembered) {
  StartFlow flow = this->flow();
  flow.open({.kind = StartChoice::Kind::kJoin, .address = "127.0.0.1:5000"});
  ASSERT_EQ(flow.state(), State::kReady);
  EXPECT_FALSE(flow.has_server());
  flow.close("connection refused");
  EXPECT_EQ(flow.problem(), "connection refused");
  EXPECT_TRUE(flow.recent().empty());
}

TEST(ChildProgram, EndsWhenTheProgramThatStartedItIsKilled) {
  const fs::path file = fs::path(testing::TempDir()) / "orphan";
  fs::remove(file);
  const pid_t middle = fork();
  if (middle == 0) {
    ChildProgram child("/bin/sh", {"-c", "echo $$ >" + file.string() + ".new; mv " + file.string() + ".new " +
                                             file.string() + "; exec sleep 100"});
    std::this_thread::sleep_for(kPatience);
    _exit(0);
  }
  ASSERT_TRUE(eventually([] {}, [&file] { return fs::exists(file); }));
  kill(middle, SIGKILL);
  waitpid(middle, nullptr, 0);
  pid_t orphan = 0;
  std::ifstream(file) >> orphan;
  EXPECT_TRUE(eventually([] {}, [orphan] { return has_ended(orphan); }));
}

TEST(ChildProgram, IsKilledIfItIgnoresTheRequest) {
  ChildProgram child("/bin/sh", {"-c", "trap '' TERM; echo ready; while :; do sleep 0.05; done"});
  std::vector<std::string> lines;
  ASSERT_TRUE(eventually([&] { lines = child.take_lines(); }, [&lines] { return !lines.empty(); }));
  child.stop(std::chrono::milliseconds(50));
  EXPECT_FALSE(child.is_running());
  EXPECT_EQ(child.exit_code(), 128 + SIGKILL);
}

/// Returns the id of a process that `script` starts and prints in its first line. Runs the script as a ChildProgram and
/// then destroys the ChildProgram. Fails if the destruction waits for that process.
pid_t process_left_by(const std::string& script) {
  auto program = std::make_unique<ChildProgram>("/bin/sh", std::vector<std::string>{"-c", script});
  std::vector<std::string> lines;
  EXPECT_TRUE(eventually([&] { lines = program->take_lines(); }, [&lines] { return !lines.empty(); }));
  const auto began = std::chrono::steady_clock::now();
  program.reset();
  EXPECT_LT(std::chrono::steady_clock::now() - began, kPatience);
  return lines.empty() ? 0 : std::stoi(lines.front());
}

TEST(ChildProgram, EndsWithTheProcessesOfItsGroup) {
  const pid_t started = process_left_by("sh -c 'echo $$; exec sleep 100' & exec sleep 100");
  EXPECT_TRUE(eventually([] {}, [started] { return has_ended(started); }));
}

TEST(ChildProgram, IsDestroyedAlthoughAProcessOfAnotherGroupHoldsTheOutput) {
  const pid_t started = process_left_by("setsid sh -c 'echo $$; exec sleep 100' & exec sleep 100");
  EXPECT_FALSE(has_ended(started));
  kill(started, SIGKILL);
}

TEST(ChildProgram, ReportsAProgramThatCannotBeExecuted) {
  ChildProgram child("/nonexistent/program", {});
  ASSERT_TRUE(eventually([] {}, [&child] { return !child.is_running(); }));
  EXPECT_EQ(child.exit_code(), 127);
}

}  // namespace
}  // namespace tandem::client
