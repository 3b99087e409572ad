#include "lab/studies/rendering/hand_rig.hpp"

#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "common/base/spatial.hpp"
#include "common/haptics/coupling/saturation.hpp"

namespace tandem::lab {
namespace {

// Mass and inertia by which a massless tool is simulated. They are so small that the tool reaches the equilibrium of
// coupling and contact within one step. Even at a stiffness of 0.1 N/m, its time constant is below a thousandth of a
// period of 0.25 ms.
constexpr double kVanishingMass_kg = 1e-15;
constexpr double kVanishingInertia_kg_m2 = 1e-21;

std::unique_ptr<haptics::CouplingLaw> made_law(const HandRigSettings& settings) {
  auto law = haptics::make_coupling_law(settings.law, settings.coupling);
  if (law) return law;
  throw std::invalid_argument("hand rig: law is \"" + settings.law + "\"; it must be one of " +
                              haptics::listed_coupling_law_names());
}

double checked_period_s(double rate_hz) {
  if (std::isfinite(rate_hz) && rate_hz >= 10 && rate_hz <= 20000) return 1 / rate_hz;
  throw std::invalid_argument("hand rig: rate_hz is " + std::to_string(rate_hz) + "; it must be 10 to 20000");
}

Vec3 rounded_to(const Vec3& a, double step) {
  if (step <= 0) return a;
  return (a / step).array().round().matrix() * step;
}

}  // namespace

devices::HandParameters hand_of(const haptics::CheckedHand& checked) {
  devices::HandParameters hand;
  hand.mass_kg = checked.mass_kg;
  hand.damping_n_s_per_m = checked.damping_n_s_per_m;
  hand.stiffness_n_per_m = checked.stiffness_n_per_m;
  hand.inertia_kg_m2 = checked.inertia_kg_m2;
  hand.damping_n_m_s_per_rad = checked.damping_n_m_s_per_rad;
  hand.stiffness_n_m_per_rad = checked.stiffness_n_m_per_rad;
  return hand;
}

struct HandRig::Impl {
  Impl(const HandRigSettings& settings_in, devices::HandPath path);

  /// Computes the coupling, the tool and the displayed wrench for a new position of the handle.
  HandRigTick respond(const Pose& X_WH_true, const Twist& V_WH_true, const Pose& X_WH);
  Wrench step_tool(const Pose& X_WH, const Twist& V_WH);
  Wrench press_directly(const Pose& X_WH);
  double depth_m(const Vec3& p_W) const { return settings.plane_z_m ? *settings.plane_z_m - p_W.z() : -1; }
  bool is_massless() const { return law->tool_dynamics() == haptics::ToolDynamics::kMassless; }

  HandRigSettings settings;
  double period_s;
  std::unique_ptr<haptics::CouplingLaw> law;
  devices::SimDevice device;
  haptics::VelocityEstimator estimator;
  haptics::CouplingPassivityController passivity;
  contact::ContactSolver solver{{.bodies = 1, .couplings = 1, .patches = 1, .contacts = 2}};
  LocalTime now{};
  std::int64_t ticks = 0;

  Pose X_WT;
  Twist V_WT;
  std::array<contact::ContactPoint, 1> contact;  ///< contact with the plane; keeps the friction bristle
  Wrench on_tool_W;
  double normal_force_n = 0;
  double work_on_tool_j = 0;  ///< work on the tool in the last step

