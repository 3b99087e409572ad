// See net_charge.hpp.
#include "server/assets/structures/net_charge.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <numeric>
#include <tuple>
#include <utility>

#include "server/assets/structures/text.hpp"

namespace tandem::server {
namespace {

constexpr double kWhole_e = 0.02;
constexpr double kWholeResidue_e = 0.005;

/// Formal charges of ions, cofactors, nucleotides and modified residues, by residue name [e].
/// Source  formal charges of the components in wwPDB's Chemical Component Dictionary; phosphates and carboxylates have
///         their charges at pH 7
constexpr auto kFormalCharges = std::to_array<std::pair<std::string_view, int>>(
    {{"LI", 1},   {"NA", 1},   {"K", 1},    {"RB", 1},   {"CS", 1},   {"AG", 1},   {"CU1", 1},  {"MG", 2},
     {"CA", 2},   {"SR", 2},   {"BA", 2},   {"MN", 2},   {"FE2", 2},  {"FE", 3},   {"CO", 2},   {"NI", 2},
     {"CU", 2},   {"ZN", 2},   {"CD", 2},   {"HG", 2},   {"PB", 2},   {"AL", 3},   {"F", -1},   {"CL", -1},
     {"BR", -1},  {"IOD", -1}, {"SO4", -2}, {"PO4", -3}, {"NO3", -1}, {"SCN", -1}, {"ACT", -1}, {"FMT", -1},
     {"CIT", -3}, {"AMP", -2}, {"ADP", -3}, {"ATP", -4}, {"GDP", -3}, {"GTP", -4}, {"NAD", -1}, {"NAP", -3},
     {"FAD", -2}, {"FMN", -2}, {"HEM", -2}, {"SEP", -2}, {"TPO", -2}, {"PTR", -2}, {"A", -1},   {"C", -1},
     {"G", -1},   {"U", -1},   {"DA", -1},  {"DC", -1},  {"DG", -1},  {"DT", -1}});

bool is_whole_number(double charge_e, double tolerance_e) {
  return std::abs(charge_e - std::round(charge_e)) <= tolerance_e;
}

/// Returns the index of the first atom of each residue.
std::vector<std::size_t> first_atoms(const docking::Molecule& molecule) {
  const auto place = [&molecule](std::size_t i) {
    return std::tie(molecule.chains[i], molecule.segments[i], molecule.residue_ids[i], molecule.residue_names[i]);
  };
  std::vector<std::size_t> starts;
  for (std::size_t i = 0; i < molecule.size(); ++i) {
    if (i == 0 || place(i) != place(i - 1)) starts.push_back(i);
  }
  return starts;
}

std::string residue_text(const docking::Molecule& molecule, std::size_t atom) {
  return printable_text(molecule.residue_names[atom] + " " + molecule.residue_ids[atom] +
                        (molecule.chains[atom].empty() ? "" : " of chain " + molecule.chains[atom]));
}

}  // namespace

std::string signed_charge(double charge_e) {
  std::array<char, 32> text{};
  if (is_whole_number(charge_e, kWholeResidue_e)) {
    const double whole = std::round(charge_e);
    std::snprintf(text.data(), text.size(), whole == 0 ? "%.0f" : "%+.0f", std::abs(whole) == 0 ? 0.0 : whole);
  } else {
    std::snprintf(text.data(), text.size(), "%+.2f", charge_e);
  }
  return text.data();
}

NetCharge net_charge(const docking::Molecule& molecule, const std::vector<ImpliedCharge>& implied) {
  NetCharge result;
  std::map<std::string, std::size_t> index_of;
  for (std::size_t i = 0; i < molecule.size(); ++i) {
    const auto [entry, is_new] = index_of.try_emplace(molecule.chains[i], result.chains.size());
    if (is_new) result.chains.push_back({molecule.chains[i], 0});
    result.chains[entry->second].charge_e += molecule.charge_e[i];
    result.total_e += molecule.charge_e[i];
  }
  for (const ChainCharge& chain : result.chains) {
    if (is_whole_number(chain.charge_e, kWhole_e)) continue;
    result.fractional_chains.push_back(printable_text(chain.chain.empty() ? "(blank)" : chain.chain) + " (" +
                                       signed_charge(chain.charge_e) + " e)");
  }
  const std::vector<std::size_t> starts = first_atoms(molecule);
  auto expected = implied.begin();
  for (std::size_t r = 0; r < starts.size(); ++r) {
    const std::size_t end = r + 1 < starts.size() ? starts[r + 1] : molecule.size();
    const auto begin = molecule.charge_e.begin() + static_cast<std::ptrdiff_t>(starts[r]);
    const double charge_e = std::accumulate(begin, molecule.charge_e.begin() + static_cast<std::ptrdiff_t>(end), 0.0);
    while (expected != implied.end() && expected->first_atom < starts[r]) ++expected;
    const bool is_known = expected != implied.end() && expected->first_atom == starts[r];
    if (is_known && std::abs(charge_e - expected->charge_e) > kWholeResidue_e) {
      result.suspects.push_back(residue_text(molecule, starts[r]) + ": " + signed_charge(charge_e) + " of " +
                                signed_charge(expected->charge_e) + " e");
    } else if (!is_known && !is_whole_number(charge_e, kWholeResidue_e) &&
               !is_whole_number(result.chains[index_of[molecule.chains[starts[r]]]].charge_e, kWhole_e)) {
      result.suspects.push_back(residue_text(molecule, starts[r]) + ": " + signed_charge(charge_e) + " e");
    }
  }
  return result;
}

std::string charge_text(const NetCharge& charge) {
  std::string text = signed_charge(charge.total_e) + " e";
  if (charge.chains.size() < 2) return text;
  constexpr std::size_t kMaxChains = 12;
  std::string list;
  for (std::size_t c = 0; c < std::min(charge.chains.size(), kMaxChains); ++c) {
    const ChainCharge& chain = charge.chains[c];
    list += (list.empty() ? "" : ", ") + printable_text(chain.chain.empty() ? "(blank)" : chain.chain) + " " +
            signed_charge(chain.charge_e);
  }
  return text + " (" + list + (charge.chains.size() > kMaxChains ? ", …)" : ")");
}

std::optional<int> formal_charge_of(const PdbResidue& residue) {
  int stated = 0;
  for (const PdbAtom& atom : residue.atoms) stated += atom.formal_charge_e;
  if (stated != 0) return stated;
  const auto* const known = std::ranges::find(kFormalCharges, residue.name, &std::pair<std::string_view, int>::first);
  return known == kFormalCharges.end() ? std::nullopt : std::optional(known->second);
}

}  // namespace tandem::server
