// Tests the codecs of states. Decoding must return the encoded values, and refuse a message in which any one field is
// out of range.
#include "proto/state_codec.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "tandem/state.pb.h"
#include "tests/proto/samples.hpp"

namespace tandem::proto {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

Bytes bytes_of(const google::protobuf::MessageLite& message) {
  const std::string text = message.SerializeAsString();
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

wire::ClientUpdate good_client_update() {
  Bytes bytes;
  append_client_update(client_update(), bytes);
  wire::ClientUpdate message;
  EXPECT_TRUE(message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())));
  return message;
}

wire::ServerUpdate good_server_update() {
  Bytes bytes;
  ServerUpdateEncoder().append(server_update(), bytes);
  wire::ServerUpdate message;
  EXPECT_TRUE(message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())));
  return message;
}

DropReason answer_to(const std::function<void(wire::ClientUpdate&)>& change) {
  wire::ClientUpdate message = good_client_update();
  change(message);
  ClientUpdate out;
  return parse_client_update(bytes_of(message), out);
}

DropReason answer_to(const std::function<void(wire::ServerUpdate&)>& change) {
  wire::ServerUpdate message = good_server_update();
  change(message);
  ServerUpdate out;
  return parse_server_update(bytes_of(message), out);
}

using Client = wire::ClientUpdate;
using Server = wire::ServerUpdate;

void expect_same(const RigidState& a, const RigidState& b, double tolerance) {
  EXPECT_LE((a.X.p - b.X.p).norm(), tolerance);
  EXPECT_LE(a.X.q.angularDistance(b.X.q), tolerance);
  EXPECT_LE((a.V.v - b.V.v).norm(), tolerance);
  EXPECT_LE((a.V.w - b.V.w).norm(), tolerance);
}

TEST(ClientUpdateCodec, ReadsBackEveryField) {
  for (const ClientUpdate& written :
       {client_update(), largest_client_update(), largest_client_update(ClientMode::kWave),
        largest_client_update(ClientMode::kHandle), ClientUpdate{}}) {
    Bytes bytes;
    append_client_update(written, bytes);
    // Decodes into an object with other contents, all of which must be overwritten.
    ClientUpdate read = largest_client_update(ClientMode::kWave);
    ASSERT_EQ(parse_client_update(bytes, read), DropReason::kNone);
    EXPECT_EQ(read.input_tick, written.input_tick);
    // Decoding normalises the unit quaternion, which changes it by rounding only.
    expect_same(read.handle, written.handle, 1e-12);
    EXPECT_EQ(read.handle_valid, written.handle_valid);
    EXPECT_EQ(read.buttons, written.buttons);
    EXPECT_EQ(read.sent, written.sent);
    EXPECT_EQ(read.acknowledged_step, written.acknowledged_step);
    EXPECT_EQ(read.acknowledged_sent, written.acknowledged_sent);
    EXPECT_EQ(read.acknowledged_held, written.acknowledged_held);
    EXPECT_EQ(read.energy_to_hand_j, written.energy_to_hand_j);
    EXPECT_EQ(read.energy_from_hand_j, written.energy_from_hand_j);
    EXPECT_EQ(read.mode, written.mode);
    const double tolerance = 1e-6 * (1 + written.on_hand_W.f.norm() + written.on_hand_W.t.norm());  // single precision
    EXPECT_LE((read.on_hand_W.f - written.on_hand_W.f).norm(), tolerance);
    EXPECT_LE((read.on_hand_W.t - written.on_hand_W.t).norm(), tolerance);
    EXPECT_EQ(read.round_trip, written.round_trip);
    EXPECT_EQ(read.wave.f, written.wave.f);
    EXPECT_EQ(read.wave.t, written.wave.t);
  }
}

TEST(ClientUpdateCodec, LargestUpdateFitsADatagram) {
  for (const ClientMode mode : {ClientMode::kHandle, ClientMode::kLocalModel, ClientMode::kWave}) {
    Bytes bytes;
    append_client_update(largest_client_update(mode), bytes);
    EXPECT_LE(bytes.size(), kMaxPayloadBytes);
  }
}

