// Fixes against WGS84's own formulas and differences of the places, and their errors against their theory.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <numbers>

#include "tests/support/expect_error.h"
#include "tests/support/sensor_flight.h"

namespace terracast::test {
namespace {

using Eigen::Vector3d;

constexpr double kDegree_rad = std::numbers::pi / 180.0;

/// WGS84 by its defining numbers.
constexpr double kA_m = 6378137.0;
constexpr double kE2 = (2.0 - 1.0 / 298.257223563) / 298.257223563;
double w_of(double lat_rad) { return 1.0 - kE2 * std::pow(std::sin(lat_rad), 2); }
double prime_vertical_m(double lat_rad) { return kA_m / std::sqrt(w_of(lat_rad)); }
double meridian_m(double lat_rad) { return kA_m * (1.0 - kE2) / std::pow(w_of(lat_rad), 1.5); }

struct Stated {
  double lat_deg, lon_deg, height_m, altitude_msl_m;
  Vector3d velocity_ned_mps;

  explicit Stated(const double* row)
      : lat_deg(row[0]),
        lon_deg(row[1]),
        height_m(row[2]),
        altitude_msl_m(row[3]),
        velocity_ned_mps(row[4], row[5], row[6]) {}
  Vector3d ecef() const {
    const double lat = kDegree_rad * lat_deg, lon = kDegree_rad * lon_deg;
    const double n = prime_vertical_m(lat);
    return {(n + height_m) * std::cos(lat) * std::cos(lon),
            (n + height_m) * std::cos(lat) * std::sin(lon),
            (n * (1.0 - kE2) + height_m) * std::sin(lat)};
  }
  /// Its place east, north and up of another one, a few metres away.
  Vector3d enu_from(const Stated& other) const {
    const double lat = kDegree_rad * other.lat_deg, lon = kDegree_rad * other.lon_deg;
    const Vector3d off = ecef() - other.ecef();
    const Vector3d east(-std::sin(lon), std::cos(lon), 0.0);
    const Vector3d up(std::cos(lat) * std::cos(lon), std::cos(lat) * std::sin(lon), std::sin(lat));
    return {off.dot(east), off.dot(up.cross(east)), off.dot(up)};
  }
};

struct Fix {
  Stated shown;
  std::array<double, 4> sigmas;
  double kind;
  Stated truth;

  explicit Fix(const double* row)
      : shown(row), sigmas{row[7], row[8], row[9], row[10]}, kind(row[11]), truth(row + 12) {}
  Vector3d error_enu_m() const { return shown.enu_from(truth); }
  Vector3d velocity_error_mps() const { return shown.velocity_ned_mps - truth.velocity_ned_mps; }
};
constexpr std::size_t kNumChannels = 19;

const geo::Rigid3d kMount{
    .rotation = Eigen::Quaterniond(Eigen::AngleAxisd(1.1, Vector3d(1.0, 2.0, 3.0).normalized())),
    .translation = {-0.8, 0.3, 1.4}};

class Gnss : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists("/usr/share/proj/egm96_15.gtx"))
      GTEST_SKIP() << "no grid of EGM96: install proj-data";
  }
  std::vector<Fix> measure(const std::string& keys, std::shared_ptr<const geo::Trajectory> motion,
                           double rate_hz, std::size_t count,
                           const geo::Rigid3d& body_from_sensor = {}) const {
    const std::vector<double> values =
        flight_.measure("gnss", keys, std::move(motion), rate_hz, count, body_from_sensor);
    EXPECT_EQ(values.size(), kNumChannels * count);
    std::vector<Fix> fixes;
    for (std::size_t k = 0; k < count; ++k) fixes.emplace_back(&values[kNumChannels * k]);
    return fixes;
  }
  const geo::WorldFrame& frame() const { return flight_.frame(); }

 private:
  SensorFlight flight_;
};

