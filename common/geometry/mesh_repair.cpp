#include "common/geometry/mesh_repair.hpp"

#include <algorithm>
#include <functional>
#include <iomanip>
#include <numbers>
#include <optional>
#include <sstream>
#include <utility>

#include "common/base/units.hpp"
#include "common/geometry/repair/mesh_connectivity.hpp"
#include "common/geometry/repair/mesh_holes.hpp"
#include "common/geometry/repair/mesh_sides.hpp"
#include "common/geometry/repair/mesh_weld.hpp"
#include "common/geometry/triangle_tree.hpp"
#include "common/geometry/winding_number.hpp"

namespace tandem::geometry {
namespace {

/// Limit of coordinates. Larger ones would make squared areas overflow in single precision.
constexpr double kMaxCoordinate_m = 1e12;

// A part with holes counts as a solid if the triangles that would close its holes have less than this fraction of its
// surface area. Typical fractions are 1/3 to 1/2 for a cup, 1/10 for a section of pipe ten times as long as wide
// (neither is a solid), and 1/1000 for a scan.
constexpr double kHoleShare = 0.05;
// A part encloses no space if its volume is less than kRoomShare × area^1.5. For a hand-sized object, this corresponds
// to a thickness of 0.25 µm, the rounding error between two coincident surfaces. For a part with unpaired edges,
// kUnpairedRoomShare is used instead, so that a plate of 10 µm encloses no space, either.
constexpr double kRoomShare = 1e-6, kUnpairedRoomShare = 1e-4;

// Maximum number of closed parts whose nesting is determined by comparing all pairs. In the worst case, where each part
// contains the next one, this takes two seconds.
constexpr std::size_t kMaxParts = 5000;
constexpr int kMaxRounds = 8;

void check(const TriangleMesh& mesh) {
  if (mesh.triangles.empty()) throw MeshError("the mesh has no triangle: export its surface as triangles");
  const auto count = static_cast<int>(mesh.vertices.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (const int corner : mesh.triangles[i]) {
      if (corner >= 0 && corner < count) continue;
      throw MeshError("triangle " + std::to_string(i) + " uses vertex " + std::to_string(corner) + " of " +
                      std::to_string(count) + ": the file is damaged, export it again");
    }
  }
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const Vec3& p = mesh.vertices[v];
    if (is_finite(p) && p.cwiseAbs().maxCoeff() <= kMaxCoordinate_m) continue;
    const std::string vertex = "vertex " + std::to_string(v);
    if (!is_finite(p)) throw MeshError(vertex + " is not a finite number: the file is damaged, export it again");
    throw MeshError(vertex + " is more than 1e12 m from the origin: the file is damaged, or the scale is wrong");
  }
}

/// Measures of a part that determine whether it is a solid or a sheet.
struct PartMeasures {
  double area_m2 = 0;
  double volume_m3 = 0;  ///< enclosed volume; negative if the part is inside out
  /// Sum of the volumes of the tetrahedra between one vertex and each triangle, all taken as positive; 0 if all
  /// triangles are coplanar.
  double between_m3 = 0;
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity());
  Vec3 high = Vec3::Constant(-std::numeric_limits<double>::infinity());
};

PartMeasures measured(const TriangleMesh& mesh, const MeshPart& part) {
  PartMeasures measures;
  const Vec3& about = mesh.vertices[static_cast<std::size_t>(mesh.triangles[part.triangles.front()][0])];
  for (const int t : part.triangles) {
    const auto& corners = mesh.triangles[static_cast<std::size_t>(t)];
    const Vec3 doubled = doubled_area(mesh, static_cast<std::size_t>(t));
    measures.area_m2 += doubled.norm() / 2;
    const double volume_m3 = (mesh.vertices[static_cast<std::size_t>(corners[0])] - about).dot(doubled) / 6;
    measures.volume_m3 += volume_m3;
    measures.between_m3 += std::abs(volume_m3);
    for (const int corner : corners) {
      measures.low = measures.low.cwiseMin(mesh.vertices[static_cast<std::size_t>(corner)]);
      measures.high = measures.high.cwiseMax(mesh.vertices[static_cast<std::size_t>(corner)]);
    }
  }
  return measures;
}

