#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>

#include "geo/units.h"
#include "rigs/picture/panels.h"

namespace terracast::rigs {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Hammer's equal-area projection of the directions about the rig (E. Hammer, 1892): forward in the middle, left on the
/// left, up at the top, back at both ends. x within 2 sqrt 2 of 0, y within sqrt 2.
Vector2d hammer_of(const Vector3d& direction_rig) {
  const Vector3d d = direction_rig.normalized();
  const double longitude = std::atan2(-d.y(), d.x());
  const double latitude = std::asin(std::clamp(d.z(), -1.0, 1.0));
  const double k =
      std::numbers::sqrt2 / std::sqrt(1.0 + std::cos(latitude) * std::cos(0.5 * longitude));
  return {2.0 * k * std::cos(latitude) * std::sin(0.5 * longitude), k * std::sin(latitude)};
}

std::optional<Vector3d> direction_of(const Vector2d& hammer) {
  const double square = 0.125 * hammer.x() * hammer.x() + 0.5 * hammer.y() * hammer.y();
  if (square > 1.0) return std::nullopt;
  const double z = std::sqrt(1.0 - 0.5 * square);
  const double longitude = 2.0 * std::atan2(z * hammer.x(), 2.0 * (2.0 * z * z - 1.0));
  const double latitude = std::asin(std::clamp(z * hammer.y(), -1.0, 1.0));
  return Vector3d(std::cos(latitude) * std::cos(longitude),
                  -std::cos(latitude) * std::sin(longitude), std::sin(latitude));
}

/// From white over blue to dark blue.
Color color_of_count(int count, int most) {
  if (count == 0) return {243, 244, 246};
  const double t = most > 1 ? static_cast<double>(count - 1) / (most - 1) : 0.0;
  const auto mixed = [&](double light, double dark) {
    return static_cast<std::uint8_t>(std::lround(light + t * (dark - light)));
  };
  return {mixed(188, 24), mixed(214, 62), mixed(240, 126)};
}

Vector3d direction_of_angles(double azimuth_deg, double elevation_deg) {
  const double azimuth = geo::radians_from_degrees(azimuth_deg);
  const double elevation = geo::radians_from_degrees(elevation_deg);
  return {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
          std::sin(elevation)};
}

}  // namespace

