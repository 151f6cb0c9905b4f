#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "geo/units.h"
#include "tiler/vector_reader.h"

// From a source's coordinates to places in the world.
namespace terracast::tiler {
namespace {

using Eigen::Vector2d;

/// Points of a long edge stand no farther apart: what is straight in latitude and longitude bends from
/// a straight line by s^2 / 8R tan(latitude), 2 cm for 1 km at 45 degrees.
constexpr double kLongestEdge_m = 1000.0;
constexpr double kMetresPerDegree = 111320.0;

}  // namespace

/// False: a place that is none. In place, from the source's coordinates to longitude and latitude.
bool VectorReader::transform(PointsWorld& line, const LayerRules& rules) const {
  for (const Vector2d& at : line)
    if (!at.allFinite()) return false;
  if (rules.geodetic_from_crs) {
    std::vector<double> x(line.size());
    std::vector<double> y(line.size());
    for (std::size_t i = 0; i < line.size(); ++i) {
      x[i] = line[i].x();
      y[i] = line[i].y();
    }
    if (!rules.geodetic_from_crs->transform(x, y)) return false;
    for (std::size_t i = 0; i < line.size(); ++i) line[i] = {x[i], y[i]};
  }
  for (const Vector2d& at : line)
    if (!(std::abs(at.y()) <= 90.0 && std::abs(at.x()) <= 720.0)) return false;
  return true;
}

/// Adds points on the long edges that come near the square.
void VectorReader::split_long_edges(PointsWorld& line_crs, PointsWorld& line_deg, bool is_ring,
                                    const LayerRules& rules) const {
  const std::size_t num_edges = line_deg.size() - (is_ring ? 0 : 1);
  const double lon_scale = std::cos(geo::radians_from_degrees(origin_.lat_deg));
  PointsWorld fine_crs;
  bool is_split = false;
  for (std::size_t i = 0; i < line_deg.size(); ++i) {
    fine_crs.push_back(line_crs[i]);
    if (i >= num_edges) break;
    const std::size_t next = (i + 1) % line_deg.size();
    Box edge;
    edge.add(line_deg[i]);
    edge.add(line_deg[next]);
    const Vector2d extent = edge.highest - edge.lowest;
    const double length_m = kMetresPerDegree * std::hypot(extent.x() * lon_scale, extent.y());
    if (length_m <= kLongestEdge_m || extent.x() > 180.0) continue;
    const double middle_deg = 0.5 * (edge.lowest.x() + edge.highest.x());
    edge.lowest.x() += near_origin(middle_deg) - middle_deg;
    edge.highest.x() += near_origin(middle_deg) - middle_deg;
    // What an edge bends by is far less than a hundredth of its length.
    edge.lowest -= Vector2d::Constant(0.01 * extent.norm());
    edge.highest += Vector2d::Constant(0.01 * extent.norm());
    if (!edge.overlaps(square_deg_)) continue;
    const int num_pieces = static_cast<int>(std::ceil(length_m / kLongestEdge_m));
    for (int k = 1; k < num_pieces; ++k)
      fine_crs.push_back(line_crs[i] + (line_crs[next] - line_crs[i]) * (double(k) / num_pieces));
    is_split = true;
  }
  if (!is_split) return;
  line_deg = fine_crs;
  if (!transform(line_deg, rules)) line_deg.clear();
}

/// Turns longitudes by whole turns, so that they run on round the origin.
void VectorReader::unwrap(std::vector<std::vector<PointsWorld>>& parts) const {
  for (auto& part : parts) {
    Box box;
    for (const PointsWorld& line : part)
      for (const Vector2d& at : line) box.add(at);
    // A part over more than half the Earth crosses the date line, or reaches round the Earth.
    bool crosses = box.highest.x() - box.lowest.x() > 180.0;
    for (const PointsWorld& line : part)
      for (const Vector2d& at : line)
        crosses = crosses && std::abs(at.x()) > 90.0 && std::abs(at.x()) < 180.0;
    const double middle_deg = 0.5 * (box.highest.x() + box.lowest.x());
    const double turn_deg = near_origin(middle_deg) - middle_deg;
    for (PointsWorld& line : part)
      for (Vector2d& at : line) at.x() = crosses ? near_origin(at.x()) : at.x() + turn_deg;
  }
}

void VectorReader::cut_far(std::vector<std::vector<PointsWorld>>& parts, FeatureKind kind) const {
  if (kind == FeatureKind::Point) return;
  const bool is_ring = kind == FeatureKind::Area;
  const std::array<double, 2> middle = {origin_.lon_deg, origin_.lat_deg};
  for (auto& part : parts) {
    for (PointsWorld& line : part)
      for (int axis = 0; axis < 2; ++axis)
        for (const double side : {-1.0, 1.0})
          line = cut(line, axis, middle[static_cast<std::size_t>(axis)] + side * kFarthest_deg,
                     side, is_ring);
    std::erase_if(part, [&](const PointsWorld& line) { return line.size() < (is_ring ? 3U : 2U); });
  }
  std::erase_if(parts, [](const auto& part) { return part.empty(); });
}

/// False: places that are none.
bool VectorReader::turn_into_degrees(std::vector<std::vector<PointsWorld>>& parts, FeatureKind kind,
                                     const LayerRules& rules) {
  const bool is_ring = kind == FeatureKind::Area;
  for (auto& part : parts)
    for (PointsWorld& line : part) {
      PointsWorld line_crs = line;
      if (!transform(line, rules)) return false;
      if (kind == FeatureKind::Point) continue;
      split_long_edges(line_crs, line, is_ring, rules);
      if (line.empty()) return false;
    }
  unwrap(parts);
  return true;
}

/// From longitude and latitude to the world's x and y.
void VectorReader::put_on_ground() {
  std::vector<char> is_near(data_.features.size(), 0);
  core::parallel_for_blocks(
      static_cast<std::int64_t>(data_.features.size()), 16,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t i = begin; i < end; ++i) {
          VectorFeature& feature = data_.features[static_cast<std::size_t>(i)];
          for (auto& part : feature.parts_world)
            for (PointsWorld& line : part)
              for (Vector2d& at : line) {
                geo::Geodetic place{.lat_deg = at.y(), .lon_deg = at.x(), .height_m = 0.0};
                place.height_m = frame_.ground_height_m(place);
                at = frame_.frame.world_from_geodetic(place).head<2>();
              }
          is_near[static_cast<std::size_t>(i)] =
              box_of(feature.parts_world).overlaps(square_m_) ? 1 : 0;
        }
      });
  std::size_t kept = 0;
  for (std::size_t i = 0; i < data_.features.size(); ++i) {
    if (is_near[i] == 0) {
      ++num_outside_;
      continue;
    }
    if (kept != i) data_.features[kept] = std::move(data_.features[i]);
    ++kept;
  }
  data_.features.resize(kept);
}

}  // namespace terracast::tiler
