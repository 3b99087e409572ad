#include "devices/vendor_library.hpp"

#include <dlfcn.h>

#include <stdexcept>
#include <utility>

namespace tandem::devices {

VendorLibrary::VendorLibrary(std::string sdk, const std::filesystem::path& given, const std::vector<std::string>& usual,
                             const std::string& setting)
    : sdk_(std::move(sdk)) {
  const std::vector<std::string> names = given.empty() ? usual : std::vector<std::string>{given.string()};
  std::string why;
  for (const std::string& name : names) {
    file_ = name;
    handle_ = dlopen(name.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (handle_ != nullptr) return;
    if (const char* const error = dlerror()) why = error;
  }
  throw std::runtime_error("the " + sdk_ + " cannot be loaded (" + why +
                           "); install it from its maker, and give the file of its library by " + setting);
}

void* VendorLibrary::address_of(const char* name) {
  void* const address = dlsym(handle_, name);
  if (address == nullptr) missing_ += (missing_.empty() ? "" : ", ") + std::string(name);
  return address;
}

void VendorLibrary::require_all() const {
  if (missing_.empty()) return;
  throw std::runtime_error(file_ + " is not the " + sdk_ + ", or another version of it: it has no " + missing_);
}

}  // namespace tandem::devices