TEST(ClientUpdateCodec, AModeHasItsOwnPartsAndNoOthers) {
  EXPECT_EQ(answer_to([](Client& m) { m.clear_on_hand(); }), DropReason::kMalformed);
  EXPECT_EQ(answer_to([](Client& m) { m.add_on_hand(0); }), DropReason::kMalformed) << "seven";
  EXPECT_EQ(answer_to([](Client& m) { m.set_mode(0); }), DropReason::kMalformed)
      << "mode 0 with a displayed wrench is malformed";
  EXPECT_EQ(answer_to([](Client& m) { m.add_wave(0); }), DropReason::kMalformed);
  EXPECT_EQ(answer_to([](Client& m) { m.set_mode(3); }), DropReason::kNotFinite);
  EXPECT_EQ(answer_to([](Client& m) {
              m.set_mode(2);
              m.clear_on_hand();
            }),
            DropReason::kMalformed)
      << "without waves";
  for (const int count : {5, 6, 7}) {
    const auto with_waves = [count](Client& m) {
      m.set_mode(2);
      m.clear_on_hand();
      for (int i = 0; i < count; ++i) m.add_wave(1);
    };
    EXPECT_EQ(answer_to(with_waves), count == 6 ? DropReason::kNone : DropReason::kMalformed) << count;
  }
}

TEST(ClientUpdateCodec, ALongRoundTripIsSentAsTheLongestAndRefusedBeyondIt) {
  ClientUpdate written = client_update();
  written.round_trip = 3 * kMaxDelay;
  Bytes bytes;
  append_client_update(written, bytes);
  ClientUpdate read;
  ASSERT_EQ(parse_client_update(bytes, read), DropReason::kNone);
  EXPECT_EQ(read.round_trip, kMaxDelay);
  const auto limit = static_cast<std::uint64_t>(kMaxDelay.count());
  EXPECT_EQ(answer_to([&](Client& m) { m.set_round_trip_ns(limit + 1); }), DropReason::kNotFinite);
  EXPECT_EQ(answer_to([&](Client& m) { m.set_round_trip_ns(~0ULL); }), DropReason::kNotFinite);
}

TEST(ClientUpdateCodec, EachPartMustBeThere) {
  ClientUpdate out;
  EXPECT_EQ(parse_client_update({}, out), DropReason::kMalformed);
  EXPECT_EQ(answer_to([](Client& m) { m.clear_handle(); }), DropReason::kMalformed);
  EXPECT_EQ(answer_to([](Client& m) { m.mutable_handle()->clear_p(); }), DropReason::kMalformed);
  EXPECT_EQ(answer_to([](Client& m) { m.mutable_handle()->clear_q(); }), DropReason::kMalformed);
  EXPECT_EQ(answer_to([](Client& m) { m.mutable_handle()->mutable_p()->Clear(); }), DropReason::kNone) << "the origin";
}

TEST(ClientUpdateCodec, EachNumberOutsideItsRangeIsRefused) {
  for (const double bad : {kNan, kInfinity, -kInfinity, 1e300, -1e300}) {
    SCOPED_TRACE(bad);
    const auto refused = [](const std::function<void(Client&)>& change) {
      return answer_to(change) == DropReason::kNotFinite;
    };
    EXPECT_TRUE(refused([&](Client& m) { m.mutable_handle()->mutable_p()->set_y_m(bad); }));
    EXPECT_TRUE(refused([&](Client& m) { m.mutable_handle()->mutable_q()->set_w(bad); }));
    EXPECT_TRUE(refused([&](Client& m) { m.mutable_handle()->set_vz_m_per_s(bad); }));
    EXPECT_TRUE(refused([&](Client& m) { m.mutable_handle()->set_wx_rad_per_s(bad); }));
    EXPECT_TRUE(refused([&](Client& m) { m.set_energy_to_hand_j(bad); }));
    EXPECT_TRUE(refused([&](Client& m) { m.set_energy_from_hand_j(bad); }));
    for (int i = 0; i < 6; ++i) {
      EXPECT_TRUE(refused([&](Client& m) { m.set_on_hand(i, static_cast<float>(bad)); }));
      EXPECT_TRUE(refused([&](Client& m) {
        m.set_mode(2);
        m.clear_on_hand();
        for (int k = 0; k < 6; ++k) m.add_wave(k == i ? bad : 0);
      }));
    }
  }
  EXPECT_EQ(answer_to([](Client& m) { m.set_energy_to_hand_j(-1e-9); }), DropReason::kNotFinite);
}

