#include "common/contact/points/shell_sampling.hpp"

#include <array>
#include <limits>
#include <numbers>
#include <span>

#include "common/base/random.hpp"
#include "common/contact/contact_shape_options.hpp"

namespace tandem::contact {
namespace {

// Minimum separation of samples, in spacings. A value closer to 1 gives fewer samples, but closing the last gaps takes
// longer.
constexpr double kSeparation = 0.9;
// Upper bound of the mean number of samples in a square whose side is the least separation. If random samples are added
// until no more fit, there are 0.70 (the jamming density of random sequential discs).
constexpr double kSamplesPerSquare = 0.75;
// Triangles are divided into patches, and a patch into pieces. All pieces of a patch are compared with the same nearby
// samples. kPatch is the longest side of a patch, in spacings. The corners are within 2/3 of this side from the
// centroid, because no median is longer than the longest side.
constexpr float kPatch = 1.5F;
constexpr double kPatchReach = 1 + 2 * kPatch / 3;
// The spacing is reduced by this factor, so that rounding of single-precision coordinates leaves no part of the surface
// uncovered.
constexpr double kReachRounding = 1 - 1e-4;

// Maximum number of halvings of a piece. After n halvings, its longest side has at most √3 · 2^(−n/2) of its length.
// After 14 halvings, a piece of a patch is smaller than 1/30 of a spacing, so a sample covers it. A piece that is too
// small to be divided in single precision counts as covered.
constexpr int kMaxHalvings = 14;

// Lower limit of the option max_points. With fewer points, no spacing would be wide enough: even the corners of a
// simple body could exceed the limit.
constexpr std::size_t kFewestPoints = 1000;

using Corners = std::array<Eigen::Vector3f, 3>;

/// A piece of a triangle. Pieces are halved across their longest side.
struct Piece {
  Corners corner;
  int longest = 0;
  float longest_squared = 0;
  int halvings = 0;

  explicit Piece(const Corners& corners, int halved = 0) : corner(corners), halvings(halved) {
    for (int side = 0; side < 3; ++side) {
      const float squared = (at(side + 1) - at(side)).squaredNorm();
      if (squared <= longest_squared) continue;
      longest_squared = squared;
      longest = side;
    }
  }
  const Eigen::Vector3f& at(int index) const { return corner[static_cast<std::size_t>(index % 3)]; }
  Eigen::Vector3f centroid() const { return (corner[0] + corner[1] + corner[2]) / 3; }
  float radius() const {
    const Eigen::Vector3f middle = centroid();
    float squared = 0;
    for (const Eigen::Vector3f& p : corner) squared = std::max(squared, (p - middle).squaredNorm());
    return std::sqrt(squared);
  }
  float area() const { return 0.5F * (corner[1] - corner[0]).cross(corner[2] - corner[0]).norm(); }

