#include "proto/join_token.hpp"

#include <gtest/gtest.h>

#include <functional>

namespace tandem::proto {
namespace {

wire::TokenClaims claims() {
  wire::TokenClaims claims;
  claims.set_audience(std::string(32, 'a'));
  claims.set_role(wire::ROLE_MANIPULATOR);
  claims.set_room("attic");
  claims.set_issued_ms(1000);
  claims.set_expires_ms(2000);
  return claims;
}

class JoinToken : public testing::Test {
 protected:
  const secure::KeyPair issuer = secure::KeyPair::make(secure::KeyPair::Kind::kEd25519);
  const std::vector<secure::PublicKey> issuers{issuer.public_key()};
};

TEST_F(JoinToken, ContainsTheSignedClaimsOfItsIssuer) {
  const Bytes token = sign_token(claims(), issuer);
  EXPECT_LE(token.size(), kMaxTokenBytes);
  const auto read = read_token(token, issuers);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->room(), "attic");
  EXPECT_EQ(read->id().size(), kTokenIdBytes);
  EXPECT_NE(read->id(), read_token(sign_token(claims(), issuer), issuers)->id());
}

TEST_F(JoinToken, IsRefusedWithAnyBitChangedCutOrSignedByAnother) {
  const Bytes token = sign_token(claims(), issuer);
  for (std::size_t bit = 0; bit < 8 * token.size(); ++bit) {
    Bytes bad = token;
    bad[bit / 8] ^= std::byte(1U << (bit % 8));
    EXPECT_FALSE(read_token(bad, issuers)) << "bit " << bit;
  }
  for (std::size_t size = 0; size < token.size(); ++size) {
    EXPECT_FALSE(read_token(std::span(token).first(size), issuers));
  }
  EXPECT_FALSE(read_token(token, {}));
  const secure::KeyPair other = secure::KeyPair::make(secure::KeyPair::Kind::kEd25519);
  EXPECT_FALSE(read_token(token, std::vector{other.public_key()}));
}

TEST_F(JoinToken, IsNotSignedOutsideItsRanges) {
  const std::vector<std::function<void(wire::TokenClaims&)>> faults{
      [](auto& c) { c.set_audience("short"); },
      [](auto& c) { c.set_role(wire::ROLE_UNSPECIFIED); },
      [](auto& c) { c.set_expires_ms(c.issued_ms()); },
      [](auto& c) { c.set_expires_ms(c.issued_ms() + kMaxTokenLife_ms + 1); },
      [](auto& c) { c.set_max_force_n(-1); },
      [](auto& c) { c.set_max_force_n(std::numeric_limits<double>::quiet_NaN()); },
      [](auto& c) { c.set_id("short"); },
      [](auto& c) { c.set_user_name(std::string(65, 'n')); }};
  for (std::size_t i = 0; i < faults.size(); ++i) {
    wire::TokenClaims bad = claims();
    faults[i](bad);
    EXPECT_THROW(sign_token(bad, issuer), std::invalid_argument) << i;
  }
}

TEST_F(JoinToken, AnInvitationIsTextThatReadsBack) {
  Invitation invitation{"[2001:db8::1]:47800", issuer.id(), sign_token(claims(), issuer)};
  const std::string text = text_of(invitation);
  EXPECT_EQ(text.find_first_of(" \t\n'\"$&|;<>(){}*?#!~`\\"), std::string::npos) << "a shell leaves it alone";
  const auto read = invitation_of(text);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->server, invitation.server);
  EXPECT_EQ(read->key, invitation.key);
  EXPECT_EQ(read->token, invitation.token);
  for (const std::string& bad :
       {std::string(), std::string("/"), std::string("//"), text.substr(1 + text.find('/')),
        text.substr(0, text.size() - 1), text + "A", text + "/", "x" + std::string(3000, 'A')}) {
    EXPECT_FALSE(invitation_of(bad)) << bad;
  }
}

}  // namespace
}  // namespace tandem::proto
