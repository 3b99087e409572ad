// Storage of a client's assets beyond a session, by the SHA-256 of their bytes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>

#include "client/exchange/asset_map.hpp"

namespace tandem::client {

/// Bytes that a store has found; null: none of that hash and size.
using FoundAsset = std::shared_ptr<const proto::Bytes>;

/// Neither call may block on a disk, because the io thread, on which the force depends, makes them.
///
/// Thread  any, one at a time; the disk store, which two devices of one user share: any
class AssetStore {
 public:
  virtual ~AssetStore() = default;
  /// Starts a look-up of bytes of exactly that hash and size. Look-ups are answered in order.
  virtual std::future<FoundAsset> find(const proto::Sha256& hash, std::uint64_t size_bytes) = 0;
  /// In      bytes  content of that hash; a store that cannot keep them reports no error
  virtual void keep(const proto::Sha256& hash, const std::shared_ptr<const proto::Bytes>& bytes) = 0;
};

/// Store in memory for trials: filled before they begin, discarded afterwards. Answers a look-up at once.
std::shared_ptr<AssetStore> memory_asset_store();

inline constexpr std::uint64_t kDefaultAssetStoreBytes = 1ULL << 30U;

/// Reads a whole file; empty if it cannot be read.
using ReadAsset = std::function<std::optional<proto::Bytes>(const std::filesystem::path& file)>;
std::optional<proto::Bytes> read_asset_file(const std::filesystem::path& file);

/// Store in a folder with a file for each asset. Other programs can write to it, so files are verified by their hash,
/// and damaged ones are removed. Above the limit, the least recently used files are removed.
/// In      read  function that reads a file
/// Cost    a separate thread reads, hashes (about 0.1 s for 30 MB) and writes, look-ups first. The destructor waits for
///         pending writes and for the file that is being read
std::shared_ptr<AssetStore> disk_asset_store(std::filesystem::path directory,
                                             std::uint64_t limit_bytes = kDefaultAssetStoreBytes,
                                             ReadAsset read = read_asset_file);

}  // namespace tandem::client
