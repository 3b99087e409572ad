// Counts heap allocations of the calling thread, so that "allocates and frees nothing here" is a test. Link
// allocation_counter.cpp into the test program: it replaces the global operator new.
#pragma once

#include <cstdint>

namespace tandem::test {

/// Calls of operator new by this thread since it started.
std::uint64_t allocation_count() noexcept;
/// Calls of operator delete by this thread since it started, without those for a null pointer.
std::uint64_t free_count() noexcept;

}  // namespace tandem::test
