// Tests the byte budget of a server update, and the order in which items are omitted when it is exceeded. All fields
// have their largest sizes.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>

#include "proto/state_codec.hpp"
#include "tandem/state.pb.h"
#include "tests/proto/samples.hpp"

namespace tandem::proto {
namespace {

/// Encodes messages with one encoder and decodes each of them.
class Receiver {
 public:
  ServerUpdate receive(const ServerUpdate& update) {
    Bytes bytes;
    encoder.append(update, bytes);
    EXPECT_LE(kDatagramHeaderBytes + bytes.size(), kMaxDatagramBytes);
    largest_bytes = std::max(largest_bytes, bytes.size());
    ServerUpdate read;
    EXPECT_EQ(parse_server_update(bytes, read), DropReason::kNone);
    EXPECT_EQ(encoder.thinned(), update.bodies.size() + update.users.size() - read.bodies.size() - read.users.size());
    return read;
  }

  /// Encodes the update `messages` times. Returns the number of messages that contain each body.
  std::map<BodyId, int> body_counts(const ServerUpdate& update, int messages) {
    std::map<BodyId, int> counts;
    for (int i = 0; i < messages; ++i) {
      for (const BodyState& body : receive(update).bodies) ++counts[body.id];
    }
    return counts;
  }

  ServerUpdateEncoder encoder;
  std::size_t largest_bytes = 0;
};

BodyState body_of(std::uint32_t id, const RigidState& state, std::uint32_t held_by = 0) {
  return {BodyId{id}, state, UserId{held_by}};
}

bool names(const ServerUpdate& update, BodyId id) {
  return std::ranges::any_of(update.bodies, [id](const BodyState& body) { return body.id == id; });
}

TEST(ServerUpdateEncoder, LargestUpdateFitsWithOwnToolAndHeldBodyInEveryMessage) {
  for (const std::size_t held : {std::size_t{0}, kMaxBodies / 2, kMaxBodies - 1}) {
    const ServerUpdate update = largest_server_update(held);
    Receiver receiver;
    for (int message = 0; message < 100; ++message) {
      const ServerUpdate read = receiver.receive(update);
      EXPECT_EQ(read.tool.X.p, update.tool.X.p);
      EXPECT_EQ(read.wrench_on_hand_W.f, update.wrench_on_hand_W.f);
      EXPECT_EQ(read.sent, update.sent);
      ASSERT_TRUE(names(read, update.held_body));
    }
    // The encoder must use the space of a message: it adds items as long as the largest item, 72 bytes, still fits.
    EXPECT_GT(receiver.largest_bytes, kMaxPayloadBytes - 72);
  }
}

TEST(ServerUpdateEncoder, WritesTheSameBytesAsGeneratedCode) {
  ServerUpdate small;
  small.tool.X.p = Vec3(-0.0, 0, 1);
  small.wrench_on_hand_W.f.z() = -0.0;
  OtherUserState& user = small.users.emplace_back();
  user.id = UserId{1};
  user.holds = BodyId{300};
  small.bodies = {body_of(200, {}, 1)};
  for (const ServerUpdate& update : {ServerUpdate{}, small, server_update(), largest_server_update(1)}) {
    Bytes bytes;
    ServerUpdateEncoder().append(update, bytes);
    wire::ServerUpdate message;
    ASSERT_TRUE(message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())));
    const std::string generated = message.SerializeAsString();
    EXPECT_EQ(generated, std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
    EXPECT_EQ(message.users_size() == 1 ? message.users(0).holds_body() : 0,
              message.users_size() == 1 ? update.users[0].holds.value : 0);
  }
}

TEST(ServerUpdateEncoder, NothingStarvesWhenEverythingMoves) {
  const ServerUpdate update = largest_server_update(3);
  Receiver receiver;
  std::map<std::uint32_t, std::uint64_t> body_sent;
  std::map<std::uint32_t, std::uint64_t> user_sent;
  std::uint64_t longest_wait = 0;
  for (std::uint64_t message = 1; message <= 500; ++message) {
    const ServerUpdate read = receiver.receive(update);
    for (const BodyState& body : read.bodies) body_sent[body.id.value] = message;
    for (const OtherUserState& user : read.users) user_sent[user.id.value] = message;
    for (const BodyState& body : update.bodies) {
      longest_wait = std::max(longest_wait, message - body_sent[body.id.value]);
    }
    for (const OtherUserState& user : update.users) {
      longest_wait = std::max(longest_wait, message - user_sent[user.id.value]);
    }
  }
  EXPECT_LT(longest_wait, ServerUpdateEncoder::kMaxWaitMessages);
  EXPECT_EQ(body_sent.size(), kMaxBodies);
  EXPECT_EQ(user_sent.size(), kMaxUsers);
}

TEST(ServerUpdateEncoder, AllThatFitsIsSentInEveryMessage) {
  ServerUpdate update = server_update();
  update.bodies.clear();
  // Number of bodies that always fit into a message: eight, beside the largest possible part for the user (grasp, wave
  // and soft contact).
  for (std::uint32_t id = 1; id <= 8; ++id) update.bodies.push_back(body_of(id, moving_state(id)));
  Receiver receiver;
  for (int message = 0; message < 50; ++message) {
    const ServerUpdate read = receiver.receive(update);
    EXPECT_EQ(read.bodies.size(), update.bodies.size());
    EXPECT_EQ(read.users.size(), update.users.size());
    EXPECT_EQ(receiver.encoder.thinned(), 0U);
  }
}

TEST(ServerUpdateEncoder, RestingBodiesAreThinnedBeforeMovingOnes) {
  ServerUpdate update;
  for (std::uint32_t id = 1; id <= kMaxBodies; ++id) {
    // Moving bodies are last in the list. An encoder that goes by list order would omit them.
    const bool is_moving = id > kMaxBodies - 8;
    update.bodies.push_back(body_of(id, is_moving ? moving_state(id) : resting_state(id)));
  }
  Receiver receiver;
  receiver.body_counts(update, 40);  // after these messages, every item was sent at least once
  auto counts = receiver.body_counts(update, 100);
  for (const BodyState& body : update.bodies) {
    if (body.id.value > kMaxBodies - 8) {
      EXPECT_EQ(counts[body.id], 100) << "moving body " << body.id.value;
    } else {
      EXPECT_LT(counts[body.id], 100) << "resting body " << body.id.value;
      EXPECT_GE(counts[body.id], 2) << "resting body " << body.id.value;
    }
  }
}

TEST(ServerUpdateEncoder, MovingBodiesAreThinnedBeforeThoseHeldByOthers) {
  ServerUpdate update;
  for (std::uint32_t id = 1; id <= kMaxBodies; ++id) {
    update.bodies.push_back(body_of(id, moving_state(id), id > kMaxBodies - 6 ? 9 : 0));
  }
  Receiver receiver;
  receiver.body_counts(update, 40);
  auto counts = receiver.body_counts(update, 100);
  for (const BodyState& body : update.bodies) {
    if (body.held_by.is_valid()) {
      EXPECT_EQ(counts[body.id], 100) << "held body " << body.id.value;
    } else {
      EXPECT_LT(counts[body.id], 100) << "free body " << body.id.value;
    }
  }
}

TEST(ServerUpdateEncoder, BodiesHeldByOthersAreThinnedBeforeOtherUsersTools) {
  ServerUpdate update;
  for (std::uint32_t id = 1; id <= kMaxBodies; ++id) update.bodies.push_back(body_of(id, moving_state(id), 9));
  for (std::uint32_t id = 1; id <= 6; ++id)
    update.users.push_back({UserId{id}, moving_state(id), BodyId{id}, 0, false, {}, {}, {}});
  Receiver receiver;
  for (int message = 0; message < 40; ++message) receiver.receive(update);
  for (int message = 0; message < 100; ++message) EXPECT_EQ(receiver.receive(update).users.size(), 6U);
}

TEST(ServerUpdateEncoder, BodiesOfAClassAreSentInTurn) {
  ServerUpdate update;
  for (std::uint32_t id = 1; id <= 40; ++id) update.bodies.push_back(body_of(id, moving_state(id)));
  Receiver receiver;
  receiver.body_counts(update, 40);
  const auto counts = receiver.body_counts(update, 200);
  ASSERT_EQ(counts.size(), 40U);
  const auto [least, most] = std::ranges::minmax_element(counts, {}, [](const auto& entry) { return entry.second; });
  EXPECT_LE(most->second - least->second, 1);
}

TEST(ServerUpdateEncoder, ABodyThatHasStoppedIsSentAtRestBeforeItCountsAsResting) {
  ServerUpdate update;
  for (std::uint32_t id = 1; id <= kMaxBodies; ++id) {
    update.bodies.push_back(body_of(id, id <= 3 ? moving_state(id) : resting_state(id)));
  }
  Receiver receiver;
  for (int message = 0; message < 40; ++message) receiver.receive(update);
  update.bodies[1].state.V = {};
  const ServerUpdate read = receiver.receive(update);
  const auto stopped = std::ranges::find(read.bodies, BodyId{2}, &BodyState::id);
  ASSERT_NE(stopped, read.bodies.end());
  EXPECT_EQ(stopped->state.V.v, Vec3::Zero().eval());
}

TEST(ServerUpdateEncoder, TwistIsLeftOutBelowRestSpeedAndKeptAbove) {
  const auto twist_after = [](const Twist& V) {
    ServerUpdate update;
    update.bodies.push_back(body_of(1, {{}, V}));
    return Receiver().receive(update).bodies.at(0).state.V;
  };
  EXPECT_EQ(twist_after({Vec3(0.99 * kRestSpeedMPerS, 0, 0), Vec3(0, 0.99 * kRestTurnRadPerS, 0)}).v.norm(), 0);
  EXPECT_GT(twist_after({Vec3(1.01 * kRestSpeedMPerS, 0, 0), Vec3::Zero()}).v.norm(), kRestSpeedMPerS);
  EXPECT_GT(twist_after({Vec3::Zero(), Vec3(0, 1.01 * kRestTurnRadPerS, 0)}).w.norm(), kRestTurnRadPerS);
}

TEST(ServerUpdateEncoder, ABodyOutOfRangeIsLeftOutInsteadOfSpoilingTheMessage) {
  ServerUpdate update = server_update();
  const std::size_t bodies = update.bodies.size();
  update.bodies.push_back(body_of(20, resting_state(0)));
  update.bodies.push_back(body_of(21, resting_state(0)));
  update.bodies.push_back(body_of(22, resting_state(0)));
  update.bodies[bodies].state.X.p = Vec3(0, 0, -1.0001 * kMaxPositionM);
  update.bodies[bodies + 1].state.X.p.x() = std::numeric_limits<double>::quiet_NaN();
  update.bodies[bodies + 2].state.X.p = Vec3(-kMaxPositionM, 0, 0);  // at the limit of the range, where rounding
                                                                     // decides
  Receiver receiver;
  EXPECT_EQ(receiver.receive(update).bodies.size(), bodies);
  EXPECT_EQ(receiver.encoder.thinned(), 3U);
  update.bodies[bodies].state.X.p.z() = -0.9999 * kMaxPositionM;
  EXPECT_TRUE(names(receiver.receive(update), BodyId{20})) << "back inside";
}

TEST(ServerUpdateEncoder, FollowsUsersWhoJoinAndLeave) {
  ServerUpdate update = largest_server_update(0);
  Receiver receiver;
  for (std::uint32_t first = 1; first < 2'000; first += 7) {
    update.users.clear();
    for (std::uint32_t i = 0; i < kMaxUsers; ++i) {
      update.users.push_back({UserId{first + i}, moving_state(i), BodyId{}, 0, false, {}, {}, {}});
    }
    EXPECT_FALSE(receiver.receive(update).users.empty());
  }
}

}  // namespace
}  // namespace tandem::proto
