#include "tiler/land_cover/derived_cover.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/hash.h"
#include "core/parallel.h"
#include "core/random.h"
#include "geo/units.h"
#include "tiler/flow_routing.h"
#include "tiler/surface.h"
#include "tiler/void_filling.h"
#include "world/climate.h"

namespace terracast::tiler {
namespace {

/// Raised when the same inputs give other covers.
constexpr int kVersion = 2;

constexpr double kMostNodes = 2048.0;  ///< along a side of the square
constexpr double kFinestSpacing_m = 8.0;
/// So far below the tree line nothing feels it.
constexpr double kNoLine_m = -1100.0;
/// A stream runs all year where so much land drains to it.
constexpr double kStreamCatchment_m2 = 4e6;
/// Crests are looked for over this distance to both sides, over twice and three times as much.
constexpr double kCrestReach_m = 32.0;

/// 0 below the lowest, 1 above the highest.
double ramp(double lowest, double highest, double value) {
  return std::clamp((value - lowest) / (highest - lowest), 0.0, 1.0);
}

/// How steeply a node's land falls away to two opposite sides, the more level of the two: a crest's top is
/// level, and yet rock between two walls. 0 where no pair of sides falls.
float crest_fall(const Grid<float>& heights_m, int i, int j, double spacing_m) {
  const int reach = std::max(static_cast<int>(std::lround(kCrestReach_m / spacing_m)), 1);
  float steepest = 0.0F;
  for (const auto& [di, dj] : {std::pair{1, 0}, {0, 1}, {1, 1}, {1, -1}})
    for (int steps = reach; steps <= 3 * reach; steps += reach) {
      const float fall_m =
          heights_m(i, j) - std::max(heights_m.clamped(i + steps * di, j + steps * dj),
                                     heights_m.clamped(i - steps * di, j - steps * dj));
      const auto away_m = static_cast<float>(steps * spacing_m * std::hypot(di, dj));
      steepest = std::max(steepest, fall_m / away_m);
    }
  return steepest;
}

}  // namespace

DerivedCover::DerivedCover(const DerivedCoverOptions& options, const LayerInputs& inputs)
    : options_(options),
      is_north_(inputs.frame.origin().lat_deg >= 0.0),
      region_(inputs.seed, 11, 6000.0, 3),
      fields_(inputs.seed, 12, 3000.0, 5),
      woods_(inputs.seed, 13, 1100.0, 5),
      patch_(inputs.seed, 14, 240.0, 3),
      dryness_(Dryness::of(inputs.surface.options(), inputs.frame)) {
  const double lat_deg = inputs.frame.origin().lat_deg;
  if (options_.snow_line_m < 0.0) options_.snow_line_m = world::snow_line_m(lat_deg);
  if (options_.tree_line_m < 0.0) options_.tree_line_m = world::tree_line_m(lat_deg);
  measure(inputs);
  hash_ = core::content_hash(fmt::format("derived cover {} {} {} {} {} {} {}", kVersion,
                                         inputs.seed, options_.forest_share, options_.field_share,
                                         options_.snow_line_m, options_.tree_line_m,
                                         inputs.surface.input_hash()));
  if (dryness_) hash_ = core::content_hash(hash_ + " " + dryness_->content_hash());
}

void DerivedCover::measure(const LayerInputs& inputs) {
  // A level's lattice: detail finer than its spacing vanishes there.
  spacing_m_ =
      std::max(std::exp2(std::ceil(std::log2(inputs.size_m / kMostNodes))), kFinestSpacing_m);
  const double half_m = inputs.size_m / 2.0;
  const int reach = static_cast<int>(std::ceil(half_m / spacing_m_));
  first_node_ = -reach;
  const int side = 2 * reach + 1;
  Grid<float> heights_m(side, side);
  std::vector<std::uint8_t> is_sea(heights_m.values.size(), 0);
  core::parallel_for(side, [&](std::int64_t row) {
    const int j = static_cast<int>(row);
    for (int i = 0; i < side; ++i) {
      const Eigen::Vector2d place =
          Eigen::Vector2d((i + first_node_) * spacing_m_, (j + first_node_) * spacing_m_)
              .cwiseMax(-half_m)
              .cwiseMin(half_m);
      const SurfaceSample ground = inputs.surface.sample(place.x(), place.y());
      const std::size_t node = heights_m.index(i, j);
      heights_m.values[node] = static_cast<float>(
          ground.z_world + place.squaredNorm() / (2.0 * geo::kWgs84SemiMajorAxis_m));
      is_sea[node] = ground.cover == world::Cover::Sea ? 1 : 0;
    }
  });

  slope_ = Grid<float>(side, side);
  northness_ = slope_;
  crest_ = slope_;
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i) {
      const auto rise = [&](int di, int dj) {
        const float ahead = heights_m.clamped(i + di, j + dj);
        const float behind = heights_m.clamped(i - di, j - dj);
        return static_cast<double>(ahead - behind) / (2.0 * spacing_m_);
      };
      const double east = rise(1, 0);
      const double north = rise(0, 1);
      slope_(i, j) = static_cast<float>(std::hypot(east, north));
      northness_(i, j) = static_cast<float>(-north / std::max(std::hypot(east, north), 1.0));
      crest_(i, j) = crest_fall(heights_m, i, j, spacing_m_);
    }

