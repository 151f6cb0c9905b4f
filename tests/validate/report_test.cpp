#include "validate/report.h"

#include <gtest/gtest.h>

#include <limits>

#include "core/atomic_file.h"
#include "core/image_io.h"
#include "core/log.h"
#include "tests/support/test_data.h"
#include "tests/validate/analytic_dataset.h"
#include "tests/validate/joined_datasets.h"
#include "validate/check.h"
#include "validate/head_sentence.h"

/// What a report says of its results: the verdict, what was not seen, several sequences, plots,
/// map.
namespace terracast::validate {
namespace {

namespace fs = std::filesystem;

std::vector<CheckResult> run(const fs::path& folder, const fs::path& report) {
  const core::Log log("validate", core::LogLevel::Off);
  return run_validate_stage(folder, {}, report, {log});
}

const CheckResult& find(const std::vector<CheckResult>& results, const std::string& name) {
  for (const CheckResult& result : results)
    if (result.name == name) return result;
  throw std::out_of_range(name);
}

// Of values that are compared with a bound as they are: whichever way the error of 0.2 went, one of 1.2 shows.
TEST(ReportVerdict, StatesTheSmallestErrorThatWouldHaveShown) {
  CheckResult result;
  result.ok = true;
  result.value = 0.2;
  result.bound = 1.0;
  const auto stated = [&] { return report_json({result}, nullptr).at("checks").at(0); };
  EXPECT_EQ(stated().at("smallest").number(), 1.2);
  result.smallest = 3.0;
  EXPECT_EQ(stated().at("smallest").number(), 3.0);
  result.smallest.reset();
  result.is_lower_bound = true;
  result.value = 5.0;
  EXPECT_EQ(stated().at("smallest").number(), 4.0);
  for (const auto& spoil :
       {+[](CheckResult& r) { r.bound = 0.0; }, +[](CheckResult& r) { r.probability = 0.5; },
        +[](CheckResult& r) { r.skipped = true; }, +[](CheckResult& r) { r.ok = false; }}) {
    const CheckResult before = result;
    spoil(result);
    EXPECT_FALSE(stated().has("smallest"));
    result = before;
  }
}

// All that was measured says what would have shown, and all else why it was not.
TEST(ReportVerdict, LeavesNoResultWithoutAWordOfWhatItProves) {
  const test::ScratchFolder scratch;
  test::write_kitti(test::record_flight(test::kitti_cameras(), 4), scratch / "data");
  run(scratch / "data", scratch / "report");
  const core::Json checks = core::Json::read(scratch / "report/report.json").at("checks");
  for (std::size_t i = 0; i < checks.size(); ++i) {
    const core::Json& check = checks.at(i);
    const std::string& name = check.at("name").string();
    if (check.at("skipped").boolean())
      EXPECT_NE(check.at("worst").string(), "") << name;
    else
      EXPECT_TRUE(check.at("bound").number() == 0.0 || check.has("smallest")) << name;
  }
}

TEST(ReportVerdict, NamesTheColoursThatANightDoesNotShow) {
  const test::ScratchFolder scratch;
  test::write_kitti(test::record_flight(test::kitti_cameras(), 3), scratch / "data",
                    {.color_gain = 0.0});
  const auto results = run(scratch / "data", scratch / "report/kitti");
  for (const char* name :
       {"photometric_shift", "photometric_correlation", "stereo_shift", "stereo_vertical"}) {
    EXPECT_TRUE(find(results, name).is_unseen) << name;
    EXPECT_NE(verdict_line(scratch / "report/kitti").find(name), std::string::npos);
  }
  // What the format has no place for is not missed.
  EXPECT_FALSE(find(results, "colmap").is_unseen);
  EXPECT_EQ(verdict_line(scratch / "report/kitti").find("colmap"), std::string::npos);

  EXPECT_TRUE(join_reports(scratch / "report", {"kitti"}));
  const std::string line = verdict_line(scratch / "report");
  EXPECT_TRUE(line.starts_with("every bound holds; not seen: ")) << line;
  EXPECT_NE(line.find("photometric_shift (kitti)"), std::string::npos) << line;
  const core::Json json = core::Json::read(scratch / "report/report.json");
  EXPECT_GE(json.at("unseen").size(), 4U);
  for (const char* page : {"report/index.html", "report/kitti/index.html"}) {
    const std::string html = core::read_text_file(scratch / page);
    const std::size_t says = html.find("could not show what ");
    ASSERT_NE(says, std::string::npos) << page;
    EXPECT_LT(html.find("photometric_shift", says), html.find("</p>", says)) << page;
  }
}

TEST(ReportHead, SaysInOneSentenceWhatIsWrongWasProvedAndCouldNotBeShown) {
  const auto check = [](const char* name, bool ok, bool skipped, bool unseen) {
    CheckResult result;
    result.name = name;
    result.ok = ok;
    result.skipped = skipped;
    result.is_unseen = unseen;
    return result;
  };
  const auto sentence = [](const std::vector<CheckResult>& results) {
    return head_sentence(report_json(results, nullptr));
  };
  EXPECT_EQ(
      sentence({check("structure", true, false, false), check("flow", true, false, false),
                check("flow_masks", true, false, false), check("stereo_scale", true, true, false)}),
      "Proved: the files' presence and form and flow and its masks; nothing that the format "
      "holds was left unseen.");
  EXPECT_EQ(sentence({check("kitti/flow", false, false, false),
                      check("kitti/flow_masks", true, false, false),
                      check("kitti/own_check", true, false, false),
                      check("kitti/photometric_shift", true, true, true)}),
            "Wrong: flow and its masks; proved: own_check; this dataset could not show what "
            "photometric_shift (kitti) would find.");
  EXPECT_EQ(by_check(std::vector<std::string>{"kitti/flow", "kitti/depth", "coco/flow", "own"}),
            "flow (kitti, coco), depth (kitti), own");
  EXPECT_EQ(sentence({check("oxts", true, true, false)}),
            "Nothing was proved; nothing that the format holds was left unseen.");
}

TEST(ReportOfSequences, KeepsTheWorstOfBoundsFromBelowToo) {
  double least = 1e9;
  const test::ScratchFolder scratch;
  for (const int num_frames : {4, 2}) {
    const fs::path folder = scratch / std::to_string(num_frames);
    test::write_colmap(test::record_flight(test::colmap_cameras(), num_frames), folder);
    const auto results = run(folder, scratch / "report");
    least = std::min(least, find(results, "photometric_correlation").value);
  }
  test::join_datasets(scratch / "4", scratch / "2");
  const auto results = run(scratch / "4", scratch / "report");
  EXPECT_TRUE(find(results, "structure").ok) << find(results, "structure").worst;
  EXPECT_EQ(find(results, "photometric_correlation").value, least);
}

TEST(ReportBounds, ShareIsOfTheRightSide) {
  EXPECT_EQ(share_of_bound(0.5, 2.0, false), 0.25);
  EXPECT_EQ(share_of_bound(4.0, 2.0, true), 0.5);
  EXPECT_EQ(share_of_bound(1.0, 2.0, true), 2.0);
  EXPECT_EQ(share_of_bound(0.0, 0.0, false), 0.0);
  EXPECT_EQ(share_of_bound(1.0, 0.0, false), std::numeric_limits<double>::infinity());
  EXPECT_EQ(share_of_bound(0.0, 2.0, true), std::numeric_limits<double>::infinity());
}

TEST(ReportMap, IsShownWhereItLiesBesideTheReport) {
  const test::ScratchFolder scratch;
  write_report({}, {}, {}, scratch / "report/kitti");
  join_reports(scratch / "report", {"kitti"});
  EXPECT_EQ(core::read_text_file(scratch / "report/index.html").find("map.png"), std::string::npos);
  core::write_file(scratch / "report/map.png", core::encode_png(core::Image8(4, 4, 3)));
  join_reports(scratch / "report", {"kitti"});
  EXPECT_NE(core::read_text_file(scratch / "report/index.html").find("\"map.png\""),
            std::string::npos);
}

}  // namespace
}  // namespace terracast::validate
