// Admission of users, and their rights. A new user needs a token, which is valid once. A user who resumes a session
// needs the private key whose public key was sent in the first join.
//
//   JoinRoom.token ──▶ signature ▶ audience ▶ times ▶ not used ──▶ role, room, name and force limit of the token
//   JoinRoom.resume ─▶ credential valid ▶ signature over keying material of this TLS connection ──▶ rights of the first
//                      join, also in another room if the token is valid for every room
//   JoinRoom.beside ─▶ the same checks, for the second device of a connected user ──▶ rights of the token, in the room
//                      of the first device
//
// A user gets a seat only after the use of the token is on disk (invitation_ledger.hpp). If the user gets no seat, the
// token remains valid. The list of used tokens is preserved over every restart. Credentials are preserved only over a
// restart with --resume (state(), AdmissionSettings::resumed). Times are those of unix_time.hpp: a wall clock that is
// wrong for less than 10 s has no effect.
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
  InvitationLedger* ledger = nullptr;      ///< must outlive the Admission; null: a ledger in memory, for trials
  std::size_t max_credentials = 1024;
  wire::AdmissionState resumed{};  ///< state of the previous run; if empty, all earlier credentials are invalid
};

/// Reason for refusing a join.
struct Refusal {
  wire::ErrorCode code = wire::ERROR_UNSPECIFIED;
  std::string text;
};

/// Thread  io
class Admission {
 public:
  using Id = std::array<std::byte, 16>;
  /// Join that has been admitted but has no seat yet.
  struct Ticket {
    bool is_resumed = false;
    Id id{};  ///< id of the token, or of the credential for a resume
    std::uint64_t expires_ms = 0;
    secure::PublicKey resume_key{};
    bool has_resume_key = false;
    std::optional<std::uint8_t> tool{};  ///< for a resume in the same room, the previous tool of the user
    wire::TokenClaims claims;            ///< claims of the new user's token, or of the first device's token
    std::optional<Id> beside{};          ///< for a second device, the credential of the first
    bool uses_token() const { return !is_resumed && !beside; }
  };

  explicit Admission(AdmissionSettings settings);

  /// Checks a join. If it is admitted, limits its room, name, role and force limit to the granted ones.
  ///
  /// In      exported  keying material that this TLS connection exports with the label kResumeExport; without it, a
  ///                   resume or a second device is refused
  /// Out     the reason for a refusal; none if the join is admitted
  std::optional<Refusal> admit(wire::JoinRoom& join, const std::optional<secure::Exported>& exported, LocalTime now,
                               Ticket& ticket);
  // If the ticket uses_token(), a seat may be assigned only when use_of() is kWritten.
  /// Begins to write the use of the token to disk.
  void use(const Ticket& ticket) { ledger_->use(ticket.id, ticket.expires_ms); }
  /// State of the use of the token. After use(), kNone means that the write failed.
  InvitationLedger::Use use_of(const Ticket& ticket) const { return ledger_->use_of(ticket.id); }
  /// Refusal to be sent if the use of a token could not be written.
  Refusal unwritten() const;
  /// Makes the token valid again, because its holder got no seat.
  void release(const Ticket& ticket) { ledger_->release(ticket.id); }

  /// Records that the holder of the ticket has a seat and may later resume with the rights of `granted`. The holder
  /// then gets `tool` again if it is free.
  /// Out     the credential; none if the ticket has no resume key, if max_credentials are stored, or if the resumed
  ///         credential has expired
  std::optional<Id> note_joined(const Ticket& ticket, const wire::JoinRoom& granted, std::optional<std::uint8_t> tool,
                                LocalTime now);
  /// Records the loss of a connection, whose session may be resumed within kResumeWithin.
  void note_lost(const Id& credential, LocalTime now);
  /// Credential of the user's first device, which may be `credential` itself.
  Id first_of(const Id& credential) const;
  /// Revokes a credential, and that of the user's second device if there is one. The revocation is preserved over
  /// restarts once it is on disk.
  /// Out     credential of the second device; none if there is no second device
  std::optional<Id> revoke(const Id& credential);
  /// Reads the wall clock and collects the results of disk writes. It may be called often, because it is cheap.
  void poll(LocalTime now);
  /// State to be saved for the next start.
  wire::AdmissionState state(LocalTime now) const;
  /// Number of changes of state() so far, for comparison with an earlier value.
  std::uint64_t changes() const { return changes_; }

 private:
  struct Credential {
    secure::PublicKey key{};
    wire::JoinRoom granted;
    std::optional<LocalTime> lost{};
    std::uint64_t lost_before_ms = 0;  ///< time of a loss before this start [ms since 1970]; 0: no such loss
    std::optional<std::uint8_t> tool{};
    wire::TokenClaims claims;
    std::optional<Id> beside{};  ///< for a second device, the credential of the first
  };
  using Credentials = std::map<Id, Credential>;
  void resume(const wire::AdmissionState& state);
  void erase(Credentials::iterator credential);
  std::optional<Refusal> admit_by_token(wire::JoinRoom& join, LocalTime now, Ticket& ticket);
  std::optional<Refusal> admit_again(wire::JoinRoom& join, const std::optional<secure::Exported>& exported,
                                     Ticket& ticket);
  std::optional<Refusal> admit_beside(wire::JoinRoom& join, const std::optional<secure::Exported>& exported,
                                      Ticket& ticket);
  /// Finds the credential that `by` names. Returns end() if it does not exist or if its key did not make the signature.
  Credentials::iterator find_signed(const wire::Resume& by, const std::optional<secure::Exported>& exported);
  Credentials::iterator find_beside(const Id& first);
  std::optional<Refusal> check_times(const wire::TokenClaims& claims, LocalTime now) const;
  void forget_expired(LocalTime now);

  AdmissionSettings settings_;
  std::unique_ptr<InvitationLedger> own_ledger_;
  InvitationLedger* ledger_;
  UnixTime time_;
  std::optional<LocalTime> read_clock_{}, note_time_{};  ///< last reading of the wall clock; time of the next note
  Credentials credentials_;
  std::uint64_t changes_ = 1;
};

}  // namespace tandem::server
