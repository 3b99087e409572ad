// Lifts a body with a device that this program drives. Compares the forces that the device receives with those in the
// ticks. Prints one JSON object; embed_test.py compares the tool poses in it with the recording of the server.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <exception>
#include <map>
#include <string>
#include <tandem/tandem.hpp>
#include <thread>

namespace {

constexpr std::chrono::milliseconds kLength{2500};

struct Forces {
  std::map<std::uint64_t, tandem_wrench> by_command;
  std::uint64_t stale = 0;
};

/// Supplies the poses of a hand that grabs a body after about 0.5 s and rises after about 1 s. Returns the received
/// forces.
Forces drive(tandem::OwnDevice& device, const std::atomic<bool>& should_end) {
  Forces forces;
  tandem_sample sample{};
  for (int i = 0; !should_end; ++i) {
    sample.handle_D.position_m[2] = i > 1000 && i < 2000 ? 2e-5 * (i - 1000) : sample.handle_D.position_m[2];
    sample.buttons = i > 500 ? TANDEM_BUTTON_GRAB : 0;
    device.feed(sample);
    const tandem_force force = device.force();
    if (force.is_stale != 0) ++forces.stale;
    if (force.is_stale == 0) forces.by_command.try_emplace(force.commands, force.on_hand_D);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return forces;
}

bool is_same(const tandem_wrench& a, const tandem_wrench& b) {
  bool is_same = true;
  for (int i = 0; i < 3; ++i) is_same = is_same && a.force_n[i] == b.force_n[i] && a.torque_n_m[i] == b.torque_n_m[i];
  return is_same;
}

void run(const std::string& server) {
  tandem_device_settings hardware{};
  hardware.force_limit_n = hardware.force_maximum_n = 6;
  hardware.maximum_source = "this test";
  tandem::OwnDevice device(hardware);
  std::atomic<bool> should_end{false};
  Forces forces;
  std::thread hand([&] { forces = drive(device, should_end); });

  tandem::ClientSettings settings;
  settings.server = server;
  settings.is_insecure = true;
  settings.stage = "late-pose";  // displays the server's tool, which the recording contains
  settings.own_device = &device;
  tandem::Client client(settings);
  client.join();
  client.wait_joined();
  client.start();
  std::this_thread::sleep_for(kLength);
  const std::uint32_t held = client.snapshot().tick.held_body;
  const tandem_session session = client.session();
  client.stop();
  should_end = true;
  hand.join();

  std::uint64_t compared = 0, different = 0, ticks = 0;
  double largest_n = 0;
  std::map<std::uint64_t, tandem_pose> tools;
  while (true) {
    const std::vector<tandem_tick> read = client.read_ticks();
    if (read.empty()) break;
    for (const tandem_tick& tick : read) {
      ++ticks;
      tools[tick.server_step] = tick.tool_W;
      largest_n = std::max(largest_n, -tick.on_hand_D.force_n[2]);
      const auto force = forces.by_command.find(tick.number);
      if (force == forces.by_command.end()) continue;
      ++compared;
      if (!is_same(force->second, tick.on_hand_D)) ++different;
    }
  }
  std::printf(
      "{\"user\": %u, \"held\": %u, \"ticks\": %llu, \"compared\": %llu, \"different\": %llu, \"stale\": %llu, "
      "\"largest_n\": %.6f, \"lost\": %llu, \"tools\": {",
      session.user, held, static_cast<unsigned long long>(ticks), static_cast<unsigned long long>(compared),
      static_cast<unsigned long long>(different), static_cast<unsigned long long>(forces.stale), largest_n,
      static_cast<unsigned long long>(session.lost_ticks));
  const char* comma = "";
  for (const auto& [step, pose] : tools) {
    std::printf("%s\"%llu\": [%.9g, %.9g, %.9g]", comma, static_cast<unsigned long long>(step), pose.position_m[0],
                pose.position_m[1], pose.position_m[2]);
    comma = ", ";
  }
  std::printf("}}\n");
}

}  // namespace

int main(int argc, char** argv) {
  try {
    run(argc > 1 ? argv[1] : "127.0.0.1:47800");
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "check: %s\n", error.what());
    return 2;
  }
}