bool has_no_room(double volume_m3, double area_m2, double share = kRoomShare) {
  return std::abs(volume_m3) < share * area_m2 * std::sqrt(area_m2);
}

/// Size of a hole, before it is closed.
struct HoleMeasures {
  double perimeter_m = 0;
  double area_m2 = 0;  ///< area of the triangles between the hole's border and the centre of that border
};

HoleMeasures measured(const TriangleMesh& mesh, const std::vector<int>& loop) {
  const auto at = [&](std::size_t i) -> const Vec3& {
    return mesh.vertices[static_cast<std::size_t>(loop[i % loop.size()])];
  };
  Vec3 middle = Vec3::Zero();
  for (std::size_t i = 0; i < loop.size(); ++i) middle += at(i) / static_cast<double>(loop.size());
  HoleMeasures measures;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    measures.perimeter_m += (at(i + 1) - at(i)).norm();
    measures.area_m2 += (at(i) - middle).cross(at(i + 1) - middle).norm() / 2;
  }
  return measures;
}

bool has_small_holes(const TriangleMesh& mesh, const MeshPart& part, double area_m2) {
  double holes = 0;
  for (const auto& loop : part.borders) {
    // The area of the hole is the smaller of two estimates: a disc with the hole's perimeter, and the triangles between
    // its border and centre. The disc is much too large for a jagged border or a slit, which has a long perimeter.
    const HoleMeasures hole = measured(mesh, loop);
    holes += std::min(hole.perimeter_m * hole.perimeter_m / (4 * std::numbers::pi), hole.area_m2);
  }
  return holes < kHoleShare * area_m2;
}

bool is_solid(const TriangleMesh& mesh, const MeshPart& part) {
  if (!part.is_orientable) return false;
  const PartMeasures measures = measured(mesh, part);
  return !has_no_room(measures.between_m3, measures.area_m2) && has_small_holes(mesh, part, measures.area_m2);
}

/// Determines which closed parts lie inside other closed parts, and which parts are inside out.
class Nesting {
 public:
  Nesting(TriangleMesh& mesh, const std::vector<MeshPart>& parts) : mesh_(mesh), parts_(parts) {
    for (const MeshPart& part : parts) measures_.push_back(measured(mesh, part));
    container_.assign(parts.size(), kNone);
    for (std::size_t outer = 0; outer < parts.size(); ++outer) find_inside(outer);
  }

  /// Reverses each inside-out part that is not inside another part. The parts inside it are reversed with it, so that
  /// cavities remain cavities.
  /// Out     number of inside-out parts that were reversed
  std::size_t turn_inside_out() {
    std::size_t turned = 0;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      if (!is_inside_out(i)) continue;
      ++turned;
      for (const int t : parts_[i].triangles) {
        auto& corners = mesh_.triangles[static_cast<std::size_t>(t)];
        std::swap(corners[1], corners[2]);
      }
    }
    return turned;
  }

  /// Returns whether the outermost part around this part is inside out. If no other part contains this part, it is the
  /// outermost part itself.
  bool is_inside_out(std::size_t part) const { return measures_[outermost(part)].volume_m3 < 0; }

  /// Returns the number of buried parts. A buried part has the same orientation as the part around it, so it is
  /// material inside material and not a cavity.
  std::size_t buried() const {
    std::size_t count = 0;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      if (container_[i] == kNone) continue;
      const auto around = static_cast<std::size_t>(container_[i]);
      if ((measures_[i].volume_m3 > 0) == (measures_[around].volume_m3 > 0)) ++count;
    }
    return count;
  }

 private:
  static constexpr int kNone = -1;

  void find_inside(std::size_t outer) {
    std::optional<TriangleTree> tree;
    for (std::size_t inner = 0; inner < parts_.size(); ++inner) {
      const PartMeasures& in = measures_[inner];
      const PartMeasures& out = measures_[outer];
      if (inner == outer || !(in.low.array() > out.low.array()).all() || !(in.high.array() < out.high.array()).all()) {
        continue;
      }
      if (!tree) tree.emplace(part_of(mesh_, parts_[outer].triangles));
      const auto corner = mesh_.triangles[static_cast<std::size_t>(parts_[inner].triangles.front())][0];
      const double distance = tree->signed_distance_m(mesh_.vertices[static_cast<std::size_t>(corner)]);
      if ((distance < 0) != (out.volume_m3 > 0)) continue;
      // Only the smallest part around this one is stored as its container.
      int& container = container_[inner];
      const bool is_closer =
          container == kNone ||
          std::abs(out.volume_m3) < std::abs(measures_[static_cast<std::size_t>(container)].volume_m3);
      if (is_closer) container = static_cast<int>(outer);
    }
  }

  std::size_t outermost(std::size_t part) const {
    while (container_[part] != kNone) part = static_cast<std::size_t>(container_[part]);
    return part;
  }

  TriangleMesh& mesh_;
  const std::vector<MeshPart>& parts_;
  std::vector<PartMeasures> measures_;
  std::vector<int> container_;
};

