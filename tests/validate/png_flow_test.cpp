#include <gtest/gtest.h>

#include <functional>
#include <map>

#include "core/atomic_file.h"
#include "core/image_io.h"
#include "core/log.h"
#include "tests/support/test_data.h"
#include "tests/validate/analytic_dataset.h"
#include "validate/check.h"

/// TartanAir's older form of flow, 16-bit PNG in steps of 1/64 px, is read and judged as the npz is.
namespace terracast::validate {
namespace {

namespace fs = std::filesystem;
using Results = std::map<std::string, CheckResult>;

const fs::path kFlow = "Hills/Data_easy/P000/flow_lcam_front";

Results validate(const fs::path& folder, const fs::path& report) {
  const core::Log log("validate", core::LogLevel::Off);
  ValidateOptions options;
  options.samples_per_image = 1000;
  Results results;
  for (CheckResult& result : run_validate_stage(folder, options, report, {log}))
    results[result.name] = std::move(result);
  return results;
}

std::string failures(const Results& results) {
  std::string text;
  for (const auto& [name, result] : results)
    if (!result.ok)
      text += fmt::format("{} = {:.4g} {} (bound {:.4g}): {}\n", name, result.value, result.unit,
                          result.bound, result.worst);
  return text;
}

core::Image16 read_flow(const fs::path& file) {
  return std::get<core::Image16>(core::decode_png(core::read_file(file), file.string()));
}

/// A pixel's mask, v and u.
using Pixel = std::array<std::uint16_t, 3>;
void change_flow(const fs::path& folder, const std::function<void(Pixel&)>& change) {
  for (const char* name : {"000000_000001_flow.png", "000001_000002_flow.png"}) {
    core::Image16 image = read_flow(folder / kFlow / name);
    for (std::size_t i = 0; i < image.data().size(); i += 3) {
      Pixel pixel{image.data()[i], image.data()[i + 1], image.data()[i + 2]};
      change(pixel);
      std::copy(pixel.begin(), pixel.end(), image.data().begin() + static_cast<std::ptrdiff_t>(i));
    }
    core::write_file(folder / kFlow / name, core::encode_png(image));
  }
  test::list_files_again(folder);
}

class PngFlow : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    flight_ = std::make_unique<test::Recording>(test::record_flight(test::tartanair_cameras(), 3));
  }
  static void TearDownTestSuite() { flight_.reset(); }

  static Results written(const test::Mistake& mistake,
                         const std::function<void(Pixel&)>& change = {}) {
    const test::ScratchFolder scratch;
    test::write_tartanair(*flight_, scratch / "data", mistake, test::FlowForm::Png);
    if (change) change_flow(scratch / "data", change);
    return validate(scratch / "data", scratch / "report");
  }
  static Results changed(const std::function<void(Pixel&)>& change) { return written({}, change); }

  static std::unique_ptr<test::Recording> flight_;
};
std::unique_ptr<test::Recording> PngFlow::flight_;

TEST_F(PngFlow, ThatIsRightPassesWithinItsSteps) {
  const Results results = written({});
  EXPECT_EQ(failures(results), "");
  for (const char* name : {"flow", "flow_masks", "flow_covisible"})
    EXPECT_FALSE(results.at(name).skipped) << name;
  const double half_step_px = std::sqrt(2.0) / 128.0;
  EXPECT_NEAR(results.at("flow").bound, 0.005 + half_step_px, 1e-12);
  EXPECT_LT(results.at("flow").value, half_step_px + 1e-3);
  EXPECT_GT(results.at("flow").value, 0.9 * half_step_px);
}

TEST_F(PngFlow, ThatIsSwappedZeroOrOneStepOffIsFound) {
  EXPECT_FALSE(changed([](Pixel& p) { std::swap(p[1], p[2]); }).at("flow").ok);
  EXPECT_FALSE(changed([](Pixel& p) { p[1] = p[2] = 32768; }).at("flow").ok);
  EXPECT_FALSE(changed([](Pixel& p) { p = {0, 0, 0}; }).at("flow").ok);
  EXPECT_FALSE(
      changed([](Pixel& p) { p[1] = static_cast<std::uint16_t>(p[1] + 1); }).at("flow").ok);
}

TEST_F(PngFlow, MasksAreJudged) {
  const auto masks = [&](std::uint16_t value) { return changed([&](Pixel& p) { p[0] = value; }); };
  EXPECT_FALSE(masks(0).at("flow_masks").ok);
  Results results = masks(100);
  EXPECT_FALSE(results.at("flow_masks").ok);
  EXPECT_FALSE(results.at("flow_covisible").ok);
  results = changed([](Pixel& p) { p = {200, 65535, p[2]}; });
  EXPECT_FALSE(results.at("flow_masks").ok);
  EXPECT_NE(results.at("flow_masks").worst.find("longer than the format can hold"),
            std::string::npos);
}

TEST_F(PngFlow, MasksThatCannotBeAreFindings) {
  for (const std::uint16_t value : {7, 200}) {
    const CheckResult structure = changed([&](Pixel& p) {
                                    p = {value, 32768, 32768};
                                  }).at("structure");
    EXPECT_FALSE(structure.ok);
    EXPECT_NE(structure.worst.find(fmt::format("flow.png: mask {}", value)), std::string::npos)
        << structure.worst;
  }
}

TEST_F(PngFlow, ARotationOffIsFoundByTheEstimates) {
  test::Mistake mistake;
  mistake.pose_frame = 1;
  mistake.pose_turn_deg = Eigen::Vector3d(0.0, 0.02, 0.0);
  const Results results = written(mistake);
  EXPECT_FALSE(results.at("flow_rotation").ok);
}

// A turn by 80 deg from frame to frame carries points further across the image than 512 px.
TEST(LongPngFlow, IsMarkedAndJudgedByItsMark) {
  test::Recording recording;
  recording.cameras = test::tartanair_cameras();
  for (int frame = 0; frame < 3; ++frame) {
    recording.body_world.emplace_back(frame, 0.0, 100.0);
    recording.world_from_body.push_back(
        Eigen::AngleAxisd(frame * 80.0 * 3.14159265358979323846 / 180.0, Eigen::Vector3d::UnitZ())
            .toRotationMatrix());
  }
  recording.color.assign(2, {3, core::Image8(640, 640, 3, 100)});
  recording.depth.assign(2, {3, core::Image<double>(640, 640, 1, 80.0)});
  test::Mistake nothing_covisible;
  nothing_covisible.covisible = false;
  const test::ScratchFolder scratch;
  test::write_tartanair(recording, scratch / "data", nothing_covisible, test::FlowForm::Png);
  int num_long = 0;
  const core::Image16 image = read_flow(scratch / "data" / kFlow / "000000_000001_flow.png");
  for (std::size_t i = 0; i < image.data().size(); i += 3)
    num_long += image.data()[i] == 200 ? 1 : 0;
  ASSERT_GT(num_long, 1000);
  Results results = validate(scratch / "data", scratch / "report");
  EXPECT_TRUE(results.at("flow").ok) << results.at("flow").worst;
  EXPECT_TRUE(results.at("flow_masks").ok) << results.at("flow_masks").worst;

  change_flow(scratch / "data", [](Pixel& p) { p[0] = p[0] == 200 ? 1 : p[0]; });
  results = validate(scratch / "data", scratch / "report");
  EXPECT_FALSE(results.at("flow").ok) << results.at("flow").value;
}

}  // namespace
}  // namespace terracast::validate
