// Stores a client's assets on this machine for later sessions, indexed by the SHA-256 of their bytes.
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

/// Bytes of an asset in a store; null if the store has no asset with the requested hash and size.
using FoundAsset = std::shared_ptr<const proto::Bytes>;

/// Interface of a store. The io thread calls both functions, and the force depends on the io thread. So the functions
/// must not wait for a disk.
///
/// Thread  any, one at a time. Exception: the disk store accepts concurrent calls, because two devices of a user share
///         it
class AssetStore {
 public:
  virtual ~AssetStore() = default;
  /// Starts a look-up of the asset with this hash and size. Look-ups are answered in the order of the calls.
  virtual std::future<FoundAsset> find(const proto::Sha256& hash, std::uint64_t size_bytes) = 0;
  /// Stores an asset, if possible. A failure is not reported, because the asset can be fetched again.
  /// In      bytes  content whose hash is `hash`
  virtual void keep(const proto::Sha256& hash, const std::shared_ptr<const proto::Bytes>& bytes) = 0;
};

/// Creates a store in memory, which answers look-ups at once. The lab fills it before a trial and discards it after the
/// trial.
std::shared_ptr<AssetStore> memory_asset_store();

inline constexpr std::uint64_t kDefaultAssetStoreBytes = 1ULL << 30U;

/// Reads a whole file; the result is empty if the file cannot be read.
using ReadAsset = std::function<std::optional<proto::Bytes>(const std::filesystem::path& file)>;
std::optional<proto::Bytes> read_asset_file(const std::filesystem::path& file);

/// Creates a store in a folder, with one file for each asset. Other programs can write to the folder, so each file is
/// verified by its hash, and damaged files are removed. Above the size limit, the least recently used files are
/// removed.
/// In      read  function that reads a file; tests replace it
/// Cost    a thread of its own reads, hashes (about 0.1 s for 30 MB) and writes the files; reads have priority. The
///         destructor waits for pending writes and for a file that is being read
std::shared_ptr<AssetStore> disk_asset_store(std::filesystem::path directory,
                                             std::uint64_t limit_bytes = kDefaultAssetStoreBytes,
                                             ReadAsset read = read_asset_file);

}  // namespace tandem::client
