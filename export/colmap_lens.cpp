#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "core/error.h"
#include "export/colmap_model.h"

namespace terracast::exporters {
namespace {

using core::ErrorKind;
using core::fail;

/// How a model of ours is called there. Its parameters stand in COLMAP's order; with one focal length or two.
struct Row {
  const char* model;
  const char* colmap;
  std::int32_t number;
  bool has_one_focal_length;
};
constexpr Row kRows[] = {{"pinhole", "PINHOLE", 1, false},
                         {"simple_radial", "SIMPLE_RADIAL", 2, true},
                         {"radial", "RADIAL", 3, true},
                         {"opencv", "OPENCV", 4, false},
                         {"opencv_fisheye", "OPENCV_FISHEYE", 5, false},
                         {"full_opencv", "FULL_OPENCV", 6, false},
                         {"fov", "FOV", 7, false},
                         {"thin_prism_fisheye", "THIN_PRISM_FISHEYE", 10, false}};

const Row* row_of(const std::string& model) {
  for (const Row& row : kRows)
    if (model == row.model) return &row;
  return nullptr;
}

}  // namespace

ColmapLens colmap_lens(const geo::CameraIntrinsics& intrinsics) {
  const Row* row = row_of(intrinsics.model);
  if (row == nullptr) {
    std::string known;
    for (const Row& each : kRows)
      known += fmt::format("{}{}", known.empty() ? "" : ", ", each.model);
    fail(ErrorKind::Config, "COLMAP has no camera model {}; it has {}", intrinsics.model, known);
  }
  std::vector<double> p = intrinsics.parameters;
  if (row->has_one_focal_length) {
    if (p[0] == p[1]) {
      p.erase(p.begin());
    } else {  // the same lens among those with two
      row = row_of("opencv");
      p.resize(8, 0.0);
    }
  }
  return {.model = row->colmap, .number = row->number, .parameters = std::move(p)};
}

void check_colmap_camera(const geo::CameraIntrinsics& intrinsics) {
  colmap_lens(intrinsics);
  const auto camera = geo::make_camera(intrinsics);
  constexpr int kParts = 64;
  for (int j = 0; j <= kParts; ++j) {
    for (int i = 0; i <= kParts; ++i) {
      const Eigen::Vector2d pixel(intrinsics.width_px * i / static_cast<double>(kParts),
                                  intrinsics.height_px * j / static_cast<double>(kParts));
      const Eigen::Vector3d ray = camera->ray_from_pixel(pixel);
      if (ray.z() <= 0.0)
        fail(
            ErrorKind::Config,
            "pixel ({}, {}) looks behind the camera, {:.1f} degrees off its axis; COLMAP's cameras "
            "see less than 90: a longer focal length or a smaller image does",
            pixel.x(), pixel.y(),
            std::atan2(ray.head<2>().norm(), ray.z()) * (180.0 / std::numbers::pi));
    }
  }
}

}  // namespace terracast::exporters
