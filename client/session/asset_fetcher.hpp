// Fetches the files of a scene by content hash, in pieces; discards files with a wrong hash.
#pragma once

#include <cstdint>
#include <deque>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/session/asset_store.hpp"
#include "common/base/time.hpp"
#include "common/secure/content_hasher.hpp"
#include "proto/content_hash.hpp"
#include "proto/datagram.hpp"
#include "tandem/control.pb.h"

namespace tandem::client {

/// Limit of the memory that a server can make a client use for assets.
inline constexpr std::uint64_t kMaxAssetBytes = 256ULL * 1024 * 1024;

using AssetInfos = google::protobuf::RepeatedPtrField<wire::AssetInfo>;

/// Requests pieces ahead, as far as the caller permits, and assembles the answers. Received pieces are kept after a
/// lost connection as long as the asset is wanted.
///
/// Thread  io
class AssetFetcher {
 public:
  /// Time without an answer of the store after which the server is queried instead, since a disk may hang.
  static constexpr Duration kStoreTimeout = std::chrono::seconds(1);

  /// In      store  queried before the server, and stores fetched assets; null: none
  explicit AssetFetcher(std::uint64_t limit_bytes = kMaxAssetBytes, std::shared_ptr<AssetStore> store = nullptr)
      : limit_bytes_(limit_bytes), store_(std::move(store)) {}

  /// Starts the look-ups of these assets in the store, in order, within the memory limit.
  void look_up(const AssetInfos& wanted);
  /// Collects the store's answers so far. Returns true once all look-ups are answered.
  bool accept_found();
  /// Drops all look-ups when the store has not answered for kStoreTimeout.
  void check_store(LocalTime now);

  /// Sets a new list to fetch from the server, in order, except available assets. Returns one line for each asset that
  /// is left out (bad hash, over the limit).
  std::vector<std::string> begin(const AssetInfos& wanted);
  /// Starts a new connection, on which earlier requests are not answered.
  void reconnect();
  bool has(const wire::AssetInfo& info) const;

  /// Next piece to request, of at most `max_bytes`, as request number `request`; empty if all is requested.
  std::optional<wire::GetAsset> next_request(std::uint32_t request, std::size_t max_bytes);
  /// True if a request is unanswered.
  bool is_awaiting() const { return !awaited_.empty(); }
  /// True if `request` is the next to be answered: answers arrive in the order of the requests.
  bool is_next(std::uint32_t request) const { return is_awaiting() && awaited_.front().request == request; }
  /// Takes the answer to a request that is_next(). Returns the problem if it is unusable, and gives up its asset; else
  /// empty.
  std::string on_chunk(std::uint32_t request, const wire::AssetChunk& chunk);
  /// Gives up the asset of a request that is_next() and that the server refused.
  void on_refused(std::uint32_t request);

  /// Number of these assets that are still expected: listed, not available, not given up.
  std::size_t left_of(const AssetInfos& some) const;
  const AssetMap& assets() const { return assets_; }
  std::uint64_t bytes() const { return held_bytes_; }

 private:
  struct Wanted {
    wire::AssetInfo info;
    proto::Sha256 hash{};
    std::uint64_t number = 0;        ///< unique, also among entries of the same asset
    proto::Bytes bytes{};            ///< received so far
    std::uint64_t requested_to = 0;  ///< all bytes before it are received or requested
    secure::ContentHasher hasher{};
  };
  /// A requested piece without an answer yet.
  struct Awaited {
    std::uint32_t request = 0;
    std::uint64_t wanted = 0;  ///< Wanted::number
    std::uint64_t offset = 0;
    std::size_t bytes = 0;
  };

  /// A query of the store.
  struct Lookup {
    proto::Sha256 hash{};
    std::uint64_t size_bytes = 0;
    std::future<FoundAsset> answer;
  };

  std::vector<std::string> add(const AssetInfos& wanted);
  std::string accept(Wanted& wanted, const Awaited& awaited, const wire::AssetChunk& chunk);
  std::string finish(Wanted& wanted);

  std::uint64_t limit_bytes_;
  std::shared_ptr<AssetStore> store_;
  AssetMap assets_;
  std::uint64_t held_bytes_ = 0;
  std::uint64_t last_number_ = 0;
  std::deque<Wanted> wanted_;
  std::deque<Awaited> awaited_;
  std::deque<Lookup> lookups_;
  std::optional<LocalTime> store_answered_;  ///< time of its last answer, or of the start of waiting
};

}  // namespace tandem::client
