// Join tokens: what lets somebody into a room, once; and the invitations in which people hand them on.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "common/secure/key_pair.hpp"
#include "proto/datagram.hpp"
#include "tandem/token.pb.h"

namespace tandem::proto {

inline constexpr std::size_t kTokenIdBytes = 16;
inline constexpr std::size_t kMaxTokenBytes = 512;
/// From issue to expiry; servers refuse longer ones.
inline constexpr std::uint64_t kMaxTokenLife_ms = 30ULL * 24 * 60 * 60 * 1000;

/// Signs the claims; a missing id is drawn.
/// Fails   std::invalid_argument: the key is not of Ed25519, or the claims are out of their ranges
Bytes sign_token(wire::TokenClaims claims, const secure::KeyPair& issuer);

/// The claims of a token that one of `issuers` has signed, each field within its range. Times, audience and use are the
/// caller's to check.
///
/// Fails   nothing: it cannot be read, or nobody of them has signed it
std::optional<wire::TokenClaims> read_token(std::span<const std::byte> token,
                                            std::span<const secure::PublicKey> issuers);
/// Likewise, whoever has signed it: for who carries it and only wants to know what it says.
std::optional<wire::TokenClaims> peek_token(std::span<const std::byte> token);

/// What one person sends another: where the server is, how to know it, and the token.
struct Invitation {
  std::string server;  ///< "ADDRESS:PORT"
  secure::KeyId key{};
  Bytes token;
};
/// "ADDRESS:PORT/KEY/TOKEN", without characters that a shell would take for its own.
std::string text_of(const Invitation& invitation);
/// Fails   nothing: it is no such text
std::optional<Invitation> invitation_of(std::string_view text);

}  // namespace tandem::proto
