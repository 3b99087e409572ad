#include "client/embed/embedded_client.hpp"

#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <thread>

#include "client/embed/c_structs.hpp"
#include "client/embed/sized_struct.hpp"
#include "client/embed/status_error.hpp"

namespace tandem::client::embed {
namespace {

/// While an object of this class exists, all signals of the calling thread are blocked, except those of faults. Threads
/// started during this time inherit the mask. So the program's signal handlers never run on threads of the library.
class SignalsBlocked {
 public:
  SignalsBlocked() {
    sigset_t all;
    sigfillset(&all);
    // A signal for a fault must be handled in the thread that caused it.
    for (const int fault : {SIGSEGV, SIGBUS, SIGFPE, SIGILL}) sigdelset(&all, fault);
    pthread_sigmask(SIG_SETMASK, &all, &before_);
  }
  ~SignalsBlocked() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  SignalsBlocked(const SignalsBlocked&) = delete;
  SignalsBlocked& operator=(const SignalsBlocked&) = delete;

 private:
  sigset_t before_{};
};

std::shared_ptr<OwnDevice> reserved(std::shared_ptr<OwnDevice> device) {
  if (device != nullptr && !device->reserve()) {
    throw StatusError(TANDEM_BAD_STATE, "own_device is used by another client; close or stop that client first");
  }
  return device;
}

[[noreturn]] void refuse_closed() {
  throw StatusError(TANDEM_BAD_HANDLE, "the client was closed by another thread");
}

}  // namespace

Signal::Signal() : descriptor_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
  if (descriptor_ < 0) throw std::system_error(errno, std::generic_category(), "cannot open an eventfd");
}

Signal::~Signal() {
  ::close(descriptor_);
}

void Signal::raise() noexcept {
  const std::uint64_t one = 1;
  // The write can fail only if the eventfd's counter is full. In that case the signal is raised already.
  [[maybe_unused]] const auto written = ::write(descriptor_, &one, sizeof one);
}

void Signal::lower() noexcept {
  std::uint64_t count = 0;
  [[maybe_unused]] const auto taken = ::read(descriptor_, &count, sizeof count);
}

bool Signal::wait(Duration timeout) const noexcept {
  pollfd ready{descriptor_, POLLIN, 0};
  const SteadyClock clock;
  const LocalTime deadline = clock.now() + timeout;
  while (true) {
    const Duration left = std::max(Duration{0}, deadline - clock.now());
    const auto milliseconds = std::chrono::ceil<std::chrono::milliseconds>(left).count();
    const int count = ::poll(&ready, 1, static_cast<int>(milliseconds));
    if (count > 0) return true;
    if (count == 0 || errno != EINTR) return false;
  }
}

EmbeddedClient::EmbeddedClient(ClientConfig config)
    : realtime_priority_(config.realtime_priority),
      has_links_(config.io.links.has_value()),
      own_device_(reserved(std::move(config.own_device))) {
  try {
    const SignalsBlocked blocked;
    if (own_device_ == nullptr) device_ = devices::open_device(config.device);
    devices::Device& device = own_device_ != nullptr ? static_cast<devices::Device&>(*own_device_) : *device_;
    device_name_ = device.spec().name;
    io_ = std::make_unique<ClientIo>(with_signal(std::move(config.io)), device);
  } catch (...) {
    if (own_device_ != nullptr) own_device_->unreserve();
    throw;
  }
}

EmbeddedClient::~EmbeddedClient() {
  close();
}

ClientIoSettings EmbeddedClient::with_signal(ClientIoSettings settings) {
  settings.on_events = [this] { events_.raise(); };
  return settings;
}

void EmbeddedClient::join() {
  const std::lock_guard lock(lifecycle_);
  if (phase_ != Phase::kOpen) {
    throw StatusError(TANDEM_BAD_STATE, "the client has joined before; open another one to join again");
  }
  const SignalsBlocked blocked;
  io_->start();
  phase_ = Phase::kJoining;
}

