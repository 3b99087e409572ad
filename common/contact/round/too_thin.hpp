// Detection of shapes that are too thin: an object that a hand presses against such a shape would pass through it.
#pragma once

#include <string>

namespace tandem::contact {

struct ContactShape;

/// Half thickness of a shape below which a pressing object may pass through it before contact becomes rigid (as stiff
/// as the step allows). It is 1.5 times the minimum rigid depth, because a rigid contact still yields. In thin_test,
/// one rod is pressed across another with 0.5 to 5 N at up to 1 m/s. In 80 crossings each, it passed through a rod of
/// 0.12 mm 46 times, of 0.14 mm once, and of 0.16 mm never. The limit is for contact by points. It does not apply to
/// two thin primitives, even of 0.1 mm: RodContacts stops them.
inline constexpr double kMinHoldingHalf_m = 7.5e-5;

/// Explains why a shape with this half thickness is too thin, with the remedy. Returns an empty text if it is thick
/// enough.
std::string why_too_thin(double half_thickness_m);
/// Explains why a shape is too thin, or sampled too coarsely for its thickness. Returns an empty text if it is fine.
std::string why_too_thin(const ContactShape& shape);

}  // namespace tandem::contact
