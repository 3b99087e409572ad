// Admission of users and their rights: by a token that is used once, or by a resume with the key named at the first
// join.
//
//   JoinRoom.token ──▶ signature ▶ audience ▶ times ▶ not used ──▶ role, room, name and force limited to the token's
//   JoinRoom.resume ─▶ credential known, not expired ▶ signature over this connection's export ──▶ rights of the first
//                      join, also in another room if the token allows any
//   JoinRoom.beside ─▶ the same checks, for a connected user with one device ──▶ their room, and the token's rights
//
// A token counts as used only when its user has a seat, and a seat is given only when the use is on disk
// (invitation_ledger.hpp). The list of used tokens outlives every restart. Credentials outlive a restart with --resume
// (state(), AdmissionSettings::resumed). unix_time.hpp defines the times: a wall clock that is wrong for less than 10 s
// has no effect.
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

/// Time after its loss within which a connection may be resumed.
inline constexpr Duration kResumeWithin = std::chrono::minutes(15);

struct AdmissionSettings {
  secure::KeyId audience{};                ///< this server's key
  std::vector<secure::PublicKey> issuers;  ///< keys whose tokens are accepted
  std::function<std::uint64_t()> unix_ms;  ///< wall clock: milliseconds since 1970, UTC
  InvitationLedger* ledger = nullptr;      ///< outlives the Admission; null: one in memory, for trials
  std::size_t max_credentials = 1024;
  wire::AdmissionState resumed{};  ///< state of the previous run; empty: all earlier credentials end
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
  /// Admitted join that has no seat yet.
  struct Ticket {
    bool is_resumed = false;
    Id id{};  ///< token, or credential if resumed
    std::uint64_t expires_ms = 0;
    secure::PublicKey resume_key{};
    bool has_resume_key = false;
    std::optional<std::uint8_t> tool{};  ///< for a resume: the tool that the user had
    wire::TokenClaims claims;            ///< from a new user's token, or from the first device
    std::optional<Id> beside{};
    bool uses_token() const { return !is_resumed && !beside; }
  };

  explicit Admission(AdmissionSettings settings);

  /// Checks the request and limits its room, name, role and force to the granted ones.
  ///
  /// In      exported  keying material of this connection for kResumeExport; none: resume is not possible
  std::optional<Refusal> admit(wire::JoinRoom& join, const std::optional<secure::Exported>& exported, LocalTime now,
                               Ticket& ticket);
  // For a ticket that uses_token(): a seat is given only when the use is kWritten.
  /// Begins to write the token's use to disk.
  void use(const Ticket& ticket) { ledger_->use(ticket.id, ticket.expires_ms); }
  /// State of the use; kNone after use(): it could not be written.
  InvitationLedger::Use use_of(const Ticket& ticket) const { return ledger_->use_of(ticket.id); }
  Refusal unwritten() const;
  /// Releases a token whose holder got no seat; it is valid as before.
  void release(const Ticket& ticket) { ledger_->release(ticket.id); }

  /// Records that the ticket's holder has a seat, and may resume with the rights of `granted`, at `tool` if that is
  /// free.
  /// Out     the credential; none: the ticket has no resume key, or too many credentials are stored
  std::optional<Id> note_joined(const Ticket& ticket, const wire::JoinRoom& granted, std::optional<std::uint8_t> tool,
                                LocalTime now);
  /// Records a lost connection; it may be resumed within kResumeWithin.
  void note_lost(const Id& credential, LocalTime now);
  /// Credential of the user's first device; for a first device, its own.
  Id first_of(const Id& credential) const;
  /// Revokes the credential and that of a second device beside it; once written to disk, also across a restart.
  /// Out     the second device's credential; none: there is no second device
  std::optional<Id> revoke(const Id& credential);
  /// Reads the wall clock and collects finished disk writes. Cheap enough to call often.
  void poll(LocalTime now);
  /// State to save across restarts, and a count of its changes.
  wire::AdmissionState state(LocalTime now) const;
  std::uint64_t changes() const { return changes_; }

 private:
  struct Credential {
    secure::PublicKey key{};
    wire::JoinRoom granted;
    std::optional<LocalTime> lost{};
    std::uint64_t lost_before_ms = 0;  ///< since 1970, in the previous run; 0: not lost then
    std::optional<std::uint8_t> tool{};
    wire::TokenClaims claims;
    std::optional<Id> beside{};  ///< for a second device: the first one's credential
  };
  using Credentials = std::map<Id, Credential>;
  void resume(const wire::AdmissionState& state);
  void erase(Credentials::iterator credential);
  std::optional<Refusal> admit_by_token(wire::JoinRoom& join, LocalTime now, Ticket& ticket);
  std::optional<Refusal> admit_again(wire::JoinRoom& join, const std::optional<secure::Exported>& exported,
                                     Ticket& ticket);
  std::optional<Refusal> admit_beside(wire::JoinRoom& join, const std::optional<secure::Exported>& exported,
                                      Ticket& ticket);
  /// Finds the credential whose key made the signature; end(): none.
  Credentials::iterator find_signed(const wire::Resume& by, const std::optional<secure::Exported>& exported);
  Credentials::iterator find_beside(const Id& first);
  std::optional<Refusal> check_times(const wire::TokenClaims& claims, LocalTime now) const;
  void forget_expired(LocalTime now);

  AdmissionSettings settings_;
  std::unique_ptr<InvitationLedger> own_ledger_;
  InvitationLedger* ledger_;
  UnixTime time_;
  std::optional<LocalTime> read_clock_{}, note_time_{};  ///< last reading; next note
  Credentials credentials_;
  std::uint64_t changes_ = 1;
};

}  // namespace tandem::server
