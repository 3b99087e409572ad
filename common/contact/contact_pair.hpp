// Where two shapes touch: found 1000 times a second, with the work bounded, from what was found before.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/contact/contact_shape.hpp"
#include "common/contact/flat/ball_contacts.hpp"
#include "common/contact/round/rod_contacts.hpp"
#include "common/contact/shell_candidates.hpp"
#include "common/contact/union/shape_union.hpp"

namespace tandem::contact {

/// One place where A meets B.
struct ContactPoint {
  Vec3 p_W = Vec3::Zero();        ///< the sample itself: on the surface of the shape whose point it is
  Vec3 normal_W = Vec3::UnitZ();  ///< unit, out of B towards A: the force on A is along it
  double depth_m = 0;             ///< overlap along the normal; negative: a gap
  double area_m2 = 0;
  Vec3 bristle_W = Vec3::Zero();  ///< tangential displacement of A past B since they stuck; written by the solver
  /// Which sample it is, the same from step to step: the index of the point in its shell, of the first point where it
  /// stands for several; with kOtherDirection for the points of the shape that has the larger surface. With kClosedForm
  /// it is no sample but a part of a ball, from its deepest point outwards, or of a rod (RodContacts).
  std::uint32_t id = 0;
  /// Of its shell's points, from `id` on, that it stands for; of a slice of a face, those whose friction it takes over.
  std::uint32_t count = 1;

  static constexpr std::uint32_t kOtherDirection = 1U << 31;
  static constexpr std::uint32_t kClosedForm = 1U << 30;
};

/// Points of a pair that a step looks at; beyond it, they are merged with their neighbours. A budget in points and
/// never in time: a replay degrades alike.
inline constexpr std::uint32_t kContactBudget = 768;

/// The contacts of shape A with shape B, searched each step. Remembers which parts of the tree cannot be near yet, and how far
/// the shapes may move until they can.
///
/// Model   the surface points of each shape against the distance field of the other, each for half of its area. Inside of a
///         plane of the larger shape, where few of its points would press beside the edges of a small tip and push it to
///         all sides, the smaller shape's points stand for their whole area; and all over a shape whose shell is wider
///         than 0.5 mm (a large primitive), which gives its feature points alone
/// Thread  one at a time
class ContactPair {
 public:
  /// All memory for `budget` is taken here.
  explicit ContactPair(std::uint32_t budget = kContactBudget);

  /// Forgets everything and looks at these shapes from now on. Null: none. No allocation.
  void bind(const ContactShape* a, const ContactShape* b) noexcept;
  bool is_bound() const { return a_ != nullptr && b_ != nullptr; }

  /// Finds every point deeper than −`band_m`. Bristles of points that were there before are carried along with B. Beyond the budget
  /// points may be found late: their depth_m then grows by 10 µm a step, up to the rigid depth, and besides by their own motion; also
  /// when the budget holds again, until they are no deeper than that.
  ///
  /// Model   while the budget holds, force, moment and stiffness depend on the poses alone, not on those before; up to eight
  ///         points of a leaf are one where their depths are equal within a micrometre. Of flat on flat a few contacts act
  ///         as all of a face (PlaneContacts). Beyond the budget, points are joined: of a leaf, what presses, with the force
  ///         and moment of its points; then of larger nodes. A ball on one plane has the few contacts of
  ///         add_ball_on_plane(), which have the force that its points tend to when they get finer; near an edge it
  ///         depends on the last millimetre of motion whether these are found or its points. Thin rods and balls have
  ///         those of RodContacts, but for flat ends and their edges
  /// In      band_m  beyond a field's `band_m()` depths are as good as its sample(): to look ahead in fast motion
  /// Fails   no contact for a pose that is not finite
  ContactWork find(const Pose& X_WA, const Pose& X_WB, double band_m) noexcept;

