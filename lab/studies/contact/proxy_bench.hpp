// Measurements of `tandem-lab bench proxy`. A proxy that moves over a mesh is compared with a simple method that
// computes the closest point in each tick. Both follow the same path of the hand.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "common/base/json.hpp"
#include "common/geometry/triangle_mesh.hpp"
#include "common/haptics/proxy/god_object.hpp"
#include "lab/studies/contact/quantiles.hpp"

namespace tandem::lab {

/// Returns positions of the hand, one for each tick.
///
/// Model   A point y moves on an ellipsoid around the bounding box. Let x be the point of the mesh closest to y. The
///         target of the hand lies on the line from y through x, 5 mm beyond x. The hand begins at y and moves towards
///         the target at up to 0.2 m/s. It may pass through the inside of the mesh.
std::vector<Vec3> wandering_hand(const geometry::TriangleMesh& mesh, std::size_t steps);

/// Results of one method (god-object or closest point) for one path of the hand.
struct ProxyRun {
  std::vector<Duration> times;
  std::vector<Vec3> ball_W;  ///< centre of the displayed ball at each tick
  std::vector<Vec3> way_W;   ///< vertices of the polyline along which the ball moved
};

/// Runs the god-object. The displayed ball is its proxy.
ProxyRun run_god_object(const std::shared_ptr<const haptics::ProxyMesh>& mesh,
                        const haptics::GodObjectSettings& settings, const std::vector<Vec3>& hand, const Clock& clock);
/// Runs the closest-point loop. Each tick queries the closest point of the mesh from the bounding-volume tree, without
/// state from the previous tick. The ball touches the mesh at that point, on the side to which the surface faces.
ProxyRun run_closest_point(const geometry::TriangleTree& tree, double radius_m, const std::vector<Vec3>& hand,
                           const Clock& clock);

/// Figures of merit of one method. They are computed from positions and triangles alone. The only code shared with the
/// methods under test is the exact distance to a mesh.
struct ProxyFigures {
  TimeQuantiles loop_us;  ///< duration of a tick, over all ticks of all runs
  /// Largest penetration over the ticks: radius of the ball minus the signed distance of its centre.
  double max_penetration_m = 0;
  std::uint64_t pop_throughs = 0;  ///< number of straight segments of the ball's path that cross the mesh
};

/// Lag of the god-object: its distance from the position that it would reach if the computation time of a tick were
/// unlimited.
struct ProxyLag {
  double held_back_share = 0;  ///< fraction of the ticks that end with kProxyHeldBack
  double p50_m = 0;            ///< median distance from the position at which the proxy would rest if the hand stopped
  double p99_m = 0;
  double max_m = 0;
};
/// Measures the lag of the god-object. After every kLagStride-th tick, the god-object is copied. The copy is updated
/// with a hand that does not move until its proxy is at rest, at most kMaxSettling times. The lag is the distance that
/// the proxy of the copy moves. The result does not depend on a clock.
ProxyLag lag_of(const std::shared_ptr<const haptics::ProxyMesh>& mesh, const haptics::GodObjectSettings& settings,
                const std::vector<Vec3>& hand);
/// Returns the largest depth of the hand below the surface.
double depth_of(const std::vector<Vec3>& hand, const geometry::TriangleTree& tree);

/// Evaluates all runs of one loop.
/// In      runs  one or more runs of the same loop and path; the first run, which has cold caches, should be omitted
ProxyFigures figures_of(const std::vector<ProxyRun>& runs, const geometry::TriangleMesh& mesh, double radius_m);
boost::json::object to_json(const ProxyFigures& figures);
boost::json::object to_json(const ProxyLag& lag);

}  // namespace tandem::lab
