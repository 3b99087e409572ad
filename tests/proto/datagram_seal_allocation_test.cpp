#include <gtest/gtest.h>
#include <openssl/crypto.h>

#include <cstdlib>

#include "proto/datagram_seal.hpp"
#include "tests/support/allocation_counter.hpp"

namespace tandem::proto {
namespace {

std::uint64_t openssl_allocations = 0;

/// Replaces the allocation functions of OpenSSL by counting ones. OpenSSL accepts them only before its first
/// allocation.
const bool kIsCounting = CRYPTO_set_mem_functions(
                             [](std::size_t size, const char*, int) {
                               ++openssl_allocations;
                               return std::malloc(size);
                             },
                             [](void* memory, std::size_t size, const char*, int) {
                               ++openssl_allocations;
                               return std::realloc(memory, size);
                             },
                             [](void* memory, const char*, int) { std::free(memory); }) == 1;

TEST(DatagramSeal, AllocatesNothingForADatagram) {
  ASSERT_TRUE(kIsCounting);
  for (const secure::Aead aead : {secure::Aead::kAes256Gcm, secure::Aead::kChaCha20Poly1305}) {
    secure::Exported exported;
    exported.aead = aead;
    DatagramSeal seal(exported, DatagramSeal::Use::kSeal, true, 0), opener(exported, DatagramSeal::Use::kOpen, true, 0);
    Bytes datagram;
    datagram.reserve(kMaxDatagramBytes);
    const auto pass = [&](std::uint64_t sequence) {
      const DatagramHeader header{DatagramType::kClientUpdate, 0, ConnectionId{1}, sequence};
      datagram.clear();
      append_header(header, datagram);
      datagram.resize(kDatagramHeaderBytes + 200);
      seal.keep_fresh(LocalTime(std::chrono::seconds(1)));
      seal.seal(sequence, datagram);
      std::span<const std::byte> payload;
      return opener.open(header, datagram, payload);
    };
    ASSERT_EQ(pass(1), DropReason::kNone);
    const std::uint64_t before = openssl_allocations + test::allocation_count();
    for (std::uint64_t sequence = 2; sequence < 1000; ++sequence) ASSERT_EQ(pass(sequence), DropReason::kNone);
    EXPECT_EQ(openssl_allocations + test::allocation_count(), before);
  }
}

}  // namespace
}  // namespace tandem::proto
