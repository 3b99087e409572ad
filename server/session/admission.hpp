// Who may join, and as what: by a token that is used once, or by coming back with the key that the first join named.
//
//   JoinRoom.token ──▶ signature ▶ audience ▶ times ▶ not used ──▶ role, room, name and force of the request cut to the token's
//   JoinRoom.resume ─▶ credential known, not expired ▶ signature of this connection's export ──▶ those of the first join,
//                      in another room where the token was for any
//   JoinRoom.beside ─▶ likewise, of a user who is here, with one device ──▶ his room, and what his token allows
//
// A token is used only when its user has a seat, and a seat is given only when the use is on the disk (invitation_ledger.hpp). The
// list of used tokens outlives every restart. Credentials outlive one with --resume (state(), AdmissionSettings::resumed). Times are
// those of unix_time.hpp: a wall clock that is wrong for less than 10 s changes nothing.
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

/// How long after its loss a connection may be resumed.
inline constexpr Duration kResumeWithin = std::chrono::minutes(15);

struct AdmissionSettings {
  secure::KeyId audience{};                ///< this server's key
  std::vector<secure::PublicKey> issuers;  ///< whose tokens let in
  std::function<std::uint64_t()> unix_ms;  ///< of the wall clock: milliseconds since 1970, UTC
  InvitationLedger* ledger = nullptr;      ///< outlives the Admission; null: one in memory, for trials
  std::size_t max_credentials = 1024;
  wire::AdmissionState resumed{};  ///< of the run before; empty: no credential outlives it
};

/// Why somebody is not let in.
struct Refusal {
  wire::ErrorCode code = wire::ERROR_UNSPECIFIED;
  std::string text;
};

/// Thread  io
class Admission {
 public:
  using Id = std::array<std::byte, 16>;
  /// What was let in, until it has got a seat or not.
  struct Ticket {
    bool is_resumed = false;
    Id id{};  ///< of the token, or of the credential
    std::uint64_t expires_ms = 0;
    secure::PublicKey resume_key{};
    bool has_resume_key = false;
    std::optional<std::uint8_t> tool{};  ///< of who comes back: the one he had
    wire::TokenClaims claims;            ///< of a newcomer's token, or of the user's beside whom it is
    std::optional<Id> beside{};
    bool uses_token() const { return !is_resumed && !beside; }
  };

  explicit Admission(AdmissionSettings settings);

  /// Checks the request and cuts it to what is granted: afterwards its room, name, role and force are those allowed.
  ///
  /// In      exported  of this connection for kResumeExport; none: nobody can resume
  std::optional<Refusal> admit(wire::JoinRoom& join, const std::optional<secure::Exported>& exported, LocalTime now,
                               Ticket& ticket);
  // Of a ticket that uses_token(): a seat is given only when the use is kWritten.
  /// Begins to write the use down.
  void use(const Ticket& ticket) { ledger_->use(ticket.id, ticket.expires_ms); }
  /// kNone after use(): it could not be written.
  InvitationLedger::Use use_of(const Ticket& ticket) const { return ledger_->use_of(ticket.id); }
  Refusal unwritten() const;
  /// The ticket's holder got no seat: its token is valid as before.
  void release(const Ticket& ticket) { ledger_->release(ticket.id); }

  /// The ticket's holder has a seat, and may come back as `granted` says, to `tool` if that is free.
  /// Out     the credential; none: it named no key, or too many are remembered
  std::optional<Id> note_joined(const Ticket& ticket, const wire::JoinRoom& granted, std::optional<std::uint8_t> tool,
                                LocalTime now);
  /// The connection is gone, and may be resumed within kResumeWithin.
  void note_lost(const Id& credential, LocalTime now);
  /// That of the device which this one is beside; of a first device, its own.
  Id first_of(const Id& credential) const;
  /// It lets in no more, nor does that of a second device beside it; also after a restart, once that is on the disk.
  /// Out     the second device's; none: there is no such
  std::optional<Id> revoke(const Id& credential);
  /// Reads the wall clock, and takes over what is on the disk. Often: it costs little.
  void poll(LocalTime now);
  /// All that must outlive the server, and how often that has changed.
  wire::AdmissionState state(LocalTime now) const;
  std::uint64_t changes() const { return changes_; }

 private:
  struct Credential {
    secure::PublicKey key{};
    wire::JoinRoom granted;
    std::optional<LocalTime> lost{};
    std::uint64_t lost_before_ms = 0;  ///< since 1970, by the server before; 0: not lost then
    std::optional<std::uint8_t> tool{};
    wire::TokenClaims claims;
    std::optional<Id> beside{};  ///< of a second device
  };
  using Credentials = std::map<Id, Credential>;
  void resume(const wire::AdmissionState& state);
  void erase(Credentials::iterator credential);
  std::optional<Refusal> admit_by_token(wire::JoinRoom& join, LocalTime now, Ticket& ticket);
  std::optional<Refusal> admit_again(wire::JoinRoom& join, const std::optional<secure::Exported>& exported,
                                     Ticket& ticket);
  std::optional<Refusal> admit_beside(wire::JoinRoom& join, const std::optional<secure::Exported>& exported,
                                      Ticket& ticket);
  /// Whose it is who has signed that; end(): nobody's.
  Credentials::iterator find_signed(const wire::Resume& by, const std::optional<secure::Exported>& exported);
  Credentials::iterator find_beside(const Id& first);
  std::optional<Refusal> check_times(const wire::TokenClaims& claims, LocalTime now) const;
  void forget_expired(LocalTime now);

  AdmissionSettings settings_;
  std::unique_ptr<InvitationLedger> own_ledger_;
  InvitationLedger* ledger_;
  UnixTime time_;
  std::optional<LocalTime> read_clock_{}, note_time_{};  ///< when last; when next
  Credentials credentials_;
  std::uint64_t changes_ = 1;
};

}  // namespace tandem::server
