// See elements.hpp.
#include "server/assets/structures/elements.hpp"

#include <algorithm>
#include <array>

#include "server/assets/structures/text.hpp"

namespace tandem::server {
namespace {

constexpr double kSigmaPerMinimum = 0.890898718140339;  // σ divided by the distance of the minimum: 2^(-1/6)

constexpr std::array<ChemicalElement, 103> kPeriodicTable = {
    {{"H", 1.008, 2.886, 0.044},   {"HE", 4.0026, 2.362, 0.056}, {"LI", 6.94, 2.451, 0.025},
     {"BE", 9.0122, 2.745, 0.085}, {"B", 10.81, 4.083, 0.18},    {"C", 12.011, 3.851, 0.105},
     {"N", 14.007, 3.66, 0.069},   {"O", 15.999, 3.5, 0.06},     {"F", 18.998, 3.364, 0.05},
     {"NE", 20.18, 3.243, 0.042},  {"NA", 22.99, 2.983, 0.03},   {"MG", 24.305, 3.021, 0.111},
     {"AL", 26.982, 4.499, 0.505}, {"SI", 28.085, 4.295, 0.402}, {"P", 30.974, 4.147, 0.305},
     {"S", 32.06, 4.035, 0.274},   {"CL", 35.45, 3.947, 0.227},  {"AR", 39.948, 3.868, 0.185},
     {"K", 39.098, 3.812, 0.035},  {"CA", 40.078, 3.399, 0.238}, {"SC", 44.956, 3.295, 0.019},
     {"TI", 47.867, 3.175, 0.017}, {"V", 50.942, 3.144, 0.016},  {"CR", 51.996, 3.023, 0.015},
     {"MN", 54.938, 2.961, 0.013}, {"FE", 55.845, 2.912, 0.013}, {"CO", 58.933, 2.872, 0.014},
     {"NI", 58.693, 2.834, 0.015}, {"CU", 63.546, 3.495, 0.005}, {"ZN", 65.38, 2.763, 0.124},
     {"GA", 69.723, 4.383, 0.415}, {"GE", 72.63, 4.28, 0.379},   {"AS", 74.922, 4.23, 0.309},
     {"SE", 78.971, 4.205, 0.291}, {"BR", 79.904, 4.189, 0.251}, {"KR", 83.798, 4.141, 0.22},
     {"RB", 85.468, 4.114, 0.04},  {"SR", 87.62, 3.641, 0.235},  {"Y", 88.906, 3.345, 0.072},
     {"ZR", 91.224, 3.124, 0.069}, {"NB", 92.906, 3.165, 0.059}, {"MO", 95.95, 3.052, 0.056},
     {"TC", 97, 2.998, 0.048},     {"RU", 101.07, 2.963, 0.056}, {"RH", 102.91, 2.929, 0.053},
     {"PD", 106.42, 2.899, 0.048}, {"AG", 107.87, 3.148, 0.036}, {"CD", 112.41, 2.848, 0.228},
     {"IN", 114.82, 4.463, 0.599}, {"SN", 118.71, 4.392, 0.567}, {"SB", 121.76, 4.42, 0.449},
     {"TE", 127.6, 4.47, 0.398},   {"I", 126.9, 4.5, 0.339},     {"XE", 131.29, 4.404, 0.332},
     {"CS", 132.91, 4.517, 0.045}, {"BA", 137.33, 3.703, 0.364}, {"LA", 138.91, 3.522, 0.017},
     {"CE", 140.12, 3.556, 0.013}, {"PR", 140.91, 3.606, 0.01},  {"ND", 144.24, 3.575, 0.01},
     {"PM", 145, 3.547, 0.009},    {"SM", 150.36, 3.52, 0.008},  {"EU", 151.96, 3.493, 0.008},
     {"GD", 157.25, 3.368, 0.009}, {"TB", 158.93, 3.451, 0.007}, {"DY", 162.5, 3.428, 0.007},
     {"HO", 164.93, 3.409, 0.007}, {"ER", 167.26, 3.391, 0.007}, {"TM", 168.93, 3.374, 0.006},
     {"YB", 173.05, 3.355, 0.228}, {"LU", 174.97, 3.64, 0.041},  {"HF", 178.49, 3.141, 0.072},
     {"TA", 180.95, 3.17, 0.081},  {"W", 183.84, 3.069, 0.067},  {"RE", 186.21, 2.954, 0.066},
     {"OS", 190.23, 3.12, 0.037},  {"IR", 192.22, 2.84, 0.073},  {"PT", 195.08, 2.754, 0.08},
     {"AU", 196.97, 3.293, 0.039}, {"HG", 200.59, 2.705, 0.385}, {"TL", 204.38, 4.347, 0.68},
     {"PB", 207.2, 4.297, 0.663},  {"BI", 208.98, 4.37, 0.518},  {"PO", 209, 4.709, 0.325},
     {"AT", 210, 4.75, 0.284},     {"RN", 222, 4.765, 0.248},    {"FR", 223, 4.9, 0.05},
     {"RA", 226, 3.677, 0.404},    {"AC", 227, 3.478, 0.033},    {"TH", 232.04, 3.396, 0.026},
     {"PA", 231.04, 3.424, 0.022}, {"U", 238.03, 3.395, 0.022},  {"NP", 237, 3.424, 0.019},
     {"PU", 244, 3.424, 0.016},    {"AM", 243, 3.381, 0.014},    {"CM", 247, 3.326, 0.013},
     {"BK", 247, 3.339, 0.013},    {"CF", 251, 3.313, 0.013},    {"ES", 252, 3.299, 0.012},
     {"FM", 257, 3.286, 0.012},    {"MD", 258, 3.274, 0.011},    {"NO", 259, 3.248, 0.011},
     {"LR", 262, 3.236, 0.011}}};

/// Residue names, sorted for a binary search.
constexpr std::array kStandardResidues = std::to_array<std::string_view>(
    {"A",    "ALA",  "ARG",  "ARGN", "ASH",  "ASN", "ASP", "ASPH", "C",   "CYM",  "CYS", "CYS2", "CYSH", "CYX", "DA",
     "DC",   "DG",   "DI",   "DT",   "DU",   "G",   "GLH", "GLN",  "GLU", "GLUH", "GLY", "HID",  "HIE",  "HIP", "HIS",
     "HISA", "HISB", "HISD", "HISE", "HISH", "HOH", "HSD", "HSE",  "HSP", "I",    "ILE", "LEU",  "LYN",  "LYP", "LYS",
     "LYSH", "LYSN", "MET",  "MSE",  "PHE",  "PRO", "SER", "THR",  "TRP", "TYR",  "U",   "VAL",  "WAT"});
static_assert(std::ranges::is_sorted(kStandardResidues));

/// Element symbols that can be recognised in atom names: no usual atom name of a different element begins with one of
/// them.
constexpr std::array kPlainSymbols = std::to_array<std::string_view>({"BR", "CL", "FE", "MG", "MN", "SE", "SI", "ZN"});

bool is_upper(char c) {
  return c >= 'A' && c <= 'Z';
}

std::string upper_case(std::string_view text) {
  std::string result(text);
  for (char& c : result) {
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  }
  return result;
}

/// Returns the first run of upper-case letters, without preceding characters such as digits.
std::string_view leading_letters(std::string_view name) {
  while (!name.empty() && !is_upper(name.front())) name.remove_prefix(1);
  std::size_t letters = 0;
  while (letters < name.size() && is_upper(name[letters])) ++letters;
  return name.substr(0, letters);
}

std::string known_or_x(std::string_view symbol) {
  if (symbol == "D" || symbol == "T") return "H";
  return find_element(symbol) != nullptr ? std::string(symbol) : "X";
}

/// Returns the element that the columns of a PDB atom name determine; empty if they do not determine it.
std::string by_columns(std::string_view name) {
  constexpr std::size_t kColumns = 4;
  if (name.size() != kColumns) return {};
  if (name[0] == ' ' && is_upper(name[1])) return known_or_x(name.substr(1, 1));
  // A name of four letters begins in the first column for every element, so its columns determine nothing.
  if (name.find(' ') == std::string_view::npos || !is_upper(name[0]) || !is_upper(name[1])) return {};
  return find_element(name.substr(0, 2)) != nullptr ? std::string(name.substr(0, 2)) : std::string();
}

/// Returns whether an atom is a lone ion, whose residue has the name of the atom, possibly followed by digits.
/// Examples: "CA" of residue "CA" and "ZN" of "ZN2", but not "CA" of "CAP".
bool is_lone_ion(std::string_view name, std::string_view residue) {
  return name.size() == 2 && residue.starts_with(name) && find_element(name) != nullptr &&
         std::ranges::none_of(residue.substr(2), is_upper);
}

}  // namespace

double ChemicalElement::sigma_angstrom() const {
  return kSigmaPerMinimum * minimum_angstrom;
}

std::span<const ChemicalElement> periodic_table() {
  return kPeriodicTable;
}

const ChemicalElement* find_element(std::string_view symbol) {
  const auto* const found = std::ranges::find(kPeriodicTable, symbol, &ChemicalElement::symbol);
  return found == kPeriodicTable.end() ? nullptr : found;
}

bool is_standard_residue(std::string_view name) {
  return std::ranges::binary_search(kStandardResidues, name);
}

std::string element_of(const ElementClues& clues) {
  const std::string field = upper_case(clues.name);
  const std::string name(trimmed(field));
  const std::string stated = upper_case(trimmed(clues.element));
  const std::string_view letters = leading_letters(name);
  if (is_standard_residue(clues.residue)) {
    if (clues.residue == "MSE" && name == "SE") return "SE";
    return known_or_x(letters.substr(0, 1));
  }
  if (is_lone_ion(name, clues.residue)) return name;
  if (stated == "D" || stated == "T" || find_element(stated) != nullptr) return known_or_x(stated);
  if (const std::string by_column = by_columns(field); !by_column.empty()) return by_column;
  if (std::ranges::find(kPlainSymbols, letters.substr(0, 2)) != kPlainSymbols.end()) {
    return std::string(letters.substr(0, 2));
  }
  return known_or_x(letters.substr(0, 1));
}

}  // namespace tandem::server
