// Program tandem-watchdog: writes zero to one device when the owner (the program that started it) is silent or has
// ended. See watchdog.hpp.
#include "devices/watchdog_program.hpp"

#include <fcntl.h>
#include <linux/sockios.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <optional>
#include <string_view>
#include <utility>

#include "common/realtime/realtime.hpp"
#include "devices/watchdog.hpp"

using namespace tandem;
using namespace tandem::devices;
using namespace tandem::devices::watchdog_program;

namespace {

constexpr int kCheckPeriod_ms = 5;
constexpr Duration kCheckPeriod = std::chrono::milliseconds(kCheckPeriod_ms);
// Number of zeros written in one silence of the owner. One is not enough, because the device may lose packets in
// transit. More would be useless, and the device answers each one although no program reads the answers.
constexpr int kZeros = 5;
// Maximum time after the owner's end for which zero is retried while the device accepts nothing. Our choice.
constexpr Duration kMaxRetry = std::chrono::seconds(10);
// Maximum time after an owner has resumed during which zero must still be written. The owner may complete an old
// command with a force, so a zero must follow it. After this time the owner has restarted its force from zero, so no
// further zero is needed.
constexpr Duration kMaxAnswer = std::chrono::milliseconds(20);

using Bytes = std::vector<std::uint8_t>;

ZeroCommand zero_from(std::string_view endpoint, std::string_view hex) {
  ZeroCommand zero{.descriptor = kDevice, .bytes = {}};
  if (endpoint != "-") zero.usb_endpoint = static_cast<std::uint8_t>(std::atoi(endpoint.data()));
  for (std::size_t i = 0; i + 1 < hex.size() && zero.bytes.size() < kMaxFrameBytes; i += 2)
    zero.bytes.push_back(static_cast<std::uint8_t>(std::stoi(std::string(hex.substr(i, 2)), nullptr, 16)));
  return zero;
}

/// Writes frames to the device's descriptor. Each frame is completed before the next one.
class Line {
 public:
  explicit Line(ZeroCommand zero) : zero_(std::move(zero)) {
    struct stat status {};
    is_socket_ = fstat(zero_.descriptor, &status) == 0 && S_ISSOCK(status.st_mode);
  }
  const Bytes& zero() const { return zero_.bytes; }
  /// Sets the next frame; empty: no frame. Must not be called while a frame is partly written.
  void set_next(const Bytes& frame) { frame_ = frame; }
  bool has_frame() const { return !frame_.empty(); }
  /// Writes as much of the frame as the device accepts now. Returns whether the frame is now written completely.
  bool push() noexcept;
  /// Returns whether a frame is partly written.
  bool is_within() const { return out_ > 0; }
  /// Returns whether the device was unplugged or has closed the connection, so that it accepts nothing more.
  bool is_lost() const { return is_lost_; }
  /// Returns whether the device accepts no bytes now. In this case poll(2) reports when it accepts bytes again.
  bool is_full() const { return is_full_; }
  /// For sockets: discards input that the owner did not read, for two reasons. A peer that is blocked by unread input
  /// would not read the zero. Closing a socket with unread input would discard its output.
  void discard_input() const noexcept;
  /// For sockets: returns the number of written bytes that the peer has not acknowledged.
  int unsent_bytes() const noexcept;

 private:
  ssize_t write_some() const noexcept;

  ZeroCommand zero_;
  Bytes frame_;
  std::size_t out_ = 0;
  bool is_socket_ = false;
  bool is_full_ = false;
  bool is_lost_ = false;
};

/// Writes a part of the frame. It never blocks, except for up to 20 ms in a USB transfer.
ssize_t Line::write_some() const noexcept {
  const std::uint8_t* const bytes = frame_.data() + out_;
  const std::size_t size = frame_.size() - out_;
  if (zero_.usb_endpoint) return send_zero(zero_) ? static_cast<ssize_t>(size) : -1;
  if (is_socket_) return send(zero_.descriptor, bytes, size, MSG_DONTWAIT | MSG_NOSIGNAL);
  pollfd room{zero_.descriptor, POLLOUT, 0};
  const bool may_block = (fcntl(zero_.descriptor, F_GETFL) & O_NONBLOCK) == 0;
  if (may_block && (poll(&room, 1, 0) != 1 || (room.revents & POLLOUT) == 0)) {
    errno = EAGAIN;
    return -1;
  }
  return write(zero_.descriptor, bytes, size);
}

bool Line::push() noexcept {
  constexpr std::array kLost{ENODEV, ESHUTDOWN, ECONNRESET, ENOTCONN, EBADF};
  while (out_ < frame_.size()) {
    errno = 0;
    const ssize_t count = write_some();
    if (count < 0 && errno == EINTR) continue;
    is_full_ = count < 0 && errno == EAGAIN && !zero_.usb_endpoint;
    is_lost_ = count < 0 && (std::ranges::find(kLost, errno) != kLost.end() || (is_socket_ && errno == EPIPE));
    if (count <= 0) return false;
    out_ += static_cast<std::size_t>(count);
  }
  out_ = 0;
  frame_.clear();
  return true;
}

void Line::discard_input() const noexcept {
  std::array<std::uint8_t, 4096> input;
  while (is_socket_ && recv(zero_.descriptor, input.data(), input.size(), MSG_DONTWAIT) > 0) {
  }
}

int Line::unsent_bytes() const noexcept {
  int bytes = 0;
  return is_socket_ && ioctl(zero_.descriptor, SIOCOUTQ, &bytes) == 0 ? bytes : 0;
}

/// A frame received from the owner, none of whose bytes have been written yet.
struct Waiting {
  WatchdogFrameHead head;
  Bytes frame;
};

/// Chooses the next frame for the device. The choice depends on the state of the owner: running, silent or ended.
class Watch {
 public:
  Watch(ZeroCommand zero, WatchdogBeat& beat) : line_(std::move(zero)), beat_(beat) {}

