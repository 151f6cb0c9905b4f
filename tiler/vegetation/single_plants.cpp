#include "tiler/vegetation/single_plants.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/error.h"
#include "tiler/vegetation/crop_rows.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;
using world::Cover;

/// Trees of forests are shown one by one up to this level.
constexpr int kTreeLevel = 2;
/// Beyond it, of trees that stand alone those are shown that would do so if so few of their places bore
/// any; on meadows and in gardens these are nearly all.
constexpr double kLoneShare = 0.12;
/// Stones and bushes keep so far from stems.
constexpr double kStemDistance_m = 1.5;

/// Trees below tall ones are smaller, less so where all are of one age.
constexpr double kLowShare = 0.72;
constexpr double kLowShareInStand = 0.9;
/// No species is drawn larger than this.
constexpr double kLargestTree = 1.9;
/// A canopy lower than this is one of bushes.
constexpr double kTallestBush_m = 3.5;

constexpr int kCropLevel = 2;
constexpr double kCropReach_m = 4.0;
/// No crops where the ground rises more than this: pieces of fields are level.
constexpr double kSteepestField = 0.18;
constexpr double kSteepestMeadow = 0.45;

std::string_view species_of(const TreeKinds& kinds, double drawn) {
  const double broadleaves =
      std::max(1.0 - kinds.dead - kinds.palms - kinds.conifers - kinds.pines, 0.0);
  const std::array<std::pair<double, std::string_view>, 7> shares = {
      {{kinds.dead, "dead_tree"},
       {kinds.palms, "palm"},
       {kinds.conifers, "spruce"},
       {kinds.pines, "pine"},
       {broadleaves * kinds.poplars, "poplar"},
       {broadleaves * kinds.birches, "birch"},
       {broadleaves, "oak"}}};
  double sum = 0.0;
  for (const auto& [share, name] : shares) {
    sum += share;
    if (drawn < sum) return name;
  }
  return kinds.conifers > 0.5 ? "spruce" : "oak";
}

/// How large a tree is drawn whose height no raster knows.
/// drawn   uniform in [0, 1)
double scale_of(const TreeKinds& kinds, const PlantModel& model, bool is_low, double drawn) {
  if (!kinds.is_stand) return kinds.size * (0.75 + 0.4 * drawn) * (is_low ? kLowShare : 1.0);
  // Species that are taller elsewhere hardly stand out of a canopy.
  return kinds.size * std::sqrt(kinds.top_m() / model.height_m) * (0.85 + 0.3 * drawn) *
         (is_low ? kLowShareInStand : 1.0);
}

/// Of crops that stand so high that it is seen; "": the ground shows the others.
std::string_view species_of(Crop crop) {
  switch (crop) {
    case Crop::Corn:
      return "corn";
    case Crop::Wheat:
      return "wheat";
    case Crop::Vine:
      return "vine";
    default:
      return "";
  }
}

}  // namespace

NearPlaces SinglePlants::stems_near(const PlanBox& box, std::initializer_list<Stratum> strata,
                                    double distance_m) {
  const PlanBox wider = box.grown(distance_m);
  NearPlaces stems(distance_m, wider);
  for (const Stratum stratum : strata)
    for (const BlueNoise::Place& place : places_.places_in(stratum, wider))
      stems.add(place.at_world);
  return stems;
}

/// For all but grass.
bool SinglePlants::has_room(const Vector2d& place_world, double radius_m) const {
  return site_.is_free(place_world, radius_m) && !site_.is_kept_low(place_world, radius_m);
}

void SinglePlants::add_trees(Stratum stratum) {
  const StratumInfo& info = kStrata[stratum];
  for (const PlanBox& box : places_.boxes(kFinestTile, info.coarsest_level, info.reach_m)) {
    const NearPlaces tall = stratum == kLowTrees ? stems_near(box, {kTallTrees}, kTreeDistance_m)
                                                 : stems_near(box, {}, kTreeDistance_m);
    for (const BlueNoise::Place& place : places_.places_in(stratum, box)) {
      if (!is_inside(place.at_world, plan_.half_size_m)) continue;
      if (tall.has_within(place.at_world, kTreeDistance_m)) continue;
      if (id_.level > kTreeLevel && contains(places_.box(), place.at_world) &&
          !is_lone(stratum, place))
        continue;
      add_tree(stratum, place);
    }
  }
}

