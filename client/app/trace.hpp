// The time series of a session as CSV: every field of every n-th haptic tick, with units in the column names. Any tool
// can plot it, and the files of both ends of a session can be compared.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

#include "client/haptics/haptic_core.hpp"

namespace tandem::client {

/// Writes tick records to a file. Unknown values (server state, watched body) are empty cells.
///
/// Out     t_s counts from the first record; local_ns is this machine's monotonic clock, shared by all its programs
/// Thread  any one but the haptic
class TraceWriter {
 public:
  /// In      every  1 writes each record, 10 every tenth
  /// Fails   std::invalid_argument: the file cannot be created, or `every` is 0
  TraceWriter(const std::filesystem::path& file, std::uint64_t every);

  /// In      phase  index of the hand path's phase, −1 for none
  void write(const TickRecord& record, int phase);
  /// Writes the buffered rows. Returns false if the file is incomplete (disk full).
  bool flush();

 private:
  std::ofstream out_;
  std::uint64_t every_;
  std::uint64_t seen_ = 0;
  LocalTime start_{};
  std::string line_;
};

/// Header row: comma-separated names with units.
std::string trace_header();
/// One row in the format of TraceWriter.
/// In      start  time zero of t_s
std::string trace_row(const TickRecord& record, LocalTime start, int phase);

}  // namespace tandem::client
