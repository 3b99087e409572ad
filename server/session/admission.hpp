// Who may join, and as what: by a token that is used once, or by coming back with the key that the first join named.
//
//   JoinRoom.token ──▶ signature ▶ audience ▶ times ▶ not used ──▶ role, room, name and force of the request cut to the token's
//   JoinRoom.resume ─▶ credential known, not expired ▶ signature of this connection's export ──▶ those of the first join,
//                      in another room where the token was for any
//   JoinRoom.beside ─▶ likewise, of a user who is here, with one device ──▶ his room, and what his token allows
//
// A token is used up only when its user has got a seat. What has been used is remembered until it expires; when there is
// no room to remember one more, it is refused and nothing is forgotten. What is remembered can outlive the server (state(),
// AdmissionSettings::resumed); where it does not, tokens from before the start are refused.
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
#include "tandem/checkpoint.pb.h"
#include "tandem/control.pb.h"
#include "tandem/token.pb.h"

namespace tandem::server {

/// How long after its loss a connection may be resumed.
inline constexpr Duration kResumeWithin = std::chrono::minutes(15);

struct AdmissionSettings {
  secure::KeyId audience{};                ///< this server's key
  std::vector<secure::PublicKey> issuers;  ///< whose tokens let in
  std::function<std::uint64_t()> unix_ms;  ///< milliseconds since 1970, UTC
  std::size_t max_used_tokens = 4096;
  std::size_t max_credentials = 1024;
  wire::AdmissionState resumed{};  ///< of a server that was this one before; empty: it begins anew
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
  };

  explicit Admission(AdmissionSettings settings);

  /// Checks the request and cuts it to what is granted: afterwards its room, name, role and force are those allowed.
  ///
  /// In      exported  of this connection for kResumeExport; none: nobody can resume
  std::optional<Refusal> admit(wire::JoinRoom& join, const std::optional<secure::Exported>& exported, LocalTime now,
                               Ticket& ticket);
  /// The ticket's holder has a seat: its token is used, and it may come back as `granted` says, to `tool` if that is free.
  /// Out     the credential; none: it named no key, or too many are remembered
  std::optional<Id> note_joined(const Ticket& ticket, const wire::JoinRoom& granted, std::optional<std::uint8_t> tool,
                                LocalTime now);
  /// The connection is gone, and may be resumed within kResumeWithin.
  void note_lost(const Id& credential, LocalTime now);
  /// That of the device which this one is beside; of a first device, its own.
  Id first_of(const Id& credential) const;
  /// It lets in no more, nor does that of a second device beside it.
  /// Out     the second device's; none: there is no such
  std::optional<Id> revoke(const Id& credential);
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
  std::optional<Refusal> admit_by_token(wire::JoinRoom& join, Ticket& ticket);
  std::optional<Refusal> admit_again(wire::JoinRoom& join, const std::optional<secure::Exported>& exported,
                                     Ticket& ticket);
  std::optional<Refusal> admit_beside(wire::JoinRoom& join, const std::optional<secure::Exported>& exported,
                                      Ticket& ticket);
  /// Whose it is who has signed that; end(): nobody's.
  Credentials::iterator find_signed(const wire::Resume& by, const std::optional<secure::Exported>& exported);
  Credentials::iterator find_beside(const Id& first);
  std::optional<Refusal> check_times(const wire::TokenClaims& claims);
  /// Milliseconds since 1970, never before what they were.
  std::uint64_t unix_ms();
  void forget_expired(LocalTime now);

  AdmissionSettings settings_;
  std::uint64_t started_ms_;
  std::uint64_t newest_ms_ = 0;       ///< a clock that is set back makes no used token valid again
  std::map<Id, std::uint64_t> used_;  ///< tokens, until when they would have been valid
  Credentials credentials_;
  std::uint64_t changes_ = 1;
};

}  // namespace tandem::server
