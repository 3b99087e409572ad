#include "client/session/asset_fetcher.hpp"

#include <algorithm>
#include <cstring>
#include <vector>

#include "proto/control_framing.hpp"

namespace tandem::client {
namespace {

std::optional<proto::Sha256> hash_of_field(const std::string& field) {
  proto::Sha256 hash{};
  if (field.size() != hash.size()) return std::nullopt;
  std::memcpy(hash.data(), field.data(), hash.size());
  return hash;
}

}  // namespace

std::vector<std::string> AssetFetcher::begin(const google::protobuf::RepeatedPtrField<wire::AssetInfo>& wanted) {
  wanted_.clear();
  partial_.clear();
  is_awaiting_ = false;
  std::vector<std::string> left_out;
  std::uint64_t planned = held_bytes_;
  for (const wire::AssetInfo& info : wanted) {
    const auto hash = hash_of_field(info.sha256());
    if (!hash) {
      left_out.push_back("asset " + info.name() + " left out: its hash is not 32 bytes");
    } else if (assets_.contains(*hash)) {
      continue;
    } else if (info.size_bytes() > limit_bytes_ - std::min(planned, limit_bytes_)) {
      left_out.push_back("asset " + info.name() + " left out: with it, assets would be over " +
                         std::to_string(limit_bytes_) + " bytes");
    } else {
      planned += info.size_bytes();
      if (!take_from_store(*hash, info.size_bytes())) wanted_.push_back({*hash, info.size_bytes(), info.name()});
    }
  }
  is_lacking_ = !left_out.empty();
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
  request.set_sha256(wanted_.front().hash.data(), wanted_.front().hash.size());
  request.set_offset(partial_.size());
  is_awaiting_ = true;
  return request;
}

std::string AssetFetcher::on_chunk(const wire::AssetChunk& chunk) {
  if (!is_awaiting_ || wanted_.empty()) return "an asset chunk came that was not asked for";
  is_awaiting_ = false;
  const Wanted& wanted = wanted_.front();
  const std::uint64_t missing = wanted.size - partial_.size();
  const bool is_next = hash_of_field(chunk.sha256()) == wanted.hash && chunk.offset() == partial_.size() &&
                       chunk.total_bytes() == wanted.size;
  const bool fits = chunk.data().size() <= std::min<std::uint64_t>(missing, proto::kAssetChunkBytes);
  if (!is_next || !fits || (chunk.data().empty() && missing > 0)) {
    const std::string problem = "asset " + wanted.name + ": the chunk is not the one asked for";
    on_refused();
    return problem;
  }
  const auto data = std::as_bytes(std::span(chunk.data()));
  partial_.insert(partial_.end(), data.begin(), data.end());
  return partial_.size() == wanted.size ? finish() : std::string();
}

std::string AssetFetcher::finish() {
  const Wanted& wanted = wanted_.front();
  if (proto::sha256_of(partial_) != wanted.hash) {
    const std::string problem = "asset " + wanted.name + ": the bytes do not match their hash";
    on_refused();
    return problem;
  }
  const auto bytes = std::make_shared<const proto::Bytes>(std::move(partial_));
  held_bytes_ += bytes->size();
  assets_[wanted.hash] = bytes;
  if (store_) store_->keep(wanted.hash, bytes);
  forget_first();
  return {};
}

void AssetFetcher::on_refused() {
  is_lacking_ = true;
  forget_first();
}

void AssetFetcher::forget_first() {
  is_awaiting_ = false;
  partial_ = proto::Bytes();
  if (!wanted_.empty()) wanted_.pop_front();
}

}  // namespace tandem::client