/// 20 km north-east of the origin, where north is another one than there.
std::shared_ptr<WavyMotion> far_flight() {
  std::shared_ptr<WavyMotion> motion = figure_of_eight();
  motion->place[0].middle += 14000.0;
  motion->place[1].middle += 15000.0;
  motion->place[0].slope = 30.0;
  return motion;
}

TEST_F(Gnss, PlacesAreThoseOfTheAntenna) {
  const auto motion = far_flight();
  const std::vector<Fix> fixes = measure("", motion, 5.0, 200, kMount);
  double farthest_from_body_m = 0.0;
  for (std::size_t k = 0; k < fixes.size(); ++k) {
    const geo::MotionState body = motion->at(static_cast<double>(k) / 5.0);
    const auto ecef_of = [&](const Vector3d& point_body) -> Vector3d {
      return frame().ecef_from_world() * (body.world_from_body * point_body);
    };
    const Vector3d right = ecef_of(kMount.translation);
    EXPECT_LT((fixes[k].truth.ecef() - right).norm(), 2e-8);
    farthest_from_body_m =
        std::max(farthest_from_body_m, (fixes[k].truth.ecef() - ecef_of(Vector3d::Zero())).norm());
    // Without errors it shows its truth, and says so.
    EXPECT_EQ(fixes[k].shown.ecef(), fixes[k].truth.ecef());
    EXPECT_EQ(fixes[k].shown.velocity_ned_mps, fixes[k].truth.velocity_ned_mps);
    EXPECT_EQ(fixes[k].sigmas, (std::array<double, 4>{}));
    EXPECT_EQ(fixes[k].kind, 1.0);
  }
  EXPECT_NEAR(farthest_from_body_m, kMount.translation.norm(), 1e-7);
}

TEST_F(Gnss, VelocitiesAreDerivativesOfLatitudeLongitudeAndHeight) {
  constexpr double kStep_s = 0.02;
  const auto motion = far_flight();
  const std::vector<Fix> fixes = measure("", motion, 1.0 / kStep_s, 2000, kMount);
  const std::vector<Fix> of_body = measure("", motion, 1.0 / kStep_s, 2000);
  double by_lever_arm_mps = 0.0;
  for (std::size_t k = 4; k + 4 < fixes.size(); k += 7) {
    // Central differences of the eighth order; of degrees rounded to 1e-14 they leave 1e-7 m/s.
    const auto slope = [&](double Stated::*number) {
      const auto across = [&](std::size_t i) {
        return fixes[k + i].truth.*number - fixes[k - i].truth.*number;
      };
      return (across(1) * (4.0 / 5.0) - across(2) / 5.0 + across(3) * (4.0 / 105.0) -
              across(4) / 280.0) /
             kStep_s;
    };
    const Stated& at = fixes[k].truth;
    const double lat = kDegree_rad * at.lat_deg;
    const Vector3d expected((meridian_m(lat) + at.height_m) * kDegree_rad * slope(&Stated::lat_deg),
                            (prime_vertical_m(lat) + at.height_m) * std::cos(lat) * kDegree_rad *
                                slope(&Stated::lon_deg),
                            -slope(&Stated::height_m));
    EXPECT_LT((at.velocity_ned_mps - expected).norm(), 2e-6) << k;
    by_lever_arm_mps = std::max(by_lever_arm_mps,
                                (at.velocity_ned_mps - of_body[k].truth.velocity_ned_mps).norm());
  }
  // Its lever arm counts.
  EXPECT_GT(by_lever_arm_mps, 0.5);
}

TEST_F(Gnss, SeaLevelIsThatOfEgm96) {
  const std::vector<Fix> fixes = measure("", far_flight(), 5.0, 20);
  // NGA's geoid stands 50 to 56 m above the ellipsoid in the western Alps.
  for (const Fix& fix : fixes) {
    const double undulation_m = fix.truth.height_m - fix.truth.altitude_msl_m;
    EXPECT_GT(undulation_m, 50.0);
    EXPECT_LT(undulation_m, 56.0);
    EXPECT_NEAR(undulation_m,
                geo::Geoid::egm96()->undulation_m(fix.truth.lat_deg, fix.truth.lon_deg), 1e-9);
  }
}

