#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "core/atomic_file.h"
#include "core/image_io.h"
#include "core/json.h"
#include "core/log.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"
#include "tests/validate/joined_datasets.h"
#include "tests/validate/mutations/edits.h"
#include "validate/check.h"

/// Two faults in one dataset are both named, whatever one of them explains; so are those of two
/// sequences. What no geoid makes is not called one.
namespace terracast::validate {
namespace {

namespace fs = std::filesystem;

const test::Mutation& mutation(const std::string& name) {
  for (const test::Mutation& one : test::mutations())
    if (one.name == name) return one;
  throw std::out_of_range(name);
}

core::Json causes_of(const fs::path& folder, const fs::path& report) {
  const core::Log log("validate", core::LogLevel::Off);
  ValidateOptions options;
  options.samples_per_image = 2000;
  run_validate_stage(folder, options, report, {log});
  return core::Json::read(report / "report.json").at("causes");
}

/// Index of the cause whose words have all parts; -1 without one.
int find(const core::Json& causes, const std::vector<std::string>& parts) {
  for (std::size_t i = 0; i < causes.size(); ++i) {
    const std::string& words = causes.at(i).at("words").string();
    if (std::all_of(parts.begin(), parts.end(),
                    [&](const std::string& part) { return words.find(part) != std::string::npos; }))
      return static_cast<int>(i);
  }
  return -1;
}

bool is_seen_by(const core::Json& causes, int index, const std::string& check) {
  const auto checks = causes.at(static_cast<std::size_t>(index)).at("checks").strings();
  return std::find(checks.begin(), checks.end(), check) != checks.end();
}

TEST(TwoFaults, AFileIsNamedBesideABaseline) {
  const test::ScratchFolder scratch;
  const test::RightDataset right =
      test::write_right_dataset("kitti", test::Path::Curved, scratch / "right");
  const fs::path data = scratch / "data";
  test::corrupt(right, mutation("Baseline"), data);
  core::Json causes = causes_of(data, scratch / "report");
  int baseline = find(causes, {"baseline", "is 0.5500 m where 0.5000 m is right"});
  ASSERT_GE(baseline, 0) << causes.text();
  EXPECT_FALSE(is_seen_by(causes, baseline, "structure"));

  mutation("FileTruncated").corrupt(right, data);
  mutation("FileMissing").corrupt(right, data);
  core::write_file(data / "notes.txt", std::string_view("x"));
  causes = causes_of(data, scratch / "report");
  baseline = find(causes, {"baseline", "is 0.5500 m where 0.5000 m is right"});
  ASSERT_GE(baseline, 0) << causes.text();
  EXPECT_FALSE(is_seen_by(causes, baseline, "structure"));
  const std::string truncated = test::depth_file(right, 0, 1).string();
  EXPECT_GE(find(causes, {"a file does not hold what it should", truncated}), 0) << causes.text();
  EXPECT_GE(find(causes, {"a file is not the one that was exported", truncated}), 0);
  EXPECT_GE(find(causes, {"a file is missing", test::color_file(right, 0, 1).string()}), 0);
  EXPECT_GE(find(causes, {"a file too many", "notes.txt"}), 0);
}

TEST(TwoFaults, ACauseExplainsThatDamageAloneWhichFollowsFromIt) {
  const test::ScratchFolder scratch;
  const test::RightDataset right =
      test::write_right_dataset("tartanair_v1", test::Path::Curved, scratch / "right");
  const struct {
    const char* mutation;
    std::vector<std::string> words;
  } cases[] = {{"ByteOrder", {"byte order"}}, {"Baseline", {"baseline", "0.2750 m"}}};
  for (const auto& one : cases) {
    const fs::path data = scratch / one.mutation;
    test::corrupt(right, mutation(one.mutation), data);
    core::Json causes = causes_of(data, scratch / "report");
    ASSERT_EQ(causes.size(), 1U) << causes.text();
    EXPECT_EQ(find(causes, one.words), 0) << causes.text();
    EXPECT_TRUE(is_seen_by(causes, 0, "structure"));

    mutation("FileMissing").corrupt(right, data);
    test::list_files_again(data);
    causes = causes_of(data, scratch / "report");
    EXPECT_EQ(causes.size(), 2U) << causes.text();
    EXPECT_GE(find(causes, one.words), 0) << causes.text();
    EXPECT_GE(find(causes, {"a file is missing", test::color_file(right, 0, 1).string()}), 0)
        << causes.text();
  }
}

TEST(TwoFaults, OfManyDamagedFilesEachKindIsNamed) {
  const test::ScratchFolder scratch;
  const test::RightDataset right =
      test::write_right_dataset("kitti", test::Path::Straight, scratch / "right");
  const fs::path data = scratch / "data";
  fs::copy(right.folder, data, fs::copy_options::recursive);
  for (int i = 0; i < 50; ++i)
    core::write_file(data / fmt::format("a{:02}.txt", i), std::string_view("x"));
  mutation("FileMissing").corrupt(right, data);
  const core::Json causes = causes_of(data, scratch / "report");
  EXPECT_GE(find(causes, {"a file is missing", test::color_file(right, 0, 1).string()}), 0)
      << causes.text();
  EXPECT_GE(find(causes, {"a file too many: a04.txt", "(and more)"}), 0) << causes.text();
}

TEST(SeveralSequences, EachHasItsOwnCauses) {
  const test::ScratchFolder scratch;
  const test::RightDataset right =
      test::write_right_dataset("colmap", test::Path::Curved, scratch / "right");
  test::corrupt(right, mutation("FrameTwice"), scratch / "data");
  // Another place looks like none of these: this one upside down does as well.
  const test::Mutation foreign{
      "Foreign",
      {},
      [](const test::RightDataset& d, const fs::path& folder) {
        const core::Image8& image = d.recording.color[1][0];
        core::Image8 turned = image;
        for (int y = 0; y < image.height(); ++y)
          for (int x = 0; x < image.width(); ++x)
            for (int k = 0; k < 3; ++k)
              turned(x, y, k) = image(image.width() - 1 - x, image.height() - 1 - y, k);
        core::write_file(folder / test::color_file(d, 1, 0), core::encode_png(turned));
      },
      {}};
  test::corrupt(right, foreign, scratch / "second");
  test::join_datasets(scratch / "data", scratch / "second");
  fs::remove(scratch / "data/other/depth/rig/cam2/000000.npy");
  const core::Json causes = causes_of(scratch / "data", scratch / "report");
  const int first = find(causes, {"flight: image of rig/cam0, frame 2 is duplicated"});
  const int second = find(causes, {"other: image of rig/cam1, frame 0 does not belong there"});
  ASSERT_GE(first, 0) << causes.text();
  ASSERT_GE(second, 0) << causes.text();
  EXPECT_EQ(causes.at(static_cast<std::size_t>(first)).at("sequence").string(), "flight");
  EXPECT_EQ(causes.at(static_cast<std::size_t>(second)).at("sequence").string(), "other");
  EXPECT_GE(find(causes, {"a file is missing: other/depth/rig/cam2/000000.npy"}), 0)
      << causes.text();
  EXPECT_EQ(causes.size(), 3U) << causes.text();
}

TEST(HeightOffsets, AreTheGeoidsWhereTheyAreThatOfThePlace) {
  const test::ScratchFolder scratch;
  const test::RightDataset right =
      test::write_right_dataset("colmap", test::Path::Straight, scratch / "right");
  const struct {
    double offset_m;
    const char* words;
  } cases[] = {{-test::kUndulation_m, "heights are above the geoid where the ellipsoid is meant"},
               {test::kUndulation_m, "m too high: the geoid's height added twice"},
               {-48.2, "heights are 48.2 m too low: above another datum?"},
               {48.2, "heights are 48.2 m too high: above another datum?"}};
  for (const auto& one : cases) {
    const fs::path data = scratch / fmt::format("{}", one.offset_m);
    const test::Mutation offset{"Offset",
                                {},
                                [&](const test::RightDataset& d, const fs::path& folder) {
                                  test::edit_georeference(
                                      d, folder,
                                      [&](std::array<double, 8>& row) { row[3] += one.offset_m; });
                                },
                                {}};
    test::corrupt(right, offset, data);
    const test::ProgramResult result =
        test::run_program({"validate", data.string(), "--report", (scratch / "report").string()});
    EXPECT_EQ(result.status, 1);
    EXPECT_NE(result.output.find(one.words), std::string::npos) << result.output;
  }
}

}  // namespace
}  // namespace terracast::validate
