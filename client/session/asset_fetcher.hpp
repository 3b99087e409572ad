// Fetches the assets of a scene from the server in pieces. An asset is identified by the hash of its content. Received
// content with a different hash is discarded.
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

/// Maximum memory for the assets that a server lists.
inline constexpr std::uint64_t kMaxAssetBytes = 256ULL * 1024 * 1024;

using AssetInfos = google::protobuf::RepeatedPtrField<wire::AssetInfo>;

/// Requests the pieces of assets and assembles the answers. Several requests may be unanswered at a time; the caller
/// limits their total size. After a lost connection, the pieces of a partly received asset are kept if the next begin()
/// lists this asset again.
///
/// Thread  io
class AssetFetcher {
 public:
  /// Time without an answer of the store after which the client fetches its assets from the server instead. The limit
  /// is needed because a disk may stop responding.
  static constexpr Duration kStoreTimeout = std::chrono::seconds(1);

  /// In      store  local store that is queried before the server, and that keeps fetched assets; null if there is none
  explicit AssetFetcher(std::uint64_t limit_bytes = kMaxAssetBytes, std::shared_ptr<AssetStore> store = nullptr)
      : limit_bytes_(limit_bytes), store_(std::move(store)) {}

  /// Starts to look up assets in the store, in the order of `wanted`. Assets beyond the memory limit are not looked up.
  void look_up(const AssetInfos& wanted);
  /// Accepts the answers of the store that have arrived. Returns true once all look-ups have been answered.
  bool accept_found();
  /// Drops all look-ups if the store has not answered for kStoreTimeout.
  void check_store(LocalTime now);

  /// Sets the list of assets to fetch from the server, in the order of fetching. Assets that are available already are
  /// skipped. Returns one line of text for each asset that is omitted because its hash is malformed or the memory limit
  /// is reached.
  std::vector<std::string> begin(const AssetInfos& wanted);
  /// Must be called for a new connection: pieces that were requested but not received are requested again.
  void reconnect();
  bool has(const wire::AssetInfo& info) const;

  /// Returns the next request for a piece of at most `max_bytes`; `request` is the number that the request is sent
  /// with. Returns nothing if all pieces have been requested.
  std::optional<wire::GetAsset> next_request(std::uint32_t request, std::size_t max_bytes);
  /// Returns true if a request is unanswered.
  bool is_awaiting() const { return !awaited_.empty(); }
  /// Returns true if `request` is the oldest unanswered request. The server answers in the order of the requests.
  bool is_next(std::uint32_t request) const { return is_awaiting() && awaited_.front().request == request; }
  /// Accepts the answer to the oldest request; is_next() must be true for the request. Returns an empty text if the
  /// answer is usable. Otherwise returns the problem, and the asset is no longer fetched.
  std::string on_chunk(std::uint32_t request, const wire::AssetChunk& chunk);
  /// Handles a refusal of the oldest request; is_next() must be true for the request. The requested asset is no longer
  /// fetched.
  void on_refused(std::uint32_t request);

  /// Returns how many of the given assets are still to be fetched.
  std::size_t left_of(const AssetInfos& some) const;
  const AssetMap& assets() const { return assets_; }
  std::uint64_t bytes() const { return held_bytes_; }

 private:
  struct Wanted {
    wire::AssetInfo info;
    proto::Sha256 hash{};
    /// Number of this list entry. If an asset is removed and later listed again, its new entry has a new number.
    std::uint64_t number = 0;
    proto::Bytes bytes{};            ///< bytes received so far
    std::uint64_t requested_to = 0;  ///< all bytes before this offset are received or requested
    secure::ContentHasher hasher{};
  };
  /// A request for a piece that has not been answered.
  struct Awaited {
    std::uint32_t request = 0;
    std::uint64_t wanted = 0;  ///< Wanted::number of the asset
    std::uint64_t offset = 0;
    std::size_t bytes = 0;
  };

  /// A look-up in the store that has not been answered.
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
  /// Time at which the wait for the store's next answer began: the first check_store() after its last answer. Empty:
  /// there is no wait.
  std::optional<LocalTime> store_answered_;
};

}  // namespace tandem::client
