#include "tiler/objects/clear_strips.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "core/error.h"
#include "tiler/objects/rules.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;

constexpr double kPiece_m =
    300.0;  ///< strips are cut into such, so that each is found from few cells
constexpr double kFarthest_m = 1e6;
constexpr std::size_t kMostPieces = 50'000;

/// Off the middle line (ICAO Annex 14: 140 m beside runways of codes 3 and 4, 75 m and less beside shorter ones, which
/// are narrower; 26 m beside taxiways for aircraft of 36 m span). Runways' strips go on 60 m beyond their ends.
struct Strip {
  double half_width_m;
  double beyond_m;
};
Strip strip_of(const FeatureTags& tags) {
  if (tags.value("aeroway") == "taxiway") return {30.0, 0.0};
  return {tags.number("width").value_or(45.0) >= 30.0 ? 150.0 : 75.0, 60.0};
}

}  // namespace

ClearStrips::ClearStrips(std::span<const VectorFeature> features) {
  for (const VectorFeature& feature : features) {
    const std::string_view aeroway = feature.tags.value("aeroway");
    for (const auto& part : feature.parts_world) {
      if (part.empty()) continue;
      if (aeroway == "aerodrome" && feature.kind == FeatureKind::Area && part[0].size() >= 3) {
        Aerodrome aerodrome{part, part[0][0], part[0][0]};
        for (const Vector2d& corner : part[0]) {
          aerodrome.lowest = aerodrome.lowest.cwiseMin(corner);
          aerodrome.highest = aerodrome.highest.cwiseMax(corner);
        }
        aerodromes_.push_back(std::move(aerodrome));
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

bool ClearStrips::holds(const Vector2d& place, double radius_m) const {
  if (strips_.holds(place, radius_m)) return true;
  return std::any_of(aerodromes_.begin(), aerodromes_.end(), [&](const Aerodrome& aerodrome) {
    return (place.array() >= aerodrome.lowest.array()).all() &&
           (place.array() <= aerodrome.highest.array()).all() && is_inside(aerodrome.rings, place);
  });
}

}  // namespace terracast::tiler
