// `tandem-lab bench contact-scaling`: the cost of contact must follow the area in contact, not the size of the meshes.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "lab/report/check.hpp"
#include "lab/studies/contact/touch_judgement.hpp"

namespace tandem::lab {

/// One resolution of the mesh in contact with itself.
struct ScalingRow {
  std::size_t triangles = 0;
  std::size_t points = 0;
  double spacing_m = 0;
  double cell_m = 0;
  double build_s = 0;
  TouchFigures figures;
};

/// Compares the p99 of the finest mesh with the p99 of mesh number `reference`, the mesh as given.
std::vector<Check> scaling_checks(std::span<const ScalingRow> rows, std::size_t reference);
std::string scaling_report_html(const std::string& mesh_name, std::span<const ScalingRow> rows, std::size_t reference);

}  // namespace tandem::lab
