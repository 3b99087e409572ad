#include "common/contact/contact_shape_options.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

namespace tandem::contact {
namespace {

void require(bool is_met, const char* field, double value, const char* remedy) {
  if (is_met) return;
  throw std::invalid_argument("contact shape: " + std::string(field) + " is " + std::to_string(value) + "; " + remedy);
}

}  // namespace

void check(const ContactShapeOptions& options) {
  require(options.cell_m >= kMinCell_m && options.cell_m <= 10, "cell_m", options.cell_m, "use 0.00001 to 10 m");
  require(options.tolerance_m > 0 && std::isfinite(options.tolerance_m), "tolerance_m", options.tolerance_m,
          "use a positive length");
  // The band must be at least as wide as a cell. At distances below half of a cell's diagonal, an interpolated distance
  // may have the wrong sign, so these distances must be in the band.
  require(options.band_m >= options.cell_m && options.band_m <= 100, "band_m", options.band_m,
          "use at least cell_m and at most 100 m");
  require(options.sheet_thickness_m >= 0 && options.sheet_thickness_m <= 100, "sheet_thickness_m",
          options.sheet_thickness_m, "use 0 to 100 m");
  require(options.threads >= 1 && options.threads <= 256, "threads", options.threads, "use 1 to 256");
}

}  // namespace tandem::contact
