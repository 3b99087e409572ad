/* A program of the first version of tandem.h. It holds a body, and checks that the library writes no byte beyond the
 * structs of that version. Prints one JSON object. */
#include <stdio.h>
#include <string.h>

#include "tandem.h"

#define COUNT 16
#define GUARD 0x5a

/* An array of structs of this version, followed by bytes that no call may change. */
struct guarded_ticks {
  tandem_tick ticks[COUNT];
  unsigned char guard[4096];
};
struct guarded_bodies {
  tandem_body bodies[COUNT];
  unsigned char guard[4096];
};
struct guarded_session {
  tandem_session session;
  unsigned char guard[4096];
};

static unsigned changed(const unsigned char* guard) {
  unsigned count = 0;
  for (int i = 0; i < 4096; ++i) count += guard[i] != GUARD;
  return count;
}

static int fail(const char* call) {
  fprintf(stderr, "first: %s: %s\n", call, tandem_last_error());
  return 2;
}

int main(int argc, char** argv) {
  tandem_client_settings settings = {0};
  settings.struct_size = sizeof settings;
  settings.server = argc > 1 ? argv[1] : NULL;
  settings.user_name = "first";
  settings.is_insecure = 1;
  tandem_client client = 0;
  if (tandem_client_open(&settings, &client) < 0) return fail("open");
  if (tandem_client_join(client) < 0) return fail("join");
  if (tandem_client_wait_joined(client, 20) < 0) return fail("wait_joined");
  if (tandem_client_start(client) < 0) return fail("start");
  if (tandem_client_grab(client, 0) < 0) return fail("grab");

  static struct guarded_ticks ticks;
  static struct guarded_bodies bodies;
  static struct guarded_session session;
  memset(ticks.guard, GUARD, sizeof ticks.guard);
  memset(bodies.guard, GUARD, sizeof bodies.guard);
  memset(session.guard, GUARD, sizeof session.guard);
  ticks.ticks[0].struct_size = sizeof(tandem_tick);
  bodies.bodies[0].struct_size = sizeof(tandem_body);
  session.session.struct_size = sizeof(tandem_session);
  uint64_t last = 0, missing = 0;
  uint32_t held = 0, count = 0;
  char crate[72] = "";
  for (int i = 0; i < 20; ++i) {
    tandem_client_wait_event(client, 0.1);
    tandem_event event = {.struct_size = sizeof event};
    while (tandem_client_next_event(client, &event, NULL, 0) == TANDEM_OK) continue;
    while (tandem_client_read_ticks(client, ticks.ticks, COUNT, &count) == TANDEM_OK) {
      for (uint32_t k = 0; k < count; ++k) {
        missing += ticks.ticks[k].number - last - 1;
        last = ticks.ticks[k].number;
        held = ticks.ticks[k].held_body;
      }
    }
    if (tandem_client_bodies(client, bodies.bodies, COUNT, &count) < 0) return fail("bodies");
    for (uint32_t k = 0; k < count; ++k) {
      if (bodies.bodies[k].id == held) memcpy(crate, bodies.bodies[k].name, sizeof crate);
    }
  }
  if (tandem_client_session(client, &session.session) < 0) return fail("session");
  printf(
      "{\"held\": %u, \"name\": \"%s\", \"ticks\": %llu, \"missing\": %llu, \"room\": \"%s\", \"overwritten\": %u}\n",
      held, crate, (unsigned long long)last, (unsigned long long)missing, session.session.room,
      changed(ticks.guard) + changed(bodies.guard) + changed(session.guard));
  return tandem_client_close(client) == TANDEM_OK ? 0 : fail("close");
}
