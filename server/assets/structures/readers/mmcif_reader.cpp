// See mmcif_reader.hpp.
#include "server/assets/structures/readers/mmcif_reader.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "server/assets/structures/elements.hpp"
#include "server/assets/structures/text.hpp"

namespace tandem::server {
namespace {

constexpr std::string_view kMmcifBlanks = " \t\r\n";
constexpr std::size_t kMaxColumns = 200;
constexpr double kMaxFormalCharge_e = 20;

/// Compares keywords or names of CIF, which ignores case.
bool is_named(std::string_view text, std::string_view name) {
  return std::ranges::equal(text, name, {}, small_letter, small_letter);
}

/// A word of the file: a value or a keyword. A quoted word is always a value.
struct Word {
  std::string_view text;
  bool is_quoted = false;

  bool is_keyword(std::string_view keyword) const { return !is_quoted && begins_with_any_case(text, keyword); }
  bool ends_loop() const {
    return is_keyword("_") || is_keyword("loop_") || is_keyword("data_") || is_keyword("save_");
  }
  /// Returns the value of the word. "." and "?" mean that there is no value.
  std::string_view value() const { return !is_quoted && (text == "." || text == "?") ? std::string_view() : text; }
};

class MmcifWords {
 public:
  explicit MmcifWords(std::string_view text) : text_(text) {}

  bool next(Word& word) {
    skip();
    if (at_ >= text_.size()) return false;
    const char first = text_[at_];
    if (first == ';' && (at_ == 0 || text_[at_ - 1] == '\n')) {
      word = {until("\n;", at_ + 1), true};
      at_ = std::min(at_ + word.text.size() + 3, text_.size());
    } else if (first == '\'' || first == '"') {
      std::size_t end = at_ + 1;
      // A quote character ends the value only if a blank follows it.
      while (end < text_.size() && text_[end] != '\n' && !(text_[end] == first && is_blank(end + 1))) ++end;
      word = {text_.substr(at_ + 1, end - at_ - 1), true};
      at_ = std::min(end + 1, text_.size());
    } else {
      const std::size_t end = std::min(text_.find_first_of(kMmcifBlanks, at_), text_.size());
      word = {text_.substr(at_, end - at_), false};
      at_ = end;
    }
    return true;
  }

  std::size_t position() const { return at_; }
  std::size_t line_of(std::size_t position) const {
    return 1 + static_cast<std::size_t>(
                   std::count(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(position), '\n'));
  }

