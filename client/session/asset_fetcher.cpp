#include "client/session/asset_fetcher.hpp"

#include <algorithm>
#include <vector>

#include "proto/control_framing.hpp"

namespace tandem::client {

std::vector<std::string> AssetFetcher::begin(const google::protobuf::RepeatedPtrField<wire::AssetInfo>& wanted) {
  wanted_.clear();
  partial_.clear();
  is_awaiting_ = false;
  std::vector<std::string> left_out;
  std::uint64_t planned = held_bytes_;
  for (const wire::AssetInfo& info : wanted) {
    const auto hash = proto::hash_from(info.sha256());
    if (!hash) {
      left_out.push_back("asset " + info.name() + " left out: its hash is not 32 bytes");
    } else if (assets_.contains(*hash)) {
      continue;
    } else if (info.size_bytes() > limit_bytes_ - std::min(planned, limit_bytes_)) {
      left_out.push_back("asset " + info.name() + " left out: with it, assets would be over " +
                         std::to_string(limit_bytes_) + " bytes");
    } else {
      planned += info.size_bytes();
      if (!take_from_store(*hash, info.size_bytes())) wanted_.push_back(info);
    }
  }
  return left_out;
}

bool AssetFetcher::take_from_store(const proto::Sha256& hash, std::uint64_t size) {
  const auto found = store_ ? store_->find(hash) : nullptr;
  if (found == nullptr || found->size() != size) return false;
  held_bytes_ += size;
  assets_[hash] = found;
  return true;
}

std::optional<wire::GetAsset> AssetFetcher::next_request() {
  if (is_awaiting_ || wanted_.empty()) return std::nullopt;
  wire::GetAsset request;
  request.set_sha256(wanted_.front().sha256());
  request.set_offset(partial_.size());
  is_awaiting_ = true;
  return request;
}

std::string AssetFetcher::on_chunk(const wire::AssetChunk& chunk) {
  if (!is_awaiting_ || wanted_.empty()) return "an asset chunk came that was not asked for";
  is_awaiting_ = false;
  const wire::AssetInfo& wanted = wanted_.front();
  const std::uint64_t missing = wanted.size_bytes() - partial_.size();
  const bool is_next = chunk.sha256() == wanted.sha256() && chunk.offset() == partial_.size() &&
                       chunk.total_bytes() == wanted.size_bytes();
  const bool fits = chunk.data().size() <= std::min<std::uint64_t>(missing, proto::kAssetChunkBytes);
  if (!is_next || !fits || (chunk.data().empty() && missing > 0)) {
    std::string problem = "asset " + wanted.name() + ": the chunk is not the one asked for";
    forget_first();
    return problem;
  }
  const auto data = std::as_bytes(std::span(chunk.data()));
  partial_.insert(partial_.end(), data.begin(), data.end());
  return partial_.size() == wanted.size_bytes() ? finish() : std::string();
}

std::string AssetFetcher::finish() {
  const wire::AssetInfo& wanted = wanted_.front();
  const proto::Sha256 hash = proto::sha256_of(partial_);
  if (hash != proto::hash_from(wanted.sha256())) {
    std::string problem = "asset " + wanted.name() + ": the bytes do not match their hash";
    forget_first();
    return problem;
  }
  const auto bytes = std::make_shared<const proto::Bytes>(std::move(partial_));
  held_bytes_ += bytes->size();
  assets_[hash] = bytes;
  if (store_) store_->keep(hash, bytes);
  forget_first();
  return {};
}

void AssetFetcher::forget_first() {
  is_awaiting_ = false;
  partial_ = proto::Bytes();
  if (!wanted_.empty()) wanted_.pop_front();
}

}  // namespace tandem::client
