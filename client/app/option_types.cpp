#include "client/app/option_types.hpp"

#include <CLI/CLI.hpp>
#include <sstream>
#include <stdexcept>

namespace tandem::client {

void add_text(CLI::App& app, const std::string& name, const std::string& help, const std::string& type,
              const std::function<void(const std::string&)>& store) {
  app.add_option_function<std::string>(
         name,
         [name, store](const std::string& text) {
           try {
             store(text);
           } catch (const std::invalid_argument& error) {
             throw CLI::ValidationError(name, error.what());
           }
         },
         help)
      ->type_name(type);
}

void add_number(CLI::App& app, const std::string& name, double& value, double least, double largest,
                const std::string& help, const std::string& type) {
  const auto in_range = [least, largest](const std::string& text) {
    double number = 0;
    // The comparisons are written such that the condition is false for NaN.
    if (CLI::detail::lexical_cast(text, number) && number >= least && number <= largest) return std::string();
    std::ostringstream remedy;
    remedy << "'" << text << "' must be a number from " << least << " to " << largest;
    return remedy.str();
  };
  app.add_option(name, value, help)->capture_default_str()->type_name(type)->check(in_range);
}

std::string listed(const std::vector<std::string_view>& names) {
  std::string text;
  for (const std::string_view name : names) text.append(text.empty() ? "" : ", ").append(name);
  return text;
}

}  // namespace tandem::client
