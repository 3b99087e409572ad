// Memory that is read all over the place, in pages of 2 MiB.
#pragma once

#include <cstddef>
#include <span>

namespace tandem::realtime {

/// Has the kernel move what fills whole pages of 2 MiB into such pages, where it can: reads that are far from each other
/// else wait for the addresses as long as for the data, in a virtual machine longer.
///
/// Out   false: nothing was moved, as it is too little, or the kernel has no such pages (/sys/kernel/mm/transparent_hugepage)
/// Cost  a copy of the memory; of its contents nothing changes
bool use_large_pages(std::span<const std::byte> memory) noexcept;

}  // namespace tandem::realtime