/// Whether a tree that stands there is shown on coarse tiles.
bool SinglePlants::is_lone(Stratum stratum, const BlueNoise::Place& place) {
  if (stratum != kTallTrees) return false;
  return draws(stratum, place).unit(kTake) < kLoneShare && !pieces_.is_piece(place.at_world);
}

void SinglePlants::add_tree(Stratum stratum, const BlueNoise::Place& place) {
  const PlaceDraws draws = this->draws(stratum, place);
  const TileGround::Here here = ground_.here(place.at_world);
  if (draws.unit(kTake) >= here.growth.trees) return;
  const bool is_low = stratum == kLowTrees;
  const std::optional<double>& canopy_m = here.canopy_m;
  const TreeKinds kinds = ground_.tree_kinds(here);

  const PlantModel* model = nullptr;
  double scale = 0.0;
  const auto is_free_as = [&](std::string_view species, double smaller) {
    model = &draws.variety(of(species));
    scale = canopy_m ? *canopy_m / model->height_m
                     : smaller * std::min(kLargestTree,
                                          scale_of(kinds, *model, is_low, draws.unit(kSize)));
    return scale <= kLargestTree && has_room(place.at_world, scale * model->reach_m);
  };
  const std::string_view species = species_of(kinds, draws.unit(kKind));
  // Beside walls, water and roads the crown has less room: a smaller tree, or, where its height is
  // known, a slimmer one.
  const bool is_free =
      canopy_m && *canopy_m < kTallestBush_m ? is_free_as("bush", 1.0)
      : canopy_m ? is_free_as(species, 1.0) || is_free_as("birch", 1.0) || is_free_as("poplar", 1.0)
                 : is_free_as(species, 1.0) || is_free_as(species, 0.5);
  if (!is_free) return;
  const int coarsest_level = is_lone(stratum, place) ? kStrata[stratum].coarsest_level : kTreeLevel;
  sink_.add({.id = draws.id,
             .model = *model,
             .heading = draws.heading(),
             .scale = scale,
             .coarsest_level = coarsest_level,
             .tint = kinds.tint},
            place.at_world);
}

void SinglePlants::add_bushes() {
  const StratumInfo& info = kStrata[kBushes];
  for (const PlanBox& box : places_.boxes(kFinestTile, info.coarsest_level, info.reach_m)) {
    const NearPlaces stems = stems_near(box, {kTallTrees, kLowTrees}, kStemDistance_m);
    for (const BlueNoise::Place& place : places_.places_in(kBushes, box)) add_bush(place, stems);
  }
}

void SinglePlants::add_bush(const BlueNoise::Place& place, const NearPlaces& stems) {
  if (!is_inside(place.at_world, plan_.half_size_m)) return;
  const PlaceDraws draws = this->draws(kBushes, place);
  const TileGround::Here here = ground_.here(place.at_world);
  if (draws.unit(kTake) >= here.growth.bushes) return;
  if (here.growth.trees > kForestShare && stems.has_within(place.at_world, kStemDistance_m)) return;
  const bool is_dwarf = draws.unit(kKind) < here.growth.dwarf_pines;
  const PlantModel& model = draws.variety(of(is_dwarf ? "mountain_pine" : "bush"));
  const double scale =
      0.45 + 0.75 * draws.unit(kSize) * (0.5 + 0.5 * ground_.tree_kinds(here).size);
  if (!has_room(place.at_world, scale * model.reach_m)) return;
  sink_.add({draws.id, model, draws.heading(), scale, scale < 0.75 ? 1 : 2}, place.at_world);
}

void SinglePlants::add_plants() {
  const StratumInfo& info = kStrata[kPlants];
  for (const PlanBox& box : places_.boxes(kFinestTile, info.coarsest_level, info.reach_m))
    for (const BlueNoise::Place& place : places_.places_in(kPlants, box)) add_plant(place);
}

void SinglePlants::add_plant(const BlueNoise::Place& place) {
  if (!is_inside(place.at_world, plan_.half_size_m)) return;
  const PlaceDraws draws = this->draws(kPlants, place);
  const TileGround::Here here = ground_.here(place.at_world);
  const double drawn = draws.unit(kTake);
  const bool is_reed = drawn < here.growth.reeds;
  if (!is_reed && drawn >= here.growth.reeds + here.growth.grass) return;
  if (here.ground.slope > kSteepestMeadow) return;
  const PlantModel& model = draws.variety(of(is_reed ? "reed" : "grass"));
  if (id_.level - kLevelsAtCorner > model.coarsest_level) return;
  const double scale = 0.75 + 0.5 * draws.unit(kSize);
  if (!site_.is_free(place.at_world, scale * model.reach_m)) return;
  if (is_reed && site_.is_kept_low(place.at_world, scale * model.reach_m)) return;
  sink_.add({draws.id, model, draws.heading(), scale, model.coarsest_level}, place.at_world);
}

