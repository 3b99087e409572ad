// A line that grows on a terminal while something takes seconds.
#pragma once

#include <functional>
#include <string>

namespace tandem {

/// A line on the standard error output: what takes long, and how much of it is done (0..1; 1 ends the line). On a
/// terminal the line is overwritten; else a new one is written every 25 %.
///
/// In      write  takes the text instead
/// Thread  any, one at a time
std::function<void(const std::string& what, double done)> progress_on_stderr(
    std::function<void(const std::string& text)> write = {});

}  // namespace tandem
