// C++ interface of libtandem (C++17), a layer over tandem.h: classes whose destructors close the handles, and
// exceptions of the type tandem::Error. It needs only the standard library. tandem.h describes units, frames, threads
// and safety.
//
//   tandem::ClientSettings settings;
//   settings.is_insecure = true;
//   tandem::Client client(settings);
//   client.join();
//   client.wait_joined();
//   client.start();
//   while (...) { tandem_tick tick = client.snapshot().tick; ... }
//
// The destructor of Client ramps the force to zero and leaves the room.
#pragma once

#include <chrono>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tandem.h"

namespace tandem {

using Seconds = std::chrono::duration<double>;

/// Exception for a failed call; what() names the value and the remedy.
class Error : public std::runtime_error {
 public:
  explicit Error(tandem_status status) : std::runtime_error(text_of(status)), status_(status) {}
  /// Returns the status of the call, e.g. TANDEM_BAD_HANDLE.
  tandem_status status() const noexcept { return status_; }

 private:
  static std::string text_of(tandem_status status) {
    const std::string text = tandem_last_error();
    return text.empty() ? tandem_status_text(status) : text;
  }

  tandem_status status_;
};

namespace detail {

/// Throws if the status is an error.
inline tandem_status check(tandem_status status) {
  if (status < 0) throw Error(status);
  return status;
}

/// Returns a struct of zeros with its struct_size.
template <class Struct>
Struct sized() {
  Struct made{};
  made.struct_size = sizeof made;
  return made;
}

inline const char* text_or_null(const std::string& text) {
  return text.empty() ? nullptr : text.c_str();
}

/// Owns a handle and closes it exactly once.
template <tandem_status (*Close)(std::uint64_t) noexcept>
class Handle {
 public:
  Handle() = default;
  explicit Handle(std::uint64_t handle) noexcept : handle_(handle) {}
  Handle(Handle&& other) noexcept : handle_(std::exchange(other.handle_, 0)) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  ~Handle() {
    if (handle_ != 0) Close(handle_);
  }
  std::uint64_t get() const noexcept { return handle_; }

 private:
  std::uint64_t handle_ = 0;
};

}  // namespace detail

/// A device that the program drives. The program must call feed() and force() 200 to 2000 times a second, from any
/// thread.
class OwnDevice {
 public:
  /// In      settings  struct_size need not be set
  explicit OwnDevice(tandem_device_settings settings = {}) {
    settings.struct_size = sizeof settings;
    tandem_device device = 0;
    detail::check(tandem_device_open(&settings, &device));
    handle_ = decltype(handle_)(device);
  }

  void feed(tandem_sample sample) {
    sample.struct_size = sizeof sample;
    detail::check(tandem_device_feed(handle_.get(), &sample));
  }
  tandem_force force() const {
    auto force = detail::sized<tandem_force>();
    detail::check(tandem_device_force(handle_.get(), &force));
    return force;
  }
  tandem_device handle() const noexcept { return handle_.get(); }

 private:
  detail::Handle<tandem_device_close> handle_;
};

/// Settings of a client. An empty text or a zero selects the default that tandem.h states.
struct ClientSettings {
  std::string server, room, user_name;
  std::string invitation, pin, authorities, token;
  bool is_insecure = false;
  std::uint32_t role = 0;
  bool uses_tcp = false;
  const OwnDevice* own_device = nullptr;  ///< device that the program drives; must exist when the client is constructed
  std::string device, profile, hand;
  std::string stage, predictor;
  bool has_passivity = true;
  int realtime_priority = 0;
  bool has_simulated_link = false;
  bool has_cache = true;
  std::string firmware, library, service, motors;
  double motor_counts_per_n_m = 0;
};

struct Snapshot {
  bool has_tick = false;  ///< false: the loop has not ticked yet, and all values are zero
  tandem_snapshot room{};
  tandem_tick tick{};
};

struct Event {
  tandem_event about{};
  std::string text;
};

class Client {
 public:
  explicit Client(const ClientSettings& settings) {
    auto c = detail::sized<tandem_client_settings>();
    c.role = settings.role;
    c.server = detail::text_or_null(settings.server);
    c.room = detail::text_or_null(settings.room);
    c.user_name = detail::text_or_null(settings.user_name);
    c.invitation = detail::text_or_null(settings.invitation);
    c.pin = detail::text_or_null(settings.pin);
    c.authorities = detail::text_or_null(settings.authorities);
    c.token = detail::text_or_null(settings.token);
    c.is_insecure = settings.is_insecure ? 1 : 0;
    c.uses_tcp = settings.uses_tcp ? 1 : 0;
    c.own_device = settings.own_device != nullptr ? settings.own_device->handle() : 0;
    c.device = detail::text_or_null(settings.device);
    c.profile = detail::text_or_null(settings.profile);
    c.hand = detail::text_or_null(settings.hand);
    c.stage = detail::text_or_null(settings.stage);
    c.predictor = detail::text_or_null(settings.predictor);
    c.has_no_passivity = settings.has_passivity ? 0 : 1;
    c.realtime_priority = settings.realtime_priority;
    c.has_simulated_link = settings.has_simulated_link ? 1 : 0;
    c.has_no_cache = settings.has_cache ? 0 : 1;
    c.firmware = detail::text_or_null(settings.firmware);
    c.motor_counts_per_n_m = settings.motor_counts_per_n_m;
    c.library = detail::text_or_null(settings.library);
    c.service = detail::text_or_null(settings.service);
    c.motors = detail::text_or_null(settings.motors);
    tandem_client client = 0;
    detail::check(tandem_client_open(&c, &client));
    handle_ = decltype(handle_)(client);
  }

