// Writes what recording_fuzz starts from, by the real writer: a whole recording, one that was killed, an empty one.
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <iostream>

#include "common/recording/mcap_writer.hpp"

namespace {

using tandem::recording::Bytes;
using tandem::recording::McapWriter;

/// Raw for a fuzzer, hexadecimal for the runner.
void write(const std::filesystem::path& file, const Bytes& bytes) {
  std::filesystem::create_directories(file.parent_path());
  std::ofstream raw(file.string() + ".seed", std::ios::binary), hex(file.string() + ".hex");
  raw.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  hex << std::hex << std::setfill('0');
  for (const std::uint8_t byte : bytes) hex << std::setw(2) << static_cast<int>(byte);
  if (!raw.flush() || !hex.flush()) throw std::runtime_error(file.string() + " cannot be written");
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
    if (i % 4 == 3) append(file, writer.take_chunk());
  }
  write(folder / "killed", file);
  append(file, writer.finish());
  write(folder / "whole", file);
  return 0;
}
