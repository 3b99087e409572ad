// Contacts computed by formula instead of points: a ball on a plane, and two thin rods.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "common/contact/contact_point.hpp"
#include "common/contact/contact_shape.hpp"
#include "common/contact/round/rod_contacts.hpp"

namespace tandem::contact {

/// Finds the closed-form contacts of shape A with shape B, and stores the state of their friction.
///
/// Model   add_ball_on_plane() and RodContacts have the formulas. Friction:
///         * The bristle of a contact is its tangential displacement since it began to stick.
///         * The area of a contact has two parts: a core that has pressed since the contact began, and a ring that was
///           added later. The contact's bristle is the mean over both.
///         * Newly added area has no bristle. A shrinking contact first loses the ring
/// Thread  any, one at a time; no allocation
class ClosedFormContacts {
 public:
  /// In      share_of_a, share_of_b  fraction of the force that is computed from the points of A or B, if A or B is a
  ///         ball
  void bind(const ContactShape* a, const ContactShape* b, double share_of_a, double share_of_b) noexcept;
  /// Begins a step. had_contacts() then refers to the previous step.
  void begin_step() noexcept;

  /// Appends the contacts in the order of their ids. For a ball that is out of reach, returns true and appends none.
  /// Returns false if the pair has no closed form at these poses, so that the shells must be searched.
  bool find(const Pose& X_WA, const Pose& X_WB, double band_m, std::vector<ContactPoint>& now) noexcept;
  bool had_contacts() const { return was_on_ != nullptr || had_rods_; }
  bool is_ball_a() const { return ball_ != nullptr && ball_ == a_; }
  bool is_ball_b() const { return ball_ != nullptr && ball_ == b_; }

  /// Transfers the bristles from the contacts of the last step to those of find().
  ///
  /// In      turn  rotation since the last step of the surface that carries the bristles
  void carry_bristles(std::span<const ContactPoint> before, std::span<ContactPoint> now,
                      const Eigen::Matrix3d& turn) noexcept;

 private:
  bool add_ball(const Pose& X_WA, const Pose& X_WB, double band_m, std::vector<ContactPoint>& now) noexcept;
  PlaneSet planes_around_ball(const DistanceField& field, const Vec3& centre_F, double reach_m) noexcept;
  void carry_each(std::span<const ContactPoint> before, std::span<ContactPoint> now,
                  const Eigen::Matrix3d& turn) noexcept;
  void keep_core(const ContactPoint& point, const Vec3& core_bristle_W, double core_area_m2) noexcept;

  const ContactShape* a_ = nullptr;
  const ContactShape* b_ = nullptr;
  const ContactShape* ball_ = nullptr;  ///< shape that is a ball, if the other shape has planes; null: none
  double ball_share_ = 1;               ///< fraction of the force that is computed from the ball's points
  const FieldPlane* is_on_ = nullptr;   ///< plane of the ball's contacts; null: none
  const FieldPlane* was_on_ = nullptr;  ///< value of is_on_ in the previous step
  bool are_rods_ = false;               ///< true: both shapes are thin rods or balls
  bool has_rods_ = false;               ///< true: the last find() used the formulas for rods
  bool had_rods_ = false;               ///< value of has_rods_ in the previous step
  RodContacts rods_;
  std::array<double, kMaxRodContacts> core_areas_m2_ = {};
  std::array<Vec3, kMaxRodContacts> core_leads_W_;  ///< bristle of the core minus bristle of the contact
  PlaneSet ball_planes_ = 0;  ///< result of the last plane query; the next two members are its box
  Vec3 ball_planes_centre_F_ = Vec3::Zero();
  double ball_planes_reach_m_ = -1;
};

/// Transfers the friction state between contacts of different kinds, for example from points to closed-form contacts.
/// Each pressing contact gets a bristle in proportion to its depth, because the limit of its friction is proportional
/// to its depth. The sums over all contacts, friction force and moment about the normal, do not change.
void share_bristles(std::span<const ContactPoint> before, std::span<ContactPoint> now,
                    const Eigen::Matrix3d& turn) noexcept;

}  // namespace tandem::contact