TEST(ClientUpdateCodec, LimitsHoldForTheLengthOfAVectorAndAreInclusive) {
  const auto answer_at = [](double x, double y) {
    return answer_to([&](Client& m) {
      m.mutable_handle()->mutable_p()->set_x_m(x);
      m.mutable_handle()->mutable_p()->set_y_m(y);
      m.mutable_handle()->mutable_p()->set_z_m(0);
    });
  };
  EXPECT_EQ(answer_at(kMaxPositionM, 0), DropReason::kNone);
  EXPECT_EQ(answer_at(std::nextafter(kMaxPositionM, 2e3), 0), DropReason::kNotFinite);
  EXPECT_EQ(answer_at(0.8 * kMaxPositionM, 0.8 * kMaxPositionM), DropReason::kNotFinite);
}

TEST(ClientUpdateCodec, RotationIsMadeUnitLengthOrRefused) {
  const auto scaled = [](double scale) {
    wire::ClientUpdate message = good_client_update();
    wire::Rotation& q = *message.mutable_handle()->mutable_q();
    q.set_w(scale * q.w());
    q.set_x(scale * q.x());
    q.set_y(scale * q.y());
    q.set_z(scale * q.z());
    return bytes_of(message);
  };
  ClientUpdate out;
  for (const double scale : {1 - 0.99 * kMaxQuaternionError, 1 + 0.99 * kMaxQuaternionError}) {
    ASSERT_EQ(parse_client_update(scaled(scale), out), DropReason::kNone);
    EXPECT_NEAR(out.handle.X.q.norm(), 1.0, 1e-15);
    EXPECT_LE(out.handle.X.q.angularDistance(client_update().handle.X.q), 1e-7);
  }
  for (const double scale : {0.0, 1 - 1.01 * kMaxQuaternionError, 1 + 1.01 * kMaxQuaternionError, 1e200}) {
    EXPECT_EQ(parse_client_update(scaled(scale), out), DropReason::kNotFinite) << scale;
  }
}

TEST(ClientUpdateCodec, TimesBeyondTheLimitAreRefused) {
  const auto limit = static_cast<std::uint64_t>(kMaxTimestamp.count());
  EXPECT_EQ(answer_to([&](Client& m) { m.set_sent_local_ns(limit); }), DropReason::kNone);
  EXPECT_EQ(answer_to([&](Client& m) { m.set_sent_local_ns(limit + 1); }), DropReason::kNotFinite);
  EXPECT_EQ(answer_to([&](Client& m) { m.set_acknowledged_server_ns(~0ULL); }), DropReason::kNotFinite);
  EXPECT_EQ(answer_to([&](Client& m) { m.set_acknowledged_held_ns(limit + 1); }), DropReason::kNotFinite);
}

TEST(ClientUpdateCodec, UnknownFieldsAreSkippedWithinTheSizeLimit) {
  wire::ClientUpdate message = good_client_update();
  auto& unknown = *message.GetReflection()->MutableUnknownFields(&message);
  unknown.AddVarint(1000, 1);
  unknown.AddLengthDelimited(1001, std::string(700, 'x'));
  Bytes bytes = bytes_of(message);
  ClientUpdate out;
  ASSERT_EQ(parse_client_update(bytes, out), DropReason::kNone);
  EXPECT_EQ(out.input_tick, client_update().input_tick);
  unknown.AddLengthDelimited(1002, std::string(700, 'x'));
  EXPECT_EQ(parse_client_update(bytes_of(message), out), DropReason::kMalformed) << "over kMaxPayloadBytes";
}

