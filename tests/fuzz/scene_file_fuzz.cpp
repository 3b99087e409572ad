// Reads arbitrary bytes as a scene file. It must be loaded, or refused with a readable error of one line.
#include <cstdint>
#include <cstdlib>
#include <string>

#include "common/net/text.hpp"
#include "server/assets/scene_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tandem;
  const std::string text(reinterpret_cast<const char*>(data), size);
  try {
    // The folder for referenced files does not exist, so that no file is read.
    const auto scene = server::load_scene_text(text, "fuzz.json", "/nowhere");
    if (scene == nullptr || scene->world.bodies.size() != scene->body_shapes.size()) std::abort();
  } catch (const server::SceneError& error) {
    const std::string line = error.what();
    if (line.empty() || line.find('\n') != std::string::npos) std::abort();
  }
  return 0;
}
