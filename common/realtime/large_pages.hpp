// Pages of 2 MiB for memory with random access.
#pragma once

#include <cstddef>
#include <span>

namespace tandem::realtime {

/// Moves the whole 2 MiB pages within `memory` to large pages, where the kernel can. Otherwise distant reads wait for
/// address translation as long as for the data, in a virtual machine longer.
///
/// Out     false: nothing was moved; too little memory, or no support (/sys/kernel/mm/transparent_hugepage)
/// Cost    a copy of the memory; its contents do not change
bool use_large_pages(std::span<const std::byte> memory) noexcept;

}  // namespace tandem::realtime