void close_holes(ContactMesh& result, std::vector<MeshPart>& parts) {
  std::size_t closed = 0;
  const std::size_t before = result.mesh.triangles.size();
  for (MeshPart& part : parts) {
    closed += part.borders.size();
    for (const auto& loop : part.borders) close_hole(result.mesh, part, loop);
    part.borders.clear();
  }
  if (closed == 0) return;
  result.notes.push_back(counted(closed, "hole", "holes") + " closed with " +
                         counted(result.mesh.triangles.size() - before, "triangle", "triangles"));
}

/// Closes slits, which are holes without an area. No surface is missing at a slit: it arises where a vertex lies on the
/// edge of a triangle that does not use this vertex.
void close_slits(ContactMesh& result, std::vector<MeshPart>& parts) {
  const double widest_m = weld_tolerance_m(result.mesh);
  std::size_t closed = 0;
  for (MeshPart& part : parts) {
    for (const auto& loop : part.borders) {
      const HoleMeasures hole = measured(result.mesh, loop);
      if (hole.area_m2 > widest_m * hole.perimeter_m / 2) continue;
      close_hole(result.mesh, part, loop);
      ++closed;
    }
  }
  if (closed == 0) return;
  result.notes.push_back(counted(closed, "slit", "slits") + " without width closed");
  // The triangles that close slits have no area. Welding removes them. At the vertex on the slit, it divides the
  // triangle on the opposite side of the slit. The notes of this welding would repeat earlier ones, so they are
  // discarded.
  std::vector<std::string> repeated;
  weld(result.mesh, repeated);
  parts = connect(result.mesh, repeated);
}

std::string note_of_sheet(const TriangleMesh& mesh, const std::vector<MeshPart>& parts) {
  std::size_t open = 0;
  std::optional<Vec3> first;
  for (const MeshPart& part : parts) {
    for (const auto& loop : part.borders) {
      open += loop.size();
      if (!first) first = mesh.vertices[static_cast<std::size_t>(loop.front())];
    }
  }
  if (!first && std::ranges::all_of(parts, &MeshPart::is_orientable)) {
    return "surface that lies on itself, with no room inside: felt as a plate from both sides";
  }
  if (!first) return "surface with one side only: felt as a plate from both sides";
  std::ostringstream note;
  note << "open surface (" << counted(open, "open edge", "open edges") << ", the first near (" << std::setprecision(6)
       << first->x() << ", " << first->y() << ", " << first->z() << ") m): felt as a plate from both sides";
  return note.str();
}

void note_turned(ContactMesh& result, std::size_t parts) {
  if (parts == 0) return;
  result.notes.push_back(counted(parts, "part was inside out and is turned", "parts were inside out and are turned"));
}

void turn_parts(ContactMesh& result, const std::vector<MeshPart>& parts) {
  Nesting nesting(result.mesh, parts);
  const std::size_t buried = nesting.buried();
  note_turned(result, nesting.turn_inside_out());
  if (buried > 0) {
    result.notes.push_back(counted(buried, "part lies inside another and is felt only there",
                                   "parts lie inside others and are felt only there"));
  }
}