  Pose X_WH_before;  ///< true (not reported) pose of the handle at the previous tick
  Pose X_WH_reported;
  Wrench on_hand_W;
  double hand_work_j = 0;
  double reported_work_j = 0;
};

HandRig::Impl::Impl(const HandRigSettings& settings_in, devices::HandPath path)
    : settings(settings_in),
      period_s(checked_period_s(settings_in.rate_hz)),
      law(made_law(settings_in)),
      device(devices::SimDevice::default_spec(), settings_in.hand, std::move(path), settings_in.seed),
      estimator(settings_in.hand.encoder_step_m, settings_in.hand.encoder_step_rad),
      X_WT(device.hand_pose()),
      X_WH_before(device.hand_pose()) {
  device.read(now);
}

HandRigTick HandRig::Impl::respond(const Pose& X_WH_true, const Twist& V_WH_true, const Pose& X_WH) {
  hand_work_j -= held_work_j(on_hand_W, X_WH_before, X_WH_true);
  reported_work_j -= held_work_j(on_hand_W, X_WH_reported, X_WH);
  X_WH_before = X_WH_true;
  X_WH_reported = X_WH;
  const Twist estimated = estimator.add(now, X_WH);
  const Twist& V_WH = settings.estimates_velocity ? estimated : V_WH_true;
  const bool is_direct = law->tool_dynamics() == haptics::ToolDynamics::kAtHandle;
  // The passivity controller accounts for the energy up to this tick. Therefore it receives the work on the tool in the
  // previous step.
  const double work_before_j = std::exchange(work_on_tool_j, 0.0);
  const Wrench wanted = is_direct ? press_directly(X_WH) : step_tool(X_WH, V_WH);
  on_hand_W = settings.is_passivity_controlled ? passivity.apply(X_WH, wanted, work_before_j, period_s) : wanted;
  device.write(now, on_hand_W);

  HandRigTick tick;
  tick.at = now.time_since_epoch();
  tick.X_WH = X_WH_true;
  tick.V_WH = V_WH_true;
  tick.X_WT = X_WT;
  tick.V_WT = V_WT;
  tick.on_hand_W = on_hand_W;
  tick.on_tool_W = on_tool_W;
  tick.normal_force_n = normal_force_n;
  tick.hand_work_j = hand_work_j;
  tick.reported_work_j = reported_work_j;
  return tick;
}

/// Steps the tool and returns the wrench on the hand.
Wrench HandRig::Impl::step_tool(const Pose& X_WH, const Twist& V_WH) {
  contact::SolverBody body;
  const Eigen::Matrix3d R = X_WT.q.toRotationMatrix();
  if (is_massless()) {
    body.mass_kg = kVanishingMass_kg;
    body.inertia_W = kVanishingInertia_kg_m2 * Eigen::Matrix3d::Identity();
  } else {
    body.mass_kg = settings.tool_mass_kg;
    body.inertia_W = R * settings.tool_inertia_kg_m2.asDiagonal() * R.transpose();
    body.V_WC = V_WT;
    body.wrench_W.f = settings.tool_mass_kg * settings.gravity_m_per_s2;
  }
  body.p_WC = X_WT.p;

  contact[0].p_W = X_WT.p;
  contact[0].depth_m = depth_m(X_WT.p);
  contact[0].area_m2 = settings.plane_z_m ? settings.contact_n_per_m / contact::SolverPatch{}.stiffness_n_per_m3 : 0;
  contact::SolverPatch patch;
  patch.contacts = std::span(contact).first(settings.plane_z_m ? 1 : 0);
  patch.friction = settings.friction;

  const contact::SolverCoupling coupling{0, law.get(), X_WH, V_WH, X_WT};
  contact::PatchResult pressed;
  solver.step(period_s, std::span(&body, 1), std::span(&coupling, 1), std::span(&patch, 1), std::span(&pressed, 1),
              std::span(&on_tool_W, 1));
  normal_force_n = pressed.normal_force_n;
  V_WT = body.V_WC;
  const Pose before = std::exchange(X_WT, integrate(X_WT, V_WT, period_s));
  work_on_tool_j = held_work_j(on_tool_W, before, X_WT);
  return haptics::reaction_on_hand(on_tool_W, X_WH.p - X_WT.p);
}

/// Direct rendering: returns a penalty force proportional to the depth of the handle. There is no friction.
Wrench HandRig::Impl::press_directly(const Pose& X_WH) {
  const haptics::CouplingParameters& c = settings.coupling;
  X_WT = X_WH;
  normal_force_n = haptics::saturated(settings.contact_n_per_m * std::max(0.0, depth_m(X_WH.p)), c.force_limit_n,
                                      c.saturation_softness);
  const Wrench on_hand{normal_force_n * Vec3::UnitZ(), Vec3::Zero()};
  on_tool_W = -on_hand;
  return on_hand;
}

HandRig::HandRig(const HandRigSettings& settings, devices::HandPath path)
    : impl_(std::make_unique<Impl>(settings, std::move(path))) {}
HandRig::~HandRig() = default;
HandRig::HandRig(HandRig&&) noexcept = default;

HandRigTick HandRig::tick() {
  Impl& rig = *impl_;
  // The time is computed from the number of ticks. A period need not be a whole number of nanoseconds, so a sum of
  // rounded periods would drift.
  rig.now = LocalTime(from_seconds(static_cast<double>(++rig.ticks) * rig.period_s));
  const devices::DeviceSample sample = rig.device.read(rig.now);
  return rig.respond(rig.device.hand_pose(), rig.device.hand_twist(), sample.X_DH);
}

HandRigTick HandRig::tick_driven(const Vec3& step_W, const Vec3& turn_W) {
  Impl& rig = *impl_;
  rig.now = LocalTime(from_seconds(static_cast<double>(++rig.ticks) * rig.period_s));
  Pose X_WH = rig.X_WH_before;
  X_WH.p += step_W;
  X_WH.q = (quaternion_of(turn_W) * X_WH.q).normalized();
  Pose reported = X_WH;
  const devices::HandParameters& hand = rig.settings.hand;
  reported.p = rounded_to(X_WH.p, hand.encoder_step_m);
  if (hand.encoder_step_rad > 0) reported.q = quaternion_of(rounded_to(rotation_vector(X_WH.q), hand.encoder_step_rad));
  return rig.respond(X_WH, {step_W / rig.period_s, turn_W / rig.period_s}, reported);
}

double HandRig::withheld_j() const {
  return impl_->passivity.withheld_j();
}

}  // namespace tandem::lab
