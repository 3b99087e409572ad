// See residue_collector.hpp.
#include "server/assets/structures/residue_collector.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "server/assets/structures/text.hpp"

namespace tandem::server {
namespace {

constexpr std::size_t kMaxAtoms = 1'000'000;
/// Limit of the number of records in one residue. It exceeds that of any real residue with all of its alternate
/// locations. At the limit, the next record begins a new residue.
constexpr std::size_t kMaxRecordsPerResidue = 1000;
constexpr std::size_t kMaxDropped = 100'000;
/// Largest distance between two positions that count as equal, in files with three decimals.
constexpr double kOnePlaceAngstrom = 0.01;
/// Largest distance at which two atoms of the same name are two positions of one atom. It is below any bond length.
constexpr double kNearerThanAnyBondAngstrom = 0.6;
/// Largest distance of an atom from the nearest other atom of its residue.
constexpr double kMaxBondAngstrom = 2.5;

/// Statistics of the alternate locations, in the order of their first occurrence in the file.
class Alternates {
 public:
  void add(char letter, const PdbAtom& atom) {
    const auto known = std::ranges::find(all_, letter, &Entry::letter);
    Entry& entry = known == all_.end() ? all_.emplace_back(Entry{letter}) : *known;
    ++entry.atoms;
    // Occupancies of hydrogens are ignored, because programs that add hydrogens set arbitrary values.
    if (atom.element == "H") return;
    entry.heavy_occupancy += atom.occupancy;
    ++entry.heavy_atoms;
  }
  bool has(char letter) const { return std::ranges::find(all_, letter, &Entry::letter) != all_.end(); }
  /// Returns the location with the largest mean occupancy, rounded to two digits. Among equal occupancies, the location
  /// with the most atoms is chosen, then the first. Returns ' ' if there is no location.
  char best() const {
    const auto found = std::ranges::max_element(all_, {}, [](const Entry& e) {
      return std::pair(std::round(100 * e.heavy_occupancy / std::max(1.0, e.heavy_atoms)), e.atoms);
    });
    return found == all_.end() ? ' ' : found->letter;
  }

