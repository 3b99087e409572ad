// Replaces the delay trace of a simulated link by a shorter one. Detects a read position that stays beyond the end of
// the new trace.
#include <gtest/gtest.h>

#include "common/net/link.hpp"

namespace tandem::net {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(LinkChange, AShorterTraceBeginsAtItsBeginning) {
  LinkParameters parameters;
  parameters.distribution = JitterDistribution::kTrace;
  parameters.allows_reordering = true;
  parameters.duplication = 1;
  parameters.trace.assign(1000, milliseconds(9));
  SimulatedLink link(parameters, 1, 12);
  LocalTime now{};
  for (int i = 0; i < 900; ++i) link.send(now += milliseconds(1), {});
  parameters.trace = {milliseconds(1), milliseconds(2)};
  link.set_parameters(parameters);
  now += seconds(1);
  while (link.receive(now)) {
  }
  link.send(now, {});
  link.send(now, {});
  ASSERT_TRUE(link.next_due());
  EXPECT_EQ(*link.next_due(), now + milliseconds(1));
  while (link.receive(now + milliseconds(2))) {
  }
  EXPECT_FALSE(link.next_due()) << "both packets and their copies are here after 2 ms at most";
}

}  // namespace
}  // namespace tandem::net
