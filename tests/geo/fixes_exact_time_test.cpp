// Times that count from far zeros: what a file writes in decimals is not rounded to the doubles of its clock.

#include <cmath>
#include <numbers>

#include "geo/fixes/exact_time.h"
#include "geo/fixes/times.h"
#include "tests/geo/fixes_support.h"

namespace terracast::geo {
namespace {

TEST(ExactTimes, AreThoseOfTheirDecimals) {
  struct Case {
    const char* text;
    int exponent;
    double whole_s, rest_s;
  };
  for (const Case& one :
       {Case{"1700000000.005", 0, 1700000000.0, 0.005},
        Case{"1700000000005000001", -9, 1700000000.0, 0.005000001},
        Case{"1.700000000005e9", 0, 1700000000.0, 0.005}, Case{"-1.5", 0, -1.0, -0.5},
        Case{"1,25", 0, 1.0, 0.25}, Case{"+5", -3, 0.0, 0.005}, Case{"25e-1", 0, 2.0, 0.5},
        Case{"0.5", -9, 0.0, 5e-10}, Case{" 12 ", 0, 12.0, 0.0}, Case{"3E3", -3, 3.0, 0.0},
        Case{"000000000000000007", -3, 0.0, 0.007}}) {
    const auto time = exact_time_of(one.text, one.exponent);
    ASSERT_TRUE(time) << one.text;
    EXPECT_EQ(time->whole_s, one.whole_s) << one.text;
    EXPECT_DOUBLE_EQ(time->rest_s, one.rest_s) << one.text;
  }
  for (const char* wrong : {"", ".", "-", "1e400", "1e-400", "1e99999999999", "nan", "12:30",
                            "1.2.3", "0x10", "99999999999999999"})
    EXPECT_FALSE(exact_time_of(wrong, 0)) << wrong;
}

TEST(ExactTimes, OfDatesKeepTheirFraction) {
  const auto time = stated_time("2023-11-14T22:13:20.005000001+05:30", 0.0);
  ASSERT_TRUE(time);
  EXPECT_EQ(time->exact.whole_s, 1700000000.0 - 19800.0);  // date -u -d @1700000000
  EXPECT_DOUBLE_EQ(time->exact.rest_s, 0.005000001);
}

/// East at 20 m/s, weaving by 5 m in 4 s: 200 fixes a second from a time of 2023.
class FarTimes : public test::Recordings {
 protected:
  static constexpr int kRate_hz = 200, kSeconds = 6;
  static constexpr double kTurn_radps = 0.5 * std::numbers::pi, kWidth_m = 5.0;

  /// Of rows as a function of a row's number and its x and y.
  template <class Row>
  static std::string rows(Row&& row) {
    std::string text;
    for (int i = 0; i <= kRate_hz * kSeconds; ++i) {
      const double time_s = static_cast<double>(i) / kRate_hz;
      text += row(i, 20.0 * time_s, kWidth_m * std::sin(kTurn_radps * time_s));
    }
    return text;
  }
  /// The largest difference to the path's true acceleration, but for half a second at its ends, where a spline through
  /// samples knows less.
  double worst_mps2(const std::string& keys, const std::string& text, double utc_unix_s) {
    const auto motion =
        test::trajectory_from(fmt::format("kind = \"recorded\"\nfile = \"{}\"\norigin = {{ lat_deg "
                                          "= 42.5, lon_deg = 1.5, height_m = 1000.0 "
                                          "}}\nattitude = \"path\"\nsigma_m = 0.0\n{}",
                                          written("far.txt", text).string(), keys),
                              test::GroundWorld());
    EXPECT_NEAR(motion->duration_s(), kSeconds, 1e-9);
    EXPECT_EQ(motion->utc_start_unix_s().value_or(0.0), utc_unix_s);
    double worst = 0.0;
    for (double time_s = 0.5; time_s < kSeconds - 0.5; time_s += 0.0137) {
      const Eigen::Vector3d truth(
          0.0, -kWidth_m * kTurn_radps * kTurn_radps * std::sin(kTurn_radps * time_s), 0.0);
      worst = std::max(worst, (motion->at(time_s).acceleration_world_mps2 - truth).norm());
    }
    return worst;
  }

  /// A cubic spline's second derivative is off by up to h^2/8 of the fourth between knots: 9.5e-5 m/s^2 here. Times
  /// rounded to 2.4e-7 s would give 0.2 m/s^2.
  static constexpr double kMost_mps2 = 1.5e-4;
};

TEST_F(FarTimes, OfTablesAccelerateAsThePath) {
  const std::string keys =
      "format = \"csv\"\nframe = \"local\"\nplace_columns = [\"x\", \"y\", \"z\"]\ntime_column = "
      "\"t\"\n";
  const auto table = [&](auto&& time) {
    return "t,x,y,z\n" + rows([&](int i, double x, double y) {
             return fmt::format("{},{:.12f},{:.12f},0\n", time(i), x, y);
           });
  };
  const auto seconds = [](int i) {
    return fmt::format("{}.{:03}", 1700000000 + i / kRate_hz, i % kRate_hz * 5);
  };
  const auto nanoseconds = [](int i) {
    return fmt::format("{}", 1700000000000000000 + i * 5000000LL);
  };
  const auto dates = [](int i) {
    return fmt::format("2023-11-14T22:13:{}.{:03}Z", 20 + i / kRate_hz, i % kRate_hz * 5);
  };
  EXPECT_LT(worst_mps2(keys + "time_unit = \"unix_s\"\n", table(seconds), 1.7e9), kMost_mps2);
  EXPECT_LT(worst_mps2(keys + "time_unit = \"unix_ns\"\n", table(nanoseconds), 1.7e9), kMost_mps2);
  EXPECT_LT(worst_mps2(keys + "time_unit = \"text\"\n", table(dates), 1.7e9), kMost_mps2);
  EXPECT_LT(worst_mps2(keys + "time_unit = \"s\"\n", table(seconds), 0.0), kMost_mps2);
  EXPECT_LT(worst_mps2(keys + "time_unit = \"ns\"\n", table(nanoseconds), 0.0), kMost_mps2);
}

TEST_F(FarTimes, OfTumAccelerateAsThePath) {
  const std::string poses = rows([](int i, double x, double y) {
    return fmt::format("{}.{:03} {:.12f} {:.12f} 0 0 0 0 1\n", 1700000000 + i / kRate_hz,
                       i % kRate_hz * 5, x, y);
  });
  EXPECT_LT(worst_mps2("format = \"tum\"\nunix_times = true\n", poses, 1.7e9), kMost_mps2);
  EXPECT_LT(worst_mps2("format = \"tum\"\n", poses, 0.0), kMost_mps2);
}

}  // namespace
}  // namespace terracast::geo
