#include "server/session/admission.hpp"

#include <algorithm>
#include <stdexcept>

#include "proto/coupling_fields.hpp"
#include "proto/join_token.hpp"

namespace tandem::server {
namespace {

/// Maximum time by which the clock of a token's issuer may be ahead of the server's time.
constexpr std::uint64_t kClockError_ms = 60'000;
constexpr Duration kReadClockEvery = std::chrono::milliseconds(100), kNoteTimeEvery = std::chrono::minutes(10);

std::span<const std::byte> bytes_in(const std::string& text) {
  return std::as_bytes(std::span(text));
}

/// Copies the first bytes of a text to an array.
/// In      text  must be at least as long as the array
template <class Array>
Array array_of(const std::string& text) {
  Array array{};
  std::ranges::copy(bytes_in(text).first(array.size()), array.begin());
  return array;
}

/// Rank of a role. A role includes the rights of every role of lower rank.
int rank_of(wire::Role role) {
  if (role == wire::ROLE_OPERATOR) return 2;
  return role == wire::ROLE_MANIPULATOR ? 1 : 0;
}

std::optional<Refusal> cut_to(const wire::TokenClaims& claims, wire::JoinRoom& join) {
  if (join.role() == wire::ROLE_UNSPECIFIED) join.set_role(claims.role());
  // The role of a source of signals is no higher or lower rank than other roles. Its token permits only this role, and
  // no other token permits it.
  const bool is_source = join.role() == wire::ROLE_SIGNAL;
  if (is_source != (claims.role() == wire::ROLE_SIGNAL)) {
    return Refusal{wire::ERROR_NOT_ALLOWED,
                   is_source ? "sending signals needs a token for it; issue one by tandem-token --role signal"
                             : "the token is for sending signals only; use it with tandem-signal or tandem-eeg"};
  }
  if (rank_of(join.role()) > rank_of(claims.role())) {
    return Refusal{wire::ERROR_NOT_ALLOWED, "the token does not let its holder join in that role; leave out --role"};
  }
  if (!claims.room().empty() && !join.room().empty() && join.room() != claims.room()) {
    return Refusal{wire::ERROR_NOT_ALLOWED, "the token is for another room; leave out --room"};
  }
  if (!claims.room().empty()) join.set_room(claims.room());
  if (!claims.user_name().empty()) join.set_user_name(claims.user_name());
  if (claims.max_force_n() == 0) return std::nullopt;
  wire::Coupling& bounds = *join.mutable_coupling_bounds();
  const double wanted = bounds.has_force_limit_n() ? bounds.force_limit_n() : claims.max_force_n();
  bounds.set_force_limit_n(std::min(wanted, claims.max_force_n()));
  return std::nullopt;
}

}  // namespace

Admission::Admission(AdmissionSettings settings)
    : settings_(std::move(settings)),
      own_ledger_(settings_.ledger == nullptr ? std::make_unique<InvitationLedger>() : nullptr),
      ledger_(settings_.ledger == nullptr ? own_ledger_.get() : settings_.ledger),
      time_(ledger_->time_ms()) {
  if (!settings_.unix_ms) throw std::invalid_argument("AdmissionSettings.unix_ms is empty; give it a clock");
  resume(settings_.resumed);
}

void Admission::resume(const wire::AdmissionState& state) {
  // A run without --resume starts a new generation of credentials, which makes all earlier credentials invalid.
  if (state.generation() != ledger_->generation()) return;
  for (const wire::ResumeCredential& in : state.credentials()) {
    if (in.id().size() != sizeof(Id) || in.key().size() != sizeof(secure::PublicKey)) continue;
    if (ledger_->is_revoked(array_of<Id>(in.id()))) continue;
    Credential& credential = credentials_[array_of<Id>(in.id())];
    credential.key = array_of<secure::PublicKey>(in.key());
    credential.granted = in.granted();
    // A user who was still connected when the previous run ended counts as lost at the start of this run.
    credential.lost_before_ms = in.lost_ms() != 0 ? in.lost_ms() : settings_.unix_ms();
    if (in.tool() > 0) credential.tool = static_cast<std::uint8_t>(in.tool() - 1);
    credential.claims = in.claims();
    if (in.beside().size() == sizeof(Id)) credential.beside = array_of<Id>(in.beside());
  }
}

wire::AdmissionState Admission::state(LocalTime now) const {
  const auto text = [](const auto& bytes) {
    return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  };
  wire::AdmissionState out;
  out.set_generation(ledger_->generation());
  for (const auto& [id, credential] : credentials_) {
    wire::ResumeCredential& to = *out.add_credentials();
    to.set_id(text(id));
    to.set_key(text(credential.key));
    *to.mutable_granted() = credential.granted;
    to.set_lost_ms(credential.lost_before_ms);
    if (credential.lost) {
      const auto ago_ms = static_cast<std::uint64_t>((now - *credential.lost) / std::chrono::milliseconds(1));
      to.set_lost_ms(time_.at(now) - ago_ms);
    }
    if (credential.tool) to.set_tool(1U + *credential.tool);
    *to.mutable_claims() = credential.claims;
    if (credential.beside) to.set_beside(text(*credential.beside));
  }
  return out;
}

Admission::Id Admission::first_of(const Id& credential) const {
  const auto found = credentials_.find(credential);
  return found == credentials_.end() ? credential : found->second.beside.value_or(credential);
}

void Admission::erase(Credentials::iterator credential) {
  ledger_->revoke(credential->first);
  credentials_.erase(credential);
  ++changes_;
}

std::optional<Admission::Id> Admission::revoke(const Id& credential) {
  if (const auto first = credentials_.find(credential); first != credentials_.end()) erase(first);
  const auto second = find_beside(credential);
  if (second == credentials_.end()) return std::nullopt;
  const Id id = second->first;
  erase(second);
  return id;
}

void Admission::poll(LocalTime now) {
  ledger_->poll();
  if (read_clock_ && now - *read_clock_ < kReadClockEvery) return;
  read_clock_ = now;
  const std::uint64_t now_ms = time_.update(settings_.unix_ms(), now);
  // The first write of the time is delayed, because the wall clock may be wrong for a moment after the machine has
  // started.
  if (!note_time_) note_time_ = now + kClockHold;
  // The write is postponed while a step of the wall clock may still turn out to be an error (UnixTime::follows_in()).
  if (time_.follows_in(now)) note_time_ = now + kReadClockEvery;
  if (now < *note_time_) return;
  note_time_ = now + kNoteTimeEvery;
  ledger_->note_time(now_ms);
}

std::optional<Refusal> Admission::admit(wire::JoinRoom& join, const std::optional<secure::Exported>& exported,
                                        LocalTime now, Ticket& ticket) {
  forget_expired(now);
  if (join.has_resume()) return admit_again(join, exported, ticket);
  if (join.resume_key().size() == ticket.resume_key.size()) {
    ticket.resume_key = array_of<secure::PublicKey>(join.resume_key());
    ticket.has_resume_key = true;
  }
  if (join.has_beside()) return admit_beside(join, exported, ticket);
  return admit_by_token(join, now, ticket);
}

std::optional<Refusal> Admission::admit_by_token(wire::JoinRoom& join, LocalTime now, Ticket& ticket) {
  const auto claims = proto::read_token(bytes_in(join.token()), settings_.issuers);
  if (!claims) {
    return Refusal{wire::ERROR_BAD_TOKEN, join.token().empty()
                                              ? "joining needs an invitation; ask for one"
                                              : "the token is not valid here; ask for a new invitation"};
  }
  if (!secure::is_equal(bytes_in(claims->audience()), settings_.audience)) {
    return Refusal{wire::ERROR_BAD_TOKEN, "the token is for another server; ask for a new invitation"};
  }
  if (auto refusal = check_times(*claims, now)) return refusal;
  ticket.id = array_of<Id>(claims->id());
  ticket.expires_ms = claims->expires_ms();
  if (ledger_->use_of(ticket.id) != InvitationLedger::Use::kNone) {
    return Refusal{wire::ERROR_TOKEN_USED, "the token was used before, and is valid once; ask for a new invitation"};
  }
  if (!ledger_->has_room(time_.at(now))) {
    return Refusal{wire::ERROR_SERVER_FULL,
                   "the server's list of used invitations is full: " + std::to_string(ledger_->max_used()) +
                       " have not expired yet; try later, and issue them for a shorter time"};
  }
  ticket.claims = *claims;
  return cut_to(*claims, join);
}

std::optional<Refusal> Admission::check_times(const wire::TokenClaims& claims, LocalTime now) const {
  const std::uint64_t now_ms = time_.at(now);
  const std::string here = "; the server's time is " + utc_text(now_ms);
  std::string problem;
  if (claims.expires_ms() <= now_ms) {
    problem = "the token has expired, at " + utc_text(claims.expires_ms()) + here + "; ask for a new invitation";
  } else if (claims.issued_ms() > now_ms + kClockError_ms) {
    problem = "the token is from the future, " + utc_text(claims.issued_ms()) + here + "; set the clocks";
  } else if (claims.issued_ms() < ledger_->issued_from_ms()) {
    problem = "the token is older than the server's list of used invitations, which begins at " +
              utc_text(ledger_->issued_from_ms()) + ", and may have been used; ask for a new invitation";
  } else if (claims.expires_ms() <= ledger_->forgotten_to_ms()) {
    problem = "the server does not list invitations any more that expire until " +
              utc_text(ledger_->forgotten_to_ms()) +
              ", and this one may have been used; ask for one that is valid for longer";
  }
  if (problem.empty()) return std::nullopt;
  if (const auto wait = time_.follows_in(now)) {
    problem += ". The server's clock was set; it is followed in " +
               std::to_string(1 + *wait / std::chrono::seconds(1)) + " s: try again then";
  }
  return Refusal{wire::ERROR_TOKEN_EXPIRED, problem};
}

Refusal Admission::unwritten() const {
  return {wire::ERROR_SERVER_FULL, "the server cannot write down that the invitation is used (" + ledger_->problem() +
                                       "); it is still valid: tell the operator, and try later"};
}

Admission::Credentials::iterator Admission::find_signed(const wire::Resume& by,
                                                        const std::optional<secure::Exported>& exported) {
  if (!exported || by.credential().size() != sizeof(Id) || by.signature().size() != sizeof(secure::Signature)) {
    return credentials_.end();
  }
  const auto found = credentials_.find(array_of<Id>(by.credential()));
  if (found == credentials_.end()) return found;
  const auto signature = array_of<secure::Signature>(by.signature());
  return secure::has_signed(found->second.key, exported->secret.bytes(), signature) ? found : credentials_.end();
}

Admission::Credentials::iterator Admission::find_beside(const Id& first) {
  return std::ranges::find_if(credentials_, [&first](const auto& entry) { return entry.second.beside == first; });
}

/// Admits a user who resumes a session. The refusal is the same for an unknown credential and for a wrong signature. An
/// attacker can therefore not find out which credentials exist.
std::optional<Refusal> Admission::admit_again(wire::JoinRoom& join, const std::optional<secure::Exported>& exported,
                                              Ticket& ticket) {
  const auto found = find_signed(join.resume(), exported);
  if (found == credentials_.end()) {
    return Refusal{wire::ERROR_BAD_CREDENTIAL, "the session cannot be resumed; ask for a new invitation"};
  }
  ticket.id = found->first;
  ticket.is_resumed = true;
  const Credential& credential = found->second;
  const bool goes_elsewhere = !join.room().empty() && join.room() != credential.granted.room();
  const bool is_for_any_room = !credential.claims.id().empty() && credential.claims.room().empty();
  if (goes_elsewhere && !is_for_any_room) return Refusal{wire::ERROR_NOT_ALLOWED, "the session was in another room"};
  if (!goes_elsewhere) ticket.tool = credential.tool;
  wire::JoinRoom granted = credential.granted;
  granted.set_deadband(join.deadband());
  if (goes_elsewhere) granted.set_room(join.room());
  join = granted;
  return std::nullopt;
}

std::optional<Refusal> Admission::admit_beside(wire::JoinRoom& join, const std::optional<secure::Exported>& exported,
                                               Ticket& ticket) {
  const auto found = find_signed(join.beside(), exported);
  if (found == credentials_.end() || found->second.lost) {
    return Refusal{wire::ERROR_BAD_CREDENTIAL, "the first device is not here; let it join again"};
  }
  const auto second = find_beside(found->first);
  const bool is_here = second != credentials_.end() && !second->second.lost;
  const bool is_room = second != credentials_.end() || credentials_.size() < settings_.max_credentials;
  if (found->second.beside || is_here || !ticket.has_resume_key || !is_room) {
    return Refusal{wire::ERROR_NOT_ALLOWED, "an invitation is for two devices of one person at most"};
  }
  ticket.beside = found->first;
  ticket.claims = found->second.claims;
  const wire::JoinRoom& first = found->second.granted;
  join.set_room(first.room());
  if (join.role() == wire::ROLE_SIGNAL || first.role() == wire::ROLE_SIGNAL) {
    return Refusal{wire::ERROR_NOT_ALLOWED, "a source of signals has no second device; give it a token of its own"};
  }
  // A second device never gets the role of operator, because a room has only one operator.
  const bool has_tool = join.role() != wire::ROLE_OBSERVER && first.role() != wire::ROLE_OBSERVER;
  join.set_role(has_tool ? wire::ROLE_MANIPULATOR : wire::ROLE_OBSERVER);
  return cut_to(ticket.claims, join);
}

std::optional<Admission::Id> Admission::note_joined(const Ticket& ticket, const wire::JoinRoom& granted,
                                                    std::optional<std::uint8_t> tool, LocalTime now) {
  forget_expired(now);
  ++changes_;
  if (ticket.is_resumed) {
    const auto found = credentials_.find(ticket.id);
    if (found == credentials_.end()) return std::nullopt;
    found->second.lost.reset();
    found->second.lost_before_ms = 0;
    found->second.tool = tool;
    found->second.granted.set_room(granted.room());
    return ticket.id;
  }
  if (ticket.beside) {
    // A new second device replaces an earlier second device whose connection was lost.
    const auto before = find_beside(*ticket.beside);
    if (before != credentials_.end()) erase(before);
  }
  if (!ticket.has_resume_key || credentials_.size() >= settings_.max_credentials) return std::nullopt;
  Id id{};
  secure::fill_random(id);
  Credential& credential = credentials_[id];
  credential.key = ticket.resume_key;
  credential.granted = granted;
  credential.granted.clear_token();
  credential.granted.clear_beside();
  credential.tool = tool;
  credential.claims = ticket.claims;
  credential.beside = ticket.beside;
  return id;
}

void Admission::note_lost(const Id& credential, LocalTime now) {
  const auto found = credentials_.find(credential);
  if (found == credentials_.end()) return;
  found->second.lost = now;
  ++changes_;
}

void Admission::forget_expired(LocalTime now) {
  const std::uint64_t now_ms = time_.update(settings_.unix_ms(), now);
  for (auto& [id, credential] : credentials_) {
    if (credential.lost_before_ms == 0 || credential.lost) continue;
    const std::uint64_t ago_ms = now_ms - std::min(now_ms, credential.lost_before_ms);
    const std::uint64_t known_ms = std::min<std::uint64_t>(ago_ms, 2 * (kResumeWithin / std::chrono::milliseconds(1)));
    credential.lost = now - std::chrono::milliseconds(known_ms);
  }
  changes_ += std::erase_if(credentials_, [now](const auto& entry) {
    return entry.second.lost && now - *entry.second.lost >= kResumeWithin;
  });
}

}  // namespace tandem::server
