#include "common/docking/atom_radii.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace tandem::docking {
namespace {

struct Element {
  std::string_view symbol;
  double mass_u;
  AtomRadii radii;
};

constexpr std::array<Element, 19> kElements{{{"H", 1.008, {1.10, 0.31}},
                                             {"C", 12.011, {1.70, 0.76}},
                                             {"N", 14.007, {1.55, 0.71}},
                                             {"O", 15.999, {1.52, 0.66}},
                                             {"F", 18.998, {1.47, 0.57}},
                                             {"NA", 22.990, {2.27, 1.66}},
                                             {"MG", 24.305, {1.73, 1.41}},
                                             {"P", 30.974, {1.80, 1.07}},
                                             {"S", 32.06, {1.80, 1.05}},
                                             {"CL", 35.45, {1.75, 1.02}},
                                             {"K", 39.098, {2.75, 2.03}},
                                             {"CA", 40.078, {2.31, 1.76}},
                                             {"MN", 54.938, {2.45, 1.39}},
                                             {"FE", 55.845, {2.44, 1.32}},
                                             {"CU", 63.546, {2.38, 1.32}},
                                             {"ZN", 65.38, {2.39, 1.22}},
                                             {"SE", 78.971, {1.90, 1.20}},
                                             {"BR", 79.904, {1.85, 1.20}},
                                             {"I", 126.904, {1.98, 1.39}}}};

}  // namespace

const AtomRadii& atom_radii(std::string_view symbol, double mass_u) {
  const auto* const named = std::ranges::find(kElements, symbol, &Element::symbol);
  if (named != kElements.end()) return named->radii;
  return std::ranges::min_element(kElements, {}, [mass_u](const Element& e) { return std::abs(e.mass_u - mass_u); })
      ->radii;
}

const AtomRadii& atom_radii(const Molecule& molecule, std::size_t atom) {
  const bool is_named = atom < molecule.elements.size();
  return atom_radii(is_named ? std::string_view(molecule.elements[atom]) : std::string_view(), molecule.mass_u[atom]);
}

}  // namespace tandem::docking