bool is_within(const TriangleMesh& mesh, const MeshPart& part, const WindingNumber& around) {
  return std::ranges::all_of(part.triangles, [&](int t) {
    const int corner = mesh.triangles[static_cast<std::size_t>(t)][0];
    return std::abs(around.at(mesh.vertices[static_cast<std::size_t>(corner)])) > 0.5;
  });
}

/// Moves solids to `others` if they are inside out and lie within `others`, because they are cavities there. If there
/// are more than kMaxParts solids, moves all of them without this test.
void leave_cavities(TriangleMesh& mesh, std::vector<MeshPart>& solids, std::vector<MeshPart>& others) {
  std::vector<bool> stays(solids.size(), solids.size() > kMaxParts);
  if (solids.size() <= kMaxParts) {
    std::optional<WindingNumber> around;
    const Nesting nesting(mesh, solids);
    for (std::size_t i = 0; i < solids.size(); ++i) {
      if (!nesting.is_inside_out(i)) continue;
      if (!around) around.emplace(part_of(mesh, triangles_of(others)));
      stays[i] = is_within(mesh, solids[i], *around);
    }
  }
  std::vector<MeshPart> left;
  for (std::size_t i = 0; i < solids.size(); ++i) (stays[i] ? others : left).push_back(std::move(solids[i]));
  solids = std::move(left);
}

/// Moves the complete solids from `parts` to the result. A complete solid encloses a volume without the help of other
/// parts. Its holes are closed, it is oriented outwards, and it is reported.
/// These solids remain in `parts`:
/// * an inside-out solid within parts with unpaired edges, because it is a cavity there
/// * all solids, if there are more than kMaxParts and some parts have unpaired edges
std::vector<MeshPart> extract_solids(ContactMesh& result, std::vector<MeshPart>& parts) {
  const auto first = std::stable_partition(parts.begin(), parts.end(), [&](const MeshPart& part) {
    return part.is_unpaired || !is_solid(result.mesh, part);
  });
  std::vector<MeshPart> solids(std::make_move_iterator(first), std::make_move_iterator(parts.end()));
  parts.erase(first, parts.end());
  const bool is_unpaired = std::ranges::any_of(parts, &MeshPart::is_unpaired);
  if (solids.size() > kMaxParts && !is_unpaired) {
    throw MeshError("the mesh has " + std::to_string(solids.size()) + " closed parts; at most " +
                    std::to_string(kMaxParts) + " are possible: join them, or remove those that cannot be touched");
  }
  if (is_unpaired) leave_cavities(result.mesh, solids, parts);
  std::vector<std::size_t> holes;
  for (const MeshPart& part : solids) holes.push_back(part.borders.size());
  close_holes(result, solids);
  turn_parts(result, solids);
  for (std::size_t i = 0; i < solids.size(); ++i) {
    const PartMeasures measures = measured(result.mesh, solids[i]);
    result.parts.push_back({SurfaceKind::kSolid, solids[i].triangles.size(), 1, measures.volume_m3, holes[i],
                            holes[i] > 0 ? "closed but for small holes" : "closed"});
  }
  return solids;
}

/// The parts that are not complete solids, combined in one mesh, and the classification of their triangles.
struct Enclosed {
  TriangleMesh whole;  ///< all these parts in one mesh, in their order
  std::vector<Side> sides;
  TriangleMesh inner;
  TriangleMesh surface;
  std::vector<MeshPart> parts;  ///< parts of `surface`
};

Enclosed enclosed_by(const TriangleMesh& mesh, const std::vector<MeshPart>& others) {
  Enclosed enclosed;
  enclosed.whole = part_of(mesh, triangles_of(others));
  enclosed.sides = sides_of(enclosed.whole);
  enclosed.inner = part_of(enclosed.whole, inner_of(others, enclosed.sides));
  enclosed.surface = part_of(enclosed.whole, those_of(enclosed.sides, Side::kBorder));
  if (enclosed.surface.triangles.empty()) return enclosed;
  // Without the inner triangles, more edges have exactly two triangles and can be paired. The notes of this welding
  // would repeat earlier ones, so they are discarded.
  std::vector<std::string> repeated;
  weld(enclosed.surface, repeated);
  enclosed.parts = connect(enclosed.surface, repeated);
  return enclosed;
}

