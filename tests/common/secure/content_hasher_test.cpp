#include "common/secure/content_hasher.hpp"

#include <gtest/gtest.h>
#include <openssl/evp.h>

#include <algorithm>
#include <random>
#include <vector>

#include "tests/support/test_seed.hpp"

namespace tandem::secure {
namespace {

TEST(ContentHasher, OfPiecesIsTheHashOfTheWholeHoweverItIsCut) {
  std::mt19937_64 random(test::test_seed(180));
  for (int round = 0; round < 200; ++round) {
    std::vector<std::byte> whole(random() % 20'000);
    for (std::byte& byte : whole) byte = static_cast<std::byte>(random());
    ContentHasher hasher;
    for (std::size_t done = 0; done < whole.size();) {
      const std::size_t size = std::min<std::size_t>(1 + random() % 5000, whole.size() - done);
      hasher.add(std::span(whole).subspan(done, size));
      done += size;
    }
    std::array<std::byte, 32> expected{};
    unsigned int length = 0;
    ASSERT_EQ(EVP_Digest(whole.data(), whole.size(), reinterpret_cast<unsigned char*>(expected.data()), &length,
                         EVP_sha256(), nullptr),
              1);
    EXPECT_EQ(hasher.finish(), expected);
  }
}

}  // namespace
}  // namespace tandem::secure
