#include "common/contact/round/too_thin.hpp"

#include <iomanip>
#include <sstream>

#include "common/contact/contact_shape.hpp"

namespace tandem::contact {
namespace {

std::string millimetres(double length_m) {
  std::ostringstream out;
  out << std::setprecision(2) << length_m * 1e3 << " mm";
  return out.str();
}

}  // namespace

std::string why_too_thin(double half_thickness_m) {
  if (!(half_thickness_m < kMinHoldingHalf_m)) return {};
  return "is " + millimetres(2 * half_thickness_m) +
         " thick, too thin to hold: a hand may press it through other things, and them through it; make it " +
         millimetres(2 * kMinHoldingHalf_m) + " thick or more, or the scene larger";
}

std::string why_too_thin(const ContactShape& shape) {
  if (std::string why = why_too_thin(shape.half_thickness_m); !why.empty()) return why;
  const double spacing_m = shape.shells.surface.spacing_m;
  if (shape.rod.is_valid() && spacing_m > 2 * shape.rod.radius_m) {
    return "is " + millimetres(2 * shape.rod.radius_m) + " thick with contact points " + millimetres(spacing_m) +
           " apart, of which a primitive has 20,000 at most: thin objects may pass between them; make it shorter, "
           "several shapes, or thicker";
  }
  if (shape.field->error_m() > shape.half_thickness_m) {
    return "is " + millimetres(2 * shape.half_thickness_m) + " thick, but its distances are right to " +
           millimetres(shape.field->error_m()) +
           " only: thin objects may pass through it; divide it among several meshes, or make it thicker";
  }
  return {};
}

}  // namespace tandem::contact