/// Returns for each part of `enclosed` whether it encloses no space. Such a part has an opening, or its two sides
/// coincide, although its triangles were classified as the border of a solid.
std::vector<bool> without_inside(const TriangleMesh& mesh, const std::vector<MeshPart>& solids,
                                 const Enclosed& enclosed) {
  std::vector<bool> are_open;
  for (const MeshPart& part : enclosed.parts) {
    const PartMeasures measures = measured(enclosed.surface, part);
    are_open.push_back(has_small_holes(enclosed.surface, part, measures.area_m2) &&
                       has_no_room(measures.volume_m3, measures.area_m2, kUnpairedRoomShare));
  }
  if (std::ranges::all_of(enclosed.parts, is_closed)) return are_open;
  const TriangleMesh all = joined(joined(enclosed.surface, enclosed.inner), part_of(mesh, triangles_of(solids)));
  const std::vector<double> shares = open_shares(enclosed.surface, enclosed.parts, all);
  for (std::size_t i = 0; i < shares.size(); ++i) are_open[i] = are_open[i] || shares[i] > kHoleShare;
  return are_open;
}

/// Returns the open parts of `others` and removes them from it. A part is open if without_inside() is true for most of
/// the area that it contributes to the border.
std::vector<MeshPart> extract_open(const TriangleMesh& mesh, const std::vector<MeshPart>& solids,
                                   std::vector<MeshPart>& others, const Enclosed& enclosed) {
  const std::vector<bool> are_open = without_inside(mesh, solids, enclosed);
  if (std::ranges::find(are_open, true) == are_open.end()) return {};
  std::vector<std::size_t> part_of_triangle;
  std::vector<double> borders_m2(others.size()), open_m2(others.size());
  for (std::size_t k = 0; k < others.size(); ++k) {
    for (std::size_t i = 0; i < others[k].triangles.size(); ++i) {
      const std::size_t t = part_of_triangle.size();
      if (enclosed.sides[t] == Side::kBorder) borders_m2[k] += doubled_area(enclosed.whole, t).norm() / 2;
      part_of_triangle.push_back(k);
    }
  }
  const TriangleTree tree(enclosed.whole);
  for (std::size_t i = 0; i < enclosed.parts.size(); ++i) {
    if (!are_open[i]) continue;
    for (const int triangle : enclosed.parts[i].triangles) {
      const auto t = static_cast<std::size_t>(triangle);
      const auto& [a, b, c] = corners_of(enclosed.surface, t);
      const auto nearest = static_cast<std::size_t>(tree.closest((a + b + c) / 3).triangle);
      open_m2[part_of_triangle[nearest]] += doubled_area(enclosed.surface, t).norm() / 2;
    }
  }
  std::vector<MeshPart> open, left;
  for (std::size_t k = 0; k < others.size(); ++k) {
    (open_m2[k] > borders_m2[k] / 2 ? open : left).push_back(std::move(others[k]));
  }
  others = std::move(left);
  return open;
}

void report_sheet(ContactMesh& result, const std::vector<MeshPart>& parts) {
  PartReport sheets{SurfaceKind::kSheet, 0, parts.size(), 0, 0, "open"};
  for (const MeshPart& part : parts) {
    sheets.triangles += part.triangles.size();
    sheets.holes += part.borders.size();
  }
  result.notes.push_back(note_of_sheet(result.mesh, parts));
  result.parts.push_back(sheets);
}

/// Converts the parts that are not complete solids to a sheet.
void keep_as_sheet(ContactMesh& result, const std::vector<MeshPart>& solids, const std::vector<MeshPart>& others) {
  report_sheet(result, others);
  if (solids.empty()) {
    result.sheet = std::exchange(result.mesh, {});
    return;
  }
  result.sheet = part_of(result.mesh, triangles_of(others));
  result.mesh = part_of(result.mesh, triangles_of(solids));
}

