// A fake of the library liblsl, with the functions that tandem-eeg uses. It supplies one stream, which the test defines
// by variables. If it is compiled with WITHOUT_PULL, it lacks the function that returns samples.
#include <cstdint>
#include <cstring>

#define EXPORTED extern "C" __attribute__((visibility("default")))

// Variables by which the test defines the stream, and counters and texts that it checks.
extern "C" {
__attribute__((visibility("default"))) int fake_streams = 1;
__attribute__((visibility("default"))) int fake_channels = 2;
__attribute__((visibility("default"))) double fake_rate_hz = 128;
__attribute__((visibility("default"))) const char* fake_labels[4] = {"F3", "O1", nullptr, nullptr};
__attribute__((visibility("default"))) const char* fake_unit = "microvolts";
__attribute__((visibility("default"))) int fake_samples = 4;  ///< number of samples that each call returns
__attribute__((visibility("default"))) int fake_error = 0;
__attribute__((visibility("default"))) int fake_open_inlets = 0;
__attribute__((visibility("default"))) int fake_infos = 0;
__attribute__((visibility("default"))) char fake_property[64] = "";
__attribute__((visibility("default"))) char fake_value[64] = "";
}

namespace {

int info, inlet, description, list;
int channel[4];

const int* place_of(const void* element) {
  for (const int& one : channel) {
    if (&one == element) return &one;
  }
  return nullptr;
}

}  // namespace

// NOLINTBEGIN(readability-identifier-naming): the library chose these names
EXPORTED std::int32_t lsl_resolve_byprop(void** infos, std::uint32_t size, const char* property, const char* value,
                                         std::int32_t, double) {
  std::strncpy(fake_property, property, sizeof fake_property - 1);
  std::strncpy(fake_value, value, sizeof fake_value - 1);
  for (int i = 0; i < fake_streams && i < static_cast<int>(size); ++i) {
    infos[i] = &info;
    ++fake_infos;
  }
  return fake_streams;
}
EXPORTED void* lsl_create_inlet(void*, std::int32_t, std::int32_t, std::int32_t) {
  ++fake_open_inlets;
  return &inlet;
}
EXPORTED void lsl_destroy_inlet(void*) {
  --fake_open_inlets;
}
EXPORTED void lsl_destroy_streaminfo(void*) {
  --fake_infos;
}
EXPORTED void* lsl_get_fullinfo(void*, double, std::int32_t* error) {
  *error = 0;
  ++fake_infos;
  return &info;
}
#ifndef WITHOUT_PULL
EXPORTED unsigned long lsl_pull_chunk_d(void*, double* data, double*, unsigned long size, unsigned long, double,
                                        std::int32_t* error) {
  *error = fake_error;
  unsigned long count = 0;
  for (; fake_error == 0 && count < static_cast<unsigned long>(fake_samples * fake_channels) && count < size; ++count)
    data[count] = static_cast<double>(count);
  return count;
}
#endif
EXPORTED std::int32_t lsl_get_channel_count(void*) {
  return fake_channels;
}
EXPORTED double lsl_get_nominal_srate(void*) {
  return fake_rate_hz;
}
EXPORTED const char* lsl_get_name(void*) {
  return "fake";
}
EXPORTED void* lsl_get_desc(void*) {
  return &description;
}
EXPORTED void* lsl_child(void* element, const char* name) {
  if (element == &description && std::strcmp(name, "channels") == 0) return &list;
  return element == &list && fake_labels[0] != nullptr ? &channel[0] : nullptr;
}
EXPORTED void* lsl_next_sibling_n(void* element, const char*) {
  const int* const place = place_of(element);
  if (place == nullptr || place == &channel[3] || fake_labels[place - channel + 1] == nullptr) return nullptr;
  return &channel[place - channel + 1];
}
EXPORTED const char* lsl_child_value_n(void* element, const char* name) {
  const int* const place = place_of(element);
  if (place == nullptr) return nullptr;
  return std::strcmp(name, "label") == 0 ? fake_labels[place - channel] : fake_unit;
}
// NOLINTEND(readability-identifier-naming)
