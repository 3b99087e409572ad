// Error of the readers of structure files and force-field files.
#pragma once

#include <stdexcept>

namespace tandem::docking {

/// Reports an unusable structure or force-field file. what() names file, line and remedy.
class MoleculeError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace tandem::docking