  std::array<Piece, 2> halves() const {
    const Eigen::Vector3f middle = (at(longest) + at(longest + 1)) / 2;
    return {Piece({at(longest), middle, at(longest + 2)}, halvings + 1),
            Piece({middle, at(longest + 1), at(longest + 2)}, halvings + 1)};
  }
};

Piece whole(const geometry::TriangleMesh& mesh, std::size_t triangle) {
  Corners corners;
  for (std::size_t i = 0; i < 3; ++i) {
    corners[i] = mesh.vertices[static_cast<std::size_t>(mesh.triangles[triangle][i])].cast<float>();
  }
  return Piece(corners);
}

bool is_compatible(const geometry::SurfaceSample& sample, const Eigen::Vector3f& normal) {
  return sample.normal_S.dot(normal) > 0;
}

/// Cuts a long and narrow triangle across its length. The pieces are about as long as the larger of `longest` and their
/// width. Halving alone would make many more pieces, each nearly as narrow as the triangle.
void append_slices(const Piece& triangle, float longest, std::vector<Piece>& pieces) {
  const float length = std::sqrt(triangle.longest_squared);
  const float height = 2 * triangle.area() / length;
  if (length <= longest || height > length / 4) {
    pieces.push_back(triangle);
    return;
  }
  const Eigen::Vector3f& from = triangle.at(triangle.longest);
  const Eigen::Vector3f& to = triangle.at(triangle.longest + 1);
  const Eigen::Vector3f& top = triangle.at(triangle.longest + 2);
  const Eigen::Vector3f foot = from + (to - from) * ((top - from).dot(to - from) / triangle.longest_squared);
  for (const Eigen::Vector3f& tip : {from, to}) {
    const float slices = std::ceil((tip - foot).norm() / std::max(height, 0.7F * longest));
    for (float i = 0; i < slices; ++i) {
      const Eigen::Vector3f near_foot = foot + (tip - foot) * (i / slices);
      const Eigen::Vector3f far_foot = foot + (tip - foot) * ((i + 1) / slices);
      const Eigen::Vector3f near_top = top + (tip - top) * (i / slices);
      const Eigen::Vector3f far_top = top + (tip - top) * ((i + 1) / slices);
      pieces.emplace_back(Corners{near_foot, far_foot, near_top});
      if (i + 1 < slices) pieces.emplace_back(Corners{near_top, far_foot, far_top});
    }
  }
}

/// Divides a triangle into pieces that are no longer than `longest`, and calls visit(piece) for each.
template <typename Visit>
void visit_patches(const Piece& triangle, float longest, std::vector<Piece>& stack, Visit&& visit) {
  append_slices(triangle, longest, stack);
  // This number of halvings suffices (kMaxHalvings explains why). A piece that is still too long is so small that
  // rounding prevents further division.
  const float ratio = std::max(1.0F, std::sqrt(triangle.longest_squared) / longest);
  const int most_halvings = 3 + static_cast<int>(std::ceil(2 * std::log2(ratio)));
  while (!stack.empty()) {
    const Piece piece = stack.back();
    stack.pop_back();
    if (piece.longest_squared <= longest * longest || piece.halvings >= most_halvings) {
      visit(piece);
    } else {
      for (const Piece& half : piece.halves()) stack.push_back(half);
    }
  }
}

class Spreader {
 public:
  Spreader(const geometry::SurfaceTopology& surface, double spacing_m, std::size_t max_samples)
      : surface_(surface),
        reach_(static_cast<float>(spacing_m * kReachRounding)),
        apart_(static_cast<float>(spacing_m * kSeparation)),
        max_samples_(max_samples),
        grid_(spacing_m * kPatchReach) {}

  geometry::SampleGrid& grid() { return grid_; }

  /// Samples the surface until it is covered.
  /// Out     false if more than `max_samples` samples would be needed
  bool cover(const std::function<void(double)>& progress) {
    const std::size_t count = surface_.mesh.triangles.size();
    for (std::size_t i = 0; i < count; ++i) {
      if (i % 16384 == 0 && progress) progress(static_cast<double>(i) / static_cast<double>(count));
      const Eigen::Vector3f normal = surface_.face_normals[i].cast<float>();
      if (normal.isZero()) continue;
      visit_patches(whole(surface_.mesh, i), kPatch * reach_, stack_,
                    [&](const Piece& patch) { cover_patch(patch, normal); });
      if (grid_.samples().size() > max_samples_) return false;
    }
    return true;
  }

  /// Adds bumps: vertices, and points of long edges, that protrude by more than `height_m` from the samples. Bumps are
  /// added in the order of decreasing height, until the limit of samples is reached. A bump is omitted if a feature
  /// nearer than `apart_m` protrudes at least as far.
  void add_bumps(std::size_t sharp_count, double height_m, double apart_m) {
    sharp_count_ = sharp_count;
    smooth_end_ = grid_.samples().size();
    std::vector<Bump> bumps = find_bumps(static_cast<float>(height_m), apart_m);
    std::stable_sort(bumps.begin(), bumps.end(), [](const Bump& a, const Bump& b) { return a.height > b.height; });
    for (const Bump& bump : bumps) {
      if (4 * grid_.samples().size() >= 5 * max_samples_) return;
      if (!is_represented(bump.sample, static_cast<float>(height_m), static_cast<float>(apart_m))) {
        grid_.add(bump.sample);
      }
    }
  }

  bool is_feature(std::size_t index) const { return index < sharp_count_ || index >= smooth_end_; }

 private:
  void cover_patch(const Piece& patch, const Eigen::Vector3f& normal) {
    const Eigen::Vector3f middle = patch.centroid();
    const float reach = reach_ + patch.radius();
    near_.clear();
    bool is_covered = false;
    grid_.visit_near(middle, [&](std::uint32_t, const geometry::SurfaceSample& sample) {
      if ((sample.p_S - middle).squaredNorm() > reach * reach || !is_compatible(sample, normal)) return;
      near_.push_back(sample.p_S);
      is_covered = is_covered || is_within_reach(patch, sample.p_S);
    });
    if (!is_covered) cover_piece(patch, normal, kMaxHalvings);
  }

