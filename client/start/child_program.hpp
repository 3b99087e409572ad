// A program that runs as a child process of this one, e.g. a server that the window has started.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <filesystem>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "common/base/time.hpp"

namespace tandem::client {

/// Runs a program in a process group of its own. So Ctrl-C reaches only the parent, which then ends the program in
/// order. If the parent ends in any way, SIGKILL included, the kernel sends SIGTERM to the program.
///
/// Thread  main. The kernel sends SIGTERM when the thread that has started the process ends, so this thread must exist
///         as long as the program. A thread of this object reads the program's output, so that the pipe never fills
class ChildProgram {
 public:
  static constexpr std::size_t kMaxLines = 256;  ///< number of stored output lines; older ones are dropped
  static constexpr std::size_t kMaxLineBytes = 4096;
  static constexpr int kNotExecuted = 127;  ///< exit code of a program that could not be executed

  /// Fails   std::system_error if no process or pipe can be created
  ChildProgram(const std::filesystem::path& program, const std::vector<std::string>& arguments);
  /// Calls stop(). Does not wait for the end of the output, because a process that the program has started may still
  /// hold the pipe open.
  ~ChildProgram();
  ChildProgram(const ChildProgram&) = delete;
  ChildProgram& operator=(const ChildProgram&) = delete;

  bool is_running();
  /// Returns the exit code, or 128 plus the number of the signal that ended the program. Valid when is_running() is
  /// false.
  int exit_code() const { return exit_code_; }
  /// Returns true if the output has ended. The next take_lines() then returns the last lines.
  bool has_read_all() const { return has_read_all_; }
  /// Returns the lines of stdout and stderr since the last call.
  std::vector<std::string> take_lines();
  /// Sends SIGTERM to the program and the processes that it has started.
  void request_stop();
  /// Sends SIGTERM, and SIGKILL if the program still runs after `patience`.
  void stop(Duration patience = std::chrono::milliseconds(1000));

 private:
  void read_lines();
  void add_line(std::string& line);

  pid_t process_ = -1;
  int output_ = -1;  ///< read end of the pipe
  bool has_ended_ = false;
  int exit_code_ = 0;
  std::mutex mutex_;  ///< protects lines_
  std::vector<std::string> lines_;
  std::atomic<bool> is_stopping_{false};  ///< true: the reader must end, even before the end of the output
  std::atomic<bool> has_read_all_{false};
  std::thread reader_;
};

/// Returns the program of this name in the folder of the running program.
std::filesystem::path program_beside(const std::string& name);

}  // namespace tandem::client
