// Cache of plane queries. A plane query finds the planes of the other shape's field above which a flat node of the
// shell lies.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/contact/field/distance_field.hpp"
#include "common/contact/shell/cut_node.hpp"
#include "common/contact/shell/shell_motion.hpp"

namespace tandem::contact {

/// For each flat node, stores the planes above which it lies, and the accumulated motion until which this result is
/// valid. A plane query of a grid takes microseconds. To bound their cost, the new queries of a step may read only a
/// limited number of entries of the field's table of planes.
///
/// Thread  any, one at a time; no allocation after construction
class PlaneCache {
 public:
  PlaneCache();

  void bind(const PointShell& shell, const DistanceField& field) noexcept;
  /// Discards all results. Required when the accumulated motion restarts at zero.
  void clear() noexcept;
  void begin_step() noexcept { queries_ = 0; }
  /// Sets the number of table entries that new queries of this step may read.
  void set_limit(std::size_t queries) noexcept { max_queries_ = queries; }
  void begin_part() noexcept { has_open_question_ = false; }
  /// Returns whether the limit has prevented the query of a node since begin_part().
  bool has_open_question() const { return has_open_question_; }

  /// Returns the planes above which a node lies, with the accumulated motion until which they are valid. The set is
  /// empty if the node is above no plane, or if it was not queried because of the limit.
  ///
  /// In      moved_m  accumulated motion of the node's part
  CutNode planes_below(std::uint32_t index, double moved_m, const ShellMotion& motion) noexcept;

 private:
  static constexpr std::size_t kAnswers = 4096;

  const PointShell* shell_ = nullptr;
  const DistanceField* field_ = nullptr;
  std::vector<CutNode> answers_;  ///< results; the slot of a node is its index modulo kAnswers
  std::size_t queries_ = 0;       ///< entries of the field's table of planes that were read in this step
  std::size_t max_queries_ = 0;
  bool has_open_question_ = false;
};

}  // namespace tandem::contact
