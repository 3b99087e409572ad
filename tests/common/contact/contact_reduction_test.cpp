#include "common/contact/contact_reduction.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "tests/support/allocation_counter.hpp"

namespace tandem::contact {
namespace {

constexpr double kStiffness_n_per_m3 = 5e9;
using Patch = std::vector<ContactPoint>;

class Numbers {
 public:
  explicit Numbers(unsigned seed) : engine_(seed) {}
  double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
  Vec3 vector(double size) { return {between(-size, size), between(-size, size), between(-size, size)}; }
  Quat rotation() { return quaternion_of(vector(3)); }

 private:
  std::mt19937 engine_;
};

ContactPoint contact_at(const Vec3& p, const Vec3& normal, double depth_m, double area_m2 = 2e-7) {
  ContactPoint contact;
  contact.p_W = p;
  contact.normal_W = normal.normalized();
  contact.depth_m = depth_m;
  contact.area_m2 = area_m2;
  return contact;
}

Patch turned(Patch patch, const Quat& turn) {
  for (ContactPoint& contact : patch) {
    contact.p_W = turn * contact.p_W;
    contact.normal_W = turn * contact.normal_W;
  }
  return patch;
}

Patch on_plane(Numbers& random) {
  Patch patch;
  const double width = random.between(0.2, 1);
  const double tilt = random.between(-1, 1);
  for (int i = 0; i < 300; ++i) {
    const Vec3 p(random.between(-0.01, 0.01), width * random.between(-0.01, 0.01), 0);
    patch.push_back(contact_at(p, Vec3::UnitZ(), 1e-4 * (1.01 + tilt * p.x() / 0.01), random.between(1e-7, 3e-7)));
  }
  return patch;
}

Patch on_sphere(Numbers& random) {
  Patch patch;
  const double rim = random.between(0.2, 0.999);
  for (int i = 0; i < 300; ++i) {
    const double z = random.between(rim, 1);
    const double angle = random.between(0, 6.28);
    const double ring = std::sqrt(1 - z * z);
    const Vec3 normal(ring * std::cos(angle), ring * std::sin(angle), z);
    patch.push_back(contact_at(0.01 * normal, normal, 1e-4 * (1e-3 + (z - rim) / (1 - rim))));
  }
  return patch;
}

// Returns contacts on the two walls of a groove with a random angle. A random fraction of them is on the first wall.
Patch in_groove(Numbers& random) {
  Patch patch;
  const double length = random.between(0.3, 2);
  const double share = random.between(0.1, 0.5);
  const double slope = random.between(0.2, 1.4);
  for (int i = 0; i < 300; ++i) {
    const double side = random.between(0, 1) < share ? 1 : -1;
    const double up = random.between(0, 0.01);
    const Vec3 p(side * std::cos(slope) * up, length * random.between(-0.01, 0.01), std::sin(slope) * up);
    patch.push_back(contact_at(p, {-side * std::sin(slope), 0, std::cos(slope)}, random.between(0, 1e-4)));
  }
  return patch;
}

Patch in_corner(Numbers& random) {
  Patch patch;
  const double share = random.between(0.1, 0.8);
  for (int i = 0; i < 300; ++i) {
    const int wall = random.between(0, 1) < share ? 0 : i % 2 + 1;
    Vec3 p(random.between(0, 0.01), random.between(0, 0.01), random.between(0, 0.01));
    p[wall] = 0;
    patch.push_back(contact_at(p, Vec3::Unit(wall), random.between(0, 1e-4)));
  }
  return patch;
}

Patch around_peg(Numbers& random) {
  Patch patch;
  const double arc = random.between(2, 6.28);
  for (int i = 0; i < 300; ++i) {
    const double angle = random.between(0, arc);
    const Vec3 normal(std::cos(angle), std::sin(angle), 0);
    patch.push_back(
        contact_at(0.005 * normal + Vec3(0, 0, random.between(-0.02, 0.02)), -normal, random.between(0, 1e-4)));
  }
  return patch;
}

struct Middle {
  Vec3 p_W = Vec3::Zero();
  double radius_m = 0;
  double pressing_n = 0;  ///< sum of the magnitudes of all forces
};

Middle middle_of(const Patch& patch) {
  Middle middle;
  double area = 0;
  for (const ContactPoint& contact : patch) {
    if (contact.depth_m <= 0) continue;
    middle.p_W += contact.area_m2 * contact.p_W;
    area += contact.area_m2;
    middle.pressing_n += kStiffness_n_per_m3 * contact.area_m2 * contact.depth_m;
  }
  middle.p_W /= area;
  for (const ContactPoint& contact : patch) {
    if (contact.depth_m > 0) middle.radius_m += contact.area_m2 * (contact.p_W - middle.p_W).squaredNorm();
  }
  middle.radius_m = std::sqrt(middle.radius_m / area);
  return middle;
}

// Scales the derivative so that all entries are forces per displacement. A rotation counts as the displacement that it
// causes at the distance `radius_m`.
Mat6 in_units_of(double radius_m, const Mat6& derivative) {
  Vec6 unit;
  unit << Vec3::Ones(), Vec3::Constant(1 / radius_m);
  return unit.asDiagonal() * derivative * unit.asDiagonal();
}

double wrench_error(const Wrench& a, const Wrench& b, const Middle& middle) {
  return ((a.f - b.f).norm() + (a.t - b.t).norm() / middle.radius_m) / middle.pressing_n;
}

struct Kind {
  std::string name;
  Patch (*make)(Numbers&);
  /// Limit of the derivative's error, slightly above the largest error in 2,000 random patches
  double derivative_error;
};

class Reduction : public testing::TestWithParam<Kind> {};

TEST_P(Reduction, KeepsTheNetWrenchAndNearlyItsDerivative) {
  for (unsigned seed = 1; seed <= 60; ++seed) {
    Numbers random(seed);
    const Patch patch = turned(GetParam().make(random), random.rotation());
    const Middle middle = middle_of(patch);
    std::array<ReducedContact, kReducedContacts> out;
    ASSERT_EQ(reduce_contacts(patch, kStiffness_n_per_m3, out), kReducedContacts);
    const ContactWrench all = contact_wrench(patch, kStiffness_n_per_m3, middle.p_W);
    const ContactWrench few = contact_wrench(out, middle.p_W);
    EXPECT_LT(wrench_error(few.on_a_W, all.on_a_W, middle), 1e-9) << "seed " << seed;
    const Mat6 wanted = in_units_of(middle.radius_m, all.derivative);
    const Mat6 error = in_units_of(middle.radius_m, few.derivative - all.derivative);
    EXPECT_LT(error.norm(), GetParam().derivative_error * wanted.norm()) << "seed " << seed;
  }
}

TEST_P(Reduction, PushesWithinThePatch) {
  for (unsigned seed = 1; seed <= 60; ++seed) {
    Numbers random(seed);
    const Patch patch = turned(GetParam().make(random), random.rotation());
    const Middle middle = middle_of(patch);
    std::array<ReducedContact, kReducedContacts> out;
    reduce_contacts(patch, kStiffness_n_per_m3, out);
    for (const ReducedContact& contact : out) {
      EXPECT_NEAR(contact.normal_W.norm(), 1, 1e-9);
      EXPECT_GT(contact.stiffness_n_per_m, 0);
      EXPECT_LT((contact.p_W - middle.p_W).norm(), 5 * middle.radius_m) << "seed " << seed;
      EXPECT_GT(contact.force_on_a_W.dot(contact.normal_W), -0.01 * middle.pressing_n) << "seed " << seed;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Patches, Reduction,
                         testing::Values(Kind{"plane", on_plane, 1e-6}, Kind{"sphere", on_sphere, 0.002},
                                         Kind{"groove", in_groove, 0.06}, Kind{"corner", in_corner, 0.08},
                                         Kind{"peg", around_peg, 0.09}),
                         [](const auto& kind) { return kind.param.name; });

template <typename Contact>
void move(std::vector<Contact>& contacts, const Vec3& about, const Vec3& shift, const Vec3& turn);

template <>
void move(Patch& contacts, const Vec3& about, const Vec3& shift, const Vec3& turn) {
  for (ContactPoint& contact : contacts) {
    const Vec3 p = about + shift + quaternion_of(turn) * (contact.p_W - about);
    contact.depth_m -= contact.normal_W.dot(p - contact.p_W);
    contact.p_W = p;
  }
}

template <>
void move(std::vector<ReducedContact>& contacts, const Vec3& about, const Vec3& shift, const Vec3& turn) {
  for (ReducedContact& contact : contacts) {
    const Vec3 p = about + shift + quaternion_of(turn) * (contact.p_W - about);
    const double deeper = -contact.normal_W.dot(p - contact.p_W);
    contact.force_on_a_W += contact.stiffness_n_per_m * deeper * contact.normal_W;
    contact.p_W = p;
  }
}

// Computes the derivative of `wrench` by central differences. `wrench` is a function of translation and rotation.
Mat6 differences(const std::function<Wrench(const Vec3&, const Vec3&)>& wrench) {
  Mat6 derivative;
  constexpr double kStep = 1e-6;
  for (int column = 0; column < 6; ++column) {
    Vec3 shift = Vec3::Zero();
    Vec3 turn = Vec3::Zero();
    (column < 3 ? shift[column] : turn[column - 3]) = kStep;
    const Wrench change = (wrench(shift, turn) - wrench(-shift, -turn)) * (0.5 / kStep);
    derivative.col(column) << change.f, change.t;
  }
  return derivative;
}

TEST(ContactWrench, DerivativeIsThatOfFiniteDifferences) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    Numbers random(seed);
    Patch patch;
    std::vector<ReducedContact> reduced;
    for (int i = 0; i < 20; ++i) {
      // One part of the derivative is proportional to the forces. The large depths make this part significant, so that
      // a derivative without it fails.
      patch.push_back(contact_at(random.vector(0.01), random.vector(1), random.between(1e-3, 5e-3)));
      reduced.push_back({random.vector(0.01), random.vector(1).normalized(), random.vector(5), 1e3});
    }
    const Vec3 about = random.vector(0.02);
    const Mat6 of_all = differences([&](const Vec3& shift, const Vec3& turn) {
      Patch moved = patch;
      move(moved, about, shift, turn);
      return contact_wrench(moved, kStiffness_n_per_m3, about).on_a_W;
    });
    const Mat6 of_few = differences([&](const Vec3& shift, const Vec3& turn) {
      std::vector<ReducedContact> moved = reduced;
      move(moved, about, shift, turn);
      return contact_wrench(moved, about).on_a_W;
    });
    const Mat6 all = contact_wrench(patch, kStiffness_n_per_m3, about).derivative;
    const Mat6 few = contact_wrench(reduced, about).derivative;
    EXPECT_LT((all - of_all).norm(), 1e-7 * all.norm()) << "seed " << seed;
    EXPECT_LT((few - of_few).norm(), 1e-7 * few.norm()) << "seed " << seed;
  }
}

TEST(ContactWrench, AContactWithoutPressureHasNone) {
  const Patch patch = {contact_at(Vec3::Zero(), Vec3::UnitZ(), -1e-4), contact_at(Vec3::Zero(), Vec3::UnitZ(), 0)};
  const ContactWrench net = contact_wrench(patch, kStiffness_n_per_m3, Vec3(1, 2, 3));
  EXPECT_EQ(net.on_a_W.f, Vec3::Zero());
  EXPECT_EQ(net.derivative, Mat6::Zero());
}

// Returns the contacts of a sphere that rolls into a groove: first on one wall, then on both. `way` is the progress of
// the motion. Points of the sphere enter and leave the contact.
Patch rolling(double way) {
  Patch patch;
  constexpr int kPoints = 8000;
  constexpr double kRadius_m = 0.01;
  const Vec3 centre(3e-4 * way, 1e-3 * way, 0.0141 - 1e-4 * way);
  const Quat turn = quaternion_of(Vec3(0.3, 0.1, 0.5) * way);
  for (int i = 0; i < kPoints; ++i) {
    const double z = 1 - (2 * i + 1.0) / kPoints;
    const double ring = std::sqrt(1 - z * z);
    const Vec3 p = centre + kRadius_m * (turn * Vec3(ring * std::cos(2.4 * i), ring * std::sin(2.4 * i), z));
    for (const double side : {-1.0, 1.0}) {
      const Vec3 normal = Vec3(side, 0, 1).normalized();
      const double depth = -normal.dot(p);
      if (depth > -1e-4) patch.push_back(contact_at(p, normal, depth, 1.6e-7));
    }
  }
  return patch;
}

TEST(ContactReduction, ChangesNoMoreAtOnceThanThePatchDoes) {
  std::array<ReducedContact, kReducedContacts> before;
  std::array<ReducedContact, kReducedContacts> now;
  ContactWrench few_before;
  ContactWrench all_before;
  double farthest = 0;
  constexpr int kSteps = 400;
  for (int i = 0; i <= kSteps; ++i) {
    const Patch patch = rolling(0.5 + 0.5 * i / kSteps);
    const Middle middle = middle_of(patch);
    ASSERT_EQ(reduce_contacts(patch, kStiffness_n_per_m3, now), kReducedContacts) << "step " << i;
    const Vec3 about(0, 0, 0.004);
    const ContactWrench all = contact_wrench(patch, kStiffness_n_per_m3, about);
    const ContactWrench few = contact_wrench(now, about);
    if (i > 0) {
      EXPECT_LT(wrench_error(few.on_a_W - few_before.on_a_W, all.on_a_W - all_before.on_a_W, middle), 1e-9);
      const Mat6 change = in_units_of(middle.radius_m, few.derivative - few_before.derivative);
      const Mat6 true_change = in_units_of(middle.radius_m, all.derivative - all_before.derivative);
      const double size = in_units_of(middle.radius_m, all.derivative).norm();
      EXPECT_LT((change - true_change).norm(), 2e-4 * size + 0.02 * true_change.norm()) << "step " << i;
      for (std::size_t k = 0; k < now.size(); ++k) {
        farthest = std::max(farthest, (now[k].p_W - before[k].p_W).norm() / middle.radius_m);
      }
    }
    before = now;
    few_before = few;
    all_before = all;
  }
  // If one of n neighbouring points enters or leaves, their mean moves by about 1/n of their spread. A larger step
  // would be a discontinuity of the reduction.
  EXPECT_LT(farthest, 0.2);
}

TEST(ContactReduction, GivesFewContactsAsTheyAre) {
  Numbers random(1);
  Patch patch = on_plane(random);
  patch.resize(16);
  patch[3].depth_m = -1e-5;
  std::array<ReducedContact, 15> out;
  ASSERT_EQ(reduce_contacts(patch, kStiffness_n_per_m3, out), 15U);
  EXPECT_EQ(out[2].p_W, patch[2].p_W);
  EXPECT_EQ(out[3].p_W, patch[4].p_W) << "a contact without pressure must be omitted";
  EXPECT_EQ(out[3].stiffness_n_per_m, kStiffness_n_per_m3 * patch[4].area_m2);
}

TEST(ContactReduction, EightSlotsKeepTheWrenchToo) {
  for (unsigned seed = 1; seed <= 40; ++seed) {
    Numbers random(seed);
    const Patch patch = turned(in_groove(random), random.rotation());
    const Middle middle = middle_of(patch);
    std::array<ReducedContact, 15> out;
    ASSERT_EQ(reduce_contacts(patch, kStiffness_n_per_m3, out), kReducedContactsMin);
    const ContactWrench all = contact_wrench(patch, kStiffness_n_per_m3, middle.p_W);
    const ContactWrench few = contact_wrench(std::span(out).first(kReducedContactsMin), middle.p_W);
    EXPECT_LT(wrench_error(few.on_a_W, all.on_a_W, middle), 1e-9) << "seed " << seed;
    EXPECT_LT(in_units_of(middle.radius_m, few.derivative - all.derivative).norm(),
              0.2 * in_units_of(middle.radius_m, all.derivative).norm())
        << "seed " << seed;
  }
}

TEST(ContactReduction, GivesNoContactsWithoutPressureOrSpace) {
  Numbers random(1);
  Patch patch = on_plane(random);
  std::array<ReducedContact, 7> out;
  EXPECT_EQ(reduce_contacts(patch, kStiffness_n_per_m3, out), 0U);
  for (ContactPoint& contact : patch) contact.depth_m = -contact.depth_m;
  EXPECT_EQ(reduce_contacts(patch, kStiffness_n_per_m3, out), 0U);
  EXPECT_EQ(reduce_contacts({}, kStiffness_n_per_m3, out), 0U);
}

TEST(ContactReduction, StandsPatchesWithoutExtent) {
  Patch line;
  Patch spot;
  for (int i = 0; i < 100; ++i) {
    line.push_back(contact_at(Vec3(1e-4 * i, 0, 0), Vec3(0, 0.01 * i, 1), 1e-6 * (i + 1)));
    spot.push_back(contact_at(Vec3(1, 2, 3), Vec3::UnitZ(), 1e-6 * (i + 1)));
  }
  for (const Patch& patch : {line, spot}) {
    std::array<ReducedContact, kReducedContacts> out;
    ASSERT_EQ(reduce_contacts(patch, kStiffness_n_per_m3, out), kReducedContacts);
    Middle middle = middle_of(patch);
    middle.radius_m = std::max(1e-3, middle.radius_m);
    const ContactWrench all = contact_wrench(patch, kStiffness_n_per_m3, middle.p_W);
    const ContactWrench few = contact_wrench(out, middle.p_W);
    EXPECT_LT(wrench_error(few.on_a_W, all.on_a_W, middle), 1e-9);
    EXPECT_LT(in_units_of(middle.radius_m, few.derivative - all.derivative).norm(),
              0.02 * in_units_of(middle.radius_m, all.derivative).norm());
  }
}

TEST(ContactReduction, AllocatesNothing) {
  Numbers random(1);
  const Patch patch = in_groove(random);
  std::array<ReducedContact, kReducedContacts> out;
  const std::uint64_t before = test::allocation_count();
  reduce_contacts(patch, kStiffness_n_per_m3, out);
  contact_wrench(out, Vec3::Zero());
  EXPECT_EQ(test::allocation_count(), before);
}

}  // namespace
}  // namespace tandem::contact
