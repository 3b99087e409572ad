// What lets a session in: the token of an invitation the first time, later the key that it made itself.
#pragma once

#include <optional>

#include "client/session/session.hpp"
#include "common/secure/key_pair.hpp"

namespace tandem::client {

/// Shows nothing where the connection is not encrypted: who listens could use it.
///
/// Thread  io
class Credentials {
 public:
  /// In      token  of an invitation; empty: none
  explicit Credentials(proto::Bytes token) : token_(std::move(token)) {}
  ~Credentials() { secure::wipe(token_); }
  Credentials(const Credentials&) = delete;
  Credentials& operator=(const Credentials&) = delete;

  void fill(wire::JoinRoom& join, ClientTransport& transport, ConnectionId connection);
  /// The server lets nobody in without.
  bool are_asked_for() const { return resume_key_.has_value(); }
  /// From now on the session may be resumed, where the server says so.
  void take(const wire::Joined& joined);

 private:
  proto::Bytes token_;
  std::optional<secure::KeyPair> resume_key_;
  std::string credential_;  ///< of the last join; names the session, and is worth nothing without the key
};

}  // namespace tandem::client
