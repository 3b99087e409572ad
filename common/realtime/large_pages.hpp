// Use of 2 MiB pages for memory that is accessed randomly.
#pragma once

#include <cstddef>
#include <span>

namespace tandem::realtime {

/// Moves all complete 2 MiB blocks within `memory` to large pages, if the kernel supports them. Large pages make random
/// accesses faster. With pages of 4 KiB, translating an address takes about as long as the access itself, and even
/// longer in a virtual machine.
///
/// Out     false: nothing was moved, because the memory is too small or large pages are not supported
///         (/sys/kernel/mm/transparent_hugepage)
/// Cost    one copy of the memory by the kernel; the contents do not change
bool use_large_pages(std::span<const std::byte> memory) noexcept;

}  // namespace tandem::realtime
