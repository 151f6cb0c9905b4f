#include <gtest/gtest.h>

#include <map>

#include "core/atomic_file.h"
#include "core/json.h"
#include "core/log.h"
#include "tests/support/test_data.h"
#include "tests/validate/analytic_dataset.h"
#include "validate/check.h"

/// The check of bounds.csv, on a dataset of two cameras and three frames with depths of 90 to 400 m.
namespace terracast::validate {
namespace {

namespace fs = std::filesystem;

constexpr const char* kHeader =
    "frame,camera,depth_error_mm,depth_rounding_mm,flow_error_px,flow_rounding_px,left_out,"
    "pixels\n";
constexpr int kFrames = 3;
const std::string kTable = "dataset/sequences/00/bounds.csv";

/// A table that says the same of every image.
std::string table(const std::string& cells) {
  std::string text = kHeader;
  for (int frame = 0; frame < kFrames; ++frame)
    for (const char* camera : {"image_2", "image_3"})
      text += fmt::format("{},{},{}\n", frame, camera, cells);
  return text;
}

class ValidateBounds : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    flight_ =
        std::make_unique<test::Recording>(test::record_flight(test::kitti_cameras(), kFrames));
  }
  static void TearDownTestSuite() { flight_.reset(); }

  /// Results by name, of a dataset with this table; without one it says nothing of bounds.
  std::map<std::string, CheckResult> validate(const std::string& text) {
    const test::ScratchFolder scratch;
    const fs::path folder = scratch / "kitti";
    test::write_kitti(*flight_, folder);
    if (!text.empty()) {
      core::write_file(folder / kTable, text);
      std::string json = core::read_text_file(folder / "dataset.json");
      const std::string member = "\"georeference\":";
      const std::size_t at = json.find(member);
      EXPECT_NE(at, std::string::npos);
      core::write_file(folder / "dataset.json",
                       json.insert(at, fmt::format("\"bounds\": \"{}\", ", kTable)));
      test::list_files_again(folder);
    }
    const core::Log log("validate", core::LogLevel::Off);
    ValidateOptions options;
    options.samples_per_image = 100;
    std::map<std::string, CheckResult> results;
    for (const CheckResult& result : run_validate_stage(folder, options, scratch / "report", {log}))
      results[result.name] = result;
    return results;
  }

  static std::unique_ptr<test::Recording> flight_;
};

std::unique_ptr<test::Recording> ValidateBounds::flight_;

const std::vector<std::string> kNames = {"bounds_depth", "bounds_rounding", "bounds_flow",
                                         "bounds_left_out"};

TEST_F(ValidateBounds, ThoseOfFloatsAreRight) {
  const auto results = validate(table("1e-9,0.03,1e-12,2e-6,1,20480"));
  for (const std::string& name : kNames) {
    EXPECT_TRUE(results.at(name).ok) << name << " " << results.at(name).value;
    EXPECT_FALSE(results.at(name).skipped) << name;
  }
  EXPECT_NEAR(results.at("bounds_left_out").value, 1.0 / 20480.0, 1e-12);
  EXPECT_TRUE(results.at("structure").ok) << results.at("structure").worst;
}

TEST_F(ValidateBounds, EachFigureThatCannotBeIsFound) {
  const auto fails = [&](const std::string& cells, const std::string& name) {
    const auto results = validate(table(cells));
    for (const std::string& other : kNames)
      EXPECT_EQ(results.at(other).ok, other != name)
          << cells << ": " << other << " = " << results.at(other).value;
  };
  // In metres where millimetres should be: a float keeps 100 m no better than to 4e-3 mm.
  fails("1e-12,0.00003,1e-12,2e-6,1,20480", "bounds_rounding");
  fails("1.0,0.03,1e-12,2e-6,1,20480", "bounds_depth");
  fails("1e-9,0.03,0.02,2e-6,1,20480", "bounds_flow");
  fails("1e-9,0.03,1e-12,2e-6,205,20480", "bounds_left_out");
  // Nothing is said of the depths that are there.
  const auto results = validate(table(",,1e-12,2e-6,1,20480"));
  EXPECT_FALSE(results.at("bounds_depth").ok);
}

TEST_F(ValidateBounds, TablesThatAreDamagedAreFindings) {
  const std::string right = table("1e-9,0.03,1e-12,2e-6,1,20480");
  for (const std::string& damaged :
       {right.substr(0, right.rfind("2,image_3")), right + "2,image_3,1,1,1,1,1,1\n",
        right + "3,image_3,1,1,1,1,1,1\n", right.substr(0, right.size() - 4),
        "frame,camera\n" + right, table("-1,0.03,1e-12,2e-6,1,20480"),
        table("1e-9,0.03,1e-12,2e-6,20481,20480"), table("x,0.03,1e-12,2e-6,1,20480")}) {
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
