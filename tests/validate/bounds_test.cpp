#include <gtest/gtest.h>

#include <limits>
#include <map>

#include "core/atomic_file.h"
#include "core/json.h"
#include "core/log.h"
#include "tests/support/test_data.h"
#include "tests/validate/analytic_dataset.h"
#include "validate/check.h"

/// The check of bounds.csv, on a dataset of two cameras and three frames with depths of 90 to 900 m; the right
/// camera's are not in it.
namespace terracast::validate {
namespace {

namespace fs = std::filesystem;

constexpr const char* kHeader =
    "frame,camera,depth_error_mm,depth_rounding_mm,flow_error_px,flow_rounding_px,left_out,"
    "pixels\n";
constexpr int kFrames = 3;
const std::string kTable = "dataset/sequences/00/bounds.csv";

const std::string kRight = "1e-8,0.03,1e-12,2e-6,1,20480";

/// A table that says the same of every image.
std::string table(const std::string& cells) {
  std::string text = kHeader;
  for (int frame = 0; frame < kFrames; ++frame)
    for (const char* camera : {"image_2", "image_3"})
      text += fmt::format("{},{},{}\n", frame, camera, cells);
  return text;
}

/// A right table but for the left image of frame 1.
std::string table_but_one(const std::string& cells) {
  std::string text = table(kRight);
  const std::string row = "1,image_2,";
  return text.replace(text.find(row), row.size() + kRight.size(), row + cells);
}

/// Puts the table into a dataset whose list of sequences has but one.
void add_table(const fs::path& folder, const std::string& path, const std::string& text) {
  core::write_file(folder / path, text);
  std::string json = core::read_text_file(folder / "dataset.json");
  const std::string member = "\"georeference\":";
  const std::size_t at = json.find(member);
  EXPECT_NE(at, std::string::npos);
  core::write_file(folder / "dataset.json",
                   json.insert(at, fmt::format("\"bounds\": \"{}\", ", path)));
  test::list_files_again(folder);
}

std::map<std::string, CheckResult> validate_folder(const fs::path& folder, const fs::path& report) {
  const core::Log log("validate", core::LogLevel::Off);
  ValidateOptions options;
  options.samples_per_image = 100;
  std::map<std::string, CheckResult> results;
  for (const CheckResult& result : run_validate_stage(folder, options, report, {log}))
    results[result.name] = result;
  return results;
}

class ValidateBounds : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    flight_ =
        std::make_unique<test::Recording>(test::record_flight(test::kitti_cameras(), kFrames));
  }
  static void TearDownTestSuite() { flight_.reset(); }

  /// Results by name, of a dataset with this table; without one it says nothing of bounds.
  static std::map<std::string, CheckResult> validate(const std::string& text) {
    return validate(*flight_, text);
  }
  static std::map<std::string, CheckResult> validate(const test::Recording& flight,
                                                     const std::string& text) {
    const test::ScratchFolder scratch;
    test::write_kitti(flight, scratch / "kitti");
    if (!text.empty()) add_table(scratch / "kitti", kTable, text);
    return validate_folder(scratch / "kitti", scratch / "report");
  }

  static std::unique_ptr<test::Recording> flight_;
};

std::unique_ptr<test::Recording> ValidateBounds::flight_;

const std::vector<std::string> kNames = {"bounds_depth", "bounds_arithmetic", "bounds_rounding",
                                         "bounds_flow", "bounds_left_out"};

TEST_F(ValidateBounds, ThoseOfFloatsAreRight) {
  const auto results = validate(table(kRight));
  for (const std::string& name : kNames) {
    EXPECT_TRUE(results.at(name).ok) << name << " " << results.at(name).value;
    EXPECT_FALSE(results.at(name).skipped) << name;
  }
  EXPECT_NEAR(results.at("bounds_left_out").value, 1.0 / 20480.0, 1e-12);
  EXPECT_TRUE(results.at("structure").ok) << results.at("structure").worst;
}

TEST_F(ValidateBounds, EachFigureThatCannotBeIsFound) {
  const auto fails = [&](const std::string& cells, const std::string& name) {
    const auto results = validate(table_but_one(cells));
    for (const std::string& other : kNames)
      EXPECT_EQ(results.at(other).ok, other != name)
          << cells << ": " << other << " = " << results.at(other).value;
  };
  // In metres where millimetres should be: a float keeps 100 m no better than to 4e-3 mm, and a double than
  // to 7e-12 mm.
  fails("1e-8,0.00003,1e-12,2e-6,1,20480", "bounds_rounding");
  fails("1e-11,0.03,1e-12,2e-6,1,20480", "bounds_arithmetic");
  fails("1e-8,0,1e-12,2e-6,1,20480", "bounds_rounding");
  fails("0,0.03,1e-12,2e-6,1,20480", "bounds_arithmetic");
  fails("1e-8,0.03,0,2e-6,1,20480", "bounds_arithmetic");
  fails("1e-8,0.03,1e-12,0,1,20480", "bounds_rounding");
  fails("1.0,0.03,1e-12,2e-6,1,20480", "bounds_depth");
  fails("1e-8,0.03,0.02,2e-6,1,20480", "bounds_flow");
  fails("1e-8,0.03,1e-12,2e-6,2050,20480", "bounds_left_out");
  // Nothing is said of the depths and the flow that are there.
  fails(",,1e-12,2e-6,1,20480", "bounds_depth");
  fails(",0.03,1e-12,2e-6,1,20480", "bounds_depth");
  fails("1e-8,,1e-12,2e-6,1,20480", "bounds_depth");
  fails("1e-8,0.03,,,1,20480", "bounds_flow");
  fails("1e-8,0.03,,2e-6,1,20480", "bounds_flow");
  fails("1e-8,0.03,1e-12,,1,20480", "bounds_flow");
}

