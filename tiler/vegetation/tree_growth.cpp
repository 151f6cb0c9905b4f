#include "tiler/vegetation/tree_growth.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "geo/units.h"

namespace terracast::tiler {
namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using geo::radians_from_degrees;

/// Twigs thinner than this would vanish on the lattice of vertices.
constexpr double kThinnest_m = 0.006;
/// Forks stop where this share of the stem is left.
constexpr double kLastFork = 0.35;

/// Weber and Penn, section 4.3; `above` is the share of the crown's height above a branch.
double shape_ratio(CrownShape shape, double above) {
  switch (shape) {
    case CrownShape::Pointed:
      return 0.05 + 0.95 * above;
    case CrownShape::Conical:
      return 0.2 + 0.8 * above;
    case CrownShape::Spherical:
      return 0.2 + 0.8 * std::sin(std::numbers::pi * above);
    case CrownShape::Hemispherical:
      return 0.2 + 0.8 * std::sin(0.5 * std::numbers::pi * above);
    case CrownShape::Cylindrical:
      return 1.0;
    case CrownShape::TaperedCylindrical:
      return 0.5 + 0.5 * above;
    case CrownShape::Flame:
      return above <= 0.7 ? above / 0.7 : (1.0 - above) / 0.3;
    case CrownShape::TendFlame:
      return above <= 0.7 ? 0.5 + 0.5 * above / 0.7 : 0.5 + 0.5 * (1.0 - above) / 0.3;
  }
  return 1.0;
}

/// Where a stem stands and how it is turned: the columns are x, y and the direction of growth.
struct Growing {
  Vector3d place_m;
  Matrix3d axes;
  Vector3d direction() const { return axes.col(2); }
  void turn(double angle_rad, const Vector3d& axis) {
    axes = AngleAxisd(angle_rad, axis).toRotationMatrix() * axes;
  }
};

class Grower {
 public:
  Grower(const TreeRules& rules, std::uint64_t seed) : rules_(rules), draws_(seed) {
    plant_.finishes = rules.finishes;
  }

  Plant grow() {
    height_m_ = rules_.height_m * draws_.about(1.0, rules_.height_variation);
    const double length_m = height_m_ * rules_.stems.front().length;
    bare_m_ = rules_.bare_share * length_m;
    Growing start{{0.0, 0.0, 0.0}, Matrix3d::Identity()};
    start.turn(draws_.between(0.0, 2.0 * std::numbers::pi), Vector3d::UnitZ());
    grow_stem(0, start, length_m, length_m * rules_.trunk_ratio, 0);
    plant_.has_crown = !plant_.leaves.empty();
    return std::move(plant_);
  }

 private:
  const StemRule& rule(int order) const { return rules_.stems[static_cast<std::size_t>(order)]; }
  bool is_last(int order) const { return order + 1 == static_cast<int>(rules_.stems.size()); }

  double radius_m(int order, double base_radius_m, double share) const {
    double radius = base_radius_m * (1.0 - rules_.taper * share);
    // The foot of the trunk widens towards the ground (Weber and Penn, section 4.4).
    if (order == 0)
      radius *=
          1.0 + rules_.flare * (std::pow(100.0, 1.0 - 8.0 * std::min(share, 0.125)) - 1.0) / 100.0;
    return std::max(radius, kThinnest_m);
  }

