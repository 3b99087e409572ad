// A client must read a molecule exactly as the server wrote it, and must refuse all other bytes.
#include "common/docking/molecule_asset.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include "common/base/byte_io.hpp"
#include "common/base/random.hpp"
#include "common/docking/exact_field.hpp"
#include "tests/support/molecules.hpp"

namespace tandem::docking {
namespace {

/// Byte offsets of the fields in an asset.
constexpr std::size_t kVersion = 4, kFlags = 8, kCount = 12, kFirstAtom = 16;

Molecule sample(std::size_t count) {
  std::mt19937 random(5);
  Molecule molecule = test::random_molecule(count, random);
  for (std::size_t i = 0; i < count; ++i) molecule.charge_e[i] = 0.01 * static_cast<double>(i % 7) - 0.03;
  return molecule;
}

/// Returns a molecule of 20 atoms in four residues of five atoms each.
Molecule named_sample() {
  Molecule molecule = sample(20);
  for (int i = 0; i < 20; ++i) {
    molecule.atom_names.push_back(i % 5 == 1 ? "CA" : "HD" + std::to_string(i % 5));
    molecule.elements.emplace_back(i % 5 == 1 ? "C" : "H");
    molecule.residue_names.emplace_back("GLU");
    molecule.residue_ids.push_back(std::to_string(i / 5 % 2 + 8));
    molecule.chains.emplace_back(i < 10 ? "A" : "B");
    molecule.segments.push_back(i / 15);
  }
  return molecule;
}

/// Returns the bytes with a valid checksum, as an attacker would compute it.
std::vector<std::byte> sealed(std::span<const std::byte> bytes) {
  const auto content = octets_of(bytes.first(bytes.size() - sizeof(std::uint64_t)));
  std::vector<std::uint8_t> octets(content.begin(), content.end());
  end_asset(octets);
  return bytes_of(octets);
}

std::vector<std::byte> with_number(std::size_t offset, double value) {
  std::vector<std::byte> bytes = molecule_asset_bytes(sample(20));
  std::memcpy(bytes.data() + offset, &value, sizeof value);
  return sealed(bytes);
}

TEST(MoleculeAsset, ReadsTheBitsThatItWroteSoThatBothEndsHaveTheSameField) {
  const Molecule written = sample(100);
  const auto read = molecule_from(molecule_asset_bytes(written));
  ASSERT_TRUE(read);
  EXPECT_EQ(read->positions_angstrom, written.positions_angstrom);
  EXPECT_EQ(read->sigma_angstrom, written.sigma_angstrom);
  EXPECT_EQ(read->epsilon_kj_per_mol, written.epsilon_kj_per_mol);
  EXPECT_EQ(read->charge_e, written.charge_e);
  EXPECT_EQ(read->mass_u, written.mass_u);
  const Pose far{Vec3(25, 3, -4), Quat(0.5, 0.5, -0.5, 0.5)};
  EXPECT_EQ(exact_field(*read, *read, far).force_on_b, exact_field(written, written, far).force_on_b);
}

TEST(MoleculeAsset, KeepsTheMixingOfItsForceField) {
  Molecule molecule = sample(20);
  EXPECT_FALSE(molecule_from(molecule_asset_bytes(molecule))->mixes_arithmetically);
  molecule.mixes_arithmetically = true;
  const std::vector<std::byte> arithmetic = molecule_asset_bytes(molecule);
  ASSERT_TRUE(molecule_from(arithmetic));
  EXPECT_TRUE(molecule_from(arithmetic)->mixes_arithmetically);
  for (const std::size_t field : {kVersion, kFlags}) {
    std::vector<std::byte> later = arithmetic;
    later[field] = std::byte{4};
    EXPECT_FALSE(molecule_from(sealed(later))) << field;
  }
}

TEST(MoleculeAsset, ContainsAtomsResiduesAndChains) {
  const Molecule written = named_sample();
  const auto read = molecule_from(molecule_asset_bytes(written));
  ASSERT_TRUE(read);
  EXPECT_EQ(read->atom_names, written.atom_names);
  EXPECT_EQ(read->elements, written.elements);
  EXPECT_EQ(read->chains, written.chains);
  EXPECT_EQ(read->residue_names, written.residue_names);
  EXPECT_EQ(read->residue_ids, written.residue_ids);
  EXPECT_EQ(read->segments, written.segments);
  EXPECT_EQ(residue_starts(*read), residue_starts(written));
  EXPECT_TRUE(molecule_from(molecule_asset_bytes(sample(20)))->chains.empty()) << "of a molecule without names";
}

TEST(MoleculeAsset, TextsAreShortAndPrintable) {
  Molecule molecule = named_sample();
  molecule.chains[0] = "a chain of a long name";
  molecule.atom_names[0] = "C\x1b[2J";
  molecule.residue_names[0] = "\xc3\xa9";
  const auto read = molecule_from(molecule_asset_bytes(molecule));
  ASSERT_TRUE(read);
  EXPECT_EQ(read->chains[0], "a chain ");
  EXPECT_EQ(read->atom_names[0], "C?[2J");
  EXPECT_EQ(read->residue_names[0], "??");
}

/// Detects a reader that accepts residues that overlap, are empty or have equal names: such residues are not read back
/// as written.
TEST(MoleculeAsset, ResiduesThatAreNoRunsOfAllAtomsAreRefused) {
  const std::vector<std::byte> good = molecule_asset_bytes(named_sample());
  constexpr std::size_t kResidues = kFirstAtom + 20 * 56, kFirstResidue = kResidues + 4, kResidueBytes = 8 + 2 + 4 + 2;
  const auto with = [&good](std::size_t offset, std::uint32_t value) {
    std::vector<std::byte> bytes = good;
    std::memcpy(bytes.data() + offset, &value, sizeof value);
    return sealed(bytes);
  };
  EXPECT_TRUE(molecule_from(with(kResidues, 4)));
  for (const std::uint32_t count : {1U, 3U, 5U, 21U, 0xFFFFFFFFU}) EXPECT_FALSE(molecule_from(with(kResidues, count)));
  EXPECT_FALSE(molecule_from(with(kFirstResidue, 1))) << "an atom before the first";
  for (const std::uint32_t first : {0U, 10U, 20U, 0xFFFFFFFFU}) {
    EXPECT_FALSE(molecule_from(with(kFirstResidue + kResidueBytes, first))) << first;
  }
  std::vector<std::byte> twice = good;
  std::copy_n(good.begin() + kFirstResidue + 4, kResidueBytes - 4, twice.begin() + kFirstResidue + kResidueBytes + 4);
  EXPECT_FALSE(molecule_from(sealed(twice))) << "the second is named as the first";
}

TEST(MoleculeAsset, EveryNumberOutOfItsRangeIsRefusedAlsoUnderAGoodChecksum) {
  for (std::size_t number = 0; number < 7; ++number) {
    const std::size_t offset = kFirstAtom + 8 * number;
    for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity(), 1e300, -1e300}) {
      EXPECT_FALSE(molecule_from(with_number(offset, bad))) << "number " << number << " = " << bad;
    }
  }
  EXPECT_TRUE(molecule_from(with_number(kFirstAtom, 1.5)));
  EXPECT_FALSE(molecule_from(with_number(kFirstAtom + 24, 0.05))) << "a sigma that the kernels cannot bound";
}

