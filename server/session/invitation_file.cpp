#include "server/session/invitation_file.hpp"

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

constexpr Duration kMinRetryAfter = std::chrono::milliseconds(500), kMaxRetryAfter = std::chrono::seconds(8);
/// Maximum size of the file that is read. A full list (kMaxUsedTokens and kMaxRevoked) takes 2 MB.
constexpr std::uintmax_t kMaxLedgerBytes = 16U << 20U;
constexpr unsigned kLedgerMode = 0600;

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
  InvitationId id{};
  secure::fill_random(id);
  return text_of_id(id);
}

[[noreturn]] void refuse_to_write(const std::filesystem::path& file, const std::error_code& error) {
  throw std::invalid_argument(file.string() + " cannot be written: " + error.message() +
                              "; used invitations are listed there, so free space or make the folder writable");
}

}  // namespace

std::string text_of_id(const InvitationId& id) {
  return {reinterpret_cast<const char*>(id.data()), id.size()};
}

std::optional<InvitationId> id_in(const std::string& text) {
  InvitationId id{};
  if (text.size() != id.size()) return std::nullopt;
  std::ranges::copy(std::as_bytes(std::span(text)), id.begin());
  return id;
}

InvitationFile::InvitationFile(std::filesystem::path file, std::function<void(const std::string&)> on_news,
                               ReplaceFile replace)
    : file_(std::move(file)),
      on_news_(std::move(on_news)),
      replace_(replace ? std::move(replace) : ReplaceFile(replace_private)) {
  read();
}

void InvitationFile::make(const std::filesystem::path& file) {
  wire::InvitationLedger list;
  list.set_generation(drawn_generation());
  const std::string bytes = bytes_of(list);
  const std::error_code error = write_new_file(file, {std::as_bytes(std::span(bytes))}, kLedgerMode);
  if (error && error != std::errc::file_exists) refuse_to_write(file, error);
}

void InvitationFile::read() {
  std::error_code error;
  is_new_ = !std::filesystem::exists(file_, error) && !error;
  if (is_new_) {
    list_.set_generation(drawn_generation());
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
}

void InvitationFile::begin(bool keeps_credentials, std::uint64_t now_ms) {
  if (is_new_) list_.set_issued_from_ms(now_ms);
  if (list_.issued_from_ms() > now_ms && on_news_) {
    on_news_("the clock is behind the time at which " + file_.string() +
             " was made, and invitations from before that (" + utc_text(list_.issued_from_ms()) +
             ") are not accepted; set the clock, or, if it was wrong then, remove the file and "
             "start again");
  }
  if (!keeps_credentials) {
    list_.set_generation(drawn_generation());
    list_.clear_revoked();
  }
  remove_unfinished(file_);
  if (const std::error_code error = replace()) refuse_to_write(file_, error);
}

int InvitationFile::write(std::span<const InvitationChange> changes, LocalTime now) {
  for (const InvitationChange& change : changes) apply(change);
  if (changes.empty() && !(is_failing_ && now >= retry_)) return 0;
  const std::error_code error = replace();
  const bool was_failing = std::exchange(is_failing_, static_cast<bool>(error));
  if (error) {
    // The joins that use these tokens are refused, because the write has failed. Their tokens are therefore marked as
    // unused again.
    for (const InvitationChange& change : changes) {
      if (change.kind == InvitationChange::Kind::kUse)
        apply({.kind = InvitationChange::Kind::kRelease, .id = change.id});
    }
    back_off_ = was_failing ? std::min(2 * back_off_, kMaxRetryAfter) : kMinRetryAfter;
    retry_ = now + back_off_;
  }
  if (is_failing_ && !was_failing && on_news_) {
    on_news_(file_.string() + " cannot be written: " + error.message() +
             "; no invitation is accepted until it can: free space, or make the folder writable");
  }
  if (!is_failing_ && was_failing && on_news_) on_news_(file_.string() + " is written again; invitations are accepted");
  return error.value();
}

void InvitationFile::apply(const InvitationChange& change) {
  const std::string id = text_of_id(change.id);
  auto& used = *list_.mutable_used();
  const auto erase_used = [&used](auto&& is_erased) {
    used.erase(std::remove_if(used.begin(), used.end(), is_erased), used.end());
  };
  switch (change.kind) {
    case InvitationChange::Kind::kTime:
      list_.set_time_ms(change.unix_ms);
      break;
    case InvitationChange::Kind::kUse: {
      wire::UsedToken& token = *used.Add();
      token.set_id(id);
      token.set_expires_ms(change.unix_ms);
      break;
    }
    case InvitationChange::Kind::kRelease:
      erase_used([&id](const wire::UsedToken& token) { return token.id() == id; });
      break;
    case InvitationChange::Kind::kRevoke:
      list_.add_revoked(id);
      if (list_.revoked_size() > kMaxRevoked) list_.mutable_revoked()->DeleteSubrange(0, 1);
      break;
    case InvitationChange::Kind::kForget:
      list_.set_forgotten_to_ms(change.unix_ms);
      erase_used([&change](const wire::UsedToken& token) { return token.expires_ms() <= change.unix_ms; });
      break;
  }
}

std::error_code InvitationFile::replace() {
  const std::string bytes = bytes_of(list_);
  return replace_(file_, std::as_bytes(std::span(bytes)));
}

}  // namespace tandem::server