  /// Receives the owner's packets. Returns false if the owner has ended.
  bool receive();
  void check(LocalTime now);
  void on_owner_exit(const Clock& clock);
  /// Sleeps until the device can accept bytes or the owner has sent a packet, but at most for kCheckPeriod.
  void wait() const noexcept;

 private:
  enum class Kind : std::uint8_t { kNone, kZero, kAnswer, kCommand, kReply };
  void write_all(LocalTime now);
  void choose(LocalTime now);
  void set_next(Kind kind, const Bytes& frame);
  void choose_command();
  void note_begun();
  void note_written(LocalTime now);
  void set_in_frame(bool is_in_frame) noexcept;

  Line line_;
  WatchdogBeat& beat_;
  Kind kind_ = Kind::kNone;   ///< kind of the frame that `line_` writes
  std::uint32_t number_ = 0;  ///< number of the command in that frame
  std::optional<Waiting> command_, reply_;
  /// True: the owner passes all its frames to this process, which is then the only writer of the stream
  bool is_writer_ = false;
  bool is_silent_ = false;  ///< true: the owner became silent while a force was displayed
  bool has_owner_exited_ = false;
  LocalTime silent_since_{};
  int zeros_ = 0;  ///< number of zeros that the device has accepted in the current silence
  LocalTime next_zero_{};
  LocalTime answer_until_{};
};

bool Watch::receive() {
  std::array<std::uint8_t, sizeof(WatchdogFrameHead) + kMaxFrameBytes> packet;
  while (true) {
    const ssize_t size = recv(kOwner, packet.data(), packet.size(), MSG_DONTWAIT);
    if (size < 0 && errno == EINTR) continue;
    if (size < 0 && errno == EAGAIN) return true;
    if (size <= static_cast<ssize_t>(sizeof(WatchdogFrameHead))) return false;
    Waiting waiting;
    std::memcpy(&waiting.head, packet.data(), sizeof waiting.head);
    waiting.frame.assign(packet.begin() + sizeof waiting.head, packet.begin() + size);
    is_writer_ = true;
    (waiting.head.number != 0 ? command_ : reply_) = std::move(waiting);
  }
}

void Watch::check(LocalTime now) {
  const bool is_force_on = beat_.is_force_on.load(std::memory_order_acquire);
  const LocalTime beat_at{Duration(beat_.at_ns.load(std::memory_order_relaxed))};
  const bool was_silent = is_silent_;
  is_silent_ = now - beat_at > Watchdog::kMaxSilence && (is_force_on || was_silent);
  // The time of the last beat has changed: the owner has resumed and become silent again since the last check. This new
  // silence needs new zeros.
  if (is_silent_ && (!was_silent || beat_at != silent_since_)) {
    zeros_ = 0;
    next_zero_ = now;
  }
  silent_since_ = beat_at;
  // An owner that writes to the device itself may have been stopped during a write. When it resumes, it completes this
  // old command. A zero must follow then (kMaxAnswer).
  if (was_silent && !is_silent_ && zeros_ > 0 && !is_writer_) answer_until_ = now + kMaxAnswer;
  write_all(now);
}

// Writes frames as long as the device accepts them. A frame of which no byte has been written yet is chosen again each
// time, because a newer one may replace it.
void Watch::write_all(LocalTime now) {
  while (true) {
    const bool was_within = line_.is_within();
    if (!was_within) choose(now);
    if (!line_.has_frame()) return;
    set_in_frame(true);
    const bool is_out = line_.push();
    if (!was_within && (is_out || line_.is_within())) note_begun();
    if (is_out) note_written(now);
    if (!line_.is_within()) set_in_frame(false);
    if (!is_out) return;
  }
}

void Watch::choose(LocalTime now) {
  if (is_silent_ && zeros_ < kZeros && now >= next_zero_) return set_next(Kind::kZero, line_.zero());
  if (!is_silent_ && now < answer_until_) return set_next(Kind::kAnswer, line_.zero());
  if (command_) return choose_command();
  if (reply_) return set_next(Kind::kReply, reply_->frame);
  set_next(Kind::kNone, {});
}

void Watch::set_next(Kind kind, const Bytes& frame) {
  kind_ = kind;
  line_.set_next(frame);
}

void Watch::choose_command() {
  const bool is_obsolete = command_->head.known_releases != beat_.releases.load(std::memory_order_relaxed);
  number_ = command_->head.number;
  set_next(Kind::kCommand, is_obsolete && command_->head.is_force_on != 0 ? line_.zero() : command_->frame);
}

void Watch::note_begun() {
  if (kind_ == Kind::kCommand) command_.reset();
  if (kind_ == Kind::kReply) reply_.reset();
}

void Watch::note_written(LocalTime now) {
  if (kind_ == Kind::kAnswer) answer_until_ = {};
  if (kind_ == Kind::kCommand && !has_owner_exited_) beat_.written.store(number_, std::memory_order_release);
  if (kind_ != Kind::kZero) return;
  if (zeros_++ == 0 && !has_owner_exited_) beat_.releases.fetch_add(1, std::memory_order_release);
  next_zero_ = now + kCheckPeriod;
}

/// Stores whether a frame may be written only in part. After the owner's end it stores nothing, because a new watchdog
/// may already use the shared memory.
void Watch::set_in_frame(bool is_in_frame) noexcept {
  if (!has_owner_exited_) beat_.is_in_frame.store(is_in_frame, std::memory_order_release);
}

void Watch::on_owner_exit(const Clock& clock) {
  const bool is_force_on = beat_.is_force_on.load(std::memory_order_acquire);
  has_owner_exited_ = is_silent_ = true;
  zeros_ = is_force_on ? 0 : kZeros;
  next_zero_ = clock.now();
  command_.reset();
  reply_.reset();
  LocalTime end = clock.now() + kMaxRetry;
  int unsent_before = 0;
  while (true) {
    write_all(clock.now());
    line_.discard_input();
    const int unsent = line_.unsent_bytes();
    if (std::exchange(unsent_before, unsent) != unsent) end = clock.now() + kMaxRetry;
    const bool is_done = zeros_ >= kZeros && !line_.is_within() && unsent == 0;
    if (is_done || line_.is_lost() || clock.now() >= end) return;
    wait();
  }
}

void Watch::wait() const noexcept {
  const int owner = has_owner_exited_ ? -1 : kOwner;
  const int device = line_.has_frame() && line_.is_full() ? kDevice : -1;
  std::array<pollfd, 2> wakes{pollfd{owner, POLLIN, 0}, pollfd{device, POLLOUT, 0}};
  poll(wakes.data(), wakes.size(), kCheckPeriod_ms);
}

constexpr const char* kHelp =
    "Sets the force of a haptic device to zero when the program that opened it is silent or has ended.\n"
    "Usage: tandem-watchdog PRIORITY ENDPOINT ZERO\n\n"
    "Positionals:\n"
    "  PRIORITY INT REQUIRED       SCHED_FIFO priority, 1 to 99; 0: normal scheduler\n"
    "  ENDPOINT TEXT REQUIRED      USB endpoint of the device; -: none\n"
    "  ZERO HEX REQUIRED           bytes of the zero command\n\n"
    "Options:\n"
    "  --help                      Print this help message and exit\n\n"
    "A program that opens a haptic device starts it, with descriptors of its own. There is no other use of it.\n"
    "Exit code: 0 done, 2 called in another way.\n";

}  // namespace

int main(int count, char** arguments) {
  if (count == 2 && arguments[1] == std::string_view("--help")) {
    std::cout << kHelp;
    return 0;
  }
  void* const shared = mmap(nullptr, sizeof(WatchdogBeat), PROT_READ | PROT_WRITE, MAP_SHARED, kMemory, 0);
  if (count != 4 || shared == MAP_FAILED) {
    std::cerr << "tandem-watchdog is started by a program that opens a haptic device; there is no other use of it\n";
    return 2;
  }
  for (const int signal : {SIGINT, SIGTERM, SIGQUIT, SIGHUP, SIGPIPE, SIGTSTP}) std::signal(signal, SIG_IGN);
  static_cast<void>(realtime::request_realtime(std::atoi(arguments[1])));
  const SteadyClock clock;
  Watch watch(zero_from(arguments[2], arguments[3]), *static_cast<WatchdogBeat*>(shared));
  while (watch.receive()) {
    watch.check(clock.now());
    watch.wait();
  }
  watch.on_owner_exit(clock);
}
