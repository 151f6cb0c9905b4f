#include "validate/imaging.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/json.h"
#include "core/log.h"
#include "tests/support/test_data.h"
#include "tests/validate/mutations/edits.h"
#include "validate/check.h"

/// Images that are not those of an ideal camera: right where imaging.json says so, wrong where it does not.
namespace terracast::validate {
namespace {

using test::Recording;

const char* const kSettings =
    "[lens]\nred_scale_permille = 16.0\nblue_scale_permille = 16.0\n\n[exposure]\ngain = 3.0\n\n"
    "[color]\nwhite_balance = \"temperature\"\ntemperature_k = 3200.0\ngains = [1.0, 2.0, 3.0]\n";

TEST(ImagingSettings, AreReadBySectionAndKey) {
  const Imaging imaging = imaging_of_settings(kSettings, "cam0");
  EXPECT_DOUBLE_EQ(imaging.red_scale, 1.016);
  EXPECT_DOUBLE_EQ(imaging.blue_scale, 1.016);
  EXPECT_EQ(imaging.white_balance, "temperature 3200.0");
  EXPECT_EQ(imaging_of_settings("", "cam0"), Imaging{});
  EXPECT_FALSE(imaging.has_shading);
  for (const char* shades :
       {"[lens]\nvignetting_exponent = 0.5\n", "[lens]\nvignetting_polynomial = [-0.1, 0.0, 0.0]\n",
        "[soiling]\nsmudges = 2\n", "[soiling]\ndirt_spots = 1\n"})
    EXPECT_TRUE(imaging_of_settings(shades, "cam0").has_shading) << shades;
  for (const char* shades_not : {"[lens]\nvignetting_exponent = 0.0\nvignetting_polynomial = []\n",
                                 "[soiling]\nsmudges = 0\n"})
    EXPECT_FALSE(imaging_of_settings(shades_not, "cam0").has_shading) << shades_not;
  EXPECT_EQ(imaging_of_settings("[exposure]\nred_scale_permille = 4.0\n", "cam0"), Imaging{});
  for (const char* wrong : {"nan", "20.5", "much"})
    EXPECT_THROW(
        imaging_of_settings(fmt::format("[lens]\nred_scale_permille = {}\n", wrong), "cam0"),
        core::Error)
        << wrong;
}

/// Smooth, of a period of 9 px.
double wave(double x, double y) { return 128.0 + 60.0 * std::sin(0.7 * x) * std::cos(0.7 * y); }

TEST(Aberration, IsUndoneToALevel) {
  constexpr int kWidth = 80, kHeight = 60;
  const Eigen::Vector2d center_px(38.0, 31.0);
  const Imaging imaging{.red_scale = 1.02, .blue_scale = 0.985};
  core::Image8 image(kWidth, kHeight, 3);
  const auto shown = [&](int x, int y, double scale) {
    const Eigen::Vector2d from =
        center_px + (Eigen::Vector2d(x + 0.5, y + 0.5) - center_px) / scale;
    return static_cast<std::uint8_t>(std::lround(wave(from.x(), from.y())));
  };
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      image(x, y, 0) = shown(x, y, imaging.red_scale);
      image(x, y, 1) = shown(x, y, 1.0);
      image(x, y, 2) = shown(x, y, imaging.blue_scale);
    }
  const core::Image8 aligned = without_aberration(image, imaging, center_px);
  double worst = 0.0;
  for (int y = 4; y < kHeight - 4; ++y)
    for (int x = 4; x < kWidth - 4; ++x)
      for (int k = 0; k < 3; ++k)
        worst = std::max(worst, std::abs(1.0 * aligned(x, y, k) - shown(x, y, 1.0)));
  // Roundings of both, and what the cubic leaves of such waves: 60 levels times 0.7^3 / 24 twice.
  EXPECT_LE(worst, 1.0 + 2.0 * 60.0 * 0.343 / 24.0);
}

/// Colours of a camera whose red and blue are so many times as large as green, by linear interpolation.
core::Image8 aberrated(const core::Image8& image, double scale) {
  core::Image8 wrong = image;
  const double cx = 0.5 * image.width() - 0.5, cy = 0.5 * image.height() - 0.5;
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) {
      const double u = cx + (x - cx) / scale, v = cy + (y - cy) / scale;
      const int i = std::min(static_cast<int>(u), image.width() - 2);
      const int j = std::min(static_cast<int>(v), image.height() - 2);
      for (const int k : {0, 2}) {
        const double above = image(i, j, k) + (u - i) * (image(i + 1, j, k) - image(i, j, k));
        const double below =
            image(i, j + 1, k) + (u - i) * (image(i + 1, j + 1, k) - image(i, j + 1, k));
        wrong(x, y, k) = static_cast<std::uint8_t>(std::lround(above + (v - j) * (below - above)));
      }
    }
  return wrong;
}

/// By other white: blue 1.9 times, red half: brown ground looks as with red and blue swapped.
core::Image8 cooler(core::Image8 image) {
  for (std::size_t i = 0; i < image.data().size(); i += 3) {
    image.data()[i] = static_cast<std::uint8_t>(image.data()[i] / 2);
    image.data()[i + 2] = static_cast<std::uint8_t>(std::min(255.0, 1.9 * image.data()[i + 2]));
  }
  return image;
}

