/* Joins a room with a simulated hand, grabs the nearest body and prints the force. Read this sample first.
 *
 *   tandem-server --insecure --scene crate &
 *   cc 01_touch_a_room.c $(pkg-config --cflags --libs tandem) && ./a.out 127.0.0.1:47800
 */
#include <stdio.h>
#include <tandem/tandem.h>

/* Prints the reason why a call failed. */
static int fail(const char* call) {
  fprintf(stderr, "01_touch_a_room: %s: %s\n", call, tandem_last_error());
  return 2;
}

int main(int argc, char** argv) {
  /* Zero selects a default, so only the settings that differ are set. A server on another machine needs an invitation
  * instead of is_insecure. device = "auto" selects the first connected haptic device instead of a simulated hand. */
  tandem_client_settings settings = {0};
  settings.struct_size = sizeof settings;
  settings.server = argc > 1 ? argv[1] : "127.0.0.1:47800";
  settings.user_name = "sample";
  settings.is_insecure = 1;
  tandem_client client = 0;
  if (tandem_client_open(&settings, &client) != TANDEM_OK) return fail("open");

  /* Joining runs in the background. A program with a window would not wait, but query tandem_client_session() at each
  * frame. */
  if (tandem_client_join(client) != TANDEM_OK) return fail("join");
  if (tandem_client_wait_joined(client, 20) != TANDEM_OK) return fail("wait_joined");

  /* From here on, a thread of the library displays the force, 1000 times a second. */
  if (tandem_client_start(client) != TANDEM_OK) return fail("start");
  if (tandem_client_grab(client, 0) != TANDEM_OK) return fail("grab");

  uint32_t held = 0;
  for (int i = 0; i < 20; ++i) {
    /* Waits up to 0.1 s for an event, then prints all events. */
    tandem_event event = {.struct_size = sizeof event};
    char text[200];
    tandem_client_wait_event(client, 0.1);
    while (tandem_client_next_event(client, &event, text, sizeof text) == TANDEM_OK) {
      if (event.kind == TANDEM_EVENT_GRABBED) printf("grabbed body %u\n", event.body);
      if (event.kind == TANDEM_EVENT_REFUSED || event.kind == TANDEM_EVENT_NEWS) printf("%s\n", text);
    }
    tandem_tick tick = {.struct_size = sizeof tick};
    if (tandem_client_snapshot(client, NULL, &tick) != TANDEM_OK) continue;
    held = tick.held_body;
    printf("tick %llu: force %.2f N upwards, body %u held\n", (unsigned long long)tick.number,
           tick.on_hand_D.force_n[2], held);
  }

  /* Ramps the force to zero, then leaves the room. */
  tandem_client_close(client);
  return held != 0 ? 0 : 1;
}