/// Covariances over time against a process's own, to four standard errors of their estimate (Bartlett's formula).
void expect_covariances(const std::vector<double>& samples,
                        const std::function<double(double lag)>& theory) {
  const auto count = static_cast<double>(samples.size());
  for (const std::size_t lag : {std::size_t{0}, std::size_t{1}, std::size_t{10}, std::size_t{40}}) {
    double sum = 0.0;
    for (std::size_t k = 0; k + lag < samples.size(); ++k) sum += samples[k] * samples[k + lag];
    const auto l = static_cast<double>(lag);
    double variance = 0.0;
    for (double j = -400.0; j <= 400.0; ++j)
      variance +=
          std::pow(theory(std::abs(j)), 2) + theory(std::abs(j + l)) * theory(std::abs(j - l));
    EXPECT_NEAR(sum / (count - l), theory(l), 4.0 * std::sqrt(variance / count)) << lag;
  }
}

std::vector<double> along(const std::vector<Fix>& fixes, int axis, bool is_velocity = false) {
  std::vector<double> errors;
  for (const Fix& fix : fixes)
    errors.push_back((is_velocity ? fix.velocity_error_mps() : fix.error_enu_m())[axis]);
  return errors;
}

TEST_F(Gnss, ErrorsHaveTheCovariancesOfTheirParameters) {
  constexpr std::size_t kCount = 40000;
  const std::vector<Fix> fixes = measure(R"(
[single]
velocity_noise_horizontal_mps = 0.05
velocity_noise_vertical_mps = 0.1
markov_horizontal_m = 1.2
markov_vertical_m = 2.0
markov_s = 10.0
noise_horizontal_m = 0.3
noise_vertical_m = 0.5
)",
                                         std::make_shared<WavyMotion>(), 2.0, kCount);
  for (int axis = 0; axis < 3; ++axis) {
    const double markov = axis < 2 ? 1.2 : 2.0, noise = axis < 2 ? 0.3 : 0.5;
    expect_covariances(along(fixes, axis), [&](double lag) {
      return markov * markov * std::exp(-lag / 20.0) + (lag == 0.0 ? noise * noise : 0.0);
    });
    const double velocity = axis < 2 ? 0.05 : 0.1;
    expect_covariances(along(fixes, axis, true),
                       [&](double lag) { return lag == 0.0 ? velocity * velocity : 0.0; });
  }
  // Axes have numbers of their own.
  const std::vector<double> east = along(fixes, 0), north = along(fixes, 1);
  double both = 0.0;
  for (std::size_t k = 0; k < kCount; ++k) both += east[k] * north[k];
  EXPECT_NEAR(both / kCount, 0.0, 4.0 * 1.44 * std::sqrt(20.0 / kCount));
  // What is believed is what was drawn.
  EXPECT_EQ(fixes[7].sigmas, (std::array{std::hypot(1.2, 0.3), std::hypot(2.0, 0.5), 0.05, 0.1}));
}