  /// first_segment   above 0: a fork goes on from there
  void grow_stem(int order, Growing at, double length_m, double base_radius_m, int first_segment) {
    const StemRule& stem_rule = rule(order);
    const int num_segments = stem_rule.num_segments;
    const double segment_m = length_m / num_segments;
    Stem stem;
    stem.order = order;
    const double first_share = static_cast<double>(first_segment) / num_segments;
    if (order == 0 && first_segment == 0)
      stem.nodes.push_back(
          {at.place_m - kSunk_m * Vector3d::UnitZ(), radius_m(order, base_radius_m, 0.0)});
    stem.nodes.push_back({at.place_m, radius_m(order, base_radius_m, first_share)});
    std::vector<Growing> path = {at};
    for (int i = first_segment; i < num_segments; ++i) {
      bend(order, at);
      at.place_m += segment_m * at.direction();
      const double share = (i + 1.0) / num_segments;
      stem.nodes.push_back({at.place_m, radius_m(order, base_radius_m, share)});
      path.push_back(at);
      const bool forks = i + 1 < num_segments && share < 1.0 - kLastFork &&
                         (order > 0 || share * length_m > 0.8 * bare_m_) &&
                         draws_.unit() < stem_rule.num_forks / num_segments;
      if (!forks) continue;
      const double angle_rad = radians_from_degrees(
          draws_.about(stem_rule.fork_angle_deg, 0.3 * stem_rule.fork_angle_deg));
      Growing fork = at;
      const Vector3d axis =
          AngleAxisd(draws_.between(0.0, 2.0 * std::numbers::pi), at.direction()) *
          Vector3d(at.axes.col(0));
      fork.turn(angle_rad, axis);
      at.turn(-0.5 * angle_rad, axis);
      grow_stem(order, fork, length_m, 0.85 * base_radius_m, i + 1);
    }
    plant_.stems.push_back(std::move(stem));
    if (is_last(order))
      add_leaves(path, length_m);
    else
      add_branches(order, path, length_m, base_radius_m, first_share);
  }

  void bend(int order, Growing& at) {
    const StemRule& stem_rule = rule(order);
    const double share = 1.0 / stem_rule.num_segments;
    const double curve_rad = radians_from_degrees(stem_rule.curve_deg) * share;
    // Away from the trunk is downward, whatever way the stem is turned round itself.
    const Vector3d level = at.direction().cross(Vector3d::UnitZ());
    if (order > 0 && level.norm() > 1e-3) at.turn(-curve_rad, level.normalized());
    const double variation_rad = radians_from_degrees(stem_rule.curve_variation_deg) * share;
    at.turn(draws_.about(0.0, variation_rad), at.axes.col(0));
    at.turn(draws_.about(0.0, variation_rad), at.axes.col(1));
    if (stem_rule.upward == 0.0) return;
    const Vector3d pull = at.direction().cross(Vector3d::UnitZ());
    const double sine = pull.norm();
    if (sine > 1e-3) at.turn(stem_rule.upward * share * sine, pull / sine);
  }

  /// The place at a share of a path, and how it is turned there.
  static Growing along(const std::vector<Growing>& path, double share) {
    const double at = share * static_cast<double>(path.size() - 1);
    const std::size_t i = std::min(static_cast<std::size_t>(at), path.size() - 2);
    const double t = at - static_cast<double>(i);
    return {path[i].place_m + t * (path[i + 1].place_m - path[i].place_m), path[i + 1].axes};
  }

  void add_branches(int order, const std::vector<Growing>& path, double length_m,
                    double base_radius_m, double first_share) {
    const StemRule& child = rule(order + 1);
    const double bare_share = std::max(order == 0 ? rules_.bare_share : 0.15, first_share);
    // A fork bears its part of them.
    const int num_stems = static_cast<int>(std::lround(
        child.num_stems * (1.0 - bare_share) / (1.0 - (order == 0 ? rules_.bare_share : 0.15))));
    double turn_rad = draws_.between(0.0, 2.0 * std::numbers::pi);
    const int num_whorls = std::max(num_stems / child.whorl, 1);
    for (int i = 0; i < num_stems; ++i) {
      const int whorl = std::min(i / child.whorl, num_whorls - 1);
      const double jitter = child.whorl > 1 ? draws_.about(0.0, 0.12) : draws_.about(0.0, 0.4);
      const double share =
          bare_share +
          (1.0 - bare_share) * std::clamp((whorl + 0.5 + jitter) / num_whorls, 0.0, 0.995);
      const double above = (1.0 - share) / (1.0 - std::min(bare_share, 0.99));
      const double crown_above = order == 0 ? (1.0 - share) / (1.0 - rules_.bare_share) : above;
      double child_m = draws_.about(child.length, child.length_variation);
      child_m *= order == 0 ? length_m * shape_ratio(rules_.shape, crown_above)
                            : length_m * (1.0 - 0.6 * share);
      const double variation_deg = child.down_angle_variation_deg;
      const double down_deg =
          variation_deg >= 0.0 ? draws_.about(child.down_angle_deg, variation_deg)
                               : child.down_angle_deg - variation_deg * (2.0 * crown_above - 1.0) +
                                     draws_.about(0.0, 5.0);
      turn_rad += radians_from_degrees(draws_.about(child.turn_deg, child.turn_variation_deg));
      Growing start = along(path, (share - first_share) / (1.0 - first_share));
      start.turn(turn_rad, start.direction());
      start.turn(radians_from_degrees(down_deg), start.axes.col(0));
      const double parent_m = radius_m(order, base_radius_m, share);
      const double radius =
          std::min(base_radius_m * std::pow(std::min(child_m / length_m, 1.0), rules_.ratio_power),
                   0.85 * parent_m);
      if (child_m < 0.05) continue;
      grow_stem(order + 1, start, child_m, std::max(radius, kThinnest_m), 0);
    }
  }