  /// Corrects the contacts of the last find() where shapes that are near, too, cover the surface of A or B: contact is with
  /// the union. Once after each find(), with the same poses.
  ///
  /// In      beside_a, beside_b  shapes that touch B beside A, and A beside B; their order is changed
  void join(const Pose& X_WA, const Pose& X_WB, std::span<PlacedShape> beside_a,
            std::span<PlacedShape> beside_b) noexcept;

  /// Of the last find(), in the order of their ids.
  std::span<ContactPoint> contacts() noexcept { return now_; }
  std::span<const ContactPoint> contacts() const noexcept { return now_; }
  /// Whose shell the points are of that a contact stands for: A's or B's.
  bool is_of_a(const ContactPoint& contact) const noexcept {
    return ((contact.id & ContactPoint::kOtherDirection) != 0) != is_a_primary_;
  }
  /// These points, in the frame of their shape; none where it is no sample.
  std::span<const ShellPoint> points_of(const ContactPoint& contact) const noexcept;

 private:
  struct Direction;

  bool has_ball_contacts(const Pose& X_WA, const Pose& X_WB, double band_m) noexcept;
  bool has_rod_contacts(const Pose& X_WA, const Pose& X_WB, double band_m) noexcept;
  PlaneSet planes_around_ball(const Vec3& centre_F, double reach_m) noexcept;
  void search(ShellCandidates& candidates, const Direction& direction, double band_m) noexcept;
  void limit_depths(const Pose& X_WA, const Pose& X_WB, const Pose& X_BA, bool is_coarse) noexcept;
  const ContactPoint* deepest_before(const ContactPoint& point) const noexcept;
  void carry_ball_bristles(const Eigen::Matrix3d& turn) noexcept;
  void keep_core(const ContactPoint& point, const Vec3& core_bristle_W, double core_area_m2) noexcept;
  void share_bristles(const Eigen::Matrix3d& turn) noexcept;
  void carry_bristle_again(std::size_t index, bool is_first_direction) noexcept;
  void carry_bristles(std::size_t now, std::size_t now_end, std::size_t before, std::size_t before_end,
                      const Eigen::Matrix3d& turn_of_b) noexcept;

  const ContactShape* a_ = nullptr;
  const ContactShape* b_ = nullptr;
  std::uint32_t budget_;
  bool is_a_primary_ = true;
  bool is_mutual_ = false;  ///< all points of both
  double plane_share_ = 1;  ///< of the primary's points inside of a plane of the other
  ShellCandidates primary_;
  ShellCandidates other_;
  std::vector<ContactPoint> now_;
  std::vector<ContactPoint> before_;
  std::size_t first_of_other_ = 0;  ///< where the second direction begins
  std::size_t first_of_other_before_ = 0;
  double deepest_m_ = 0;         ///< contact of the last find(); infinite: nothing is known of it
  bool is_catching_up_ = false;  ///< it was coarse, or deeper than it had been
  Pose X_BA_before_;
  Eigen::Matrix3d turn_of_b_ = Eigen::Matrix3d::Identity();  ///< since the find() before
  Quat q_WA_before_ = Quat::Identity();
  Quat q_WB_before_ = Quat::Identity();
  const ContactShape* ball_ = nullptr;   ///< of the two, if the other one has planes
  double ball_share_ = 1;                ///< of the force, from the ball's own points
  const FieldPlane* ball_on_ = nullptr;  ///< now_ is that of the ball on this plane
  bool are_rods_ = false;                ///< both, and thin
  bool has_rods_ = false;                ///< now_ is that of the rods
  RodContacts rods_;
  /// Of each contact of a ball or of rods, the area that has been pressing all the time, and how far its bristle is ahead of the
  /// contact's, which is the mean of it and of the ring around it.
  std::array<double, kMaxRodContacts> core_areas_m2_ = {};
  std::array<Vec3, kMaxRodContacts> core_leads_W_;
  PlaneSet ball_planes_ = 0;  ///< all over a box of this size about this place, last asked for
  Vec3 ball_planes_centre_F_ = Vec3::Zero();
  double ball_planes_reach_m_ = -1;
};

}  // namespace tandem::contact
