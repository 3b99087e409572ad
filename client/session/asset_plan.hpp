// Selects the assets of a joined scene that the client needs. Determines the order in which they are looked up in the
// store and fetched from the server.
//
//   look up tactile ──▶ select, look up coarse replacements ──▶ fetch: first drawings, coarse, fine ──▶ other drawings
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "client/session/asset_fetcher.hpp"
#include "common/net/fetch_rate.hpp"

namespace tandem::client {

/// Availability of the assets that the client needs in the joined scene. Assets that the server refused or that were
/// left out are not counted. kCoarse: each asset or its coarse replacement is available.
enum class AssetLevel : std::uint8_t { kNone, kCoarse, kFull };

struct AssetPlanSettings {
  std::vector<std::string> kinds;        ///< kinds of assets to fetch (proto/WIRE.md); others are not fetched
  std::vector<std::string> drawn_kinds;  ///< kinds of assets that are used for drawing only
  bool fetches_one_at_a_time = false;    ///< true: the next piece is requested after the answer to the last one
  std::shared_ptr<AssetStore> store;     ///< store of assets on this machine; null if there is none
};

/// Fetches the assets of one scene after the other, and reports their availability.
///
/// Thread  io
class AssetPlan {
 public:
  /// In      log  called with a line of text for each asset that is left out or unusable
  AssetPlan(AssetPlanSettings settings, std::function<void(const std::string&)> log);

  void set_kinds(std::vector<std::string> kinds) { settings_.kinds = std::move(kinds); }
  /// Starts with the assets of a scene, or again after set_kinds(). The answers of a store on a disk are accepted
  /// later, by advance(). Returns true if assets are already available, so that the level has risen.
  bool begin(const AssetInfos& offered);
  /// Must be called for a new connection: pieces that were requested but not received are requested again.
  void reconnect();
  /// Accepts the answers of the store and continues. Returns true if the level has risen.
  bool advance(LocalTime now);
  /// Returns the next request, number `request`; none if the rate permits no request now or nothing is left.
  std::optional<wire::GetAsset> next_request(std::uint32_t request, LocalTime now);
  /// Accepts the answer to a request: receive() a piece, refuse() a refusal. Returns true if the level has risen.
  bool receive(std::uint32_t request, const wire::AssetChunk& chunk, LocalTime now);
  bool refuse(std::uint32_t request, LocalTime now);
  /// Notes a state that arrived with the one-way delay `delay`. The rate of the fetch depends on it, because states and
  /// assets share the network (FetchRate::state_came()).
  void note_state(LocalTime now, Duration delay, std::size_t bytes) { rate_.state_came(now, delay, bytes); }

  AssetLevel level() const { return level_; }
  const AssetMap& assets() const { return fetcher_.assets(); }

 private:
  /// Next step of the plan. It is taken once the store has answered all look-ups.
  enum class Step : std::uint8_t {
    kNone,     ///< no step is left
    kSelect,   ///< tactile assets were looked up; look up coarse replacements of the missing ones
    kFetch,    ///< coarse replacements and first drawings were looked up; fetch the missing assets from the server
    kDrawings  ///< remaining drawings were looked up; fetch the missing ones from the server
  };

  bool take_steps();
  void select();
  AssetInfos drawings_by_size() const;
  bool is_planning() const { return step_ == Step::kSelect || step_ == Step::kFetch; }
  bool raise_level();
  void fetch(const AssetInfos& wanted);

  AssetPlanSettings settings_;
  std::function<void(const std::string&)> log_;
  AssetFetcher fetcher_;
  net::FetchRate rate_;
  AssetInfos offered_;
  AssetLevel level_ = AssetLevel::kNone;  ///< level of the current scene and kinds
  Step step_ = Step::kNone;
  AssetInfos felt_coarse_;  ///< tactile assets, or instead of a missing one its coarse replacement
  AssetInfos felt_fine_;    ///< full assets that are fetched after their coarse replacements
};

}  // namespace tandem::client