  // Water leaves over the sea and over the square's border.
  std::vector<std::uint8_t> is_outlet = is_sea;
  for (int k = 0; k < side; ++k)
    for (const std::size_t node : {heights_m.index(k, 0), heights_m.index(k, side - 1),
                                   heights_m.index(0, k), heights_m.index(side - 1, k)})
      is_outlet[node] = 1;
  const FlowRouting flow = route_flow(heights_m, is_outlet);
  Grid<std::uint8_t> is_land(side, side, 1);
  Grid<std::uint8_t> is_dry = is_land;
  const double stream_nodes = kStreamCatchment_m2 / (spacing_m_ * spacing_m_);
  for (std::size_t node = 0; node < is_dry.values.size(); ++node) {
    const bool is_stream = static_cast<double>(flow.area[node]) >= stream_nodes;
    is_land.values[node] = is_sea[node] != 0 ? 0 : 1;
    is_dry.values[node] = is_sea[node] != 0 || is_stream ? 0 : 1;
  }
  const auto distance_m = [&](const Grid<std::uint8_t>& is_member) {
    return distance_to_others(is_member, {spacing_m_, spacing_m_});
  };
  const auto is_none = [](std::uint8_t member) { return member == 0; };
  const auto has_others = [&](const Grid<std::uint8_t>& is_member) {
    return std::any_of(is_member.values.begin(), is_member.values.end(), is_none);
  };
  water_m_ = has_others(is_dry) ? distance_m(is_dry) : Grid<float>(side, side, 1e9F);
  if (has_others(is_land)) sea_m_ = distance_m(is_land);
}

Eigen::Vector2d DerivedCover::node_of(const Eigen::Vector2d& place_world) const {
  return place_world / spacing_m_ - Eigen::Vector2d::Constant(first_node_);
}

std::optional<world::Cover> DerivedCover::cover(const Eigen::Vector2d& place_world,
                                                const SurfaceSample& ground) const {
  using world::Cover;
  const Eigen::Vector2d node = node_of(place_world);
  const double slope = bilinear(slope_, node);
  const double crest = bilinear(crest_, node);
  const double shade = (is_north_ ? 1.0 : -1.0) * bilinear(northness_, node);
  const double water_m = bilinear(water_m_, node);
  const double height_m =
      ground.z_world + place_world.squaredNorm() / (2.0 * geo::kWgs84SemiMajorAxis_m);
  const double moisture = ground.moisture / 255.0;
  const double sea_m = sea_m_.values.empty() ? 1e9 : bilinear(sea_m_, node);
  if (sea_m < 30.0) return std::nullopt;
  const double patch = patch_(place_world);
  const double uneven = patch - 0.5;
  if (sea_m < 30.0 + 60.0 * patch) return std::nullopt;

  // Far below its lines climate is the same, whatever the region, which then counts for fields alone.
  const double is_level = 1.0 - ramp(0.07, 0.15, slope);
  const bool is_low =
      height_m - options_.tree_line_m + 190.0 + 100.0 * std::abs(shade) < kNoLine_m &&
      height_m - options_.snow_line_m + 260.0 + 350.0 * std::abs(shade) < 0.0;
  const double region = is_low && is_level == 0.0 ? 0.5 : region_(place_world);
  const double above_snow_m =
      height_m - options_.snow_line_m + 300.0 * (region - 0.5) + 200.0 * uneven + 350.0 * shade;
  // Snow slides off what is steeper than 45 degrees or so.
  if (above_snow_m > 0.0 && slope < 0.95 + 0.3 * uneven) return Cover::Snow;
  const double above_trees_m =
      height_m - options_.tree_line_m + 200.0 * (region - 0.5) + 160.0 * uneven + 100.0 * shade;
  // Scree rests at 35 degrees, soil with roots at less; plants hold more below the tree line.
  const double bare_slope = 1.0 - 0.35 * ramp(-200.0, 400.0, above_trees_m) + 0.3 * uneven;
  if (std::hypot(slope, crest) > bare_slope) return Cover::Bare;
  if (patch < ramp(250.0, 900.0, above_trees_m)) return Cover::Bare;

  const double growth = dryness_ ? dryness_->growth(place_world) : 1.0;
  if (dryness_)
    if (const auto dry = dryness_->cover(place_world, moisture)) return dry;

  const double wet = moisture + 0.15 * uneven - 3.0 * std::max(slope - 0.02, 0.0);
  if (wet > 0.82 && water_m < 500.0) return Cover::Wetland;

  const double woods = woods_(place_world);
  const double season = 1.0 - ramp(kNoLine_m, -700.0, above_trees_m);
  const double field_share = growth * options_.field_share * is_level * season *
                             (0.6 + 0.8 * region) * ramp(60.0, 300.0, sea_m);
  double forest_share = growth * options_.forest_share *
                        (0.55 + 0.9 * ramp(0.08, 0.35, slope) + 0.5 * (moisture - 0.4)) *
                        (1.0 - ramp(-120.0, 60.0, above_trees_m));
  // Trees line the water.
  if (water_m < 120.0) forest_share += growth * 0.2 * (1.0 - water_m / 120.0) * season;
  // Wind and a thin soil keep woods off crests between walls.
  forest_share *= 1.0 - ramp(0.3, 0.6, crest);
  // Among fields, woods keep to a part of what they would hold elsewhere.
  if (woods < 0.3 * forest_share) return Cover::Forest;
  const bool is_field = field_share > 0.0 && fields_(place_world) < field_share;
  if (is_field) return Cover::Crops;
  if (woods < forest_share) return Cover::Forest;
  if (woods < forest_share + 0.05 && patch < 0.6) return Cover::Shrubs;
  const double shrub_share =
      0.5 * ramp(-150.0, -20.0, above_trees_m) * (1.0 - ramp(100.0, 350.0, above_trees_m)) +
      0.35 * ramp(0.35, 0.15, moisture) * ramp(0.0, -0.4, shade);
  if (patch < shrub_share) return Cover::Shrubs;
  return Cover::Grass;
}

}  // namespace terracast::tiler