TEST(ServerUpdateCodec, ReadsBackEveryField) {
  const ServerUpdate written = server_update();
  Bytes bytes;
  ServerUpdateEncoder().append(written, bytes);
  ServerUpdate read = largest_server_update(0);  // an object with other contents, all of which decoding must overwrite
  ASSERT_EQ(parse_server_update(bytes, read), DropReason::kNone);
  EXPECT_EQ(read.step, written.step);
  EXPECT_EQ(read.stepped, written.stepped);
  EXPECT_EQ(read.answered_input, written.answered_input);
  EXPECT_EQ(read.echoed_sent, written.echoed_sent);
  EXPECT_EQ(read.received, written.received);
  EXPECT_EQ(read.sent, written.sent);
  expect_same(read.tool, written.tool, 1e-12);
  EXPECT_EQ(read.wrench_on_hand_W.f, written.wrench_on_hand_W.f);
  EXPECT_EQ(read.wrench_on_hand_W.t, written.wrench_on_hand_W.t);
  EXPECT_EQ(read.held_body, written.held_body);
  EXPECT_EQ(read.tick_faults, written.tick_faults);
  EXPECT_EQ(read.energy_into_world_j, written.energy_into_world_j);
  EXPECT_EQ(read.energy_from_world_j, written.energy_from_world_j);
  EXPECT_EQ(read.field_energy_kj_per_mol, written.field_energy_kj_per_mol);
  expect_same({read.X_BT, {}}, {written.X_BT, {}}, 1e-7);
  EXPECT_EQ(read.playout, written.playout);
  EXPECT_EQ(read.soft_contact.wrench_W.f, written.soft_contact.wrench_W.f);
  EXPECT_EQ(read.soft_contact.wrench_W.t, written.soft_contact.wrench_W.t);
  EXPECT_EQ(read.soft_contact.stiffness, written.soft_contact.stiffness) << "of numbers that a float holds";
  expect_same({read.soft_contact.X_WT0, {}}, {written.soft_contact.X_WT0, {}}, 1e-12);
  EXPECT_EQ(read.soft_contact.trust_radius_m, written.soft_contact.trust_radius_m);
  EXPECT_EQ(read.soft_contact.lever_m, written.soft_contact.lever_m);
  EXPECT_EQ(read.wave.f, written.wave.f);
  EXPECT_EQ(read.wave.t, written.wave.t);
  ASSERT_EQ(read.bodies.size(), 2U);
  EXPECT_EQ(read.bodies[0].id, BodyId{2}) << "the held body must be first";
  EXPECT_EQ(read.bodies[0].held_by, UserId{3});
  // The tolerance is the error of single precision at velocities below 4 m/s and 4 rad/s.
  expect_same(read.bodies[0].state, written.bodies[1].state, 1e-6);
  EXPECT_EQ(read.bodies[1].id, BodyId{7});
  EXPECT_EQ(read.bodies[1].held_by, UserId{});
  expect_same(read.bodies[1].state, written.bodies[0].state, 1e-7);
  ASSERT_EQ(read.users.size(), 1U);
  EXPECT_EQ(read.users[0].id, UserId{4});
  expect_same(read.users[0].tool, written.users[0].tool, 1e-6);
  EXPECT_EQ(read.users[0].tool_index, written.users[0].tool_index);
  ASSERT_TRUE(read.users[0].has_handle);
  expect_same(read.users[0].handle, written.users[0].handle, 1e-6);
  EXPECT_EQ(read.users[0].handle_age, written.users[0].handle_age);
  EXPECT_EQ(read.users[0].on_hand_W.f, written.users[0].on_hand_W.f) << "of numbers that a float holds";
  EXPECT_EQ(read.users[0].on_hand_W.t, written.users[0].on_hand_W.t);
}

