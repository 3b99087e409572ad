// Invitations for tests of the start screen.
#pragma once

#include <string>

#include "proto/join_token.hpp"

namespace tandem::client::test {

/// Text of an invitation to `server` (ADDRESS:PORT), for a user with this name.
inline std::string some_invitation(const std::string& server, const std::string& user = "") {
  wire::TokenClaims claims;
  claims.set_audience(std::string(32, 'a'));
  claims.set_user_name(user);
  claims.set_role(wire::ROLE_MANIPULATOR);
  claims.set_issued_ms(1);
  claims.set_expires_ms(2);
  static const auto issuer = secure::KeyPair::make(secure::KeyPair::Kind::kEd25519);
  return proto::text_of(proto::Invitation{server, {}, proto::sign_token(claims, issuer)});
}

}  // namespace tandem::client::test
