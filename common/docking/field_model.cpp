#include "common/docking/field_model.hpp"

#include <charconv>
#include <cmath>
#include <stdexcept>

namespace tandem::docking {
namespace {

constexpr double kMinPermittivity = 0.1;
constexpr double kMaxPermittivity = 1000;

}  // namespace

void set_dielectric(FieldModel& model, const std::string& text) {
  model.dielectric = Dielectric::kNone;
  if (text == "none") return;
  const bool grows = text.ends_with('r');
  const char* const end = text.data() + text.size() - (grows ? 1 : 0);
  const auto [read, error] = std::from_chars(text.data(), end, model.permittivity);
  if (error != std::errc() || read != end) {
    throw std::invalid_argument("dielectric \"" + text +
                                "\" must be none, a number such as 1, or one with r such as 4r");
  }
  model.dielectric = grows ? Dielectric::kDistance : Dielectric::kConstant;
}

void validate(const FieldModel& model) {
  if (!(model.permittivity >= kMinPermittivity && model.permittivity <= kMaxPermittivity)) {
    throw std::invalid_argument("molecular field: permittivity = " + std::to_string(model.permittivity) +
                                ", must be 0.1 to 1000");
  }
  const double cutoff = model.cutoff_angstrom;
  if (cutoff != 0 && !(cutoff >= kMinCutoffAngstrom && cutoff <= kMaxCutoffAngstrom)) {
    throw std::invalid_argument("molecular field: cut-off = " + std::to_string(cutoff) +
                                " Å, must be 0 (none) or 4 to 100 Å");
  }
  if (model.has_far_grid && cutoff == 0) {
    throw std::invalid_argument(
        "molecular field: the grid holds the part beyond a cut-off; give a cut-off, 8 Å is usual");
  }
}

ForceSwitch force_switch(double alpha, double start_angstrom, double cutoff_angstrom) {
  const double r1 = start_angstrom, rc = cutoff_angstrom, width = rc - r1;
  const double scale = alpha / (std::pow(rc, alpha + 2) * width * width);
  ForceSwitch found;
  found.a = -scale * ((alpha + 4) * rc - (alpha + 1) * r1);
  found.b = scale * ((alpha + 3) * rc - (alpha + 1) * r1) / width;
  found.c = std::pow(rc, -alpha) - found.a / 3 * std::pow(width, 3) - found.b / 4 * std::pow(width, 4);
  return found;
}

}  // namespace tandem::docking
