// Exception that is used within the library. It contains the status that the C interface returns.
#pragma once

#include <stdexcept>
#include <string>

#include "client/embed/c/tandem.h"

namespace tandem::client::embed {

class StatusError : public std::runtime_error {
 public:
  StatusError(tandem_status error_status, const std::string& text) : std::runtime_error(text), status(error_status) {}
  tandem_status status;
};

}  // namespace tandem::client::embed
