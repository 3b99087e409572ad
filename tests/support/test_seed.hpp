// The seed of a property test. It is printed, so that a failure can be repeated; an environment variable sets it.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <string>

namespace tandem::test {

/// Returns `usual`, or the value of the environment variable TANDEM_TEST_SEED. Prints the seed as an assignment of this
/// variable.
/// Fails   std::invalid_argument: the variable is not a number
inline std::uint64_t test_seed(std::uint64_t usual) {
  const char* const given = std::getenv("TANDEM_TEST_SEED");
  const std::uint64_t seed = given != nullptr ? std::stoull(given) : usual;
  std::cout << "TANDEM_TEST_SEED=" << seed << '\n';
  return seed;
}

}  // namespace tandem::test
