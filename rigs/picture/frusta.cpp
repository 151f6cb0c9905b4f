#include <algorithm>
#include <cmath>

#include "rigs/picture/panels.h"

namespace terracast::rigs {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Seen from far away, from behind the rig, its right and above: forward goes up to the right, left to the left.
const Vector3d kTowardsViewer = Vector3d(-0.55, -0.62, 0.56).normalized();

struct Face {
  double nearness;
  Shape shape;
};

/// Maps points of the rig, in m, into a panel.
class Sight {
 public:
  Sight(const Panel& panel, const std::vector<Vector3d>& points_rig) {
    right_ = Vector3d::UnitZ().cross(kTowardsViewer).normalized();
    up_ = kTowardsViewer.cross(right_);
    Vector2d low = flat(points_rig.front()), high = low;
    for (const Vector3d& point : points_rig) {
      low = low.cwiseMin(flat(point));
      high = high.cwiseMax(flat(point));
    }
    const Vector2d extent = (high - low).cwiseMax(1e-6);
    scale_ = std::min(panel.width / extent.x(), panel.height / extent.y());
    shift_ = Vector2d(panel.left + 0.5 * panel.width, panel.top + 0.5 * panel.height) -
             scale_ * 0.5 * (low + high);
  }
  Vector2d operator()(const Vector3d& point_rig) const { return scale_ * flat(point_rig) + shift_; }
  double pixels_per_m() const { return scale_; }

 private:
  Vector2d flat(const Vector3d& point) const { return {right_.dot(point), -up_.dot(point)}; }
  Vector3d right_, up_;
  double scale_ = 1.0;
  Vector2d shift_ = Vector2d::Zero();
};

/// Where the rays of the border of a camera's image start, and where they are drawn to: to a depth, or around the
/// camera where it sees to the side and behind.
struct Frustum {
  std::vector<Vector3d> starts_rig;
  std::vector<Vector3d> border_rig;
};

Frustum frustum_of(const RigView& rig, std::size_t camera, double depth_m) {
  constexpr int kPointsASide = 12;
  constexpr double kFlattest = 0.35;  // cosine up to which an image is drawn as a plane: 140 deg
  const geo::Rigid3d& rig_from_camera = rig.cameras()[camera].rig_from_camera;
  std::vector<BorderRay> rays = border_of(rig.model(camera), kPointsASide);
  bool is_flat = true;
  for (BorderRay& ray : rays) {
    ray.direction_camera.normalize();
    is_flat = is_flat && ray.direction_camera.z() > kFlattest;
  }
  Frustum frustum;
  for (const BorderRay& ray : rays) {
    const Vector3d& direction = ray.direction_camera;
    frustum.starts_rig.push_back(rig_from_camera * ray.origin_camera);
    frustum.border_rig.push_back(
        rig_from_camera *
        Vector3d(ray.origin_camera + direction * (is_flat ? depth_m / direction.z() : depth_m)));
  }
  return frustum;
}

double nearness_of(const std::vector<Vector3d>& points) {
  Vector3d middle = Vector3d::Zero();
  for (const Vector3d& point : points) middle += point;
  return middle.dot(kTowardsViewer) / static_cast<double>(points.size());
}

/// 1, 2 or 5 times a power of ten, no more than so much.
double round_length(double most) {
  const double power = std::pow(10.0, std::floor(std::log10(most)));
  for (const double digit : {5.0, 2.0})
    if (digit * power <= most) return digit * power;
  return power;
}

std::string length_text(double length_m) {
  return length_m < 1.0 ? fmt::format("{:g} mm", length_m * 1e3) : fmt::format("{:g} m", length_m);
}

}  // namespace

