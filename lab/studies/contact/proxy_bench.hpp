// What `tandem-lab bench proxy` measures: a proxy that wanders over a mesh, against the loop that most programs would
// write first, both along the same path of the hand.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "common/base/json.hpp"
#include "common/geometry/triangle_mesh.hpp"
#include "common/haptics/proxy/god_object.hpp"
#include "lab/studies/contact/quantiles.hpp"

namespace tandem::lab {

/// Where the hand's point is, one place a tick.
///
/// Model   a point y wanders on an ellipsoid around the bounding box; the hand is drawn to the place 5 mm behind the
///         mesh's closest point to y, at no more than 0.2 m/s, through the inside too. It begins at y.
std::vector<Vec3> wandering_hand(const geometry::TriangleMesh& mesh, std::size_t steps);

/// What one loop did along a path.
struct ProxyRun {
  std::vector<Duration> times;
  std::vector<Vec3> ball_W;  ///< centre of the ball where the loop says that it touches: one a tick
  std::vector<Vec3> way_W;   ///< corners of its way
};

/// The god-object: the ball is its proxy.
ProxyRun run_god_object(const std::shared_ptr<const haptics::ProxyMesh>& mesh,
                        const haptics::GodObjectSettings& settings, const std::vector<Vec3>& hand, const Clock& clock);
/// The mesh's closest point by the bounding-volume tree, from scratch in every tick: no history. The ball is beside it,
/// on the side that the surface faces.
ProxyRun run_closest_point(const geometry::TriangleTree& tree, double radius_m, const std::vector<Vec3>& hand,
                           const Clock& clock);

/// Judged from places and triangles alone, without any of the loops' own code but the exact distance to a mesh.
struct ProxyFigures {
  TimeQuantiles loop_us;           ///< over all ticks of all runs
  double max_penetration_m = 0;    ///< of the ball: radius less the signed distance of its centre
  std::uint64_t pop_throughs = 0;  ///< straight pieces of the way that cross the mesh
};

/// How far the god-object is from where it would be if it had more time in a tick.
struct ProxyLag {
  double held_back_share = 0;  ///< of the ticks that end with kProxyHeldBack
  double p50_m = 0;            ///< distance from the place where it comes to rest if the hand holds still
  double p99_m = 0;
  double max_m = 0;
};
/// Every kLagStride-th tick is followed to its rest, for at most kMaxSettling updates. Reads no clock.
ProxyLag lag_of(const std::shared_ptr<const haptics::ProxyMesh>& mesh, const haptics::GodObjectSettings& settings,
                const std::vector<Vec3>& hand);
/// How deep the hand's point is at most.
double depth_of(const std::vector<Vec3>& hand, const geometry::TriangleTree& tree);

/// In      runs  of the same loop and path, at least one; leave out a first one, which finds caches cold
ProxyFigures figures_of(const std::vector<ProxyRun>& runs, const geometry::TriangleMesh& mesh, double radius_m);
boost::json::object to_json(const ProxyFigures& figures);
boost::json::object to_json(const ProxyLag& lag);

}  // namespace tandem::lab
