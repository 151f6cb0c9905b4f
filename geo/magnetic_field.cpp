#include "geo/magnetic_field.h"

#include <GeographicLib/SphericalHarmonic1.hpp>
#include <cmath>
#include <ctime>
#include <memory>
#include <vector>

#include "core/error.h"
#include "core/world_magnetic_model.h"

namespace terracast::geo {

namespace {

/// The radius that the model's coefficients are for, m.
constexpr double kMagneticRadius_m = 6371200.0;

/// A model's numbers in GeographicLib's order, and their sum.
class MagneticSum {
 public:
  explicit MagneticSum(const core::MagneticTable& table) : first_year_(table.first_year) {
    constexpr int kDegree = core::MagneticTable::kDegree;
    // Order by order, from its own degree up; sines begin at the first order.
    for (int order = 0; order <= kDegree; ++order)
      for (int degree = order; degree <= kDegree; ++degree) {
        const core::MagneticCoefficient of =
            degree == 0 ? core::MagneticCoefficient{} : table.at(degree, order);
        cosines_.push_back(of.g_nt);
        yearly_cosines_.push_back(of.g_nt_per_year);
        if (order == 0) continue;
        sines_.push_back(of.h_nt);
        yearly_sines_.push_back(of.h_nt_per_year);
      }
    sum_ = GeographicLib::SphericalHarmonic1(cosines_, sines_, kDegree, yearly_cosines_,
                                             yearly_sines_, kDegree, kMagneticRadius_m,
                                             GeographicLib::SphericalHarmonic1::SCHMIDT);
  }
  MagneticSum(const MagneticSum&) = delete;
  MagneticSum& operator=(const MagneticSum&) = delete;

  Eigen::Vector3d field_nt(const Eigen::Vector3d& point, double year) const {
    Eigen::Vector3d slope;
    sum_(year - first_year_, point.x(), point.y(), point.z(), slope.x(), slope.y(), slope.z());
    return -kMagneticRadius_m * slope;
  }

 private:
  double first_year_;
  std::vector<double> cosines_, sines_, yearly_cosines_, yearly_sines_;
  GeographicLib::SphericalHarmonic1 sum_;  ///< refers to those
};

std::size_t model_of(double year) {
  const auto models = core::world_magnetic_models();
  for (std::size_t i = models.size(); i-- > 0;)
    if (year >= models[i].first_year && year < models[i].end_year) return i;
  core::fail(
      core::ErrorKind::Config,
      "the World Magnetic Model is known here from the year {:.0f} to before {:.0f}, and the "
      "year {:.4f} is asked for; take another date (utc_start of the trajectory)",
      models.front().first_year, models.back().end_year, year);
}

}  // namespace

double decimal_year(double unix_s) {
  const auto year_of = [](std::time_t seconds) {
    std::tm parts{};
    gmtime_r(&seconds, &parts);
    return parts.tm_year;
  };
  const auto begin_of = [](int year) {
    std::tm parts{};
    parts.tm_year = year;
    parts.tm_mday = 1;
    return static_cast<double>(timegm(&parts));
  };
  const int year = year_of(static_cast<std::time_t>(std::floor(unix_s)));
  const double begin_s = begin_of(year);
  return 1900.0 + year + (unix_s - begin_s) / (begin_of(year + 1) - begin_s);
}

Eigen::Vector3d magnetic_field_ecef_nt(const Eigen::Vector3d& point_ecef, double year) {
  static const std::vector<std::unique_ptr<const MagneticSum>> kSums = [] {
    std::vector<std::unique_ptr<const MagneticSum>> sums;
    for (const core::MagneticTable& table : core::world_magnetic_models())
      sums.push_back(std::make_unique<const MagneticSum>(table));
    return sums;
  }();
  return kSums[model_of(year)]->field_nt(point_ecef, year);
}

void check_magnetic_year(double year) { static_cast<void>(model_of(year)); }

}  // namespace terracast::geo
