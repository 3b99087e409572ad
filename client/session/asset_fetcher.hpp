// Fetches the files of a scene by content hash, one chunk at a time, and keeps only what hashes right.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/session/asset_store.hpp"
#include "proto/content_hash.hpp"
#include "proto/datagram.hpp"
#include "tandem/control.pb.h"

namespace tandem::client {

/// Memory that a server can make a client use for assets.
inline constexpr std::uint64_t kMaxAssetBytes = 256ULL * 1024 * 1024;

/// Asks for one chunk, waits for it, asks for the next: control messages of people never wait behind a file.
///
/// Thread  io
class AssetFetcher {
 public:
  /// In      store  asked before the server, and told what was fetched; null: none
  explicit AssetFetcher(std::uint64_t limit_bytes = kMaxAssetBytes, std::shared_ptr<AssetStore> store = nullptr)
      : limit_bytes_(limit_bytes), store_(std::move(store)) {}

  /// A new list to fetch; what is here or in the store already is not fetched again. Returns one line for each asset
  /// that is left out (bad hash, over the limit).
  std::vector<std::string> begin(const google::protobuf::RepeatedPtrField<wire::AssetInfo>& wanted);
  /// The next chunk to ask for; empty while an answer is awaited or all is here.
  std::optional<wire::GetAsset> next_request();
  /// Takes an answer. The problem when it cannot be used (the asset is then given up); else empty.
  std::string on_chunk(const wire::AssetChunk& chunk);
  /// The server refused the chunk asked for last: its asset is given up.
  void on_refused() { forget_first(); }

  /// Nothing on the list is still to come: it is here, or was left out or given up.
  bool is_done() const { return wanted_.empty(); }
  const AssetMap& assets() const { return assets_; }
  std::uint64_t bytes() const { return held_bytes_; }

 private:
  bool take_from_store(const proto::Sha256& hash, std::uint64_t size);
  std::string finish();
  void forget_first();

  std::uint64_t limit_bytes_;
  std::shared_ptr<AssetStore> store_;
  AssetMap assets_;
  std::uint64_t held_bytes_ = 0;
  std::deque<wire::AssetInfo> wanted_;  ///< their hashes have 32 bytes
  proto::Bytes partial_;                ///< of wanted_.front()
  bool is_awaiting_ = false;
};

}  // namespace tandem::client
