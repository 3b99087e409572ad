// Built-in force-field parameters, for use without the parameter files of GROMACS.
#include <array>
#include <string>
#include <string_view>

#include "server/assets/structures/elements.hpp"
#include "server/assets/structures/force_field.hpp"
#include "server/assets/structures/loader.hpp"

namespace tandem::server {
namespace {

struct Element {
  std::string_view type;
  double mass_u, sigma_angstrom, epsilon_kcal_per_mol;
};

constexpr std::array<Element, 17> kElements = {{
    {"C", 12.011, 3.50, 0.066},
    {"N", 14.007, 3.25, 0.17},
    {"O", 15.999, 2.96, 0.21},
    {"S", 32.06, 3.55, 0.25},
    {"SE", 78.971, 3.55, 0.25},
    {"P", 30.974, 3.74, 0.20},
    {"H", 1.008, 2.50, 0.03},
    {"HP", 1.008, 0, 0},
    {"F", 18.998, 2.94, 0.061},
    {"CL", 35.45, 3.40, 0.30},
    {"BR", 79.904, 3.47, 0.47},
    {"NA", 22.990, 3.330, 0.00277},
    {"K", 39.098, 4.935, 0.000328},
    {"MG", 24.305, 1.644, 0.875},
    {"CA", 40.08, 2.412, 0.450},
    {"ZN", 65.38, 1.644, 0.875},
    {"FE", 55.845, 1.644, 0.875},
}};

/// Residue names: those of the amino acids in residue_typing.cpp, and those that other programs use for chain caps.
constexpr std::array<std::string_view, 32> kResidues = {"ALA",  "ARG", "ARGN", "ASN",  "ASP",  "ASPH", "CYS",  "CYS2",
                                                        "CYSH", "GLN", "GLU",  "GLUH", "GLY",  "HISD", "HISE", "HISH",
                                                        "ILE",  "LEU", "LYS",  "LYSH", "LYSN", "MET",  "PHE",  "PRO",
                                                        "SER",  "THR", "TRP",  "TYR",  "VAL",  "PGLU", "AIB",  "HYP"};
constexpr std::array<std::string_view, 4> kKnownCaps = {"ACE", "NAC", "NH2", "NHE"};

}  // namespace

ForceField built_in_force_field() {
  ForceField made;
  made.name = made.directory = kBuiltInForceField;
  made.is_by_element = true;
  for (const Element& element : kElements) {
    made.types[std::string(element.type)] = {element.mass_u, element.sigma_angstrom,
                                             docking::kKilojoulesPerKilocalorie * element.epsilon_kcal_per_mol};
  }
  for (const ChemicalElement& element : periodic_table()) {
    made.types.try_emplace(std::string(element.symbol),
                           AtomType{element.mass_u, element.sigma_angstrom(),
                                    docking::kKilojoulesPerKilocalorie * element.well_kcal_per_mol});
  }
  for (const std::string_view name : kResidues) {
    made.blocks[std::string(name)] = {
        std::string(name), {{"N", "N", 0}, {"CA", "C", 0}, {"C", "C", 0}, {"O", "O", 0}}, {}};
  }
  for (const std::string_view name : kKnownCaps) made.blocks[std::string(name)] = {std::string(name), {}, {}};
  return made;
}

}  // namespace tandem::server
