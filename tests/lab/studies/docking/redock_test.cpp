// Tests that two hands reassemble the complex of a real pair. Claims are tested on results with known values, and the
// refusal on pairs that form no complex.
#include "lab/studies/docking/redock.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "lab/metrics/capri.hpp"
#include "lab/studies/docking/docking_trial.hpp"
#include "lab/studies/docking/exit_path.hpp"
#include "lab/studies/docking/reproduce_docking.hpp"
#include "server/assets/docking_scene.hpp"
#include "tests/support/molecules.hpp"
#include "tests/support/needs.hpp"

namespace tandem::lab {
namespace {

namespace json = boost::json;

wire::MoleculeSource helix(const std::string& chain) {
  wire::MoleculeSource source;
  source.set_file(test::k3al1File.string());
  source.add_chains(chain);
  return source;
}

TEST(Redock, HandsBringAHelixHomeAndTheFieldTakesItIn) {
  TANDEM_NEEDS_FILES(test::k3al1File, test::kOplsDirectory);
  const json::object redocked =
      redock(server::docking_scene(helix("A"), helix("B"), {}), 1, 2, from_seconds(0.1), false, 1);
  EXPECT_FALSE(redocked.at("locked").get_bool());
  ASSERT_EQ(redocked.at("seeds").get_array().size(), 2U);
  for (const json::value& value : redocked.at("seeds").get_array()) {
    const json::object& row = value.get_object();
    EXPECT_GE(row.at("out_angstrom").to_number<double>(), 8);
    EXPECT_GE(row.at("intended_rmsd_angstrom").to_number<double>(), kRelease_angstrom);
    EXPECT_LE(row.at("intended_rmsd_angstrom").to_number<double>(), kFarthestRelease_angstrom);
    EXPECT_LE(row.at("settled_rmsd_angstrom").to_number<double>(), kDocked_angstrom);
    EXPECT_TRUE(row.at("docked").get_bool());
    EXPECT_EQ(row.at("end").as_string(), "docked");
    // The minimum is 0.5 Å from the native pose, so the end pose must be near the native pose too.
    EXPECT_LE(row.at("settled_rmsd_to_native_angstrom").to_number<double>(), 1);
    EXPECT_LE(row.at("settled_interface_rmsd_angstrom").to_number<double>(), 0.5);
    EXPECT_GE(row.at("settled_native_contact_share").to_number<double>(), 0.9);
    // The bound is 2 kT with kT = 0.593 kcal/mol. No force is displayed at energies up to 1 kT above the minimum (the
    // zero area), and the force is faded in over another 1 kT.
    EXPECT_LE(row.at("settled_above_minimum_kcal_per_mol").to_number<double>(), 2 * 0.593);
  }
  EXPECT_NEAR(redocked.at("minimum_rmsd_to_native_angstrom").to_number<double>(), 0.5, 0.2);
  EXPECT_GE(redocked.at("minimum_native_contact_share").to_number<double>(), 0.9);
  EXPECT_LE(redocked.at("minimum_kcal_per_mol").to_number<double>(),
            redocked.at("native_kcal_per_mol").to_number<double>());
  EXPECT_TRUE(all_hold(redock_checks(redocked)));
}

TEST(Redock, AHandThatGoesOnGuidingStaysOffTheMinimum) {
  TANDEM_NEEDS_FILES(test::k3al1File, test::kOplsDirectory);
  wire::MolecularField field;
  field.set_zero_area_kt(0);  // a zero area, i.e. a region without force, would let the ligand rest anywhere
  const wire::Scene scene = server::docking_scene(helix("A"), helix("B"), field);
  const auto settled = [&](bool guided) {
    const json::object redocked = redock(scene, 1, 1, from_seconds(0.1), guided, 1);
    return redocked.at("seeds").at(0).at("settled_rmsd_angstrom").to_number<double>();
  };
  EXPECT_LT(settled(false), 0.005);
  EXPECT_GT(settled(true), 0.02);
}

TEST(Redock, MinimaAroundTheNativePoseAreNoHigherThanTheirStartsAndOneIsTheNativeOne) {
  TANDEM_NEEDS_FILES(test::k3al1File, test::kOplsDirectory);
  const auto scene = scene_with_ligand_at(server::docking_scene(helix("A"), helix("B"), {}), {Vec3(0, 0, 100), {}});
  const auto [native, energy] = native_minimum(*scene);
  const auto minima = minima_around_native(*scene, 3, 1, 1);
  ASSERT_EQ(minima.size(), 3U);
  const docking::Molecule& ligand = *scene->world.bodies[1].molecule;
  EXPECT_TRUE(std::ranges::any_of(
      minima, [&](const auto& minimum) { return ligand_rmsd_angstrom(ligand, minimum.first, native) < 0.05; }));
  for (const auto& minimum : minima) EXPECT_LT(minimum.second, 0);
}

TEST(Redock, ALigandBehindClosedFlapsIsLockedAndTheReasonIsNamed) {
  const std::string file = "/usr/share/pymol/data/tut/1hpv.pdb";
  TANDEM_NEEDS_FILES(file, test::kOplsDirectory);
  wire::MoleculeSource protease, drug;
  protease.set_file(file);
  protease.add_chains("A");
  protease.add_chains("B");
  drug.set_file(file);
  drug.add_chains("/478");
  const json::object redocked = redock(server::docking_scene(protease, drug, {}), 1, 1, from_seconds(0.1), false, 1);
  ASSERT_TRUE(redocked.at("locked").get_bool());
  const json::object& lock = redocked.at("lock").get_object();
  EXPECT_LT(lock.at("out_angstrom").to_number<double>(), 4);
  EXPECT_LT(lock.at("out_without_hydrogens_angstrom").to_number<double>(), kExitDistance_angstrom);
  EXPECT_NE(lock.at("against").get_string().find("478 200"), std::string::npos) << "the drug's residue";
  EXPECT_LE(redocked.at("minimum_rmsd_to_native_angstrom").to_number<double>(), kNative_angstrom);
  EXPECT_FALSE(all_hold(redock_checks(redocked)));
}

std::string refusal(const std::string& receptor, const std::string& ligand) {
  try {
    redock(server::docking_scene(helix(receptor), helix(ligand), {}), 1, 1, from_seconds(0.1), false, 1);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(Redock, AMoleculeWithItselfIsRefusedAsOverlapping) {
  TANDEM_NEEDS_FILES(test::k3al1File, test::kOplsDirectory);
  const std::string message = refusal("A", "A");
  for (const char* const text : {"no complex", "overlap", "0.00 Å apart", "name two parts of one complex"}) {
    EXPECT_NE(message.find(text), std::string::npos) << text << " in: " << message;
  }
}

json::object row(double settled_angstrom, double beyond_n_per_ms, double peak_n) {
  return {{"docked", settled_angstrom <= kDocked_angstrom},
          {"out_angstrom", 8.1},
          {"settled_rmsd_angstrom", settled_angstrom},
          {"force_step_beyond_n_per_ms", beyond_n_per_ms},
          {"peak_force_n", peak_n},
          {"device_limit_n", 7}};
}

json::object of_rows(json::array rows, double minimum_angstrom = 0.3) {
  return {{"locked", false},
          {"guided", false},
          {"minimum_rmsd_to_native_angstrom", minimum_angstrom},
          {"seeds", std::move(rows)}};
}

TEST(Redock, ClaimsFailWithTheirNumbers) {
  const json::object good = row(0.2, 0.05, 1), far = row(4, 0.05, 1), jumpy = row(0.2, 0.2, 1),
                     strong = row(0.2, 0, 7.1);
  EXPECT_TRUE(all_hold(redock_checks(of_rows({good, good, good, good, far}))));
  EXPECT_FALSE(all_hold(redock_checks(of_rows({good, good, good, far}))));
  EXPECT_FALSE(all_hold(redock_checks(of_rows({good, jumpy}))));
  EXPECT_FALSE(all_hold(redock_checks(of_rows({good, strong}))));
  const json::object no_way{{"out_angstrom", 3.0}};
  EXPECT_FALSE(all_hold(redock_checks(of_rows({no_way, good}))));
  json::object locked = of_rows({no_way, no_way});
  locked["locked"] = true;
  ASSERT_EQ(redock_checks(locked).size(), 2U);
  EXPECT_FALSE(all_hold(redock_checks(locked)));
  EXPECT_TRUE(all_hold(redock_checks(of_rows({good}, 1.99))));
  EXPECT_FALSE(all_hold(redock_checks(of_rows({good}, 2.01)))) << "docked, but away from the native pose";
}

TEST(ReproduceDocking, ItsClaimsHold) {
  TANDEM_NEEDS_FILES(test::k3al1File, test::kOplsDirectory);
  const SteadyClock clock;
  for (const Check& claim : reproduce_docking(clock).claims)
    EXPECT_TRUE(claim.holds()) << claim.claim << claim.value_text();
}

}  // namespace
}  // namespace tandem::lab
