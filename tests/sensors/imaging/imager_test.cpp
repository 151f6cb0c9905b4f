#include "sensors/camera/imaging/imager.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "capture/frame_reader.h"
#include "core/atomic_file.h"
#include "core/schema_writer.h"
#include "core/toml_reader.h"
#include "scene/light/shading.h"
#include "tests/support/hills_flight.h"
#include "tests/support/test_data.h"

namespace terracast::sensors {
namespace {

namespace fs = std::filesystem;

/// A bit of everything.
ImagingOptions whole_camera() {
  ImagingOptions options;
  options.lens = {.vignetting_exponent = 4.0,
                  .red_scale_permille = 2.0,
                  .blue_scale_permille = -1.0,
                  .veiling_glare = 0.02,
                  .bloom = 0.05};
  options.soiling = {.smudges = 2, .dirt_spots = 3};
  options.exposure = {.mode = "automatic", .time_constant_s = 0.2};
  options.sensor = {.bits = 12,
                    .black_level_dn = 64.0,
                    .full_well_e = 8000.0,
                    .read_noise_e = 3.0,
                    .prnu_percent = 1.0,
                    .dsnu_e = 2.0,
                    .dead_share = 1e-3,
                    .hot_share = 1e-3,
                    .mosaic = "grbg"};
  options.color = {.white_balance = "grey_world", .saturation = 1.2, .curve = "srgb"};
  return options;
}

std::map<std::string, std::vector<std::byte>> bytes_of(const fs::path& folder) {
  std::map<std::string, std::vector<std::byte>> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file())
      files[fs::relative(entry.path(), folder).string()] = core::read_file(entry.path());
  return files;
}

float linear_from_srgb(std::uint8_t value) {
  const float v = static_cast<float>(value) / 255.0f;
  return v <= 0.04045f ? v / 12.92f : std::pow((v + 0.055f) / 1.055f, 2.4f);
}

TEST(ImagingOptions, AreReadWithPlaceAndReasonOfWhatIsWrong) {
  const test::ScratchFolder scratch;
  const auto read = [&](const std::string& imaging) {
    core::write_file(scratch / "rig.toml",
                     "name = \"rig\"\n" + imaging +
                         "[[cameras]]\nname = \"a\"\nwidth_px = 8\nheight_px = 8\nfx_px = 8\n");
    return core::read_toml<rigs::RigOptions>(scratch / "rig.toml");
  };
  const auto message_of = [&](const std::string& imaging) -> std::string {
    try {
      read(imaging);
    } catch (const core::Error& error) {
      EXPECT_EQ(error.kind(), core::ErrorKind::Config);
      return error.what();
    }
    return "";
  };
  const rigs::RigOptions rig = read("[imaging.sensor]\nbits = 10\nfull_well_e = 9000\n");
  EXPECT_EQ(rig.imaging.sensor.bits, 10);
  ASSERT_EQ(rigs::imaging_of_cameras({rig}).size(), 1u);
  EXPECT_TRUE(rigs::imaging_of_cameras({read("")}).empty());
  EXPECT_EQ(core::toml_text(rig), core::toml_text(read("[imaging.sensor]\nbits = 10\n"
                                                       "full_well_e = 9000.0\n")));
  using testing::HasSubstr;
  EXPECT_THAT(message_of("[imaging.sensor]\nbit = 10\n"), HasSubstr("bits"));
  EXPECT_THAT(message_of("[imaging.sensor]\nbits = 17\n"), HasSubstr("outside 0 to 16"));
  EXPECT_THAT(message_of("[imaging.sensor]\nmosaic = \"xtrans\"\n"), HasSubstr("rggb"));
  EXPECT_THAT(message_of("[imaging.sensor]\nread_noise_e = 2.0\n"),
              testing::AllOf(HasSubstr("rig.toml:2"), HasSubstr("bits = 0 leaves it out")));
}

/// An imager of one camera with a pinhole of 32 x 24 px.
struct OneCamera {
  explicit OneCamera(const ImagingOptions& options,
                     const scene::Color& balance = scene::Color::Ones())
      : imager(options, camera, *model, 1, "P000", 1.0f, balance) {}