  void join() { detail::check(tandem_client_join(handle_.get())); }
  void wait_joined(Seconds timeout = Seconds(20)) {
    detail::check(tandem_client_wait_joined(handle_.get(), timeout.count()));
  }
  void start() { detail::check(tandem_client_start(handle_.get())); }
  /// Ramps the force to zero and leaves the room. Unread ticks and events can still be read afterwards.
  void stop() { detail::check(tandem_client_stop(handle_.get())); }

  tandem_session session() const {
    auto session = detail::sized<tandem_session>();
    detail::check(tandem_client_session(handle_.get(), &session));
    return session;
  }
  Snapshot snapshot() const {
    Snapshot snapshot{false, detail::sized<tandem_snapshot>(), detail::sized<tandem_tick>()};
    snapshot.has_tick =
        detail::check(tandem_client_snapshot(handle_.get(), &snapshot.room, &snapshot.tick)) == TANDEM_OK;
    return snapshot;
  }
  std::vector<tandem_body> bodies() const { return all<tandem_body, tandem_client_bodies>(64); }
  std::vector<tandem_user> users() const { return all<tandem_user, tandem_client_users>(16); }
  /// Returns and removes the oldest unread ticks, at most `most`.
  std::vector<tandem_tick> read_ticks(std::uint32_t most = 1024) {
    return all<tandem_tick, tandem_client_read_ticks>(most);
  }

  /// Returns and removes the oldest event; nothing if there is none.
  std::optional<Event> next_event() {
    Event event{detail::sized<tandem_event>(), std::string(4096, '\0')};
    const tandem_status status =
        tandem_client_next_event(handle_.get(), &event.about, event.text.data(), event.text.size());
    if (detail::check(status) == TANDEM_EMPTY) return std::nullopt;
    event.text.resize(event.text.find('\0'));
    return event;
  }
  /// Waits for an event. Returns false after the time-out.
  bool wait_event(Seconds timeout) {
    const tandem_status status = tandem_client_wait_event(handle_.get(), timeout.count());
    if (status == TANDEM_TIMED_OUT) return false;
    detail::check(status);
    return true;
  }
  int event_descriptor() const {
    int descriptor = -1;
    detail::check(tandem_client_event_descriptor(handle_.get(), &descriptor));
    return descriptor;
  }

  void grab(std::uint32_t body = 0) { detail::check(tandem_client_grab(handle_.get(), body)); }
  void release() { detail::check(tandem_client_release(handle_.get())); }
  void point(const double (&place_W_m)[3], std::uint32_t body = 0) {
    detail::check(tandem_client_point(handle_.get(), body, place_W_m));
  }
  void set_parameter(const std::string& name, double value) {
    detail::check(tandem_client_set_parameter(handle_.get(), name.c_str(), value));
  }
  void set_law(const std::string& law) { detail::check(tandem_client_set_law(handle_.get(), law.c_str())); }
  /// Selects how the force is computed. An empty predictor keeps the current one.
  void set_stage(const std::string& stage, const std::string& predictor = "", bool has_passivity = true) {
    detail::check(
        tandem_client_set_stage(handle_.get(), stage.c_str(), detail::text_or_null(predictor), has_passivity ? 1 : 0));
  }
  void set_link(Seconds delay, Seconds jitter = Seconds(0), double loss = 0) {
    detail::check(tandem_client_set_link(handle_.get(), delay.count(), jitter.count(), loss));
  }
  void reset_room() { detail::check(tandem_client_reset_room(handle_.get())); }
  void change_room(const std::string& room) { detail::check(tandem_client_change_room(handle_.get(), room.c_str())); }
  void set_nudges(bool has_nudges) { detail::check(tandem_client_set_nudges(handle_.get(), has_nudges ? 1 : 0)); }
  void set_workspace(double scale, double turn_rad = 0) {
    detail::check(tandem_client_set_workspace(handle_.get(), scale, turn_rad));
  }
  /// Requests an operation on the relative pose of two molecules.
  /// In      request  TANDEM_POSE_...
  void request_pose(std::uint32_t request, std::uint32_t number = 0, const std::string& name = "",
                    std::uint32_t tag = 0) {
    detail::check(tandem_client_request_pose(handle_.get(), request, number, name.c_str(), tag));
  }
  tandem_client handle() const noexcept { return handle_.get(); }

 private:
  template <class Struct, tandem_status (*Read)(tandem_client, Struct*, std::uint32_t, std::uint32_t*) noexcept>
  std::vector<Struct> all(std::uint32_t most) const {
    std::vector<Struct> found(most, detail::sized<Struct>());
    std::uint32_t count = 0;
    detail::check(Read(handle_.get(), found.data(), most, &count));
    found.resize(count);
    return found;
  }

  detail::Handle<tandem_client_close> handle_;
};

}  // namespace tandem
