// Reads arbitrary bytes as an EDF or BDF file (recordings of biosignals). The file must be refused with a message, or
// its number of samples must be limited by the size of the file.
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <stdexcept>
#include <string>

#include "devices/eeg/sources/edf_file.hpp"
#include "devices/eeg/sources/edf_header.hpp"
#include "tests/fuzz/check.hpp"

using tandem::fuzz::check;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tandem::eeg;
  const int descriptor = memfd_create("edf", 0);
  check(descriptor >= 0 && write(descriptor, data, size) == static_cast<ssize_t>(size));
  try {
    const EdfContent content = read_edf("/proc/self/fd/" + std::to_string(descriptor));
    std::size_t samples = 0;
    for (const EdfSignal& signal : content.signals) samples += signal.digital.size();
    check(samples <= kMaxFileSamples && samples <= size);
  } catch (const std::invalid_argument& error) {
    check(std::string(error.what()).size() > 10);
  }
  close(descriptor);
  return 0;
}
