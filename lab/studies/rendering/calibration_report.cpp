#include "lab/studies/rendering/calibration_report.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <sstream>

namespace tandem::lab {
namespace {

namespace json = boost::json;

constexpr int kHeight_px = 260;
constexpr int kCurvePoints = 100;

/// Words and units of an axis in the report.
struct Quantity {
  std::string name;
  std::string unit;

  std::string label() const { return name + " [" + unit + "]"; }
};
struct Words {
  Quantity inertia;
  Quantity stiffness;
  Quantity damping;
  Quantity roughness;
  bool is_rotation;
};
const Words kTranslation{{"mass", "kg"}, {"stiffness", "N/m"}, {"damping", "N·s/m"}, {"roughness", "mN"}, false};
const Words kRotation{
    {"moment of inertia", "kg·m²"}, {"stiffness", "N·m/rad"}, {"damping", "N·m·s/rad"}, {"roughness", "mN·m"}, true};

std::string text_of(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

json::object pair_json(const Pair& pair, double spectral_radius, double restlessness, double roughness) {
  return {{"stiffness", pair.stiffness},
          {"damping", pair.damping},
          {"spectral_radius_with_margins", spectral_radius},
          {"rest_range_steps", restlessness},
          {"roughness", roughness}};
}

json::object axis_json(const AxisCalibration& axis, const Words& words) {
  json::array points, left_out;
  const char* const inertia = words.is_rotation ? "inertia_kg_m2" : "inertia_kg";
  for (const CalibrationPoint& point : axis.left_out) {
    left_out.push_back(
        json::object{{"mass_kg", point.mass_kg}, {inertia, point.inertia}, {"limited_by", point.limited_by}});
  }
  for (const CalibrationPoint& point : axis.points) {
    points.push_back(json::object{
        {"mass_kg", point.mass_kg},
        {inertia, point.inertia},
        {"limited_by", point.limited_by},
        {"roughness_allowed", point.roughness_allowed},
        {"best", pair_json(point.best, point.spectral_radius, point.restlessness, point.roughness)},
        {"fitted",
         pair_json(point.fitted, point.fitted_spectral_radius, point.fitted_restlessness, point.fitted_roughness)}});
  }
  const auto polynomial = [](const haptics::Cubic& cubic, int degree) {
    return json::object{{"coefficients", json::array(cubic.c.begin(), cubic.c.end())}, {"degree", degree}};
  };
  return {{"points", points},
          {"left_out", left_out},
          {"stiffness", polynomial(axis.stiffness, axis.stiffness_degree)},
          {"damping", polynomial(axis.damping, axis.damping_degree)},
          {"stiffness_maximum", axis.stiffness_maximum},
          {"is_maximum_verified", axis.is_maximum_verified},
          {"damping_maximum", axis.damping_maximum}};
}

json::object settings_json(const CalibrationSettings& settings) {
  return {{"gain_margin", settings.gain_margin},
          {"delay_margin_periods", settings.delay_margin_periods},
          {"rate_hz", settings.rate_hz},
          {"tremor_rms_n", settings.tremor_rms_n},
          {"seed", settings.seed},
          {"roughness_floor_n", settings.roughness_floor_n},
          {"roughness_share_of_weight", settings.roughness_share_of_weight},
          {"stiffness_share_of_roughness", settings.stiffness_share_of_roughness},
          {"rest_range_steps", settings.restlessness_steps},
          {"gyration_radius_m", settings.gyration_radius_m}};
}

/// Samples a curve over the tried range, so that the plot shows the polynomial between the points.
Series curve(const std::string& label, const haptics::Cubic& cubic, double low, double high) {
  Series series{label, {}, {}, 0, Draw::kLine};
  for (int i = 0; i <= kCurvePoints; ++i) {
    const double x = low + (high - low) * i / kCurvePoints;
    series.x.push_back(x);
    series.y.push_back(cubic(x));
  }
  return series;
}

Plot half_plot(std::string description, const Quantity& x, const Quantity& y) {
  Plot plot;
  plot.description = std::move(description);
  plot.x = {.quantity = x.name, .unit = x.unit};
  plot.y = {.quantity = y.name, .unit = y.unit};
  plot.y.low = 0;
  plot.width_px = kHalfWidth_px;
  plot.height_px = kHeight_px;
  return plot;
}

Plot stiffness_figure(const AxisCalibration& axis, const Words& words) {
  Plot plot = half_plot("Best stiffness of each tool and the polynomial through them", words.inertia, words.stiffness);
  Series found{"best", {}, {}, 1, Draw::kMarkers};
  for (const CalibrationPoint& point : axis.points) {
    found.x.push_back(point.inertia);
    found.y.push_back(point.best.stiffness);
  }
  plot.series = {
      curve("fit, degree " + std::to_string(axis.stiffness_degree), axis.stiffness, found.x.front(), found.x.back()),
      std::move(found)};
  plot.limits.push_back(
      {axis.stiffness_maximum, axis.is_maximum_verified ? "most of the device" : "cap: its own is unverified"});
  plot.caption =
      "The largest stiffness that is stable with the margins, at rest and quiet. Beyond the ends the "
      "nearest value holds.";
  return plot;
}

Plot damping_figure(const AxisCalibration& axis, const Words& words) {
  Plot plot =
      half_plot("Best damping at each stiffness and the polynomial through them", words.stiffness, words.damping);
  Series found{"best", {}, {}, 1, Draw::kMarkers};
  for (const CalibrationPoint& point : axis.points) {
    // Points of almost equal stiffness may be in any order, but the x values of a plot must not decrease. Therefore
    // they are made monotonic.
    const double k = found.x.empty() ? point.best.stiffness : std::max(found.x.back(), point.best.stiffness);
    found.x.push_back(k);
    found.y.push_back(point.best.damping);
  }
  plot.series = {
      curve("fit, degree " + std::to_string(axis.damping_degree), axis.damping, found.x.front(), found.x.back()),
      std::move(found)};
  plot.limits.push_back({axis.damping_maximum, "most of the device"});
  plot.caption =
      "The damping with which the tool settles soonest once it is suddenly heavy, where that is "
      "stable with the margins, at rest and quiet.";
  return plot;
}

Table points_table(const AxisCalibration& axis, const Words& words) {
  Table table;
  table.caption = "Best values of each tool, and the values of the polynomials";
  table.columns = {{words.inertia.name, words.inertia.unit},
                   {"best stiffness", words.stiffness.unit},
                   {"not stiffer for", ""},
                   {"best damping", words.damping.unit},
                   {"fitted stiffness", words.stiffness.unit},
                   {"fitted damping", words.damping.unit},
                   {words.roughness.name, words.roughness.unit},
                   {"allowed", words.roughness.unit}};
  table.columns[2].is_text = true;
  for (const CalibrationPoint& point : axis.points) {
    table.rows.push_back({text_of(point.inertia), text_of(point.best.stiffness), std::string(point.limited_by),
                          text_of(point.best.damping), text_of(point.fitted.stiffness), text_of(point.fitted.damping),
                          text_of(1e3 * point.fitted_roughness), text_of(1e3 * point.roughness_allowed)});
  }
  return table;
}

std::string method(const Calibration& calibration) {
  const CalibrationSettings& s = calibration.settings;
  std::ostringstream text;
  text
      << "Best stiffness of a tool: the largest that (1) is stable with " << s.gain_margin << " times the force and "
      << s.delay_margin_periods << " period of delay more, in no hand, a relaxed one, a light and a firm grip, the "
      << "tool in the air and in stiff contact; (2) lets a hand that presses without tremor come to rest within "
      << s.restlessness_steps
      << " encoder steps; (3) adds no more roughness (RMS above 30 Hz, with encoder steps and a "
      << "tremor of " << s.tremor_rms_n << " N) than " << 1e3 * s.roughness_floor_n << " mN and "
      << 100 * s.roughness_share_of_weight << " % of the tool's weight; and (4) is within the device's limits. "
      << "Best damping: the tool settles soonest once it is suddenly heavy (least ∫ t |d − d_rest| dt) under the same "
         "conditions. The polynomial's degree is "
      << "that which errs least at points it was not shown. All on the simulated hand; masses, damping and resolutions "
      << "are those of the profile.";
  return text.str();
}

/// Returns remarks about a calibration that supplement the table of points.
std::vector<std::string> remarks_of(const AxisCalibration& axis, const Words& words) {
  const std::string unit = " " + words.stiffness.unit;
  std::vector<std::string> remarks;
  for (const CalibrationPoint& point : axis.left_out) {
    remarks.push_back("left out, too light: " + text_of(point.mass_kg) + " kg; even " + text_of(point.best.stiffness) +
                      unit + " breaks \"" + std::string(point.limited_by) +
                      "\"; it gets the values of the lightest tried one");
  }
  if (!axis.is_maximum_verified) {
    remarks.push_back("capped at " + text_of(axis.stiffness_maximum) + unit +
                      ": the stiffness that this device can show is unverified; this table is not its own");
  }
  return remarks;
}

std::vector<Plot> figures_of(const AxisCalibration& axis, const Words& words) {
  return {stiffness_figure(axis, words), damping_figure(axis, words)};
}

std::string answer_of(const AxisCalibration& axis, const Words& words) {
  const CalibrationPoint& light = axis.points.front();
  const CalibrationPoint& heavy = axis.points.back();
  const auto of = [&](const CalibrationPoint& point) {
    return "A tool of " + text_of(point.inertia) + " " + words.inertia.unit + " gets " +
           text_of(point.fitted.stiffness) + " " + words.stiffness.unit + " and " + text_of(point.fitted.damping) +
           " " + words.damping.unit + ". ";
  };
  return of(light) + of(heavy) + "Between them the curves below hold.";
}

void add_points(HtmlReport& page, const char* heading, const AxisCalibration& axis, const Words& words) {
  page.heading(heading);
  page.table(points_table(axis, words));
  for (const std::string& remark : remarks_of(axis, words)) page.paragraph(remark);
}

void print_axis(std::ostream& out, const AxisCalibration& axis, const Words& words) {
  out << '\n'
      << words.inertia.label() << ": " << words.stiffness.label() << ", " << words.damping.label()
      << "; not stiffer for\n";
  for (const CalibrationPoint& point : axis.points) {
    out << "  " << text_of(point.inertia) << ": " << text_of(point.best.stiffness) << ", "
        << text_of(point.best.damping) << "; " << point.limited_by << "   fitted " << text_of(point.fitted.stiffness)
        << ", " << text_of(point.fitted.damping) << '\n';
  }
  for (const std::string& remark : remarks_of(axis, words)) out << "  " << remark << '\n';
}

}  // namespace

json::object to_json(const Calibration& calibration) {
  json::object result{{"device", calibration.profile.name},
                      {"settings", settings_json(calibration.settings)},
                      {"translation", axis_json(calibration.translation, kTranslation)},
                      {"rotation", nullptr},
                      {"checks", to_json(checks_of(calibration))}};
  if (calibration.rotation) result["rotation"] = axis_json(*calibration.rotation, kRotation);
  return result;
}

HtmlReport to_report(const Calibration& calibration) {
  HtmlReport page("Calibration of " + calibration.profile.name, calibration.profile.title);
  page.question("Which stiffness and damping may a tool of each mass have on this device?");
  page.answer(answer_of(calibration.translation, kTranslation));
  page.verdict(checks_of(calibration));
  page.side_by_side(figures_of(calibration.translation, kTranslation));
  page.appendix();
  page.heading("Method");
  page.paragraph(method(calibration));
  add_points(page, "Translation", calibration.translation, kTranslation);
  if (calibration.rotation) {
    add_points(page, "Rotation", *calibration.rotation, kRotation);
    page.side_by_side(figures_of(*calibration.rotation, kRotation));
  }
  page.footer(calibration.profile.adaptive_source);
  return page;
}

std::string to_text(const Calibration& calibration) {
  std::ostringstream out;
  out << calibration.profile.name << ": " << calibration.profile.title << '\n';
  print_axis(out, calibration.translation, kTranslation);
  if (calibration.rotation) print_axis(out, *calibration.rotation, kRotation);
  out << '\n';
  print_checks(out, checks_of(calibration));
  return out.str();
}

}  // namespace tandem::lab
