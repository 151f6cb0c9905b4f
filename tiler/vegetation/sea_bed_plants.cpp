#include "tiler/vegetation/sea_bed_plants.h"

#include <algorithm>
#include <cmath>

#include "tiler/world_options.h"
#include "world/sea_bed.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using world::Cover;

/// Between blades or boulders and the water's surface.
constexpr double kBelowSurface_m = 0.3;
/// No tuft is drawn smaller or larger.
constexpr double kSmallestTuft = 0.55;
constexpr double kLargestTuft = 1.15;
/// So much of a tuft's reach lies where seagrass is painted.
constexpr double kInMeadow = 0.7;
/// By how much of a turn tufts may be turned from the way that the swell lays all of them.
constexpr double kTurned = 0.09;

/// Of the places of stones, as many bear one.
constexpr double kBouldersOnSand = 0.05;
constexpr double kBouldersOnRock = 0.55;
constexpr double kLargestBoulder = 2.2;
/// Boulders lie no nearer to the surface: boats pass above.
constexpr double kBoulderDepth_m = 2.0;

/// The bed's slope is that between places so far apart.
constexpr double kSlopeStep_m = 2.0;

}  // namespace

SeaBedPlants::SeaBedPlants(const VegetationPlan& plan, const world::TileId& id,
                           const LayerSite& site, TilePlaces& places, PlantSink& sink)
    : plan_(plan),
      id_(id),
      site_(site),
      bed_(dynamic_cast<const BedSite*>(&site)),
      places_(places),
      sink_(sink),
      noise_seed_(
          world::sea_bed::noise_seed(static_cast<std::uint64_t>(plan.surface.options().seed))) {}

void SeaBedPlants::add_all() {
  if (bed_ == nullptr) return;
  const auto for_each = [&](Stratum stratum, const auto& add) {
    const StratumInfo& info = kStrata[stratum];
    for (const PlanBox& box : places_.boxes(kFinestTile, info.coarsest_level, info.reach_m))
      for (const BlueNoise::Place& place : places_.places_in(stratum, box))
        if (is_bed(place)) add(place);
  };
  const int seagrass_level = plan_.library->of("seagrass").front().coarsest_level;
  if (id_.level - kLevelsAtCorner <= seagrass_level)
    for_each(kPlants, [&](const BlueNoise::Place& place) { add_seagrass(place); });
  for_each(kStones, [&](const BlueNoise::Place& place) { add_boulder(place); });
}

bool SeaBedPlants::is_bed(const BlueNoise::Place& place) const {
  return is_inside(place.at_world, plan_.half_size_m) && site_.cover(place.at_world) == Cover::Sea;
}

double SeaBedPlants::bed_z_world(const Vector2d& place_world) const {
  return site_.ground_z_world(place_world) - bed_->water_depth_m(place_world);
}

float SeaBedPlants::steepness(const Vector2d& place_world) const {
  const auto rise = [&](const Vector2d& along) {
    return (bed_z_world(place_world + kSlopeStep_m * along) -
            bed_z_world(place_world - kSlopeStep_m * along)) /
           (2.0 * kSlopeStep_m);
  };
  const double slope = std::hypot(rise(Vector2d::UnitX()), rise(Vector2d::UnitY()));
  return static_cast<float>(slope / std::hypot(slope, 1.0));
}

bool SeaBedPlants::has_room(const Vector2d& place_world, double radius_m,
                            double least_depth_m) const {
  for (const auto& [dx, dy] : {std::pair(-1, 0), {1, 0}, {0, -1}, {0, 1}}) {
    const Vector2d at = place_world + radius_m * Vector2d(dx, dy);
    if (!world::is_water(site_.cover(at)) || bed_->water_depth_m(at) < least_depth_m) return false;
  }
  return bed_->is_unheld(place_world, radius_m);
}

/// The swell comes from one side in all of a world.
std::uint16_t SeaBedPlants::heading_of(const PlaceDraws& draws) const {
  const double swell = core::random_unit(plan_.seed, 0x7377656c6cULL, 0);
  const double turn = swell + kTurned * (2.0 * draws.unit(kHeading) - 1.0) + 1.0;
  return static_cast<std::uint16_t>(static_cast<std::uint32_t>(turn * 65536.0) & 0xffffU);
}

float SeaBedPlants::seagrass(const Vector2d& place_world) const {
  const double depth_m = bed_->water_depth_m(place_world);
  if (depth_m <= 0.0) return 0.0f;
  const Vector3d at(place_world.x(), place_world.y(), bed_z_world(place_world));
  const world::sea_bed::Noise noise = world::sea_bed::noise_at(at, noise_seed_);
  return world::sea_bed::seagrass(noise.patch, noise.weed, static_cast<float>(depth_m), 0.0f);
}

bool SeaBedPlants::is_meadow(const Vector2d& place_world, double radius_m) const {
  for (const auto& [dx, dy] : {std::pair(-1, 0), {1, 0}, {0, -1}, {0, 1}})
    if (seagrass(place_world + radius_m * Vector2d(dx, dy)) <= world::sea_bed::kStands)
      return false;
  return true;
}

void SeaBedPlants::add_seagrass(const BlueNoise::Place& place) {
  const Vector2d& at = place.at_world;
  const double depth_m = bed_->water_depth_m(at);
  const PlaceDraws draws = this->draws(kPlants, place);
  const PlantModel& model = draws.variety(plan_.library->of("seagrass"));
  const double largest = std::min(kLargestTuft, (depth_m - kBelowSurface_m) / model.height_m);
  if (largest < kSmallestTuft || seagrass(at) <= world::sea_bed::kStands) return;
  // Within the meadow's border, but for tips of blades; the smallest stand on it.
  double scale = std::min(0.85 + 0.3 * draws.unit(kSize), largest);
  while (scale > kSmallestTuft && !is_meadow(at, kInMeadow * scale * model.reach_m))
    scale = std::max(0.8 * scale, kSmallestTuft);
  if (!has_room(at, scale * model.reach_m, scale * model.height_m + kBelowSurface_m)) return;
  sink_.add_on_bed({draws.id, model, heading_of(draws), scale, model.coarsest_level}, *bed_, at,
                   depth_m);
}

void SeaBedPlants::add_boulder(const BlueNoise::Place& place) {
  const Vector2d& at = place.at_world;
  const PlaceDraws draws = this->draws(kStones, place);
  const double drawn = draws.unit(kTake);
  if (drawn >= kBouldersOnRock) return;
  const double depth_m = bed_->water_depth_m(at);
  if (depth_m < kBoulderDepth_m) return;
  if (drawn >= kBouldersOnSand) {
    const Vector3d foot(at.x(), at.y(), site_.ground_z_world(at) - depth_m);
    const float patch = world::sea_bed::noise_at(foot, noise_seed_).patch;
    const float rock = world::sea_bed::rock(patch, steepness(at), 0.0f);
    if (drawn >= kBouldersOnRock * static_cast<double>(rock)) return;
  }
  const PlantModel& model = draws.variety(plan_.library->of("boulder"));
  // Few are large, as on land.
  const double scale = std::min({0.35 * std::pow(1.0 - draws.unit(kSize), -0.5), kLargestBoulder,
                                 (depth_m - kBelowSurface_m) / model.height_m});
  if (!has_room(at, scale * model.reach_m, scale * model.height_m + kBelowSurface_m)) return;
  sink_.add_on_bed({draws.id, model, draws.heading(), scale,
                    static_cast<int>(std::floor(std::log2(4.0 * scale)))},
                   *bed_, at, depth_m);
}

}  // namespace terracast::tiler