 private:
  struct Entry {
    char letter;
    double heavy_occupancy = 0;
    double heavy_atoms = 0;
    double atoms = 0;
  };
  std::vector<Entry> all_;
};

}  // namespace

bool has_own_charges(const PdbResidue& residue) {
  return !residue.atoms.empty() && residue.atoms.front().charge_e.has_value();
}

std::string residue_place(const PdbResidue& residue) {
  return residue.name + " " + residue.id + (residue.chain.empty() ? "" : " of chain " + residue.chain);
}

std::string place_text(const PdbResidue& residue, std::string_view atom) {
  return printable_text(std::string(atom) + " of " + residue_place(residue));
}

bool ResidueCollector::belongs_to(const OpenResidue& known, const PdbResidue& residue, const Record& record) const {
  if (known.residue.name != residue.name || known.records.size() >= kMaxRecordsPerResidue) return false;
  const bool is_latest = &known == &open_.back();
  const auto has_name = [&known, &record](std::string_view name) {
    return std::ranges::any_of(known.records,
                               [&](const Record& r) { return r.atom.name == name && r.alternate == record.alternate; });
  };
  const auto distance = [&record](const Record& other) {
    return (other.atom.position_angstrom - record.atom.position_angstrom).norm();
  };
  if (is_latest) {
    const bool begins_again = record.atom.name == "N" && has_name("N") && has_name("CA") && has_name("C");
    return !begins_again || std::ranges::any_of(known.records, [&distance, &record](const Record& r) {
      return r.atom.name == record.atom.name && distance(r) < kNearerThanAnyBondAngstrom;
    });
  }
  return std::ranges::any_of(known.records, [&distance](const Record& r) { return distance(r) < kMaxBondAngstrom; });
}

void ResidueCollector::add(PdbResidue residue, PdbAtom atom, char alternate) {
  if (++atoms_ > kMaxAtoms) {
    throw docking::MoleculeError("more than 1000000 atoms; keep only the chains that are needed");
  }
  Record record{std::move(atom), alternate};
  const std::string place =
      std::to_string(residue.segment) + '|' + residue.segment_name + '|' + residue.chain + '|' + residue.id;
  const auto [entry, is_new] = index_of_place_.try_emplace(place, open_.size());
  std::size_t first_place = open_.size();
  if (!is_new) {
    // Alternate residues with different names may have the same number in the chain, and their atoms may alternate in
    // the file. The atom may therefore belong to the last opened residue of this number, or to the first one.
    for (const std::size_t index : {entry->second, open_[entry->second].place}) {
      if (!belongs_to(open_[index], residue, record)) continue;
      open_[index].records.push_back(std::move(record));
      return;
    }
    const OpenResidue& known = open_[entry->second];
    if (known.residue.name != residue.name && alternate != ' ') first_place = known.place;
    entry->second = open_.size();
  }
  OpenResidue& opened = open_.emplace_back();
  opened.residue = std::move(residue);
  opened.records.push_back(std::move(record));
  opened.place = first_place;
}

void ResidueCollector::drop(const PdbResidue& residue, const Record& record, const char* why) {
  if (structure_.dropped.size() >= kMaxDropped) return;
  structure_.dropped.push_back("atom " + place_text(residue, record.atom.name) + ": " + why);
}

/// Returns whether both atoms of the chain bond between two residues have alternate locations.
bool ResidueCollector::are_linked(const OpenResidue& before, const OpenResidue& after) {
  const auto alternates = [](const OpenResidue& open, std::string_view a, std::string_view b) {
    return std::ranges::any_of(
        open.records, [&](const Record& r) { return r.alternate != ' ' && (r.atom.name == a || r.atom.name == b); });
  };
  return before.residue.chain == after.residue.chain && before.residue.segment == after.residue.segment &&
         alternates(before, "C", "O3'") && alternates(after, "N", "P");
}

void ResidueCollector::choose_alternates() {
  std::size_t begin = 0;
  for (std::size_t r = 1; r <= open_.size(); ++r) {
    const bool goes_on =
        r < open_.size() && (open_[r].place == open_[r - 1].place || are_linked(open_[r - 1], open_[r]));
    if (goes_on) continue;
    choose_alternate(begin, r);
    begin = r;
  }
}

/// Chooses one alternate location for consecutive residues whose chain bonds have alternate locations, because their
/// choices must agree. A residue that lacks the chosen location gets the best of its own locations.
void ResidueCollector::choose_alternate(std::size_t begin, std::size_t end) {
  Alternates all;
  std::map<std::size_t, Alternates> of_place;
  for (std::size_t r = begin; r < end; ++r) {
    for (const Record& record : open_[r].records) {
      if (record.alternate == ' ') continue;
      all.add(record.alternate, record.atom);
      of_place[open_[r].place].add(record.alternate, record.atom);
    }
  }
  const char best = all.best();
  for (std::size_t r = begin; r < end; ++r) {
    const Alternates& own = of_place[open_[r].place];
    open_[r].chosen = own.has(best) ? best : own.best();
  }
}

/// Returns whether the letter of an alternate location can be ignored, because the atom has full occupancy and no other
/// location.
bool ResidueCollector::is_only_one(const OpenResidue& open, const Record& record) {
  constexpr double kAlways = 0.995;
  return record.atom.occupancy >= kAlways && std::ranges::none_of(open.records, [&record](const Record& other) {
           return other.atom.name == record.atom.name && other.alternate != record.alternate;
         });
}

/// Removes atoms that are not at the chosen location, and duplicates. The remaining atoms keep the order of the file.
void ResidueCollector::close(OpenResidue& open) {
  std::unordered_map<std::string, std::vector<std::size_t>> kept;  // indices of kept atoms by name
  std::vector<char> alternates;
  for (const Record& record : open.records) {
    if (record.alternate != ' ' && record.alternate != open.chosen && !is_only_one(open, record)) {
      ++structure_.alternate_atoms;
      drop(open.residue, record, "another alternate location is taken");
      continue;
    }
    std::vector<std::size_t>& same_name = kept[record.atom.name];
    double nearest = kMaxCoordinateAngstrom;
    for (const std::size_t i : same_name) {
      const Vec3& other = open.residue.atoms[i].position_angstrom;
      nearest = std::min(nearest, (other - record.atom.position_angstrom).norm());
    }
    const bool is_alternate =
        std::ranges::any_of(same_name, [&](std::size_t i) { return alternates[i] != record.alternate; });
    if (is_alternate || nearest < kNearerThanAnyBondAngstrom) {
      const bool is_duplicate = nearest < kOnePlaceAngstrom;
      ++(is_duplicate ? structure_.duplicate_atoms : structure_.alternate_atoms);
      drop(open.residue, record,
           is_duplicate   ? "the file gives it twice"
           : is_alternate ? "another alternate location is taken"
                          : "nearer than any bond to another of its name");
      continue;
    }
    same_name.push_back(open.residue.atoms.size());
    alternates.push_back(record.alternate);
    open.residue.atoms.push_back(record.atom);
  }
}

/// Uses the segment names as chain names, if a file has no chain names but several segment names.
void ResidueCollector::name_chains_by_segment() {
  std::set<std::string_view> names;
  for (const OpenResidue& open : open_) {
    if (!open.residue.chain.empty()) return;
    names.insert(open.residue.segment_name);
  }
  if (names.size() < 2) return;
  for (OpenResidue& open : open_) open.residue.chain = open.residue.segment_name;
}

PdbStructure ResidueCollector::finish() {
  name_chains_by_segment();
  choose_alternates();
  for (OpenResidue& open : open_) {
    const bool is_rival = open.chosen != ' ' && std::ranges::none_of(open.records, [&open](const Record& record) {
                            return record.alternate == ' ' || record.alternate == open.chosen;
                          });
    if (is_rival) {
      structure_.alternate_atoms += open.records.size();
      for (const Record& record : open.records) {
        drop(open.residue, record, "another residue of its place has the larger occupancy");
      }
      continue;
    }
    close(open);
    if (!open.residue.atoms.empty()) structure_.residues.push_back(std::move(open.residue));
  }
  return std::move(structure_);
}

}  // namespace tandem::server