  void cover_piece(const Piece& piece, const Eigen::Vector3f& normal, int halvings_left) {
    if (grid_.samples().size() > max_samples_) return;
    const Eigen::Vector3f dart = random_point(piece);
    bool is_free = true;
    for (const Eigen::Vector3f& p : near_) {
      if (is_within_reach(piece, p)) return;
      is_free = is_free && (p - dart).squaredNorm() >= apart_ * apart_;
    }
    if (is_free) {
      grid_.add({dart, normal});
      near_.push_back(dart);
      if (is_within_reach(piece, dart)) return;
    }
    if (halvings_left == 0) return;
    for (const Piece& half : piece.halves()) cover_piece(half, normal, halvings_left - 1);
  }

  struct Bump {
    geometry::SurfaceSample sample;
    float height;
  };

  std::vector<Bump> find_bumps(float height, double step_m) {
    std::vector<Bump> bumps;
    const auto add_if_missing = [&](const Vec3& p, const Vec3& normal) {
      const geometry::SurfaceSample sample{p.cast<float>(), normal.cast<float>()};
      if (sample.normal_S.isZero()) return;
      const float found = height_of(sample);
      if (found > height) bumps.push_back({sample, found});
    };
    for (std::size_t v = 0; v < surface_.mesh.vertices.size(); ++v) {
      add_if_missing(surface_.mesh.vertices[v], surface_.vertex_normals[v]);
    }
    // Between its ends, an edge protrudes from samples at the given spacing by at most spacing × sin(half its fold
    // angle). Edges that fold less need no points.
    const double least_fold = 2 * std::asin(std::min(1.0F, height / reach_));
    for (const geometry::MeshEdge& edge : surface_.edges) {
      const Vec3 along = surface_.vertex(edge.b) - surface_.vertex(edge.a);
      const double pieces = std::ceil(along.norm() / step_m);
      if (pieces < 2 || surface_.fold_rad(edge) < least_fold) continue;
      const Vec3 normal = surface_.edge_normal(edge);
      for (double i = 1; i < pieces; ++i) add_if_missing(surface_.vertex(edge.a) + along * (i / pieces), normal);
    }
    return bumps;
  }

  /// Returns the height of a point along its normal above the nearby samples. It is the larger of two values:
  /// 1. Height above all samples within one spacing. Without such a point, contact with a flat body would be found too
  ///    late.
  /// 2. Height above three quarters of the samples at about one spacing. Without such a point, a tip could enter
  ///    another body between that body's samples.
  float height_of(const geometry::SurfaceSample& point) {
    const float ring_inside = 0.5F * reach_;
    const float ring_outside = 1.25F * reach_;
    float above_all = std::numeric_limits<float>::infinity();
    ring_drops_.clear();
    grid_.visit_near(point.p_S, [&](std::uint32_t, const geometry::SurfaceSample& sample) {
      const Eigen::Vector3f to_sample = sample.p_S - point.p_S;
      const float squared = to_sample.squaredNorm();
      if (squared > ring_outside * ring_outside || !is_compatible(sample, point.normal_S)) return;
      const float drop = -point.normal_S.dot(to_sample);
      if (squared <= reach_ * reach_) above_all = std::min(above_all, drop);
      if (squared >= ring_inside * ring_inside) ring_drops_.push_back(drop);
    });
    if (ring_drops_.empty()) return above_all;
    const auto most = ring_drops_.begin() + static_cast<std::ptrdiff_t>(ring_drops_.size() / 4);
    std::nth_element(ring_drops_.begin(), most, ring_drops_.end());
    return std::max(above_all, *most);
  }

  bool is_represented(const geometry::SurfaceSample& bump, float height, float apart) const {
    bool is_found = false;
    grid_.visit_near(bump.p_S, [&](std::uint32_t index, const geometry::SurfaceSample& sample) {
      const Eigen::Vector3f to_sample = sample.p_S - bump.p_S;
      is_found = is_found || (is_feature(index) && to_sample.squaredNorm() < apart * apart &&
                              is_compatible(sample, bump.normal_S) && bump.normal_S.dot(to_sample) >= -height);
    });
    return is_found;
  }

  bool is_within_reach(const Piece& piece, const Eigen::Vector3f& p) const {
    const float squared = reach_ * reach_;
    return (piece.corner[0] - p).squaredNorm() <= squared && (piece.corner[1] - p).squaredNorm() <= squared &&
           (piece.corner[2] - p).squaredNorm() <= squared;
  }

  Eigen::Vector3f random_point(const Piece& piece) {
    float u = static_cast<float>(random_.next_u32() >> 8U) * 0x1.0p-24F;
    float v = static_cast<float>(random_.next_u32() >> 8U) * 0x1.0p-24F;
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    return piece.corner[0] + u * (piece.corner[1] - piece.corner[0]) + v * (piece.corner[2] - piece.corner[0]);
  }

