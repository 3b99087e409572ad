// A vendor's SDK as installed by the user. It is loaded at run time with our own declarations, because neither its
// headers nor its library may be distributed with this project.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace tandem::devices {

/// Reason for a device that was connected and is lost.
inline constexpr std::string_view kSdkLost =
    "its maker's SDK cannot reach it any more; check its cable and its power supply";

/// A shared library that is never unloaded, because such libraries start threads that do not end with them.
class VendorLibrary {
 public:
  /// In      sdk    readable name: "Force Dimension SDK"
  ///         given  a file; empty: the first of `usual` that the system finds
  /// Fails   std::runtime_error: no library found; names --library
  VendorLibrary(std::string sdk, const std::filesystem::path& given, const std::vector<std::string>& usual);

  /// Looks up a function; null if the library lacks it, which require_all() reports.
  template <class Function>
  void find(Function*& function, const char* name) {
    function = reinterpret_cast<Function*>(address_of(name));
  }
  /// Fails   std::runtime_error naming the functions that were not found
  void require_all() const;

 private:
  void* address_of(const char* name);

  std::string sdk_;
  std::string file_;
  void* handle_ = nullptr;
  std::string missing_;
};

}  // namespace tandem::devices
