// Implements tandem.h. Each function finds the object of its handle, calls the object, and converts exceptions to a
// status.
#include "client/embed/c/tandem.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <new>
#include <span>
#include <string>
#include <system_error>

#include "client/embed/c_structs.hpp"
#include "client/embed/embedded_client.hpp"
#include "client/embed/handle_table.hpp"
#include "client/embed/sized_struct.hpp"
#include "common/base/tick_faults.hpp"
#include "common/secure/secret.hpp"
#include "proto/datagram.hpp"

namespace {

using namespace tandem;
using namespace tandem::client;
using namespace tandem::client::embed;

struct Tables {
  const pid_t process = ::getpid();  ///< detects a forked child process: it has the tables but no threads
  HandleTable<EmbeddedClient> clients{1};
  HandleTable<OwnDevice> devices{2};
};

/// Exit handler: ramps all forces to zero and ends all threads of the library before the program ends.
void close_all(int /*exit_code*/, void* all) {
  auto& tables = *static_cast<Tables*>(all);
  if (::getpid() != tables.process) return;
  const auto clients = tables.clients.remove_all();
  for (const auto& client : clients) client->begin_stop();  // all ramps begin before the first wait
  for (const auto& client : clients) client->close();
}

// Returns the tables, created at the first call. They are never destroyed, because a thread of the program may call the
// library while the program exits.
Tables& tables() {
  static Tables* const tables = [] {
    // close_all() must run before OpenSSL's exit handler. Exit handlers run in the reverse order of their registration,
    // and OpenSSL registers one at its first use. So OpenSSL is used here, before close_all() is registered.
    static_cast<void>(secure::random_u64());
    auto* const made = new Tables;
    on_exit(&close_all, made);
    return made;
  }();
  return *tables;
}

// Texts for the calling thread. They are arrays because arrays need no destructor: at the end of the program, static
// objects of the program may call the library after thread-local objects with destructors were destroyed.
thread_local std::array<char, 2048> last_error{};
thread_local std::array<char, 512> fault_text{};

tandem_status failed(tandem_status status, const char* text) noexcept {
  cut_text(text, last_error);
  return status;
}

bool lacks_resources(const std::error_code& code) {
  return code == std::errc::resource_unavailable_try_again || code == std::errc::not_enough_memory ||
         code == std::errc::too_many_files_open || code == std::errc::too_many_files_open_in_system;
}

/// Calls a function that returns a status. Converts an exception to a status, and stores the text of the exception as
/// the last error of the calling thread.
template <class Function>
tandem_status call_safely(const Function& function) noexcept {
  try {
    return function();
  } catch (const StatusError& error) {
    return failed(error.status, error.what());
  } catch (const std::bad_alloc&) {
    return failed(TANDEM_NO_MEMORY, "no memory is left");
  } catch (const std::invalid_argument& error) {
    return failed(TANDEM_BAD_ARGUMENT, error.what());
  } catch (const std::system_error& error) {
    return failed(lacks_resources(error.code()) ? TANDEM_NO_MEMORY : TANDEM_SETUP_FAILED, error.what());
  } catch (const std::runtime_error& error) {
    return failed(TANDEM_SETUP_FAILED, error.what());
  } catch (const std::exception& error) {
    return failed(TANDEM_FAULT, error.what());
  } catch (...) {
    return failed(TANDEM_FAULT, "an unknown exception");
  }
}

std::shared_ptr<EmbeddedClient> client_of(tandem_client handle) {
  auto client = tables().clients.find(handle);
  if (client == nullptr) throw StatusError(TANDEM_BAD_HANDLE, "this client was closed or never opened");
  if (::getpid() != tables().process) {
    throw StatusError(TANDEM_BAD_STATE, "the client belongs to the parent process; open one in this process");
  }
  return client;
}

std::shared_ptr<OwnDevice> device_of(tandem_device handle) {
  auto device = tables().devices.find(handle);
  if (device == nullptr) throw StatusError(TANDEM_BAD_HANDLE, "this device was closed or never opened");
  return device;
}

/// Calls a function with the client of a handle. Fails if the client is not open.
template <class Function>
tandem_status with_client(tandem_client handle, const Function& function) noexcept {
  return call_safely([&]() -> tandem_status {
    function(*client_of(handle));
    return TANDEM_OK;
  });
}

void require(bool is_good, const char* text) {
  if (!is_good) throw StatusError(TANDEM_BAD_ARGUMENT, text);
}

std::string text_of(const char* text, const char* name) {
  if (text == nullptr) throw StatusError(TANDEM_BAD_ARGUMENT, std::string(name) + " is a null pointer");
  return checked_text(text, name);
}

Duration timeout_of(double seconds) {
  constexpr double kLongest_s = 1e6;
  require(seconds >= 0, "timeout_s must be 0 or more");
  return from_seconds(std::min(seconds, kLongest_s));
}

FedSample fed_of(const tandem_sample& sample) {
  require(sample.reserved == 0, "reserved must be 0; begin with tandem_sample sample = {0}");
  FedSample fed;
  const tandem_pose& pose = sample.handle_D;
  fed.X_DH.p = Vec3(pose.position_m);
  const std::span<const double, 4> q(pose.rotation_wxyz);
  const bool has_rotation = std::ranges::any_of(q, [](double each) { return each != 0; });
  if (has_rotation) fed.X_DH.q = Quat(q[0], q[1], q[2], q[3]);
  fed.has_velocity = sample.has_velocity != 0;
  fed.V_DH = {Vec3(sample.velocity_D.linear_m_per_s), Vec3(sample.velocity_D.angular_rad_per_s)};
  fed.buttons = sample.buttons;
  return fed;
}

/// Copies results to an array of the caller with elements of `size` bytes, at most `capacity` of them.
template <class Struct>
void write_all(const std::vector<Struct>& results, Struct* to, std::uint32_t size, std::uint32_t capacity,
               std::uint32_t* count) {
  *count = static_cast<std::uint32_t>(std::min<std::size_t>(results.size(), capacity));
  for (std::uint32_t i = 0; i < *count; ++i) write_struct(results[i], to, size, i);
}

}  // namespace

