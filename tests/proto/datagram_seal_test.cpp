#include "proto/datagram_seal.hpp"

#include <gtest/gtest.h>

#include "proto/datagram_channel.hpp"
#include "proto/state_codec.hpp"

namespace tandem::proto {
namespace {

constexpr LocalTime kStart{std::chrono::seconds(10)};

secure::Exported secret_of(std::uint8_t seed, secure::Aead aead = secure::Aead::kAes256Gcm) {
  secure::Exported exported;
  exported.aead = aead;
  std::ranges::fill(exported.secret.bytes(), std::byte{seed});
  return exported;
}

Bytes sealed_by(DatagramSeal& seal, std::uint64_t sequence, const Bytes& payload, LocalTime now = kStart) {
  Bytes datagram;
  seal.keep_fresh(now);
  append_header({DatagramType::kClientUpdate, seal.epoch(), ConnectionId{7}, sequence}, datagram);
  datagram.insert(datagram.end(), payload.begin(), payload.end());
  seal.seal(sequence, datagram);
  return datagram;
}

/// Opens a datagram. Returns its payload, or the reason why it was dropped.
std::pair<DropReason, Bytes> opened_by(DatagramSeal& opener, const Bytes& datagram) {
  DatagramHeader header;
  if (const DropReason reason = parse_header(datagram, header); reason != DropReason::kNone) return {reason, {}};
  std::span<const std::byte> payload;
  const DropReason reason = opener.open(header, datagram, payload);
  return {reason, reason == DropReason::kNone ? Bytes(payload.begin(), payload.end()) : Bytes{}};
}

class EachCipher : public testing::TestWithParam<secure::Aead> {
 protected:
  const secure::Exported secret = secret_of(1, GetParam());
  DatagramSeal seal{secret, DatagramSeal::Use::kSeal, true, 0};
  DatagramSeal opener{secret, DatagramSeal::Use::kOpen, true, 0};
  const Bytes payload = Bytes(50, std::byte{0x42});
};

TEST_P(EachCipher, DecryptsASealedDatagramThatDoesNotShowItsContent) {
  for (std::uint64_t sequence = 1; sequence < 10; ++sequence) {
    const Bytes datagram = sealed_by(seal, sequence, payload);
    EXPECT_EQ(datagram.size(), kDatagramHeaderBytes + payload.size());
    EXPECT_TRUE(std::ranges::search(datagram, Bytes(4, std::byte{0x42})).empty());
    EXPECT_EQ(opened_by(opener, datagram), std::pair(DropReason::kNone, payload));
  }
}

TEST_P(EachCipher, RefusesEachBitThatWasChangedAndEachByteThatWasCut) {
  const Bytes good = sealed_by(seal, 1, payload);
  for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
    Bytes bad = good;
    bad[bit / 8] ^= std::byte(1U << (bit % 8));
    EXPECT_NE(opened_by(opener, bad).first, DropReason::kNone) << "bit " << bit;
  }
  for (std::size_t size = 0; size < good.size(); ++size) {
    EXPECT_NE(opened_by(opener, Bytes(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size))).first,
              DropReason::kNone);
  }
  EXPECT_EQ(opened_by(opener, good).first, DropReason::kNone) << "none of them did any harm";
}

TEST_P(EachCipher, TheOtherDirectionAndAnotherConnectionHaveOtherKeys) {
  const Bytes datagram = sealed_by(seal, 1, payload);
  DatagramSeal down(secret, DatagramSeal::Use::kOpen, false, 0);
  DatagramSeal other(secret_of(2, GetParam()), DatagramSeal::Use::kOpen, true, 0);
  EXPECT_EQ(opened_by(down, datagram).first, DropReason::kTag);
  EXPECT_EQ(opened_by(other, datagram).first, DropReason::kTag);
}

TEST_P(EachCipher, ChangesTheKeyEachHourAndRefusesTheOldKey) {
  const Bytes old = sealed_by(seal, 1, payload);
  std::uint8_t before = 0;
  for (int hour = 1; hour <= 20; ++hour) {
    const Bytes fresh = sealed_by(seal, 1U + static_cast<unsigned>(hour), payload, kStart + hour * kMaxEpochAge);
    EXPECT_EQ(seal.epoch(), (before + 1) & kMaxEpoch);
    before = seal.epoch();
    EXPECT_EQ(opened_by(opener, fresh), std::pair(DropReason::kNone, payload)) << "hour " << hour;
    EXPECT_EQ(opener.epoch(), seal.epoch());
    EXPECT_NE(opened_by(opener, old).first, DropReason::kNone);
  }
}

