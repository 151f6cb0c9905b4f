#include "capture/kalibr_text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "core/error.h"

namespace terracast::capture {

KalibrCamera kalibr_camera(const geo::CameraIntrinsics& intrinsics, std::string_view camera) {
  constexpr double kCentreOfFirstPixel_px = 0.5;
  const auto known =
      std::find_if(kKalibrModels.begin(), kKalibrModels.end(),
                   [&](const KalibrModel& row) { return row.model == intrinsics.model; });
  if (known == kKalibrModels.end()) {
    std::vector<std::string_view> models;
    for (const KalibrModel& row : kKalibrModels)
      if (std::find(models.begin(), models.end(), row.model) == models.end())
        models.push_back(row.model);
    core::fail(core::ErrorKind::Config, "camera {}: Kalibr has no model {}; it holds {}", camera,
               intrinsics.model, fmt::join(models, ", "));
  }
  const std::vector<double>& p = intrinsics.parameters;
  const auto own = p.begin() + 4;
  const auto coefficients = own + static_cast<std::ptrdiff_t>(known->num_leading);
  KalibrCamera written{.camera_model = known->camera_model,
                       .distortion_model = known->distortion_model,
                       .intrinsics = {own, coefficients},
                       .coefficients = {coefficients, p.end()},
                       .width_px = intrinsics.width_px,
                       .height_px = intrinsics.height_px};
  written.intrinsics.insert(written.intrinsics.end(), {p[0], p[1], p[2] - kCentreOfFirstPixel_px,
                                                       p[3] - kCentreOfFirstPixel_px});
  written.coefficients.resize(known->num_coefficients, 0.0);
  return written;
}

std::string KalibrCamera::text() const {
  return fmt::format(
      "  camera_model: {}\n  intrinsics: [{}]\n  distortion_model: {}\n  distortion_coeffs: [{}]\n"
      "  resolution: [{}, {}]\n",
      camera_model, yaml_numbers(intrinsics), distortion_model, yaml_numbers(coefficients),
      width_px, height_px);
}

std::string yaml_numbers(const std::vector<double>& numbers) {
  std::string text;
  for (const double number : numbers)
    text += fmt::format("{}{:#}", text.empty() ? "" : ", ", number + 0.0);  // + 0: no -0
  return text;
}

std::string yaml_rows(const geo::Rigid3d& target_from_source) {
  const Eigen::Matrix3d r = target_from_source.rotation.toRotationMatrix();
  const Eigen::Vector3d& t = target_from_source.translation;
  std::string text;
  for (int row = 0; row < 3; ++row)
    text += fmt::format("    - [{}]\n", yaml_numbers({r(row, 0), r(row, 1), r(row, 2), t(row)}));
  return text + "    - [0.0, 0.0, 0.0, 1.0]\n";
}

}  // namespace terracast::capture
