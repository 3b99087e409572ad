// Treats arbitrary bytes as calls of tandem.h by a faulty program: wrong handles, sizes, numbers, texts and orders.
// Every call must return a documented status. Structs lie in blocks of exactly struct_size bytes, so that
// AddressSanitizer finds an access beyond them. No client has a server: all clients connect to a port on which no
// program listens.
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "client/embed/c/tandem.h"
#include "tests/fuzz/call_script.hpp"
#include "tests/fuzz/check.hpp"

namespace {

using tandem::fuzz::Call;
using tandem::fuzz::CallReader;
using tandem::fuzz::check;

constexpr std::uint32_t kMaxSize = 65536;
/// Limits for one input, so that it takes milliseconds: opening and stopping a client is slow.
constexpr int kMaxCalls = 200, kMaxClients = 3;

/// A struct, or an array of structs, in a heap block of exactly the size that struct_size claims. AddressSanitizer then
/// detects an access beyond that size.
template <class Struct>
class Block {
 public:
  /// In      script  selects the claimed size of one element
  Block(CallReader& script, std::uint32_t elements = 1) {
    const std::uint8_t choice = script.byte();
    claimed_ = choice < 200 ? sizeof(Struct) : script.number<std::uint32_t>();
    is_null_ = choice == 199;
    // If struct_size is outside of the permitted range, the library may read only this field.
    const bool is_usable = claimed_ >= sizeof claimed_ && claimed_ <= kMaxSize;
    size_ = is_usable ? std::size_t{claimed_} * std::max(elements, 1U) : sizeof claimed_;
    bytes_ = std::make_unique<std::uint8_t[]>(size_);
    std::memcpy(bytes_.get(), &claimed_, sizeof claimed_);
  }
  /// Copies settings into the block, up to the end of the block. The block's struct_size is kept.
  void fill(const Struct& settings) {
    const auto* const from = reinterpret_cast<const std::uint8_t*>(&settings);
    const std::size_t size = std::min(size_, sizeof settings);
    std::copy(from + sizeof claimed_, from + std::max(size, sizeof claimed_), bytes_.get() + sizeof claimed_);
  }
  Struct* get() { return is_null_ ? nullptr : reinterpret_cast<Struct*>(bytes_.get()); }
  bool is_usual() const { return !is_null_ && claimed_ == sizeof(Struct); }

 private:
  std::uint32_t claimed_ = 0;
  bool is_null_ = false;
  std::size_t size_ = 0;
  std::unique_ptr<std::uint8_t[]> bytes_;
};

/// A faulty program. Each byte of the script is read in a statement of its own, because C++ does not specify the order
/// in which the arguments of a call are evaluated.
class Program {
 public:
  explicit Program(CallReader script) : script_(std::move(script)) {}
  ~Program() {
    for (const tandem_client client : clients_) close(client, &tandem_client_close);
    for (const tandem_device device : devices_) close(device, &tandem_device_close);
  }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  void run() {
    for (int i = 0; i < kMaxCalls && !script_.is_at_end(); ++i) {
      const tandem_status status = call(static_cast<Call>(script_.byte() % static_cast<int>(Call::kCount)));
      check(status > TANDEM_FAULT && status <= TANDEM_EMPTY);
      check(*tandem_status_text(status) != '\0' && (status >= 0 || *tandem_last_error() != '\0'));
    }
  }

 private:
  static void close(std::uint64_t handle, tandem_status (*function)(std::uint64_t) noexcept) {
    const tandem_status status = function(handle);
    check(status == TANDEM_OK || status == TANDEM_BAD_HANDLE);
    check(function(handle) == TANDEM_BAD_HANDLE);
  }

  std::uint64_t handle_of(const std::vector<std::uint64_t>& handles) {
    const std::uint8_t choice = script_.byte();
    if (choice == 255) return script_.number<std::uint64_t>();
    return choice < handles.size() ? handles[choice] : 0;
  }
  tandem_client client() { return handle_of(clients_); }
  tandem_device device() { return handle_of(script_.byte() == 255 ? clients_ : devices_); }
  /// Waits at most 2 ms, or passes an invalid time-out.
  tandem_status wait(tandem_status (*function)(tandem_client, double) noexcept) {
    constexpr std::array<double, 5> kTimeouts_s{0, 0.001, 0.002, -1, std::numeric_limits<double>::quiet_NaN()};
    const double timeout_s = kTimeouts_s[script_.byte() % kTimeouts_s.size()];
    return function(client(), timeout_s);
  }
  /// Returns a text that names no file outside of the search path and no real device.
  const char* name() {
    const char* const text = script_.text();
    if (text == nullptr || *text == '\0') return text;
    names_.push_back(std::make_unique<std::string>("x" + std::string(text)));
    std::replace(names_.back()->begin(), names_.back()->end(), '/', '_');
    return names_.back()->c_str();
  }