  capture::CameraCalibration camera{
      .rig = "rig",
      .name = "cam",
      .intrinsics = {.width_px = 32, .height_px = 24, .parameters = {20.0, 20.0, 16.0, 12.0}},
      .rig_from_camera = {},
      .body_from_rig = {}};
  std::unique_ptr<geo::CameraModel> model = geo::make_camera(camera.intrinsics);
  Imager imager;
};

core::ImageF even(const scene::Color& color) {
  core::ImageF light(32, 24, 3);
  for (std::size_t i = 0; i < light.data().size(); ++i)
    light.data()[i] = color[static_cast<Eigen::Index>(i % 3)];
  return light;
}

TEST(Imager, GreysAreGreyUnderTheirWhiteBalance) {
  const scene::Color tint(1.3f, 0.95f, 0.6f);
  ImagingOptions options;
  options.color.curve = "linear";
  const auto expect_grey = [&](const ImagingOptions& camera, const scene::Color& balance,
                               const scene::Color& light, const scene::Color& grey) {
    const Photo photo = OneCamera(camera, balance).imager.photograph(even(light), 0, 0.0, grey);
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(photo.color(7, 9, k), photo.color(7, 9, 1), 1.0) << camera.color.white_balance;
    EXPECT_GT(photo.color(7, 9), 20);
  };
  expect_grey(options, 1.0f / tint, 0.3f * tint, {});
  options.color.white_balance = "gains";
  options.color.gains = {1.0 / 1.3, 1.0 / 0.95, 1.0 / 0.6};
  expect_grey(options, scene::Color::Ones(), 0.3f * tint, {});
  options.color.gains.clear();
  options.color.white_balance = "temperature";
  options.color.temperature_k = 3000.0;
  expect_grey(options, scene::Color::Ones(), 0.3f / gains_of_temperature(3000.0), {});
  options.color.white_balance = "grey_world";
  expect_grey(options, scene::Color::Ones(), 0.3f * tint, 0.7f * tint);
  // Behind a sensor and a mosaic as well.
  options.sensor = {.bits = 12, .mosaic = "rggb"};
  expect_grey(options, scene::Color::Ones(), 0.3f * tint, 0.7f * tint);
}

TEST(Imager, ExposesByStops) {
  ImagingOptions options;
  options.color.curve = "linear";
  const OneCamera one(options);
  const core::ImageF light = even(scene::Color::Constant(0.1f));
  EXPECT_EQ(one.imager.photograph(light, 0, 0.0, {}).color(3, 3), 26);
  EXPECT_EQ(one.imager.photograph(light, 0, 1.0, {}).color(3, 3), 51);
  EXPECT_EQ(one.imager.photograph(light, 0, 8.0, {}).color(3, 3), 255);
}

TEST(Imager, WhatIsTooBrightIsWhiteWithoutATint) {
  ImagingOptions options;
  options.sensor = {.bits = 10, .saturation_exposure = 1.0};
  options.color = {.white_balance = "gains", .gains = {2.0, 1.0, 1.5}, .curve = "linear"};
  const Photo photo =
      OneCamera(options).imager.photograph(even(scene::Color::Constant(7.0f)), 0, 0.0, {});
  for (int k = 0; k < 3; ++k) EXPECT_EQ(photo.color(5, 5, k), 255);
}

TEST(Imager, AWhiteFurnaceShowsTheVignetting) {
  ImagingOptions options;
  options.lens.vignetting_exponent = 4.0;
  options.color.curve = "linear";
  const Photo photo =
      OneCamera(options).imager.photograph(even(scene::Color::Constant(0.8f)), 0, 0.0, {});
  for (int y = 0; y < 24; ++y)
    for (int x = 0; x < 32; ++x) {
      const double tan2 = (std::pow(x + 0.5 - 16.0, 2) + std::pow(y + 0.5 - 12.0, 2)) / 400.0;
      EXPECT_NEAR(photo.color(x, y), 255.0 * 0.8 / std::pow(1.0 + tan2, 2.0), 0.51);
    }
}

class ImagingStage : public testing::Test {
 protected:
  static render::SequencePlan plan_with(const ImagingOptions& options, int num_frames = 3) {
    render::SequencePlan plan = test::small_plan(num_frames, 40, 30);
    plan.imaging.assign(plan.cameras.size(), options);
    return plan;
  }
  void render(const render::SequencePlan& plan, const fs::path& folder,
              const capture::FrameSelection& selection = {}, int num_threads = 2,
              const std::vector<fs::path>& earlier = {}) {
    const core::Log log("test", core::LogLevel::Off);
    const core::Context context{.log = log, .num_threads = num_threads, .events_file = {}};
    rendered_ = render::run_render_stage(store_, plan, {}, selection, folder, context, earlier);
  }

