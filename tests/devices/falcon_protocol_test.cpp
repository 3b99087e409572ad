// Compares the Falcon's packets and kinematics with packets of the manufacturer's driver and with poses that are
// computed independently.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <string_view>

#include "common/base/random.hpp"
#include "devices/falcon/falcon_kinematics.hpp"
#include "devices/falcon/falcon_packet.hpp"

namespace tandem::devices {
namespace {

FalconPacket packet_of(std::string_view text) {
  FalconPacket packet{};
  std::copy(text.begin(), text.end(), packet.begin());
  return packet;
}

std::string text_of(const FalconPacket& packet) {
  return {packet.begin(), packet.end()};
}

struct Vector {
  std::string_view text;
  FalconCounts counts;
  std::uint8_t bits;
};
// Packets of the manufacturer's driver with their motor counts and lights. Source: libnifalcon,
// util/translate_packet.py
const Vector kVectors[] = {
    {"<AAAAAAAAAAAAAA>", {0, 0, 0}, 0},
    {"<PPPACEPACMPAEA>", {4095, 3906, 4034}, kFalconBlue},
    {"<AMKAMNKAIELAEA>", {2752, 2780, 2888}, kFalconBlue},
    {"<PBFANKFAGPFAEA>", {1311, 1453, 1526}, kFalconBlue},
    {"<FJCALNCAOPCAEA>", {661, 731, 766}, kFalconBlue},
    {"<MKEPLBAABKDAEA>", {-2900, 27, 929}, kFalconBlue},
    {"<PLPPIIAABGPPEA>", {-65, 136, -159}, kFalconBlue},
    {"<BLJADGNPFGJPEA>", {2481, -669, -1691}, kFalconBlue},
};

TEST(FalconPacket, WritesAndReadsThePacketsOfTheManufacturersDriver) {
  for (const Vector& one : kVectors) {
    EXPECT_EQ(text_of(falcon_request(one.counts, one.bits)), one.text);
    const auto read = read_falcon_packet(packet_of(one.text));
    ASSERT_TRUE(read) << one.text;
    EXPECT_EQ(read->encoders, one.counts) << one.text;
    EXPECT_EQ(read->bits, one.bits) << one.text;
  }
}

TEST(FalconPacket, ButtonsAndHomedArmsGoBeyondANibble) {
  FalconPacket packet = packet_of("<AAAAAAAAAAAAAA>");
  packet[13] = 0xc0;
  const auto read = read_falcon_packet(packet);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->bits, kFalconHomed | 0xf);
}

TEST(FalconPacket, ATooLargeNumberIsClampedWithItsSign) {
  for (const int number : {4096, 32767, 32768, 65536, 2147483647, -4096, -32769, -2147483647}) {
    const auto read = read_falcon_packet(falcon_request({number, 0, -4095}, 0));
    ASSERT_TRUE(read);
    EXPECT_EQ(read->encoders, FalconCounts(number > 0 ? 4095 : -4095, 0, -4095)) << number;
  }
}

std::vector<FalconReply> parsed(FalconPacketParser& parser, std::string_view text) {
  std::vector<FalconReply> replies;
  for (const char c : text) {
    if (const auto reply = parser.parse(static_cast<std::uint8_t>(c))) replies.push_back(*reply);
  }
  return replies;
}

TEST(FalconPacketParser, FindsPacketsBetweenOtherBytes) {
  FalconPacketParser parser;
  EXPECT_THAT(parsed(parser, "PPP>>A<<PPPACEPACMPAEA><A"), testing::SizeIs(1));
  EXPECT_EQ(parsed(parser, "AAA<FJCALNCAOPCAEA>").size(), 1U) << "a truncated packet must not hide the next one";
  EXPECT_EQ(parser.skipped(), 6U + 1U + 5U);
  EXPECT_EQ(parsed(parser, "<MKEPLBAA").size(), 0U);
  EXPECT_EQ(parsed(parser, "BKDAEA>").size(), 1U) << "split";
}

TEST(FalconPacketParser, AnyBytesAreSurvivedAndAPacketBehindThemIsFound) {
  Random random(4711);
  FalconPacketParser parser;
  for (int round = 0; round < 2000; ++round) {
    std::string bytes;
    const int length = static_cast<int>(random.uniform() * 40);
    for (int i = 0; i < length; ++i) bytes += static_cast<char>(60 + random.uniform() * 30);
    const std::string whole = bytes + std::string(15, '>') + "<FJCALNCAOPCAEA>";
    const auto replies = parsed(parser, whole);
    ASSERT_FALSE(replies.empty()) << whole;
    ASSERT_EQ(replies.back().encoders, FalconCounts(661, 731, 766)) << whole;
  }
}

/// Returns a grid of positions that covers the whole workspace.
std::vector<Vec3> places() {
  std::vector<Vec3> all;
  for (double z = 0.080; z <= 0.1701; z += 0.015) {
    for (double x = -0.03; x <= 0.0301; x += 0.015) {
      for (double y = -0.03; y <= 0.0301; y += 0.015) all.emplace_back(x, y, z);
    }
  }
  return all;
}

TEST(FalconKinematics, GivesTheKnownPosesOnTheAxis) {
  struct Pose {
    double z_m, theta_deg;
    int count;
  };
  for (const Pose& pose : {Pose{0.075, -18.32, -1463},
                           {0.080, -11.80, -1284},
                           {0.110, 16.19, -516},
                           {0.125, 27.71, -200},
                           {0.150, 47.24, 336},
                           {0.155, 51.55, 454},
                           {0.180, 82.68, 1308}}) {
    const auto angles = falcon_inverse({0, 0, pose.z_m});
    ASSERT_TRUE(angles) << pose.z_m;
    for (int leg = 0; leg < 3; ++leg) {
      EXPECT_NEAR((*angles)[leg] * 180 / std::numbers::pi, pose.theta_deg, 0.005) << pose.z_m;
    }
    const auto p = falcon_forward(falcon_angles(FalconCounts::Constant(pose.count)));
    ASSERT_TRUE(p) << pose.z_m;
    EXPECT_NEAR((*p - Vec3(0, 0, pose.z_m)).norm(), 0, 3e-5) << "half a step of the encoder";
  }
}

TEST(FalconKinematics, GivesTheKnownPoseOffTheAxis) {
  const auto p = falcon_forward(falcon_angles({-539, -328, 106}));
  ASSERT_TRUE(p);
  EXPECT_NEAR((*p - Vec3(0.01, 0.02, 0.12)).norm(), 0, 5e-5);
}

TEST(FalconKinematics, ForwardIsTheInverseOfTheInverseToANanometre) {
  for (const Vec3& place : places()) {
    const auto angles = falcon_inverse(place);
    ASSERT_TRUE(angles) << place.transpose();
    const auto p = falcon_forward(*angles);
    ASSERT_TRUE(p) << place.transpose();
    EXPECT_NEAR((*p - place).norm(), 0, 1e-9) << place.transpose();
  }
}

TEST(FalconKinematics, JacobianIsTheDerivativeOfTheInverse) {
  constexpr double kStep = 1e-6;
  for (const Vec3& place : places()) {
    const auto j = falcon_jacobian(place);
    ASSERT_TRUE(j);
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 h = kStep * Vec3::Unit(axis);
      // Fourth-order central difference with an error below 1e-9 rad/m.
      const Vec3 slope = (8 * (*falcon_inverse(place + h) - *falcon_inverse(place - h)) -
                          (*falcon_inverse(place + 2 * h) - *falcon_inverse(place - 2 * h))) /
                         (12 * kStep);
      const double error = (j->col(axis) - slope).cwiseAbs().maxCoeff();
      EXPECT_LT(error, 1e-7 * std::max(1.0, slope.cwiseAbs().maxCoeff())) << place.transpose() << ", axis " << axis;
    }
  }
}

