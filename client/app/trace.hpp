// Writes the time series of a session as CSV: all fields of every n-th haptic tick, with units in the column names. Any
// plotting tool can read the file, and the files of two users of a session can be compared.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

#include "client/haptics/haptic_core.hpp"

namespace tandem::client {

/// Writes tick records to a file. Unknown values (server state, watched body) are empty cells.
/// Out     columns t_s: time since the first record; local_ns: monotonic clock of this machine, which is the same for
///         all programs on this machine
/// Thread  always the same thread, not the haptic one
class TraceWriter {
 public:
  /// In      every  1: each record is written; 10: every tenth record
  /// Fails   std::invalid_argument if the file cannot be created, or `every` is 0
  TraceWriter(const std::filesystem::path& file, std::uint64_t every);

  /// In      phase  index of the phase of the hand's path; −1 for none
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

/// Returns the header row: comma-separated names with units.
std::string trace_header();
/// Returns one row in the format of TraceWriter.
/// In      start  time at which t_s is 0
std::string trace_row(const TickRecord& record, LocalTime start, int phase);

}  // namespace tandem::client