class StatedImaging : public testing::Test {
 protected:
  using Results = std::map<std::string, CheckResult>;

  static const Recording& flight() {
    static const Recording recording = test::record_flight(test::colmap_cameras(), 3);
    return recording;
  }

  /// A COLMAP dataset with the second camera's colours changed, and imaging.json of it.
  /// settings  of that camera; empty: no such file
  /// of_first  of the first
  Results validate(const std::function<core::Image8(const core::Image8&)>& change,
                   const std::string& settings, const std::string& of_first = "") {
    const std::filesystem::path data = scratch_ / "data";
    std::filesystem::remove_all(data);
    test::write_colmap(flight(), data);
    test::RightDataset right;
    right.format = "colmap";
    right.folder = data;
    right.recording = flight();
    test::edit_colors(right, data, 0, [&](std::size_t c, std::size_t f) {
      return c == 1 ? change(flight().color[c][f]) : flight().color[c][f];
    });
    const core::Json dataset = core::Json::read(data / "dataset.json");
    const core::Json& sequence = dataset.at("sequences").at(0);
    if (!settings.empty()) {
      core::Json cameras = core::Json::array();
      for (std::size_t c = 0; c < sequence.at("cameras").size(); ++c) {
        core::Json camera =
            core::Json::object().set("name", sequence.at("cameras").at(c).at("name").string());
        if (c == 1) camera.set("settings", settings);
        if (c == 0 && !of_first.empty()) camera.set("settings", of_first);
        cameras.push(std::move(camera));
      }
      const std::filesystem::path georeference = data / sequence.at("georeference").string();
      core::write_file(georeference.parent_path() / "imaging.json",
                       std::string_view(core::Json::object().set("cameras", cameras).text()));
    }
    test::list_files_again(data);
    const core::Log log("validate", core::LogLevel::Off);
    Results results;
    for (CheckResult& result : run_validate_stage(data, {}, scratch_ / "report", {log}))
      results[result.name] = std::move(result);
    return results;
  }

  static std::string failures(const Results& results) {
    std::string text;
    for (const auto& [name, result] : results)
      if (!result.ok)
        text += fmt::format("{} = {:.4g} (bound {:.4g}): {}\n", name, result.value, result.bound,
                            result.worst);
    return text;
  }

  const test::ScratchFolder scratch_;
};

TEST_F(StatedImaging, AnAberrationIsNoMistakeWhereItIsStatedAndOneWhereItIsNot) {
  const char* const settings = "[lens]\nred_scale_permille = 20.0\nblue_scale_permille = 20.0\n";
  const auto change = [](const core::Image8& image) { return aberrated(image, 1.02); };
  EXPECT_EQ(failures(validate(change, settings)), "");
  EXPECT_NE(failures(validate(change, "")).find("photometric_"), std::string::npos);
  // Stated of images that have none.
  const auto none = [](const core::Image8& image) { return image; };
  EXPECT_NE(failures(validate(none, settings)).find("photometric_"), std::string::npos);
}

TEST_F(StatedImaging, AnotherWhiteIsNoMistakeWhereItIsStatedAndOneWhereItIsNot) {
  const Results stated = validate(cooler, "[color]\nwhite_balance = \"gains\"\n");
  EXPECT_EQ(failures(stated), "");
  // Comparing a camera with itself cannot show red and blue swapped in all its images.
  EXPECT_TRUE(stated.at("photometric_channels").is_unseen);
  EXPECT_NE(stated.at("photometric_channels").summary.find("balance white otherwise"),
            std::string::npos);
  const Results unstated = validate(cooler, "");
  EXPECT_NE(failures(unstated).find("photometric_channels"), std::string::npos)
      << unstated.at("photometric_channels").value;
}

// Each rig makes what it sees itself grey, so that one setting is two gains.
TEST_F(StatedImaging, TwoCamerasThatMakeTheirWorldGreyAreNotOfOneWhite) {
  const std::string grey = "[color]\nwhite_balance = \"grey_world\"\n";
  const Results of_both = validate(cooler, grey, grey);
  EXPECT_EQ(failures(of_both), "");
  EXPECT_TRUE(of_both.at("photometric_channels").is_unseen);
  // Of one setting that is one gain it is a mistake.
  const std::string warm = "[color]\nwhite_balance = \"temperature\"\ntemperature_k = 3200.0\n";
  EXPECT_NE(failures(validate(cooler, warm, warm)).find("photometric_channels"), std::string::npos);
}

TEST_F(StatedImaging, AFileThatSaysNonsenseIsAFinding) {
  const auto none = [](const core::Image8& image) { return image; };
  const Results results = validate(none, "[lens]\nred_scale_permille = 300.0\n");
  EXPECT_FALSE(results.at("structure").ok);
  EXPECT_NE(results.at("structure").worst.find("it takes -20 to 20"), std::string::npos)
      << results.at("structure").worst;
}

}  // namespace
}  // namespace terracast::validate
