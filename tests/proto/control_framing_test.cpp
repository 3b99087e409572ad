// Tests the framing of control messages. A stream may arrive in pieces of any size, and from a peer that is not
// trusted.
#include "proto/control_framing.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/base/random.hpp"
#include "tests/proto/samples.hpp"

namespace tandem::proto {
namespace {

/// Returns a length prefix with the value `announced`, followed by `size` bytes.
Bytes raw_frame(std::size_t size, std::size_t announced) {
  Bytes bytes;
  for (const unsigned shift : {24U, 16U, 8U, 0U}) bytes.push_back(std::byte((announced >> shift) & 0xffU));
  for (std::size_t i = 0; i < size; ++i) bytes.push_back(std::byte(i * 31 + size));
  return bytes;
}
Bytes raw_frame(std::size_t size) {
  return raw_frame(size, size);
}

void append(const Bytes& from, Bytes& to) {
  to.insert(to.end(), from.begin(), from.end());
}

/// Passes the stream to a reader in random pieces of at most `largest_piece` bytes. Returns the frames.
std::vector<Bytes> frames_of(const Bytes& stream, std::size_t largest_piece, Random& random) {
  FrameReader reader;
  std::vector<Bytes> frames;
  for (std::size_t at = 0; at < stream.size();) {
    const std::size_t wanted = 1 + random.next_u32() % largest_piece;
    const std::size_t size = std::min(wanted, stream.size() - at);
    const bool is_open = reader.feed(std::span(stream).subspan(at, size));
    while (const auto frame = reader.next()) frames.emplace_back(frame->begin(), frame->end());
    if (!is_open) break;
    at += size;
  }
  return frames;
}

template <class Message>
Bytes serialized(const Message& message) {
  Bytes frame;
  append_frame(message, frame);
  return {frame.begin() + kFrameLengthBytes, frame.end()};
}

TEST(FrameReader, GivesTheSameFramesHoweverTheStreamIsCut) {
  std::vector<Bytes> expected;
  Bytes stream;
  for (const std::size_t size : {0UL, 1UL, 3UL, 4UL, 5UL, 0UL, 1000UL, 70'000UL, kMaxControlBytes, 17UL}) {
    const Bytes frame = raw_frame(size);
    expected.emplace_back(frame.begin() + kFrameLengthBytes, frame.end());
    append(frame, stream);
  }
  for (const std::size_t largest_piece : {1UL, 2UL, 7UL, 5'000UL, 200'000UL, stream.size()}) {
    Random random(1);
    EXPECT_TRUE(frames_of(stream, largest_piece, random) == expected) << "pieces up to " << largest_piece;
  }
}

TEST(FrameReader, AFrameOverTheLimitEndsTheStreamAfterTheWholeFramesBeforeIt) {
  Bytes stream = raw_frame(10);
  append(raw_frame(100, kMaxControlBytes + 1), stream);
  append(raw_frame(10), stream);
  for (const std::size_t largest_piece : {std::size_t{1}, std::size_t{9}, stream.size()}) {
    Random random(1);
    EXPECT_EQ(frames_of(stream, largest_piece, random).size(), 1U) << "pieces up to " << largest_piece;
  }
  FrameReader reader;
  EXPECT_FALSE(reader.feed(stream));
  EXPECT_FALSE(reader.feed(raw_frame(1))) << "stays closed";
  EXPECT_TRUE(reader.next().has_value());
  EXPECT_FALSE(reader.next().has_value());
}

TEST(FrameReader, EveryLengthOverTheLimitIsRefusedAtItsFourthByte) {
  for (const std::size_t announced : {kMaxControlBytes + 1, std::size_t{0x7fffffff}, std::size_t{0xffffffff}}) {
    const Bytes prefix = raw_frame(0, announced);
    FrameReader reader;
    EXPECT_TRUE(reader.feed(std::span(prefix).first(3)));
    EXPECT_FALSE(reader.feed(std::span(prefix).last(1)));
    EXPECT_FALSE(reader.next().has_value());
  }
}

TEST(FrameReader, AnUnfinishedFrameGivesNothing) {
  FrameReader reader;
  const Bytes frame = raw_frame(100);
  ASSERT_TRUE(reader.feed(std::span(frame).first(frame.size() - 1)));
  EXPECT_FALSE(reader.next().has_value());
  ASSERT_TRUE(reader.feed(std::span(frame).last(1)));
  EXPECT_TRUE(reader.next().has_value());
}

TEST(FrameReader, ASlowReaderLosesNothing) {
  FrameReader reader;
  Random random(2);
  std::size_t fed = 0;
  std::size_t taken = 0;
  for (int round = 0; round < 2'000; ++round) {
    for (std::uint32_t n = random.next_u32() % 4; n > 0; --n) ASSERT_TRUE(reader.feed(raw_frame(fed++ % 300)));
    for (std::uint32_t n = random.next_u32() % 4; n > 0; --n) {
      const auto frame = reader.next();
      ASSERT_EQ(frame.has_value(), taken < fed);
      if (!frame) break;
      const Bytes expected = raw_frame(taken++ % 300);
      ASSERT_TRUE(std::equal(frame->begin(), frame->end(), expected.begin() + kFrameLengthBytes, expected.end()));
    }
  }
  EXPECT_GT(taken, 1'000U);
}

TEST(ControlFraming, RefusesToSendMoreThanAReaderAccepts) {
  wire::ServerControl message = asset_chunk();
  message.mutable_asset_chunk()->mutable_data()->assign(kMaxControlBytes, 'x');
  Bytes out;
  EXPECT_THROW(append_frame(message, out), std::length_error);
  EXPECT_TRUE(out.empty());
}

TEST(ParseControl, NeedsOneCompleteMessage) {
  wire::ClientControl client;
  wire::ServerControl server;
  EXPECT_TRUE(parse_control(serialized(hello()), client));
  EXPECT_TRUE(parse_control(serialized(joined()), server));
  EXPECT_FALSE(parse_control({}, client)) << "no oneof";
  EXPECT_FALSE(parse_control({}, server)) << "no oneof";
  wire::ClientControl only_request;
  only_request.set_request(1);
  EXPECT_FALSE(parse_control(serialized(only_request), client));
  Bytes cut = serialized(hello());
  cut.pop_back();
  EXPECT_FALSE(parse_control(cut, client));
}

TEST(ParseControl, RefusesNumbersThatAreNotFiniteAtAnyDepth) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  wire::ClientControl parameter;
  parameter.mutable_set_parameter()->set_value(1.0);
  wire::ClientControl client;
  EXPECT_TRUE(parse_control(serialized(parameter), client));
  parameter.mutable_set_parameter()->set_value(std::nan(""));
  EXPECT_FALSE(parse_control(serialized(parameter), client));

  wire::ServerControl server;
  wire::ServerControl joined = proto::joined();
  joined.mutable_joined()->mutable_scene()->mutable_bodies(0)->mutable_shapes(0)->mutable_sphere()->set_radius_m(
      kInfinity);
  EXPECT_FALSE(parse_control(serialized(joined), server)) << "a sphere's radius";
  joined = proto::joined();
  joined.mutable_joined()->mutable_scene()->set_gravity_m_per_s2(2, -kInfinity);
  EXPECT_FALSE(parse_control(serialized(joined), server)) << "one number of gravity";
}

TEST(ParseControl, RefusesAWelcomeThatDatagramsCouldNotFollow) {
  wire::ServerControl out;
  wire::ServerControl message = welcome();
  EXPECT_TRUE(parse_control(serialized(message), out));
  message.mutable_welcome()->set_connection_id(0);
  EXPECT_FALSE(parse_control(serialized(message), out));
  message = welcome();
  message.mutable_welcome()->set_epoch(kMaxEpoch + 1);
  EXPECT_FALSE(parse_control(serialized(message), out));
  message = welcome();
  message.mutable_welcome()->set_datagram_port(65'536);
  EXPECT_FALSE(parse_control(serialized(message), out));
}

TEST(ParseControl, RefusesAChunkOutsideItsAsset) {
  wire::ServerControl out;
  const auto parses = [&out](const auto& change) {
    wire::ServerControl message = asset_chunk();
    change(*message.mutable_asset_chunk());
    return parse_control(serialized(message), out);
  };
  EXPECT_TRUE(parses([](wire::AssetChunk&) {}));
  EXPECT_TRUE(parses([](wire::AssetChunk& c) { c.set_total_bytes(c.offset() + c.data().size()); }));
  EXPECT_FALSE(parses([](wire::AssetChunk& c) { c.set_total_bytes(c.offset() + c.data().size() - 1); }));
  EXPECT_FALSE(parses([](wire::AssetChunk& c) { c.set_offset(c.total_bytes() + 1); }));
  EXPECT_FALSE(parses([](wire::AssetChunk& c) { c.set_offset(std::numeric_limits<std::uint64_t>::max()); }));
  EXPECT_FALSE(parses([](wire::AssetChunk& c) { c.mutable_sha256()->pop_back(); }));
  EXPECT_FALSE(parses([](wire::AssetChunk& c) {
    c.set_total_bytes(1'000'000);
    c.mutable_data()->assign(kAssetChunkBytes + 1, 'x');
  }));
}

}  // namespace
}  // namespace tandem::proto
