// The time series of a session as CSV: every field of every n-th haptic tick, its unit in its column's name, so that
// any tool can plot it and the two ends of a session can be laid side by side.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

#include "client/haptics/haptic_core.hpp"

namespace tandem::client {

/// Writes tick records to a file. What is not known yet (server state, watched body) is an empty cell.
///
/// Out     t_s counts from the first record; local_ns is this machine's monotonic clock, shared by all its programs
/// Thread  any one but the haptic
class TraceWriter {
 public:
  /// `every` = 1 writes each record, 10 every tenth.
  /// Fails   std::invalid_argument: the file cannot be created, or `every` is 0
  TraceWriter(const std::filesystem::path& file, std::uint64_t every);

  /// `phase` is the index of the hand path's phase, −1 for none.
  void write(const TickRecord& record, int phase);
  /// Writes what is still in memory. False when not everything reached the file (disk full).
  bool flush();

 private:
  std::ofstream out_;
  std::uint64_t every_;
  std::uint64_t seen_ = 0;
  LocalTime start_{};
  std::string line_;
};

/// The header row: comma-separated names with units.
std::string trace_header();
/// A row, as TraceWriter writes it.
/// In      start  of t_s
std::string trace_row(const TickRecord& record, LocalTime start, int phase);

}  // namespace tandem::client
