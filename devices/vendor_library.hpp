// A vendor's SDK that the user has installed. Neither its headers nor its library may be distributed with this project.
// The library is therefore loaded at run time, and its functions are declared in this project.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace tandem::devices {

/// Reason reported for a device that was connected and is now lost.
inline constexpr std::string_view kSdkLost =
    "its maker's SDK cannot reach it any more; check its cable and its power supply";

/// A shared library that is never unloaded. Vendors' libraries start threads, which would crash after the unloading.
class VendorLibrary {
 public:
  /// In      sdk      name of the SDK for display, e.g. "Force Dimension SDK"
  ///         given    file of the library; empty: the first of `usual` that the system finds
  ///         setting  name of the setting that gives the file, for the error message
  /// Fails   std::runtime_error: no library was found; the message names the setting
  VendorLibrary(std::string sdk, const std::filesystem::path& given, const std::vector<std::string>& usual,
                const std::string& setting = "--library");

  /// Looks up a function. A missing function is set to null, and require_all() reports it.
  template <class Function>
  void find(Function*& function, const char* name) {
    function = reinterpret_cast<Function*>(address_of(name));
  }
  /// Fails   std::runtime_error: functions were not found; the message names them
  void require_all() const;

 private:
  void* address_of(const char* name);

  std::string sdk_;
  std::string file_;
  void* handle_ = nullptr;
  std::string missing_;
};

}  // namespace tandem::devices
