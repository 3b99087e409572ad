// Tests damaged and malicious bytes. Every golden message is truncated at every byte, has every bit flipped, and is
// damaged at random. The reader must refuse the result or return values in range. The test is most effective with the
// sanitizers.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <sstream>

#include "common/base/random.hpp"
#include "proto/datagram_seal.hpp"
#include "proto/state_codec.hpp"
#include "tests/proto/samples.hpp"

namespace tandem::proto {
namespace {

/// Returns whether a control loop can use this rigid state. It is independent of the checks in the codec.
bool is_usable(const RigidState& state) {
  return is_finite(state.X) && is_finite(state.V) && std::abs(state.X.q.norm() - 1.0) < 1e-9 &&
         state.X.p.norm() <= kMaxPositionM && state.V.v.norm() <= kMaxSpeedMPerS && state.V.w.norm() <= kMaxTurnRadPerS;
}

bool is_usable(const ClientUpdate& update) {
  return is_usable(update.handle) && update.energy_to_hand_j >= 0 && update.energy_to_hand_j <= kMaxEnergyJ &&
         update.energy_from_hand_j >= 0 && update.energy_from_hand_j <= kMaxEnergyJ &&
         update.acknowledged_held >= Duration{0} && update.sent >= LocalTime{} &&
         update.acknowledged_sent >= ServerTime{};
}

bool is_usable(const ServerUpdate& update) {
  bool is_good = is_usable(update.tool) && is_finite(update.wrench_on_hand_W) && update.energy_into_world_j >= 0 &&
                 update.energy_from_world_j >= 0 && std::isfinite(update.energy_into_world_j) &&
                 std::isfinite(update.energy_from_world_j) && std::isfinite(update.field_energy_kj_per_mol) &&
                 update.sent >= ServerTime{} && update.received >= ServerTime{};
  for (const BodyState& body : update.bodies) is_good = is_good && body.id.is_valid() && is_usable(body.state);
  for (const OtherUserState& user : update.users) is_good = is_good && user.id.is_valid() && is_usable(user.tool);
  return is_good;
}

/// Returns whether all numbers of a message are finite. Checks the message as text, with one line for each field, so
/// that no field is missed. A text field cannot be mistaken for a number, because its line ends in a quotation mark.
bool has_finite_numbers(const google::protobuf::Message& message) {
  std::istringstream text(message.DebugString());
  for (std::string line; std::getline(text, line);) {
    for (const std::string_view bad : {": nan", ": -nan", ": inf", ": -inf"}) {
      if (line.ends_with(bad)) return false;
    }
  }
  return true;
}

/// Result of reading damaged bytes.
enum class Outcome { kRefused, kRead, kUnusable };

template <class Message>
Outcome read_frames(std::span<const std::byte> bytes) {
  FrameReader reader;
  reader.feed(bytes);
  Outcome outcome = Outcome::kRefused;
  while (const auto payload = reader.next()) {
    Message message;
    if (!parse_control(*payload, message)) continue;
    if (!has_finite_numbers(message)) return Outcome::kUnusable;
    outcome = Outcome::kRead;
  }
  return outcome;
}

template <class Update>
Outcome read_datagram(std::span<const std::byte> bytes,
                      DropReason (*parse)(std::span<const std::byte> payload, Update& out)) {
  DatagramHeader header;
  if (parse_header(bytes, header) != DropReason::kNone) return Outcome::kRefused;
  Update update;
  if (parse(payload_of(bytes), update) != DropReason::kNone) return Outcome::kRefused;
  return header.connection.is_valid() && is_usable(update) ? Outcome::kRead : Outcome::kUnusable;
}

Outcome outcome_of(Packing packing, std::span<const std::byte> bytes) {
  switch (packing) {
    case Packing::kClientControlFrame:
      return read_frames<wire::ClientControl>(bytes);
    case Packing::kServerControlFrame:
      return read_frames<wire::ServerControl>(bytes);
    case Packing::kClientDatagram:
      return read_datagram<ClientUpdate>(bytes, &parse_client_update);
    case Packing::kServerDatagram:
      return read_datagram<ServerUpdate>(bytes, &parse_server_update);
  }
  return Outcome::kUnusable;
}

/// Reads a heap copy of exactly this size, so that AddressSanitizer detects a read beyond its end.
Outcome outcome_of_copy(Packing packing, std::span<const std::byte> bytes) {
  const Bytes copy(bytes.begin(), bytes.end());
  return outcome_of(packing, copy);
}

std::uint64_t seed() {
  const char* text = std::getenv("TANDEM_TEST_SEED");
  return text != nullptr ? std::strtoull(text, nullptr, 10) : 20'240'601;
}

TEST(HostileBytes, GoldenMessagesThemselvesAreRead) {
  for (const auto& message : golden_messages()) {
    EXPECT_EQ(outcome_of_copy(message.packing, message.bytes), Outcome::kRead) << message.name;
  }
}

TEST(HostileBytes, TheTextCheckFindsNumbersAndNotWords) {
  wire::ClientControl message;
  message.mutable_set_parameter()->set_name("nan: inf");
  EXPECT_TRUE(has_finite_numbers(message));
  for (const double bad : {std::nan(""), -HUGE_VAL, HUGE_VAL}) {
    message.mutable_set_parameter()->set_value(bad);
    EXPECT_FALSE(has_finite_numbers(message)) << bad;
  }
}

TEST(HostileBytes, EveryTruncationIsRefusedOrRead) {
  for (const auto& message : golden_messages()) {
    const bool is_frame =
        message.packing == Packing::kClientControlFrame || message.packing == Packing::kServerControlFrame;
    for (std::size_t size = 0; size < message.bytes.size(); ++size) {
      const Outcome outcome = outcome_of_copy(message.packing, std::span(message.bytes).first(size));
      ASSERT_NE(outcome, Outcome::kUnusable) << message.name << " cut to " << size;
      // A frame contains its length, so a truncated frame must be refused. A datagram that is truncated between two
      // fields may be valid.
      if (is_frame) {
        ASSERT_EQ(outcome, Outcome::kRefused) << message.name << " cut to " << size;
      }
    }
  }
}

TEST(HostileBytes, EverySingleBitFlipIsRefusedOrRead) {
  for (const auto& message : golden_messages()) {
    Bytes bytes = message.bytes;
    for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
      const auto mask = std::byte(1U << (bit % 8));
      bytes[bit / 8] ^= mask;
      ASSERT_NE(outcome_of_copy(message.packing, bytes), Outcome::kUnusable) << message.name << " bit " << bit;
      bytes[bit / 8] ^= mask;
    }
  }
}

TEST(HostileBytes, EveryBitFlipInVersionAndTagIsRefusedAsSuch) {
  Bytes bytes;
  append_header(client_header(), bytes);
  DatagramSeal null_cipher({}, DatagramSeal::Use::kOpen, true, client_header().epoch);
  const auto reason_with_flip = [&](std::size_t bit) {
    const auto mask = std::byte(1U << (bit % 8));
    DatagramHeader header;
    bytes[bit / 8] ^= mask;
    DropReason reason = parse_header(bytes, header);
    std::span<const std::byte> payload;
    if (reason == DropReason::kNone) reason = null_cipher.open(header, bytes, payload);
    bytes[bit / 8] ^= mask;
    return reason;
  };
  for (std::size_t bit = 5; bit < 8; ++bit) EXPECT_EQ(reason_with_flip(bit), DropReason::kVersion) << "bit " << bit;
  for (std::size_t bit = 8 * 17; bit < 8 * bytes.size(); ++bit) {
    EXPECT_EQ(reason_with_flip(bit), DropReason::kTag) << "bit " << bit;
  }
}

TEST(HostileBytes, RandomDamageIsRefusedOrRead) {
  constexpr int kRounds = 4'000;
  const std::uint64_t first_seed = seed();
  for (const auto& message : golden_messages()) {
    Random random(first_seed);
    int refused = 0;
    for (int round = 0; round < kRounds; ++round) {
      Bytes bytes = message.bytes;
      for (std::uint32_t n = 1 + random.next_u32() % 8; n > 0; --n) {
        bytes[random.next_u32() % bytes.size()] = std::byte(random.next_u32());
      }
      if (random.next_u32() % 4 == 0) bytes.resize(random.next_u32() % (2 * bytes.size()), std::byte{0xff});
      const Outcome outcome = outcome_of_copy(message.packing, bytes);
      ASSERT_NE(outcome, Outcome::kUnusable)
          << message.name << " round " << round << "; repeat with TANDEM_TEST_SEED=" << first_seed;
      refused += outcome == Outcome::kRefused ? 1 : 0;
    }
    EXPECT_GT(refused, 0) << message.name;
  }
}

TEST(HostileBytes, PureNoiseBehindAGoodHeaderIsRefusedOrRead) {
  const std::uint64_t first_seed = seed();
  Random random(first_seed);
  for (int round = 0; round < 20'000; ++round) {
    for (const auto packing : {Packing::kClientDatagram, Packing::kServerDatagram}) {
      Bytes bytes;
      append_header(client_header(), bytes);
      for (std::uint32_t n = random.next_u32() % kMaxPayloadBytes; n > 0; --n)
        bytes.push_back(std::byte(random.next_u32()));
      ASSERT_NE(outcome_of_copy(packing, bytes), Outcome::kUnusable)
          << "round " << round << "; repeat with TANDEM_TEST_SEED=" << first_seed;
    }
  }
}

TEST(HostileBytes, ManyEmptyItemsAreRefusedWithoutHarm) {
  Bytes payload;
  for (std::size_t i = 0; i + 1 < kMaxPayloadBytes; i += 2) {
    payload.push_back(std::byte{0x72});  // field 14 (bodies), length-delimited
    payload.push_back(std::byte{0});
  }
  ServerUpdate out;
  EXPECT_EQ(parse_server_update(payload, out), DropReason::kMalformed);
}

TEST(HostileBytes, DeepNestingIsRefusedWithoutRunningOutOfStack) {
  // The bytes open a group within a group, 200,000 levels deep. Groups have no length prefix, so they fit into one
  // control message.
  const Bytes payload(200'000, std::byte{0xa3});
  wire::ClientControl message;
  EXPECT_FALSE(parse_control(payload, message));
}

}  // namespace
}  // namespace tandem::proto
