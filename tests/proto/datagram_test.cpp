#include "proto/datagram.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <set>

#include "tests/proto/samples.hpp"

namespace tandem::proto {
namespace {

Bytes datagram_of(const DatagramHeader& header, std::size_t payload_bytes = 1) {
  Bytes bytes;
  append_header(header, bytes);
  bytes.resize(bytes.size() + payload_bytes, std::byte{0x5a});
  return bytes;
}

DropReason refusal_of(const Bytes& datagram) {
  DatagramHeader header;
  return parse_header(datagram, header);
}

TEST(DatagramHeader, HasTheDocumentedLayout) {
  const Bytes bytes = datagram_of({.type = DatagramType::kServerUpdate,
                                   .epoch = 5,
                                   .connection = ConnectionId{0x0102030405060708},
                                   .sequence = 0x1112131415161718},
                                  0);
  ASSERT_EQ(bytes.size(), kDatagramHeaderBytes);
  EXPECT_EQ(bytes[0], std::byte{0b011'01'101});
  for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(bytes[1 + i], std::byte(0x01 + i));
  for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(bytes[9 + i], std::byte(0x11 + i));
  for (std::size_t i = 17; i < kDatagramHeaderBytes; ++i) EXPECT_EQ(bytes[i], std::byte{0});
}

TEST(DatagramHeader, ReadsExtremeValuesThatItWrote) {
  constexpr auto kLargest = std::numeric_limits<std::uint64_t>::max();
  for (const auto type : {DatagramType::kClientUpdate, DatagramType::kServerUpdate}) {
    for (const std::uint8_t epoch : {std::uint8_t{0}, kMaxEpoch}) {
      for (const std::uint64_t number : {std::uint64_t{1}, kLargest}) {
        const DatagramHeader written{type, epoch, ConnectionId{number}, number};
        DatagramHeader read;
        ASSERT_EQ(parse_header(datagram_of(written), read), DropReason::kNone);
        EXPECT_EQ(read.type, type);
        EXPECT_EQ(read.epoch, epoch);
        EXPECT_EQ(read.connection.value, number);
        EXPECT_EQ(read.sequence, number);
      }
    }
  }
}

TEST(DatagramHeader, EachDefectIsRefusedWithItsReason) {
  const DatagramHeader good = client_header();
  EXPECT_EQ(refusal_of({}), DropReason::kTooShort);
  Bytes bytes = datagram_of(good, 0);
  EXPECT_EQ(refusal_of(bytes), DropReason::kNone);
  bytes.pop_back();
  EXPECT_EQ(refusal_of(bytes), DropReason::kTooShort);
  EXPECT_EQ(refusal_of(datagram_of(good, kMaxPayloadBytes)), DropReason::kNone);
  EXPECT_EQ(refusal_of(datagram_of(good, kMaxPayloadBytes + 1)), DropReason::kTooLong);
  for (unsigned version = 0; version < 8; ++version) {
    bytes = datagram_of(good);
    bytes[0] = std::byte((version << 5U) | 5U);
    EXPECT_EQ(refusal_of(bytes), version == kProtocolVersion ? DropReason::kNone : DropReason::kVersion);
  }
  EXPECT_EQ(refusal_of(datagram_of({.connection = ConnectionId{}, .sequence = 1})), DropReason::kUnknownConnection);
  EXPECT_EQ(refusal_of(datagram_of({.connection = ConnectionId{1}, .sequence = 0})), DropReason::kMalformed);
}

TEST(DropReason, EveryReasonHasItsOwnName) {
  std::set<std::string_view> names;
  for (unsigned i = 0; i < static_cast<unsigned>(DropReason::kCount); ++i) {
    const std::string_view name = name_of(static_cast<DropReason>(i));
    EXPECT_NE(name, "unknown") << i;
    EXPECT_TRUE(names.insert(name).second) << name << " names two reasons";
  }
}

TEST(DropCounters, CountEachReasonApart) {
  DropCounters counters;
  counters.add(DropReason::kLate);
  counters.add(DropReason::kLate, 2);
  counters.add(DropReason::kTag);
  EXPECT_EQ(counters.count(DropReason::kLate), 3U);
  EXPECT_EQ(counters.count(DropReason::kTag), 1U);
  EXPECT_EQ(counters.count(DropReason::kDuplicate), 0U);
}

}  // namespace
}  // namespace tandem::proto
