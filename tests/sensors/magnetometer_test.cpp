// Fields against the model's sums in another program, and what iron and errors make of them.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/expect_error.h"
#include "tests/support/sensor_flight.h"

namespace terracast::test {
namespace {

using Eigen::Vector3d;

struct Field {
  Vector3d shown, truth;
};

class Magnetometer : public testing::Test {
 protected:
  std::vector<Field> measure(const std::string& keys, std::shared_ptr<const geo::Trajectory> motion,
                             double rate_hz, std::size_t count,
                             const geo::Rigid3d& body_from_sensor = {}) const {
    const std::vector<double> values =
        flight_.measure("magnetometer", keys, std::move(motion), rate_hz, count, body_from_sensor);
    EXPECT_EQ(values.size(), 6 * count);
    std::vector<Field> fields;
    for (std::size_t k = 0; k < count; ++k)
      fields.push_back({Vector3d(&values[6 * k]), Vector3d(&values[6 * k + 3])});
    return fields;
  }

 private:
  SensorFlight flight_;
};

/// North, east and down at 46 N 8 E, 400 m above the ellipsoid, on 2025-06-21 at 10:00: the sums of the model's report
/// with Schmidt's functions by recursion, in a program of a page that shares nothing with ours.
const Vector3d kNorthEastDown_nt(22326.474560, 1291.746732, 42335.726007);

std::shared_ptr<WavyMotion> over_the_origin(double yaw) {
  auto motion = std::make_shared<WavyMotion>();
  motion->place[2].middle = 400.0;
  motion->yaw.middle = yaw;
  return motion;
}

TEST_F(Magnetometer, ShowsTheFieldOfPlaceAndDateAlongItsAxes) {
  const double n = kNorthEastDown_nt.x(), e = kNorthEastDown_nt.y(), d = kNorthEastDown_nt.z();
  const double quarter = 0.5 * std::numbers::pi;
  // x forward, y left, z up: to the east, and to the north.
  EXPECT_LT((measure("", over_the_origin(0.0), 1.0, 1)[0].truth - Vector3d(e, n, -d)).norm(), 1e-4);
  const std::vector<Field> north = measure("", over_the_origin(quarter), 1.0, 1);
  EXPECT_LT((north[0].truth - Vector3d(n, -e, -d)).norm(), 1e-4);
  EXPECT_EQ(north[0].shown, north[0].truth);
  // Upside down on its mount, and turned to the right.
  const geo::Rigid3d mount{
      .rotation = Eigen::Quaterniond(Eigen::AngleAxisd(2.0 * quarter, Vector3d::UnitX())),
      .translation = {0.2, 0.0, 0.0}};
  EXPECT_LT(
      (measure("", over_the_origin(quarter), 1.0, 1, mount)[0].truth - Vector3d(n, e, d)).norm(),
      1e-2);
}

TEST_F(Magnetometer, TurnsAgainstTheBody) {
  const auto motion = figure_of_eight();
  const std::vector<Field> fields = measure("", motion, 5.0, 100);
  for (std::size_t k = 0; k < fields.size(); ++k) {
    const Vector3d world =
        motion->at(static_cast<double>(k) / 5.0).world_from_body.rotation * fields[k].truth;
    // Over some hundred metres the field changes by less than 10 nT.
    EXPECT_LT(
        (world - Vector3d(kNorthEastDown_nt.y(), kNorthEastDown_nt.x(), -kNorthEastDown_nt.z()))
            .norm(),
        10.0);
  }
}

TEST_F(Magnetometer, IronBendsTheField) {
  for (const Field& field : measure(R"(
hard_iron_nt = [1000.0, -2500.0, 300.0]
soft_iron = [1.1, 0.02, 0.0, 0.01, 0.95, -0.03, 0.0, 0.04, 1.02]
)",
                                    figure_of_eight(), 5.0, 50)) {
    const Vector3d& b = field.truth;
    const Vector3d expected(1.1 * b.x() + 0.02 * b.y() + 1000.0,
                            0.01 * b.x() + 0.95 * b.y() - 0.03 * b.z() - 2500.0,
                            0.04 * b.y() + 1.02 * b.z() + 300.0);
    EXPECT_LT((field.shown - expected).norm(), 1e-9);
  }
}

TEST_F(Magnetometer, ErrorsAreThoseOfAnInstrument) {
  constexpr std::size_t kCount = 20000;
  double squares = 0.0;
  for (const Field& field :
       measure("errors = { noise_nt_per_sqrt_hz = 10.0 }", over_the_origin(0.0), 25.0, kCount))
    squares += (field.shown - field.truth).squaredNorm();
  EXPECT_NEAR(squares / (3.0 * kCount * 2500.0), 1.0, 4.0 * std::sqrt(2.0 / (3.0 * kCount)));
  for (const Field& field :
       measure("errors = { step_nt = 150.0, range_nt = 30000.0 }", figure_of_eight(), 5.0, 50))
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(field.shown[axis], std::clamp(field.truth[axis], -30000.0, 30000.0), 75.0 + 1e-9);
      EXPECT_EQ(field.shown[axis] / 150.0, std::round(field.shown[axis] / 150.0));
    }
}

TEST_F(Magnetometer, ShippedSetsAreRead) {
  for (const char* set : {"gnss_ins_sim_low", "gnss_ins_sim_high"}) {
    const Field field = measure("errors = \"" TERRACAST_SOURCE_DIR "/configs/sensors/" +
                                    std::string(set) + "/magnetometer.toml\"",
                                figure_of_eight(), 100.0, 1)[0];
    EXPECT_NE(field.shown, field.truth);
  }
}

TEST_F(Magnetometer, RefusesWhatIsNoIronAndNoDate) {
  const auto refuse = [](const std::string& keys, const std::vector<std::string>& words) {
    expect_error(core::ErrorKind::Config, words, [&] { sensor_of("magnetometer", keys); });
  };
  refuse("hard_iron_nt = [1.0, 2.0]", {"hard_iron_nt", "3"});
  refuse("soft_iron = [1, 0, 0, 0, 1, 0, 0, 0, -1]", {"soft_iron", "determinant", "-1"});
  refuse("soft_iron = [1.0, 0.0, 0.0]", {"soft_iron", "9"});
  refuse("errors = { noise_nt_per_sqrt_hz = -1.0 }", {"noise_nt_per_sqrt_hz"});
  const auto sensor = sensor_of("magnetometer", "");
  constexpr double kIn2030 = 1893456000.0;
  EXPECT_NO_THROW(sensor->check_times(kIn2030 - 20.0, kIn2030 - 1.0));
  expect_error(core::ErrorKind::Config, {"2015", "2030", "utc_start"},
               [&] { sensor->check_times(kIn2030 - 20.0, kIn2030 + 1.0); });
}

}  // namespace
}  // namespace terracast::test
