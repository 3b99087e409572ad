#include "common/base/json_fields.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "common/base/json_pretty.hpp"

namespace tandem {
namespace {

constexpr std::uintmax_t kMaxFileBytes = 4U << 20U;

std::string text_of(double value) {
  std::ostringstream out;
  out.precision(10);
  out << value;
  return out.str();
}

// Returns a quotation of a value for an error message; long values are truncated.
std::string excerpt(const boost::json::value& value) {
  std::string text = compact_json(value);
  constexpr std::size_t kLongest = 60;
  if (text.size() > kLongest) text = text.substr(0, kLongest) + "…";
  return text;
}

template <class Range>
std::string joined(const Range& words) {
  std::string text;
  for (const auto& word : words) {
    if (!text.empty()) text += ", ";
    text += word;
  }
  return text;
}

}  // namespace

JsonFields::JsonFields(const boost::json::value& value, std::string origin, std::string path)
    : origin_(std::move(origin)), path_(std::move(path)) {
  if (!value.is_object()) {
    throw std::invalid_argument(origin_ + ": " + (path_.empty() ? "the file" : path_) + " is " + excerpt(value) +
                                "; it must be an object { … }");
  }
  object_ = value.get_object();
}

std::string JsonFields::path_of(std::string_view name) const {
  return path_.empty() ? std::string(name) : path_ + "." + std::string(name);
}

void JsonFields::fail(std::string_view name, std::string_view remedy) const {
  const auto* value = object_.if_contains(name);
  throw std::invalid_argument(origin_ + ": " + path_of(name) + (value ? " is " + excerpt(*value) : " is missing") +
                              "; " + std::string(remedy));
}

const boost::json::value* JsonFields::find(std::string_view name) {
  read_names_.emplace(name);
  return object_.if_contains(name);
}

bool JsonFields::has(std::string_view name) {
  return find(name) != nullptr;
}

double JsonFields::number_of(const boost::json::value& value, const std::string& name, double low, double high) const {
  boost::json::error_code error;
  const auto number = value.to_number<double>(error);
  if (!error && std::isfinite(number) && number >= low && number <= high) return number;
  throw std::invalid_argument(origin_ + ": " + path_of(name) + " is " + excerpt(value) + "; it must be a number from " +
                              text_of(low) + " to " + text_of(high));
}

double JsonFields::number(std::string_view name, double otherwise, double low, double high) {
  const auto* value = find(name);
  return value ? number_of(*value, std::string(name), low, high) : otherwise;
}

double JsonFields::required_number(std::string_view name, double low, double high) {
  if (!has(name)) fail(name, "it must be a number from " + text_of(low) + " to " + text_of(high));
  return number(name, 0, low, high);
}

std::uint64_t JsonFields::whole_number(std::string_view name, std::uint64_t otherwise, std::uint64_t high) {
  const auto* value = find(name);
  if (!value) return otherwise;
  boost::json::error_code error;
  const auto number = value->to_number<std::uint64_t>(error);
  if (error || number > high) fail(name, "it must be a whole number from 0 to " + std::to_string(high));
  return number;
}

bool JsonFields::boolean(std::string_view name, bool otherwise) {
  const auto* value = find(name);
  if (!value) return otherwise;
  if (!value->is_bool()) fail(name, "it must be true or false");
  return value->get_bool();
}

std::string JsonFields::text(std::string_view name, std::string_view otherwise) {
  const auto* value = find(name);
  if (!value) return std::string(otherwise);
  if (!value->is_string()) fail(name, "it must be a text in quotes");
  return std::string(value->get_string());
}

std::string JsonFields::required_text(std::string_view name) {
  std::string value = text(name, "");
  if (value.empty()) fail(name, "it must be a text in quotes");
  return value;
}

std::size_t JsonFields::choice(std::string_view name, std::size_t otherwise,
                               const std::vector<std::string_view>& choices) {
  if (!has(name)) return otherwise;
  const auto found = std::find(choices.begin(), choices.end(), text(name, ""));
  if (found == choices.end()) fail(name, "it must be one of " + joined(choices));
  return static_cast<std::size_t>(found - choices.begin());
}

std::vector<double> JsonFields::numbers(std::string_view name, double low, double high) {
  const auto* value = find(name);
  if (!value) return {};
  if (!value->is_array()) fail(name, "it must be a list of numbers");
  std::vector<double> result;
  for (const auto& element : value->get_array()) {
    const std::string element_name = std::string(name) + "[" + std::to_string(result.size()) + "]";
    result.push_back(number_of(element, element_name, low, high));
  }
  return result;
}

Vec3 JsonFields::vector(std::string_view name, const Vec3& otherwise, double bound) {
  if (!has(name)) return otherwise;
  const auto values = numbers(name, -bound, bound);
  if (values.size() != 3) fail(name, "it must be three numbers [x, y, z]");
  return {values[0], values[1], values[2]};
}

std::vector<std::string> JsonFields::texts(std::string_view name) {
  const auto* value = find(name);
  if (!value) return {};
  if (!value->is_array()) fail(name, "it must be a list of texts");
  std::vector<std::string> result;
  for (const auto& element : value->get_array()) {
    if (!element.is_string()) fail(name, "it must be a list of texts");
    result.emplace_back(element.get_string());
  }
  return result;
}

JsonFields JsonFields::object(std::string_view name) {
  const auto* value = find(name);
  return JsonFields(value ? *value : boost::json::value(boost::json::object()), origin_, path_of(name));
}

std::vector<JsonFields> JsonFields::objects(std::string_view name, std::size_t at_least, std::size_t at_most) {
  const auto* value = find(name);
  const std::size_t size = value && value->is_array() ? value->get_array().size() : 0;
  const bool is_list = value == nullptr || value->is_array();
  if (!is_list || size < at_least || size > at_most) {
    fail(name, "it must be a list of " + std::to_string(at_least) + " to " + std::to_string(at_most) + " objects");
  }
  std::vector<JsonFields> result;
  for (std::size_t i = 0; i < size; ++i) {
    result.emplace_back(value->get_array()[i], origin_, path_of(name) + "[" + std::to_string(i) + "]");
  }
  return result;
}

void JsonFields::finish() const {
  for (const auto& field : object_) {
    if (!read_names_.contains(std::string_view(field.key()))) {
      fail(field.key(), "there is no such field here; known: " + joined(read_names_));
    }
  }
}

boost::json::value parse_json(std::string_view text, const std::string& origin) {
  boost::json::stream_parser parser;
  boost::json::error_code error;
  const std::size_t read = parser.write_some(text.data(), text.size(), error);
  const std::string_view before = text.substr(0, read);
  const bool has_more = text.find_first_not_of(" \t\r\n", read) != std::string_view::npos;
  // An incomplete text is an error that only finish() detects. finish() may be called only if no further text follows.
  if (!error && !has_more) parser.finish(error);
  if (!error && !has_more) return parser.release();
  const auto line = 1 + std::count(before.begin(), before.end(), '\n');
  const auto column = read - (before.rfind('\n') == std::string_view::npos ? 0 : before.rfind('\n') + 1) + 1;
  throw std::invalid_argument(origin + ": line " + std::to_string(line) + ", column " + std::to_string(column) + ": " +
                              (error ? error.message() : "text after the end of the JSON value") +
                              "; it must be one valid JSON value");
}

std::string read_text_file(const std::filesystem::path& file) {
  std::error_code error;
  const auto bytes = std::filesystem::file_size(file, error);
  if (error) throw std::invalid_argument(file.string() + ": cannot be read (" + error.message() + "); check the path");
  if (bytes > kMaxFileBytes) {
    throw std::invalid_argument(file.string() + ": has " + std::to_string(bytes) + " bytes; at most 4 MiB are read");
  }
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) throw std::invalid_argument(file.string() + ": cannot be read; check its rights");
  return std::move(text).str();
}

}  // namespace tandem
