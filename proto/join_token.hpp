// Join tokens and invitations. A token admits one user to a room once; an invitation contains a token.
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
/// Maximum time between the issue and the expiry of a token. Servers refuse a token that is valid for longer.
inline constexpr std::uint64_t kMaxTokenLife_ms = 30ULL * 24 * 60 * 60 * 1000;

/// Signs the claims (the rights of a token, TokenClaims in token.proto) and returns the token. Claims without an id get
/// a random one.
/// Fails   std::invalid_argument: the key is not an Ed25519 key, or a claim is out of its range
Bytes sign_token(wire::TokenClaims claims, const secure::KeyPair& issuer);

/// Returns the claims of a token, after verifying that one of `issuers` has signed it and that each field is in its
/// range. Not verified here, but by the caller: the times, the audience, and repeated use.
///
/// Fails   returns nothing: the token is unreadable, signed by no issuer, or has a field out of its range
std::optional<wire::TokenClaims> read_token(std::span<const std::byte> token,
                                            std::span<const secure::PublicKey> issuers);
/// Returns the claims of a token without verifying its signature, for programs that only display the claims.
std::optional<wire::TokenClaims> peek_token(std::span<const std::byte> token);

/// Invitation to a room: the server's address and key, and a join token.
struct Invitation {
  std::string server;  ///< address of the server, "ADDRESS:PORT"
  secure::KeyId key{};
  Bytes token;
};
/// Returns the text "ADDRESS:PORT/KEY/TOKEN", which contains no characters with a special meaning in a shell.
std::string text_of(const Invitation& invitation);
/// Parses the text of an invitation.
/// Fails   returns nothing if the text is not an invitation
std::optional<Invitation> invitation_of(std::string_view text);

}  // namespace tandem::proto
