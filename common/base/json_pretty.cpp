#include "common/base/json_pretty.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace tandem {
namespace {

namespace json = boost::json;

/// Special value of `depth`: the whole text is written on one line.
constexpr int kOneLine = -1;

bool is_scalar(const json::value& value) {
  return !value.is_object() && !value.is_array();
}

void append_double(double value, std::string& out) {
  if (!std::isfinite(value)) {
    out += "null";
    return;
  }
  char text[32];
  const auto end = std::to_chars(text, text + sizeof text, value).ptr;
  out.append(text, end);
}

void append(const json::value& value, int depth, std::string& out);

int deeper(int depth) {
  return depth == kOneLine ? kOneLine : depth + 1;
}

void begin_line(int depth, std::string& out) {
  if (depth != kOneLine) out.append(1, '\n').append(2 * static_cast<std::size_t>(depth), ' ');
}

void append_array(const json::array& array, int depth, std::string& out) {
  // An array of scalars, such as a vector, stays on one line.
  const bool is_flat = depth == kOneLine || std::all_of(array.begin(), array.end(), is_scalar);
  out += '[';
  for (std::size_t i = 0; i < array.size(); ++i) {
    if (i > 0) out += is_flat ? ", " : ",";
    if (!is_flat) begin_line(deeper(depth), out);
    append(array[i], deeper(depth), out);
  }
  if (!is_flat) begin_line(depth, out);
  out += ']';
}

void append_object(const json::object& object, int depth, std::string& out) {
  out += '{';
  bool is_first = true;
  for (const auto& field : object) {
    if (!is_first) out += depth == kOneLine ? ", " : ",";
    is_first = false;
    begin_line(deeper(depth), out);
    out += json::serialize(field.key()) + ": ";
    append(field.value(), deeper(depth), out);
  }
  if (!is_first) begin_line(depth, out);
  out += '}';
}

void append(const json::value& value, int depth, std::string& out) {
  if (value.is_object()) {
    append_object(value.get_object(), depth, out);
  } else if (value.is_array()) {
    append_array(value.get_array(), depth, out);
  } else if (value.is_double()) {
    append_double(value.get_double(), out);
  } else {
    out += json::serialize(value);
  }
}

}  // namespace

std::string pretty_json(const json::value& value) {
  std::string out;
  append(value, 0, out);
  out += '\n';
  return out;
}

std::string compact_json(const json::value& value) {
  std::string out;
  append(value, kOneLine, out);
  return out;
}

}  // namespace tandem
