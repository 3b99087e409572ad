#include "proto/content_hash.hpp"

#include <gtest/gtest.h>

#include <iomanip>
#include <sstream>
#include <string_view>

namespace tandem::proto {
namespace {

std::string hex_of_hash(std::string_view text) {
  std::ostringstream hex;
  hex << std::hex << std::setfill('0');
  for (const std::byte byte : sha256_of(std::as_bytes(std::span(text))))
    hex << std::setw(2) << std::to_integer<int>(byte);
  return hex.str();
}

TEST(ContentHash, IsTheStandardSha256) {
  // Test vectors for one block and for the empty message. Source: FIPS 180-4, NIST examples
  EXPECT_EQ(hex_of_hash("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(hex_of_hash(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
}

}  // namespace
}  // namespace tandem::proto
