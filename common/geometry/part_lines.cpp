// Combines the solid and the sheet of a repaired mesh, and describes its parts as text.
#include <iomanip>
#include <sstream>

#include "common/base/units.hpp"
#include "common/geometry/mesh_repair.hpp"

namespace tandem::geometry {

TriangleMesh joined(TriangleMesh mesh, const TriangleMesh& other) {
  const auto first = static_cast<int>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), other.vertices.begin(), other.vertices.end());
  for (const auto& [a, b, c] : other.triangles) mesh.triangles.push_back({first + a, first + b, first + c});
  return mesh;
}

TriangleMesh all_of(const ContactMesh& mesh) {
  return joined(mesh.mesh, mesh.sheet);
}

std::vector<std::string> part_lines(const ContactMesh& mesh) {
  constexpr std::size_t kMaxLines = 10;
  std::vector<std::string> lines;
  for (const PartReport& part : mesh.parts) {
    if (lines.size() == kMaxLines) {
      lines.push_back("and " + counted(mesh.parts.size() - kMaxLines, "smaller part", "smaller parts"));
      break;
    }
    std::ostringstream line;
    line << (part.kind == SurfaceKind::kSolid ? "a solid"
             : part.parts == 1                ? "a sheet"
                                              : "sheets")
         << " of " << counted(part.triangles, "triangle", "triangles") << ": " << part.why;
    if (part.holes > 0) line << ", " << counted(part.holes, "hole", "holes");
    if (part.kind == SurfaceKind::kSolid) line << ", " << std::setprecision(3) << part.volume_m3 * 1e6 << " cm³";
    lines.push_back(line.str());
  }
  return lines;
}

}  // namespace tandem::geometry
