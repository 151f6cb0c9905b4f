#include "geo/paths/area.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "geo/paths/flattened.h"
#include "geo/paths/place.h"

namespace terracast::geo {
namespace {

using core::ErrorKind;
using core::fail;

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// Two sides pass through each other.
bool do_cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c,
              const Eigen::Vector2d& d) {
  const auto side = [](const Eigen::Vector2d& p, const Eigen::Vector2d& q,
                       const Eigen::Vector2d& r) { return cross(q - p, r - p); };
  return side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0;
}

Place place_of(const Corner& corner) {
  return {.lat_deg = corner.lat_deg,
          .lon_deg = corner.lon_deg,
          .east_m = corner.east_m,
          .north_m = corner.north_m};
}

}  // namespace

void Corner::describe(core::SchemaVisitor& visit) {
  Place place = place_of(*this);
  place.describe_on_map(visit);
  *this = {place.lat_deg, place.lon_deg, place.east_m, place.north_m};
}

void Corner::validate() const { place_of(*this).validate(); }

Area::Area(std::vector<Eigen::Vector2d> corners) : corners_(std::move(corners)) {
  const std::size_t count = corners_.size();
  constexpr std::size_t kMostCorners = 1000;
  if (count < 3 || count > kMostCorners)
    fail(ErrorKind::Config, "area has {} corners; it takes 3 to {}", count, kMostCorners);
  double twice_size_m2 = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector2d& a = corners_[i];
    const Eigen::Vector2d& b = corners_[(i + 1) % count];
    twice_size_m2 += cross(a - corners_[0], b - corners_[0]);
    for (std::size_t k = i + 1; k < count; ++k)
      if (do_cross(a, b, corners_[k], corners_[(k + 1) % count]))
        fail(ErrorKind::Config,
             "the area's sides after corners {} and {} (counted from 0) cross; name the corners in "
             "order",
             i, k);
  }
  constexpr double kLeastSize_m2 = 1.0;
  if (std::abs(twice_size_m2) < 2.0 * kLeastSize_m2)
    fail(ErrorKind::Config, "the area's corners lie in a line; it has no extent");
}

bool Area::contains(const Eigen::Vector2d& point) const {
  bool is_inside = false;
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    const Eigen::Vector2d& a = corners_[i];
    const Eigen::Vector2d& b = corners_[(i + 1) % corners_.size()];
    if ((a.y() > point.y()) == (b.y() > point.y())) continue;
    if (point.x() < a.x() + (b.x() - a.x()) * (point.y() - a.y()) / (b.y() - a.y()))
      is_inside = !is_inside;
  }
  return is_inside;
}

std::pair<double, double> Area::extent(const Eigen::Vector2d& along) const {
  double lowest = along.dot(corners_[0]), highest = lowest;
  for (const Eigen::Vector2d& corner : corners_) {
    lowest = std::min(lowest, along.dot(corner));
    highest = std::max(highest, along.dot(corner));
  }
  return {lowest, highest};
}

std::optional<std::pair<double, double>> Area::extent_of_strip(const Eigen::Vector2d& along,
                                                               const Eigen::Vector2d& across,
                                                               double lowest,
                                                               double highest) const {
  std::optional<std::pair<double, double>> extent;
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    const Eigen::Vector2d& a = corners_[i];
    const Eigen::Vector2d& b = corners_[(i + 1) % corners_.size()];
    const double from = across.dot(a), to = across.dot(b);
    if (std::max(from, to) < lowest || std::min(from, to) > highest) continue;
    // The ends of the part of the side that lies in the strip.
    const auto share_at = [&](double bound) { return (bound - from) / (to - from); };
    const double first = from == to ? 0.0 : share_at(std::clamp(from, lowest, highest));
    const double last = from == to ? 1.0 : share_at(std::clamp(to, lowest, highest));
    for (const double share : {first, last}) {
      const double at = along.dot(a + share * (b - a));
      if (!extent) extent = {at, at};
      extent = {std::min(extent->first, at), std::max(extent->second, at)};
    }
  }
  return extent;
}

Eigen::Vector2d resolve_corner(const Corner& corner, const TrajectoryContext& context,
                               const std::string& what) {
  return resolve_place(place_of(corner), context, what).head<2>();
}

Area resolve_area(const std::vector<Corner>& corners, const TrajectoryContext& context) {
  std::vector<Eigen::Vector2d> places;
  for (const Corner& corner : corners)
    places.push_back(resolve_corner(
        corner, context, fmt::format("corner {} of the area (counted from 0)", places.size())));
  return Area(std::move(places));
}

double ground_w_m(const Eigen::Vector2d& place, double near_w_m, const TrajectoryContext& context) {
  const Flattened flattened(context.frame.origin());
  const PathPoint near = flattened.world_from_flattened(
      {{place.x(), place.y(), near_w_m}, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()});
  Geodetic at = context.frame.geodetic_from_world(near.position_world);
  const auto ground_m = context.ground_height_m(at.lat_deg, at.lon_deg);
  if (!ground_m || !std::isfinite(*ground_m))
    fail(ErrorKind::Input,
         "the flight, or a turn of it, leaves the world's ground at {}; make it smaller, or "
         "the world larger",
         text_of(at));
  at.height_m = *ground_m;
  return flattened.flattened_from_world(context.frame.world_from_geodetic(at)).z();
}

}  // namespace terracast::geo
