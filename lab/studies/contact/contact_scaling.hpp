// `tandem-lab bench contact-scaling`: checks that the cost of contact depends on the contact area and not on the number
// of triangles.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "lab/report/html_report.hpp"
#include "lab/studies/contact/touch_judgement.hpp"

namespace tandem::lab {

/// Results for one resolution of the mesh, which is in contact with a copy of itself.
struct ScalingRow {
  std::size_t triangles = 0;
  std::size_t points = 0;
  double spacing_m = 0;
  double cell_m = 0;
  double build_s = 0;
  TouchFigures figures;
};

/// Returns the check that the step time does not grow with the resolution: the 99th percentile for the finest mesh must
/// be similar to the one for `rows[reference]`, the mesh with its original resolution.
std::vector<Check> scaling_checks(std::span<const ScalingRow> rows, std::size_t reference);
HtmlReport scaling_report(const std::string& mesh_name, std::span<const ScalingRow> rows, std::size_t reference);

}  // namespace tandem::lab
