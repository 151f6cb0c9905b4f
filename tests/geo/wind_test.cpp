#include "geo/air/wind.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/toml_reader.h"
#include "tests/geo/trajectory_support.h"

namespace terracast::geo {
namespace {

using Eigen::Vector3d;

WindField::Place at_height(double agl_m) {
  return {.world_from_enu = Eigen::Matrix3d::Identity(), .agl_m = agl_m};
}

TEST(Wind, BlowsToWhereItDoesNotComeFrom) {
  const WindField field({.speed_mps = 6.0, .from_deg = 270.0, .profile = "even"}, 0.0, 10.0);
  EXPECT_LT((field.mean_mps(at_height(80.0)) - Vector3d(6.0, 0.0, 0.0)).norm(), 1e-14);
  const WindField northern({.speed_mps = 6.0, .from_deg = 30.0, .profile = "even"}, 0.0, 10.0);
  EXPECT_LT(
      (northern.mean_mps(at_height(80.0)) - Vector3d(-3.0, -3.0 * std::sqrt(3.0), 0.0)).norm(),
      1e-14);
  // Elsewhere on the Earth it is level there.
  const WorldFrame frame({42.5, 1.5, 1000.0});
  const Vector3d place(25000.0, -3000.0, 0.0);
  const Vector3d wind =
      field.mean_mps({.world_from_enu = frame.world_from_enu(place), .agl_m = 5.0});
  EXPECT_NEAR(wind.dot(frame.up_world(place)), 0.0, 1e-14);
}

TEST(Wind, GrowsWithTheLogarithmOfTheHeight) {
  const WindField field({.speed_mps = 7.0, .roughness_m = 0.04572}, 0.0, 10.0);
  const auto speed = [&](double feet) { return field.mean_mps(at_height(0.3048 * feet)).norm(); };
  EXPECT_NEAR(speed(20.0), 7.0, 1e-13);
  // 0.15 ft times (20 / 0.15)^2 is where it doubles.
  EXPECT_NEAR(speed(0.15 * std::pow(20.0 / 0.15, 1.5)), 10.5, 1e-12);
  EXPECT_EQ(speed(1000.0), speed(5000.0));
  EXPECT_EQ(speed(3.0), speed(-10.0));
}

// At 30 m with 15 knots at 20 ft, as a table of the standard's formulas has it.
TEST(Wind, TurbulenceIsAsLargeAndStrongAsTheStandardSays) {
  const double knots15_mps = 15.0 * 1852.0 / 3600.0;
  const TurbulenceScale low = turbulence_scale(TurbulenceModel::Dryden, 30.0, knots15_mps);
  EXPECT_NEAR(low.level_m, 152.0, 1.0);
  EXPECT_NEAR(low.vertical_m, 30.0, 1e-12);
  EXPECT_NEAR(low.vertical_mps, 0.77, 0.005);
  EXPECT_NEAR(low.level_mps, 1.33, 0.01);
  for (const auto& [model, high_ft] :
       {std::pair{TurbulenceModel::Dryden, 1750.0}, {TurbulenceModel::VonKarman, 2500.0}}) {
    const TurbulenceScale joint = turbulence_scale(model, 304.8, knots15_mps);
    EXPECT_NEAR(joint.level_m, 304.8, 1e-9);
    EXPECT_NEAR(joint.level_mps, joint.vertical_mps, 1e-12);
    const TurbulenceScale middle = turbulence_scale(model, 457.2, knots15_mps);
    EXPECT_NEAR(middle.vertical_m, 0.3048 * (1000.0 + high_ft) / 2.0, 1e-9);
    // At 1000 ft 0.177 + 0.823 is 1: the level length is the height there.
    EXPECT_NEAR(middle.level_m, 0.3048 * (1000.0 + high_ft) / 2.0, 1e-9);
    const TurbulenceScale high = turbulence_scale(model, 5000.0, knots15_mps);
    EXPECT_NEAR(high.level_m, 0.3048 * high_ft, 1e-9);
    EXPECT_NEAR(high.vertical_m, 0.3048 * high_ft, 1e-9);
  }
}

TEST(Wind, GustsGrowAsACosineAndStay) {
  WindOptions options{.speed_mps = 5.0, .from_deg = 180.0, .profile = "even"};
  options.gusts = {{.start_m = 50.0, .length_m = 20.0, .along_mps = 3.0, .left_mps = 1.0},
                   {.start_m = 100.0, .length_m = 10.0, .up_mps = -2.0}};
  const WindField field(options, 1000.0, 10.0);
  const auto at = [&](double distance_m) {
    return field.at(at_height(10.0), {.distance_m = distance_m});
  };
  EXPECT_LT((at(49.9) - Vector3d(0.0, 5.0, 0.0)).norm(), 1e-14);
  EXPECT_LT((at(60.0) - Vector3d(-0.5, 6.5, 0.0)).norm(), 1e-14);
  EXPECT_LT((at(55.0) - Vector3d(0.0, 5.0, 0.0) -
             Vector3d(-1.0, 3.0, 0.0) * 0.5 * (1.0 - std::cos(std::numbers::pi / 4.0)))
                .norm(),
            1e-14);
  EXPECT_LT((at(99.0) - Vector3d(-1.0, 8.0, 0.0)).norm(), 1e-14);
  EXPECT_LT((at(900.0) - Vector3d(-1.0, 8.0, -2.0)).norm(), 1e-14);
}

// The strengths at a height, over a long way: within four deviations of what so many lengths tell.
TEST(Wind, TurbulenceHasItsStrengthAtEachHeight) {
  for (const char* turbulence : {"dryden", "von_karman"}) {
    const double most_m = 100e3;
    const WindField field({.speed_mps = 0.0,
                           .from_deg = 270.0,
                           .turbulence = turbulence,
                           .turbulence_speed_mps = 8.0},
                          most_m, 50.0);
    const double agl_m = 60.0;
    const TurbulenceScale scale = turbulence_scale(TurbulenceModel::Dryden, agl_m, 8.0);
    const AirWay rate = field.way_rate(agl_m, 1.0);
    EXPECT_NEAR(rate.level_lengths * scale.level_m, 1.0, 1e-14);
    Vector3d squares = Vector3d::Zero();
    int count = 0;
    for (double way_m = 0.0; way_m < most_m; way_m += 3.0, ++count)
      squares += field
                     .at(at_height(agl_m), {.distance_m = way_m,
                                            .level_lengths = way_m * rate.level_lengths,
                                            .vertical_lengths = way_m * rate.vertical_lengths})
                     .cwiseAbs2();
    const double level_band = 4.0 * std::sqrt(4.0 * scale.level_m / most_m);
    const double vertical_band = 4.0 * std::sqrt(4.0 * scale.vertical_m / most_m);
    const double level = scale.level_mps * scale.level_mps;
    EXPECT_NEAR(squares.x() / count / level, 1.0, level_band) << turbulence;
    EXPECT_NEAR(squares.y() / count / level, 1.0, level_band) << turbulence;
    EXPECT_NEAR(squares.z() / count / std::pow(scale.vertical_mps, 2), 1.0, vertical_band);
    EXPECT_NE(test::message_of(core::ErrorKind::Input,
                               [&] { field.at(at_height(agl_m), {.level_lengths = 1e4}); })
                  .find("no turbulence is drawn"),
              std::string::npos);
  }
}

// The same air at two heights: level speeds go by the standard's 0.177 + 0.000823 h to the power of 0.4, with h of 196.85 and
// 656.17 ft; up and down it is as strong at both.
TEST(Wind, TheSameAirIsWeakerHigherUp) {
  const WindField field({.turbulence = "dryden", .turbulence_speed_mps = 8.0}, 1000.0, 50.0);
  const double ratio = std::pow(0.71703 / 0.33901, 0.4);
  for (const double lengths : {0.3, 1.7, 4.2}) {
    const AirWay way{.distance_m = 0.0, .level_lengths = lengths, .vertical_lengths = lengths};
    const Vector3d low = field.at(at_height(60.0), way), high = field.at(at_height(200.0), way);
    EXPECT_NEAR(low.x() / high.x(), ratio, 1e-4);
    EXPECT_NEAR(low.y() / high.y(), ratio, 1e-4);
    EXPECT_NEAR(low.z() / high.z(), 1.0, 1e-12);
  }
}

TEST(Wind, SaysWhatIsWrongWithItsOptions) {
  const auto message = [](const std::string& toml) {
    return test::message_of(core::ErrorKind::Config, [&] {
      WindOptions options;
      core::TomlDocument::parse(toml, "wind.toml").read(options);
    });
  };
  EXPECT_NE(message("speed_mps = 80.0").find("80 knots is 41.2 m/s, one of 80 km/h 22.2 m/s"),
            std::string::npos);
  EXPECT_NE(message("speed_mps = -3.0").find("speed_mps"), std::string::npos);
  EXPECT_NE(message("turbulence = \"dryden\"").find("has no strength"), std::string::npos);
  EXPECT_NE(message("turbulence_speed_mps = 8.0").find("without turbulence"), std::string::npos);
  EXPECT_NE(message("gusts = [{ start_m = 30.0 }]").find("a gust after 30 m has no speed"),
            std::string::npos);
  EXPECT_NE(message("turbulence = \"kolmogorov\"").find("dryden"), std::string::npos);
}

}  // namespace
}  // namespace terracast::geo