TEST(FalconKinematics, OutOfReachIsSaidAndNotComputed) {
  EXPECT_FALSE(falcon_inverse({0.2, 0, 0.12}));
  EXPECT_FALSE(falcon_jacobian({0, 0, 0.5}));
  EXPECT_FALSE(falcon_torques({0, 0, 0.5}, Vec3(1, 0, 0)));
  EXPECT_FALSE(falcon_forward(Vec3::Constant(10)));
  EXPECT_FALSE(falcon_forward(Vec3::Constant(std::numeric_limits<double>::quiet_NaN())));
  EXPECT_FALSE(falcon_forward(falcon_angles(FalconCounts::Constant(32767))));
}

TEST(FalconForce, TorquesDoTheWorkOfTheForce) {
  for (const Vec3& place : places()) {
    const Vec3 force(1.5, -2, 0.7), v(0.1, 0.05, -0.2);
    const auto torques = falcon_torques(place, force);
    ASSERT_TRUE(torques);
    EXPECT_NEAR(torques->dot(*falcon_jacobian(place) * v), force.dot(v), 1e-12);
  }
}

/// Returns the force on the hand that the given motor counts cause.
Vec3 force_of(const Vec3& place, const FalconCounts& counts, double counts_per_n_m) {
  return falcon_jacobian(place)->transpose() * (counts.cast<double>() / -counts_per_n_m);
}

TEST(FalconForce, KeepsItsDirectionAtAnyRequestAndNeverWraps) {
  Random random(815);
  for (const Vec3& place : places()) {
    for (const double newton : {1.0, 8.0, 50.0, 1e3, 1e6, 1e12}) {
      const Vec3 direction = Vec3(random.normal(), random.normal(), random.normal()).normalized();
      const Vec3 wanted = newton * direction;
      const FalconCounts counts = falcon_motor_counts(*falcon_torques(place, wanted), 10000);
      ASSERT_LE(counts.cwiseAbs().maxCoeff(), 4095);
      const auto sent = read_falcon_packet(falcon_request(counts, 0));
      ASSERT_EQ(sent->encoders, counts);
      const Vec3 shown = force_of(place, counts, 10000);
      EXPECT_LE(shown.norm(), newton + 0.005) << "a fraction of a count of each motor is cut off";
      // The counts of the motors are integers of at most 4095. For a weak force, their rounding changes the direction
      // more, so the limit of the cosine is lower.
      EXPECT_GT(shown.normalized().dot(direction), counts.cwiseAbs().maxCoeff() > 1000 ? 0.999 : 0.97)
          << place.transpose() << ", " << newton << " N";
    }
  }
}

TEST(FalconForce, AForceThatIsNotFiniteBecomesZero) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(falcon_motor_counts(Vec3(1, nan, 0), 10000).isZero());
  EXPECT_TRUE(falcon_motor_counts(Vec3(1, infinity, 0), 10000).isZero());
  EXPECT_TRUE(falcon_motor_counts(Vec3(1, 0, 0), infinity).isZero());
  EXPECT_FALSE(falcon_torques({0, 0, 0.125}, Vec3(nan, 0, 0)));
}

}  // namespace
}  // namespace tandem::devices