void EmbeddedClient::wait_joined(Duration timeout) {
  const SteadyClock clock;
  const LocalTime deadline = clock.now() + timeout;
  while (true) {
    if (is_closed_) refuse_closed();
    const Phase phase = phase_;
    if (phase == Phase::kOpen) throw StatusError(TANDEM_BAD_STATE, "call tandem_client_join() first");
    if (phase == Phase::kStopped) throw StatusError(TANDEM_ENDED, "the client was stopped");
    const ClientIoSnapshot io = io_->snapshot();
    if (io.status.state == SessionState::kActive && io.joined != nullptr) return;
    if (io.status.state == SessionState::kEnded) throw StatusError(TANDEM_ENDED, io.status.why);
    if (clock.now() >= deadline) {
      throw StatusError(TANDEM_TIMED_OUT,
                        "the room is not joined yet" + (io.status.why.empty() ? std::string() : ": " + io.status.why));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
}

void EmbeddedClient::start() {
  const std::lock_guard lock(lifecycle_);
  if (phase_ != Phase::kJoining) {
    throw StatusError(TANDEM_BAD_STATE, phase_ == Phase::kOpen ? "call tandem_client_join() first"
                                                               : "the client runs already, or was stopped");
  }
  HapticLoopSettings settings;
  settings.realtime_priority = realtime_priority_;
  {
    const std::lock_guard ticks_lock(ticks_mutex_);
    loop_ = std::make_unique<HapticLoop>(settings, io_->haptics(), [this] { io_->notify(); });
  }
  const SignalsBlocked blocked;
  std::string note;
  for (const std::string& missing : loop_->start()) note += (note.empty() ? "" : "; ") + missing;
  phase_ = Phase::kRunning;
  const std::lock_guard notes_lock(notes_mutex_);
  realtime_note_ = std::move(note);
}

void EmbeddedClient::stop() noexcept {
  const std::lock_guard lock(lifecycle_);
  if (phase_ == Phase::kStopped) return;
  if (loop_ != nullptr) loop_->stop();
  io_->stop();
  phase_ = Phase::kStopped;
  if (own_device_ != nullptr) own_device_->unreserve();
}

void EmbeddedClient::begin_stop() noexcept {
  const std::lock_guard lock(lifecycle_);
  if (loop_ != nullptr) loop_->request_stop();
}

void EmbeddedClient::close() noexcept {
  is_closed_ = true;
  events_.raise();
  stop();
}

void EmbeddedClient::send(Command command) {
  const Phase phase = phase_;
  if (phase != Phase::kJoining && phase != Phase::kRunning) {
    throw StatusError(TANDEM_BAD_STATE, phase == Phase::kOpen ? "a command is possible after tandem_client_join()"
                                                              : "the client was stopped");
  }
  io_->send(std::move(command));
}

wire::Point EmbeddedClient::point_of(std::uint32_t body, const Vec3& place_W) {
  Vec3 place = place_W;
  if (body != 0) {
    const std::lock_guard lock(view_mutex_);
    const View* const view = io_->haptics().newest_view();
    if (view == nullptr) throw StatusError(TANDEM_BAD_STATE, "no state was received yet; wait for a snapshot");
    const auto found = std::ranges::find(view->bodies, BodyId{body}, &proto::BodyState::id);
    if (found == view->bodies.end()) {
      throw StatusError(TANDEM_BAD_ARGUMENT, "the room has no body " + std::to_string(body));
    }
    place = found->state.X.inverse() * place_W;
  }
  wire::Point point;
  point.set_body(body);
  for (int i = 0; i < 3; ++i) point.add_place(place[i]);
  for (int i = 0; i < 3; ++i) point.add_place_w(place_W[i]);
  return point;
}

tandem_session EmbeddedClient::session() const {
  const ClientIoSnapshot io = io_->snapshot();
  tandem_session session = c_session(io);
  const Phase phase = phase_;
  if (phase == Phase::kOpen) session.state = TANDEM_NOT_STARTED;
  if (phase == Phase::kStopped) session.state = TANDEM_SESSION_ENDED;
  session.is_running = phase == Phase::kRunning ? 1 : 0;
  cut_text(device_name_, session.device);
  {
    const std::lock_guard lock(ticks_mutex_);
    if (loop_ != nullptr) session.lost_ticks = loop_->trace_overflows();
  }
  std::string note = io.rendering.stage_note;
  const std::lock_guard lock(notes_mutex_);
  for (const std::string& more : {io.rendering.model_problem, realtime_note_}) {
    if (!more.empty()) note += (note.empty() ? "" : "; ") + more;
  }
  cut_text(note, session.note);
  return session;
}

std::optional<EmbeddedClient::Newest> EmbeddedClient::newest() {
  const std::lock_guard lock(view_mutex_);
  const View* const view = io_->haptics().newest_view();
  if (view == nullptr) return std::nullopt;
  return Newest{c_snapshot(*view), c_tick(view->record)};
}

std::vector<tandem_body> EmbeddedClient::bodies() {
  const std::shared_ptr<const wire::Joined> joined = io_->snapshot().joined;
  const std::lock_guard lock(view_mutex_);
  const View* const view = io_->haptics().newest_view();
  if (view == nullptr || joined == nullptr) return {};
  std::vector<tandem_body> bodies;
  bodies.reserve(view->bodies.size());
  for (const proto::BodyState& body : view->bodies) bodies.push_back(c_body(body, joined->scene()));
  std::ranges::sort(bodies, {}, &tandem_body::id);
  return bodies;
}

std::vector<tandem_user> EmbeddedClient::users() {
  const std::vector<wire::UserJoined> known = io_->snapshot().users;
  const std::lock_guard lock(view_mutex_);
  const View* const view = io_->haptics().newest_view();
  if (view == nullptr) return {};
  std::vector<tandem_user> users;
  for (const proto::OtherUserState& user : view->users) {
    const auto named = std::ranges::find(known, user.id.value, &wire::UserJoined::user);
    if (named != known.end()) users.push_back(c_user(user, *named));
  }
  return users;
}

bool EmbeddedClient::pop(tandem_tick& tick) {
  const std::lock_guard lock(ticks_mutex_);
  TickRecord record;
  if (loop_ == nullptr || !loop_->pop(record)) return false;
  tick = c_tick(record);
  return true;
}

// Returns the next event. If the queue is empty, the signal is lowered, and then the queue is read a second time,
// because an event may have arrived before the lowering. If this second read returns an event, the signal is raised
// again for further events.
std::optional<Event> EmbeddedClient::next_event() {
  std::optional<Event> event = io_->next();
  if (event.has_value() || is_closed_) return event;
  events_.lower();
  event = io_->next();
  // close() raises the signal too. If close() was called just before lower(), the signal must be raised again.
  if (event.has_value() || is_closed_) events_.raise();
  return event;
}

void EmbeddedClient::wait_event(Duration timeout) {
  const bool is_raised = events_.wait(timeout);
  if (is_closed_) refuse_closed();
  if (!is_raised) throw StatusError(TANDEM_TIMED_OUT, "no event has arrived");
}

}  // namespace tandem::client::embed
