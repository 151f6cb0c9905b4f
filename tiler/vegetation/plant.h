#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "core/random.h"
#include "world/shape.h"

namespace terracast::tiler {

/// How deep stems reach below a plant's foot, so that none hangs in the air on a slope.
inline constexpr double kSunk_m = 0.6;

/// A tapering stem: trunk, branch or stalk. It is closed: a cap at its start, a point at its end.
struct Stem {
  struct Node {
    Eigen::Vector3d place_m;
    double radius_m;
  };
  std::vector<Node> nodes;  ///< at least two, from the start to the end
  int order = 0;            ///< 0: trunk, 1: its branches, …
  std::uint8_t finish = 0;
};

enum class LeafForm : std::uint8_t {
  Kite,   ///< a leaf or a spray of leaves, folded along its middle: two triangles
  Blade,  ///< long and bent: three triangles
};

/// A leaf, or a spray of them. Seen from outside the plant, side, tip and the viewer are a
/// right-handed frame.
struct Leaf {
  Eigen::Vector3d base_m;
  Eigen::Vector3d tip_m;   ///< from the base
  Eigen::Vector3d side_m;  ///< to its right edge, half its width
  double lift_m = 0.0;     ///< of the edges (Kite) or of the middle (Blade) towards the viewer
  LeafForm form = LeafForm::Kite;
  std::uint8_t finish = 0;

  Eigen::Vector3d center_m() const { return base_m + 0.5 * tip_m; }
  int num_triangles() const { return form == LeafForm::Kite ? 2 : 3; }
};

/// A grown plant in metres, z up, its foot at the origin.
struct Plant {
  std::vector<world::Finish> finishes;
  std::vector<Stem> stems;
  std::vector<Leaf> leaves;
  /// Coarser levels show fewer leaves; they are wider, and as long as before: grass. Otherwise they
  /// are larger as a whole.
  bool keeps_leaf_length = false;
  /// Its leaves fill a crown: the coarsest levels show its hull instead of them.
  bool has_crown = false;
  /// A stone instead: how far it reaches from `stone_center_m` in a direction.
  std::function<double(const Eigen::Vector3d& direction)> stone_reach_m;
  Eigen::Vector3d stone_center_m = Eigen::Vector3d::Zero();
};

/// Random numbers of one plant, drawn one after the other.
class Draws {
 public:
  explicit Draws(std::uint64_t seed) : seed_(seed) {}
  double unit() { return core::random_unit(seed_, 0x706c616e74ULL, index_++); }
  double between(double lowest, double highest) { return lowest + (highest - lowest) * unit(); }
  /// Within `variation` of the mean.
  double about(double mean, double variation) { return mean + variation * (2.0 * unit() - 1.0); }
  Eigen::Vector3d direction();  ///< uniform over the sphere

 private:
  std::uint64_t seed_;
  std::uint64_t index_ = 0;
};

/// By which what grows round a middle goes on from one to the next (Vogel 1979).
inline constexpr double kGoldenAngle_rad = 2.399963229728653;

/// Where one of many stalks or tufts stands, z up from the plant's foot.
struct Foot {
  double out_m = 0.0;  ///< from the middle
  Eigen::Vector3d place_m = Eigen::Vector3d::Zero();
};

/// The k-th of `count` feet that are spread evenly over a disc, from its middle outward.
/// astray_rad   most that it stands beside its golden angle; 0: there, and nothing is drawn for it
Foot spread_foot(int k, int count, double reach_m, double sunk_m, double astray_rad, Draws& draws);

/// Any direction across another one; both of length 1.
Eigen::Vector3d across(const Eigen::Vector3d& direction);

/// A leaf whose upper side looks as near to `up` as its direction allows.
Leaf make_leaf(const Eigen::Vector3d& base_m, const Eigen::Vector3d& tip_m, double width_m,
               const Eigen::Vector3d& up, LeafForm form, double lift_m, std::uint8_t finish);

}  // namespace terracast::tiler
