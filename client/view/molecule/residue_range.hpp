// Ranges of residues as a user types them: "A:10-25, B:3". No display is needed.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/docking/molecule.hpp"

namespace tandem::client {

/// Residues of one chain, or of all.
struct ResidueRange {
  std::string chain{};                     ///< name of the chain; empty: all chains
  std::optional<int> first{}, last{};      ///< first and last residue number, both included; empty: all residues
  std::optional<std::string> insertion{};  ///< insertion code of the residues; empty: any code

  bool operator==(const ResidueRange&) const = default;
};

inline constexpr std::size_t kMaxRanges = 32;

/// Parses ranges separated by commas. Returns nothing if the text has a different form, or more than kMaxRanges ranges.
/// Forms:
/// * "A:10-25": several residues of chain A; "A:12": one residue; "A:12B": with the insertion code B
/// * "10-25": these residues in all chains
/// * "A" or "1:": a whole chain
std::optional<std::vector<ResidueRange>> parse_residues(std::string_view text);

/// Returns true if a residue belongs to a range.
/// In      id  number and insertion code, as in Molecule::residue_ids
bool is_in(const ResidueRange& range, std::string_view chain, std::string_view id);

}  // namespace tandem::client
