// Credentials of a session: the token of an invitation for the first join, and a session key with which the client
// rejoins.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "client/session/session.hpp"
#include "common/secure/key_pair.hpp"

namespace tandem::client {

/// Stores the credentials of a session and adds them to join messages. Credentials are added only on an encrypted
/// connection, because an eavesdropper could use them.
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
  /// Returns true once fill() has added credentials to a join message of an encrypted connection.
  bool are_requested() const { return resume_key_.has_value(); }
  /// Returns true if the token is valid for a single room.
  bool are_for_one_room() const { return are_for_one_room_; }
  /// Returns true if the server has issued a resume credential, with which the user can leave and rejoin.
  bool can_return() const { return !credential_.empty(); }
  /// Returns credentials for a second device of the same user, valid while this session is joined. Returns null if this
  /// session is not joined or uses no credentials.
  std::shared_ptr<const Credentials> beside() const;
  /// Stores the resume credential issued by the server, which identifies the session when rejoining.
  void accept(const wire::Joined& joined);

 private:
  proto::Bytes token_;
  std::optional<secure::KeyPair> resume_key_;
  /// Resume credential of the last join. It identifies the session to the server and is useless without resume_key_
  std::string credential_;
  /// Session key of the first device; set only in the credentials of a second device
  std::optional<secure::KeyPair> first_key_;
  std::string first_credential_;
  bool are_for_one_room_ = false;
};

}  // namespace tandem::client
