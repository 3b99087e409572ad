// Measurements of `tandem-lab bench contact` as values: for the command, for reproductions, and for tests.
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
  std::size_t points = 0;  ///< points of both shells together
  double spacing_m = 0;    ///< the wider spacing of the two
  double cell_m = 0;       ///< the larger cell of the two
  double build_s = 0;      ///< sum for both objects; counted once when they are the same
  double cache_load_s = 0;
  std::size_t memory_bytes = 0;
  TouchFigures ours;
  std::optional<TouchFigures> gimpact;
  double field_sample_ns = 0;    ///< time of one field sample: a lower bound for every method
  TimeQuantiles memory_copy_us;  ///< time to copy 256 KiB: the machine's own jitter
};

/// Figures of two objects, without a run. Their costs count once when both are the same object.
ContactBench describe(const TouchObject& a, const TouchObject& b);

boost::json::object to_json(const TouchFigures& figures);
boost::json::object to_json(const ContactBench& bench);
/// The figures as a table in text.
std::string to_text(const ContactBench& bench);

/// The hand's path in every benchmark with two meshes.
TouchPlan bench_plan(const TouchSettings& settings);

}  // namespace tandem::lab
