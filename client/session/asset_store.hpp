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

/// Thread  io
class AssetStore {
 public:
  virtual ~AssetStore() = default;
  /// Bytes of exactly that hash, or null.
  virtual std::shared_ptr<const proto::Bytes> find(const proto::Sha256& hash) = 0;
  /// In      bytes  of that hash; a store that cannot keep them is no error
  virtual void keep(const proto::Sha256& hash, const std::shared_ptr<const proto::Bytes>& bytes) = 0;
};

/// For trials: filled before they begin, gone after.
class MemoryAssetStore final : public AssetStore {
 public:
  std::shared_ptr<const proto::Bytes> find(const proto::Sha256& hash) override;
  void keep(const proto::Sha256& hash, const std::shared_ptr<const proto::Bytes>& bytes) override {
    assets_[hash] = bytes;
  }

 private:
  AssetMap assets_;
};

/// A folder with a file for each asset. Others can write to it, so what is read is hashed, and what is damaged is
/// removed. When it would be over its limit, the files go that were not used for longest.
/// Cost    a find reads and hashes the whole asset: about 0.1 s for 30 MB
class DiskAssetStore final : public AssetStore {
 public:
  static constexpr std::uint64_t kDefaultLimitBytes = 1ULL << 30U;

  explicit DiskAssetStore(std::filesystem::path directory, std::uint64_t limit_bytes = kDefaultLimitBytes)
      : directory_(std::move(directory)), limit_bytes_(limit_bytes) {}

  std::shared_ptr<const proto::Bytes> find(const proto::Sha256& hash) override;
  void keep(const proto::Sha256& hash, const std::shared_ptr<const proto::Bytes>& bytes) override;

 private:
  std::filesystem::path file_of(const proto::Sha256& hash) const;
  void make_room_for(std::uint64_t bytes) const;

  std::filesystem::path directory_;
  std::uint64_t limit_bytes_;
};

}  // namespace tandem::client