TEST(ServerUpdateCodec, EachPartOfAPartnersHandleIsChecked) {
  const auto answer = [](const std::function<void(wire::PartnerHandle&)>& change) {
    return answer_to([&](Server& m) { change(*m.mutable_users(0)->mutable_handle()); });
  };
  EXPECT_EQ(answer([](auto&) {}), DropReason::kNone);
  EXPECT_EQ(answer_to([](Server& m) { m.mutable_users(0)->clear_handle(); }), DropReason::kNone)
      << "without a handle there is no force";
  EXPECT_EQ(answer([](auto& h) { h.add_pose(0); }), DropReason::kMalformed);
  EXPECT_EQ(answer([](auto& h) { h.clear_twist(); }), DropReason::kMalformed);
  EXPECT_EQ(answer([](auto& h) { h.mutable_on_hand()->RemoveLast(); }), DropReason::kMalformed);
  EXPECT_EQ(answer([](auto& h) { h.set_age_ns(~0ULL); }), DropReason::kNotFinite);
  for (const double bad : {kNan, kInfinity, -kInfinity, 1e38}) {
    const auto bad_float = static_cast<float>(bad);
    for (int i = 0; i < 6; ++i) {
      EXPECT_EQ(answer([&](auto& h) { h.set_pose(i, bad_float); }), DropReason::kNotFinite);
      EXPECT_EQ(answer([&](auto& h) { h.set_twist(i, bad_float); }), DropReason::kNotFinite);
      EXPECT_EQ(answer([&](auto& h) { h.set_on_hand(i, bad_float); }), DropReason::kNotFinite);
    }
  }
}

TEST(ServerUpdateCodec, TheWriterOmitsAHandleThatReadersWouldRefuse) {
  ServerUpdate written = server_update();
  written.users[0].on_hand_W.t.x() = kNan;
  Bytes bytes;
  ServerUpdateEncoder().append(written, bytes);
  ServerUpdate read;
  ASSERT_EQ(parse_server_update(bytes, read), DropReason::kNone);
  ASSERT_EQ(read.users.size(), 1U);
  EXPECT_FALSE(read.users[0].has_handle);
}

TEST(ServerUpdateCodec, ADefaultUpdateIsReadableAndLeavesNothingOfAnOlderOne) {
  Bytes bytes;
  ServerUpdateEncoder().append({}, bytes);
  ServerUpdate read = largest_server_update(0);
  ASSERT_EQ(parse_server_update(bytes, read), DropReason::kNone);
  EXPECT_EQ(read.X_BT.p, Vec3::Zero());
  EXPECT_EQ(read.soft_contact.trust_radius_m, 0);
  EXPECT_TRUE(read.soft_contact.stiffness.isZero(0));
  EXPECT_EQ(read.wave.f, Vec3::Zero());
  EXPECT_EQ(read.playout, Duration{0});
}

TEST(ServerUpdateCodec, TheWriterOmitsASoftContactThatReadersWouldRefuse) {
  const auto reads_as_none = [](const std::function<void(SoftContact&)>& change) {
    ServerUpdate written = server_update();
    change(written.soft_contact);
    Bytes bytes;
    ServerUpdateEncoder().append(written, bytes);
    ServerUpdate read;
    return parse_server_update(bytes, read) == DropReason::kNone && read.soft_contact.trust_radius_m == 0;
  };
  EXPECT_FALSE(reads_as_none([](SoftContact&) {}));
  EXPECT_TRUE(reads_as_none([](SoftContact& c) { c.stiffness(3, 3) = kNan; }));
  EXPECT_TRUE(reads_as_none([](SoftContact& c) { c.stiffness = -c.stiffness; }));
  EXPECT_TRUE(reads_as_none([](SoftContact& c) { c.stiffness *= 1e10; }));
  EXPECT_TRUE(reads_as_none([](SoftContact& c) { c.wrench_W.f.x() = kInfinity; }));
  EXPECT_TRUE(reads_as_none([](SoftContact& c) { c.trust_radius_m = 0; }));
}

