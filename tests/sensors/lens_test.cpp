#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>

#include "capture/channel.h"
#include "capture/labels.h"
#include "core/error.h"
#include "core/toml_reader.h"
#include "tests/support/hills_flight.h"
#include "tests/support/test_data.h"

namespace terracast::sensors {
namespace {

using capture::SemanticClass;
using test::TracedPlan;

std::filesystem::path write(const std::filesystem::path& path, const std::string& text) {
  std::ofstream(path) << text;
  return path;
}

rigs::RigOptions rig_of(const std::filesystem::path& folder, const std::string& camera) {
  return core::read_toml<rigs::RigOptions>(
      write(folder / "rig.toml",
            "name = \"rig\"\n[[cameras]]\nname = \"cam\"\nwidth_px = 64\n"
            "height_px = 48\n" +
                camera));
}

std::vector<double> parameters_of(const std::filesystem::path& folder, const std::string& camera) {
  return rigs::build_cameras({rig_of(folder, camera)}).at(0).intrinsics.parameters;
}

std::string message_of(const std::filesystem::path& folder, const std::string& camera) {
  try {
    parameters_of(folder, camera);
  } catch (const core::Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(LensOptions, AModelsOwnParametersAreKeysOfTheCamera) {
  const test::ScratchFolder folder;
  EXPECT_EQ(
      parameters_of(folder.path(), "fx_px = 50.0\nmodel = \"opencv\"\nk1 = -0.1\np2 = 0.001\n"),
      (std::vector<double>{50, 50, 32, 24, -0.1, 0, 0, 0.001}));
  EXPECT_EQ(parameters_of(folder.path(),
                          "fx_px = 20.0\nfy_px = 21.0\nmodel = \"double_sphere\"\nxi = 0.2\n"),
            (std::vector<double>{20, 21, 32, 24, 0.2, 0.5}));
  const double per_rad = 64 / (2 * std::numbers::pi);
  EXPECT_EQ(parameters_of(folder.path(), "model = \"cylindrical\"\n"),
            (std::vector<double>{per_rad, per_rad, 32, 24}));
  EXPECT_EQ(parameters_of(folder.path(), "model = \"equirectangular\"\nfx_px = 10.0\n"),
            (std::vector<double>{10, 10, 32, 24}));
}

TEST(LensOptions, WhatAModelDoesNotTakeIsRefused) {
  const test::ScratchFolder folder;
  const auto message = [&](const std::string& camera) { return message_of(folder.path(), camera); };
  EXPECT_NE(message("fx_px = 50.0\nk1 = 0.1\n").find("k1"), std::string::npos);
  EXPECT_NE(message("fx_px = 50.0\nmodel = \"radial\"\nk3 = 0.1\n").find("k3"), std::string::npos);
  EXPECT_NE(
      message("fx_px = 50.0\nmodel = \"double_sphere\"\nalpha = 1.5\n").find("outside 0 to 1"),
      std::string::npos);
  EXPECT_NE(message("fx_px = 50.0\nmodel = \"opncv\"\n").find("opencv"), std::string::npos);
  EXPECT_NE(message("model = \"opencv\"\n").find("no focal length"), std::string::npos);
  const std::string parallel = "fx_px = 5.0\nmodel = \"orthographic\"\n";
  EXPECT_EQ(message(parallel), "no error");
  EXPECT_EQ(message(parallel + "line_time_us = 20.0\nexposure_ms = 2.0\n"), "no error");
  EXPECT_NE(message(parallel + "aperture_mm = 4.0\n").find("no one entrance pupil"),
            std::string::npos);
  EXPECT_NE(message("focal_length_mm = 5.0\nimage_plane_width_mm = 8.0\nmodel = "
                    "\"orthographic\"\n")
                .find("pixels a metre"),
            std::string::npos);
  const std::string scanner = "fx_px = 50.0\nmodel = \"pushbroom\"\n";
  EXPECT_NE(message(scanner).find("rows a metre of the way"), std::string::npos);
  EXPECT_EQ(message(scanner + "fy_px = 2.0\n"), "no error");
  EXPECT_NE(message(scanner + "fy_px = 2.0\nline_time_us = 20.0\n").find("on the way that fy_px"),
            std::string::npos);
  EXPECT_NE(message("model = \"tabulated\"\n").find("from a file"), std::string::npos);
}

TEST(LensOptions, RaysComeFromATable) {
  const test::ScratchFolder folder;
  std::string text = "# u v x y z\n";
  for (int j = 0; j < 7; ++j)
    for (int i = 0; i < 9; ++i)
      text +=
          fmt::format("{} {} {} {} 1\n", 8 * i, 8 * j, (8 * i - 32) / 50.0, (8 * j - 24) / 50.0);
  write(folder / "rays.txt", text);
  const auto camera =
      rigs::build_cameras({rig_of(folder.path(), "model = \"tabulated\"\nrays = \"rays.txt\"\n")})
          .at(0);
  const auto model = geo::make_camera(camera.intrinsics);
  const auto pinhole = geo::make_camera({"pinhole", 64, 48, {50, 50, 32, 24}});
  for (const Eigen::Vector2d& pixel :
       {Eigen::Vector2d(0, 0), Eigen::Vector2d(31.5, 20.25), Eigen::Vector2d(64, 48)}) {
    // Nodes 9 deg apart: what cubics leave, with room.
    const Eigen::Vector3d ray = model->ray_from_pixel(pixel);
    EXPECT_LT((ray - pinhole->ray_from_pixel(pixel).normalized()).norm(), 1e-3);
    EXPECT_LT((*model->pixel_from_ray(3.0 * ray) - pixel).norm(), 1e-9);
  }
  write(folder / "rays.txt", "0 0 0 0 1\n");
  EXPECT_NE(
      message_of(folder.path(), "model = \"tabulated\"\nrays = \"rays.txt\"\n").find("whole rows"),
      std::string::npos);
}

/// A level plane at z = 40 m as far as 2048 m to each side, and one camera of the model over it.
struct Flight {
  test::ScratchFolder folder;
  world::TileStore store =
      test::make_tiny_world(folder / "world", [](double, double) { return 40.0; },
                            {.finest_level = 3, .coarsest_level = 3});
  render::SequencePlan plan = test::small_plan(2, 40, 32);

  explicit Flight(const geo::CameraIntrinsics& intrinsics) {
    plan.cameras.resize(1);
    plan.cameras[0].intrinsics = intrinsics;
  }
};

class EachLens : public testing::TestWithParam<geo::CameraIntrinsics> {};

TEST_P(EachLens, SeesAPlaneWhereItsEquationPutsIt) {
  const Flight flight(GetParam());
  const TracedPlan scene(flight.store, flight.plan);
  const int width = GetParam().width_px, height = GetParam().height_px;
  const TruthFrame truth = scene.renderer.truth(0, 0);
  const core::Image8 color = scene.renderer.color(0, 0);
  const View& view = scene.renderer.views().at(0, 0);
  const View& next = scene.renderer.views().at(1, 0);
  int num_ground = 0, num_nothing = 0, num_seen_next = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto pixel = static_cast<std::size_t>(y * width + x);
      const double range_m = truth.range_m[pixel];
      const auto semantic = static_cast<SemanticClass>(truth.facts.semantic_id(x, y));
      const Eigen::Vector3d direction = view.ray_world({x + 0.5, y + 0.5}).normalized();
      ASSERT_EQ(std::isnan(range_m), !direction.allFinite());
      ASSERT_EQ(std::isnan(range_m), semantic == SemanticClass::Nothing);
      ASSERT_TRUE(capture::agree(truth.facts.range_m(x, y), truth.facts.semantic_id(x, y)));
      if (std::isnan(range_m)) {
        ++num_nothing;
        EXPECT_EQ(truth.facts.flags(x, y), 0u);
        // A pixel whose corner the circle cuts has some light.
        bool is_dark = true;
        for (const double u : {0.0, 1.0})
          for (const double v : {0.0, 1.0})
            is_dark = is_dark && !view.ray_world({x + u, y + v}).allFinite();
        if (is_dark) {
          EXPECT_EQ(color(x, y, 0) + color(x, y, 1) + color(x, y, 2), 0);
        }
        continue;
      }
      const double expected_m = (40.0 - view.center_world.z()) / direction.z();
      const Eigen::Vector3d point = view.center_world + expected_m * direction;
      const bool is_on_tiles =
          expected_m > 0.0 && std::abs(point.x()) < 2048.0 && std::abs(point.y()) < 2048.0;
      ASSERT_EQ(std::isinf(range_m), !is_on_tiles) << x << " " << y;
      if (!is_on_tiles) continue;
      ++num_ground;
      EXPECT_NEAR(range_m, expected_m, 1e-11 * expected_m);
      EXPECT_LT(
          (*view.project(truth.point_world[pixel]) - Eigen::Vector2d(x + 0.5, y + 0.5)).norm(),
          1e-7);
      // Nothing stands on the plane: what is in the next image is seen there.
      const bool is_in_next = next.has_in_image(truth.point_world[pixel]);
      EXPECT_EQ((truth.facts.flags(x, y) & capture::kVisibleNext) != 0, is_in_next);
      num_seen_next += is_in_next ? 1 : 0;
    }
  }
  EXPECT_GT(num_ground, width * height / 6);
  EXPECT_GT(num_seen_next, width * height / 10);
  RecordProperty("num_nothing", num_nothing);
}

TEST_P(EachLens, FlowThereAndBackIsNone) {
  const Flight flight(GetParam());
  const TracedPlan scene(flight.store, flight.plan);
  const auto model = geo::make_camera(GetParam());
  const auto view_at = [&](std::size_t frame) {
    return capture::CameraView{*model, flight.plan.states[frame].world_from_body *
                                           flight.plan.cameras[0].body_from_camera()};
  };
  const capture::CameraView now = view_at(0), then = view_at(1);
  const TruthFrame truth = scene.renderer.truth(0, 0);
  int num_followed = 0;
  for (int y = 0; y < GetParam().height_px; ++y) {
    for (int x = 0; x < GetParam().width_px; ++x) {
      const auto pixel = static_cast<std::size_t>(y * GetParam().width_px + x);
      if (!std::isfinite(truth.range_m[pixel])) continue;
      const Eigen::Vector2d here(x + 0.5, y + 0.5);
      const auto motion = capture::flow(now, then, here, truth.range_m[pixel]);
      if (!motion) continue;
      const double range_then_m =
          (truth.point_world[pixel] - then.world_from_camera.translation).norm();
      const auto back = capture::flow(then, now, here + *motion, range_then_m);
      ASSERT_TRUE(back);
      EXPECT_LT((*motion + *back).norm(), 1e-8) << here.transpose();
      ++num_followed;
    }
  }
  EXPECT_GT(num_followed, 200);
}

// The bounds are of the labels of all pixels that have one, and small: rounding, not a guess.
TEST_P(EachLens, LabelsHaveBounds) {
  const Flight flight(GetParam());
  const TracedPlan scene(flight.store, flight.plan);
  const auto model = geo::make_camera(GetParam());
  const capture::CameraView view{
      *model, flight.plan.states[0].world_from_body * flight.plan.cameras[0].body_from_camera()};
  const capture::CameraView next{
      *model, flight.plan.states[1].world_from_body * flight.plan.cameras[0].body_from_camera()};
  TruthFrame truth = scene.renderer.truth(0, 0);
  const capture::TileScale plane{.spacing_m = 8.0, .lowest_z_world = 40.0, .highest_z_world = 40.0};
  const std::vector<capture::TileScale> tiles(capture::kMaxShownTiles, plane);
  const capture::LabelBounds bounds =
      capture::bounds_of_labels(view, next, std::nullopt, truth.facts, truth.crossing_error, tiles);
  ASSERT_TRUE(bounds.depth_m);
  ASSERT_TRUE(bounds.flow_next_px);
  EXPECT_GT(bounds.depth_m->arithmetic, 0.0);
  EXPECT_LT(bounds.depth_m->arithmetic, 1e-2);
  EXPECT_LT(bounds.flow_next_px->arithmetic, 1e-4);
}

INSTANTIATE_TEST_SUITE_P(
    Models, EachLens,
    testing::Values(
        geo::CameraIntrinsics{"opencv", 60, 48, {40, 41, 31, 23, -0.2, 0.05, 1e-3, -1e-3}},
        geo::CameraIntrinsics{"opencv_fisheye", 60, 48, {12, 12, 30, 24, -0.03, 0, 0, 0}},
        geo::CameraIntrinsics{"double_sphere", 60, 48, {14, 14, 30, 24, 0.3, 0.65}},
        geo::CameraIntrinsics{"unified", 60, 48, {40, 40, 30, 24, 1.2, -0.1, 0, 0, 0}},
        geo::CameraIntrinsics{
            "equirectangular", 64, 32, {32 / std::numbers::pi, 32 / std::numbers::pi, 32, 16}},
        geo::CameraIntrinsics{"cylindrical", 64, 48, {32 / std::numbers::pi, 10, 32, 24}}),
    [](const auto& example) { return example.param.model; });

}  // namespace
}  // namespace terracast::sensors