TEST(MoleculeAsset, CountsAndLengthsThatDoNotAgreeAreRefused) {
  const std::vector<std::byte> good = molecule_asset_bytes(named_sample());
  for (std::size_t length = 0; length < good.size(); ++length) {
    std::vector<std::byte> cut(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(length));
    EXPECT_FALSE(molecule_from(cut)) << length;
    if (length < 8) continue;
    EXPECT_FALSE(molecule_from(sealed(cut))) << length;
  }
  for (const std::uint32_t count : {0U, 19U, 21U, 0xFFFFFFFFU}) {
    std::vector<std::byte> bytes = good;
    std::memcpy(bytes.data() + kCount, &count, sizeof count);
    EXPECT_FALSE(molecule_from(sealed(bytes))) << count;
  }
}

TEST(MoleculeAsset, FlippedBytesAreRefusedOrReadAsAMoleculeThatTheFieldCanBear) {
  const std::vector<std::byte> good = molecule_asset_bytes(named_sample());
  Random random(11);
  for (int trial = 0; trial < 5000; ++trial) {
    std::vector<std::byte> bytes = good;
    for (std::uint32_t flips = 1 + random.next_u32() % 4; flips > 0; --flips) {
      bytes[random.next_u32() % bytes.size()] = static_cast<std::byte>(random.next_u32());
    }
    EXPECT_TRUE(bytes == good || !molecule_from(bytes)) << "the checksum";
    const auto molecule = molecule_from(sealed(bytes));
    if (!molecule) continue;
    EXPECT_NO_THROW(validate(*molecule));
    EXPECT_EQ(molecule_asset_bytes(*molecule), sealed(bytes));
  }
}

TEST(MoleculeAsset, AnInvalidMoleculeIsNotWritten) {
  EXPECT_THROW(molecule_asset_bytes(Molecule{}), std::invalid_argument);
  Molecule incomplete = sample(3);
  incomplete.charge_e.pop_back();
  EXPECT_THROW(molecule_asset_bytes(incomplete), std::invalid_argument);
}

}  // namespace
}  // namespace tandem::docking
