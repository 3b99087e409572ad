#include "common/net/address_race.hpp"

#include <algorithm>

namespace tandem::net {

AddressRace::AddressRace(std::span<const Address> known, int lookups, RaceSettings settings)
    : settings_(settings),
      has_known_(!known.empty()),
      lookups_(lookups),
      awaits_v6_(lookups > 0),
      is_v6_next_(known.empty() || known.front().is_v6()) {
  for (const Address& address : known) append(address);
}

void AddressRace::append(const Address& address) {
  const auto is_of_family = [&address](const Candidate& other) { return other.address.is_v6() == address.is_v6(); };
  const auto of_family = static_cast<std::size_t>(std::ranges::count_if(candidates_, is_of_family));
  if (find(address) == nullptr && of_family < kMaxPerFamily) candidates_.push_back({address});
}

void AddressRace::add(std::span<const Address> addresses, bool is_v6, const std::string& problem, LocalTime now) {
  lookups_ = std::max(0, lookups_ - 1);
  if (is_v6) {
    awaits_v6_ = false;
  } else if (awaits_v6_) {
    v4_answered_ = now;
  }
  for (const Address& address : addresses) append(address);
  const bool is_reported = std::ranges::find(lookup_problems_, problem) != lookup_problems_.end();
  if (addresses.empty() && !problem.empty() && !is_reported) lookup_problems_.push_back(problem);
}

AddressRace::Candidate* AddressRace::find(const Address& address) {
  const auto found = std::ranges::find(candidates_, address, &Candidate::address);
  return found == candidates_.end() ? nullptr : &*found;
}

bool AddressRace::has(State state) const {
  return std::ranges::find(candidates_, state, &Candidate::state) != candidates_.end();
}

/// Returns the next address to try: the first waiting one of the preferred family (IPv4 or IPv6). If that family has
/// none, returns the first waiting one of the second family; null if no address is waiting.
AddressRace::Candidate* AddressRace::first_waiting() {
  Candidate* first = nullptr;
  for (Candidate& candidate : candidates_) {
    if (candidate.state != State::kWaiting) continue;
    if (candidate.address.is_v6() == is_v6_next_) return &candidate;
    if (first == nullptr) first = &candidate;
  }
  return first;
}

std::optional<LocalTime> AddressRace::next_start() const {
  if (has(State::kAccepted) || !has(State::kWaiting)) return std::nullopt;
  if (last_tried_) return last_start_ ? *last_start_ + settings_.attempt_delay : LocalTime{};
  const bool has_preferred = std::ranges::any_of(
      candidates_, [this](const Candidate& candidate) { return candidate.address.is_v6() == is_v6_next_; });
  if (has_preferred || !awaits_v6_ || !v4_answered_) return LocalTime{};
  return *v4_answered_ + settings_.resolution_delay;
}

std::optional<Address> AddressRace::next(LocalTime now) {
  const auto start = next_start();
  if (!start || now < *start) return std::nullopt;
  Candidate& candidate = *first_waiting();
  candidate.state = State::kTrying;
  candidate.started = now;
  last_tried_ = candidate.address;
  last_start_ = now;
  is_v6_next_ = candidate.address.is_v4();
  return candidate.address;
}

/// Returns the time when the attempt times out. Empty if all other addresses have failed: the attempt then has no time
/// limit in this class, and the caller decides how long it may last.
std::optional<LocalTime> AddressRace::expiry(const Candidate& candidate) const {
  const bool is_going_on = candidate.state == State::kTrying || candidate.state == State::kAccepted;
  const auto is_left = [&candidate](const Candidate& other) {
    return &other != &candidate && other.state != State::kFailed;
  };
  if (!is_going_on || std::ranges::none_of(candidates_, is_left)) return std::nullopt;
  return candidate.started + settings_.attempt_timeout;
}

std::optional<Address> AddressRace::expired(LocalTime now) const {
  for (const Candidate& candidate : candidates_) {
    const auto at = expiry(candidate);
    if (at && now >= *at) return candidate.address;
  }
  return std::nullopt;
}

std::optional<LocalTime> AddressRace::due() const {
  std::optional<LocalTime> earliest = next_start();
  for (const Candidate& candidate : candidates_) {
    const auto at = expiry(candidate);
    if (at && (!earliest || *at < *earliest)) earliest = at;
  }
  return earliest;
}

void AddressRace::failed(const Address& address, AttemptFailure failure, const std::string& why) {
  Candidate* const candidate = find(address);
  if (candidate == nullptr || candidate->state == State::kWaiting || candidate->state == State::kFailed) return;
  if (candidate->state == State::kAccepted || last_tried_ == address) last_start_.reset();
  candidate->state = State::kFailed;
  candidate->failure = failure;
  candidate->why = why;
}

void AddressRace::accepted(const Address& address) {
  Candidate* const winner = find(address);
  if (winner == nullptr || winner->state != State::kTrying) return;
  for (Candidate& candidate : candidates_) {
    if (candidate.state == State::kTrying) candidate.state = State::kWaiting;
  }
  winner->state = State::kAccepted;
}

bool AddressRace::is_lost() const {
  return (lookups_ == 0 || has_known_) && !has(State::kWaiting) && !has(State::kTrying) && !has(State::kAccepted);
}

std::string AddressRace::report() const {
  std::string text;
  const auto append_part = [&text](const std::string& part) { text += (text.empty() ? "" : "; ") + part; };
  for (const Candidate& candidate : candidates_) {
    const std::string name = candidate.address.to_string() + ": ";
    if (candidate.state == State::kFailed) append_part(name + candidate.why);
    if (candidate.state == State::kTrying || candidate.state == State::kAccepted) append_part(name + "no answer yet");
  }
  for (const std::string& problem : lookup_problems_) {
    if (candidates_.empty()) append_part(problem);
  }
  if (lookups_ > 0) append_part("the look-up of its name is not answered yet");
  return text;
}

std::optional<AttemptFailure> AddressRace::only_failure() const {
  if (candidates_.size() != 1 || candidates_.front().state != State::kFailed) return std::nullopt;
  return candidates_.front().failure;
}

}  // namespace tandem::net
