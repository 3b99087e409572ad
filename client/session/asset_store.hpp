// Where a client keeps the assets of scenes beyond a session, by the SHA-256 of their bytes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "proto/content_hash.hpp"
#include "proto/datagram.hpp"

namespace tandem::client {

/// What is here, by content.
using AssetMap = std::map<proto::Sha256, std::shared_ptr<const proto::Bytes>>;

/// In      hash  32 bytes, as a message has it
/// Out     null: no hash, or not here
const proto::Bytes* find_asset(const AssetMap& assets, const std::string& hash);

/// Thread  any, one at a time; a folder's, which two devices of a person share, any
class AssetStore {
 public:
  virtual ~AssetStore() = default;
  /// Bytes of exactly that hash, or null.
  virtual std::shared_ptr<const proto::Bytes> find(const proto::Sha256& hash) = 0;
  /// In      bytes  of that hash; a store that cannot keep them is no error
  virtual void keep(const proto::Sha256& hash, const std::shared_ptr<const proto::Bytes>& bytes) = 0;
};

/// For trials: filled before they begin, gone after.
std::shared_ptr<AssetStore> memory_asset_store();

inline constexpr std::uint64_t kDefaultAssetStoreBytes = 1ULL << 30U;

/// A folder with a file for each asset. Others can write to it, so what is read is hashed, and what is damaged is
/// removed. When it would be over its limit, the files go that were not used for longest.
/// Cost    a find reads and hashes the whole asset: about 0.1 s for 30 MB; what is kept is written by a thread of its own,
///         which the end of the store waits for
std::shared_ptr<AssetStore> disk_asset_store(std::filesystem::path directory,
                                             std::uint64_t limit_bytes = kDefaultAssetStoreBytes);

}  // namespace tandem::client