  tandem_status open_device() {
    Block<tandem_device_settings> block(script_);
    tandem_device_settings settings{};
    settings.abilities = script_.byte();
    settings.name = script_.text();
    settings.maximum_source = script_.text();
    for (double* const each :
         {&settings.force_limit_n, &settings.force_maximum_n, &settings.reach_m, &settings.speed_limit_m_per_s,
          &settings.slew_limit_n_per_s, &settings.position_step_m}) {
      *each = script_.number<double>();
    }
    block.fill(settings);
    tandem_device made = 0;
    const tandem_status status = tandem_device_open(block.get(), &made);
    check((status == TANDEM_OK) == (made != 0));
    if (made != 0) devices_.push_back(made);
    return status;
  }
  tandem_status open_client() {
    Block<tandem_client_settings> block(script_);
    tandem_client_settings settings{};
    const std::uint8_t choice = script_.byte();
    settings.role = choice & 7U;
    settings.server = (choice & 8U) != 0 ? script_.text() : "127.0.0.1:9";
    settings.is_insecure = (choice & 16U) != 0 ? 1 : 0;
    settings.uses_tcp = (choice & 32U) != 0 ? 1 : 0;
    settings.has_simulated_link = (choice & 64U) != 0 ? 1 : 0;
    settings.has_no_passivity = (choice & 128U) != 0 ? 1 : 0;
    settings.has_no_cache = 1;
    settings.realtime_priority = -1 - script_.byte() % 2;
    settings.own_device = device();
    for (const char** const each : {&settings.room, &settings.user_name, &settings.invitation, &settings.pin,
                                    &settings.token, &settings.stage, &settings.predictor}) {
      *each = script_.text();
    }
    settings.motor_counts_per_n_m = script_.number<double>();
    settings.service = script_.text();
    for (const char** const each : {&settings.authorities, &settings.device, &settings.profile, &settings.hand,
                                    &settings.firmware, &settings.library}) {
      *each = name();
    }
    block.fill(settings);
    if (clients_.size() == kMaxClients) return TANDEM_OK;
    tandem_client made = 0;
    const tandem_status status = tandem_client_open(block.get(), &made);
    check((status == TANDEM_OK) == (made != 0));
    if (made == 0) return status;
    clients_.push_back(made);
    // A client may join only if its server is the port on which no program listens.
    const bool is_safe = block.is_usual() && (choice & 8U) == 0 && settings.is_insecure == 1;
    can_join_.push_back(is_safe);
    return status;
  }
  tandem_status join() {
    const std::uint8_t choice = script_.byte();
    if (choice < clients_.size() && !can_join_[choice]) return TANDEM_OK;
    return tandem_client_join(choice < clients_.size() ? clients_[choice] : 0);
  }
  tandem_status feed() {
    Block<tandem_sample> block(script_);
    tandem_sample sample{};
    sample.buttons = script_.byte();
    sample.has_velocity = script_.byte() & 1U;
    sample.reserved = script_.byte() == 77 ? 1 : 0;
    for (double& each : sample.handle_D.position_m) each = script_.number<double>();
    for (double& each : sample.handle_D.rotation_wxyz) each = script_.number<double>();
    for (double& each : sample.velocity_D.linear_m_per_s) each = script_.number<double>();
    block.fill(sample);
    return tandem_device_feed(device(), block.get());
  }
  tandem_status read_force() {
    Block<tandem_force> block(script_);
    const tandem_status status = tandem_device_force(device(), block.get());
    // No client has a session, so no force is ever commanded.
    if (block.is_usual() && status != TANDEM_BAD_ARGUMENT) {
      for (const double each : block.get()->on_hand_D.force_n) check(each == 0);
    }
    return status;
  }
  template <class Struct>
  tandem_status read_all(tandem_status (*function)(tandem_client, Struct*, std::uint32_t, std::uint32_t*) noexcept) {
    const std::uint32_t capacity = script_.byte() % 5;
    Block<Struct> block(script_, capacity);
    std::uint32_t count = 99;
    const bool has_count = script_.byte() != 255;
    const tandem_status status = function(client(), block.get(), capacity, has_count ? &count : nullptr);
    check(status < 0 || (has_count && count <= capacity));
    return status;
  }
  tandem_status next_event() {
    Block<tandem_event> block(script_);
    const std::size_t size = script_.byte() % 40;
    const auto text = std::make_unique<char[]>(size + 1);
    text[size] = 'x';
    const bool has_text = script_.byte() != 255;
    const tandem_status status = tandem_client_next_event(client(), block.get(), has_text ? text.get() : nullptr, size);
    check(text[size] == 'x');
    return status;
  }
  tandem_status read_snapshot() {
    Block<tandem_snapshot> snapshot(script_);
    Block<tandem_tick> tick(script_);
    return tandem_client_snapshot(client(), snapshot.get(), tick.get());
  }
  tandem_status send_texts() {
    const char* const first = script_.text();
    const char* const second = script_.text();
    const std::uint8_t which = script_.byte(), has_passivity = script_.byte();
    switch (which % 3) {
      case 0:
        return tandem_client_set_law(client(), first);
      case 1:
        return tandem_client_set_stage(client(), first, second, has_passivity);
      default:
        return tandem_client_change_room(client(), first);
    }
  }
  tandem_status send_numbers() {
    const auto a = script_.number<double>();
    const auto b = script_.number<double>();
    const auto c = script_.number<double>();
    const std::uint8_t which = script_.byte(), has_nudges = script_.byte();
    switch (which % 3) {
      case 0:
        return tandem_client_set_link(client(), a, b, c);
      case 1:
        return tandem_client_set_workspace(client(), a, b);
      default:
        return tandem_client_set_nudges(client(), has_nudges);
    }
  }
  tandem_status point() {
    double place[3];
    for (double& each : place) each = script_.number<double>();
    const bool has_place = script_.byte() != 255;
    const std::uint8_t body = script_.byte();
    return tandem_client_point(client(), body, has_place ? place : nullptr);
  }
  tandem_status grab() {
    const std::uint8_t which = script_.byte(), body = script_.byte();
    switch (which % 3) {
      case 0:
        return tandem_client_grab(client(), body);
      case 1:
        return tandem_client_release(client());
      default:
        return tandem_client_reset_room(client());
    }
  }
  tandem_status read_constants() {
    check(*tandem_status_text(script_.number<std::int32_t>()) != '\0');
    check(*tandem_server_fault_text(script_.number<std::uint32_t>()) != '\0');
    check(*tandem_version() != '\0' && tandem_protocol_version() > 0);
    return TANDEM_OK;
  }
  tandem_status read_session() {
    Block<tandem_session> block(script_);
    return tandem_client_session(client(), block.get());
  }
  tandem_status read_descriptor() {
    int descriptor = -1;
    const bool has_descriptor = script_.byte() != 255;
    return tandem_client_event_descriptor(client(), has_descriptor ? &descriptor : nullptr);
  }
  tandem_status set_parameter() {
    const char* const name = script_.text();
    const auto value = script_.number<double>();
    return tandem_client_set_parameter(client(), name, value);
  }
  tandem_status request_pose() {
    const char* const name = script_.text();
    const auto number = script_.number<std::uint32_t>();
    const std::uint8_t request = script_.byte(), tag = script_.byte();
    return tandem_client_request_pose(client(), request, number, name, tag);
  }