TEST_P(EachCipher, AWrongEpochIsRefusedAndMovesNothing) {
  const Bytes good = sealed_by(seal, 1, payload);
  for (unsigned epoch = 1; epoch <= kMaxEpoch; ++epoch) {
    Bytes forged = good;
    forged[0] |= std::byte(epoch);
    EXPECT_EQ(opened_by(opener, forged).first, epoch == 1 ? DropReason::kTag : DropReason::kUnknownConnection);
  }
  EXPECT_EQ(opener.epoch(), 0);
  EXPECT_EQ(opened_by(opener, good).first, DropReason::kNone);
}

INSTANTIATE_TEST_SUITE_P(DatagramSeal, EachCipher,
                         testing::Values(secure::Aead::kAes256Gcm, secure::Aead::kChaCha20Poly1305));

TEST(ReplayWindow, RemembersEachOfTheLastSequencesAndNoEarlierOne) {
  ReplayWindow window;
  for (std::uint64_t sequence = 1; sequence <= 10'000; sequence += 2) window.accept(sequence);
  constexpr std::uint64_t kNewest = 9999;
  for (std::uint64_t back = 0; back < ReplayWindow::kSize; ++back) {
    EXPECT_EQ(window.check(kNewest - back), back % 2 == 0 ? DropReason::kDuplicate : DropReason::kNone) << back;
  }
  EXPECT_EQ(window.check(kNewest - ReplayWindow::kSize), DropReason::kLate);
  EXPECT_EQ(window.check(1), DropReason::kLate);
  window.accept(kNewest - 1);
  EXPECT_EQ(window.check(kNewest - 1), DropReason::kDuplicate);
  window.accept(kNewest + ReplayWindow::kSize);
  EXPECT_EQ(window.check(kNewest), DropReason::kLate);
  EXPECT_EQ(window.check(kNewest + 1), DropReason::kNone) << "a sequence that was skipped";
}

/// Both ends of an encrypted connection.
class SealedChannel : public testing::Test {
 protected:
  static DatagramChannel::Settings settings(DatagramType sends) {
    return {.sends = sends, .connection = ConnectionId{7}, .max_rate_hz = 1000, .secret = secret_of(3)};
  }
  Bytes from_client() {
    ClientUpdate update;
    Bytes datagram;
    client.send(update, now, false, append_client_update, [&datagram](std::span<const std::byte> bytes) {
      datagram.assign(bytes.begin(), bytes.end());
      return true;
    });
    return datagram;
  }
  DropReason to_server(const Bytes& datagram) {
    DatagramHeader header;
    if (const DropReason reason = read_header(datagram, DatagramType::kClientUpdate, header);
        reason != DropReason::kNone)
      return reason;
    ClientUpdate update;
    return server.receive(header, datagram, now, update, parse_client_update);
  }

  LocalTime now = kStart;
  ChannelCounters counters;
  DatagramChannel client{settings(DatagramType::kClientUpdate), counters};
  DatagramChannel server{settings(DatagramType::kServerUpdate), counters};
};

TEST_F(SealedChannel, ReplayedReorderedAndForgedDatagramsHaveTheirReasons) {
  const Bytes first = from_client(), second = from_client(), third = from_client();
  EXPECT_EQ(to_server(second), DropReason::kNone);
  EXPECT_EQ(to_server(second), DropReason::kDuplicate);
  EXPECT_EQ(to_server(first), DropReason::kLate) << "authentic, but too old";
  EXPECT_EQ(to_server(first), DropReason::kDuplicate) << "now it has been here";
  Bytes forged = third;
  forged.back() ^= std::byte{1};
  EXPECT_EQ(to_server(forged), DropReason::kTag);
  Bytes far = third;
  far[16] = std::byte{200};
  EXPECT_EQ(to_server(far), DropReason::kTag) << "a sequence that was not sealed moves no window";
  EXPECT_EQ(to_server(third), DropReason::kNone);
}

TEST_F(SealedChannel, AnAddressIsRequestedToReturnANumberOnce) {
  constexpr std::uint64_t kNumber = 0x0102030405060708;
  const auto question = server.path_message(kNumber, now);
  const Bytes challenge(question.begin(), question.end());
  DatagramHeader header;
  std::uint64_t number = 0;
  ASSERT_EQ(read_header(challenge, DatagramType::kServerUpdate, header), DropReason::kNone);
  ASSERT_EQ(client.receive_path(header, challenge, number), DropReason::kNone);
  EXPECT_EQ(number, kNumber);
  EXPECT_EQ(client.receive_path(header, challenge, number), DropReason::kDuplicate);
  const auto answer = client.path_message(number, now);
  const Bytes reply(answer.begin(), answer.end());
  EXPECT_EQ(to_server(from_client()), DropReason::kNone);
  number = 0;
  ASSERT_EQ(read_header(reply, DatagramType::kClientUpdate, header), DropReason::kNone);
  EXPECT_EQ(server.receive_path(header, reply, number), DropReason::kNone) << "although newer state is here";
  EXPECT_EQ(number, kNumber);
}

}  // namespace
}  // namespace tandem::proto
