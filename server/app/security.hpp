// Identity of a server and its rules for admitting users: stored keys, certificates and invitations.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "common/base/time.hpp"
#include "common/secure/tls.hpp"
#include "proto/join_token.hpp"
#include "server/session/admission.hpp"

namespace tandem::server {

/// Returns $TANDEM_STATE, otherwise $XDG_STATE_HOME/tandem, otherwise $HOME/.local/state/tandem. Returns an empty path
/// if none of the variables is set.
std::filesystem::path default_state_folder();

struct SecurityOptions {
  std::filesystem::path state = default_state_folder();  ///< folder of the keys that the server generates
  std::filesystem::path certificate;                     ///< certificate file; empty: self-signed by the server's key
  std::filesystem::path key;
  std::vector<std::string> issuers;  ///< public keys of other token issuers
};

/// Keys of one server.
struct ServerKeys {
  secure::KeyPair identity;
  secure::KeyPair issuer;  ///< key pair that signs invitations
  std::string certificate_pem;
};
/// Reads the keys of a server. Missing keys are generated and stored. Together with a new server key, an empty list of
/// used invitations is stored.
/// Fails   std::invalid_argument: a file cannot be read or written, or a key is invalid
ServerKeys open_keys(const SecurityOptions& options);

/// Path of the file that lists the used invitations (InvitationLedger).
std::filesystem::path ledger_file(const std::filesystem::path& state);
/// Locks the state folder of a server until the returned object is destroyed. Two servers with the same folder could
/// otherwise each accept the same single-use token.
/// Fails   std::invalid_argument: another server holds the lock, or the lock file cannot be written
std::shared_ptr<void> lock_state(const std::filesystem::path& state);

std::shared_ptr<const secure::TlsContext> tls_of(const ServerKeys& keys);
/// Returns the settings with which a server admits users: the id of its key, and the keys whose tokens it accepts.
/// Fails   std::invalid_argument: one of the issuers is not a valid key
AdmissionSettings admission_of(const ServerKeys& keys, const SecurityOptions& options);

/// Returns the time in milliseconds since 1970, UTC.
std::uint64_t unix_ms_now();

/// Rights that a join token grants, and its validity.
struct Invited {
  std::string role = "manipulator";
  std::string room{};  ///< room that the token admits to; empty: any room
  std::string name{};  ///< name of the user; empty: chosen by the user
  double max_force_n = 0;
  Duration life{std::chrono::minutes(15)};
};
/// Parses the value of --valid, a time with its unit such as "15min". The limit is 30 days.
/// Fails   std::invalid_argument: not a time, or too long; the message names value, limit and remedy
Duration valid_for(const std::string& text);
/// Returns a join token that grants the rights in `invited`, is valid for the server with the key id `audience`, and is
/// signed by `issuer`.
/// Fails   std::invalid_argument: a value is out of the range in proto/join_token.hpp
proto::Bytes token_for(const Invited& invited, const secure::KeyId& audience, const secure::KeyPair& issuer);

/// Returns a line of the form "invitation (one manipulator, until 2026-11-22 05:15 UTC): tandem-client --join …".
std::string invitation_line(const Invited& invited, const std::string& server, const ServerKeys& keys);

/// Returns whether the address is a loopback address, on which clients on other machines cannot reach the server.
bool is_loopback(const std::string& address);
/// Returns the public address of this machine: the first IPv4 address of a network interface that is up. If there is
/// none and `may_be_v6`, returns the first IPv6 address that is not link-local; otherwise 127.0.0.1.
std::string own_address(bool may_be_v6);
std::string own_host_name();

}  // namespace tandem::server
