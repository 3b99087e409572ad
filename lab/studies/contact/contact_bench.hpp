// Results of `tandem-lab bench contact`. The command, the reproductions and the tests use them.
#pragma once

#include <optional>

#include "common/base/json.hpp"
#include "lab/studies/contact/touch_judgement.hpp"
#include "lab/studies/contact/touch_path.hpp"

namespace tandem::lab {

struct ContactBench {
  std::string a;
  std::string b;
  std::size_t triangles_a = 0;
  std::size_t triangles_b = 0;
  std::size_t points = 0;  ///< number of points in both shells together
  double spacing_m = 0;    ///< point spacing of the object with the wider spacing
  double cell_m = 0;       ///< cell size of the object with the larger cells
  double build_s = 0;      ///< build time: sum for both objects, or the time of one if they are the same object
  double cache_load_s = 0;
  std::size_t memory_bytes = 0;
  TouchFigures ours;
  std::optional<TouchFigures> gimpact;
  double field_sample_ns = 0;    ///< time of one query of the distance field: a lower bound for every contact method
  TimeQuantiles memory_copy_us;  ///< time to copy 256 KiB; its spread is the timing jitter of the machine
};

/// Returns the results that can be determined without a simulation, such as number of triangles and build time. If both
/// objects are the same, the build time counts once.
ContactBench describe(const TouchObject& a, const TouchObject& b);

boost::json::object to_json(const TouchFigures& figures);
boost::json::object to_json(const ContactBench& bench);
/// Returns the results as a text table.
std::string to_text(const ContactBench& bench);

/// Returns the hand's path that every benchmark with two meshes uses.
TouchPlan bench_plan(const TouchSettings& settings);

}  // namespace tandem::lab
