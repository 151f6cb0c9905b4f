#include "rigs/rig_view.h"

#include <bit>
#include <cmath>
#include <numbers>
#include <optional>

#include "geo/units.h"

namespace terracast::rigs {
namespace {

/// The first point with a ray on the way from an edge of the image inwards, in steps of a pixel.
Eigen::Vector3d first_ray(const geo::CameraModel& camera, Eigen::Vector2d pixel,
                          const Eigen::Vector2d& inwards, int num_steps) {
  for (int step = 0; step < num_steps; ++step, pixel += inwards) {
    const Eigen::Vector3d ray = camera.ray_from_pixel(pixel);
    if (ray.allFinite()) return ray;
  }
  return Eigen::Vector3d::UnitZ();
}

/// The principal point's coordinate where that lies within the image, else the image's middle.
double middle_of(double principal_point_px, int size_px) {
  const bool is_inside = principal_point_px >= 0.0 && principal_point_px < size_px;
  return is_inside ? principal_point_px : 0.5 * size_px;
}

}  // namespace

FieldOfView field_of_view(const geo::CameraModel& camera) {
  const std::vector<double>& p = camera.intrinsics().parameters;
  const int width = camera.width_px(), height = camera.height_px();
  const double x = middle_of(p[2], width), y = middle_of(p[3], height);
  const Eigen::Vector3d left = first_ray(camera, {0.0, y}, {1.0, 0.0}, width);
  const Eigen::Vector3d right = first_ray(camera, {width, y}, {-1.0, 0.0}, width);
  const Eigen::Vector3d top = first_ray(camera, {x, 0.0}, {0.0, 1.0}, height);
  const Eigen::Vector3d bottom = first_ray(camera, {x, height}, {0.0, -1.0}, height);
  return {.horizontal_deg = geo::degrees_from_radians(std::atan2(right.x(), right.z()) -
                                                      std::atan2(left.x(), left.z())),
          .vertical_deg = geo::degrees_from_radians(std::atan2(bottom.y(), bottom.z()) -
                                                    std::atan2(top.y(), top.z()))};
}

Swath swath_of(const geo::CameraModel& camera) {
  if (camera.is_central()) return {};
  const Eigen::Vector3d first = camera.origin_from_pixel({0.0, 0.0});
  const Eigen::Vector3d right = camera.origin_from_pixel({double(camera.width_px()), 0.0});
  const Eigen::Vector3d below = camera.origin_from_pixel({0.0, double(camera.height_px())});
  return {.width_m = (right - first).norm(), .height_m = (below - first).norm()};
}

std::string view_text(const geo::CameraModel& camera) {
  const FieldOfView view = field_of_view(camera);
  if (camera.is_central())
    return fmt::format("{:.3f} x {:.3f} deg, horizontally and vertically", view.horizontal_deg,
                       view.vertical_deg);
  const Swath swath = swath_of(camera);
  return swath.width_m == 0.0
             ? fmt::format("{:.3f} deg across the way, {:.3f} m of it", view.horizontal_deg,
                           swath.height_m)
             : fmt::format("{:.3f} x {:.3f} m, horizontally and vertically, at any distance",
                           swath.width_m, swath.height_m);
}

RigView::RigView(const rigs::RigOptions& rig)
    : name_(rig.name), cameras_(rigs::build_cameras({rig})) {
  for (const capture::CameraCalibration& camera : cameras_)
    models_.push_back(geo::make_camera(camera.intrinsics));
  seen_together_.assign(cameras_.size(), std::vector<int>(cameras_.size(), 0));
  seen_by_.assign(cameras_.size() + 1, 0);
  for (int i = 0; i < kSamples; ++i) {
    // Spread evenly over the sphere, by the golden angle.
    const double z = 1.0 - 2.0 * (i + 0.5) / kSamples;
    const double turn = std::numbers::pi * (3.0 - std::sqrt(5.0)) * i;
    const double r = std::sqrt(1.0 - z * z);
    const std::uint32_t seeing = find_seeing({r * std::cos(turn), r * std::sin(turn), z});
    ++seen_by_[static_cast<std::size_t>(std::popcount(seeing))];
    for (std::size_t a = 0; a < cameras_.size(); ++a)
      for (std::size_t b = 0; b < cameras_.size(); ++b)
        if ((seeing >> a & 1U) != 0 && (seeing >> b & 1U) != 0) ++seen_together_[a][b];
  }
}

std::uint32_t RigView::find_seeing(const Eigen::Vector3d& direction_rig) const {
  std::uint32_t seeing = 0;
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    if (!models_[i]->is_central()) continue;
    const Eigen::Vector3d ray = cameras_[i].rig_from_camera.rotation.conjugate() * direction_rig;
    const std::optional<Eigen::Vector2d> pixel = models_[i]->pixel_from_ray(ray);
    if (pixel && models_[i]->contains(*pixel)) seeing |= std::uint32_t{1} << i;
  }
  return seeing;
}

