// Everything that `tandem-lab bench contact` measures, as values: for the command, for reproductions, and for tests.
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
  std::size_t points = 0;  ///< of the shells of both
  double spacing_m = 0;    ///< the wider of both
  double cell_m = 0;       ///< the larger of both
  double build_s = 0;      ///< of both; once when they are the same
  double cache_load_s = 0;
  std::size_t memory_bytes = 0;
  TouchFigures ours;
  std::optional<TouchFigures> gimpact;
  double field_sample_ns = 0;    ///< what no method can beat here
  TimeQuantiles memory_copy_us;  ///< likewise
};

/// Figures of two objects, without a run. What they cost counts once when both are the same object.
ContactBench describe(const TouchObject& a, const TouchObject& b);

boost::json::object to_json(const TouchFigures& figures);
boost::json::object to_json(const ContactBench& bench);
/// A table for people.
std::string to_text(const ContactBench& bench);

/// How the tool meets the fixed thing in every benchmark with two meshes.
TouchPlan bench_plan(const TouchSettings& settings);

}  // namespace tandem::lab
