#include <algorithm>
#include <cmath>
#include <iterator>

#include "geo/units.h"
#include "rigs/picture/panels.h"

namespace terracast::rigs {
namespace {

constexpr double kRow = 23.0;

/// A name that does not run into the next column.
std::string shortened(const std::string& name, std::size_t most) {
  return name.size() <= most ? name : name.substr(0, most - 2) + "..";
}

/// Rows start below the panel's heading and the columns'.
double row_top(const Panel& panel, std::size_t row) {
  return panel.top + 44.0 + kRow * static_cast<double>(row);
}

/// So many digits, and no sign of a zero.
std::string rounded(double value, int num_digits) {
  const double scale = std::pow(10.0, num_digits);
  return fmt::format("{:.{}f}", std::round(value * scale) / scale + 0.0, num_digits);
}

/// Degrees, or metres where the camera sees as much from near and from far.
std::string view_cell(const geo::CameraModel& camera) {
  const FieldOfView view = field_of_view(camera);
  const Swath swath = swath_of(camera);
  const auto part = [](double angle_deg, double length_m) {
    return length_m > 0.0 ? fmt::format("{:.4g} m", length_m) : fmt::format("{:.1f}", angle_deg);
  };
  return part(view.horizontal_deg, swath.width_m) + "\xc3\x97" +
         part(view.vertical_deg, swath.height_m);
}

void draw_number(Drawing& drawing, double x, double base_line, std::size_t camera) {
  drawing.add(Label{
      {x, base_line}, fmt::format("{}", camera), 13.0, Anchor::Middle, color_of_camera(camera)});
}

}  // namespace

void draw_overlaps(Drawing& drawing, const Panel& panel, const RigView& rig) {
  drawing.add(Label{{panel.left, panel.top + 14.0},
                    "Views shared, % of the view of the row",
                    14.0,
                    Anchor::Start,
                    kInk});
  const std::size_t count = rig.cameras().size();
  constexpr double kNames = 118.0;
  const double cell = std::min(40.0, (panel.width - kNames) / static_cast<double>(count));
  const double size = cell < 24.0 ? 9.0 : 12.0;
  for (std::size_t row = 0; row < count; ++row) {
    const double top = row_top(panel, row), base_line = top + 16.0;
    draw_number(drawing, panel.left + 8.0, base_line, row);
    drawing.add(Label{{panel.left + 22.0, base_line},
                      shortened(rig.cameras()[row].name, 12),
                      12.0,
                      Anchor::Start,
                      kInk});
    draw_number(drawing, panel.left + kNames + cell * (static_cast<double>(row) + 0.5),
                row_top(panel, 0) - 6.0, row);
    for (std::size_t column = 0; column < count; ++column) {
      const double share = rig.overlap(row, column);
      const double left = panel.left + kNames + cell * static_cast<double>(column);
      const auto mixed = [&](double dark) {
        return static_cast<std::uint8_t>(std::lround(255.0 + share * (dark - 255.0)));
      };
      const Color shade{mixed(38), mixed(92), mixed(160)};
      drawing.add(Shape{
          .outlines =
              {{{left, top}, {left + cell, top}, {left + cell, top + kRow}, {left, top + kRow}}},
          .fill = shade,
          .stroke = kRule,
          .stroke_width = 1.0,
          .is_closed = true});
      const double percent = 100.0 * share;
      if (percent <= 0.0) continue;
      const Color ink = share > 0.55 ? Color{255, 255, 255} : kInk;
      drawing.add(Label{{left + 0.5 * cell, base_line},
                        percent < 0.5 ? "0" : fmt::format("{:.0f}", percent),
                        size,
                        Anchor::Middle,
                        ink});
    }
  }
}

void draw_table(Drawing& drawing, const Panel& panel, const RigView& rig) {
  drawing.add(Label{{panel.left, panel.top + 14.0}, "Cameras", 14.0, Anchor::Start, kInk});
  struct Column {
    const char* heading;
    double right;
  };
  const Column columns[] = {{"image, px", 185.0},
                            {"f, px", 247.0},
                            {"view, \xc2\xb0", 344.0},
                            {"centre, mm", 470.0},
                            {"az., el., \xc2\xb0", 570.0}};
  for (const Column& column : columns)
    drawing.add(Label{{panel.left + column.right, panel.top + 36.0},
                      column.heading,
                      11.0,
                      Anchor::End,
                      kFaintInk});
  for (std::size_t i = 0; i < rig.cameras().size(); ++i) {
    const capture::CameraCalibration& camera = rig.cameras()[i];
    const double top = row_top(panel, i), base_line = top + 16.0;
    const Eigen::Vector3d t = camera.rig_from_camera.translation * 1e3;
    const Eigen::Vector3d axis = camera.rig_from_camera.rotation * Eigen::Vector3d::UnitZ();
    const double elevation = geo::degrees_from_radians(std::asin(std::clamp(axis.z(), -1.0, 1.0)));
    // Straight up or down an azimuth says nothing.
    const double azimuth = std::hypot(axis.x(), axis.y()) < 1e-6
                               ? 0.0
                               : geo::degrees_from_radians(std::atan2(axis.y(), axis.x()));
    const std::string cells[] = {
        fmt::format("{}\xc3\x97{}", camera.intrinsics.width_px, camera.intrinsics.height_px),
        fmt::format("{:.1f}", camera.intrinsics.parameters[0]), view_cell(rig.model(i)),
        fmt::format("{}, {}, {}", rounded(t.x(), 0), rounded(t.y(), 0), rounded(t.z(), 0)),
        fmt::format("{}, {}", rounded(azimuth, 1), rounded(elevation, 1))};
    drawing.add(
        Shape{.outlines = {{{panel.left, top + kRow}, {panel.left + panel.width, top + kRow}}},
              .fill = {},
              .stroke = kRule,
              .stroke_width = 1.0});
    draw_number(drawing, panel.left + 8.0, base_line, i);
    drawing.add(Label{
        {panel.left + 22.0, base_line}, shortened(camera.name, 12), 12.0, Anchor::Start, kInk});
    for (std::size_t k = 0; k < std::size(columns); ++k)
      drawing.add(
          Label{{panel.left + columns[k].right, base_line}, cells[k], 12.0, Anchor::End, kInk});
  }
}

}  // namespace terracast::rigs