  test::ScratchFolder scratch_;
  world::TileStore store_ = test::make_hills(scratch_ / "world");
  render::RenderedFrames rendered_;
};

TEST_F(ImagingStage, OffChangesNothing) {
  const test::TracedPlan without(store_, test::small_plan(1, 40, 30));
  const test::TracedPlan off(store_, plan_with({}, 1));
  EXPECT_EQ(off.renderer.color(0, 1), without.renderer.color(0, 1));
  EXPECT_FALSE(off.renderer.photo(0, 1).exposure_ev.has_value());
  // A camera in between that does nothing rounds the product of exposure and balance otherwise.
  ImagingOptions idle;
  idle.color.gamma = 2.0;
  const test::TracedPlan on(store_, plan_with(idle, 1));
  const core::Image8 a = on.renderer.color(0, 1);
  const core::Image8 b = without.renderer.color(0, 1);
  for (std::size_t i = 0; i < a.data().size(); ++i)
    ASSERT_LE(std::abs(int{a.data()[i]} - int{b.data()[i]}), 1);
}

TEST_F(ImagingStage, BytesDoNotDependOnThreadsShardsOrOrder) {
  const render::SequencePlan plan = plan_with(whole_camera());
  render(plan, scratch_ / "whole");
  render(plan, scratch_ / "parts", {.first = 2, .step = 3}, 1);
  render(plan, scratch_ / "parts", {.first = 1, .step = 3}, 2);
  render(plan, scratch_ / "parts", {.first = 0, .step = 3}, 1);
  const auto whole = bytes_of(scratch_ / "whole");
  EXPECT_EQ(whole.count("pair/left/000002.raw.png"), 1u);
  EXPECT_EQ(bytes_of(scratch_ / "parts"), whole);
}

TEST_F(ImagingStage, IsRecordedAndReadAgain) {
  const render::SequencePlan plan = plan_with(whole_camera());
  render(plan, scratch_ / "capture");
  const auto capture = capture::SequenceReader::open(scratch_ / "capture");
  const capture::CameraImaging& imaging = capture.info().imaging.at(0);
  EXPECT_NE(imaging.settings_toml.find("full_well_e = 8000"), std::string::npos);
  EXPECT_EQ(imaging.raw.mosaic, "grbg");
  EXPECT_EQ(imaging.raw.bits, 12);
  EXPECT_EQ(imaging.raw.black_level_dn, 64.0);
  EXPECT_EQ(imaging.raw.white_level_dn, 4095.0);
  EXPECT_NE(capture.info().imaging.at(1).hot_sites, imaging.hot_sites);
  const capture::CameraFrame frame =
      capture.read_camera(1, 0, capture::SequenceReader::kAll | capture::SequenceReader::kRaw);
  ASSERT_FALSE(imaging.hot_sites.empty());
  for (const std::int64_t site : imaging.hot_sites)
    EXPECT_EQ(frame.raw.data()[static_cast<std::size_t>(site)], 4095);
  const capture::FrameRecord& record = capture.frames()[1];
  ASSERT_TRUE(record.cameras[0].exposure_ev.has_value());
  EXPECT_EQ(*record.cameras[0].exposure_ev, *record.cameras[2].exposure_ev);  // locked

  // A lost raw file is a damaged frame.
  fs::remove(scratch_ / "capture" / record.cameras[0].raw->path);
  render(plan, scratch_ / "capture");
  EXPECT_EQ(rendered_.rendered, std::vector<int>{1});
}

TEST_F(ImagingStage, FramesStayWhereTheirImagingDoes) {
  ImagingOptions options;
  options.sensor = {.bits = 10, .full_well_e = 5000.0};
  const render::SequencePlan plan = plan_with(options, 2);
  render(plan, scratch_ / "before");
  render::SequencePlan again = plan;
  again.config_toml += "# as before\n";
  render(again, scratch_ / "same", {}, 2, {scratch_ / "before"});
  EXPECT_EQ(rendered_.taken_over.size(), 2u);
  again.imaging[0].sensor.full_well_e = 6000.0;
  render(again, scratch_ / "other", {}, 2, {scratch_ / "before"});
  EXPECT_EQ(rendered_.rendered.size(), 2u);
  EXPECT_NE(render::CheckedPlan(again, store_).info().input_hash,
            render::CheckedPlan(plan, store_).info().input_hash);
}

/// The image itself, linearised, has the target as its mean.
TEST_F(ImagingStage, AutomaticExposureReachesItsTarget) {
  ImagingOptions options;
  options.exposure = {.mode = "automatic", .target = 0.1, .time_constant_s = 0.0, .lock = "camera"};
  options.color.curve = "srgb";
  for (const double light : {0.05, 1.0, 20.0}) {
    render::SequencePlan plan = plan_with(options, 1);
    plan.conditions.exposure = light;
    const test::TracedPlan scene(store_, plan);
    const Photo photo = scene.renderer.photo(0, 0);
    // The mean of the logarithms of what blocks of pixels show: the meter's spots, with two rays a pixel
    // instead of one. The image's last rows make no block.
    double sum = 0.0;
    for (int y = 0; y < 28; y += 4)
      for (int x = 0; x < 40; x += 4) {
        double block = 0.0;
        for (int i = 0; i < 16; ++i) {
          const std::uint8_t* rgb = &photo.color(x + i % 4, y + i / 4);
          block += double{scene::luminance_of({linear_from_srgb(rgb[0]), linear_from_srgb(rgb[1]),
                                               linear_from_srgb(rgb[2])})} /
                   16.0;
        }
        sum += std::log(block) / 70.0;
      }
    EXPECT_NEAR(std::exp(sum), 0.1, 0.005) << light << " " << *photo.exposure_ev;
  }
}

}  // namespace
}  // namespace terracast::sensors