double RigView::overlap(std::size_t of_camera, std::size_t with_camera) const {
  const int num_seen = seen_together_[of_camera][of_camera];
  if (num_seen == 0) return 0.0;
  return static_cast<double>(seen_together_[of_camera][with_camera]) / num_seen;
}

double RigView::share_seen_by(int num_cameras) const {
  return static_cast<double>(seen_by_.at(static_cast<std::size_t>(num_cameras))) / kSamples;
}

std::string rig_text(const RigView& rig) {
  std::string text = fmt::format("rig {}: {} cameras\n", rig.name(), rig.cameras().size());
  for (std::size_t i = 0; i < rig.cameras().size(); ++i) {
    const capture::CameraCalibration& camera = rig.cameras()[i];
    const std::vector<double>& p = camera.intrinsics.parameters;
    const Eigen::Matrix3d r = camera.rig_from_camera.rotation.toRotationMatrix();
    const Eigen::Vector3d& t = camera.rig_from_camera.translation;
    text += fmt::format("\ncamera {} {}\n  model  {}\n  image  {} x {} px\n", i, camera.name,
                        camera.intrinsics.model, camera.intrinsics.width_px,
                        camera.intrinsics.height_px);
    text += fmt::format("  view   {}\n", view_text(rig.model(i)));
    if (!rig.model(i).is_central())
      text += swath_of(rig.model(i)).width_m > 0.0
                  ? fmt::format("  scale  {:g} x {:g} px a metre\n", p[0], p[1])
                  : fmt::format(
                        "  scale  {:g} px by the tangent across the way, {:g} rows a metre of it\n",
                        p[0], p[1]);
    text += fmt::format("  K      {:14.6f} {:14.6f} {:14.6f}\n", p[0], 0.0, p[2]);
    text += fmt::format("         {:14.6f} {:14.6f} {:14.6f}\n", 0.0, p[1], p[3]);
    text += fmt::format("         {:14.6f} {:14.6f} {:14.6f}\n", 0.0, 0.0, 1.0);
    constexpr std::size_t kMostShown = 4 + 16;
    if (p.size() > kMostShown)
      text += fmt::format("  lens   {} numbers\n", p.size() - 4);
    else if (p.size() > 4)
      text +=
          fmt::format("  lens   {}\n", fmt::join(std::vector<double>(p.begin() + 4, p.end()), " "));
    for (int row = 0; row < 3; ++row)
      text += fmt::format("  {:5}  {:14.9f} {:14.9f} {:14.9f} {:14.9f}\n", row == 0 ? "T" : "",
                          r(row, 0), r(row, 1), r(row, 2), t(row));
    text += fmt::format("  {:5}  {:14.9f} {:14.9f} {:14.9f} {:14.9f}\n", "", 0.0, 0.0, 0.0, 1.0);
  }
  text +=
      "\nK has pixels with the top-left one's centre at (0.5, 0.5). T takes points of the camera "
      "(x "
      "right, y down, z forward)\nto the rig (x forward, y left, z up), in m.\n\ndirections seen "
      "by\n";
  for (int count = 0; count <= static_cast<int>(rig.cameras().size()); ++count)
    if (rig.share_seen_by(count) > 0.0)
      text += fmt::format("  {:2} cameras {:6.2f} %\n", count, 100.0 * rig.share_seen_by(count));
  return text;
}

}  // namespace terracast::rigs
