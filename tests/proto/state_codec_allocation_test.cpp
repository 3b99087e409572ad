// Tests that the codecs allocate no memory after the first messages, because they run at 1 kHz on io threads.
#include <gtest/gtest.h>

#include <memory>

#include "proto/state_codec.hpp"
#include "tests/proto/samples.hpp"
#include "tests/support/allocation_counter.hpp"

namespace tandem::proto {
namespace {

TEST(StateCodec, CodingAllocatesNothingAfterTheFirstMessages) {
  const ClientUpdate client = largest_client_update();
  const ServerUpdate server = largest_server_update(0);
  auto encoder = std::make_unique<ServerUpdateEncoder>();
  auto client_read = std::make_unique<ClientUpdate>();
  auto server_read = std::make_unique<ServerUpdate>();
  Bytes bytes;
  bytes.reserve(kMaxDatagramBytes);  // the set of omitted items, and therefore the size, differs between messages
  const auto code_once = [&] {
    bytes.clear();
    append_client_update(client, bytes);
    const DropReason client_drop = parse_client_update(bytes, *client_read);
    bytes.clear();
    encoder->append(server, bytes);
    const DropReason server_drop = parse_server_update(bytes, *server_read);
    return client_drop == DropReason::kNone && server_drop == DropReason::kNone;
  };
  ASSERT_TRUE(code_once());
  const std::uint64_t before = test::allocation_count();
  ASSERT_GT(before, 0U) << "the counter does not count";
  bool is_read = true;
  for (int i = 0; i < 100; ++i) is_read = is_read && code_once();
  EXPECT_EQ(test::allocation_count() - before, 0U);
  EXPECT_TRUE(is_read);
}

}  // namespace
}  // namespace tandem::proto
