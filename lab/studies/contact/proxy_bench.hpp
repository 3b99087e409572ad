// Measurements of `tandem-lab bench proxy`: a proxy that moves over a mesh, compared with a simple closest-point loop
// along the same path of the hand.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "common/base/json.hpp"
#include "common/geometry/triangle_mesh.hpp"
#include "common/haptics/proxy/god_object.hpp"
#include "lab/studies/contact/quantiles.hpp"

namespace tandem::lab {

/// Positions of the hand's point, one a tick.
///
/// Model   a point y wanders on an ellipsoid around the bounding box; the hand moves towards the point 5 mm behind the
///         mesh's closest point to y, at no more than 0.2 m/s, also through the inside. It begins at y.
std::vector<Vec3> wandering_hand(const geometry::TriangleMesh& mesh, std::size_t steps);

/// Results of one loop along a path.
struct ProxyRun {
  std::vector<Duration> times;
  std::vector<Vec3> ball_W;  ///< centre of the displayed ball, one a tick
  std::vector<Vec3> way_W;   ///< corners of the ball's path
};

/// The god-object: the ball is its proxy.
ProxyRun run_god_object(const std::shared_ptr<const haptics::ProxyMesh>& mesh,
                        const haptics::GodObjectSettings& settings, const std::vector<Vec3>& hand, const Clock& clock);
/// The mesh's closest point from the bounding-volume tree, computed from scratch in every tick. The ball touches it on
/// the side that the surface faces.
ProxyRun run_closest_point(const geometry::TriangleTree& tree, double radius_m, const std::vector<Vec3>& hand,
                           const Clock& clock);

/// Figures from positions and triangles alone. Only the exact distance to a mesh is shared with the loops under test.
struct ProxyFigures {
  TimeQuantiles loop_us;           ///< over all ticks of all runs
  double max_penetration_m = 0;    ///< largest radius less the signed distance of the ball's centre
  std::uint64_t pop_throughs = 0;  ///< straight pieces of the path that cross the mesh
};

/// Lag of the god-object: its distance from the position it would reach with unlimited time in a tick.
struct ProxyLag {
  double held_back_share = 0;  ///< share of the ticks that end with kProxyHeldBack
  double p50_m = 0;            ///< distance from the position where it comes to rest if the hand holds still
  double p99_m = 0;
  double max_m = 0;
};
/// Follows every kLagStride-th tick until the proxy rests, for at most kMaxSettling updates. Reads no clock.
ProxyLag lag_of(const std::shared_ptr<const haptics::ProxyMesh>& mesh, const haptics::GodObjectSettings& settings,
                const std::vector<Vec3>& hand);
/// Largest depth of the hand's point.
double depth_of(const std::vector<Vec3>& hand, const geometry::TriangleTree& tree);

/// In      runs  runs of the same loop and path, at least one; omit a first run, whose caches are cold
ProxyFigures figures_of(const std::vector<ProxyRun>& runs, const geometry::TriangleMesh& mesh, double radius_m);
boost::json::object to_json(const ProxyFigures& figures);
boost::json::object to_json(const ProxyLag& lag);

}  // namespace tandem::lab
