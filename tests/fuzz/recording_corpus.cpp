// Writes the seeds of recording_fuzz with the project's own writer: a complete recording, the recording of a killed
// program, and an empty one.
#include <cstdint>
#include <filesystem>
#include <iostream>

#include "common/recording/mcap_writer.hpp"
#include "tests/fuzz/seed_file.hpp"

namespace {

using tandem::recording::Bytes;
using tandem::recording::McapWriter;

void write(const std::filesystem::path& file, const Bytes& bytes) {
  tandem::fuzz::write_seed(file, std::as_bytes(std::span(bytes)));
}

void append(Bytes& file, const Bytes& part) {
  file.insert(file.end(), part.begin(), part.end());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: " << argv[0] << " FOLDER\n";
    return 2;
  }
  const std::filesystem::path folder(argv[1]);
  McapWriter writer({{"/step", "tandem.wire.RecordedStep", {10, 2, 8, 1}}, {"/states", "S", {}}}, "corpus");
  Bytes file = writer.begin();
  write(folder / "empty", file);
  for (std::uint16_t i = 0; i < 8; ++i) {
    writer.add(i % 2, 1'000'000U + i, Bytes(i, static_cast<std::uint8_t>(i)));
    if (i % 4 == 3) append(file, writer.pop_chunk());
  }
  write(folder / "killed", file);
  append(file, writer.finish());
  write(folder / "whole", file);
  return 0;
}
