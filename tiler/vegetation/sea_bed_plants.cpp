#include "tiler/vegetation/sea_bed_plants.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>

#include "core/error.h"
#include "tiler/world_options.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using world::Cover;

/// Between blades and the water's surface.
constexpr double kBelowSurface_m = 0.3;
/// No tuft is drawn smaller or larger.
constexpr double kSmallestTuft = 0.55;
constexpr double kLargestTuft = 1.15;
/// So much of a tuft's reach lies where seagrass is painted.
constexpr double kInMeadow = 0.7;
/// A tuft is level and rigid. On a slope it is lowered until its sheaves on the lower side have their
/// feet in the bed, by no more of its height: those on the upper side are buried, and the tufts above
/// stand in their place.
constexpr double kMostLowered = 0.5;
/// By how much of a turn tufts may be turned from the way that the swell lays all of them.
constexpr double kTurned = 0.09;

/// Of the places of stones, as many bear one.
constexpr double kBouldersOnSand = 0.05;
constexpr double kBouldersOnRock = 0.55;
constexpr double kSmallestBoulder = 0.35;
constexpr double kLargestBoulder = 2.2;
/// The tops of boulders lie no nearer to the surface: boats pass above.
constexpr double kBoulderDepth_m = 2.0;

/// Where boulders lie the bed's slope is that of places so far round them.
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

SeaBedPlants::Round SeaBedPlants::round_of(const Vector2d& place_world, double radius_m) {
  constexpr double kHalf = std::numbers::sqrt2 / 2;
  Round round;
  round[0] = place_world;
  std::size_t k = 1;
  for (const auto& [x, y] : {std::pair(1.0, 0.0),
                             {kHalf, kHalf},
                             {0.0, 1.0},
                             {-kHalf, kHalf},
                             {-1.0, 0.0},
                             {-kHalf, -kHalf},
                             {0.0, -1.0},
                             {kHalf, -kHalf}})
    round[k++] = place_world + radius_m * Vector2d(x, y);
  return round;
}

SeaBedPlants::Bed SeaBedPlants::bed_at(const Vector2d& place_world, double radius_m) const {
  const Round round = round_of(place_world, radius_m);
  // Over some metres the sea's surface is level.
  const double surface_z = site_.ground_z_world(place_world);
  Bed bed;
  core::Lanes3d points;
  Vector2d moment = Vector2d::Zero();
  for (std::size_t k = 0; k < round.size(); ++k) {
    bed.depth_m[k] = bed_->water_depth_m(round[k]);
    moment += (round[k] - place_world) * bed.depth_m[k];
  }
  for (int lane = 0; lane < core::kLanes; ++lane) {
    const std::size_t k = std::min(static_cast<std::size_t>(lane), round.size() - 1);
    points[0][lane] = round[k].x();
    points[1][lane] = round[k].y();
    points[2][lane] = surface_z - bed.depth_m[k];
  }
  bed.noise = world::sea_bed::noise_at(points, noise_seed_);
  // Squares of the eight places' x add up to four of the radius.
  const double slope = moment.norm() / (4.0 * radius_m * radius_m);
  bed.steepness = static_cast<float>(slope / std::hypot(slope, 1.0));
  return bed;
}

bool SeaBedPlants::has_room(const Vector2d& place_world, double radius_m,
                            double least_depth_m) const {
  for (const Vector2d& at : round_of(place_world, radius_m))
    if (!world::is_water(site_.cover(at)) || bed_->water_depth_m(at) < least_depth_m) return false;
  return bed_->is_unheld(place_world, radius_m);
}

double SeaBedPlants::lowered_m(const Vector2d& place_world, double depth_m, const PlantModel& model,
                               double scale) const {
  double deepest_m = depth_m;
  for (const Vector2d& at : round_of(place_world, scale * model.root_reach_m))
    deepest_m = std::max(deepest_m, bed_->water_depth_m(at));
  return std::max(deepest_m - depth_m - scale * model.sunk_m, 0.0);
}

/// The swell comes from one side in all of a world.
std::uint16_t SeaBedPlants::heading_of(const PlaceDraws& draws) const {
  const double swell = core::random_unit(plan_.seed, 0x7377656c6cULL, 0);
  const double turn = swell + kTurned * (2.0 * draws.unit(kHeading) - 1.0) + 1.0;
  return static_cast<std::uint16_t>(static_cast<std::uint32_t>(turn * 65536.0) & 0xffffU);
}

