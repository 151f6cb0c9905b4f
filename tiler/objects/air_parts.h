#pragma once

#include <vector>

#include "tiler/objects/things.h"

namespace terracast::tiler {

/// A cross-section of a fuselage or a hull of revolution.
struct Section {
  double x_m;
  double z_m;  ///< of its middle
  double half_width_m;
  double half_height_m;
};
/// rings of sections from nose to tail
void add_fuselage(ThingMesh& mesh, const std::vector<Section>& sections, int num_sides,
                  const FinishOfFace& finish, FinishNumber ends);

/// A section of a wing: its leading edge; the chord goes aft.
struct WingSection {
  Eigen::Vector3d leading_edge;
  double chord_m;
  double thickness_m;
};
/// Sections from one tip to the other; `up` is across chord and span.
void add_wing(ThingMesh& mesh, const std::vector<WingSection>& sections, const Eigen::Vector3d& up,
              int detail, FinishNumber finish);
/// The same on both sides of y = 0, as one body: sections of the left half from the root out.
void add_wing_pair(ThingMesh& mesh, const std::vector<WingSection>& left_half, int detail,
                   FinishNumber finish);

/// A propeller or rotor of blades about an axis.
void add_blades(ThingMesh& mesh, const Eigen::Vector3d& hub, const Eigen::Vector3d& axis,
                const Eigen::Vector3d& first_blade, double radius_m, double chord_m, int num_blades,
                FinishNumber finish, double thickness_m = 0.03);

}  // namespace terracast::tiler
