#include "render/visited_tiles.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "geo/sun.h"

namespace terracast::render {
namespace {

using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kToldAbove_m = 64.0;
static_assert(kToldAbove_m < world::RayTrail::kFollowed_m);
/// More than places along a ray are rounded by.
constexpr double kRounding_m = 1e-6;
/// Points of a tile are taken for so much farther out of its box, plus a share of its side: more than
/// sun rays start above the ground.
constexpr double kPointMargin_m = 0.01;
constexpr double kPointMarginPerSide = 4e-6;
/// Rays to points end up to here, of the way to them: a little behind.
constexpr double kEndOfWay = 1.0 + 1e-5;

/// A parameter's values that conditions leave over.
class Range {
 public:
  Range(double first, double last) : first_(first), last_(last) {}
  bool is_empty() const { return !(first_ <= last_); }

  /// Those at which at + s * rate <= limit.
  void keep_below(double at, double rate, double limit) {
    const double room = limit - at;
    if (rate > 0.0)
      last_ = std::min(last_, room / rate);
    else if (rate < 0.0)
      first_ = std::max(first_, room / rate);
    else if (room < 0.0)
      last_ = -kInfinity;
  }
  void keep_above(double at, double rate, double limit) { keep_below(-at, -rate, -limit); }

 private:
  double first_;
  double last_;
};

geo::Box3d widened(const geo::Box3d& box, double margin_m) {
  return {box.min() - Vector3d::Constant(margin_m), box.max() + Vector3d::Constant(margin_m)};
}

/// The rays of an image: its centre, and directions through its corners, of which all others are sums
/// with factors of 0 or more.
struct Pyramid {
  Vector3d apex;
  std::array<Vector3d, 4> edges;
};

Pyramid pyramid_of(const sensors::View& view) {
  const double width = view.model->width_px();
  const double height = view.model->height_px();
  return {view.center_world,
          {view.ray_world({0.0, 0.0}), view.ray_world({width, 0.0}),
           view.ray_world({width, height}), view.ray_world({0.0, height})}};
}

/// Whether a plane across an axis stands between the two.
bool are_apart(const Pyramid& pyramid, const geo::Box3d& box, const Vector3d& axis) {
  const double box_middle = axis.dot(box.center());
  const double box_reach = axis.cwiseAbs().dot(0.5 * box.sizes());
  double lowest = axis.dot(pyramid.apex);
  double highest = lowest;
  for (const Vector3d& edge : pyramid.edges) {
    const double along = axis.dot(edge);
    if (along < 0.0) lowest = -kInfinity;
    if (along > 0.0) highest = kInfinity;
  }
  return box_middle + box_reach < lowest || box_middle - box_reach > highest;
}

/// Two convex bodies of planes are apart when a plane stands between them that is parallel to a face of
/// one, or to an edge of each.
bool are_apart(const Pyramid& pyramid, const geo::Box3d& box) {
  for (std::size_t i = 0; i < 4; ++i)
    if (are_apart(pyramid, box, pyramid.edges[i].cross(pyramid.edges[(i + 1) % 4]))) return true;
  for (int k = 0; k < 3; ++k) {
    const Vector3d along = Vector3d::Unit(k);
    if (are_apart(pyramid, box, along)) return true;
    for (const Vector3d& edge : pyramid.edges)
      if (are_apart(pyramid, box, along.cross(edge))) return true;
  }
  return false;
}

}  // namespace

double told_below_z(std::span<const int> touched_tiles, std::span<const capture::TileScale> tiles) {
  double highest = -kInfinity;
  for (const int tile : touched_tiles)
    highest = std::max(highest, tiles[static_cast<std::size_t>(tile)].highest_z_world);
  return highest + kToldAbove_m;
}

void set_seen_tiles(const world::RayTrail& trail, std::span<const capture::TileScale> tiles,
                    capture::FrameRecord& record) {
  record.touched_tiles.clear();
  record.passed_tiles.clear();
  for (std::size_t tile = 0; tile < trail.num_tiles(); ++tile)
    if (trail.is_touched(tile)) record.touched_tiles.push_back(static_cast<int>(tile));
  const double below_z = told_below_z(record.touched_tiles, tiles);
  for (std::size_t tile = 0; tile < trail.num_tiles(); ++tile) {
    const double z_world = trail.passed_z_world(tile);
    if (z_world > below_z) continue;
    const double steps = std::floor((z_world - kRounding_m) / capture::kPassedStep_m);
    record.passed_tiles.push_back(
        {.tile = static_cast<int>(tile), .above_z_world_m = steps * capture::kPassedStep_m});
  }
}

FrameSight::FrameSight(const sensors::FrameRenderer& renderer,
                       const std::vector<geo::Box3d>& tile_boxes)
    : renderer_(renderer) {
  for (const geo::Box3d& box : tile_boxes)
    points_.push_back(widened(box, kPointMargin_m + kPointMarginPerSide * box.sizes().x()));
}

bool FrameSight::may_reach(int frame, std::span<const int> touched_tiles,
                           const geo::Box3d& box_world) const {
  const sensors::ViewTable& views = renderer_.views();
  for (int camera = 0; camera < views.num_cameras(); ++camera) {
    // Rays from other cameras of the rig to points of this one are rays of their images too.
    if (may_see(views.at(frame, camera), box_world)) return true;
    for (const int beside : {frame - 1, frame + 1})
      if (beside >= 0 && beside < views.num_frames() &&
          may_ask_through(views.at(beside, camera), touched_tiles, box_world))
        return true;
  }
  return may_shade(touched_tiles, box_world);
}

bool FrameSight::may_see(const sensors::View& view, const geo::Box3d& box_world) const {
  // Of other models the corners say nothing of what lies between them.
  if (view.model->intrinsics().model != "pinhole") return true;
  return !are_apart(pyramid_of(view), widened(box_world, kRounding_m));
}

/// A ray to a point of a tile's box is at s on its way between what it would be at to the lowest and to
/// the highest such point, in each coordinate by itself.
bool FrameSight::may_ask_through(const sensors::View& view, std::span<const int> touched_tiles,
                                 const geo::Box3d& box_world) const {
  if (!may_see(view, box_world)) return false;
  const geo::Box3d box = widened(box_world, kRounding_m);
  return std::any_of(touched_tiles.begin(), touched_tiles.end(), [&](int tile) {
    const geo::Box3d& points = points_[static_cast<std::size_t>(tile)];
    Range s(0.0, kEndOfWay);
    for (int k = 0; k < 3; ++k) {
      const double from = view.center_world[k];
      s.keep_below(from, points.min()[k] - from, box.max()[k]);
      s.keep_above(from, points.max()[k] - from, box.min()[k]);
    }
    return !s.is_empty();
  });
}

/// The same of rays without end, to all places of the sun's disc.
bool FrameSight::may_shade(std::span<const int> touched_tiles, const geo::Box3d& box_world) const {
  if (renderer_.sky().is_night()) return false;
  const geo::Box3d box = widened(box_world, kRounding_m);
  const Vector3d& sun = renderer_.sky().daylight().sun_direction_world;
  const double radius = std::tan(geo::kSunAngularRadius_rad);
  return std::any_of(touched_tiles.begin(), touched_tiles.end(), [&](int tile) {
    const geo::Box3d& points = points_[static_cast<std::size_t>(tile)];
    Range s(0.0, kInfinity);
    for (int k = 0; k < 3; ++k) {
      s.keep_below(points.min()[k], sun[k] - radius, box.max()[k]);
      s.keep_above(points.max()[k], sun[k] + radius, box.min()[k]);
    }
    return !s.is_empty();
  });
}

}  // namespace terracast::render
