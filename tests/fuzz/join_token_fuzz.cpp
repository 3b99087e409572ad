// Reads arbitrary bytes as a join token and as the text of an invitation. Claims that can be read must form a valid
// token after signing. An accepted invitation must give the same text when it is written.
#include <cstdint>
#include <span>
#include <string_view>

#include "proto/join_token.hpp"
#include "tests/fuzz/check.hpp"

using tandem::fuzz::check;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tandem;
  static const secure::KeyPair kIssuer = secure::KeyPair::make(secure::KeyPair::Kind::kEd25519);
  static const std::vector<secure::PublicKey> kIssuers{kIssuer.public_key()};
  const std::span<const std::byte> bytes = std::as_bytes(std::span(data, size));
  check(!proto::read_token(bytes, kIssuers));  // no arbitrary token may have a valid signature
  if (const auto claims = proto::peek_token(bytes)) {
    check(proto::read_token(proto::sign_token(*claims, kIssuer), kIssuers).has_value());
  }
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  if (const auto invitation = proto::invitation_of(text)) check(proto::text_of(*invitation) == text);
  return 0;
}
