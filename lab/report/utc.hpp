// Times of recordings as text.
#pragma once

#include <cstdint>
#include <string>

namespace tandem::lab {

/// Returns a Unix time [ns] as UTC in whole seconds, such as "2026-01-31T12:00:00Z".
std::string utc_text(std::uint64_t unix_ns);

}  // namespace tandem::lab
