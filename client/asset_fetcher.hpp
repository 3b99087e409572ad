// Fetches the files of a scene by content hash, one chunk at a time, and keeps only what hashes right.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "proto/content_hash.hpp"
#include "proto/datagram.hpp"
#include "tandem/control.pb.h"

namespace tandem {

/// What is here, by content.
using AssetMap = std::map<Sha256, std::shared_ptr<const Bytes>>;

/// Memory that a server can make a client use for assets.
inline constexpr std::uint64_t kMaxAssetBytes = 256ULL * 1024 * 1024;

/// Asks for one chunk, waits for it, asks for the next: control messages of people never wait behind a file.
///
/// Thread  io
class AssetFetcher {
 public:
  explicit AssetFetcher(std::uint64_t limit_bytes = kMaxAssetBytes) : limit_bytes_(limit_bytes) {}

  /// A new list to fetch; what is here already is not fetched again. Returns one line for each asset that is
  /// left out (bad hash, over the limit).
  std::vector<std::string> begin(const google::protobuf::RepeatedPtrField<wire::AssetInfo>& wanted);
  /// The next chunk to ask for; empty while an answer is awaited or all is here.
  std::optional<wire::GetAsset> next_request();
  /// Takes an answer. The problem when it cannot be used (the asset is then given up); else empty.
  std::string on_chunk(const wire::AssetChunk& chunk);
  /// The server refused the chunk asked for last: its asset is given up.
  void on_refused();

  const AssetMap& assets() const { return assets_; }
  std::uint64_t bytes() const { return held_bytes_; }

 private:
  struct Wanted {
    Sha256 hash;
    std::uint64_t size = 0;
    std::string name;
  };
  std::string finish();

  std::uint64_t limit_bytes_;
  AssetMap assets_;
  std::uint64_t held_bytes_ = 0;
  std::deque<Wanted> wanted_;
  Bytes partial_;  ///< of wanted_.front()
  bool is_awaiting_ = false;
};

}  // namespace tandem
