// Tests that the wire format is unchanged, because installed programs use it. A difference is either a new protocol
// version or a mistake. To accept a difference, run TANDEM_UPDATE_GOLDEN=1 test_wire_golden and state the reason in the
// commit.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "proto/state_codec.hpp"
#include "tests/proto/samples.hpp"
#include "tests/support/source_path.hpp"

namespace tandem::proto {
namespace {

constexpr std::size_t kBytesPerLine = 32;

std::string hex_of(std::span<const std::byte> bytes) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string hex;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const auto value = std::to_integer<unsigned>(bytes[i]);
    hex += kDigits[value >> 4U];
    hex += kDigits[value & 0xfU];
    if ((i + 1) % kBytesPerLine == 0 || i + 1 == bytes.size()) hex += '\n';
  }
  return hex;
}

Bytes bytes_of(const std::string& hex) {
  std::string digits;
  for (const char c : hex) {
    if (std::isxdigit(static_cast<unsigned char>(c)) != 0) digits += c;
  }
  Bytes bytes;
  for (std::size_t i = 0; i + 1 < digits.size(); i += 2) {
    bytes.push_back(static_cast<std::byte>(std::stoi(digits.substr(i, 2), nullptr, 16)));
  }
  return bytes;
}

std::string path_of(const std::string& name) {
  return test::source_path("tests/golden/wire").string() + "/" + name + ".hex";
}

std::string read_text(const std::string& path) {
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// Returns the bytes of a golden file.
Bytes golden(const std::string& name) {
  return bytes_of(read_text(path_of(name)));
}

/// Returns the message in a golden control frame.
template <class Message>
std::string control_in(const std::string& name) {
  FrameReader reader;
  EXPECT_TRUE(reader.feed(golden(name)));
  const auto payload = reader.next();
  Message message;
  if (!payload || !parse_control(*payload, message)) return "not a message";
  return message.DebugString();
}

TEST(GoldenWire, EncodingGivesExactlyTheGoldenBytes) {
  const bool is_update = std::getenv("TANDEM_UPDATE_GOLDEN") != nullptr;
  for (const GoldenMessage& message : golden_messages()) {
    const std::string hex = hex_of(message.bytes);
    if (is_update) std::ofstream(path_of(message.name)) << hex;
    EXPECT_EQ(read_text(path_of(message.name)), hex)
        << message.name << ": the wire format has changed. If that is meant, run this with TANDEM_UPDATE_GOLDEN=1 to "
        << "write " << path_of(message.name) << ". The new bytes:\n"
        << hex;
  }
}

TEST(GoldenWire, ControlFramesDecodeToTheirValues) {
  EXPECT_EQ(control_in<wire::ClientControl>("hello"), hello().DebugString());
  EXPECT_EQ(control_in<wire::ClientControl>("join"), join().DebugString());
  EXPECT_EQ(control_in<wire::ClientControl>("grab"), grab().DebugString());
  EXPECT_EQ(control_in<wire::ClientControl>("get_asset"), get_asset().DebugString());
  EXPECT_EQ(control_in<wire::ServerControl>("welcome"), welcome().DebugString());
  EXPECT_EQ(control_in<wire::ServerControl>("joined"), joined().DebugString());
  EXPECT_EQ(control_in<wire::ServerControl>("error"), error().DebugString());
  EXPECT_EQ(control_in<wire::ServerControl>("goodbye"), goodbye().DebugString());
  EXPECT_EQ(control_in<wire::ServerControl>("asset_chunk"), asset_chunk().DebugString());
  EXPECT_EQ(control_in<wire::ClientControl>("reset_room"), reset_room().DebugString());
  EXPECT_EQ(control_in<wire::ClientControl>("ask_pose"), ask_pose().DebugString());
  EXPECT_EQ(control_in<wire::ServerControl>("kept_pose"), kept_pose().DebugString());
  EXPECT_EQ(control_in<wire::ClientControl>("rename_pose"), rename_pose().DebugString());
  EXPECT_EQ(control_in<wire::ServerControl>("pose_deleted"), pose_deleted().DebugString());
  EXPECT_EQ(control_in<wire::ServerControl>("pose_progress"), pose_progress().DebugString());
  EXPECT_EQ(control_in<wire::ServerControl>("pointed"), pointed().DebugString());
  EXPECT_EQ(control_in<wire::ClientControl>("signal"), sent_signal().DebugString());
  EXPECT_EQ(control_in<wire::ServerControl>("room_start"), room_start().DebugString());
  EXPECT_EQ(control_in<wire::ServerControl>("room_reset"), room_reset().DebugString());
  EXPECT_EQ(control_in<wire::ServerControl>("soft_shape"), soft_shape().DebugString());
}

TEST(GoldenWire, ClientDatagramDecodesToItsValues) {
  const Bytes datagram = golden("client_update");
  DatagramHeader header;
  ASSERT_EQ(parse_header(datagram, header), DropReason::kNone);
  EXPECT_EQ(header.type, DatagramType::kClientUpdate);
  EXPECT_EQ(header.epoch, 5);
  EXPECT_EQ(header.connection.value, 0x0123456789abcdefULL);
  EXPECT_EQ(header.sequence, 0x1122U);
  ClientUpdate read;
  ASSERT_EQ(parse_client_update(payload_of(datagram), read), DropReason::kNone);
  const ClientUpdate expected = client_update();
  EXPECT_EQ(read.input_tick, expected.input_tick);
  EXPECT_EQ(read.handle.X.p, expected.handle.X.p);
  EXPECT_EQ(read.handle.X.q.coeffs(), expected.handle.X.q.coeffs());
  EXPECT_EQ(read.handle.V.w, expected.handle.V.w);
  EXPECT_EQ(read.buttons, expected.buttons);
  EXPECT_EQ(read.sent, expected.sent);
  EXPECT_EQ(read.acknowledged_held, expected.acknowledged_held);
  EXPECT_EQ(read.energy_from_hand_j, expected.energy_from_hand_j);
}

TEST(GoldenWire, ServerDatagramDecodesToItsValues) {
  const Bytes datagram = golden("server_update");
  DatagramHeader header;
  ASSERT_EQ(parse_header(datagram, header), DropReason::kNone);
  EXPECT_EQ(header.type, DatagramType::kServerUpdate);
  EXPECT_EQ(header.sequence, 0x334455U);
  ServerUpdate read;
  ASSERT_EQ(parse_server_update(payload_of(datagram), read), DropReason::kNone);
  const ServerUpdate expected = server_update();
  EXPECT_EQ(read.step, expected.step);
  EXPECT_EQ(read.echoed_sent, expected.echoed_sent);
  EXPECT_EQ(read.received, expected.received);
  EXPECT_EQ(read.tool.X.p, expected.tool.X.p);
  EXPECT_EQ(read.wrench_on_hand_W.t, expected.wrench_on_hand_W.t);
  EXPECT_EQ(read.field_energy_kj_per_mol, expected.field_energy_kj_per_mol);
  ASSERT_EQ(read.bodies.size(), 2U);
  EXPECT_EQ(read.bodies[0].id, expected.held_body);
  EXPECT_EQ(read.bodies[0].held_by, UserId{3});
  EXPECT_EQ(read.bodies[0].state.V.v, expected.tool.V.v) << "binary fractions survive single precision";
  EXPECT_EQ(read.bodies[1].state.X.p, Vec3(0.25, 0.5, 0.75));
  ASSERT_EQ(read.users.size(), 1U);
  EXPECT_EQ(read.users[0].id, UserId{4});
}

}  // namespace
}  // namespace tandem::proto