// Pixels at edges have no bound, and which they are is not told: they may be all the ground that is seen.
TEST_F(ValidateBounds, GroundThatIsLeftOutNeedsNone) {
  test::Recording flight = *flight_;
  core::Image<double>& depth = flight.depth[0][1];
  for (int y = 0; y < depth.height(); ++y)
    for (int x = 0; x < depth.width(); ++x)
      if (y != 60 || x < 40 || x > 42) depth(x, y) = std::numeric_limits<double>::infinity();
  auto results = validate(flight, table_but_one(",,1e-12,2e-6,3,20480"));
  for (const std::string& name : kNames)
    EXPECT_TRUE(results.at(name).ok) << name << " " << results.at(name).value;
  results = validate(flight, table_but_one(",,1e-12,2e-6,2,20480"));
  EXPECT_FALSE(results.at("bounds_depth").ok);
}

TEST_F(ValidateBounds, AFarPixelThatIsLeftOutNeedsNone) {
  test::Recording flight = *flight_;
  flight.depth[0][1](40, 60) = 1e6;
  auto results = validate(flight, table_but_one(kRight));
  for (const std::string& name : kNames)
    EXPECT_TRUE(results.at(name).ok) << name << " " << results.at(name).value;
  results = validate(flight, table_but_one("1e-8,0.03,1e-12,2e-6,0,20480"));
  EXPECT_FALSE(results.at("bounds_rounding").ok);
  EXPECT_FALSE(results.at("bounds_arithmetic").ok);
}

// Flow in steps of 1/64 px errs by half a step both ways, 0.01105 px, beside what floats leave.
TEST(ValidateBoundsOfSteps, AreThoseOfTheStoredFlow) {
  const test::Recording flight = test::record_flight(test::tartanair_cameras(), 2);
  const auto results = [&](const std::string& left_px) {
    const test::ScratchFolder scratch;
    test::write_tartanair(flight, scratch / "data", {}, test::FlowForm::Png);
    std::string text = kHeader;
    for (const int frame : {0, 1}) {
      text += fmt::format("{},lcam_front,1e-7,0.5,1e-12,{},1,409600\n", frame, left_px);
      text += fmt::format("{},rcam_front,1e-7,0.5,1e-12,8e-6,1,409600\n", frame);
    }
    add_table(scratch / "data", "Hills/Data_easy/P000/bounds.csv", text);
    return validate_folder(scratch / "data", scratch / "report");
  };
  auto right = results("0.0112");
  for (const std::string& name : kNames)
    EXPECT_TRUE(right.at(name).ok) << name << " " << right.at(name).value;
  EXPECT_FALSE(results("8e-6").at("bounds_rounding").ok);
  EXPECT_FALSE(results("0.0125").at("bounds_flow").ok);
}

TEST_F(ValidateBounds, TablesThatAreDamagedAreFindings) {
  const std::string right = table(kRight);
  for (const std::string& damaged :
       {right.substr(0, right.rfind("2,image_3")), right + "2,image_3,1,1,1,1,1,1\n",
        right + "3,image_3,1,1,1,1,1,1\n", right.substr(0, right.size() - 4),
        "frame,camera\n" + right, table("-1,0.03,1e-12,2e-6,1,20480"),
        table("1e-8,0.03,1e-12,2e-6,20481,20480"), table("x,0.03,1e-12,2e-6,1,20480")}) {
    const CheckResult structure = validate(damaged).at("structure");
    EXPECT_FALSE(structure.ok) << damaged;
    EXPECT_NE(structure.worst.find("bounds.csv"), std::string::npos) << structure.worst;
  }
}

TEST_F(ValidateBounds, ADatasetWithoutThemSkipsTheCheck) {
  const auto results = validate("");
  for (const std::string& name : kNames) {
    EXPECT_TRUE(results.at(name).ok) << name;
    EXPECT_TRUE(results.at(name).skipped) << name;
  }
}

}  // namespace
}  // namespace terracast::validate
