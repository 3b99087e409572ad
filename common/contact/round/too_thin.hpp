// Shapes that are too thin to hold what a hand presses against them.
#pragma once

#include <string>

namespace tandem::contact {

struct ContactShape;

/// Half thickness below which contact of points is not sure to be rigid before what presses is through the middle: the
/// minimal rigid depth, and half as much again for what a rigid contact gives way. Measured with 0.5 to 5 N at up to 1 m/s
/// (thin_test, 80 crossings each): of rods of 0.12 mm 46 let the other through, of 0.14 mm one, of 0.16 mm none. Two
/// primitives of 0.1 mm still hold each other (RodContacts).
inline constexpr double kMinHoldingHalf_m = 7.5e-5;

/// What is too thin about something of this half thickness, and what to do; empty: nothing.
std::string why_too_thin(double half_thickness_m);
/// Likewise of a shape, and of one that is sampled too coarsely for how thin it is.
std::string why_too_thin(const ContactShape& shape);

}  // namespace tandem::contact