void draw_coverage(Drawing& drawing, const Panel& panel, const RigView& rig) {
  drawing.add(Label{{panel.left, panel.top + 14.0},
                    "Directions by the number of cameras that see them",
                    14.0,
                    Anchor::Start,
                    kInk});
  const double half_width = 0.5 * panel.width, half_height = 0.5 * half_width;
  const Vector2d middle(panel.left + half_width, panel.top + 52.0 + half_height);
  const double scale = half_width / (2.0 * std::numbers::sqrt2);
  const auto on_map = [&](const Vector2d& hammer) {
    return Vector2d(middle.x() + scale * hammer.x(), middle.y() - scale * hammer.y());
  };

  // Runs of cells that equally many cameras see.
  constexpr double kCell = 2.5;
  std::map<int, Shape> cells;
  const auto num_rows = static_cast<int>(2.0 * half_height / kCell);
  const auto num_columns = static_cast<int>(2.0 * half_width / kCell);
  for (int row = 0; row < num_rows; ++row) {
    const double y = (row + 0.5) * kCell - half_height;
    int run_count = -1, run_begin = 0;
    for (int column = 0; column <= num_columns; ++column) {
      const double x = (column + 0.5) * kCell - half_width;
      int count = -1;
      if (column < num_columns)
        if (const auto direction = direction_of({x / scale, -y / scale}))
          count = std::popcount(rig.find_seeing(*direction));
      if (count == run_count) continue;
      if (run_count >= 0) {
        const double left = middle.x() - half_width + run_begin * kCell;
        const double right = middle.x() - half_width + column * kCell;
        const double top = middle.y() - half_height + row * kCell;
        // A little over the next row, so that no seam shows.
        cells[run_count].outlines.push_back(
            {{left, top}, {right, top}, {right, top + kCell + 0.3}, {left, top + kCell + 0.3}});
      }
      run_count = count;
      run_begin = column;
    }
  }
  int most = 1;
  for (int count = 1; count <= static_cast<int>(rig.cameras().size()); ++count)
    if (rig.share_seen_by(count) > 0.0) most = count;
  for (auto& [count, shape] : cells) {
    shape.fill = color_of_count(count, most);
    drawing.add(std::move(shape));
  }

  Shape graticule{
      .outlines = {}, .fill = {}, .stroke = Color{150, 158, 168, 0.45}, .stroke_width = 0.7};
  constexpr double kStep_deg = 3.0;
  constexpr double kAlmostBack_deg = 179.999;
  for (int azimuth = -180; azimuth <= 180; azimuth += 30) {
    Shape::Outline line;
    for (double elevation = -90.0; elevation <= 90.0; elevation += kStep_deg)
      line.push_back(on_map(hammer_of(direction_of_angles(
          std::clamp<double>(azimuth, -kAlmostBack_deg, kAlmostBack_deg), elevation))));
    graticule.outlines.push_back(std::move(line));
  }
  for (int elevation = -60; elevation <= 60; elevation += 30) {
    Shape::Outline line;
    for (double azimuth = -180.0; azimuth <= 180.0; azimuth += kStep_deg)
      line.push_back(on_map(hammer_of(
          direction_of_angles(std::clamp(azimuth, -kAlmostBack_deg, kAlmostBack_deg), elevation))));
    graticule.outlines.push_back(std::move(line));
  }
  drawing.add(std::move(graticule));

  for (std::size_t i = 0; i < rig.cameras().size(); ++i) {
    const geo::Rigid3d& rig_from_camera = rig.cameras()[i].rig_from_camera;
    Shape outline{.outlines = {{}}, .fill = {}, .stroke = color_of_camera(i), .stroke_width = 1.8};
    std::vector<BorderRay> rays = border_of(rig.model(i), 60);
    if (!rays.empty()) rays.push_back(rays.front());
    for (const BorderRay& ray : rays) {
      const Vector2d point = on_map(hammer_of(rig_from_camera.rotation * ray.direction_camera));
      // Over the back of the map a line goes on at its other end.
      if (!outline.outlines.back().empty() &&
          (point - outline.outlines.back().back()).norm() > 0.25 * panel.width)
        outline.outlines.emplace_back();
      outline.outlines.back().push_back(point);
    }
    drawing.add(std::move(outline));
  }
  for (std::size_t i = 0; i < rig.cameras().size(); ++i) {
    const Vector3d axis = rig.cameras()[i].rig_from_camera.rotation * Vector3d::UnitZ();
    // Of two at one place the later stands beside.
    double shift = 0.0;
    for (std::size_t k = 0; k < i; ++k)
      if ((rig.cameras()[k].rig_from_camera.rotation * Vector3d::UnitZ() - axis).norm() < 0.05)
        shift += 18.0;
    // Whole within the map's edge.
    Vector2d place = on_map(hammer_of(axis)) - middle;
    const double edge = place.cwiseQuotient(Vector2d(half_width - 14.0, half_height - 12.0)).norm();
    place = middle + place / std::max(1.0, edge);
    const Color below = color_of_count(std::popcount(rig.find_seeing(axis)), most);
    drawing.add(Label{place + Vector2d(shift, 5.0), fmt::format("{}", i), 14.0, Anchor::Middle,
                      below.red < 100 ? Color{255, 255, 255} : kInk});
  }

  const double below = middle.y() + half_height + 16.0;
  drawing.add(
      Label{{middle.x(), middle.y() - half_height - 6.0}, "up", 12.0, Anchor::Middle, kFaintInk});
  drawing.add(Label{{middle.x(), below}, "down", 12.0, Anchor::Middle, kFaintInk});
  drawing.add(Label{
      {middle.x() - half_width, below - 2.0}, "left half of back", 12.0, Anchor::Start, kFaintInk});
  drawing.add(Label{
      {middle.x() + half_width, below - 2.0}, "right half of back", 12.0, Anchor::End, kFaintInk});

  double x = panel.left;
  for (int count = 0; count <= most; ++count) {
    if (rig.share_seen_by(count) <= 0.0) continue;
    const double y = below + 18.0;
    drawing.add(Shape{.outlines = {{{x, y}, {x + 14.0, y}, {x + 14.0, y + 14.0}, {x, y + 14.0}}},
                      .fill = color_of_count(count, most),
                      .stroke = kRule,
                      .stroke_width = 1.0,
                      .is_closed = true});
    drawing.add(Label{{x + 19.0, y + 12.0},
                      fmt::format("{}: {:.1f} %", count, 100.0 * rig.share_seen_by(count)),
                      12.0,
                      Anchor::Start,
                      kInk});
    x += 84.0;
  }
}

}  // namespace terracast::rigs