std::optional<SeaBedPlants::Tuft> SeaBedPlants::tuft_at(const Vector2d& place_world, double depth_m,
                                                        const PlantModel& model,
                                                        double largest) const {
  for (double scale = largest;; scale = std::max(0.8 * scale, kSmallestTuft)) {
    const Bed bed = bed_at(place_world, kInMeadow * scale * model.reach_m);
    const auto stands = [&](std::size_t k) {
      const int lane = static_cast<int>(k);
      return world::sea_bed::seagrass(bed.noise.patch[lane], bed.noise.weed[lane],
                                      static_cast<float>(bed.depth_m[k]), bed.steepness,
                                      0.0f) > world::sea_bed::kStands;
    };
    if (!stands(0)) return std::nullopt;
    bool is_meadow = true;
    for (std::size_t k = 1; k < bed.depth_m.size(); ++k) is_meadow = is_meadow && stands(k);
    // Within the meadow's border, but for tips of blades; the smallest stand on it.
    const bool is_smallest = scale <= kSmallestTuft;
    const double lowered = lowered_m(place_world, depth_m, model, scale);
    if ((is_meadow || is_smallest) && lowered <= kMostLowered * scale * model.height_m)
      return Tuft{scale, lowered};
    if (is_smallest) return std::nullopt;
  }
}

void SeaBedPlants::add_seagrass(const BlueNoise::Place& place) {
  const Vector2d& at = place.at_world;
  const double depth_m = bed_->water_depth_m(at);
  const PlaceDraws draws = this->draws(kPlants, place);
  const PlantModel& model = draws.variety(plan_.library->of("seagrass"));
  const double largest = std::min(kLargestTuft, (depth_m - kBelowSurface_m) / model.height_m);
  if (largest < kSmallestTuft) return;
  const std::optional<Tuft> tuft =
      tuft_at(at, depth_m, model, std::min(0.85 + 0.3 * draws.unit(kSize), largest));
  if (!tuft ||
      !has_room(at, tuft->scale * model.reach_m, tuft->scale * model.height_m + kBelowSurface_m))
    return;
  sink_.add_on_bed({.id = draws.id,
                    .model = model,
                    .heading = heading_of(draws),
                    .scale = tuft->scale,
                    .coarsest_level = model.coarsest_level,
                    .lowered_m = tuft->lowered_m},
                   *bed_, at, depth_m);
}

void SeaBedPlants::add_boulder(const BlueNoise::Place& place) {
  const Vector2d& at = place.at_world;
  const PlaceDraws draws = this->draws(kStones, place);
  const double drawn = draws.unit(kTake);
  if (drawn >= kBouldersOnRock) return;
  const double depth_m = bed_->water_depth_m(at);
  const PlantModel& model = draws.variety(plan_.library->of("boulder"));
  const double largest = std::min(kLargestBoulder, (depth_m - kBoulderDepth_m) / model.height_m);
  if (largest < kSmallestBoulder) return;
  if (drawn >= kBouldersOnSand) {
    const Bed bed = bed_at(at, kSlopeStep_m);
    const float rock = world::sea_bed::rock(bed.noise.patch[0], bed.steepness, 0.0f);
    if (drawn >= kBouldersOnRock * static_cast<double>(rock)) return;
  }
  // Few are large, as on land.
  const double scale =
      std::min(kSmallestBoulder * std::pow(1.0 - draws.unit(kSize), -0.5), largest);
  if (!has_room(at, scale * model.reach_m, scale * model.height_m + kBoulderDepth_m)) return;
  sink_.add_on_bed({draws.id, model, draws.heading(), scale,
                    static_cast<int>(std::floor(std::log2(4.0 * scale)))},
                   *bed_, at, depth_m);
}

void check_reach_on_bed(const PlantLibrary& library) {
  const auto check = [&](std::string_view species, double largest, Stratum stratum) {
    for (const PlantModel& model : library.of(species))
      TERRACAST_CHECK(largest * model.reach_m <= kStrata[stratum].reach_m, "{} {} m", species,
                      model.reach_m);
  };
  check("seagrass", kLargestTuft, kPlants);
  check("boulder", kLargestBoulder, kStones);
}

}  // namespace terracast::tiler
