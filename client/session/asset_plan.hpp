// Selects the assets of a joined scene that the client needs, and their order. Assets are looked up in the local store
// first and then fetched from the server.
//
// Terms: tactile assets are those for contact and forces. A coarse replacement is a small version of a large tactile
// asset. A drawing is a mesh for display; the first drawing of a surface is its smallest one.
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

/// Availability of the tactile assets that the client needs in the joined scene. Assets that the server refused or that
/// were omitted do not count.
/// * kNone: some asset is missing, and so is its coarse replacement
/// * kCoarse: of each asset, the asset itself or its coarse replacement is available
/// * kFull: all assets are available
enum class AssetLevel : std::uint8_t { kNone, kCoarse, kFull };

struct AssetPlanSettings {
  std::vector<std::string> kinds;        ///< kinds of assets to fetch (proto/WIRE.md)
  std::vector<std::string> drawn_kinds;  ///< kinds of assets that are used for drawing only
  bool fetches_one_at_a_time = false;    ///< true: each piece is requested only after the answer to the previous one
  std::shared_ptr<AssetStore> store;     ///< store of assets on this machine; null if there is none
};

/// Fetches the assets of the joined scene and reports their availability.
///
/// Thread  io
class AssetPlan {
 public:
  /// In      log  called with a line of text for each asset that is omitted or unusable
  AssetPlan(AssetPlanSettings settings, std::function<void(const std::string&)> log);

  void set_kinds(std::vector<std::string> kinds) { settings_.kinds = std::move(kinds); }
  /// Starts with the assets of a new scene, or starts again after set_kinds(). Returns true if the level has risen at
  /// once, because assets are already available. A disk store answers later; advance() accepts the answers.
  bool begin(const AssetInfos& offered);
  /// Must be called for a new connection: pieces that were requested but not received are requested again.
  void reconnect();
  /// Accepts the answers of the store that have arrived. When the store has answered all look-ups, executes the next
  /// step of the plan. Returns true if the level has risen.
  bool advance(LocalTime now);
  /// Returns the next request; `request` is the number that it is sent with. Returns nothing if the rate limit permits
  /// no request now, or if no piece is left to request.
  std::optional<wire::GetAsset> next_request(std::uint32_t request, LocalTime now);
  /// Accepts the answer to a request: receive() accepts a piece, refuse() a refusal. Returns true if the level has
  /// risen.
  bool receive(std::uint32_t request, const wire::AssetChunk& chunk, LocalTime now);
  bool refuse(std::uint32_t request, LocalTime now);
  /// Notes a received state update; `delay` is its one-way delay plus a constant clock offset. A rising delay reduces
  /// the fetch rate, because states and assets share the network (FetchRate::state_came()).
  void note_state(LocalTime now, Duration delay, std::size_t bytes) { rate_.state_came(now, delay, bytes); }

  AssetLevel level() const { return level_; }
  const AssetMap& assets() const { return fetcher_.assets(); }

 private:
  /// Next step of the plan. It is executed once the store has answered all look-ups.
  enum class Step : std::uint8_t {
    kNone,    ///< all steps have been executed
    kSelect,  ///< tactile assets were looked up; next: look up coarse replacements of the missing ones
    kFetch,   ///< coarse replacements and first drawings were looked up; next: fetch the missing assets from the server
    kDrawings  ///< remaining drawings were looked up; next: fetch the missing ones from the server
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
  AssetLevel level_ = AssetLevel::kNone;  ///< availability level that has been reached for the current scene and kinds
  Step step_ = Step::kNone;
  AssetInfos felt_coarse_;  ///< tactile assets to fetch first; large ones are represented by their coarse replacements
  AssetInfos felt_fine_;    ///< the large assets that felt_coarse_ replaces; they are fetched after felt_coarse_
};

}  // namespace tandem::client
