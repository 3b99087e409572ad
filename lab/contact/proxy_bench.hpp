// What `tandem-lab bench proxy` measures: a proxy that wanders over a mesh, against the loop that most programs would
// write first, both along the same path of the hand.
#pragma once

#include <cstdint>
#include <vector>

#include "common/contact/triangle_mesh.hpp"
#include "common/json/json.hpp"
#include "common/proxy/god_object.hpp"
#include "lab/contact/quantiles.hpp"

namespace tandem::lab {

/// Where the hand's point is, one place a tick.
///
/// Model   a point y wanders on an ellipsoid around the bounding box; the hand is drawn to the place 5 mm behind the
///         mesh's closest point to y, at no more than 0.2 m/s, through the inside too. It begins at y.
std::vector<Vec3> wandering_hand(const TriangleMesh& mesh, std::size_t steps);

/// What one loop did along a path.
struct ProxyRun {
  std::vector<Duration> times;
  std::vector<Vec3> ball_W;  ///< what is kept out of the mesh, or is not: its centre
  std::vector<Vec3> way_W;   ///< corners of the way of a ball that touches where the loop says that the hand touches
};

/// The god-object: both are its proxy.
ProxyRun run_god_object(const std::shared_ptr<const ProxyMesh>& mesh, const GodObjectSettings& settings,
                        const std::vector<Vec3>& hand, const Clock& clock);
/// The mesh's closest point by the bounding-volume tree, from scratch in every tick, pushing the hand's point away from
/// it: no history.
ProxyRun run_closest_point(const TriangleTree& tree, double radius_m, const std::vector<Vec3>& hand,
                           const Clock& clock);

/// Judged from places and triangles alone, without any of the loops' own code but the exact distance to a mesh.
struct ProxyFigures {
  TimeQuantiles loop_us;  ///< each tick as fast as in the fastest of kRounds equal runs
  double max_penetration_m = 0;
  std::uint64_t pop_throughs = 0;
};

/// Counts straight ways that cross a mesh, by trying every triangle that overlaps their extent in x.
class CrossingJudge {
 public:
  explicit CrossingJudge(const TriangleMesh& mesh);
  bool crosses(const Vec3& from, const Vec3& to) const;

 private:
  struct Triangle {
    double low_x;
    Vec3 a, b, c;
  };
  std::vector<Triangle> triangles_;  ///< by low_x
  double widest_m_ = 0;              ///< in x
};

/// In      runs  of the same loop and path, at least one
ProxyFigures figures_of(const std::vector<ProxyRun>& runs, const TriangleTree& tree, const CrossingJudge& judge,
                        double radius_m);
boost::json::object to_json(const ProxyFigures& figures);

}  // namespace tandem::lab
