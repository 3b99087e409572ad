// See residue_collector.hpp.
#include "server/assets/structures/residue_collector.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "server/assets/structures/text.hpp"

namespace tandem::server {
namespace {

constexpr std::size_t kMaxAtoms = 1'000'000;
/// More records than any residue has with all its alternate locations; then a new residue begins.
constexpr std::size_t kMaxRecordsPerResidue = 1000;
constexpr std::size_t kMaxDropped = 100'000;
constexpr std::array<std::string_view, 14> kTwoLetterElements = {"SE", "CL", "BR", "ZN", "MG", "CA", "NA",
                                                                 "FE", "MN", "CU", "CO", "NI", "CD", "LI"};

bool is_letter(char c) {
  return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z');
}

std::string upper(std::string_view text) {
  std::string result(text);
  for (char& c : result) {
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  }
  return result;
}

}  // namespace

std::string place_text(const PdbResidue& residue, std::string_view atom) {
  return printable_text(std::string(atom) + " of " + residue.name + " " + residue.id +
                        (residue.chain.empty() ? "" : " of chain " + residue.chain));
}

std::string element_of(std::string_view atom_name, std::string_view file_element, std::string_view residue_name) {
  while (!atom_name.empty() && !is_letter(atom_name.front())) atom_name.remove_prefix(1);
  const std::string name = upper(atom_name);
  const std::string stated = upper(file_element);
  for (const std::string_view element : kTwoLetterElements) {
    const bool is_stated = stated == element && name.starts_with(element);
    const bool is_ion = name == element && residue_name.starts_with(element);
    if (is_stated || is_ion) return std::string(element);
  }
  const std::string first = name.substr(0, 1);
  return first == "D" ? "H" : first;
}

void ResidueCollector::add(PdbResidue residue, PdbAtom atom, char alternate) {
  if (++atoms_ > kMaxAtoms) {
    throw docking::MoleculeError("more than 1000000 atoms; keep only the chains that are needed");
  }
  Record record{std::move(atom), alternate};
  const std::string place = std::to_string(residue.segment) + '|' + residue.chain + '|' + residue.id;
  const auto [entry, is_new] = index_of_place_.try_emplace(place, open_.size());
  if (!is_new) {
    OpenResidue& known = open_[entry->second];
    const bool other_name = known.residue.name != residue.name;
    if (other_name && record.alternate != ' ') {
      ++structure_.alternate_atoms;
      drop(residue, record, "another residue stands at its place first");
      return;
    }
    if (!other_name && known.records.size() < kMaxRecordsPerResidue) {
      known.records.push_back(std::move(record));
      return;
    }
    entry->second = open_.size();
  }
  open_.push_back({std::move(residue), {}});
  open_.back().records.push_back(std::move(record));
}

void ResidueCollector::drop(const PdbResidue& residue, const Record& record, const char* why) {
  if (structure_.dropped.size() >= kMaxDropped) return;
  structure_.dropped.push_back("atom " + place_text(residue, record.atom.name) + ": " + why);
}

/// Chooses among the alternate locations; the order of first appearance is kept.
void ResidueCollector::close(OpenResidue& open) {
  char chosen = ' ';
  for (const Record& record : open.records) {
    if (chosen == ' ') chosen = record.alternate;
  }
  const auto is_first_choice = [chosen](char alternate) { return alternate == ' ' || alternate == chosen; };
  std::unordered_map<std::string, std::size_t> kept;
  std::vector<Record> atoms;
  for (Record& record : open.records) {
    const auto [entry, is_new] = kept.try_emplace(record.atom.name, atoms.size());
    if (is_new) {
      atoms.push_back(std::move(record));
      continue;
    }
    Record& known = atoms[entry->second];
    if (!is_first_choice(known.alternate) && is_first_choice(record.alternate)) std::swap(known, record);
    const bool is_duplicate = record.alternate == known.alternate;
    ++(is_duplicate ? structure_.duplicate_atoms : structure_.alternate_atoms);
    drop(open.residue, record, is_duplicate ? "the file gives it twice" : "another alternate location is taken");
  }
  for (Record& record : atoms) open.residue.atoms.push_back(std::move(record.atom));
  structure_.residues.push_back(std::move(open.residue));
}

PdbStructure ResidueCollector::take() {
  for (OpenResidue& open : open_) close(open);
  return std::move(structure_);
}

}  // namespace tandem::server
