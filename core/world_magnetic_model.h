#pragma once

#include <array>
#include <span>
#include <string_view>

/// The numbers of the World Magnetic Model as they are published. What they make of the field is for others: the
/// renderer and the validator each do so by code of their own.
namespace terracast::core {

/// Gauss coefficients of a degree and order, Schmidt semi-normalised, nT, and what they gain a year.
struct MagneticCoefficient {
  double g_nt, h_nt, g_nt_per_year, h_nt_per_year;
};

/// A model of five years. At its first year the coefficients are the stated ones.
struct MagneticTable {
  static constexpr int kDegree = 12;
  std::string_view name;
  double first_year, end_year;  ///< decimal years: from the first to before the end
  /// Of degree n and order m, 1 to kDegree and 0 to n, in the order of n (n + 1) / 2 + m - 1.
  std::array<MagneticCoefficient, 90> rows;

  const MagneticCoefficient& at(int degree, int order) const {
    return rows[static_cast<std::size_t>(degree * (degree + 1) / 2 + order - 1)];
  }
};

/// By years, without gaps.
/// source   NOAA/NCEI and the British Geological Survey, WMM2015 (of December 2014), WMM2020 and WMM2025: works of the
///          government of the United States, in the public domain
std::span<const MagneticTable> world_magnetic_models();

}  // namespace terracast::core
