// Tests that colours with a meaning are distinguishable for all users, including colour-blind users who lack one type
// of cone cells.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "client/view/scene_view.hpp"

namespace tandem::client {
namespace {

using Mat3 = Eigen::Matrix3d;

Vec3 linear(const Rgba& color) {
  const auto channel = [](float c) { return c <= 0.04045F ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4); };
  return {channel(color[0]), channel(color[1]), channel(color[2])};
}

/// Returns the matrix from linear RGB to the responses of the three types of cone cells, in Viénot's normalisation.
Mat3 cones_of_light() {
  Mat3 cones;
  cones << 17.8824, 43.5161, 4.11935, 3.45565, 27.1554, 3.86714, 0.0299566, 0.184309, 1.46709;
  return cones;
}

/// Returns a colour in linear RGB as a user without L cones (protanope) perceives it. The next function does the same
/// for a user without M cones (deuteranope).
///
/// Source  Viénot, Brettel, Mollon, "Digital video colourmaps for checking the legibility of displays by dichromats",
///         Color Res. Appl. 24(4), 1999
Vec3 seen_by_protanopes(const Vec3& light) {
  Mat3 lack = Mat3::Identity();
  lack.row(0) = Vec3(0, 2.02344, -2.52581);
  return cones_of_light().inverse() * lack * cones_of_light() * light;
}
Vec3 seen_by_deuteranopes(const Vec3& light) {
  Mat3 lack = Mat3::Identity();
  lack.row(1) = Vec3(0.494207, 0, 1.24827);
  return cones_of_light().inverse() * lack * cones_of_light() * light;
}

/// Converts linear RGB to CIE L*a*b* for the illuminant D65.
Vec3 lab(const Vec3& light) {
  Mat3 xyz_of_light;
  xyz_of_light << 0.4124, 0.3576, 0.1805, 0.2126, 0.7152, 0.0722, 0.0193, 0.1192, 0.9505;
  const Vec3 xyz = (xyz_of_light * light.cwiseMax(0.0)).cwiseQuotient(Vec3(0.9505, 1, 1.089));
  const auto f = [](double t) { return t > 0.008856 ? std::cbrt(t) : 7.787 * t + 16.0 / 116; };
  return {116 * f(xyz.y()) - 16, 500 * (f(xyz.x()) - f(xyz.y())), 200 * (f(xyz.y()) - f(xyz.z()))};
}

/// Checks that each two colours have a distance of at least 10 in L*a*b*, which is clearly visible side by side.
void expect_apart(const std::vector<std::pair<std::string, Rgba>>& colors) {
  const std::pair<const char*, Vec3 (*)(const Vec3&)> eyes[] = {{"usual", [](const Vec3& light) { return light; }},
                                                                {"protanope", seen_by_protanopes},
                                                                {"deuteranope", seen_by_deuteranopes}};
  for (const auto& [eye, seen] : eyes) {
    for (std::size_t i = 0; i < colors.size(); ++i) {
      for (std::size_t k = 0; k < i; ++k) {
        const double apart = (lab(seen(linear(colors[i].second))) - lab(seen(linear(colors[k].second)))).norm();
        EXPECT_GT(apart, 10) << eye << ": " << colors[i].first << " and " << colors[k].first;
      }
    }
  }
}

TEST(Palette, ToolsArrowsAndContactsAreDistinguishableForAllUsers) {
  std::vector<std::pair<std::string, Rgba>> colors{
      {"force", kForceColor}, {"torque", kTorqueColor}, {"contact", kContactColor}};
  for (std::size_t tool = 0; tool < 6; ++tool) colors.emplace_back("tool " + std::to_string(tool), tool_color(tool));
  expect_apart(colors);
}

TEST(Palette, ChainsAndKindsOfResiduesAreDistinguishableForAllUsers) {
  std::vector<std::pair<std::string, Rgba>> chains, residues;
  for (std::size_t chain = 0; chain < 9; ++chain)
    chains.emplace_back("chain " + std::to_string(chain), chain_color(chain));
  expect_apart(chains);
  docking::Molecule molecule;
  for (const char* const name : {"ASP", "LYS", "SER", "ALA", "DG", "HOH"}) {
    molecule.positions_angstrom.emplace_back(0, 0, 0);
    molecule.chains.emplace_back("A");
    molecule.residue_names.emplace_back(name);
  }
  const std::vector<Rgba> colors = atom_colors(molecule, MoleculeStyle::kByResidue, {});
  for (std::size_t i = 0; i < colors.size(); ++i) residues.emplace_back(molecule.residue_names[i], colors[i]);
  expect_apart(residues);
}

}  // namespace
}  // namespace tandem::client
