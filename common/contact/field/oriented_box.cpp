#include "common/contact/field/oriented_box.hpp"

#include <algorithm>
#include <bit>
#include <limits>

namespace tandem::contact {

double largest_m(std::span<const FieldPlane> planes, PlaneSet set, const Vec3& p) {
  double largest = -std::numeric_limits<double>::infinity();
  for (; set != 0; set &= set - 1) {
    largest = std::max(largest, planes[static_cast<std::size_t>(std::countr_zero(set))].distance_m(p));
  }
  return largest;
}

PlaneSet largest_over(std::span<const FieldPlane> planes, PlaneSet set, const OrientedBox& box) {
  if (std::has_single_bit(set) || set == 0) return set;
  const FieldPlane* largest = nullptr;
  PlaneSet found = 0;
  for (PlaneSet rest = set; rest != 0; rest &= rest - 1) {
    const FieldPlane& plane = planes[static_cast<std::size_t>(std::countr_zero(rest))];
    if (largest != nullptr && plane.distance_m(box.centre) <= largest->distance_m(box.centre)) continue;
    largest = &plane;
    found = rest & -rest;
  }
  for (PlaneSet rest = set & ~found; rest != 0; rest &= rest - 1) {
    const FieldPlane& plane = planes[static_cast<std::size_t>(std::countr_zero(rest))];
    const double below = largest->distance_m(box.centre) - plane.distance_m(box.centre);
    if (box.reach_m(plane.normal - largest->normal) > below) found |= rest & -rest;
  }
  return found;
}

}  // namespace tandem::contact
