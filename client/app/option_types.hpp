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

/// Registers a text option that `store` turns into a setting; the error that `store` throws names the option.
void add_text(CLI::App& app, const std::string& name, const std::string& help, const std::string& type,
              const std::function<void(const std::string&)>& store);
/// Registers a number from `least` to `largest`; the error for another value names both limits.
void add_number(CLI::App& app, const std::string& name, double& value, double least, double largest,
                const std::string& help, const std::string& type);
/// "a, b, c".
std::string listed(const std::vector<std::string_view>& names);

}  // namespace tandem::client
