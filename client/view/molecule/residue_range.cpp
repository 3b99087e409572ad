#include "client/view/molecule/residue_range.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>

namespace tandem::client {
namespace {

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

/// Removes a number with an optional sign from the start of the text, and returns it.
std::optional<int> take_number(std::string_view& text) {
  int number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc()) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return number;
}

bool is_word(std::string_view text) {
  return !text.empty() && text.size() <= 8 &&
         std::ranges::all_of(text, [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0; });
}

/// Parses the numbers of a range, such as "10", "10B", "10-25" or "-3-5". Returns false if the text has a different
/// form.
bool parse_numbers(std::string_view text, ResidueRange& range) {
  range.first = range.last = take_number(text);
  if (!range.first) return false;
  if (text.size() == 1 && std::isalpha(static_cast<unsigned char>(text[0])) != 0) {
    range.insertion = std::string(text);
    return true;
  }
  if (text.empty()) return true;
  if (text.front() != '-') return false;
  text.remove_prefix(1);
  range.last = take_number(text);
  return range.last && text.empty() && *range.last >= *range.first;
}

std::optional<ResidueRange> parse_one(std::string_view text) {
  ResidueRange range;
  const std::size_t colon = text.find(':');
  if (colon == std::string_view::npos) {
    if (parse_numbers(text, range)) return range;
    if (!is_word(text)) return std::nullopt;
    return ResidueRange{.chain = std::string(text)};
  }
  range.chain = std::string(trimmed(text.substr(0, colon)));
  const std::string_view numbers = trimmed(text.substr(colon + 1));
  const bool is_valid = is_word(range.chain) && (numbers.empty() || parse_numbers(numbers, range));
  return is_valid ? std::optional(range) : std::nullopt;
}

}  // namespace

std::optional<std::vector<ResidueRange>> parse_residues(std::string_view text) {
  std::vector<ResidueRange> ranges;
  while (true) {
    const std::size_t comma = std::min(text.find(','), text.size());
    const std::optional<ResidueRange> range = parse_one(trimmed(text.substr(0, comma)));
    if (!range || ranges.size() == kMaxRanges) return std::nullopt;
    ranges.push_back(*range);
    if (comma == text.size()) return ranges;
    text.remove_prefix(comma + 1);
  }
}

bool is_in(const ResidueRange& range, std::string_view chain, std::string_view id) {
  if (!range.chain.empty() && range.chain != chain) return false;
  if (!range.first) return true;
  const std::optional<int> number = take_number(id);
  if (!number || *number < *range.first || *number > *range.last) return false;
  return !range.insertion || *range.insertion == id;
}

}  // namespace tandem::client
