// See room_parameter.hpp.
#include "client/app/room_parameter.hpp"

#include <algorithm>
#include <charconv>
#include <stdexcept>

#include "common/base/units.hpp"
#include "common/haptics/coupling/laws.hpp"
#include "proto/coupling_fields.hpp"

namespace tandem::client {
namespace {

wire::SetParameter parameter_of(const std::string& name, const std::string& value) {
  wire::SetParameter parameter;
  parameter.set_name(name);
  if (name == proto::kLawParameter) {
    if (value.empty() || haptics::find_coupling_law(value) == nullptr) {
      throw std::invalid_argument("'" + value + "' is no law; use one of: " + haptics::listed_coupling_law_names());
    }
    parameter.set_text(value);
    return parameter;
  }
  const proto::CouplingField* const field = proto::find_coupling_field(name);
  if (field == nullptr) {
    std::string names(proto::kLawParameter);
    for (const proto::CouplingField& known : proto::kCouplingFields) names += ", " + std::string(known.name);
    throw std::invalid_argument("'" + name + "' is no parameter of a room; use one of: " + names);
  }
  double number = 0;
  const char* const end = value.data() + value.size();
  const auto [next, error] = std::from_chars(value.data(), end, number);
  if (error != std::errc() || next != end || !field->accepts(number)) {
    throw std::invalid_argument("'" + value + "' must be a number in the range of " + name + " (proto/WIRE.md)");
  }
  parameter.set_value(number);
  return parameter;
}

}  // namespace

std::pair<Duration, wire::SetParameter> parameter_to_set(const std::string& text) {
  const std::size_t is = text.find('='), at = std::min(text.find('@'), text.size());
  if (is >= at) throw std::invalid_argument("'" + text + "' must be NAME=VALUE or NAME=VALUE@TIME");
  const Duration when = at < text.size() ? parse_duration(text.substr(at + 1), "s") : Duration{0};
  return {when, parameter_of(text.substr(0, is), text.substr(is + 1, at - is - 1))};
}

}  // namespace tandem::client