  tandem_status call(Call function) {
    switch (function) {
      case Call::kOpenDevice:
        return open_device();
      case Call::kFeed:
        return feed();
      case Call::kForce:
        return read_force();
      case Call::kCloseDevice:
        return tandem_device_close(device());
      case Call::kOpenClient:
        return open_client();
      case Call::kJoin:
        return join();
      case Call::kWaitJoined:
        return wait(&tandem_client_wait_joined);
      case Call::kStart:
        return tandem_client_start(client());
      case Call::kStop:
        return tandem_client_stop(client());
      case Call::kCloseClient:
        return tandem_client_close(client());
      case Call::kSession:
        return read_session();
      case Call::kSnapshot:
        return read_snapshot();
      case Call::kBodies:
        return read_all(&tandem_client_bodies);
      case Call::kUsers:
        return read_all(&tandem_client_users);
      case Call::kTicks:
        return read_all(&tandem_client_read_ticks);
      case Call::kEvent:
        return next_event();
      case Call::kWaitEvent:
        return wait(&tandem_client_wait_event);
      case Call::kDescriptor:
        return read_descriptor();
      case Call::kGrab:
        return grab();
      case Call::kPoint:
        return point();
      case Call::kParameter:
        return set_parameter();
      case Call::kTexts:
        return send_texts();
      case Call::kNumbers:
        return send_numbers();
      case Call::kPose:
        return request_pose();
      default:
        return read_constants();
    }
  }

  CallReader script_;
  std::vector<std::unique_ptr<std::string>> names_;
  std::vector<std::uint64_t> clients_, devices_;
  std::vector<bool> can_join_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Program(CallReader(std::span(data, size))).run();
  return 0;
}
