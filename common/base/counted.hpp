// Notes about meshes are for people: "1 hole", "2 holes".
#pragma once

#include <cstddef>
#include <string>

namespace tandem {

inline std::string counted(std::size_t count, const char* one, const char* many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

}  // namespace tandem