/// Divides the parts that are not complete solids into a solid and a sheet. Triangles with the inside on exactly one
/// side become the solid. Triangles with the inside on neither side, and all triangles of parts with an opening, become
/// the sheet.
void divide_by_winding(ContactMesh& result, const std::vector<MeshPart>& solids, std::vector<MeshPart> others) {
  Enclosed enclosed = enclosed_by(result.mesh, others);
  std::vector<MeshPart> open_parts;
  // The search for open parts is repeated, because an open part may have covered the opening of another part. When it
  // is removed, that part is open, too.
  for (int round = 0; round < kMaxRounds; ++round) {
    std::vector<MeshPart> taken = extract_open(result.mesh, solids, others, enclosed);
    if (taken.empty()) break;
    std::ranges::move(taken, std::back_inserter(open_parts));
    if (others.empty()) return keep_as_sheet(result, solids, open_parts);
    enclosed = enclosed_by(result.mesh, others);
  }
  if (!open_parts.empty()) report_sheet(result, open_parts);
  std::vector<int> open = those_of(enclosed.sides, Side::kOutside);
  const std::vector<int> border = those_of(enclosed.sides, Side::kBorder);
  const std::size_t inner = enclosed.sides.size() - border.size() - open.size();
  if (inner > 0) {
    result.notes.push_back(
        counted(inner, "triangle inside the solid is left out", "triangles inside the solid are left out"));
  }
  if (!border.empty()) {
    // Inside-out parts are reversed one by one only if they are closed. A part that is not closed continues in inner
    // triangles, and must keep its orientation relative to these.
    std::erase_if(enclosed.parts, std::not_fn(is_closed));
    if (enclosed.parts.size() <= kMaxParts) {
      note_turned(result, Nesting(enclosed.surface, enclosed.parts).turn_inside_out());
    }
    const double volume = volume_m3(enclosed.surface);
    if (volume < 0) {
      // Parts that are not closed are reversed together, along with the inner triangles that close them.
      for (TriangleMesh* mesh : {&enclosed.surface, &enclosed.inner}) {
        for (auto& corners : mesh->triangles) std::swap(corners[1], corners[2]);
      }
    }
    if (has_no_room(volume, area_m2(enclosed.surface))) {
      open.insert(open.end(), border.begin(), border.end());
      enclosed.surface = {};
    } else {
      result.parts.push_back(
          {SurfaceKind::kSolid, border.size(), 1, std::abs(volume), 0, "enclosed, by the winding number"});
    }
  }
  if (!open.empty()) {
    result.parts.push_back({SurfaceKind::kSheet, open.size(), 1, 0, 0, "has the outside on both sides"});
  }
  result.inner = std::move(enclosed.inner);
  result.sheet = joined(part_of(enclosed.whole, open), part_of(result.mesh, triangles_of(open_parts)));
  result.mesh = joined(part_of(result.mesh, triangles_of(solids)), enclosed.surface);
}

}  // namespace

ContactMesh repaired(const TriangleMesh& mesh) {
  check(mesh);
  ContactMesh result;
  result.mesh = mesh;
  weld(result.mesh, result.notes);
  if (result.mesh.triangles.empty()) {
    throw MeshError("no triangle of the mesh has an area: its " +
                    counted(mesh.triangles.size(), "triangle is a point or a line", "triangles are points or lines") +
                    "; is the scale right?");
  }
  std::vector<MeshPart> parts = connect(result.mesh, result.notes);
  close_slits(result, parts);
  const std::vector<MeshPart> solids = extract_solids(result, parts);
  if (std::ranges::any_of(parts, &MeshPart::is_unpaired)) {
    divide_by_winding(result, solids, std::move(parts));
  } else if (!parts.empty()) {
    keep_as_sheet(result, solids, parts);
  }
  std::ranges::stable_sort(result.parts, std::greater<>(), &PartReport::triangles);
  if (!result.mesh.triangles.empty()) return result;
  result.kind = SurfaceKind::kSheet;
  result.mesh = std::exchange(result.sheet, {});
  return result;
}

}  // namespace tandem::geometry
