#include "tiler/objects/clear_strips.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "core/error.h"
#include "tiler/objects/object_tags.h"
#include "tiler/roads/road_bed.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;

constexpr double kPiece_m =
    300.0;  ///< strips are cut into such, so that each is found from few cells
constexpr double kFarthest_m = 1e6;
constexpr std::size_t kMostPieces = 50'000;

/// Aerodromes' borders are found by such cells.
constexpr double kCell_m = 128.0;
/// An aerodrome of 100 km2 with 1000 corners takes some 1e7.
constexpr std::size_t kMostCompared = 4'000'000'000;
constexpr std::size_t kMostCornersInCell = 50'000;
constexpr std::size_t kMostCells = 2'000'000;  ///< 33 000 km2

std::int32_t cell(double at_m) { return static_cast<std::int32_t>(std::floor(at_m / kCell_m)); }
std::uint64_t key(std::int32_t x, std::int32_t y) {
  return static_cast<std::uint64_t>(static_cast<std::uint32_t>(y)) << 32U |
         static_cast<std::uint32_t>(x);
}

/// Off the middle line (ICAO Annex 14: 140 m beside runways of codes 3 and 4, 75 m and less beside shorter ones, which
/// are narrower; 26 m beside taxiways for aircraft of 36 m span). Runways' strips go on 60 m beyond their ends.
struct Strip {
  double half_width_m;
  double beyond_m;
};
Strip strip_of(const ObjectTags& tags) {
  if (tags.value("aeroway") == "taxiway") return {30.0, 0.0};
  return {tags.middle("width").value_or(45.0) >= 30.0 ? 150.0 : 75.0, 60.0};
}

}  // namespace

ClearStrips::ClearStrips(std::span<const VectorFeature> features) {
  for (const VectorFeature& feature : features) {
    const std::string_view aeroway = ObjectTags(feature.tags).value("aeroway");
    for (const auto& part : feature.parts_world) {
      if (part.empty()) continue;
      if (aeroway == "aerodrome" && feature.kind == FeatureKind::Area && part[0].size() >= 3) {
        add_aerodrome(part);
      } else if ((aeroway == "runway" || aeroway == "taxiway") &&
                 feature.kind == FeatureKind::Line) {
        add_strips(part[0], feature.tags);
      }
    }
  }
}

void ClearStrips::add_strips(const PointsWorld& line, const FeatureTags& tags) {
  const Strip strip = strip_of(tags);
  for (std::size_t k = 1; k < line.size(); ++k) {
    const Vector2d reach = line[k] - line[k - 1];
    const double length_m = reach.norm();
    // What is no place, or none of a world's.
    if (!(length_m > 0.01 && line[k].cwiseAbs().maxCoeff() < kFarthest_m &&
          line[k - 1].cwiseAbs().maxCoeff() < kFarthest_m))
      continue;
    const auto num = static_cast<int>(std::ceil(length_m / kPiece_m));
    num_pieces_ += static_cast<std::size_t>(num);
    if (num_pieces_ > kMostPieces)
      core::fail(
          core::ErrorKind::Input,
          "runways and taxiways are more than {} km long together; no land has so many: look "
          "for features with a wrong aeroway",
          kMostPieces * static_cast<std::size_t>(kPiece_m) / 1000);
    for (int piece = 0; piece < num; ++piece)
      strips_.add({line[k - 1] + (piece + 0.5) / num * reach, reach / length_m,
                   0.5 * length_m / num + strip.beyond_m, strip.half_width_m});
  }
}

void ClearStrips::add_aerodrome(const std::vector<PointsWorld>& rings) {
  Vector2d low = rings[0][0], high = low;
  std::size_t num_corners = 0;
  for (const PointsWorld& ring : rings) {
    num_corners += ring.size();
    for (const Vector2d& corner : ring) {
      if (!(corner.cwiseAbs().maxCoeff() < kFarthest_m)) return;
      low = low.cwiseMin(corner);
      high = high.cwiseMax(corner);
    }
  }
  const auto refuse_if = [](bool is_too_much) {
    if (is_too_much)
      core::fail(core::ErrorKind::Input,
                 "aerodromes have more and longer borders than any land's; look for features with "
                 "a wrong aeroway");
  };
  const auto span = [](double from, double to) {
    return static_cast<std::size_t>(cell(to) - cell(from) + 1);
  };
  num_compared_ += num_corners * span(low.x(), high.x()) * span(low.y(), high.y());
  refuse_if(num_compared_ > kMostCompared);
  const auto number = static_cast<std::uint32_t>(aerodromes_.size());
  aerodromes_.push_back(rings);
  for (std::int32_t y = cell(low.y()); y <= cell(high.y()); ++y)
    for (std::int32_t x = cell(low.x()); x <= cell(high.x()); ++x) {
      const RingSide side = side_of_rings(rings, kCell_m * Vector2d(x + 0.5, y + 0.5));
      const bool is_crossed = side.distance_m <= 0.71 * kCell_m;
      if (!is_crossed && !side.is_inside) continue;
      Cell& here = cells_[key(x, y)];
      refuse_if(cells_.size() > kMostCells);
      if (here.is_inside) continue;
      if (!is_crossed) {
        here = Cell();
        here.is_inside = true;
        continue;
      }
      here.aerodromes.push_back(number);
      here.num_corners += num_corners;
      refuse_if(here.num_corners > kMostCornersInCell);
    }
}

bool ClearStrips::holds(const Vector2d& place, double radius_m) const {
  if (strips_.holds(place, radius_m)) return true;
  for (std::int32_t y = cell(place.y() - radius_m); y <= cell(place.y() + radius_m); ++y)
    for (std::int32_t x = cell(place.x() - radius_m); x <= cell(place.x() + radius_m); ++x) {
      const auto found = cells_.find(key(x, y));
      if (found == cells_.end()) continue;
      const Vector2d corner = kCell_m * Vector2d(x, y);
      if (found->second.is_inside &&
          (place.cwiseMax(corner).cwiseMin(corner + Vector2d(kCell_m, kCell_m)) - place).norm() <=
              radius_m)
        return true;
      for (const std::uint32_t number : found->second.aerodromes) {
        const RingSide side = side_of_rings(aerodromes_[number], place);
        if (side.is_inside || side.distance_m <= radius_m) return true;
      }
    }
  return false;
}

}  // namespace terracast::tiler
