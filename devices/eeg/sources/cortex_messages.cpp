#include "devices/eeg/sources/cortex_messages.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "devices/eeg/recording.hpp"

namespace tandem::eeg {
namespace {

namespace json = boost::json;

constexpr std::string_view kCounter = "COUNTER", kInterpolated = "INTERPOLATED";
/// Columns of a sample that do not contain the value of an electrode, in any version of the service. Columns whose
/// names begin with MARKER do not contain one either.
constexpr std::array<std::string_view, 6> kOtherColumns{kCounter,    kInterpolated, "RAW_CQ",
                                                        "TIMESTAMP", "BATTERY",     "BATTERY_PERCENT"};

std::optional<double> number_of(const json::value& value) {
  if (!value.is_number()) return std::nullopt;
  const double number = value.to_number<double>();
  return std::isfinite(number) ? std::optional(number) : std::nullopt;
}

std::optional<CortexProblem> problem_in(const json::object& object, std::string_view name) {
  const json::value* const found = object.if_contains(name);
  if (found == nullptr || !found->is_object()) return std::nullopt;
  CortexProblem problem;
  const json::value* const code = found->get_object().if_contains("code");
  if (code != nullptr && code->is_int64()) problem.code = code->get_int64();
  const json::value* const message = found->get_object().if_contains("message");
  if (message == nullptr) return problem;
  // In a warning, the message is an object instead of a text.
  problem.message = message->is_string() ? std::string(message->get_string()) : json::serialize(*message);
  return problem;
}

/// Returns the remedy of a frequent error, by its code.
std::string_view remedy_of(std::int64_t code) {
  switch (code) {
    case -32002:
    case -32006:
    case -32016:
    case -32024:
    case -32025:
    case -32027:
      return "raw EEG is not enabled for this account or application; Emotiv sells it as a subscription, enable it for "
             "the account and tick EEG for the application";
    case -32014:
    case -32015:
      return "the token has expired or is not valid; start the program again to get a new one";
    case -32001:
    case -32004:
    case -32010:
      return "the headset is not connected; switch it on, charge it, and connect it in the EMOTIV Launcher";
    case -32021:
    case -32028:
      return "client id or client secret is wrong; copy both from the application's page of the Emotiv account";
    case -32033:
    case -32102:
      return "nobody is logged in, or the terms are not accepted; log in to the EMOTIV Launcher and accept them";
    case -32005:
    case -32019:
      return "another program uses the headset; end it, or wait until its session has ended";
    default:
      return "see the documentation of the Cortex API for this code";
  }
}

std::string quoted(const CortexProblem& problem) {
  constexpr std::size_t kMaxShown = 200;
  return " (Cortex " + std::to_string(problem.code) + ": " + problem.message.substr(0, kMaxShown) + ")";
}

}  // namespace

std::optional<CortexMessage> read_cortex_message(std::string_view text) {
  boost::system::error_code error;
  const json::value value = json::parse(text, error);
  if (error || !value.is_object()) return std::nullopt;
  const json::object& object = value.get_object();
  CortexMessage message;
  if (const json::value* const id = object.if_contains("id"); id != nullptr && id->is_int64())
    message.id = id->get_int64();
  if (const json::value* const result = object.if_contains("result")) message.result = *result;
  message.error = problem_in(object, "error");
  message.warning = problem_in(object, "warning");
  if (const json::value* const eeg = object.if_contains("eeg"); eeg != nullptr && eeg->is_array())
    message.eeg = eeg->get_array();
  return message;
}

std::string cortex_request(std::int64_t id, std::string_view method, json::object parameters) {
  return json::serialize(
      json::object{{"id", id}, {"jsonrpc", "2.0"}, {"method", method}, {"params", std::move(parameters)}});
}

std::string cortex_advice(const CortexProblem& problem) {
  return std::string(remedy_of(problem.code)) + quoted(problem);
}

std::optional<std::string> cortex_loss(const CortexProblem& warning) {
  switch (warning.code) {
    case 0:
    case 1:
      return "the service has ended the stream; switch the headset on and start again" + quoted(warning);
    case 3:
      return "the user has logged out; log in to the EMOTIV Launcher and start again" + quoted(warning);
    case 102:
    case 103:
      return "the headset was lost; charge it, bring it nearer, and start again" + quoted(warning);
    default:
      return std::nullopt;
  }
}

CortexColumns::CortexColumns(const json::value& names) {
  if (!names.is_array()) throw std::runtime_error("the service does not name the columns of its EEG; update it");
  columns_ = names.get_array().size();
  for (std::size_t i = 0; i < columns_; ++i) {
    const json::value& name = names.get_array()[i];
    if (!name.is_string()) continue;
    const std::string column(name.get_string());
    if (column == kCounter) counter_place_ = i;
    if (column == kInterpolated) interpolated_place_ = i;
    if (std::ranges::count(kOtherColumns, column) > 0 || column.starts_with("MARKER")) continue;
    electrodes_.push_back(column);
    places_.push_back(i);
  }
  if (electrodes_.empty() || electrodes_.size() > kMaxChannels)
    throw std::runtime_error("the service names " + std::to_string(electrodes_.size()) + " electrodes; 1 to " +
                             std::to_string(kMaxChannels) + " are possible");
}

/// Returns the number of samples that were lost since the previous sample, from the counter in each sample. After a
/// maximum that depends on the headset, the counter restarts at 0. Losses at a restart are therefore not detected.
std::size_t CortexColumns::lost_before(const json::array& sample) {
  const auto number = counter_place_ ? number_of(sample[*counter_place_]) : std::nullopt;
  if (!number || *number < 0 || *number > 1e6) return 0;
  const auto now = static_cast<std::int64_t>(*number);
  const std::optional<std::int64_t> before = std::exchange(counter_, now);
  if (!before || now == *before) return 0;
  return static_cast<std::size_t>(now > *before ? now - *before - 1 : now);
}

bool CortexColumns::append(const json::array& sample, std::size_t max_lost, std::vector<double>& frames_uv) {
  if (sample.size() != columns_) return false;
  constexpr double kLostSample = std::numeric_limits<double>::quiet_NaN();
  const std::size_t lost = std::min(lost_before(sample), max_lost);
  frames_uv.insert(frames_uv.end(), lost * electrodes_.size(), kLostSample);
  const auto interpolated = interpolated_place_ ? number_of(sample[*interpolated_place_]) : std::nullopt;
  const bool is_measured = !interpolated || *interpolated == 0;
  for (const std::size_t place : places_) {
    const auto value = is_measured ? number_of(sample[place]) : std::nullopt;
    frames_uv.push_back(value.value_or(kLostSample));
  }
  return true;
}

}  // namespace tandem::eeg
