// What lets a session in: the token of an invitation the first time, later the key that it made itself.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "client/session/session.hpp"
#include "common/secure/key_pair.hpp"

namespace tandem::client {

/// Shows nothing where the connection is not encrypted: who listens could use it.
///
/// Thread  io
class Credentials {
 public:
  /// In      token  of an invitation; empty: none
  explicit Credentials(proto::Bytes token);
  ~Credentials() { secure::wipe(token_); }
  Credentials(const Credentials&) = default;
  Credentials& operator=(const Credentials&) = default;

  void fill(wire::JoinRoom& join, ClientTransport& transport, ConnectionId connection);
  /// The server lets nobody in without.
  bool are_asked_for() const { return resume_key_.has_value(); }
  /// Their holder may be in one room only.
  bool are_for_one_room() const { return are_for_one_room_; }
  /// They let the user come back after leaving to return.
  bool can_return() const { return !credential_.empty(); }
  /// For a second device of the user, while this one is joined; none: not joined, or none are asked for.
  std::shared_ptr<const Credentials> beside() const;
  /// From now on the session may be resumed, where the server says so.
  void take(const wire::Joined& joined);

 private:
  proto::Bytes token_;
  std::optional<secure::KeyPair> resume_key_;
  std::string credential_;  ///< of the last join; names the session, and is worth nothing without the key
  std::optional<secure::KeyPair> first_key_;  ///< of a second device: what the first one has
  std::string first_credential_;
  bool are_for_one_room_ = false;
};

}  // namespace tandem::client
