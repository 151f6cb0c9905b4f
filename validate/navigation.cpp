#include "validate/navigation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/world_magnetic_model.h"

namespace terracast::validate {

namespace {

/// Temperatures at the heights where ISO 2533's layers meet; between them they are straight lines.
constexpr std::array<std::array<double, 2>, 8> kTemperatures = {{{0.0, 288.15},
                                                                 {11000.0, 216.65},
                                                                 {20000.0, 216.65},
                                                                 {32000.0, 228.65},
                                                                 {47000.0, 270.65},
                                                                 {51000.0, 270.65},
                                                                 {71000.0, 214.65},
                                                                 {80000.0, 196.65}}};

constexpr int kDegree = core::MagneticTable::kDegree;

/// Legendre's functions in Schmidt's norm of the cosine of a colatitude, and their derivatives by it.
struct SchmidtFunctions {
  std::array<std::array<double, kDegree + 1>, kDegree + 1> value{}, slope{};

  explicit SchmidtFunctions(double colatitude_rad) {
    const double c = std::cos(colatitude_rad), s = std::sin(colatitude_rad);
    value[0][0] = 1.0;
    for (std::size_t n = 1; n <= kDegree; ++n)
      for (std::size_t m = 0; m <= n; ++m) {
        const auto k = static_cast<double>(n), o = static_cast<double>(m);
        if (m == n) {
          const double factor = n == 1 ? 1.0 : std::sqrt((2.0 * k - 1.0) / (2.0 * k));
          value[n][n] = factor * s * value[n - 1][n - 1];
          slope[n][n] = factor * (s * slope[n - 1][n - 1] + c * value[n - 1][n - 1]);
          continue;
        }
        const double below = std::sqrt(k * k - o * o);
        const double one = (2.0 * k - 1.0) / below;
        value[n][m] = one * c * value[n - 1][m];
        slope[n][m] = one * (c * slope[n - 1][m] - s * value[n - 1][m]);
        if (n < 2) continue;
        const double two = std::sqrt((k - 1.0) * (k - 1.0) - o * o) / below;
        // Of n = m + 1 that is the root of 0, and no such function.
        if (m > n - 2) continue;
        value[n][m] -= two * value[n - 2][m];
        slope[n][m] -= two * slope[n - 2][m];
      }
  }
};

}  // namespace

double standard_pressure_pa(double altitude_msl_m, double sea_level_pressure_pa, double warmer_k) {
  constexpr double kEarth_m = 6356766.0, kGravity_mps2 = 9.80665, kGas = 287.05287;
  const double height_m = kEarth_m * altitude_msl_m / (kEarth_m + altitude_msl_m);
  double pressure_pa = sea_level_pressure_pa;
  for (std::size_t i = 0; i + 1 < kTemperatures.size(); ++i) {
    const auto& [base_m, base_k] = kTemperatures[i];
    const auto& [top_m, top_k] = kTemperatures[i + 1];
    const double up_m = std::min(height_m, top_m) - base_m;
    if (i > 0 && up_m <= 0.0) break;
    const double gradient = (top_k - base_k) / (top_m - base_m);
    const double temperature_k = base_k + warmer_k;
    // The integral of dp / p = -g dH / (R T).
    pressure_pa *=
        std::exp(-kGravity_mps2 / kGas *
                 (gradient == 0.0 ? up_m / temperature_k
                                  : std::log1p(gradient * up_m / temperature_k) / gradient));
  }
  return pressure_pa;
}

double decimal_year(double unix_s) {
  // Days of the Gregorian calendar: 146 097 in 400 years; years of it, by trial.
  const auto days_before = [](std::int64_t year) {
    const std::int64_t y = year - 1;
    return 365 * y + y / 4 - y / 100 + y / 400;
  };
  const double days = unix_s / 86400.0 + static_cast<double>(days_before(1970));
  auto year = static_cast<std::int64_t>(days / 365.2425) + 1;
  while (static_cast<double>(days_before(year)) > days) --year;
  while (static_cast<double>(days_before(year + 1)) <= days) ++year;
  const auto first = static_cast<double>(days_before(year));
  return static_cast<double>(year) +
         (days - first) / (static_cast<double>(days_before(year + 1)) - first);
}

Eigen::Vector3d magnetic_field_ecef_nt(const Eigen::Vector3d& point_ecef, double year) {
  const core::MagneticTable* table = nullptr;
  for (const core::MagneticTable& model : core::world_magnetic_models())
    if (year >= model.first_year && year < model.end_year) table = &model;
  if (table == nullptr) return Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  const double radius_m = point_ecef.norm();
  const double from_axis_m = std::max(std::hypot(point_ecef.x(), point_ecef.y()), 1e-3);
  const double lon = std::atan2(point_ecef.y(), point_ecef.x());
  const double colatitude = std::atan2(from_axis_m, point_ecef.z());
  const SchmidtFunctions p(colatitude);
  // To the south, to the east and outward, on the sphere through the point.
  double south = 0.0, east = 0.0, out = 0.0;
  for (int n = 1; n <= kDegree; ++n) {
    const double share = std::pow(6371200.0 / radius_m, n + 2);
    for (int m = 0; m <= n; ++m) {
      const core::MagneticCoefficient& of = table->at(n, m);
      const double years = year - table->first_year;
      const double g = of.g_nt + years * of.g_nt_per_year;
      const double h = of.h_nt + years * of.h_nt_per_year;
      const double along = g * std::cos(m * lon) + h * std::sin(m * lon);
      const double across = g * std::sin(m * lon) - h * std::cos(m * lon);
      const auto i = static_cast<std::size_t>(n), j = static_cast<std::size_t>(m);
      out += share * (n + 1) * along * p.value[i][j];
      south -= share * along * p.slope[i][j];
      east += share * m * across * p.value[i][j] * radius_m / from_axis_m;
    }
  }
  const double c = std::cos(colatitude), s = std::sin(colatitude);
  const double outward = out * s + south * c;
  return {outward * std::cos(lon) - east * std::sin(lon),
          outward * std::sin(lon) + east * std::cos(lon), out * c - south * s};
}

}  // namespace terracast::validate