extern "C" {

const char* tandem_status_text(tandem_status status) noexcept {
  switch (status) {
    case TANDEM_OK:
      return "done";
    case TANDEM_EMPTY:
      return "there is nothing to read now";
    case TANDEM_BAD_HANDLE:
      return "the handle was closed, or never belonged to such an object";
    case TANDEM_BAD_ARGUMENT:
      return "an argument is invalid";
    case TANDEM_BAD_STATE:
      return "the call is not possible now";
    case TANDEM_SETUP_FAILED:
      return "the set-up failed";
    case TANDEM_ENDED:
      return "the session has ended or was refused";
    case TANDEM_TIMED_OUT:
      return "the time-out has passed";
    case TANDEM_LIMIT:
      return "too many handles are open";
    case TANDEM_NO_MEMORY:
      return "no memory is left";
    case TANDEM_FAULT:
      return "an error of the library";
    default:
      return "an unknown status";
  }
}

const char* tandem_last_error(void) noexcept {
  return last_error.data();
}

const char* tandem_version(void) noexcept {
  return TANDEM_VERSION;
}

uint32_t tandem_protocol_version(void) noexcept {
  return proto::kProtocolVersion;
}

tandem_status tandem_device_open(const tandem_device_settings* settings, tandem_device* device) noexcept {
  return call_safely([&]() -> tandem_status {
    require(device != nullptr, "device is a null pointer");
    *device = 0;
    const auto known = read_struct(settings, "tandem_device_settings");
    *device = tables().devices.add(std::make_shared<OwnDevice>(profile_of(known)));
    if (*device == 0) throw StatusError(TANDEM_LIMIT, "256 devices are open; close one first");
    return TANDEM_OK;
  });
}

tandem_status tandem_device_feed(tandem_device device, const tandem_sample* sample) noexcept {
  return call_safely([&]() -> tandem_status {
    const auto found = device_of(device);
    const FedSample fed = fed_of(read_struct(sample, "tandem_sample"));
    const char* const problem = problem_of(fed);
    require(*problem == '\0', problem);
    found->feed(SteadyClock().now(), fed);
    return TANDEM_OK;
  });
}

tandem_status tandem_device_force(tandem_device device, tandem_force* force) noexcept {
  return call_safely([&]() -> tandem_status {
    const std::uint32_t size = size_of(force, "tandem_force");
    tandem_force result{};
    const auto found = tables().devices.find(device);
    if (found != nullptr) {
      const ForceCommand command = found->force(SteadyClock().now());
      result.is_stale = command.is_stale ? 1 : 0;
      result.on_hand_D = c_wrench(command.on_hand_D);
      result.commands = command.commands;
    }
    // The result is written before the handle is checked. So a program that ignores the error of a closed device still
    // reads zero force.
    write_struct(result, force, size);
    static_cast<void>(device_of(device));
    return TANDEM_OK;
  });
}

tandem_status tandem_device_close(tandem_device device) noexcept {
  return call_safely([&]() -> tandem_status {
    device_of(device)->end_feed();
    tables().devices.remove(device);
    return TANDEM_OK;
  });
}

tandem_status tandem_client_open(const tandem_client_settings* settings, tandem_client* client) noexcept {
  return call_safely([&]() -> tandem_status {
    require(client != nullptr, "client is a null pointer");
    *client = 0;
    const auto known = read_struct(settings, "tandem_client_settings");
    auto own_device = known.own_device == 0 ? nullptr : device_of(known.own_device);
    const auto made = std::make_shared<EmbeddedClient>(config_of(known, std::move(own_device)));
    *client = tables().clients.add(made);
    if (*client == 0) throw StatusError(TANDEM_LIMIT, "256 clients are open; close one first");
    return TANDEM_OK;
  });
}

tandem_status tandem_client_join(tandem_client client) noexcept {
  return with_client(client, [](EmbeddedClient& found) { found.join(); });
}

tandem_status tandem_client_wait_joined(tandem_client client, double timeout_s) noexcept {
  return with_client(client, [&](EmbeddedClient& found) { found.wait_joined(timeout_of(timeout_s)); });
}

tandem_status tandem_client_start(tandem_client client) noexcept {
  return with_client(client, [](EmbeddedClient& found) { found.start(); });
}

tandem_status tandem_client_stop(tandem_client client) noexcept {
  return with_client(client, [](EmbeddedClient& found) { found.stop(); });
}

tandem_status tandem_client_close(tandem_client client) noexcept {
  return call_safely([&]() -> tandem_status {
    // The client is closed first and its handle is removed afterwards. So close_all() can still find the client if the
    // program exits during this call, and waits for the call.
    const auto found = client_of(client);
    found->close();
    if (tables().clients.remove(client) == nullptr) {
      throw StatusError(TANDEM_BAD_HANDLE, "this client was closed by another thread");
    }
    return TANDEM_OK;
  });
}

tandem_status tandem_client_session(tandem_client client, tandem_session* session) noexcept {
  return with_client(client, [&](EmbeddedClient& found) {
    const std::uint32_t size = size_of(session, "tandem_session");
    write_struct(found.session(), session, size);
  });
}

tandem_status tandem_client_snapshot(tandem_client client, tandem_snapshot* snapshot, tandem_tick* tick) noexcept {
  return call_safely([&]() -> tandem_status {
    const auto found = client_of(client);
    require(snapshot != nullptr || tick != nullptr, "snapshot and tick are both null pointers");
    const std::uint32_t snapshot_size = snapshot == nullptr ? 0 : size_of(snapshot, "tandem_snapshot");
    const std::uint32_t tick_size = tick == nullptr ? 0 : size_of(tick, "tandem_tick");
    const auto newest = found->newest();
    const EmbeddedClient::Newest result = newest.value_or(EmbeddedClient::Newest{});
    if (snapshot != nullptr) write_struct(result.snapshot, snapshot, snapshot_size);
    if (tick != nullptr) write_struct(result.tick, tick, tick_size);
    return newest.has_value() ? TANDEM_OK : TANDEM_EMPTY;
  });
}

tandem_status tandem_client_bodies(tandem_client client, tandem_body* bodies, uint32_t capacity,
                                   uint32_t* count) noexcept {
  return with_client(client, [&](EmbeddedClient& found) {
    require(count != nullptr, "count is a null pointer");
    *count = 0;
    if (capacity == 0) return;
    const std::uint32_t size = size_of(bodies, "tandem_body");
    write_all(found.bodies(), bodies, size, capacity, count);
  });
}

tandem_status tandem_client_users(tandem_client client, tandem_user* users, uint32_t capacity,
                                  uint32_t* count) noexcept {
  return with_client(client, [&](EmbeddedClient& found) {
    require(count != nullptr, "count is a null pointer");
    *count = 0;
    if (capacity == 0) return;
    const std::uint32_t size = size_of(users, "tandem_user");
    write_all(found.users(), users, size, capacity, count);
  });
}

const char* tandem_server_fault_text(uint32_t faults) noexcept {
  call_safely([&]() -> tandem_status {
    cut_text(describe_faults(faults), fault_text);
    return TANDEM_OK;
  });
  return fault_text.data();
}

tandem_status tandem_client_read_ticks(tandem_client client, tandem_tick* ticks, uint32_t capacity,
                                       uint32_t* count) noexcept {
  return call_safely([&]() -> tandem_status {
    const auto found = client_of(client);
    require(count != nullptr, "count is a null pointer");
    *count = 0;
    if (capacity == 0) return TANDEM_OK;
    const std::uint32_t size = size_of(ticks, "tandem_tick");
    tandem_tick tick{};
    while (*count < capacity && found->pop(tick)) write_struct(tick, ticks, size, (*count)++);
    return *count > 0 ? TANDEM_OK : TANDEM_EMPTY;
  });
}

tandem_status tandem_client_next_event(tandem_client client, tandem_event* event, char* text,
                                       size_t text_size) noexcept {
  return call_safely([&]() -> tandem_status {
    const auto found = client_of(client);
    const std::uint32_t size = size_of(event, "tandem_event");
    require(text != nullptr || text_size == 0, "text is a null pointer; its text_size must be 0");
    if (text_size > 0) *text = '\0';
    const auto next = found->next_event();
    if (!next) {
      write_struct(tandem_event{}, event, size);
      return TANDEM_EMPTY;
    }
    EventAndText result = c_event(*next);
    result.event.text_bytes = static_cast<std::uint32_t>(result.text.size());
    write_struct(result.event, event, size);
    if (text_size > 0) cut_text(result.text, {text, text_size});
    return TANDEM_OK;
  });
}

tandem_status tandem_client_wait_event(tandem_client client, double timeout_s) noexcept {
  return with_client(client, [&](EmbeddedClient& found) { found.wait_event(timeout_of(timeout_s)); });
}

tandem_status tandem_client_event_descriptor(tandem_client client, int* descriptor) noexcept {
  return with_client(client, [&](EmbeddedClient& found) {
    require(descriptor != nullptr, "descriptor is a null pointer");
    *descriptor = found.event_descriptor();
  });
}

tandem_status tandem_client_grab(tandem_client client, uint32_t body) noexcept {
  return with_client(client, [&](EmbeddedClient& found) { found.send(command::Grab{{body}}); });
}

tandem_status tandem_client_release(tandem_client client) noexcept {
  return with_client(client, [](EmbeddedClient& found) { found.send(command::Release{}); });
}

tandem_status tandem_client_point(tandem_client client, uint32_t body, const double place_W_m[3]) noexcept {
  return with_client(client, [&](EmbeddedClient& found) {
    require(place_W_m != nullptr, "place_W_m is a null pointer");
    require(Vec3(place_W_m).allFinite(), "place_W_m is not finite");
    found.send(command::Point{found.point_of(body, Vec3(place_W_m))});
  });
}

tandem_status tandem_client_set_parameter(tandem_client client, const char* name, double value) noexcept {
  return with_client(client, [&](EmbeddedClient& found) {
    require(std::isfinite(value), "value is not finite");
    found.send(command::SetParameter{text_of(name, "name"), value});
  });
}

tandem_status tandem_client_set_law(tandem_client client, const char* law) noexcept {
  return with_client(client, [&](EmbeddedClient& found) { found.send(command::SetLaw{text_of(law, "law")}); });
}

tandem_status tandem_client_set_stage(tandem_client client, const char* stage, const char* predictor,
                                      uint32_t has_passivity) noexcept {
  return with_client(client, [&](EmbeddedClient& found) {
    StageSettings settings = found.stage();
    settings.name = text_of(stage, "stage");
    if (predictor != nullptr) settings.predictor = text_of(predictor, "predictor");
    settings.passivity = has_passivity != 0;
    found.send(command::SetStage{settings});
  });
}

tandem_status tandem_client_set_link(tandem_client client, double delay_s, double jitter_s, double loss) noexcept {
  return with_client(client, [&](EmbeddedClient& found) {
    constexpr double kLongest_s = 10;
    require(delay_s >= 0 && delay_s <= kLongest_s, "delay_s must be 0 to 10");
    require(jitter_s >= 0 && jitter_s <= kLongest_s, "jitter_s must be 0 to 10");
    require(loss >= 0, "loss must be 0 to 0.95");
    if (!found.has_links()) {
      throw StatusError(TANDEM_BAD_STATE, "the client has no simulated link; set has_simulated_link when it is opened");
    }
    net::LinkParameters link;
    link.delay = from_seconds(delay_s);
    link.jitter = from_seconds(jitter_s);
    link.loss = loss;
    found.send(command::SetLinks{link});
  });
}

tandem_status tandem_client_reset_room(tandem_client client) noexcept {
  return with_client(client, [](EmbeddedClient& found) { found.send(command::ResetRoom{}); });
}

tandem_status tandem_client_change_room(tandem_client client, const char* room) noexcept {
  return with_client(client, [&](EmbeddedClient& found) { found.send(command::ChangeRoom{text_of(room, "room")}); });
}

tandem_status tandem_client_set_nudges(tandem_client client, uint32_t has_nudges) noexcept {
  return with_client(client, [&](EmbeddedClient& found) { found.send(command::SetNudges{has_nudges != 0}); });
}

tandem_status tandem_client_set_workspace(tandem_client client, double scale, double turn_rad) noexcept {
  return with_client(client, [&](EmbeddedClient& found) {
    require(scale >= 0.1 && scale <= 10, "scale must be 0.1 to 10");
    require(std::abs(turn_rad) <= 10, "turn_rad must be -10 to 10");
    found.send(command::SetWorkspace{{.scale = scale, .turn_rad = turn_rad}});
  });
}

tandem_status tandem_client_request_pose(tandem_client client, uint32_t request, uint32_t number, const char* name,
                                         uint32_t tag) noexcept {
  return with_client(client, [&](EmbeddedClient& found) {
    require(request <= TANDEM_POSE_CANCEL, "request is not known; use TANDEM_POSE_KEEP to TANDEM_POSE_CANCEL");
    found.send(pose_command(static_cast<wire::AskPose::Kind>(request), number,
                            name == nullptr ? "" : text_of(name, "name"), tag));
  });
}

}  // extern "C"
