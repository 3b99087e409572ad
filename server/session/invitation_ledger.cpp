#include "server/session/invitation_ledger.hpp"

#include <algorithm>
#include <iterator>
#include <system_error>
#include <utility>
#include <vector>

namespace tandem::server {
namespace {

/// Period of the writer thread. It delays a join by at most this time, in addition to the disk write.
constexpr Duration kWriterPeriod = std::chrono::milliseconds(5);

}  // namespace

InvitationLedger::InvitationLedger(std::filesystem::path file, std::function<void(const std::string&)> on_news,
                                   ReplaceFile replace, std::size_t max_used)
    : max_used_(max_used) {
  if (file.empty()) return;
  file_.emplace(std::move(file), std::move(on_news), std::move(replace));
  const wire::InvitationLedger& list = file_->list();
  for (const wire::UsedToken& token : list.used()) {
    if (const auto id = id_in(token.id())) used_[*id] = {token.expires_ms(), 0};
  }
  time_ms_ = list.time_ms();
  issued_from_ms_ = list.issued_from_ms();
  forgotten_to_ms_ = list.forgotten_to_ms();
  generation_ = list.generation();
}

InvitationLedger::~InvitationLedger() {
  finish();
}

void InvitationLedger::begin(bool keeps_credentials, std::uint64_t now_ms) {
  if (!file_) return;
  file_->begin(keeps_credentials, now_ms);
  issued_from_ms_ = file_->list().issued_from_ms();
  generation_ = file_->list().generation();
}

void InvitationLedger::start() {
  if (!file_) return;
  thread_ = std::make_unique<recording::RecorderThread>(kWriterPeriod, [this] { work(SteadyClock().now()); });
}

void InvitationLedger::finish() {
  if (thread_ == nullptr) return;
  poll();
  thread_->stop();
  thread_.reset();
  // Changes that did not fit into the ring are written now.
  for (poll(); posted_ > settled_; poll()) work(SteadyClock().now());
}

bool InvitationLedger::is_revoked(const Id& credential) const {
  if (!file_) return false;
  const auto& revoked = file_->list().revoked();
  return std::ranges::find(revoked, text_of_id(credential)) != revoked.end();
}

InvitationLedger::Use InvitationLedger::use_of(const Id& token) const {
  const auto found = used_.find(token);
  if (found == used_.end()) return Use::kNone;
  return found->second.number > settled_ ? Use::kBeingWritten : Use::kWritten;
}

/// Returns whether another use can be added. If the list is full, deletes expired entries first. The search for them is
/// skipped until the earliest expiry time of an entry.
bool InvitationLedger::has_room(std::uint64_t now_ms) {
  if (used_.size() < max_used_) return true;
  if (now_ms < none_expires_before_ms_) return false;
  none_expires_before_ms_ = UINT64_MAX;
  for (auto entry = used_.begin(); entry != used_.end();) {
    const std::uint64_t expires_ms = entry->second.expires_ms;
    const bool is_expired = expires_ms <= now_ms && entry->second.number <= settled_;
    if (is_expired) forgotten_to_ms_ = std::max(forgotten_to_ms_, expires_ms);
    if (!is_expired) none_expires_before_ms_ = std::min(none_expires_before_ms_, expires_ms);
    entry = is_expired ? used_.erase(entry) : std::next(entry);
  }
  if (used_.size() >= max_used_) return false;
  post({.kind = Change::Kind::kForget, .unix_ms = forgotten_to_ms_});
  return true;
}

void InvitationLedger::use(const Id& token, std::uint64_t expires_ms) {
  none_expires_before_ms_ = std::min(none_expires_before_ms_, expires_ms);
  if (!file_) {
    used_[token] = {expires_ms, 0};
    return;
  }
  post({.kind = Change::Kind::kUse, .id = token, .unix_ms = expires_ms});
  used_[token] = {expires_ms, posted_};
}

void InvitationLedger::release(const Id& token) {
  if (used_.erase(token) > 0) post({.kind = Change::Kind::kRelease, .id = token});
}

void InvitationLedger::revoke(const Id& credential) {
  post({.kind = Change::Kind::kRevoke, .id = credential});
}

void InvitationLedger::note_time(std::uint64_t now_ms) {
  post({.kind = Change::Kind::kTime, .unix_ms = now_ms});
}

void InvitationLedger::post(Change change) {
  if (!file_) return;
  change.number = ++posted_;
  waiting_.push_back(change);
  poll();
}

void InvitationLedger::poll() {
  Outcome outcome;
  while (outcomes_.pop(outcome)) settle(outcome);
  // The number of changes in flight is limited to the capacity of `outcomes_`, so that each result fits into it.
  while (!waiting_.empty() && sent_ - settled_ < kInFlight && changes_.push(waiting_.front())) {
    const Change& change = waiting_.front();
    sent_ = change.number;
    if (change.kind == Change::Kind::kUse) being_written_.push_back(change);
    waiting_.pop_front();
  }
}

void InvitationLedger::settle(const Outcome& outcome) {
  settled_ = outcome.number;
  error_ = outcome.error;
  for (; !being_written_.empty() && being_written_.front().number <= outcome.number; being_written_.pop_front()) {
    const Change& change = being_written_.front();
    const auto found = used_.find(change.id);
    const bool is_this = found != used_.end() && found->second.number == change.number;
    if (outcome.error != 0 && is_this) used_.erase(found);
  }
}

std::string InvitationLedger::problem() const {
  return error_ == 0 ? "" : std::generic_category().message(error_);
}

void InvitationLedger::work(LocalTime now) {
  if (!file_) return;
  std::vector<Change> changes;
  for (Change change; changes_.pop(change);) changes.push_back(change);
  const int error = file_->write(changes, now);
  if (!changes.empty()) outcomes_.push({.number = changes.back().number, .error = error});
}

}  // namespace tandem::server
