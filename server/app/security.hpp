// What makes a server known, and whom it lets in: keys kept in a folder, certificates, invitations.
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

/// $TANDEM_STATE, else $XDG_STATE_HOME/tandem, else $HOME/.local/state/tandem; empty when none is set.
std::filesystem::path default_state_folder();

struct SecurityOptions {
  std::filesystem::path state = default_state_folder();  ///< keys that the server makes itself
  std::filesystem::path certificate;                     ///< empty: one that says nothing but the key
  std::filesystem::path key;
  std::vector<std::string> issuers;  ///< public keys of others who issue tokens
};

/// The keys of one server.
struct ServerKeys {
  secure::KeyPair identity;
  secure::KeyPair issuer;  ///< signs invitations
  std::string certificate_pem;
};
/// Makes keys that do not exist yet, and for a new key of the server its list of used invitations.
/// Fails   std::invalid_argument: a file that cannot be read or written, or a key that is none
ServerKeys open_keys(const SecurityOptions& options);

/// File of the used invitations (InvitationLedger).
std::filesystem::path ledger_file(const std::filesystem::path& state);
/// The folder is one server's until the returned object is destroyed: two would each take the same token once.
/// Fails   std::invalid_argument: another server has it, or it cannot be written
std::shared_ptr<void> lock_state(const std::filesystem::path& state);

std::shared_ptr<const secure::TlsContext> tls_of(const ServerKeys& keys);
/// Fails   std::invalid_argument: one of the issuers is no key
AdmissionSettings admission_of(const ServerKeys& keys, const SecurityOptions& options);

/// Milliseconds since 1970, UTC.
std::uint64_t unix_ms_now();

/// What a token is to let in.
struct Invited {
  std::string role = "manipulator";
  std::string room{};  ///< empty: any
  std::string name{};  ///< empty: as the user says
  double max_force_n = 0;
  Duration life{std::chrono::minutes(15)};
};
/// As --valid gives it: a time with its unit, up to 30 days.
/// Fails   std::invalid_argument: it is none, or longer; the message names value, limit and remedy
Duration valid_for(const std::string& text);
/// Fails   std::invalid_argument: out of the ranges of proto/join_token.hpp
proto::Bytes token_for(const Invited& invited, const secure::KeyId& audience, const secure::KeyPair& issuer);

/// "invitation (one manipulator, until 2026-11-22 05:15 UTC): tandem-client --join …"
std::string invitation_line(const Invited& invited, const std::string& server, const ServerKeys& keys);

/// Whether only this machine reaches a server that listens there.
bool is_loopback(const std::string& address);
/// An address of this machine by which others reach it: the first IPv4 address of a network that is up; on a machine without
/// one, where `may_be_v6`, the first IPv6 address that is not link-local; else 127.0.0.1.
std::string own_address(bool may_be_v6);
std::string own_host_name();

}  // namespace tandem::server
