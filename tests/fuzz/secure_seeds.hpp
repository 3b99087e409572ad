// Connection id and secret that the seeds and the fuzz targets of the transport share, so that the seeds pass the first
// checks.
#pragma once

#include <algorithm>

#include "common/base/ids.hpp"
#include "common/secure/tls.hpp"

namespace tandem::fuzz {

inline constexpr ConnectionId kConnection{0x1122334455667788};

inline secure::Exported fixed_secret() {
  secure::Exported exported;
  std::ranges::fill(exported.secret.bytes(), std::byte{0x5A});
  return exported;
}

}  // namespace tandem::fuzz
