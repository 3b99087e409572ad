// Credentials of a session: the token of an invitation for the first join, then a key of the session for rejoining.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "client/session/session.hpp"
#include "common/secure/key_pair.hpp"

namespace tandem::client {

/// Stores the credentials and adds them to join messages. Over an unencrypted connection no credentials are sent,
/// because an eavesdropper could use them.
///
/// Thread  io
class Credentials {
 public:
  /// In      token  token of an invitation; empty if there is none
  explicit Credentials(proto::Bytes token);
  ~Credentials() { secure::wipe(token_); }
  Credentials(const Credentials&) = default;
  Credentials& operator=(const Credentials&) = default;

  void fill(wire::JoinRoom& join, ClientTransport& transport, ConnectionId connection);
  /// True once fill() has used the credentials, on an encrypted connection.
  bool are_requested() const { return resume_key_.has_value(); }
  /// True if the token is valid for one room only.
  bool are_for_one_room() const { return are_for_one_room_; }
  /// True if the server has issued a resume credential, with which the user can leave and rejoin.
  bool can_return() const { return !credential_.empty(); }
  /// Credentials for a second device of the user, valid while this session is joined; null if it is not joined or uses
  /// no credentials.
  std::shared_ptr<const Credentials> beside() const;
  /// Stores the server's resume credential, with which the session can be resumed.
  void accept(const wire::Joined& joined);

 private:
  proto::Bytes token_;
  std::optional<secure::KeyPair> resume_key_;
  std::string credential_;  ///< resume credential of the last join; identifies the session, useless without the key
  std::optional<secure::KeyPair> first_key_;  ///< key of the first device; only set for a second device
  std::string first_credential_;
  bool are_for_one_room_ = false;
};

}  // namespace tandem::client
