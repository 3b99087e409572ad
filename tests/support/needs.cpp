#include "tests/support/needs.hpp"

#include <array>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <string_view>
#include <utility>

namespace tandem::test {

namespace {

// Folders into which data packages of Debian and other programs install files, and the names of these packages.
constexpr std::array<std::pair<std::string_view, std::string_view>, 9> kPackages{{
    {"/usr/share/alsa/", "libasound2"},
    {"/usr/share/gromacs/", "gromacs-data"},
    {"/usr/share/pymol/", "pymol-data"},
    {"/usr/share/apbs/", "apbs-data"},
    {"/usr/share/freesasa/", "freesasa"},
    {"/usr/share/glmark2/", "glmark2-data"},
    {"/usr/share/assimp/", "assimp-testmodels"},
    {"/usr/lib/python3/dist-packages/prody/", "python3-prody-tests"},
    {"/usr/bin/save2gdf", "biosig-tools"},
}};

std::string package_of(const std::string& path) {
  for (const auto& [folder, package] : kPackages) {
    if (path.starts_with(folder)) return "the Debian package " + std::string(package);
  }
  return "a file of no package in tests/support/needs.cpp";
}

}  // namespace

std::string missing_of(std::initializer_list<std::filesystem::path> paths) {
  for (const std::filesystem::path& path : paths) {
    if (std::filesystem::exists(path)) continue;
    return "needs " + package_of(path) + ", for " + path.string() +
           " is missing; deploy/install-deps --all installs it";
  }
  return {};
}

bool is_all_required() {
  const char* required = std::getenv("TANDEM_REQUIRE");
  return required != nullptr && std::string_view(required) == "all";
}

void note_left_out(const std::string& test, const std::string& why) {
  const std::string line = test + ": " + why + "\n";
  std::cerr << "left out: " << line;
  // Writes each line by a single call, so that lines of concurrent programs are not mixed.
  if (const char* path = std::getenv("TANDEM_LEFT_OUT")) std::ofstream(path, std::ios::app) << line << std::flush;
}

}  // namespace tandem::test
