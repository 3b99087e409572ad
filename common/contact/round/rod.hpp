// Dimensions of a rod: a capsule, a cylinder or a ball.
#pragma once

namespace tandem::contact {

/// Largest radius of a thin rod.
inline constexpr double kThinRod_m = 1e-3;

/// A capsule or a cylinder along z about the origin of its shape; a ball if its length is zero.
struct Rod {
  double radius_m = 0;  ///< radius of the rod; 0: the shape is not a rod
  double half_length_m = 0;
  bool has_round_ends = true;

  bool is_valid() const { return radius_m > 0; }
  /// Returns whether RodContacts computes the contacts with another thin rod by formula. Thicker rods use points.
  bool is_thin() const { return is_valid() && radius_m <= kThinRod_m; }
};

}  // namespace tandem::contact