  const geometry::SurfaceTopology& surface_;
  float reach_;
  float apart_;
  std::size_t max_samples_;
  geometry::SampleGrid grid_;
  std::vector<Piece> stack_;
  std::vector<Eigen::Vector3f> near_;  // samples that may cover the current patch
  std::vector<float> ring_drops_;
  std::size_t sharp_count_ = 0;     // number of sharp features; they are the first samples
  std::size_t smooth_end_ = 0;      // start of the bumps; they are the last samples
  Random random_{0x7368656C6CULL};  // constant seed: the same mesh always gives the same samples
};

/// Divides the area of the surface among its samples: each piece of the surface belongs to the nearest sample whose
/// normal has about the same direction. Most of the area of a sample on a sharp edge or corner is moved to new samples
/// on the adjoining faces.
class Shares {
 public:
  /// In      sharp_count  number of leading `samples` on sharp edges and corners
  Shares(const geometry::SurfaceTopology& surface, std::span<const geometry::SurfaceSample> samples,
         std::size_t sharp_count, double spacing_m)
      : surface_(surface),
        spacing_(static_cast<float>(spacing_m)),
        grid_(spacing_m * kPatchReach),
        areas_(samples.size(), 0.0),
        sides_(sharp_count) {
    for (const geometry::SurfaceSample& sample : samples) grid_.add(sample);
  }

  void divide(SpreadSamples& spread) {
    for (std::size_t i = 0; i < surface_.mesh.triangles.size(); ++i) {
      const Eigen::Vector3f normal = surface_.face_normals[i].cast<float>();
      if (normal.isZero()) continue;
      visit_patches(whole(surface_.mesh, i), kPatch * spacing_, stack_,
                    [&](const Piece& patch) { divide_patch(patch, normal); });
    }
    give_to_the_empty();
    spread.areas_m2.assign(areas_.begin(), areas_.end());
    for (std::size_t i = 0; i < sides_.size(); ++i) add_sides(i, spread);
  }

 private:
  // Longest side of the pieces of surface that are assigned to samples, in spacings.
  static constexpr float kGrain = 0.25F;
  // Fraction of its area that a sample on a sharp edge keeps. With this value, a box pressed down on an edge has the
  // force of an elastic foundation on its faces.
  static constexpr double kEdgeShare = 0.15;
  // Limits of the cosine between two normals. kSameSide: faces with a larger cosine count as one side of a sample.
  // kSharp: a sample is sharp if two of its sides have a smaller cosine.
  static constexpr float kSameSide = 0.98F, kSharp = 0.5F;

  struct Owner {
    Eigen::Vector3f p_S;
    std::uint32_t index;
  };
  /// A side of a sharp sample: the part of its area that belongs to faces with nearly the same normal.
  struct Side {
    Eigen::Vector3f normal_S;
    double area_m2 = 0;
    Vec3 moment = Vec3::Zero();  ///< first moment of the area
  };

  /// Moves most of a sharp sample's area to new samples, one in the middle of each side. If the edge kept the whole
  /// area, two errors would arise. The area of all its sides would press although only one side is in contact. At a
  /// tilted edge, the area would press too early.
  void add_sides(std::size_t index, SpreadSamples& spread) {
    if (!is_sharp(sides_[index])) return;
    double all_m2 = 0;
    for (const Side& side : sides_[index]) all_m2 += side.area_m2;
    if (!(all_m2 > 0)) return;
    const double scale = (1 - kEdgeShare) * areas_[index] / all_m2;
    for (const Side& side : sides_[index]) {
      if (!(side.area_m2 > 0)) continue;
      spread.samples.push_back({(side.moment / side.area_m2).cast<float>(), side.normal_S});
      spread.areas_m2.push_back(static_cast<float>(scale * side.area_m2));
    }
    spread.areas_m2[index] = static_cast<float>(kEdgeShare * areas_[index]);
  }

  void divide_patch(const Piece& patch, const Eigen::Vector3f& normal) {
    const Eigen::Vector3f middle = patch.centroid();
    const float reach = spacing_ + patch.radius();
    owners_.clear();
    grid_.visit_near(middle, [&](std::uint32_t index, const geometry::SurfaceSample& sample) {
      if ((sample.p_S - middle).squaredNorm() <= reach * reach && is_compatible(sample, normal)) {
        owners_.push_back({sample.p_S, index});
      }
    });
    if (!owners_.empty()) divide_piece(patch, normal, kMaxHalvings);
  }

