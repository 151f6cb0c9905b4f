#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "world/shape.h"

namespace terracast::tiler {

using Color = std::array<std::uint8_t, 3>;  ///< sRGB

/// A closed ring of points, in the frame of the thing: x forward, y left, z up, m.
using Ring = std::vector<Eigen::Vector3d>;
/// Points of a plane, of which rings are made.
using Outline = std::vector<Eigen::Vector2d>;

/// Number of a finish of a mesh.
using FinishNumber = std::uint8_t;
/// Finish of the face that leads from point `edge` of ring `ring` to the next point and ring.
using FinishOfFace = std::function<FinishNumber(std::size_t ring, std::size_t edge)>;

/// How a part of a thing turns when the thing moves.
struct Turning {
  std::string name;  ///< "rotor", "wheel": several are told apart by numbers
  Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();  ///< on the axis, in the frame of the thing
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();     ///< unit
  double rate_radps = 0.0;                             ///< about the axis, as time goes
  double per_metre_rad = 0.0;                          ///< as the thing goes forward
  double swing_rad =
      0.0;  ///< above 0: it swings so far to both sides, and these are rates of its phase
  double phase_rad = 0.0;  ///< of the swing before the thing has gone anywhere
};
struct TurningShape {
  Turning turning;
  world::Shape shape;  ///< along the axes of the thing, about origin_m
};

/// Builds the shape of a thing of closed parts. Each part is a surface without border of its own, turned
/// outward, whose vertices lie on the world's lattice; faces that fall together to nothing there are left
/// out. Parts may run into each other, and should: faces of two parts must not lie in one plane.
class ThingMesh {
 public:
  /// splits_turning   what turns gets shapes of its own, for things that move
  explicit ThingMesh(core::SemanticClass semantic_class, bool splits_turning = false)
      : semantic_class_(semantic_class), splits_turning_(splits_turning) {}

  FinishNumber finish(world::Material material, const Color& color);
  /// Of another class than the thing's.
  FinishNumber finish(world::Material material, const Color& color,
                      core::SemanticClass semantic_class);

  /// The skin over rings of one number of points, closed at both ends.
  void loft(const std::vector<Ring>& rings, const FinishOfFace& sides, FinishNumber first_end,
            FinishNumber last_end);
  void loft(const std::vector<Ring>& rings, FinishNumber finish);

  /// lowest, highest   its corners
  void box(const Eigen::Vector3d& lowest, const Eigen::Vector3d& highest, FinishNumber finish);
  /// A box whose top has another extent.
  void tapered_box(const Eigen::Vector3d& lowest, const Eigen::Vector3d& highest,
                   const Eigen::Vector2d& top_lowest, const Eigen::Vector2d& top_highest,
                   FinishNumber finish);
  /// A prism upward over an outline in x and y.
  void prism(const Outline& outline, double low_z_m, double high_z_m, FinishNumber sides,
             FinishNumber ends);
  /// A prism along y over an outline in x and z.
  void prism_across(const Outline& outline, double low_y_m, double high_y_m, FinishNumber sides,
                    FinishNumber ends);
  /// A bar of square or round section from one point to another.
  void bar(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double width_m,
           FinishNumber finish, int num_sides = 4);
  /// A frustum about the line from one point to another.
  void cone(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double from_radius_m,
            double to_radius_m, int num_sides, FinishNumber sides, FinishNumber ends);
  void cylinder(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double radius_m,
                int num_sides, FinishNumber sides, FinishNumber ends) {
    cone(from, to, radius_m, radius_m, num_sides, sides, ends);
  }
  /// A body of revolution about the vertical through a point: radius (x) and height (y) from foot to
  /// top; a radius of 0 is a tip.
  void lathe(const Eigen::Vector2d& axis, const Outline& profile, int num_sides,
             const std::function<FinishNumber(std::size_t ring)>& finish);

  /// What `build` adds turns.
  void turning(Turning how, const std::function<void()>& build);

  /// Where parts that follow are put: turned about z, then moved.
  void set_frame(const Eigen::Vector3d& origin, double turn_rad = 0.0);

  const world::Shape& shape() const { return shape_; }
  /// What turns, where it is split off, in its order.
  std::vector<TurningShape> turning_shapes() const;
  std::size_t num_triangles() const { return shape_.triangles.size(); }

 private:
  Eigen::Vector3d placed(const Eigen::Vector3d& point) const;

  core::SemanticClass semantic_class_;
  bool splits_turning_;
  world::Shape shape_;
  std::vector<TurningShape> turning_;  ///< their finishes are the whole's
  Eigen::Vector3d part_origin_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  double turn_rad_ = 0.0;
};

/// A ring in a plane across x, of points (y, z).
Ring ring_across(double x_m, const Outline& outline);
/// A ring in a level plane.
Ring ring_at(double z_m, const Outline& outline);
/// A regular polygon with a corner straight below the middle, or with a side there.
Outline round_outline(double radius_x_m, double radius_y_m, int num_points,
                      const Eigen::Vector2d& middle = Eigen::Vector2d::Zero());
/// A rectangle with cut corners.
Outline cut_rectangle(const Eigen::Vector2d& lowest, const Eigen::Vector2d& highest, double cut_m);
Outline rectangle(const Eigen::Vector2d& lowest, const Eigen::Vector2d& highest);

}  // namespace terracast::tiler
