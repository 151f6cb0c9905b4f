#include "tiler/objects/air_parts.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace terracast::tiler {

using Eigen::Vector3d;

void add_fuselage(ThingMesh& mesh, const std::vector<Section>& sections, int num_sides,
                  const FinishOfFace& finish, FinishNumber ends) {
  std::vector<Ring> rings;
  for (const Section& section : sections)
    rings.push_back(ring_across(
        section.x_m,
        round_outline(section.half_width_m, section.half_height_m, num_sides, {0.0, section.z_m})));
  mesh.loft(rings, finish, ends, ends);
}

void add_wing(ThingMesh& mesh, const std::vector<WingSection>& sections, const Vector3d& up,
              int detail, FinishNumber finish) {
  // Shares of the chord from the leading edge, and of the thickness above the chord.
  static const std::vector<Eigen::Vector2d> kFine = {{0.0, 0.0},  {0.06, 0.34}, {0.3, 0.6},
                                                     {0.7, 0.34}, {1.0, 0.03},  {1.0, -0.03},
                                                     {0.7, -0.2}, {0.3, -0.4},  {0.06, -0.24}};
  static const std::vector<Eigen::Vector2d> kCoarse = {
      {0.0, 0.0}, {0.3, 0.6}, {1.0, 0.05}, {1.0, -0.05}, {0.3, -0.4}};
  std::vector<Ring> rings;
  for (const WingSection& section : sections) {
    Ring ring;
    for (const Eigen::Vector2d& at : detail == 0 ? kFine : kCoarse)
      ring.emplace_back(section.leading_edge - at.x() * section.chord_m * Vector3d::UnitX() +
                        at.y() * section.thickness_m * up);
    rings.push_back(std::move(ring));
  }
  mesh.loft(rings, finish);
}

void add_wing_pair(ThingMesh& mesh, const std::vector<WingSection>& left_half, int detail,
                   FinishNumber finish) {
  std::vector<WingSection> sections;
  for (std::size_t i = left_half.size(); i-- > 0;) {
    if (left_half[i].leading_edge.y() == 0.0) continue;
    sections.push_back(left_half[i]);
    sections.back().leading_edge.y() *= -1.0;
  }
  sections.insert(sections.end(), left_half.begin(), left_half.end());
  add_wing(mesh, sections, Vector3d::UnitZ(), detail, finish);
}

void add_blades(ThingMesh& mesh, const Vector3d& hub, const Vector3d& axis,
                const Vector3d& first_blade, double radius_m, double chord_m, int num_blades,
                FinishNumber finish, double thickness_m) {
  for (int k = 0; k < num_blades; ++k) {
    const Vector3d along =
        Eigen::AngleAxisd(2.0 * std::numbers::pi * k / num_blades, axis) * first_blade;
    const Vector3d across = axis.cross(along);
    const auto ring = [&](double at_m, double width_m) {
      const Vector3d middle = hub + at_m * along;
      const Vector3d half_width = 0.5 * width_m * across;
      const Vector3d half_up = 0.5 * thickness_m * axis;
      return Ring{middle - half_width - half_up, middle + half_width - half_up,
                  middle + half_width + half_up, middle - half_width + half_up};
    };
    mesh.loft({ring(0.04 * radius_m, 0.5 * chord_m), ring(0.25 * radius_m, chord_m),
               ring(radius_m, 0.8 * chord_m)},
              finish);
  }
}

}  // namespace terracast::tiler
