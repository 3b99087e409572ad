// Credentials of a session: the token of an invitation for the first join, then the session's own key.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "client/session/session.hpp"
#include "common/secure/key_pair.hpp"

namespace tandem::client {

/// Sends nothing over an unencrypted connection, where an eavesdropper could use it.
///
/// Thread  io
class Credentials {
 public:
  /// In      token  from an invitation; empty: none
  explicit Credentials(proto::Bytes token);
  ~Credentials() { secure::wipe(token_); }
  Credentials(const Credentials&) = default;
  Credentials& operator=(const Credentials&) = default;

  void fill(wire::JoinRoom& join, ClientTransport& transport, ConnectionId connection);
  /// True if the server requires credentials.
  bool are_requested() const { return resume_key_.has_value(); }
  /// True if the holder may join one room only.
  bool are_for_one_room() const { return are_for_one_room_; }
  /// True if the user can rejoin after leaving with the intent to return.
  bool can_return() const { return !credential_.empty(); }
  /// Credentials for a second device of the user while this one is joined; null: not joined, or none required.
  std::shared_ptr<const Credentials> beside() const;
  /// Stores the server's resume credential, with which the session can be resumed.
  void accept(const wire::Joined& joined);

 private:
  proto::Bytes token_;
  std::optional<secure::KeyPair> resume_key_;
  std::string credential_;                    ///< from the last join; names the session, useless without the key
  std::optional<secure::KeyPair> first_key_;  ///< second device only: key of the first device
  std::string first_credential_;
  bool are_for_one_room_ = false;
};

}  // namespace tandem::client