  void divide_piece(const Piece& piece, const Eigen::Vector3f& normal, int halvings_left) {
    if (halvings_left > 0 && piece.longest_squared > kGrain * kGrain * spacing_ * spacing_) {
      for (const Piece& half : piece.halves()) divide_piece(half, normal, halvings_left - 1);
      return;
    }
    const Eigen::Vector3f middle = piece.centroid();
    std::uint32_t nearest = 0;
    float least = std::numeric_limits<float>::infinity();
    for (const Owner& owner : owners_) {
      const float squared = (owner.p_S - middle).squaredNorm();
      if (squared >= least) continue;
      least = squared;
      nearest = owner.index;
    }
    areas_[nearest] += piece.area();
    if (nearest < sides_.size()) add_to_side(sides_[nearest], piece, normal);
  }

  static bool is_sharp(const std::vector<Side>& sides) {
    for (const Side& a : sides) {
      for (const Side& b : sides) {
        if (a.normal_S.dot(b.normal_S) < kSharp) return true;
      }
    }
    return false;
  }

  static void add_to_side(std::vector<Side>& sides, const Piece& piece, const Eigen::Vector3f& normal) {
    auto side = std::ranges::find_if(sides, [&](const Side& one) { return one.normal_S.dot(normal) > kSameSide; });
    if (side == sides.end()) side = sides.insert(side, Side{.normal_S = normal, .area_m2 = 0, .moment = Vec3::Zero()});
    side->area_m2 += piece.area();
    side->moment += piece.area() * piece.centroid().cast<double>();
  }

  /// Gives each sample without area half of the area of its nearest neighbour, so that each sample has a force.
  void give_to_the_empty() {
    const auto samples = grid_.samples();
    for (std::size_t i = 0; i < areas_.size(); ++i) {
      if (areas_[i] > 0) continue;
      std::size_t giver = i;
      float least = std::numeric_limits<float>::infinity();
      grid_.visit_near(samples[i].p_S, [&](std::uint32_t index, const geometry::SurfaceSample& sample) {
        const float squared = (sample.p_S - samples[i].p_S).squaredNorm();
        if (squared >= least || !(areas_[index] > 0)) return;
        least = squared;
        giver = index;
      });
      areas_[giver] /= 2;
      areas_[i] = areas_[giver];
    }
  }

  const geometry::SurfaceTopology& surface_;
  float spacing_;
  geometry::SampleGrid grid_;
  std::vector<double> areas_;
  std::vector<std::vector<Side>> sides_;  ///< sides of the sharp samples
  std::vector<Piece> stack_;
  std::vector<Owner> owners_;
};

}  // namespace

SpreadSamples spread_samples(const geometry::SurfaceTopology& surface, const ContactShapeOptions& options,
                             const std::function<void(double)>& progress) {
  // Feature samples have the spacing of the options, unless they alone would need more than half of all points.
  double feature_spacing = options.feature_spacing_m;
  const double feature_angle_rad = options.feature_angle_deg * std::numbers::pi / 180;
  const std::size_t max_points = std::max(options.max_points, kFewestPoints);
  std::vector<geometry::SurfaceSample> sharp = geometry::sharp_samples(surface, feature_angle_rad, feature_spacing);
  while (sharp.size() > max_points / 2) {
    feature_spacing *= 1.5;
    sharp = geometry::sharp_samples(surface, feature_angle_rad, feature_spacing);
  }
  const double budget = static_cast<double>(max_points - sharp.size());
  const double narrowest = std::sqrt(kSamplesPerSquare * area_m2(surface.mesh) / budget) / kSeparation;
  for (double spacing = std::max(options.spacing_m, narrowest);; spacing *= 1.1) {
    Spreader spreader(surface, spacing, max_points);
    for (const geometry::SurfaceSample& sample : sharp) spreader.grid().add(sample);
    if (!spreader.cover(progress)) continue;
    spreader.add_bumps(sharp.size(), options.feature_height_m, feature_spacing);
    SpreadSamples spread;
    spread.samples.assign(spreader.grid().samples().begin(), spreader.grid().samples().end());
    for (std::size_t i = 0; i < spread.samples.size(); ++i) spread.is_feature.push_back(spreader.is_feature(i));
    Shares(surface, spread.samples, sharp.size(), spacing).divide(spread);
    spread.is_feature.resize(spread.samples.size(), false);
    spread.spacing_m = spacing;
    return spread;
  }
}

}  // namespace tandem::contact