 private:
  bool is_blank(std::size_t i) const {
    return i >= text_.size() || kMmcifBlanks.find(text_[i]) != std::string_view::npos;
  }
  std::string_view until(std::string_view mark, std::size_t from) const {
    return text_.substr(from, std::min(text_.find(mark, from), text_.size()) - from);
  }
  void skip() {
    while (true) {
      at_ = std::min(text_.find_first_not_of(kMmcifBlanks, at_), text_.size());
      if (at_ >= text_.size() || text_[at_] != '#') return;
      at_ = std::min(text_.find('\n', at_), text_.size());
    }
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

constexpr std::size_t kNone = static_cast<std::size_t>(-1);

class MmcifParser {
 public:
  MmcifParser(std::string_view text, const std::string& source) : words_(text), source_(source) {}

  PdbStructure parse() {
    Word word;
    bool has_word = words_.next(word);
    while (has_word) {
      if (!word.is_keyword("loop_")) {
        has_word = words_.next(word);
        continue;
      }
      std::vector<std::string_view> tags;
      while ((has_word = words_.next(word)) && word.is_keyword("_") && tags.size() < kMaxColumns)
        tags.push_back(word.text);
      if (tags.empty() || !begins_with_any_case(tags.front(), "_atom_site.")) continue;
      read_atoms(tags, word, has_word);
      PdbStructure structure = residues_.finish();
      structure.has_more_models = has_more_models_;
      return structure;
    }
    throw docking::MoleculeError(source_ + ": no _atom_site loop; a structure in mmCIF with coordinates is needed");
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw docking::MoleculeError(source_ + ":" + std::to_string(words_.line_of(row_at_)) + ": " + what);
  }

  void read_atoms(const std::vector<std::string_view>& tags, Word word, bool has_word) {
    tags_ = &tags;
    const std::array<std::size_t, 3> xyz = {column("Cartn_x"), column("Cartn_y"), column("Cartn_z")};
    if (std::find(xyz.begin(), xyz.end(), kNone) != xyz.end()) fail("_atom_site lacks Cartn_x, Cartn_y or Cartn_z");
    name_ = column("auth_atom_id", "label_atom_id");
    residue_ = column("auth_comp_id", "label_comp_id");
    chain_ = column("auth_asym_id", "label_asym_id");
    number_ = column("auth_seq_id", "label_seq_id");
    entity_ = column("label_asym_id");
    insertion_ = column("pdbx_PDB_ins_code");
    alternate_ = column("label_alt_id");
    element_ = column("type_symbol");
    model_ = column("pdbx_PDB_model_num");
    occupancy_ = column("occupancy");
    formal_charge_ = column("pdbx_formal_charge");
    row_.resize(tags.size());
    while (has_word && !word.ends_loop()) {
      row_at_ = words_.position();
      for (std::size_t c = 0; c < row_.size(); ++c) {
        if (!has_word || word.ends_loop()) fail("a row of _atom_site is cut off");
        row_[c] = word.value();
        has_word = words_.next(word);
      }
      if (!add_row(xyz)) return;
    }
  }

  std::size_t column(std::string_view wanted, std::string_view otherwise = {}) const {
    for (std::size_t c = 0; c < tags_->size(); ++c) {
      if (is_named((*tags_)[c].substr((*tags_)[c].find('.') + 1), wanted)) return c;
    }
    return otherwise.empty() ? kNone : column(otherwise);
  }

  std::string_view value(std::size_t c) const { return c == kNone ? std::string_view() : row_[c]; }

  /// Adds the atom of a row. Returns false if the row belongs to a later model.
  bool add_row(const std::array<std::size_t, 3>& xyz) {
    if (residues_.atom_count() == 0) first_model_ = value(model_);
    has_more_models_ = value(model_) != first_model_;
    if (has_more_models_) return false;
    PdbResidue residue;
    residue.name = value(residue_);
    residue.chain = value(chain_);
    residue.id = std::string(value(number_)) + std::string(value(insertion_));
    if (value(entity_) != last_entity_) ++segment_;
    last_entity_ = value(entity_);
    residue.segment = segment_;
    PdbAtom atom;
    atom.name = value(name_);
    atom.element = element_of({atom.name, value(element_), residue.name});
    if (double occupancy = 0; parse_finite(value(occupancy_), occupancy)) atom.occupancy = occupancy;
    double formal = 0;
    if (parse_finite(value(formal_charge_), formal) && std::abs(formal) <= kMaxFormalCharge_e) {
      atom.formal_charge_e = static_cast<int>(formal);
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      double& coordinate = atom.position_angstrom[static_cast<Eigen::Index>(axis)];
      if (!parse_finite(row_[xyz[axis]], coordinate) || std::abs(coordinate) > kMaxCoordinateAngstrom) {
        fail("coordinate " + quoted_text(row_[xyz[axis]]) +
             " is not a number within 1e6 Å; correct or delete this row");
      }
    }
    const std::string_view alternate = value(alternate_);
    try {
      residues_.add(std::move(residue), std::move(atom), alternate.empty() ? ' ' : alternate.front());
    } catch (const docking::MoleculeError& error) {
      fail(error.what());
    }
    return true;
  }

  MmcifWords words_;
  const std::string& source_;
  ResidueCollector residues_;
  const std::vector<std::string_view>* tags_ = nullptr;
  std::vector<std::string_view> row_;
  std::size_t row_at_ = 0;  ///< position in the file after the first word of the row
  std::size_t name_ = kNone, residue_ = kNone, chain_ = kNone, number_ = kNone, entity_ = kNone, insertion_ = kNone,
              alternate_ = kNone, element_ = kNone, model_ = kNone, occupancy_ = kNone, formal_charge_ = kNone;
  std::string_view first_model_, last_entity_;
  int segment_ = 0;
  bool has_more_models_ = false;
};

}  // namespace

PdbStructure parse_mmcif(std::string_view text, const std::string& source) {
  return MmcifParser(text, source).parse();
}

}  // namespace tandem::server