void draw_frusta(Drawing& drawing, const Panel& panel, const RigView& rig) {
  drawing.add(Label{{panel.left, panel.top + 14.0}, "Frusta", 14.0, Anchor::Start, kInk});
  double extent_m = 0.0;
  for (const auto& a : rig.cameras())
    for (const auto& b : rig.cameras())
      extent_m = std::max(extent_m,
                          (a.rig_from_camera.translation - b.rig_from_camera.translation).norm());
  for (std::size_t i = 0; i < rig.cameras().size(); ++i) {
    const Swath swath = swath_of(rig.model(i));
    extent_m = std::max(extent_m, std::hypot(swath.width_m, swath.height_m));
  }
  const double depth_m = extent_m > 0.0 ? 0.55 * extent_m : 0.2;

  const double axis_m = 0.7 * depth_m;
  std::vector<Frustum> frusta;
  std::vector<Vector3d> all = {Vector3d::Zero(), Vector3d(axis_m, 0.0, 0.0),
                               Vector3d(0.0, axis_m, 0.0), Vector3d(0.0, 0.0, axis_m)};
  for (std::size_t i = 0; i < rig.cameras().size(); ++i) {
    frusta.push_back(frustum_of(rig, i, depth_m));
    for (const auto* points : {&frusta.back().starts_rig, &frusta.back().border_rig})
      all.insert(all.end(), points->begin(), points->end());
    all.push_back(rig.cameras()[i].rig_from_camera.translation);
  }
  const Panel inner{.left = panel.left + 20.0,
                    .top = panel.top + 34.0,
                    .width = panel.width - 40.0,
                    .height = panel.height - 84.0};
  const Sight sight(inner, all);

  std::vector<Face> faces;
  const auto add_face = [&](const std::vector<Vector3d>& points, std::size_t camera,
                            double opacity) {
    Shape shape{.outlines = {{}},
                .fill = color_of_camera(camera, opacity),
                .stroke = color_of_camera(camera, 0.55),
                .stroke_width = 1.0,
                .is_closed = true};
    for (const Vector3d& point : points) shape.outlines[0].push_back(sight(point));
    faces.push_back({nearness_of(points), std::move(shape)});
  };
  for (std::size_t i = 0; i < frusta.size(); ++i) {
    const std::vector<Vector3d>& border = frusta[i].border_rig;
    if (border.size() < 4) continue;
    const std::vector<Vector3d>& starts = frusta[i].starts_rig;
    for (std::size_t side = 0; side < 4; ++side) {
      const std::size_t begin = side * border.size() / 4, end = (side + 1) * border.size() / 4;
      std::vector<Vector3d> points = {starts[end % border.size()]};
      if (starts[begin] != points[0]) points.push_back(starts[begin]);
      for (std::size_t k = begin; k <= end; ++k) points.push_back(border[k % border.size()]);
      add_face(points, i, 0.10);
    }
    add_face(border, i, 0.22);
  }
  std::sort(faces.begin(), faces.end(),
            [](const Face& a, const Face& b) { return a.nearness < b.nearness; });
  for (Face& face : faces) drawing.add(std::move(face.shape));

  for (std::size_t i = 0; i < frusta.size(); ++i) {
    const std::vector<Vector3d>& border = frusta[i].border_rig;
    const Vector3d centre = rig.cameras()[i].rig_from_camera.translation;
    // The image's upper edge is strong.
    Shape edge{.outlines = {{}}, .fill = {}, .stroke = color_of_camera(i), .stroke_width = 3.0};
    for (std::size_t k = 0; k <= border.size() / 4 && !border.empty(); ++k)
      edge.outlines[0].push_back(sight(border[k]));
    drawing.add(std::move(edge));
    const Vector2d at = sight(centre);
    drawing.add(Shape{
        .outlines = {{at, at}}, .fill = {}, .stroke = color_of_camera(i), .stroke_width = 7.0});
    const Vector3d axis = rig.cameras()[i].rig_from_camera.rotation * Vector3d::UnitZ();
    drawing.add(Label{sight(centre + axis * depth_m) + Vector2d(0.0, 5.0), fmt::format("{}", i),
                      14.0, Anchor::Middle, kInk});
  }

  const Vector3d axes[] = {Vector3d::UnitX(), Vector3d::UnitY(), Vector3d::UnitZ()};
  const char* names[] = {"x forward", "y left", "z up"};
  const Color colors[] = {{196, 51, 47}, {46, 134, 70}, {45, 87, 180}};
  for (int k = 0; k < 3; ++k) {
    const Vector2d tip = sight(axes[k] * axis_m);
    drawing.add(Shape{.outlines = {{sight(Vector3d::Zero()), tip}},
                      .fill = {},
                      .stroke = colors[k],
                      .stroke_width = 2.0});
    const bool goes_left = tip.x() < sight(Vector3d::Zero()).x();
    drawing.add(Label{tip + Vector2d(goes_left ? -5.0 : 5.0, k == 2 ? -4.0 : 4.0), names[k], 12.0,
                      k == 2 ? Anchor::Middle : (goes_left ? Anchor::End : Anchor::Start),
                      colors[k]});
  }

  const double bar_m = round_length(140.0 / sight.pixels_per_m());
  const double y = panel.top + panel.height - 14.0;
  drawing.add(Shape{.outlines = {{{panel.left, y}, {panel.left + bar_m * sight.pixels_per_m(), y}}},
                    .fill = {},
                    .stroke = kInk,
                    .stroke_width = 2.0});
  drawing.add(Label{{panel.left, y - 7.0}, length_text(bar_m), 12.0, Anchor::Start, kInk});
}

}  // namespace terracast::rigs
