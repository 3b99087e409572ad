#include "tests/support/allocation_counter.hpp"

#include <cstdlib>
#include <new>

namespace {

thread_local std::uint64_t count = 0;
thread_local std::uint64_t frees = 0;

void* counted(std::size_t size, std::size_t alignment) noexcept {
  ++count;
  // aligned_alloc requires a size that is a multiple of the alignment.
  const std::size_t bytes = (size + alignment - 1) / alignment * alignment;
  void* memory = std::aligned_alloc(alignment, bytes == 0 ? alignment : bytes);
  return memory;
}

void* counted_or_throw(std::size_t size, std::size_t alignment) {
  void* memory = counted(size, alignment);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

void counted_free(void* memory) noexcept {
  frees += memory != nullptr ? 1 : 0;
  std::free(memory);
}

}  // namespace

std::uint64_t tandem::test::free_count() noexcept {
  return frees;
}
std::uint64_t tandem::test::allocation_count() noexcept {
  return count;
}

// Every operator delete below needs the operator new that belongs to it. A form that is not replaced here would come
// from a sanitizer and allocate memory that these operators cannot free.
void* operator new(std::size_t size) {
  return counted_or_throw(size, __STDCPP_DEFAULT_NEW_ALIGNMENT__);
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  return counted_or_throw(size, static_cast<std::size_t>(alignment));
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return counted(size, __STDCPP_DEFAULT_NEW_ALIGNMENT__);
}
void* operator new(std::size_t size, std::align_val_t alignment, const std::nothrow_t&) noexcept {
  return counted(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept {
  counted_free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  counted_free(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept {
  counted_free(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  counted_free(memory);
}
