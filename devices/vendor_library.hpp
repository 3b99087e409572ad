// A vendor's SDK as its user has installed it: loaded while running, by declarations of our own, for neither its headers
// nor the library itself may come with this project.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace tandem::devices {

/// Why a device is absent that was there.
inline constexpr std::string_view kSdkLost =
    "its maker's SDK cannot reach it any more; look at its cable and its power supply";

/// A shared library, loaded for good: what such libraries start does not end with them.
class VendorLibrary {
 public:
  /// In      sdk    for people: "Force Dimension SDK"
  ///         given  a file; empty: the first of `usual` that the system finds
  /// Fails   std::runtime_error: there is none; names --library
  VendorLibrary(std::string sdk, const std::filesystem::path& given, const std::vector<std::string>& usual);

  /// Null where the library does not have it: require_all() says so.
  template <class Function>
  void find(Function*& function, const char* name) {
    function = reinterpret_cast<Function*>(address_of(name));
  }
  /// Fails   std::runtime_error naming what was looked for and is not there
  void require_all() const;

 private:
  void* address_of(const char* name);

  std::string sdk_;
  std::string file_;
  void* handle_ = nullptr;
  std::string missing_;
};

}  // namespace tandem::devices
