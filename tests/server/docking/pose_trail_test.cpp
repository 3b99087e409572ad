// Tests the history of rest poses without a room: detection of rest, undo and redo, and moves that the room refuses.
#include "server/docking/pose_trail.hpp"

#include <gtest/gtest.h>

#include "common/base/random.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::server {
namespace {

using namespace std::chrono_literals;

/// Number of steps after which a pose counts as a rest pose: 0.5 s at 1 kHz.
constexpr std::uint64_t kStepsOfRest = 500;

docking::Molecule three_atoms() {
  docking::Molecule molecule;
  molecule.positions_angstrom = {Vec3(0, 0, 0), Vec3(1.5, 0, 0), Vec3(0, 1.5, 0)};
  return molecule;
}

Pose at_x(double x_angstrom) {
  return {Vec3(x_angstrom, 0, 0), Quat::Identity()};
}

/// The history of a molecule's rest poses in a simulated room. A move that the history requests counts as executed by
/// the room only after execute_move() was called.
class TrailBench {
 public:
  void rest_at(double x_angstrom, std::uint64_t steps = kStepsOfRest) {
    for (std::uint64_t i = 0; i <= steps; ++i) step(x_angstrom);
  }
  void step(double x_angstrom) { trail.observe(at_x(x_angstrom), Step{step_++}, moves_); }
  void execute_move() { ++moves_; }
  double x() const { return trail.newest()->p.x(); }

  const docking::Molecule molecule = three_atoms();
  PoseTrail trail{molecule, 1ms};

 private:
  std::uint64_t step_ = 0, moves_ = 0;
};

double x_of(const std::optional<Pose>& X_AB) {
  return X_AB ? X_AB->p.x() : -1;
}

TEST(PoseTrail, UndoReturnsToThePreviousRestPoseAndRedoBack) {
  TrailBench bench;
  bench.rest_at(1);
  bench.rest_at(2);
  EXPECT_EQ(x_of(bench.trail.undo()), 1);
  bench.execute_move();
  bench.step(1);
  EXPECT_FALSE(bench.trail.undo());
  EXPECT_EQ(x_of(bench.trail.redo()), 2);
  bench.execute_move();
  bench.step(2);
  EXPECT_FALSE(bench.trail.redo());
}

TEST(PoseTrail, AShortStopIsNoRestPose) {
  TrailBench bench;
  bench.rest_at(1);
  bench.rest_at(2, kStepsOfRest - 2);
  bench.rest_at(3);
  EXPECT_EQ(x_of(bench.trail.undo()), 1);
}

TEST(PoseTrail, SlowDriftIsNoRest) {
  TrailBench bench;
  bench.rest_at(1);
  // Moves the molecule slowly, by 0.3 Å in 0.5 s. A pose counts as rest if the molecule stays within 0.1 Å for 0.5 s.
  // Here it moves by 0.1 Å in 170 steps, so no pose on the way is a rest pose.
  for (int i = 0; i < 5000; ++i) bench.step(1 + 6e-4 * i);
  bench.rest_at(5);
  EXPECT_EQ(x_of(bench.trail.undo()), 1);
}

TEST(PoseTrail, RestsNearTheCurrentEntryAreNotAdded) {
  TrailBench bench;
  bench.rest_at(1);
  bench.rest_at(1.4);
  EXPECT_FALSE(bench.trail.undo());
}

TEST(PoseTrail, SamplesFromBeforeAMoveAreSkipped) {
  TrailBench bench;
  bench.rest_at(1);
  bench.trail.move_to(at_x(5));
  bench.step(1);
  EXPECT_TRUE(bench.trail.is_moving());
  EXPECT_EQ(bench.x(), 5);
  bench.execute_move();
  bench.step(4.9);
  EXPECT_FALSE(bench.trail.is_moving());
  EXPECT_EQ(bench.x(), 4.9);
}

TEST(PoseTrail, ACancelledMoveLeavesNoTrace) {
  TrailBench bench;
  bench.rest_at(1);
  bench.rest_at(2);
  ASSERT_TRUE(bench.trail.undo());
  bench.trail.cancel_move();
  EXPECT_FALSE(bench.trail.is_moving());
  EXPECT_EQ(bench.x(), 2);
  EXPECT_FALSE(bench.trail.redo());
  EXPECT_EQ(x_of(bench.trail.undo()), 1);
}

TEST(PoseTrail, MotionByHandAfterUndoDiscardsRedo) {
  TrailBench bench;
  bench.rest_at(1);
  bench.rest_at(2);
  ASSERT_TRUE(bench.trail.undo());
  bench.execute_move();
  bench.rest_at(3);
  EXPECT_FALSE(bench.trail.redo());
  EXPECT_EQ(x_of(bench.trail.undo()), 1);
}

// Compares the history with a simple reference: a list of poses and an index. All poses are whole ångströms apart, so
// that every rest adds a new entry.
TEST(PoseTrail, RandomSequencesMatchAListWithAnIndex) {
  Random random(test::test_seed(1), 0);
  TrailBench bench;
  std::vector<double> entries;
  std::size_t at = 0;
  double x = 0;
  const auto add = [&](double to) {
    if (!entries.empty() && entries[at] == to) return;
    entries.resize(entries.empty() ? 0 : at + 1);
    if (entries.size() == 100) entries.erase(entries.begin());
    entries.push_back(to);
    at = entries.size() - 1;
  };
  bench.rest_at(x);
  add(x);
  for (int i = 0; i < 2000; ++i) {
    const std::uint64_t act = random.next_u64() % 5;
    const double other = static_cast<double>(random.next_u64() % 1000);
    if (act == 0) {
      bench.rest_at(x = other);
      add(x);
      // A visit too short for a rest pose. The history adds it only if a request then moves the molecule away.
    } else if (act == 1) {
      bench.step(x = other);
    } else if (act == 2) {
      bench.trail.move_to(at_x(other));
      add(x);
      add(x = other);
      bench.execute_move();
      bench.step(x);
    } else if (act == 3) {
      add(x);
      const auto to = bench.trail.undo();
      ASSERT_EQ(to.has_value(), at > 0) << "act " << i;
      if (!to) continue;
      ASSERT_EQ(to->p.x(), x = entries[--at]) << "act " << i;
      bench.execute_move();
      bench.step(x);
    } else {
      const auto to = bench.trail.redo();
      ASSERT_EQ(to.has_value(), at + 1 < entries.size() && entries[at] == x) << "act " << i;
      if (!to) continue;
      ASSERT_EQ(to->p.x(), x = entries[++at]) << "act " << i;
      bench.execute_move();
      bench.step(x);
    }
  }
}

}  // namespace
}  // namespace tandem::server