TEST_F(Gnss, RtkIsLostAndComesBack) {
  constexpr std::size_t kCount = 100000;
  const std::vector<Fix> fixes = measure(R"(
mode = "rtk"
fixed_for_s = 60.0
floating_for_s = 12.0
fixed = { noise_horizontal_m = 0.008, noise_vertical_m = 0.015 }
floating = { markov_horizontal_m = 0.3, markov_vertical_m = 0.5, markov_s = 30.0 }
)",
                                         std::make_shared<WavyMotion>(), 1.0, kCount);
  double num_fixed = 0.0, num_lost = 0.0, squares_fixed = 0.0, squares_floating = 0.0;
  for (std::size_t k = 0; k < kCount; ++k) {
    const bool is_fixed = fixes[k].kind == 4.0;
    EXPECT_TRUE(is_fixed || fixes[k].kind == 5.0);
    EXPECT_EQ(fixes[k].sigmas[0], is_fixed ? 0.008 : 0.3);
    EXPECT_EQ(fixes[k].sigmas[1], is_fixed ? 0.015 : 0.5);
    const double east_m = fixes[k].error_enu_m().x();
    (is_fixed ? squares_fixed : squares_floating) += east_m * east_m;
    num_fixed += is_fixed;
    num_lost += k > 0 && is_fixed != (fixes[k - 1].kind == 4.0) && !is_fixed;
  }
  // Shares of time and how often it is lost, of a process with two states: what it was is forgotten over 10 s.
  const double share = 60.0 / 72.0;
  EXPECT_NEAR(num_fixed / kCount, share,
              4.0 * std::sqrt(share * (1.0 - share) * 2.0 * 10.0 / kCount));
  const double lost_a_tick = share * (1.0 - share) * -std::expm1(-0.1);
  EXPECT_NEAR(num_lost / kCount, lost_a_tick, 4.0 * std::sqrt(lost_a_tick / kCount));
  EXPECT_NEAR(std::sqrt(squares_fixed / num_fixed), 0.008,
              4.0 * 0.008 / std::sqrt(2.0 * num_fixed));
  const double num_free = (kCount - num_fixed) / 30.0;
  EXPECT_NEAR(std::sqrt(squares_floating / (kCount - num_fixed)), 0.3,
              4.0 * 0.3 / std::sqrt(2.0 * num_free));
}

TEST_F(Gnss, RtkThatIsNeverLostIsFixed) {
  for (const Fix& fix : measure("mode = \"rtk\"", figure_of_eight(), 10.0, 50)) {
    EXPECT_EQ(fix.kind, 4.0);
    EXPECT_EQ(fix.shown.ecef(), fix.truth.ecef());
  }
}

TEST_F(Gnss, ShippedSetsAreRead) {
  const std::string folder = TERRACAST_SOURCE_DIR "/configs/sensors/";
  const Fix single = measure("single = \"" + folder + "gnss_ins_sim_low/single.toml\"",
                             figure_of_eight(), 10.0, 1)[0];
  EXPECT_EQ(single.sigmas, (std::array<double, 4>{5.0, 7.0, 0.05, 0.05}));
  const Fix fixed = measure("mode = \"rtk\"\nfixed = \"" + folder + "kf_gins_rtk/fixed.toml\"",
                            figure_of_eight(), 10.0, 1)[0];
  EXPECT_EQ(fixed.sigmas, (std::array<double, 4>{0.010, 0.019, 0.0, 0.0}));
}

TEST_F(Gnss, RefusesKeysThatContradictEachOther) {
  const auto refuse = [](const std::string& keys, const std::vector<std::string>& words) {
    expect_error(core::ErrorKind::Config, words, [&] { sensor_of("gnss", keys); });
  };
  refuse("single = { noise_horizontal_m = -0.1 }", {"noise_horizontal_m", "-0.1"});
  refuse("single = { noise_horizontal_m = nan }", {"noise_horizontal_m"});
  refuse("mode = \"dgps\"", {"mode", "single", "rtk"});
  refuse("fixed = { noise_horizontal_m = 0.01 }", {"rtk", "single"});
  refuse("mode = \"rtk\"\nsingle = { noise_horizontal_m = 1.0 }", {"fixed", "floating"});
  refuse("mode = \"rtk\"\nfixed_for_s = 60.0", {"fixed_for_s = 60", "floating_for_s = 0"});
  refuse("single = { sigma_m = 1.0 }", {"sigma_m"});
}

}  // namespace
}  // namespace terracast::test
