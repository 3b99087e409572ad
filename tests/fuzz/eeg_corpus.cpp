// Writes the seeds of edf_fuzz with the project's own writer, and seeds of cortex_fuzz in the form that the service
// sends.
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <span>
#include <string>

#include "devices/eeg/sources/edf_file.hpp"
#include "devices/eeg/sources/generator.hpp"
#include "tests/fuzz/seed_file.hpp"

namespace {

using namespace tandem::eeg;

void write(const std::filesystem::path& file, const std::string& bytes) {
  tandem::fuzz::write_seed(file, std::as_bytes(std::span(bytes)));
}

std::string file_bytes(const std::filesystem::path& folder, bool is_bdf) {
  GeneratorSettings settings;
  settings.channels = {"F3"};
  settings.window = 100;
  settings.rate_hz = 100;
  settings.blocks = 2;
  settings.windows_per_block = 1;
  const std::filesystem::path file = folder / "seed.tmp";
  std::filesystem::create_directories(folder);
  std::filesystem::remove(file);
  write_edf(file, edf_from(generate(settings), is_bdf));
  std::ifstream in(file, std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(in)), {});
  std::filesystem::remove(file);
  return bytes;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: " << argv[0] << " FOLDER\n";
    return 2;
  }
  const std::filesystem::path folder(argv[1]);
  for (const bool is_bdf : {false, true})
    write(folder / "files" / (is_bdf ? "bdf" : "edf"), file_bytes(folder, is_bdf));
  write(folder / "cortex" / "sample",
        R"({"result":["COUNTER","INTERPOLATED","AF3","RAW_CQ","MARKERS"],"eeg":[7,0,4200.5,0,[]],"sid":"s","time":1})");
  write(folder / "cortex" / "error", R"({"id":1,"error":{"code":-32015,"message":"expired"}})");
  write(folder / "cortex" / "warning", R"({"warning":{"code":103,"message":{"headsetId":"E"}}})");
  return 0;
}