void SinglePlants::add_stones() {
  const StratumInfo& info = kStrata[kStones];
  for (const PlanBox& box : places_.boxes(kFinestTile, info.coarsest_level, info.reach_m)) {
    const NearPlaces stems = stems_near(box, {kTallTrees}, kStemDistance_m);
    for (const BlueNoise::Place& place : places_.places_in(kStones, box)) add_stone(place, stems);
  }
}

void SinglePlants::add_stone(const BlueNoise::Place& place, const NearPlaces& stems) {
  if (!is_inside(place.at_world, plan_.half_size_m)) return;
  const PlaceDraws draws = this->draws(kStones, place);
  const TileGround::Here here = ground_.here(place.at_world);
  if (draws.unit(kTake) >= here.growth.boulders) return;
  if (here.growth.trees > 0.0 && stems.has_within(place.at_world, kStemDistance_m)) return;
  const PlantModel& model = draws.variety(of("boulder"));
  // Few are large: fragments follow a power law.
  const double scale = std::min(0.3 * std::pow(1.0 - draws.unit(kSize), -0.5), 3.0);
  if (!has_room(place.at_world, scale * model.reach_m)) return;
  sink_.add({draws.id, model, draws.heading(), scale,
             static_cast<int>(std::floor(std::log2(4.0 * scale)))},
            place.at_world);
}

void SinglePlants::add_crops() {
  const auto cell = [](double at) {
    return static_cast<std::int32_t>(std::floor(at / Fields::kCell_m));
  };
  std::optional<Fields::Found> last;
  for (const PlanBox& box : places_.boxes(kFinestTile, kCropLevel, kCropReach_m)) {
    for (std::int32_t y = cell(box.lowest.y()); y <= cell(box.highest.y()); ++y)
      for (std::int32_t x = cell(box.lowest.x()); x <= cell(box.highest.x()); ++x) {
        const std::optional<CropPiece> crop = plan_.fields.piece_in(x, y, last);
        if (crop && contains(box, crop->center_world)) add_crop(*crop, x, y);
      }
  }
}

void SinglePlants::add_crop(const CropPiece& crop, std::int32_t cell_x, std::int32_t cell_y) {
  const Vector2d& center = crop.center_world;
  if (!is_inside(center, plan_.half_size_m - kCropPiece_m)) return;
  const std::string_view species = species_of(crop.crop);
  if (species.empty()) return;
  const std::vector<PlantModel>& models = of(species);
  if (id_.level - kLevelsAtCorner > models.front().coarsest_level) return;
  const Vector2d along(std::cos(crop.heading_rad), std::sin(crop.heading_rad));
  const Vector2d across(-along.y(), along.x());
  bool is_field = ground_.ground(center).slope < kSteepestField;
  for (const double du : {-0.5, 0.5})
    for (const double dv : {-0.5, 0.5})
      is_field = is_field &&
                 site_.cover(center + kCropPiece_m * (du * along + dv * across)) == Cover::Crops;
  if (!is_field || !has_room(center, kCropPiece_m * std::numbers::sqrt2 / 2)) return;
  const PlaceDraws draws{plan_.seed, plan_.numbers.id(CellNumbers::kCrops, cell_x, cell_y)};
  const PlantModel& model = draws.variety(models);
  const double turn =
      crop.heading_rad / (2.0 * std::numbers::pi) + (draws.unit(kHeading) < 0.5 ? 0.5 : 0.0);
  const auto heading = static_cast<std::uint16_t>(std::lround(turn * 65536.0) & 0xffff);
  sink_.add({draws.id, model, heading, 1.0, model.coarsest_level}, center);
}

void check_reach_of_trees(const PlantLibrary& library) {
  for (const std::string_view species : {"oak", "birch", "poplar", "spruce", "pine", "palm"})
    for (const PlantModel& model : library.of(species))
      TERRACAST_CHECK(kLargestTree * model.reach_m <= kStrata[kTallTrees].reach_m, "{} {} m",
                      species, model.reach_m);
}

}  // namespace terracast::tiler
