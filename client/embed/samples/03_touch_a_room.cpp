// The C++ version of 01_touch_a_room.c: destructors close the handles, and errors are exceptions (tandem::Error).
//
//   c++ -std=c++17 03_touch_a_room.cpp $(pkg-config --cflags --libs tandem) && ./a.out 127.0.0.1:47800
#include <algorithm>
#include <cstdio>
#include <exception>
#include <tandem/tandem.hpp>

namespace {

/// Returns whether a body was held at the end.
bool touch(const std::string& server) {
  tandem::ClientSettings settings;
  settings.server = server;
  settings.user_name = "sample";
  settings.is_insecure = true;
  settings.hand = "rest";  // the path of the simulated hand
  tandem::Client client(settings);
  client.join();
  client.wait_joined();
  client.start();
  client.grab();

  const tandem_session session = client.session();
  std::printf("user %u in room %s, law %s, stage %s\n", session.user, session.room, session.law, session.stage);
  for (int i = 0; i < 20; ++i) {
    client.wait_event(tandem::Seconds(0.1));
    while (const auto event = client.next_event()) {
      if (event->about.kind == TANDEM_EVENT_GRABBED) std::printf("grabbed body %u\n", event->about.body);
      if (event->about.kind == TANDEM_EVENT_NEWS) std::printf("%s\n", event->text.c_str());
    }
    // read_ticks() returns all ticks since its last call, for a log or a plot.
    double largest_n = 0;
    const std::vector<tandem_tick> ticks = client.read_ticks();
    for (const tandem_tick& tick : ticks) largest_n = std::max(largest_n, tick.on_hand_D.force_n[2]);
    std::printf("%zu ticks, force at most %.2f N upwards\n", ticks.size(), largest_n);
  }
  bool holds = false;
  for (const tandem_body& body : client.bodies()) {
    if (body.held_by != session.user) continue;
    holds = true;
    std::printf("%s is %.1f mm above the table\n", body.name, 1e3 * body.pose_W.position_m[2]);
  }
  return holds;
}  // the destructor ramps the force to zero and leaves the room

}  // namespace

int main(int argc, char** argv) {
  try {
    return touch(argc > 1 ? argv[1] : "127.0.0.1:47800") ? 0 : 1;
  } catch (const std::exception& error) {  // set-up errors; the text names the remedy
    std::fprintf(stderr, "03_touch_a_room: %s\n", error.what());
    return 2;
  }
}
