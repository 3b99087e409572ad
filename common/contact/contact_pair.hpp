// Contact search between two shapes at 1 kHz. Each step has bounded work and starts from the result of the last step.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/contact/closed_form_contacts.hpp"
#include "common/contact/contact_point.hpp"
#include "common/contact/contact_shape.hpp"
#include "common/contact/shell/shell_candidates.hpp"
#include "common/contact/union/shape_union.hpp"

namespace tandem::contact {

/// Maximum number of contacts of a pair in a step. If more points are near, neighbouring points are merged. The limit
/// is a number of contacts and not a time, so that a replay merges the same points.
inline constexpr std::uint32_t kContactBudget = 768;

/// Contacts of shape A with shape B, searched in each step. The surface points of each shape are stored in a tree. A
/// subtree of far points has a lower bound of its distance to the other shape. It is not searched again until the
/// shapes have moved by this bound.
///
/// Model   The surface points of each shape are sampled in the distance field of the other, each for half of its area.
///         There are two exceptions:
///         1. On a flat part of the larger shape, only the smaller shape's points are used, with their whole area.
///            Otherwise, the few points of the larger shape beside the edges of a small tip would push the tip
///            sideways.
///         2. A shape whose points are farther apart than 0.5 mm (a large primitive) contributes only its feature
///            points. The points of the other shape then count with their whole area
/// Thread  any, one at a time
class ContactPair {
 public:
  /// Allocates all memory for `budget`.
  explicit ContactPair(std::uint32_t budget = kContactBudget);

  /// Discards the state of the last pair and binds these shapes. With a null shape, no pair is bound. No allocation.
  void bind(const ContactShape* a, const ContactShape* b) noexcept;
  bool is_bound() const { return a_ != nullptr && b_ != nullptr; }

  /// Finds every surface point that is in contact or has a gap below `band_m`. The bristle (friction state) of a point
  /// that was in contact in the last step is rotated with B.
  ///
  /// If more points are near than the budget allows, a point in contact may be found some steps late. Its depth_m then
  /// does not begin with its full value. It grows by 10 µm a step plus the point's motion, up to the rigid depth,
  /// beyond which contact is as stiff as the step allows. This limit applies until the budget suffices again and no
  /// contact is deeper than its limit.
  ///
  /// Model   1. While the budget suffices, force, moment and stiffness depend on the current poses only.
  ///         2. The points of a leaf of the tree (8 at most) are merged if their depths are equal within 1 µm.
  ///         3. If a flat face touches a flat face, a few contacts represent the whole face (PlaneContacts).
  ///         4. Beyond the budget, points are merged with their net force and moment: first the pressing points of a
  ///            leaf, then those of larger nodes.
  ///         5. A ball on one plane has the few contacts of add_ball_on_plane(). Their force is the limit for
  ///            infinitely many points. Near an edge of the plane, the ball's points are used instead; the position of
  ///            this change depends on the last millimetre of motion.
  ///         6. Thin rods and balls have the contacts of RodContacts, except for flat ends and their edges
  /// In      band_m  largest gap that is searched. Beyond a field's `band_m()`, depths are as accurate as its sample(),
  ///         which suffices to predict contact in fast motion
  /// Fails   no contact for a pose that is not finite
  ContactWork find(const Pose& X_WA, const Pose& X_WB, double band_m) noexcept;

  /// Corrects the contacts of the last find() for shapes that touch or overlap A or B, for example a second box flush
  /// with a first one. The result is the contact with the union of the shapes: where another shape covers the surface
  /// of A or B, there is no contact. Call it once after each find(), with the same poses.
  ///
  /// In      beside_a  shapes that form a union with A and are near B; overwritten
  ///         beside_b  shapes that form a union with B and are near A; overwritten
  void join(const Pose& X_WA, const Pose& X_WB, std::span<PlacedShape> beside_a,
            std::span<PlacedShape> beside_b) noexcept;

  /// Contacts of the last find(), in the order of their ids.
  std::span<ContactPoint> contacts() noexcept { return now_; }
  std::span<const ContactPoint> contacts() const noexcept { return now_; }
  /// Returns true if the contact represents points of A's shell, false if it represents points of B's shell.
  bool is_of_a(const ContactPoint& contact) const noexcept {
    return ((contact.id & ContactPoint::kOtherDirection) != 0) != is_a_primary_;
  }
  /// Returns the shell points that the contact represents, in the frame of their shape; none for a closed-form contact.
  std::span<const ShellPoint> points_of(const ContactPoint& contact) const noexcept;

 private:
  struct Direction;

  void search(ShellCandidates& candidates, const Direction& direction, double band_m) noexcept;
  void limit_depths(const Pose& X_WA, const Pose& X_WB, const Pose& X_BA, bool is_coarse) noexcept;
  const ContactPoint* deepest_before(const ContactPoint& point) const noexcept;
  void carry_bristle_again(std::size_t index, bool is_first_direction) noexcept;
  void carry_bristles(std::size_t now, std::size_t now_end, std::size_t before, std::size_t before_end,
                      const Eigen::Matrix3d& turn_of_b) noexcept;

  const ContactShape* a_ = nullptr;
  const ContactShape* b_ = nullptr;
  std::uint32_t budget_;
  bool is_a_primary_ = true;
  bool is_mutual_ = false;  ///< true: both shapes contribute all of their points; false: only the primary shape
  double plane_share_ = 1;  ///< fraction of the area of a primary point on a flat part of the other shape
  ShellCandidates primary_;
  ShellCandidates other_;
  std::vector<ContactPoint> now_;
  std::vector<ContactPoint> before_;
  std::size_t first_of_other_ = 0;  ///< index in now_ of the first contact of the second search direction
  std::size_t first_of_other_before_ = 0;
  double deepest_m_ = 0;  ///< depth of the deepest contact of the last find(); infinite: not known
  /// True if the last search was coarse (limited by the budget), or if limit_depths() reduced the depth of a contact.
  /// The next find() then limits depths, even if its own search is not coarse.
  bool is_catching_up_ = false;
  Pose X_BA_before_;
  Eigen::Matrix3d turn_of_b_ = Eigen::Matrix3d::Identity();  ///< rotation of B since the previous find()
  Quat q_WA_before_ = Quat::Identity();
  Quat q_WB_before_ = Quat::Identity();
  ClosedFormContacts closed_form_;
};

}  // namespace tandem::contact
