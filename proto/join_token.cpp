#include "proto/join_token.hpp"

#include <google/protobuf/stubs/logging.h>

#include <algorithm>
#include <stdexcept>

#include "proto/coupling_fields.hpp"

namespace tandem::proto {
namespace {

/// Prefix of the signed bytes. A signature that the same key made for a different purpose is therefore never valid for
/// a token.
constexpr std::string_view kSignedAs{"tandem-join-token-v1\0", 21};
constexpr std::size_t kMaxNameBytes = 64;
constexpr std::size_t kMaxInvitationBytes = 2048;

std::span<const std::byte> bytes_in(const std::string& text) {
  return std::as_bytes(std::span(text));
}

Bytes signed_bytes(const std::string& claims) {
  const auto prefix = std::as_bytes(std::span(kSignedAs)), rest = bytes_in(claims);
  Bytes bytes(prefix.begin(), prefix.end());
  bytes.insert(bytes.end(), rest.begin(), rest.end());
  return bytes;
}

bool is_within_limits(const wire::TokenClaims& claims) {
  return claims.id().size() == kTokenIdBytes && claims.audience().size() == sizeof(secure::KeyId) &&
         claims.user_name().size() <= kMaxNameBytes && claims.room().size() <= kMaxNameBytes &&
         claims.role() >= wire::ROLE_MANIPULATOR && claims.role() <= wire::ROLE_SIGNAL &&
         (claims.max_force_n() == 0 || find_coupling_field("coupling.force_limit_n")->accepts(claims.max_force_n())) &&
         claims.expires_ms() > claims.issued_ms() && claims.expires_ms() - claims.issued_ms() <= kMaxTokenLife_ms;
}

bool parse(std::span<const std::byte> bytes, google::protobuf::MessageLite& out) {
  const google::protobuf::LogSilencer silencer;
  return bytes.size() <= kMaxTokenBytes && out.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
}

std::optional<wire::TokenClaims> claims_in(const wire::JoinToken& token) {
  wire::TokenClaims claims;
  if (!parse(bytes_in(token.claims()), claims) || !is_within_limits(claims)) return std::nullopt;
  return claims;
}

}  // namespace

Bytes sign_token(wire::TokenClaims claims, const secure::KeyPair& issuer) {
  if (claims.id().empty()) {
    claims.mutable_id()->resize(kTokenIdBytes);
    secure::fill_random(std::as_writable_bytes(std::span(*claims.mutable_id())));
  }
  if (!is_within_limits(claims)) {
    throw std::invalid_argument(
        "a token is valid for 1 ms to 30 days, names are at most 64 bytes, and a force is 0.001 to 1000 N, or 0");
  }
  wire::JoinToken token;
  token.set_claims(claims.SerializeAsString());
  const secure::Signature signature = issuer.sign(signed_bytes(token.claims()));
  token.set_signature(signature.data(), signature.size());
  Bytes bytes(token.ByteSizeLong());
  token.SerializeToArray(bytes.data(), static_cast<int>(bytes.size()));
  return bytes;
}

std::optional<wire::TokenClaims> read_token(std::span<const std::byte> bytes,
                                            std::span<const secure::PublicKey> issuers) {
  wire::JoinToken token;
  secure::Signature signature{};
  if (!parse(bytes, token) || token.signature().size() != signature.size()) return std::nullopt;
  std::ranges::copy(bytes_in(token.signature()), signature.begin());
  const Bytes message = signed_bytes(token.claims());
  const auto is_issuer = [&](const secure::PublicKey& key) { return secure::has_signed(key, message, signature); };
  if (std::ranges::none_of(issuers, is_issuer)) return std::nullopt;
  return claims_in(token);
}

std::optional<wire::TokenClaims> peek_token(std::span<const std::byte> bytes) {
  wire::JoinToken token;
  return parse(bytes, token) ? claims_in(token) : std::nullopt;
}

std::string text_of(const Invitation& invitation) {
  return invitation.server + "/" + secure::text_of(invitation.key) + "/" + secure::text_of(invitation.token);
}

std::optional<Invitation> invitation_of(std::string_view text) {
  if (text.size() > kMaxInvitationBytes) return std::nullopt;
  const std::size_t first = text.find('/'), second = text.find('/', std::min(first, text.size() - 1) + 1);
  if (first == std::string_view::npos || second == std::string_view::npos) return std::nullopt;
  const auto key = secure::bytes_of_text(text.substr(first + 1, second - first - 1));
  const auto token = secure::bytes_of_text(text.substr(second + 1));
  Invitation invitation;
  if (first == 0 || !key || key->size() != invitation.key.size() || !token || !peek_token(*token)) return std::nullopt;
  invitation.server = text.substr(0, first);
  std::ranges::copy(*key, invitation.key.begin());
  invitation.token = *token;
  return invitation;
}

}  // namespace tandem::proto
