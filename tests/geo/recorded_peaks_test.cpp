// What the log says of a recording's smooth motion: how hard it accelerates and turns, and how densely it was recorded.

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <random>

#include "tests/geo/trajectory_support.h"
#include "tests/support/test_data.h"

namespace terracast::geo {
namespace {

class RecordedPeaks : public testing::Test {
 protected:
  /// East at 20 m/s, weaving by 5 m in 10 s, with noise; five fixes a second.
  std::filesystem::path weaving(double sigma_m) {
    const std::filesystem::path file = scratch_ / "fixes.csv";
    std::ofstream csv(file);
    csv << "time_s,x,y,z\n";
    std::mt19937 random(7);
    std::normal_distribution<double> noise(0.0, 1.0);
    for (int i = 0; i <= 300; ++i) {
      const double time_s = 0.2 * i;
      csv << fmt::format("{:.3f},{:.6f},{:.6f},{:.6f}\n", time_s,
                         20.0 * time_s + sigma_m * noise(random),
                         5.0 * std::sin(0.2 * std::numbers::pi * time_s) + sigma_m * noise(random),
                         sigma_m * noise(random));
    }
    return file;
  }
  std::string told(const std::string& keys, double noise_m) {
    const core::Log log("test");
    TrajectoryContext context = world_.context();
    context.log = &log;
    const TrajectoryOptions options = test::options_from(
        fmt::format("kind = \"recorded\"\nfile = \"{}\"\nformat = \"csv\"\nframe = \"local\"\n"
                    "place_columns = [\"x\", \"y\", \"z\"]\norigin = {{ lat_deg = 42.5, lon_deg = "
                    "1.5, height_m = 100.0 }}\n{}",
                    weaving(noise_m).string(), keys));
    testing::internal::CaptureStderr();
    sample_frames(options, context);
    return testing::internal::GetCapturedStderr();
  }
  /// The number behind some words.
  static double number_after(const std::string& text, const std::string& words) {
    const std::size_t at = text.find(words);
    if (at == std::string::npos) {
      ADD_FAILURE() << words << " is not in " << text;
      return std::nan("");
    }
    return std::stod(text.substr(at + words.size()));
  }

  test::GroundWorld world_;
  test::ScratchFolder scratch_;
};

TEST_F(RecordedPeaks, AreThoseOfTheMotion) {
  const std::string text = told("", 0.0);
  EXPECT_NE(text.find("5 fixes a second; the smooth motion"), std::string::npos) << text;
  // 5 m (0.2 pi / s)^2; of a cubic spline through five fixes a second it is the second derivative to 1 %.
  const double most_mps2 = 5.0 * std::pow(0.2 * std::numbers::pi, 2.0);
  EXPECT_NEAR(number_after(text, "accelerates by up to "), most_mps2, 0.01 * most_mps2) << text;
}

TEST_F(RecordedPeaks, ShowNoiseThatIsNotSmoothedAway) {
  constexpr double kNoise_m = 0.3;
  EXPECT_GT(number_after(told("", kNoise_m), "accelerates by up to "), 30.0);
  EXPECT_LT(number_after(told("sigma_m = 0.3\n", kNoise_m), "accelerates by up to "), 4.0);
}

}  // namespace
}  // namespace terracast::geo
