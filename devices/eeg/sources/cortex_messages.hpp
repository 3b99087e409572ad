// Messages to and from Emotiv's Cortex service: JSON-RPC 2.0 over a WebSocket.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/json.hpp"

namespace tandem::eeg {

/// Code and text of an error or a warning of the service.
struct CortexProblem {
  std::int64_t code = 0;
  std::string message;
};

/// One parsed message of the service. Parts that the message does not contain are empty.
struct CortexMessage {
  std::optional<std::int64_t> id;  ///< id of the answered request
  boost::json::value result;
  std::optional<CortexProblem> error;
  std::optional<CortexProblem> warning;
  std::optional<boost::json::array> eeg;  ///< one sample of all channels
};

/// Parses a message. Returns nothing if the text is not a JSON object.
std::optional<CortexMessage> read_cortex_message(std::string_view text);

std::string cortex_request(std::int64_t id, std::string_view method, boost::json::object parameters);

/// Returns the remedy for the error of a request, followed by the service's code and text.
std::string cortex_advice(const CortexProblem& problem);
/// Returns the cause, the remedy, and the service's code and text for a warning that ends the stream. Returns nothing
/// for other warnings.
std::optional<std::string> cortex_loss(const CortexProblem& warning);

/// Column indices of the electrodes in a sample, from the field `cols` of the service's answer to `subscribe`.
class CortexColumns {
 public:
  /// Fails   std::runtime_error: the answer lists no electrodes, or too many
  explicit CortexColumns(const boost::json::value& names);

  const std::vector<std::string>& electrodes() const { return electrodes_; }
  /// Appends the values of the electrodes in one sample [µV].
  /// * Lost samples: if the counter shows a gap, one NaN sample for each, at most `max_lost`, is appended first.
  /// * Interpolated sample: NaN is appended instead of its values.
  /// * Sample with other columns than the service announced: nothing is appended, and the result is false.
  bool append(const boost::json::array& sample, std::size_t max_lost, std::vector<double>& frames_uv);

 private:
  std::size_t lost_before(const boost::json::array& sample);

  std::vector<std::string> electrodes_;
  std::vector<std::size_t> places_;
  std::size_t columns_ = 0;
  std::optional<std::size_t> counter_place_, interpolated_place_;
  std::optional<std::int64_t> counter_;
};

}  // namespace tandem::eeg
