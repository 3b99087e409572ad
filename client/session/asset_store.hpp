// Where a client keeps the assets of scenes beyond a session, by the SHA-256 of their bytes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "proto/content_hash.hpp"
#include "proto/datagram.hpp"

namespace tandem::client {

/// What is here, by content.
using AssetMap = std::map<proto::Sha256, std::shared_ptr<const proto::Bytes>>;

/// In      hash  32 bytes, as a message has it
/// Out     null: no hash, or not here
const proto::Bytes* find_asset(const AssetMap& assets, const std::string& hash);

/// Bytes that a store has found; null: none of that hash and size.
using FoundAsset = std::shared_ptr<const proto::Bytes>;

/// Neither call blocks on a disk: the io thread, which carries the force, makes them.
///
/// Thread  any, one at a time; a folder's, which two devices of a person share, any
class AssetStore {
 public:
  virtual ~AssetStore() = default;
  /// Starts a look-up of bytes of exactly that hash and size. Look-ups are answered in their order.
  virtual std::future<FoundAsset> find(const proto::Sha256& hash, std::uint64_t size_bytes) = 0;
  /// In      bytes  of that hash; a store that cannot keep them is no error
  virtual void keep(const proto::Sha256& hash, const std::shared_ptr<const proto::Bytes>& bytes) = 0;
};

/// For trials: filled before they begin, gone after. A look-up is answered at once.
std::shared_ptr<AssetStore> memory_asset_store();

inline constexpr std::uint64_t kDefaultAssetStoreBytes = 1ULL << 30U;

/// Reads a whole file; empty: it cannot be read.
using ReadAsset = std::function<std::optional<proto::Bytes>(const std::filesystem::path& file)>;
std::optional<proto::Bytes> read_asset_file(const std::filesystem::path& file);

/// A folder with a file for each asset. Others can write to it, so what is read is hashed, and what is damaged is
/// removed. When it would be over its limit, the files go that were not used for longest.
/// In      read  how a file is read
/// Cost    a thread of its own reads, hashes (about 0.1 s for 30 MB) and writes, look-ups first. The end of the store waits for
///         what is to be written, and for the file that is being read
std::shared_ptr<AssetStore> disk_asset_store(std::filesystem::path directory,
                                             std::uint64_t limit_bytes = kDefaultAssetStoreBytes,
                                             ReadAsset read = read_asset_file);

}  // namespace tandem::client
