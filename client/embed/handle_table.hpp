// Handles of the C interface: numbers that identify objects, for use by several threads.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace tandem::client::embed {

/// Table of objects by handle. A handle never becomes valid again after remove(). So a late call with a removed handle
/// is an error instead of a crash.
///
/// Model   handle = kind · 2⁵⁶ + generation · 2¹⁶ + index in the table + 1
///         kind        number of this table, different for each table
///         generation  number of handles that the table has issued before. A program that opens 1000 handles a second
///                     uses up the 2⁴⁰ generations in 34 years
/// Thread  any
template <class T>
class HandleTable {
 public:
  static constexpr std::size_t kCapacity = 256;

  /// In      kind  1 to 255, different for each table; so a table refuses the handles of all other tables
  explicit HandleTable(std::uint8_t kind) : kind_(kind) {}

  /// Adds an object and returns its handle; 0 if kCapacity objects are open.
  std::uint64_t add(std::shared_ptr<T> object) {
    const std::lock_guard lock(mutex_);
    for (std::size_t place = 0; place < entries_.size(); ++place) {
      if (entries_[place].object != nullptr) continue;
      const std::uint64_t generation = ++generation_ & ((std::uint64_t{1} << 40U) - 1);
      entries_[place] = {(std::uint64_t{kind_} << 56U) | (generation << 16U) | (place + 1), std::move(object)};
      return entries_[place].handle;
    }
    return 0;
  }
  /// Returns the object of a handle; null if the handle is not open. The result keeps the object alive.
  std::shared_ptr<T> find(std::uint64_t handle) const {
    const std::lock_guard lock(mutex_);
    const Entry* const entry = entry_of(handle);
    return entry == nullptr ? nullptr : entry->object;
  }
  /// Closes a handle and returns its object; null if the handle is not open.
  std::shared_ptr<T> remove(std::uint64_t handle) {
    const std::lock_guard lock(mutex_);
    const Entry* const entry = entry_of(handle);
    if (entry == nullptr) return nullptr;
    return std::exchange(entries_[static_cast<std::size_t>(entry - entries_.data())].object, nullptr);
  }
  /// Closes all handles and returns their objects.
  std::vector<std::shared_ptr<T>> remove_all() {
    std::vector<std::shared_ptr<T>> objects;
    const std::lock_guard lock(mutex_);
    for (Entry& entry : entries_) {
      if (entry.object != nullptr) objects.push_back(std::exchange(entry.object, nullptr));
    }
    return objects;
  }

 private:
  struct Entry {
    std::uint64_t handle = 0;
    std::shared_ptr<T> object;
  };

  const Entry* entry_of(std::uint64_t handle) const {
    const std::uint64_t place = (handle & 0xffffU) - 1;
    if (place >= entries_.size()) return nullptr;
    const Entry& entry = entries_[place];
    return entry.handle == handle && entry.object != nullptr ? &entry : nullptr;
  }

  std::uint8_t kind_;
  mutable std::mutex mutex_;
  std::uint64_t generation_ = 0;
  std::array<Entry, kCapacity> entries_;
};

}  // namespace tandem::client::embed
