/* Drives a device for which the library has no driver: this program supplies the pose of the handle and applies the
* force. Here the device is simulated: a mass on a spring, whose other end is lifted. Read 01_touch_a_room.c first.
 *
 *   cc 02_own_device.c $(pkg-config --cflags --libs tandem) && ./a.out 127.0.0.1:47800
 */
#include <stdio.h>
#include <tandem/tandem.h>
#include <time.h>

static int fail(const char* call) {
  fprintf(stderr, "02_own_device: %s: %s\n", call, tandem_last_error());
  return 2;
}

int main(int argc, char** argv) {
  /* Limits of the hardware. A force limit above 2 N also needs force_maximum_n and the source of this maximum. */
  tandem_device_settings hardware = {0};
  hardware.struct_size = sizeof hardware;
  hardware.force_limit_n = 6;
  hardware.force_maximum_n = 8;
  hardware.maximum_source = "the data sheet of this sample";
  tandem_device device = 0;
  if (tandem_device_open(&hardware, &device) != TANDEM_OK) return fail("device_open");

  tandem_client_settings settings = {0};
  settings.struct_size = sizeof settings;
  settings.server = argc > 1 ? argv[1] : "127.0.0.1:47800";
  settings.is_insecure = 1;
  settings.own_device = device;
  tandem_client client = 0;
  if (tandem_client_open(&settings, &client) != TANDEM_OK) return fail("client_open");
  if (tandem_client_join(client) != TANDEM_OK) return fail("join");
  if (tandem_client_wait_joined(client, 20) != TANDEM_OK) return fail("wait_joined");
  if (tandem_client_start(client) != TANDEM_OK) return fail("start");

  /* For a real device, this loop must run on a real-time thread. If the loop stalls, the force is zero 20 ms later, and
  * returns with a ramp when the loop continues. */
  double height_m = 0, speed_m_per_s = 0, largest_n = 0;
  uint32_t held = 0;
  for (int i = 0; i < 3000; ++i) {
    tandem_sample sample = {.struct_size = sizeof sample};
    sample.handle_D.position_m[2] = height_m;
    sample.buttons = i > 500 ? TANDEM_BUTTON_GRAB : 0; /* while pressed, the tool holds the nearest body */
    if (tandem_device_feed(device, &sample) != TANDEM_OK) return fail("feed");
    tandem_force force = {.struct_size = sizeof force};
    if (tandem_device_force(device, &force) != TANDEM_OK) return fail("force");
    const double upwards_n = force.on_hand_D.force_n[2], goal_m = i > 1500 ? 0.02 : 0;
    if (-upwards_n > largest_n) largest_n = -upwards_n;
    speed_m_per_s += 1e-3 * (500 * (goal_m - height_m) - 20 * speed_m_per_s + upwards_n) / 0.3;
    height_m += 1e-3 * speed_m_per_s;
    const struct timespec period = {0, 1000000};
    nanosleep(&period, NULL);
    tandem_tick tick = {.struct_size = sizeof tick};
    if (tandem_client_snapshot(client, NULL, &tick) == TANDEM_OK) held = tick.held_body;
  }
  printf("body %u held, handle %.1f mm high, at most %.2f N downwards\n", held, 1e3 * height_m, largest_n);
  tandem_client_close(client);
  tandem_device_close(device);
  return held != 0 ? 0 : 1;
}