  void add_leaves(const std::vector<Growing>& path, double length_m) {
    const LeafRule& leaves = rules_.leaves;
    if (leaves.num_leaves == 0) return;
    mean_length_m_ += (length_m - mean_length_m_) / ++num_leafy_;
    const int num_leaves =
        std::max(1, static_cast<int>(std::lround(leaves.num_leaves *
                                                 std::clamp(length_m / mean_length_m_, 0.3, 1.8))));
    double turn_rad = draws_.between(0.0, 2.0 * std::numbers::pi);
    for (int i = 0; i < num_leaves; ++i) {
      const double share =
          leaves.first + (1.0 - leaves.first) * (i + draws_.between(0.2, 1.0)) / num_leaves;
      const Growing at = along(path, std::min(share, 1.0));
      const bool is_end = i + 1 == num_leaves;
      const double down_rad =
          is_end ? 0.15 : radians_from_degrees(draws_.about(leaves.down_angle_deg, 15.0));
      Vector3d out;
      if (leaves.in_two_rows) {
        const Vector3d level = at.direction().cross(Vector3d::UnitZ());
        out = level.norm() > 1e-3 ? Vector3d(level.normalized()) : Vector3d(at.axes.col(0));
        if (i % 2 == 1) out = -out;
        out += draws_.about(0.0, 0.35) * Vector3d::UnitZ();
      } else {
        turn_rad += radians_from_degrees(137.5);
        out = AngleAxisd(turn_rad, at.direction()) * Vector3d(at.axes.col(0));
      }
      Vector3d direction = std::cos(down_rad) * at.direction() + std::sin(down_rad) * out;
      direction.z() -= leaves.hanging;
      direction.normalize();
      const double size = draws_.about(1.0, leaves.size_variation) *
                          std::clamp(1.6 * length_m / mean_length_m_, 0.3, 1.0);
      // Leaves look at the sky, and somewhat outward.
      Vector3d outward(at.place_m.x(), at.place_m.y(), 0.35 * (at.place_m.z() - 0.5 * height_m_));
      if (outward.norm() > 1e-6) outward.normalize();
      const Vector3d up = Vector3d::UnitZ() + 0.7 * outward + 0.55 * draws_.direction();
      const int num_shades = static_cast<int>(rules_.finishes.size()) - 1;
      const int shade = std::min(static_cast<int>(draws_.unit() * num_shades), num_shades - 1);
      plant_.leaves.push_back(make_leaf(
          at.place_m, size * leaves.length_m * direction, size * leaves.width_m, up, LeafForm::Kite,
          leaves.fold * size * leaves.length_m, static_cast<std::uint8_t>(1 + shade)));
    }
  }

  const TreeRules& rules_;
  Draws draws_;
  Plant plant_;
  double height_m_ = 0.0;
  double bare_m_ = 0.0;
  double mean_length_m_ = 0.0;  ///< of the stems with leaves so far
  int num_leafy_ = 0;
};

}  // namespace

Plant grow_tree(const TreeRules& rules, std::uint64_t seed) { return Grower(rules, seed).grow(); }

}  // namespace terracast::tiler
