#include "client/start/child_program.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

namespace tandem::client {
namespace {

constexpr Duration kPollPeriod = std::chrono::milliseconds(5);
constexpr int kReadPeriod_ms = 50;  ///< period at which the reader checks whether it must end

/// Replaces the child process by the program. Between fork and exec only async-signal-safe functions are called.
[[noreturn]] void become(char* const* arguments, int output, int nothing, pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (getppid() != parent) _exit(ChildProgram::kNotExecuted);  // the parent ended before prctl() took effect
  setpgid(0, 0);
  dup2(nothing, STDIN_FILENO);
  dup2(output, STDOUT_FILENO);
  dup2(output, STDERR_FILENO);
  // The parent blocks the stop signals and ignores SIGPIPE. The program would inherit both, so they are reset.
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  signal(SIGPIPE, SIG_DFL);
  execv(arguments[0], arguments);
  _exit(ChildProgram::kNotExecuted);
}

}  // namespace

ChildProgram::ChildProgram(const std::filesystem::path& program, const std::vector<std::string>& arguments) {
  std::vector<std::string> texts{program.string()};
  texts.insert(texts.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  for (std::string& text : texts) pointers.push_back(text.data());
  pointers.push_back(nullptr);
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) throw std::system_error(errno, std::generic_category(), "no pipe");
  const int nothing = open("/dev/null", O_RDONLY | O_CLOEXEC);
  const pid_t parent = getpid();
  process_ = fork();
  if (process_ == 0) become(pointers.data(), ends[1], nothing, parent);
  const int problem = errno;
  close(ends[1]);
  close(nothing);
  output_ = ends[0];
  if (process_ < 0) {
    close(output_);
    throw std::system_error(problem, std::generic_category(), "no process can be made");
  }
  // The group must exist before the first signal. Parent and child may run in either order, so both set the group.
  setpgid(process_, process_);
  reader_ = std::thread([this] { read_lines(); });
}

ChildProgram::~ChildProgram() {
  stop();
  is_stopping_ = true;
  reader_.join();
  close(output_);
}

bool ChildProgram::is_running() {
  if (has_ended_) return false;
  int status = 0;
  const pid_t ended = waitpid(process_, &status, WNOHANG);
  if (ended == 0) return true;
  has_ended_ = true;
  exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return false;
}

std::vector<std::string> ChildProgram::take_lines() {
  const std::lock_guard lock(mutex_);
  return std::exchange(lines_, {});
}

void ChildProgram::request_stop() {
  if (is_running()) kill(-process_, SIGTERM);
}

void ChildProgram::stop(Duration patience) {
  request_stop();
  const SteadyClock clock;
  const LocalTime give_up = clock.now() + patience;
  while (is_running() && clock.now() < give_up) std::this_thread::sleep_for(kPollPeriod);
  if (!is_running()) return;
  kill(-process_, SIGKILL);
  while (is_running()) std::this_thread::sleep_for(kPollPeriod);
}

void ChildProgram::read_lines() {
  std::string line;
  std::array<char, 4096> buffer{};
  while (!is_stopping_) {
    pollfd waiting{.fd = output_, .events = POLLIN, .revents = 0};
    if (poll(&waiting, 1, kReadPeriod_ms) <= 0) continue;
    const ssize_t size = read(output_, buffer.data(), buffer.size());
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) break;
    for (const char c : std::string_view(buffer.data(), static_cast<std::size_t>(size))) {
      // A progress line ends with a carriage return instead of a line feed.
      if (c == '\n' || c == '\r') {
        add_line(line);
      } else if (line.size() < kMaxLineBytes) {
        line += c;
      }
    }
  }
  add_line(line);
  has_read_all_ = true;
}

void ChildProgram::add_line(std::string& line) {
  const std::lock_guard lock(mutex_);
  if (lines_.size() >= kMaxLines) lines_.erase(lines_.begin());
  if (!line.empty()) lines_.push_back(line);
  line.clear();
}

std::filesystem::path program_beside(const std::string& name) {
  std::error_code error;
  return std::filesystem::read_symlink("/proc/self/exe", error).parent_path() / name;
}

}  // namespace tandem::client
