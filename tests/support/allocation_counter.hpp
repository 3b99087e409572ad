// Counts heap allocations of the calling thread, so that tests can check that code allocates and frees no memory. A
// test program must link allocation_counter.cpp, which replaces the global operator new.
#pragma once

#include <cstdint>

namespace tandem::test {

/// Number of calls of operator new by this thread since it started.
std::uint64_t allocation_count() noexcept;
/// Number of calls of operator delete by this thread since it started, except those with a null pointer.
std::uint64_t free_count() noexcept;

}  // namespace tandem::test
