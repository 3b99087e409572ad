// Tests which calls to Agones' sidecar are due. A wrong call lets the cluster end a server with users, or keep an
// unused one.
#include <gtest/gtest.h>

#include <vector>

#include "server/metrics/agones.hpp"

namespace tandem::server {
namespace {

using Call = AgonesPlan::Call;
using std::chrono::milliseconds;
using std::chrono::seconds;

/// A server with its Agones sidecar, under a virtual clock. The server polls every 100 ms.
class Sidecar {
 public:
  /// Returns the calls to the sidecar within `duration`, except those to /health.
  std::vector<Call> calls_in(Duration duration) {
    std::vector<Call> calls;
    for (const LocalTime end = now_ + duration; now_ < end; now_ += milliseconds(100)) {
      const Call call = plan_.due(seen, now_);
      if (call == Call::kNone) continue;
      if (call == Call::kHealth) ++health_calls;
      if (call != Call::kHealth) calls.push_back(call);
      ++tries;
      plan_.note_answer(call, is_reachable, now_, is_allocated);
    }
    return calls;
  }

  AgonesPlan::Seen seen{.is_healthy = true};
  bool is_reachable = true;
  bool is_allocated = false;  ///< whether the cluster has allocated the server
  int health_calls = 0;
  int tries = 0;

 private:
  AgonesPlan plan_;
  LocalTime now_{seconds(1000)};
};

TEST(AgonesPlan, ReportsReadyOnceTheRoomsAreLoaded) {
  Sidecar sidecar;
  EXPECT_TRUE(sidecar.calls_in(seconds(5)).empty());
  sidecar.seen.is_ready = true;
  EXPECT_EQ(sidecar.calls_in(seconds(5)), std::vector{Call::kReady});
}

TEST(AgonesPlan, ReportsHealthWhileTheServerIsHealthy) {
  Sidecar sidecar;
  sidecar.calls_in(seconds(20));
  EXPECT_EQ(sidecar.health_calls, 10);
  sidecar.seen.is_healthy = false;
  sidecar.calls_in(seconds(20));
  EXPECT_EQ(sidecar.health_calls, 10);
}

TEST(AgonesPlan, AllocatesItselfForItsFirstUserAndReturnsWhenItWasLeft) {
  Sidecar sidecar;
  sidecar.seen.is_ready = true;
  sidecar.calls_in(seconds(1));
  sidecar.seen.users = 1;
  EXPECT_EQ(sidecar.calls_in(seconds(5)), (std::vector{Call::kGameServer, Call::kAllocate}));
  sidecar.seen.users = 2;
  EXPECT_TRUE(sidecar.calls_in(seconds(100)).empty());
  sidecar.seen.users = 0;
  EXPECT_TRUE(sidecar.calls_in(seconds(59)).empty()) << "a connection may be lost for a while";
  EXPECT_EQ(sidecar.calls_in(seconds(200)), std::vector{Call::kReady});
  sidecar.seen.users = 1;
  EXPECT_EQ(sidecar.calls_in(seconds(5)), (std::vector{Call::kGameServer, Call::kAllocate}));
}

TEST(AgonesPlan, DoesNotAllocateAServerThatWasAllocatedExternally) {
  Sidecar sidecar;
  sidecar.seen.is_ready = sidecar.is_allocated = true;
  sidecar.calls_in(seconds(200));  // no user has joined yet, so the server must not be offered to others
  sidecar.seen.users = 1;
  EXPECT_EQ(sidecar.calls_in(seconds(5)), std::vector{Call::kGameServer});
}

TEST(AgonesPlan, BacksOffWhileThereIsNoAnswer) {
  Sidecar sidecar;
  sidecar.seen.is_ready = true;
  sidecar.is_reachable = false;
  sidecar.calls_in(seconds(60));
  EXPECT_GE(sidecar.tries, 60 / 4);
  EXPECT_LE(sidecar.tries, 60 / 4 + 4);
  sidecar.is_reachable = true;
  EXPECT_EQ(sidecar.calls_in(seconds(5)), std::vector{Call::kReady}) << "as soon as it answers";
}

TEST(AgonesPlan, ReportsTheShutdownOnceAndNothingAfterwards) {
  Sidecar sidecar;
  sidecar.seen = {.is_healthy = true, .has_ended = true};
  EXPECT_EQ(sidecar.calls_in(seconds(10)), std::vector{Call::kShutdown});
  EXPECT_EQ(sidecar.health_calls, 0);
}

}  // namespace
}  // namespace tandem::server