TEST(ServerUpdateCodec, EachPartOfASoftContactIsCheckedOnReading) {
  using Change = std::function<void(wire::SoftContact&)>;
  const auto answer = [](const Change& change) {
    return answer_to([&](Server& m) { change(*m.mutable_soft_contact()); });
  };
  EXPECT_EQ(answer([](auto& c) { c.add_wrench(0); }), DropReason::kMalformed);
  EXPECT_EQ(answer([](auto& c) { c.clear_stiffness(); }), DropReason::kMalformed);
  EXPECT_EQ(answer([](auto& c) { c.add_stiffness(0); }), DropReason::kMalformed);
  EXPECT_EQ(answer([](auto& c) { c.mutable_pose()->RemoveLast(); }), DropReason::kMalformed);
  EXPECT_EQ(answer([](auto& c) { c.clear_trust_radius_m(); }), DropReason::kNotFinite);
  EXPECT_EQ(answer([](auto& c) { c.set_lever_m(-1e-9); }), DropReason::kNotFinite);
  // A negative diagonal element is a negative stiffness, which would push a tool further in its direction of motion.
  EXPECT_EQ(answer([](auto& c) { c.set_stiffness(0, -1000); }), DropReason::kNotFinite);
  for (const double bad : {kNan, kInfinity, -kInfinity, 1e38, -1e38}) {
    SCOPED_TRACE(bad);
    const auto bad_float = static_cast<float>(bad);
    for (int i = 0; i < 21; ++i) {
      EXPECT_EQ(answer([&](auto& c) { c.set_stiffness(i, bad_float); }), DropReason::kNotFinite);
    }
    for (int i = 0; i < 6; ++i) EXPECT_EQ(answer([&](auto& c) { c.set_wrench(i, bad_float); }), DropReason::kNotFinite);
    for (int i = 0; i < 7; ++i) EXPECT_EQ(answer([&](auto& c) { c.set_pose(i, bad); }), DropReason::kNotFinite);
    EXPECT_EQ(answer([&](auto& c) { c.set_trust_radius_m(bad); }), DropReason::kNotFinite);
    EXPECT_EQ(answer([&](auto& c) { c.set_lever_m(bad); }), DropReason::kNotFinite);
  }
}

TEST(ServerUpdateCodec, EachPartMustBeThereAndCountsAndIdsHold) {
  const auto malformed = [](const std::function<void(Server&)>& change) {
    return answer_to(change) == DropReason::kMalformed;
  };
  EXPECT_TRUE(malformed([](Server& m) { m.clear_tool(); }));
  EXPECT_TRUE(malformed([](Server& m) { m.clear_wrench_on_hand(); }));
  EXPECT_TRUE(malformed([](Server& m) { m.mutable_tool()->clear_q(); }));
  EXPECT_TRUE(malformed([](Server& m) { m.mutable_bodies(0)->set_id(0); }));
  EXPECT_TRUE(malformed([](Server& m) { m.mutable_users(0)->set_id(0); }));
  EXPECT_TRUE(malformed([](Server& m) { m.mutable_bodies(0)->set_id(m.bodies(1).id()); }));
  EXPECT_TRUE(malformed([](Server& m) { *m.add_users() = m.users(0); }));
  EXPECT_TRUE(malformed([](Server& m) { m.mutable_bodies(0)->add_pose(0); }));
  EXPECT_TRUE(malformed([](Server& m) { m.mutable_bodies(0)->mutable_pose()->RemoveLast(); }));
  EXPECT_TRUE(malformed([](Server& m) { m.mutable_bodies(0)->add_twist(0); }));
  EXPECT_TRUE(malformed([](Server& m) { m.mutable_bodies(0)->mutable_twist()->RemoveLast(); }));
  EXPECT_TRUE(malformed([](Server& m) { m.clear_tool_in_held_body(); }));
  EXPECT_TRUE(malformed([](Server& m) { m.add_tool_in_held_body(0); }));
  EXPECT_TRUE(malformed([](Server& m) { m.clear_held_body(); })) << "a grasp without a held body";
  EXPECT_TRUE(malformed([](Server& m) { m.mutable_wave()->RemoveLast(); }));
  EXPECT_TRUE(malformed([](Server& m) {
    for (std::size_t i = 0; i <= kMaxBodies; ++i) m.add_bodies();
  }));
  EXPECT_TRUE(malformed([](Server& m) {
    for (std::size_t i = 0; i <= kMaxUsers; ++i) m.add_users();
  }));
}

