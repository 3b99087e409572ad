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

/// One message of the service. A message that it does not contain remains empty.
struct CortexMessage {
  std::optional<std::int64_t> id;  ///< id of the answered request
  boost::json::value result;
  std::optional<CortexProblem> error;
  std::optional<CortexProblem> warning;
  std::optional<boost::json::array> eeg;  ///< one sample
};

/// Parses a message. Returns nothing if it is no JSON object.
std::optional<CortexMessage> read_cortex_message(std::string_view text);

std::string cortex_request(std::int64_t id, std::string_view method, boost::json::object parameters);

/// Returns the remedy of an error of a request, with the service's own code and text.
std::string cortex_advice(const CortexProblem& problem);
/// Returns the same for a warning that ends the stream; nothing for other warnings.
std::optional<std::string> cortex_loss(const CortexProblem& warning);

/// Places of the electrodes in a sample, from the `cols` of the service's answer to `subscribe`.
class CortexColumns {
 public:
  /// Fails   std::runtime_error: the answer lists no electrodes, or too many
  explicit CortexColumns(const boost::json::value& names);

  const std::vector<std::string>& electrodes() const { return electrodes_; }
  /// Appends the electrodes of a sample [µV]. Samples that the counter shows to be lost, at most `max_lost`, precede it
  /// as NaN; an interpolated one is NaN. Returns false, and appends nothing, if the sample has other columns.
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
