// Reads JSON files that people write. Each error message names the file, the field with its index, the value and the
// remedy. An unknown field, such as a misspelt one, is an error instead of being ignored.
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/json.hpp"
#include "common/base/spatial.hpp"

namespace tandem {

/// Reads the fields of one JSON object. Every member function throws std::invalid_argument for an invalid value, for
/// example:
///   peg.json: users[1].link.loss is 1.2; it must be a number from 0 to 0.95
/// After the last field call finish(), which throws if the object has fields that were never read.
class JsonFields {
 public:
  /// In      origin  file name for error messages
  ///         path    path of the object within the file; "" for the whole file
  JsonFields(const boost::json::value& value, std::string origin, std::string path = "");

  bool has(std::string_view name);
  double number(std::string_view name, double otherwise, double low, double high);
  /// Reads a number that must be present.
  double required_number(std::string_view name, double low, double high);
  std::uint64_t whole_number(std::string_view name, std::uint64_t otherwise, std::uint64_t high);
  bool boolean(std::string_view name, bool otherwise);
  std::string text(std::string_view name, std::string_view otherwise);
  std::string required_text(std::string_view name);
  /// Reads a text that must be one of `choices`. Returns the index of the choice, or `otherwise` if the field is
  /// absent.
  std::size_t choice(std::string_view name, std::size_t otherwise, const std::vector<std::string_view>& choices);
  /// Reads a list of three numbers, each with a magnitude of at most `bound`.
  Vec3 vector(std::string_view name, const Vec3& otherwise, double bound);
  std::vector<double> numbers(std::string_view name, double low, double high);
  std::vector<std::string> texts(std::string_view name);
  /// Reads a nested object. If the field is absent, returns an empty object, all of whose fields then have their
  /// default values.
  JsonFields object(std::string_view name);
  /// Reads a list of `at_least` to `at_most` objects. The list may be absent if `at_least` is 0.
  std::vector<JsonFields> objects(std::string_view name, std::size_t at_least, std::size_t at_most);
  /// Checks that all fields of the object were read.
  /// Fails   std::invalid_argument: a field was never read; the message lists the known fields
  void finish() const;

  [[noreturn]] void fail(std::string_view name, std::string_view remedy) const;

 private:
  const boost::json::value* find(std::string_view name);
  double number_of(const boost::json::value& value, const std::string& name, double low, double high) const;
  std::string path_of(std::string_view name) const;

  boost::json::object object_;
  std::string origin_;
  std::string path_;
  std::set<std::string, std::less<>> read_names_;
};

/// Parses JSON text.
/// Fails   std::invalid_argument: the message names origin, line and column
boost::json::value parse_json(std::string_view text, const std::string& origin);
/// Returns the content of a text file of at most 4 MiB.
/// Fails   std::invalid_argument: the message names file, reason and remedy
std::string read_text_file(const std::filesystem::path& file);

}  // namespace tandem
