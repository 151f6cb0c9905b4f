#include <gtest/gtest.h>

#include <map>

#include "core/atomic_file.h"
#include "core/json.h"
#include "core/log.h"
#include "tests/support/test_data.h"
#include "tests/validate/mutations/edits.h"
#include "validate/check.h"
#include "validate/dataset.h"
#include "validate/shutter.h"

/// Datasets of rolling shutters, from a flight in closed form: right ones pass, and ones that say otherwise how
/// their lines follow each other are found, and the mistake named with its size.
namespace terracast::validate {
namespace {

using test::Recording;

/// An image takes six tenths of the time to the next: the body goes on by 2.4 m and turns by 3 degrees meanwhile,
/// which is 5 px at the ends of its lines.
constexpr double kImage_s = 0.6;

const Recording& flight_of(const std::string& format) {
  static std::map<std::string, Recording> flights;
  const auto found = flights.find(format);
  if (found != flights.end()) return found->second;
  if (format == "kitti")
    return flights[format] = test::record_smooth_flight(
               test::with_shutters(test::kitti_cameras(), kImage_s / 128, "down"), 4);
  if (format == "colmap")
    return flights[format] = test::record_smooth_flight(
               test::with_shutters(test::colmap_cameras(), kImage_s / 160, "left"), 4);
  return flights[format] = test::record_smooth_flight(
             test::with_shutters(test::tartanair_v1_cameras(), kImage_s / 480, "up"), 2);
}

void write(const std::string& format, const std::filesystem::path& folder) {
  if (format == "kitti") test::write_kitti(flight_of(format), folder);
  if (format == "colmap") test::write_colmap(flight_of(format), folder);
  if (format == "tartanair_v1") test::write_tartanair_v1(flight_of(format), folder);
}

struct Report {
  std::map<std::string, CheckResult> results;
  std::string wrong;  ///< failed checks, a line each
  core::Json causes;

