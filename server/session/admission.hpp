// Admission of users, and their rights. A new user presents a token, which is valid for one join. A user who resumes a
// session signs with a private key; its public key was part of the first join.
//
//   JoinRoom.token ──▶ signature ▶ audience ▶ times ▶ not used ──▶ role, room, name and force limit of the token
//   JoinRoom.resume ─▶ credential valid ▶ signature over keying material of this TLS connection ──▶ rights of the first
//                      join, also in another room if the token is valid for every room
//   JoinRoom.beside ─▶ the same checks, for the second device of a connected user ──▶ rights of the token, in the room
//                      of the first device
//
// * A user gets a seat only after the use of the token is on disk (invitation_ledger.hpp).
// * A token whose user got no seat remains valid.
// * The list of used tokens survives every restart. Credentials survive only a restart with --resume (state(),
//   AdmissionSettings::resumed).
// * Times follow unix_time.hpp, so an error of the wall clock of less than 10 s duration has no effect.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/time.hpp"
#include "common/secure/key_pair.hpp"
#include "common/secure/tls.hpp"
#include "server/session/invitation_ledger.hpp"
#include "server/session/unix_time.hpp"
#include "tandem/checkpoint.pb.h"
#include "tandem/control.pb.h"
#include "tandem/token.pb.h"

namespace tandem::server {

struct AdmissionSettings {
  secure::KeyId audience{};                ///< id of this server's key
  std::vector<secure::PublicKey> issuers;  ///< keys whose tokens are accepted
  std::function<std::uint64_t()> unix_ms;  ///< wall clock: milliseconds since 1970, UTC
  InvitationLedger* ledger = nullptr;      ///< list of used tokens, must outlive the Admission; null: in memory
  std::size_t max_credentials = 1024;
  wire::AdmissionState resumed{};  ///< state of the previous run; if empty, all earlier credentials are invalid
};

/// Reason for refusing a join.
struct Refusal {
  wire::ErrorCode code = wire::ERROR_UNSPECIFIED;
  std::string text;
};

/// Checks joins, and stores the credentials with which admitted users may resume.
///
/// Thread  io
class Admission {
 public:
  using Id = std::array<std::byte, 16>;
  /// A join that has been admitted but has no seat yet.
  struct Ticket {
    bool is_resumed = false;
    Id id{};  ///< id of the token; when a session is resumed, id of the credential
    std::uint64_t expires_ms = 0;
    secure::PublicKey resume_key{};
    bool has_resume_key = false;
    std::optional<std::uint8_t> tool{};  ///< previous tool of a user who resumes in the same room
    wire::TokenClaims claims;            ///< rights and validity in the token of a new user, or of the first device
    std::optional<Id> beside{};          ///< credential of the first device, if this is a second device
    bool uses_token() const { return !is_resumed && !beside; }
  };

  explicit Admission(AdmissionSettings settings);

  /// Checks a join. If it is admitted, limits its room, name, role and force limit to the granted ones.
  ///
  /// In      exported  keying material that this TLS connection exports with the label kResumeExport; without it, a
  ///                   resume or a second device is refused
  /// Out     reason for a refusal; none if the join is admitted
  std::optional<Refusal> admit(wire::JoinRoom& join, const std::optional<secure::Exported>& exported, LocalTime now,
                               Ticket& ticket);
  // If the ticket uses_token(), assign a seat only after use_of() has returned kWritten.
  /// Begins to write the use of the token to disk.
  void use(const Ticket& ticket) { ledger_->use(ticket.id, ticket.expires_ms); }
  /// Returns the state of the use of the token. kNone after use() means that the write failed.
  InvitationLedger::Use use_of(const Ticket& ticket) const { return ledger_->use_of(ticket.id); }
  /// Returns the refusal for a user whose token could not be marked as used on disk.
  Refusal unwritten() const;
  /// Makes the token valid again, because its holder got no seat.
  void release(const Ticket& ticket) { ledger_->release(ticket.id); }

  /// Records that the holder of the ticket has a seat and may later resume with the rights of `granted`. On a resume
  /// the user gets `tool` again if it is free.
  /// Out     the credential; none if the ticket has no resume key, if max_credentials are stored, or if the resumed
  ///         credential has expired
  std::optional<Id> note_joined(const Ticket& ticket, const wire::JoinRoom& granted, std::optional<std::uint8_t> tool,
                                LocalTime now);
  /// Records the loss of a connection, whose session may be resumed within kResumeWithin.
  void note_lost(const Id& credential, LocalTime now);
  /// Returns the credential of the user's first device, which may be `credential` itself.
  Id first_of(const Id& credential) const;
  /// Revokes a credential, and the credential of the user's second device if there is one. The revocation survives
  /// restarts once it is on disk.
  /// Out     credential of the second device; none if there is no second device
  std::optional<Id> revoke(const Id& credential);
  /// Reads the wall clock and collects the results of disk writes. Cheap enough for every cycle of the io thread.
  void poll(LocalTime now);
  /// Returns the state to save for the next start.
  wire::AdmissionState state(LocalTime now) const;
  /// Returns the number of changes of state() so far. A caller saves the state again when this number differs from the
  /// number at the last save.
  std::uint64_t changes() const { return changes_; }

 private:
  struct Credential {
    secure::PublicKey key{};
    wire::JoinRoom granted;
    std::optional<LocalTime> lost{};
    std::uint64_t lost_before_ms = 0;  ///< time of a loss before this start [ms since 1970]; 0: no such loss
    std::optional<std::uint8_t> tool{};
    wire::TokenClaims claims;
    std::optional<Id> beside{};  ///< credential of the first device, if this is a second device
  };
  using Credentials = std::map<Id, Credential>;
  void resume(const wire::AdmissionState& state);
  void erase(Credentials::iterator credential);
  std::optional<Refusal> admit_by_token(wire::JoinRoom& join, LocalTime now, Ticket& ticket);
  std::optional<Refusal> admit_again(wire::JoinRoom& join, const std::optional<secure::Exported>& exported,
                                     Ticket& ticket);
  std::optional<Refusal> admit_beside(wire::JoinRoom& join, const std::optional<secure::Exported>& exported,
                                      Ticket& ticket);
  /// Finds the credential to which `by` refers. Returns end() if it does not exist, or if the signature in `by` does
  /// not match the public key of the credential.
  Credentials::iterator find_signed(const wire::Resume& by, const std::optional<secure::Exported>& exported);
  Credentials::iterator find_beside(const Id& first);
  std::optional<Refusal> check_times(const wire::TokenClaims& claims, LocalTime now) const;
  void forget_expired(LocalTime now);

  AdmissionSettings settings_;
  std::unique_ptr<InvitationLedger> own_ledger_;
  InvitationLedger* ledger_;
  UnixTime time_;
  std::optional<LocalTime> read_clock_{},
      note_time_{};  ///< time of the last reading of the wall clock; time at which the ledger is to note the time next
  Credentials credentials_;
  std::uint64_t changes_ = 1;
};

}  // namespace tandem::server
