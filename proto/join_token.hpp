// Join tokens, each of which admits a user to a room once, and the invitations in which people pass them on.
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
/// Longest time from issue to expiry that servers accept.
inline constexpr std::uint64_t kMaxTokenLife_ms = 30ULL * 24 * 60 * 60 * 1000;

/// Signs the claims; a missing id is generated.
/// Fails   std::invalid_argument: the key is not an Ed25519 key, or a claim is out of its range
Bytes sign_token(wire::TokenClaims claims, const secure::KeyPair& issuer);

/// Returns the claims of a token signed by one of `issuers`, each field within its range. The caller checks times,
/// audience and use.
///
/// Fails   nothing: the token is unreadable, or no issuer has signed it
std::optional<wire::TokenClaims> read_token(std::span<const std::byte> token,
                                            std::span<const secure::PublicKey> issuers);
/// Returns the claims without a check of the signature, for a bearer that only displays them.
std::optional<wire::TokenClaims> peek_token(std::span<const std::byte> token);

/// Invitation from one person to another: the server's address and key, and the token.
struct Invitation {
  std::string server;  ///< "ADDRESS:PORT"
  secure::KeyId key{};
  Bytes token;
};
/// Returns "ADDRESS:PORT/KEY/TOKEN", without characters that are special in a shell.
std::string text_of(const Invitation& invitation);
/// Fails   nothing: the text is no invitation
std::optional<Invitation> invitation_of(std::string_view text);

}  // namespace tandem::proto