  std::string words() const {
    std::string text;
    for (std::size_t i = 0; i < causes.size(); ++i)
      text += causes.at(i).at("words").string() + "\n";
    return text;
  }
};

Report validate_folder(const std::filesystem::path& folder, const std::filesystem::path& report) {
  const core::Log log("validate", core::LogLevel::Off);
  ValidateOptions options;
  options.samples_per_image = 2000;
  Report found;
  for (CheckResult& result : run_validate_stage(folder, options, report, {log})) {
    if (!result.ok)
      found.wrong += fmt::format("{} = {:.4g} {} (bound {:.4g}): {}\n", result.name, result.value,
                                 result.unit, result.bound, result.worst);
    if (std::getenv("TERRACAST_SHOW_VALUES") != nullptr)
      fmt::print("{} {} = {:.4g} {} (bound {:.4g}): {}\n",
                 result.ok ? result.skipped ? "skip" : "ok  " : "BAD ", result.name, result.value,
                 result.unit, result.bound, result.worst);
    found.results[result.name] = std::move(result);
  }
  found.causes = core::Json::read(report / "report.json").at("causes");
  return found;
}

class RollingShutter : public testing::TestWithParam<const char*> {
 protected:
  /// A dataset whose dataset.json was changed, validated.
  Report with(const std::function<void(std::size_t c, core::Json& camera)>& change) {
    write(GetParam(), scratch_ / "data");
    test::edit_stated_cameras(scratch_ / "data", change);
    return validate_folder(scratch_ / "data", scratch_ / "report");
  }
  static core::Json shutter_of(const core::Json& camera, double factor, const char* readout) {
    const core::Json& shutter = camera.at("shutter");
    return core::Json::object()
        .set("exposure_s", 0.0)
        .set("line_time_s", factor * shutter.at("line_time_s").number())
        .set("readout", readout == nullptr ? shutter.at("readout").string() : readout);
  }
  const test::ScratchFolder scratch_;
};

TEST_P(RollingShutter, RightDatasetPassesEveryCheckAndTellsItsLineTime) {
  const Report report = with([](std::size_t, core::Json&) {});
  EXPECT_EQ(report.wrong, "");
  EXPECT_EQ(report.words(), "");
  ASSERT_TRUE(report.results.contains("reprojection_line_time"));
  EXPECT_FALSE(report.results.at("reprojection_line_time").skipped);
  EXPECT_FALSE(report.results.at("reprojection").skipped);
  EXPECT_FALSE(report.results.at("photometric_shift").skipped);
  if (GetParam() == std::string("tartanair_v1")) {
    EXPECT_FALSE(report.results.at("flow").skipped);
    EXPECT_FALSE(report.results.at("flow_line_time").skipped);
  }
  for (const auto& [format, name] :
       {std::pair("kitti", "stereo_shift"), std::pair("colmap", "colmap_errors")})
    if (GetParam() == std::string(format)) {
      EXPECT_FALSE(report.results.at(name).skipped);
    }
}

TEST_P(RollingShutter, ThatIsNotStatedIsFoundAndNamed) {
  const Report report = with([](std::size_t, core::Json& camera) {
    core::Json bare = core::Json::object();
    for (const auto& [name, value] : camera.members())
      if (name != "shutter") bare.set(name, value);
    camera = bare;
  });
  EXPECT_NE(report.wrong, "");
  const test::SceneCamera& camera = flight_of(GetParam()).cameras[0];
  const std::string words = report.words();
  EXPECT_NE(words.find("states no shutter, where lines are read " + camera.readout),
            std::string::npos)
      << words << report.wrong;
  ASSERT_GE(report.causes.size(), 1u);
  EXPECT_NEAR(report.causes.at(0).at("size").number(), 1e6 * camera.line_time_s,
              0.005 * 1e6 * camera.line_time_s)
      << words;
}

TEST_P(RollingShutter, WithLinesATenthTooSlowIsFoundAndNamed) {
  const Report report = with([](std::size_t, core::Json& camera) {
    camera.set("shutter", shutter_of(camera, 1.1, nullptr));
  });
  EXPECT_NE(report.wrong.find("line_time"), std::string::npos) << report.wrong;
  const std::string words = report.words();
  EXPECT_NE(words.find("line_time_s of dataset.json is"), std::string::npos)
      << words << report.wrong;
  ASSERT_GE(report.causes.size(), 1u);
  EXPECT_NEAR(report.causes.at(0).at("size").number(), 10.0, 0.5) << words;
}

TEST_P(RollingShutter, ReadTheOtherWayRoundIsFoundAndNamed) {
  const std::string right = flight_of(GetParam()).cameras[0].readout;
  const std::map<std::string, const char*> opposite = {
      {"down", "up"}, {"up", "down"}, {"left", "right"}};
  const Report report = with([&](std::size_t, core::Json& camera) {
    camera.set("shutter", shutter_of(camera, 1.0, opposite.at(right)));
  });
  EXPECT_NE(report.wrong.find("reprojection"), std::string::npos) << report.wrong;
  EXPECT_NE(report.words().find("lines are read " + right + ", where dataset.json says"),
            std::string::npos)
      << report.words() << report.wrong;
}

TEST_P(RollingShutter, WithoutMotionIsDamaged) {
  write(GetParam(), scratch_ / "data");
  test::edit_stated(scratch_ / "data", [](core::Json& sequence) {
    core::Json bare = core::Json::object();
    for (const auto& [name, value] : sequence.members())
      if (name != "motion") bare.set(name, value);
    sequence = bare;
  });
  const Report report = validate_folder(scratch_ / "data", scratch_ / "report");
  EXPECT_NE(report.wrong.find("has rolling shutters, but no \"motion\""), std::string::npos)
      << report.wrong;
}

TEST(RollingShutterOfOneCamera, IsNamedWithIt) {
  const test::ScratchFolder scratch;
  write("colmap", scratch / "data");
  test::edit_stated_cameras(scratch / "data", [](std::size_t c, core::Json& camera) {
    const double right_s = camera.at("shutter").at("line_time_s").number();
    if (c == 1)
      camera.set("shutter", core::Json::object()
                                .set("exposure_s", 0.0)
                                .set("line_time_s", 0.9 * right_s)
                                .set("readout", "left"));
  });
  const Report report = validate_folder(scratch / "data", scratch / "report");
  EXPECT_NE(report.words().find("rig/cam1: line_time_s of dataset.json is -10 % off"),
            std::string::npos)
      << report.words() << report.wrong;
}

// Less than images show: a way of a hundredth of a pixel.
TEST(RollingShutterMotion, IsHeldAgainstThePosesOfTheBody) {
  struct Case {
    std::size_t column;
    double factor, added;
    const char* check;
  };
  for (const Case& one :
       {Case{0, 1.0, 0.0, ""}, Case{1, 1.002, 0.0, "motion_velocity"},
        Case{5, 1.0, 0.15, "motion_acceleration"}, Case{9, 1.0, 0.002, "motion_turn_rate"}}) {
    SCOPED_TRACE(one.check);
    const test::ScratchFolder scratch;
    write("kitti", scratch / "data");
    const std::filesystem::path file = scratch / "data/dataset/sequences/00/motion.csv";
    std::vector<std::string> lines = test::lines_of(file);
    for (std::size_t i = 1; i < lines.size(); ++i) {
      std::vector<double> numbers = test::numbers_of(lines[i], ',');
      numbers[one.column] = one.factor * numbers[one.column] + one.added;
      lines[i] = fmt::format("{}", fmt::join(numbers, ","));
    }
    test::write_lines(file, lines);
    test::list_files_again(scratch / "data");
    const Report report = validate_folder(scratch / "data", scratch / "report");
    for (const char* name : {"motion_velocity", "motion_acceleration", "motion_turn_rate"}) {
      EXPECT_FALSE(report.results.at(name).skipped) << name;
      EXPECT_EQ(report.results.at(name).ok, std::string(name) != one.check) << report.wrong;
    }
  }
}

TEST(RollingShutterWords, ThatAreDamagedAreFindings) {
  struct Case {
    const char* file;
    std::string from, to, finding;
  };
  const std::string motion = "dataset/sequences/00/motion.csv";
  for (const Case& one : std::vector<Case>{
           {"dataset.json", "\"readout\": \"down\"", "\"readout\": \"sideways\"",
            "readout = \"sideways\""},
           {"dataset.json", "\"line_time_s\": 0.0046", "\"line_time_s\": -0.0046",
            "line_time_s = -"},
           {"dataset.json", "\"line_time_s\": 0.0046", "\"line_time_s\": 1e300, \"was\": 0.0046",
            "line_time_s = 1e+300"},
           {motion.c_str(), "frame,vx_mps", "frame,v_mps", "another header than frame,vx_mps"},
           {motion.c_str(), "\n1,", "\n1,nan", "motion.csv:3"},
           {motion.c_str(), "\n1,", "\n2,", "frame 2 stands twice"},
           {motion.c_str(), "\n1,", "\n99,", "frame 99 is not in the dataset"},
           {motion.c_str(), "\n1,", "\n1,0,", "11 columns, not 10"}}) {
    SCOPED_TRACE(one.to);
    const test::ScratchFolder scratch;
    write("kitti", scratch / "data");
    std::string text = core::read_text_file(scratch / "data" / one.file);
    const auto at = text.find(one.from);
    ASSERT_NE(at, std::string::npos) << text.substr(0, 400);
    core::write_file(scratch / "data" / one.file,
                     std::string_view(text.replace(at, one.from.size(), one.to)));
    Findings findings;
    read_dataset(scratch / "data", "", findings);
    const std::string lines = fmt::format("{}", fmt::join(findings.lines(), "\n"));
    EXPECT_NE(lines.find(one.finding), std::string::npos) << lines;
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, RollingShutter,
                         testing::Values("colmap", "kitti", "tartanair_v1"),
                         [](const auto& one) { return std::string(one.param); });

// A point that stands still in the world, before a camera that turns and slides: the line that sees it is the root
// of a function that is sampled here, a step of a ten-thousandth of a line at a time.
TEST(LineSight, IsWhereThePointMeetsItsLine) {
  const Intrinsics camera{640, 480, 320.0, 320.0, 320.0, 240.0};
  LineMotion motion;
  motion.body = {{3.0, 12.0, -1.0}, {0.5, -2.0, 0.3}, {0.2, -0.4, 1.5}};
  motion.body_from_camera.rotation << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  motion.body_from_camera.translation = {0.4, -0.1, 0.2};
  for (const Readout readout : {Readout::Down, Readout::Up, Readout::Right, Readout::Left}) {
    motion.shutter = {6e-5, readout};
    for (const Eigen::Vector3d& point :
         {Eigen::Vector3d(2.0, -3.0, 20.0), Eigen::Vector3d(-15.0, 11.0, 25.0),
          Eigen::Vector3d(0.0, 0.0, 5.0), Eigen::Vector3d(18.0, 9.0, 22.0)}) {
      const auto point_at = [&](double offset_s) {
        return Eigen::Vector3d(motion.start_from_camera(offset_s).inverse() * point);
      };
      const auto found = find_line(motion.shutter, camera, point_at);
      ASSERT_TRUE(found);
      double nearest_s = 1e9, at_s = 0.0;
      const double around_s = found->offset_s;
      for (int i = -20000; i <= 20000; ++i) {
        const double t = around_s + i * 1e-4 * motion.shutter.line_time_s;
        const double miss_s =
            std::abs(motion.shutter.offset_s(camera.pixel_from_point(point_at(t)), camera) - t);
        if (miss_s < nearest_s) {
          nearest_s = miss_s;
          at_s = t;
        }
      }
      EXPECT_NEAR(found->offset_s, at_s, 1e-4 * motion.shutter.line_time_s);
      EXPECT_LE(std::abs(motion.shutter.offset_s(found->pixel, camera) - found->offset_s),
                1e-9 * motion.shutter.line_time_s);
    }
  }
}

// The body's way over time by small steps of its own equations of motion.
TEST(BodyMotion, IsWhatItsDerivativesAddUpTo) {
  const BodyMotion motion{{3.0, 12.0, -1.0}, {0.5, -2.0, 0.3}, {0.2, -0.4, 1.5}};
  const LineMotion of_camera{
      {1e-4, Readout::Down}, motion, {Eigen::Matrix3d::Identity(), {0.4, -0.1, 0.2}}};
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d place = Eigen::Vector3d::Zero(), velocity = motion.velocity_mps;
  constexpr int kSteps = 20000;
  constexpr double kStep_s = 0.7 / kSteps;
  Eigen::Matrix3d cross;
  const Eigen::Vector3d& w = motion.turn_radps;
  cross << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
  for (int i = 0; i < kSteps; ++i) {  // midpoint rule
    place += kStep_s * (velocity + 0.5 * kStep_s * motion.acceleration_mps2);
    velocity += kStep_s * motion.acceleration_mps2;
    rotation += kStep_s * (rotation + 0.5 * kStep_s * rotation * cross) * cross;
  }
  const Pose found = motion.start_from_body(0.7);
  EXPECT_NEAR((found.translation - place).norm(), 0.0, 1e-9);
  // The rule's error: a sixth of (w dt)^3 a step.
  EXPECT_NEAR((found.rotation - rotation).norm(), 0.0, 1e-8);
  const double h = 1e-5;
  const Eigen::Vector3d moved = (of_camera.start_from_camera(0.3 + h).translation -
                                 of_camera.start_from_camera(0.3 - h).translation) /
                                (2.0 * h);
  EXPECT_NEAR(
      (of_camera.start_from_camera(0.3).rotation * of_camera.velocity_mps(0.3) - moved).norm(), 0.0,
      1e-7);
}

// The same of a motion with terms and a spin, on both sides of its reach.
TEST(BodyMotion, TermsAndSpinsAddUpToo) {
  BodyMotion motion{{3.0, 12.0, -1.0}, {0.5, -2.0, 0.3}, {0.2, -0.4, 21.5}};
  motion.p << 4.0, -20.0, 100.0, 6.0, 30.0, -200.0, -5.0, 10.0, 50.0;
  motion.r << 5.0, 20.0, -100.0, 300.0, -4.0, 15.0, 80.0, -400.0, 3.0, -10.0, 60.0, 200.0;
  motion.spin_radps = {0.0, 0.0, 20.0};
  motion.reach_s = 0.1;
  const LineMotion of_camera{
      {1e-4, Readout::Down}, motion, {Eigen::Matrix3d::Identity(), {0.4, -0.1, 0.2}}};
  for (const double at_s : {-0.15, -0.07, 0.03, 0.09, 0.13}) {
    // Written out, by AngleAxis.
    const double t = std::clamp(at_s, -0.1, 0.1), beyond_s = at_s - t;
    Eigen::Vector3d place =
        at_s * motion.velocity_mps + 0.5 * at_s * at_s * motion.acceleration_mps2;
    Eigen::Vector3d turn = at_s * (motion.turn_radps - motion.spin_radps);
    for (int k = 0; k < 3; ++k)
      place += (std::pow(t, k + 3) + beyond_s * (k + 3) * std::pow(t, k + 2)) * motion.p.col(k);
    for (int k = 0; k < 4; ++k)
      turn += (std::pow(t, k + 2) + beyond_s * (k + 2) * std::pow(t, k + 1)) * motion.r.col(k);
    const Eigen::Matrix3d rotation = (Eigen::AngleAxisd(turn.norm(), turn.normalized()) *
                                      Eigen::AngleAxisd(20.0 * at_s, Eigen::Vector3d::UnitZ()))
                                         .toRotationMatrix();
    const Pose found = motion.start_from_body(at_s);
    EXPECT_LT((found.translation - place).norm(), 1e-13);
    EXPECT_LT((found.rotation - rotation).norm(), 1e-13);
    EXPECT_LT((motion.place_m(at_s) - place).norm(), 1e-13);
    const Eigen::Vector3d ahead(0.3, -2.0, 5.0);
    EXPECT_LT((motion.direction_at(at_s, ahead) - rotation.transpose() * ahead).norm(), 1e-13);
    // Derivatives against central differences.
    const double h = 1e-6;
    const Pose before = motion.start_from_body(at_s - h), after = motion.start_from_body(at_s + h);
    EXPECT_LT(((after.translation - before.translation) / (2.0 * h) - motion.velocity_mps_at(at_s))
                  .norm(),
              1e-7);
    const Eigen::Matrix3d skew =
        found.rotation.transpose() * (after.rotation - before.rotation) / (2.0 * h);
    EXPECT_LT(
        (Eigen::Vector3d(skew(2, 1), skew(0, 2), skew(1, 0)) - motion.turn_radps_at(at_s)).norm(),
        1e-7);
    const Eigen::Vector3d moved = (of_camera.start_from_camera(at_s + h).translation -
                                   of_camera.start_from_camera(at_s - h).translation) /
                                  (2.0 * h);
    EXPECT_LT(
        (of_camera.start_from_camera(at_s).rotation * of_camera.velocity_mps(at_s) - moved).norm(),
        1e-7);
  }
}

}  // namespace
}  // namespace terracast::validate
