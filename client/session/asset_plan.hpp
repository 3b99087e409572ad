// Selection and order of the assets of a joined scene to look up in the store and to fetch from the server.
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

/// Availability of the wanted assets of the joined scene; unobtainable ones do not count. kCoarse: each asset itself or
/// its coarse replacement is available.
enum class AssetLevel : std::uint8_t { kNone, kCoarse, kFull };

struct AssetPlanSettings {
  std::vector<std::string> kinds;        ///< kinds of proto/WIRE.md to fetch; others stay at the server
  std::vector<std::string> drawn_kinds;  ///< kinds that are only drawn
  bool fetches_one_at_a_time = false;    ///< requests one piece at a time
  std::shared_ptr<AssetStore> store;     ///< null: none
};

/// Thread  io
class AssetPlan {
 public:
  /// In      log  receives lines about assets that are left out or unusable
  AssetPlan(AssetPlanSettings settings, std::function<void(const std::string&)> log);

  void set_kinds(std::vector<std::string> kinds) { settings_.kinds = std::move(kinds); }
  /// Begins with the assets of a scene, or with other kinds of it. A store on a disk answers later (advance()). Returns
  /// whether assets are available already, as a rise of the level.
  bool begin(const AssetInfos& offered);
  /// Starts a new connection, on which earlier requests are not answered.
  void reconnect();
  /// Continues with the answers of the store. Returns whether the level has risen.
  bool advance(LocalTime now);
  /// Next piece to request now, as request number `request`; nothing: not yet, or nothing is left.
  std::optional<wire::GetAsset> next_request(std::uint32_t request, LocalTime now);
  /// Accepts the answer to a request, a piece or its refusal. Returns whether the level has risen.
  bool receive(std::uint32_t request, const wire::AssetChunk& chunk, LocalTime now);
  bool refuse(std::uint32_t request, LocalTime now);
  /// State arrived after `delay`: it shares the line with the assets (FetchRate::state_came()).
  void note_state(LocalTime now, Duration delay, std::size_t bytes) { rate_.state_came(now, delay, bytes); }

  AssetLevel level() const { return level_; }
  const AssetMap& assets() const { return fetcher_.assets(); }

 private:
  /// Next step, taken when the store has answered all look-ups.
  enum class Step : std::uint8_t {
    kNone,     ///< nothing
    kSelect,   ///< tactile assets were looked up; next, look up coarse replacements of missing ones
    kFetch,    ///< replacements and first drawings were looked up; next, fetch from the server
    kDrawings  ///< remaining drawings were looked up; next, fetch them
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
  AssetLevel level_ = AssetLevel::kNone;  ///< for this scene and these kinds
  Step step_ = Step::kNone;
  AssetInfos felt_coarse_;  ///< the tactile assets or their coarse replacements
  AssetInfos felt_fine_;    ///< full assets that follow the replacements
};

}  // namespace tandem::client
