#include "lab/cli/commands.hpp"

#include <CLI/CLI.hpp>
#include <array>
#include <cstdio>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/base/json_pretty.hpp"
#include "common/haptics/prediction/ar_model.hpp"
#include "lab/studies/prediction/ar_of_series.hpp"
#include "lab/studies/prediction/series_file.hpp"

namespace tandem::lab {
namespace {

constexpr std::array kFits{haptics::ArFit::kYuleWalker, haptics::ArFit::kLeastSquares, haptics::ArFit::kBurg};

struct FitOrderOptions {
  std::string file;
  double rate_hz = 200;
  std::string time_unit = "s";
  std::string columns;
  std::string fit{haptics::name_of(haptics::ArFit::kLeastSquares)};
  std::size_t most_order = 16;
  bool on_values = false;
  bool prints_json = false;
};

struct SeriesOrders {
  std::string name;
  std::size_t samples = 0;
  std::vector<haptics::ArOrder> orders;  ///< empty if the series is constant or too short
};

haptics::ArFit fit_named(const std::string& name) {
  for (const haptics::ArFit fit : kFits) {
    if (haptics::name_of(fit) == name) return fit;
  }
  // This line is unreachable: the check of the option refuses unknown names.
  throw std::invalid_argument("--fit " + name + " is not known");
}

std::vector<SeriesOrders> orders_of(const FitOrderOptions& options) {
  std::vector<SeriesOrders> result;
  const CsvTable series =
      load_series(options.file, options.rate_hz, options.time_unit == "ms" ? 1e-3 : 1.0, options.columns);
  for (std::size_t i = 0; i < series.names.size(); ++i) {
    const std::vector<double> values = options.on_values ? series.columns[i] : differences(series.columns[i]);
    auto orders = haptics::fpe_of_orders(values, options.most_order, fit_named(options.fit), options.on_values);
    // Only order 0 is fitted to a constant series.
    if (orders.size() < 2) orders.clear();
    result.push_back({series.names[i], values.size(), std::move(orders)});
  }
  return result;
}

boost::json::object to_json(const FitOrderOptions& options, const std::vector<SeriesOrders>& all) {
  boost::json::array series;
  for (const SeriesOrders& one : all) {
    boost::json::array orders;
    for (const haptics::ArOrder& row : one.orders) {
      orders.push_back({{"order", row.order}, {"error_variance", row.error_variance}, {"fpe", row.fpe}});
    }
    series.push_back({{"name", one.name},
                      {"samples", one.samples},
                      {"best_order", one.orders.empty() ? boost::json::value() : haptics::best_order(one.orders)},
                      {"orders", std::move(orders)}});
  }
  return {{"file", options.file},
          {"rate_hz", options.rate_hz},
          {"fit", options.fit},
          {"on_differences", !options.on_values},
          {"series", std::move(series)}};
}

void print(const std::vector<SeriesOrders>& all) {
  for (const SeriesOrders& one : all) {
    if (one.orders.empty()) {
      std::printf("%s: constant or too short, nothing to fit\n\n", one.name.c_str());
      continue;
    }
    const std::size_t best = haptics::best_order(one.orders);
    std::printf("%s: %zu samples, least FPE at order %zu\n%6s %14s %14s\n", one.name.c_str(), one.samples, best,
                "order", "V", "FPE");
    for (const haptics::ArOrder& row : one.orders) {
      std::printf("%6zu %14.6g %14.6g%s\n", row.order, row.error_variance, row.fpe, row.order == best ? "  least" : "");
    }
    std::printf("\n");
  }
}

}  // namespace

void add_fit_order_command(CLI::App& app, int&) {
  const auto options = std::make_shared<FitOrderOptions>();
  CLI::App* command = app.add_subcommand("fit-order", "Akaike's final prediction error of a force series, by AR order");
  command->add_option("series", options->file, "a .csv file with t_s and force columns, or a .traj file")->required();
  command->add_option("--most", options->most_order, "highest order")->capture_default_str()->check(CLI::Range(1, 32));
  std::vector<std::string> fits;
  for (const haptics::ArFit fit : kFits) fits.emplace_back(haptics::name_of(fit));
  command->add_option("--fit", options->fit, "how the coefficients are found")
      ->capture_default_str()
      ->check(CLI::IsMember(fits));
  command->add_flag("--values", options->on_values,
                    "fit the values themselves, less their mean; else their differences");
  command->add_option("--rate", options->rate_hz, "Hz that the series is resampled to")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 10000.0));
  command->add_option("--time-unit", options->time_unit, "of a file's times")
      ->capture_default_str()
      ->check(CLI::IsMember({"s", "ms"}));
  command->add_option("--columns", options->columns, "of a .csv, separated by commas; else all in N and N·m");
  command->add_flag("--json", options->prints_json, "print one JSON object");
  command->footer("V: variance of the one-step error. FPE = V (1 + p/N)/(1 - p/N). Exit code: 0 done, 2 bad input.");
  command->callback([options] {
    const std::vector<SeriesOrders> all = orders_of(*options);
    if (options->prints_json) {
      std::cout << pretty_json(to_json(*options, all));
    } else {
      print(all);
    }
  });
}

}  // namespace tandem::lab
