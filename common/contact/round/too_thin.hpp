// Detection of shapes that are too thin: an object that a hand presses against them would pass through.
#pragma once

#include <string>

namespace tandem::contact {

struct ContactShape;

/// Half thickness below which a pressing object may pass through a shape before contact becomes rigid. It is 1.5 times
/// the minimum rigid depth (depth beyond which contact is as stiff as the step allows); the half is for the compliance
/// of a rigid contact. It was measured with 0.5 to 5 N at up to 1 m/s (thin_test, 80 crossings each). Rods of 0.12 mm
/// let another rod through 46 times, rods of 0.14 mm once, and rods of 0.16 mm never. The limit is for contact by
/// points: two primitives of 0.1 mm still hold each other by formula (RodContacts).
inline constexpr double kMinHoldingHalf_m = 7.5e-5;

/// Explains why a shape with this half thickness is too thin, with the remedy. Returns an empty text if it is thick
/// enough.
std::string why_too_thin(double half_thickness_m);
/// Explains why a shape is too thin, or sampled too coarsely for its thickness. Returns an empty text if it is neither.
std::string why_too_thin(const ContactShape& shape);

}  // namespace tandem::contact
