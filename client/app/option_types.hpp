// Building blocks for the command line of tandem-client.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace CLI {
class App;
}

namespace tandem::client {

/// Adds a text option. `store` converts the text to a setting. If it throws, the error message names the option.
void add_text(CLI::App& app, const std::string& name, const std::string& help, const std::string& type,
              const std::function<void(const std::string&)>& store);
/// Adds a number option with values from `least` to `largest`. The error for other values names both limits.
void add_number(CLI::App& app, const std::string& name, double& value, double least, double largest,
                const std::string& help, const std::string& type);
/// Returns names as one line of text: "a, b, c".
std::string listed(const std::vector<std::string_view>& names);

}  // namespace tandem::client