TEST(ServerUpdateCodec, EachNumberOutsideItsRangeIsRefused) {
  for (const double bad : {kNan, kInfinity, -kInfinity, 1e38, -1e38}) {
    SCOPED_TRACE(bad);
    const auto refused = [](const std::function<void(Server&)>& change) {
      return answer_to(change) == DropReason::kNotFinite;
    };
    const auto bad_float = static_cast<float>(bad);
    EXPECT_TRUE(refused([&](Server& m) { m.mutable_tool()->mutable_p()->set_x_m(bad); }));
    EXPECT_TRUE(refused([&](Server& m) { m.mutable_tool()->set_wy_rad_per_s(bad); }));
    EXPECT_TRUE(refused([&](Server& m) { m.mutable_wrench_on_hand()->set_fx_n(bad); }));
    EXPECT_TRUE(refused([&](Server& m) { m.mutable_wrench_on_hand()->set_tz_n_m(bad); }));
    EXPECT_TRUE(refused([&](Server& m) { m.set_energy_into_world_j(bad); }));
    EXPECT_TRUE(refused([&](Server& m) { m.set_energy_from_world_j(bad); }));
    EXPECT_TRUE(refused([&](Server& m) { m.set_field_energy_kj_per_mol(bad); }));
    for (int i = 0; i < 6; ++i) EXPECT_TRUE(refused([&](Server& m) { m.set_wave(i, bad); }));
    for (int i = 0; i < 7; ++i) EXPECT_TRUE(refused([&](Server& m) { m.set_tool_in_held_body(i, bad_float); }));
    for (int i = 0; i < 7; ++i) {
      EXPECT_TRUE(refused([&](Server& m) { m.mutable_bodies(0)->set_pose(i, bad_float); }));
      EXPECT_TRUE(refused([&](Server& m) { m.mutable_users(0)->set_pose(i, bad_float); }));
    }
    for (int i = 0; i < 6; ++i) {
      EXPECT_TRUE(refused([&](Server& m) { m.mutable_bodies(0)->set_twist(i, bad_float); }));
    }
  }
  EXPECT_EQ(answer_to([](Server& m) { m.set_playout_ns(~0ULL); }), DropReason::kNotFinite);
  const auto late = static_cast<std::uint64_t>(kMaxTimestamp.count()) + 1;
  EXPECT_EQ(answer_to([&](Server& m) { m.set_stepped_server_ns(late); }), DropReason::kNotFinite);
  EXPECT_EQ(answer_to([&](Server& m) { m.set_echoed_local_ns(late); }), DropReason::kNotFinite);
  EXPECT_EQ(answer_to([&](Server& m) { m.set_received_server_ns(late); }), DropReason::kNotFinite);
  EXPECT_EQ(answer_to([&](Server& m) { m.set_sent_server_ns(late); }), DropReason::kNotFinite);
}

TEST(ServerUpdateCodec, AStepOrAnEchoFromAfterItsDatagramIsRefused) {
  const auto answer_at = [](std::uint64_t stepped_ns, std::uint64_t received_ns) {
    return answer_to([&](Server& m) {
      m.set_stepped_server_ns(stepped_ns);
      m.set_received_server_ns(received_ns);
      m.set_sent_server_ns(1'000'000);
    });
  };
  EXPECT_EQ(answer_at(1'000'000, 1'000'000), DropReason::kNone);
  EXPECT_EQ(answer_at(1'000'001, 1'000'000), DropReason::kNotFinite);
  EXPECT_EQ(answer_at(1'000'000, 1'000'001), DropReason::kNotFinite);
  constexpr std::uint64_t kYear_ns = 31'557'600'000'000'000;
  EXPECT_EQ(answer_at(kYear_ns, 0), DropReason::kNotFinite);
}

TEST(ServerUpdateCodec, InfiniteFieldEnergyIsSentAsTheLargest) {
  ServerUpdate written = server_update();
  written.field_energy_kj_per_mol = kInfinity;
  Bytes bytes;
  ServerUpdateEncoder().append(written, bytes);
  ServerUpdate read;
  ASSERT_EQ(parse_server_update(bytes, read), DropReason::kNone);
  EXPECT_EQ(read.field_energy_kj_per_mol, kMaxFieldEnergyKjPerMol);
}

}  // namespace
}  // namespace tandem::proto
