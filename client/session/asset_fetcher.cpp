#include "client/session/asset_fetcher.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <span>
#include <utility>

#include "proto/control_framing.hpp"

namespace tandem::client {

void AssetFetcher::look_up(const AssetInfos& wanted) {
  std::uint64_t planned = held_bytes_;
  std::set<proto::Sha256> listed;
  for (const Lookup& lookup : lookups_) {
    planned += lookup.size_bytes;
    listed.insert(lookup.hash);
  }
  for (const wire::AssetInfo& info : wanted) {
    const auto hash = proto::hash_from(info.sha256());
    const bool fits = info.size_bytes() <= limit_bytes_ - std::min(planned, limit_bytes_);
    if (!store_ || !hash || !fits || assets_.contains(*hash)) continue;
    if (!listed.insert(*hash).second) continue;
    planned += info.size_bytes();
    lookups_.push_back({*hash, info.size_bytes(), store_->find(*hash, info.size_bytes())});
  }
}

bool AssetFetcher::accept_found() {
  while (!lookups_.empty() && lookups_.front().answer.wait_for(Duration{0}) == std::future_status::ready) {
    Lookup lookup = std::move(lookups_.front());
    lookups_.pop_front();
    store_answered_.reset();
    const FoundAsset found = lookup.answer.get();
    if (found == nullptr || found->size() != lookup.size_bytes || assets_.contains(lookup.hash)) continue;
    held_bytes_ += found->size();
    assets_[lookup.hash] = found;
  }
  return lookups_.empty();
}

void AssetFetcher::check_store(LocalTime now) {
  if (lookups_.empty()) return store_answered_.reset();
  if (!store_answered_) store_answered_ = now;
  if (now - *store_answered_ < kStoreTimeout) return;
  lookups_.clear();
  store_answered_.reset();
}

void AssetFetcher::reconnect() {
  awaited_.clear();
  for (Wanted& wanted : wanted_) wanted.requested_to = wanted.bytes.size();
}

std::vector<std::string> AssetFetcher::begin(const AssetInfos& wanted) {
  std::deque<Wanted> before = std::exchange(wanted_, {});
  std::vector<std::string> left_out = add(wanted);
  std::map<proto::Sha256, Wanted*> by_hash;
  for (Wanted& then : before) by_hash.emplace(then.hash, &then);
  for (Wanted& now : wanted_) {
    const auto found = by_hash.find(now.hash);
    if (found == by_hash.end() || found->second->info.size_bytes() != now.info.size_bytes()) continue;
    Wanted& then = *found->second;
    now.number = then.number;
    now.bytes = std::move(then.bytes);
    now.hasher = std::move(then.hasher);
    now.requested_to = then.requested_to;
  }
  return left_out;
}

std::vector<std::string> AssetFetcher::add(const AssetInfos& wanted) {
  std::vector<std::string> left_out;
  std::uint64_t planned = held_bytes_;
  std::set<proto::Sha256> listed;
  for (const wire::AssetInfo& info : wanted) {
    const auto hash = proto::hash_from(info.sha256());
    if (!hash) {
      left_out.push_back("asset " + info.name() + " left out: its hash is not 32 bytes");
    } else if (assets_.contains(*hash) || listed.contains(*hash)) {
      continue;
    } else if (info.size_bytes() > limit_bytes_ - std::min(planned, limit_bytes_)) {
      left_out.push_back("asset " + info.name() + " left out: with it, assets would be over " +
                         std::to_string(limit_bytes_) + " bytes");
    } else {
      planned += info.size_bytes();
      listed.insert(*hash);
      wanted_.push_back({.info = info, .hash = *hash, .number = ++last_number_});
    }
  }
  return left_out;
}

bool AssetFetcher::has(const wire::AssetInfo& info) const {
  const auto hash = proto::hash_from(info.sha256());
  return hash && assets_.contains(*hash);
}

std::size_t AssetFetcher::left_of(const AssetInfos& some) const {
  std::set<proto::Sha256> hashes;
  for (const wire::AssetInfo& info : some) {
    if (const auto hash = proto::hash_from(info.sha256())) hashes.insert(*hash);
  }
  return static_cast<std::size_t>(
      std::ranges::count_if(wanted_, [&hashes](const Wanted& wanted) { return hashes.contains(wanted.hash); }));
}

std::optional<wire::GetAsset> AssetFetcher::next_request(std::uint32_t request, std::size_t max_bytes) {
  const auto is_open = [](const Wanted& wanted) {
    return wanted.requested_to < wanted.info.size_bytes() || wanted.info.size_bytes() == 0;
  };
  const auto next = std::ranges::find_if(wanted_, is_open);
  const std::size_t most = std::min(max_bytes, proto::kAssetChunkBytes);
  if (next == wanted_.end() || most == 0) return std::nullopt;
  // An empty asset (0 bytes) needs exactly one request. Nothing is requested while this request is unanswered.
  const bool is_awaited = std::ranges::find(awaited_, next->number, &Awaited::wanted) != awaited_.end();
  if (next->info.size_bytes() == 0 && is_awaited) return std::nullopt;
  const std::size_t bytes =
      static_cast<std::size_t>(std::min<std::uint64_t>(most, next->info.size_bytes() - next->requested_to));
  awaited_.push_back({request, next->number, next->requested_to, bytes});
  wire::GetAsset message;
  message.set_sha256(next->info.sha256());
  message.set_offset(next->requested_to);
  message.set_max_bytes(static_cast<std::uint32_t>(std::max<std::size_t>(1, bytes)));
  next->requested_to += bytes;
  return message;
}

std::string AssetFetcher::on_chunk(std::uint32_t request, const wire::AssetChunk& chunk) {
  if (!is_next(request)) return "an asset chunk was received that was not requested";
  const Awaited awaited = awaited_.front();
  awaited_.pop_front();
  const auto wanted = std::ranges::find(wanted_, awaited.wanted, &Wanted::number);
  if (wanted == wanted_.end()) return {};  // the server may answer a request after its asset was removed from the list
  std::string problem = accept(*wanted, awaited, chunk);
  if (!problem.empty() || assets_.contains(wanted->hash)) wanted_.erase(wanted);
  return problem;
}

std::string AssetFetcher::accept(Wanted& wanted, const Awaited& awaited, const wire::AssetChunk& chunk) {
  const std::uint64_t size = wanted.info.size_bytes();
  const bool is_it = chunk.sha256() == wanted.info.sha256() && chunk.offset() == awaited.offset &&
                     awaited.offset == wanted.bytes.size() && chunk.total_bytes() == size &&
                     chunk.data().size() == awaited.bytes;
  if (!is_it) return "asset " + wanted.info.name() + ": the chunk is not the requested one";
  const auto data = std::as_bytes(std::span(chunk.data()));
  // Memory for the whole asset is reserved at once. Otherwise the vector would grow with each piece, and a single
  // growth would copy all received bytes (up to 128 MB).
  if (wanted.bytes.empty()) wanted.bytes.reserve(static_cast<std::size_t>(size));
  wanted.hasher.add(data);
  wanted.bytes.insert(wanted.bytes.end(), data.begin(), data.end());
  return wanted.bytes.size() == size ? finish(wanted) : std::string();
}

std::string AssetFetcher::finish(Wanted& wanted) {
  if (wanted.hasher.finish() != wanted.hash) {
    return "asset " + wanted.info.name() + ": the bytes do not match their hash";
  }
  const auto bytes = std::make_shared<const proto::Bytes>(std::move(wanted.bytes));
  held_bytes_ += bytes->size();
  assets_[wanted.hash] = bytes;
  if (store_) store_->keep(wanted.hash, bytes);
  return {};
}

void AssetFetcher::on_refused(std::uint32_t request) {
  if (!is_next(request)) return;
  const std::uint64_t refused = awaited_.front().wanted;
  awaited_.pop_front();
  std::erase_if(wanted_, [refused](const Wanted& wanted) { return wanted.number == refused; });
}

}  // namespace tandem::client
