// Where the files lie that come with Tandem: scenes, experiments, hand paths, device profiles.
#pragma once

#include <filesystem>

namespace tandem {

/// $TANDEM_DATA, else ../share/tandem beside the running program, whether that was built or installed, and wherever
/// its folders were moved to.
/// Out     e.g. /usr/share/tandem; need not exist
std::filesystem::path data_folder();

}  // namespace tandem
