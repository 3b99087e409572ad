#include "server/session/invitation_ledger.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "common/base/folders.hpp"
#include "common/secure/secret.hpp"
#include "proto/content_hash.hpp"
#include "server/session/unix_time.hpp"

namespace tandem::server {
namespace {

/// Period of the writer thread. A join waits at most this long in addition to the time of the disk write.
constexpr Duration kWriterPeriod = std::chrono::milliseconds(5);
constexpr Duration kMinRetryAfter = std::chrono::milliseconds(500), kMaxRetryAfter = std::chrono::seconds(8);
/// Maximum size of the file. A full list (kMaxUsedTokens and kMaxRevoked) takes 2 MB.
constexpr std::uintmax_t kMaxLedgerBytes = 16U << 20U;
constexpr unsigned kLedgerMode = 0600;

std::string text_of_id(const InvitationLedger::Id& id) {
  return {reinterpret_cast<const char*>(id.data()), id.size()};
}

std::optional<InvitationLedger::Id> id_in(const std::string& text) {
  InvitationLedger::Id id{};
  if (text.size() != id.size()) return std::nullopt;
  std::ranges::copy(std::as_bytes(std::span(text)), id.begin());
  return id;
}

std::string bytes_of(const wire::InvitationLedger& list) {
  const std::string body = list.SerializeAsString();
  const proto::Sha256 hash = proto::sha256_of(std::as_bytes(std::span(body)));
  return std::string(reinterpret_cast<const char*>(hash.data()), hash.size()) + body;
}

bool parse(const std::string& bytes, wire::InvitationLedger& list) {
  constexpr std::size_t kHash = sizeof(proto::Sha256);
  if (bytes.size() < kHash) return false;
  const std::string body = bytes.substr(kHash);
  const proto::Sha256 hash = proto::sha256_of(std::as_bytes(std::span(body)));
  return std::ranges::equal(hash, std::as_bytes(std::span(bytes)).first(kHash)) && list.ParseFromString(body);
}

std::error_code replace_private(const std::filesystem::path& file, std::span<const std::byte> bytes) {
  return replace_file(file, {bytes}, kLedgerMode);
}

std::string drawn_generation() {
  InvitationLedger::Id id{};
  secure::fill_random(id);
  return text_of_id(id);
}

[[noreturn]] void refuse_to_write(const std::filesystem::path& file, const std::error_code& error) {
  throw std::invalid_argument(file.string() + " cannot be written: " + error.message() +
                              "; used invitations are listed there, so free space or make the folder writable");
}

}  // namespace

InvitationLedger::InvitationLedger(std::filesystem::path file, std::function<void(const std::string&)> on_news,
                                   ReplaceFile replace, std::size_t max_used)
    : file_(std::move(file)),
      on_news_(std::move(on_news)),
      replace_(replace ? std::move(replace) : ReplaceFile(replace_private)),
      max_used_(max_used) {
  read();
}

InvitationLedger::~InvitationLedger() {
  finish();
}

void InvitationLedger::make(const std::filesystem::path& file) {
  wire::InvitationLedger list;
  list.set_generation(drawn_generation());
  const std::string bytes = bytes_of(list);
  const std::error_code error = write_new_file(file, {std::as_bytes(std::span(bytes))}, kLedgerMode);
  if (error && error != std::errc::file_exists) refuse_to_write(file, error);
}

void InvitationLedger::read() {
  if (file_.empty()) return;
  std::error_code error;
  is_new_ = !std::filesystem::exists(file_, error) && !error;
  if (is_new_) {
    generation_ = drawn_generation();
    list_.set_generation(generation_);
    return;
  }
  const std::uintmax_t size = error ? 0 : std::filesystem::file_size(file_, error);
  std::ifstream in(file_, std::ios::binary);
  const std::string remedy =
      "; it is not known which invitations were used, so none is accepted. Make it readable, or remove it and start "
      "again: then only invitations made after that start are accepted";
  if (error || !in) throw std::invalid_argument(file_.string() + " cannot be read" + remedy);
  if (size > kMaxLedgerBytes) {
    throw std::invalid_argument(file_.string() + " has " + std::to_string(size) + " bytes, more than the " +
                                std::to_string(kMaxLedgerBytes) + " of a list of used invitations" + remedy);
  }
  if (!parse({std::istreambuf_iterator<char>(in), {}}, list_) || list_.generation().empty()) {
    throw std::invalid_argument(file_.string() + " is damaged (its checksum is wrong)" + remedy);
  }
  for (const wire::UsedToken& token : list_.used()) {
    if (const auto id = id_in(token.id())) used_[*id] = {token.expires_ms(), 0};
  }
  time_ms_ = list_.time_ms();
  issued_from_ms_ = list_.issued_from_ms();
  forgotten_to_ms_ = list_.forgotten_to_ms();
  generation_ = list_.generation();
}

void InvitationLedger::begin(bool keeps_credentials, std::uint64_t now_ms) {
  if (file_.empty()) return;
  if (is_new_) {
    issued_from_ms_ = now_ms;
    list_.set_issued_from_ms(now_ms);
  }
  if (issued_from_ms_ > now_ms && on_news_) {
    on_news_("the clock is behind the time at which " + file_.string() +
             " was made, and invitations from before that (" + utc_text(issued_from_ms_) +
             ") are not accepted; set the clock, or, if it was wrong then, remove the file and "
             "start again");
  }
  if (!keeps_credentials) {
    generation_ = drawn_generation();
    list_.set_generation(generation_);
    list_.clear_revoked();
  }
  remove_unfinished(file_);
  if (const std::error_code error = write()) refuse_to_write(file_, error);
}

void InvitationLedger::start() {
  if (file_.empty()) return;
  thread_ = std::make_unique<recording::RecorderThread>(kWriterPeriod, [this] { work(SteadyClock().now()); });
}

void InvitationLedger::finish() {
  if (thread_ == nullptr) return;
  poll();
  thread_->stop();
  thread_.reset();
  // Writes the changes that did not fit into the ring.
  for (poll(); posted_ > settled_; poll()) work(SteadyClock().now());
}

bool InvitationLedger::is_revoked(const Id& credential) const {
  return std::ranges::find(list_.revoked(), text_of_id(credential)) != list_.revoked().end();
}

InvitationLedger::Use InvitationLedger::use_of(const Id& token) const {
  const auto found = used_.find(token);
  if (found == used_.end()) return Use::kNone;
  return found->second.number > settled_ ? Use::kBeingWritten : Use::kWritten;
}

/// If the list is full, deletes the expired entries. The list is searched only if an entry may have expired.
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
  if (file_.empty()) {
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
  if (file_.empty()) return;
  change.number = ++posted_;
  waiting_.push_back(change);
  poll();
}

void InvitationLedger::poll() {
  Outcome outcome;
  while (outcomes_.pop(outcome)) settle(outcome);
  // The number of changes without a result is limited to the capacity of `outcomes_`, so a result always fits into it.
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

void InvitationLedger::apply(const Change& change) {
  const std::string id = text_of_id(change.id);
  auto& used = *list_.mutable_used();
  const auto erase_used = [&used](auto&& is_erased) {
    used.erase(std::remove_if(used.begin(), used.end(), is_erased), used.end());
  };
  switch (change.kind) {
    case Change::Kind::kTime:
      list_.set_time_ms(change.unix_ms);
      break;
    case Change::Kind::kUse: {
      wire::UsedToken& token = *used.Add();
      token.set_id(id);
      token.set_expires_ms(change.unix_ms);
      break;
    }
    case Change::Kind::kRelease:
      erase_used([&id](const wire::UsedToken& token) { return token.id() == id; });
      break;
    case Change::Kind::kRevoke:
      list_.add_revoked(id);
      if (list_.revoked_size() > kMaxRevoked) list_.mutable_revoked()->DeleteSubrange(0, 1);
      break;
    case Change::Kind::kForget:
      list_.set_forgotten_to_ms(change.unix_ms);
      erase_used([&change](const wire::UsedToken& token) { return token.expires_ms() <= change.unix_ms; });
      break;
  }
}

std::error_code InvitationLedger::write() {
  const std::string bytes = bytes_of(list_);
  return replace_(file_, std::as_bytes(std::span(bytes)));
}

void InvitationLedger::work(LocalTime now) {
  Outcome outcome;
  std::deque<Id> uses;
  for (Change change; changes_.pop(change); outcome.number = change.number) {
    apply(change);
    if (change.kind == Change::Kind::kUse) uses.push_back(change.id);
  }
  if (outcome.number == 0 && !(is_failing_ && now >= retry_)) return;
  const std::error_code error = write();
  const bool was_failing = std::exchange(is_failing_, static_cast<bool>(error));
  if (error) {
    // The joins with these tokens are refused, so the tokens become unused again.
    for (const Id& id : uses) apply({.kind = Change::Kind::kRelease, .id = id});
    back_off_ = was_failing ? std::min(2 * back_off_, kMaxRetryAfter) : kMinRetryAfter;
    retry_ = now + back_off_;
  }
  if (is_failing_ && !was_failing && on_news_) {
    on_news_(file_.string() + " cannot be written: " + error.message() +
             "; no invitation is accepted until it can: free space, or make the folder writable");
  }
  if (!is_failing_ && was_failing && on_news_) on_news_(file_.string() + " is written again; invitations are accepted");
  if (outcome.number == 0) return;
  outcome.error = error.value();
  outcomes_.push(outcome);
}

}  // namespace tandem::server
