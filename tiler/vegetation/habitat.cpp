#include "tiler/vegetation/habitat.h"

#include <algorithm>
#include <cmath>

#include "tiler/vegetation/patch_noise.h"
#include "world/climate.h"

namespace terracast::tiler {
namespace {

using world::Cover;

/// Over so many metres below the tree line forest opens and trees get smaller.
constexpr double kTreeLineFade_m = 320.0;
/// The tree line differs from region to region by so much.
constexpr double kRegional_m = 120.0;
/// Woods of land of which nothing is known are stands from here on.
constexpr double kWooded = 0.5;
/// Of a stand's trees, so many are of what dominates it; the rest are as in the region.
constexpr double kDominance = 0.86;
/// Trees at the edge of forest are lower by so much.
constexpr double kLowerAtEdge = 0.5;
/// What a stand's trees have in common of their colour.
constexpr double kSharedTint = 0.6;

bool is_open_land(Cover cover) {
  return cover == Cover::Grass || cover == Cover::Land || cover == Cover::Crops;
}

}  // namespace

Habitat::Habitat(std::uint64_t seed, double lat_deg, const world::FieldPattern& fields)
    : lat_deg_(lat_deg),
      tree_line_m_(world::tree_line_m(lat_deg)),
      noise_(seed, 7),
      stands_(seed),
      groves_(seed, fields) {}

double Habitat::patches(const Eigen::Vector2d& place_world, double period_m, int which) const {
  return tiler::patches(noise_, place_world, period_m, which);
}

double Habitat::woods(const Ground& ground, const Eigen::Vector2d& place_world) const {
  return step_up(patches(place_world, 700.0, 5) + 0.5 * (ground.moisture - 0.45), 0.5, 0.6);
}

Eigen::Vector2d Habitat::strayed(const Eigen::Vector2d& place_world) const {
  const Eigen::Vector2d at = place_world / 37.0;
  return place_world + 14.0 * Eigen::Vector2d(fractal_noise(noise_, at.x(), at.y() + 31.3, 2),
                                              fractal_noise(noise_, at.x() + 57.9, at.y(), 2));
}

double Habitat::below_line_m(const Ground& ground, const Eigen::Vector2d& place_world) const {
  const double below_m = tree_line_m_ - ground.height_m;
  if (below_m > kTreeLineFade_m + 0.51 * kRegional_m) return below_m;
  const double regional_m = kRegional_m * (patches(place_world, 900.0, 1) - 0.5);
  return tree_line_m_ + regional_m - ground.height_m;
}

TreeKinds Habitat::tree_kinds(const Ground& ground, const Eigen::Vector2d& place_world) const {
  TreeKinds kinds;
  const double lowland = step_up(below_line_m(ground, place_world), 0.0, kTreeLineFade_m);
  kinds.size = (0.3 + 0.7 * lowland) * (1.0 - 0.25 * step_up(ground.slope, 0.5, 1.1));
  const double altitude = tree_line_m_ > 0.0 ? ground.height_m / tree_line_m_ : 1.0;
  const double lat = std::abs(lat_deg_);
  kinds.conifers = std::clamp(step_up(altitude, 0.35, 0.75) + step_up(lat, 52.0, 64.0) +
                                  0.9 * (patches(place_world, 500.0, 3) - 0.62),
                              0.0, 0.97);
  kinds.pines = (1.0 - kinds.conifers) * std::clamp(1.4 * (patches(place_world, 420.0, 4) - 0.5) +
                                                        0.7 * (0.35 - ground.moisture) +
                                                        0.4 * step_up(ground.slope, 0.3, 0.8),
                                                    0.0, 0.9);
  kinds.dead = 0.012 + 0.03 * (1.0 - lowland);
  kinds.poplars = 0.04;
  be_of_stand(kinds, ground, place_world);
  if (ground.cover == Cover::BuiltUp) {
    kinds.size *= 0.75;
    kinds.conifers *= 0.4;
    kinds.pines *= 0.6;
    kinds.dead = 0.0;
    kinds.poplars = 0.12;
  }
  if (ground.cover == Cover::Bare) kinds.dead = 0.1;
  if (ground.cover == Cover::Wetland) {
    kinds.conifers *= 0.2;
    kinds.dead = 0.08;
  }
  // Palms by warm coasts, in towns more than outside.
  const double warm =
      (1.0 - step_up(lat, 36.0, 45.0)) * (1.0 - step_up(ground.height_m, 200.0, 500.0));
  kinds.palms = warm * (ground.cover == Cover::BuiltUp  ? 0.35
                        : ground.cover == Cover::Forest ? 0.0
                                                        : 0.08);
  return kinds;
}

void Habitat::be_of_stand(TreeKinds& kinds, const Ground& ground,
                          const Eigen::Vector2d& place_world) const {
  if (ground.cover == Cover::BuiltUp) {
    kinds.size *= 0.85 + 0.3 * patches(place_world, 240.0, 2);
    return;
  }
  const Stand stand = stands_.at(place_world);
  const auto dominate = [&](double& share, bool does) {
    share = (1.0 - kDominance) * share + (does ? kDominance : 0.0);
  };
  if (!stand.is_mixed) {
    const double conifers = kinds.conifers;
    const bool has_conifers = stand.kind < conifers;
    const bool has_pines = !has_conifers && stand.kind < conifers + kinds.pines;
    dominate(kinds.conifers, has_conifers);
    dominate(kinds.pines, has_pines);
    kinds.birches = stand.variety < 0.62 ? 0.12 : stand.variety < 0.9 ? 0.85 : 0.3;
    if (stand.variety > 0.97) kinds.poplars = 0.8;
    if (has_conifers && stand.is_dying) kinds.dead = 0.4;
  }
  kinds.is_stand = ground.cover == Cover::Forest ||
                   (ground.cover == Cover::Land && woods(ground, place_world) > kWooded);
  if (kinds.is_stand)
    kinds.size *= stand.height * (1.0 - kLowerAtEdge * ground.edge);
  else
    kinds.size *= 0.85 + 0.3 * patches(place_world, 240.0, 2);
  if (ground.is_by_water && !kinds.is_stand) {
    kinds.poplars = 0.3;
    kinds.birches = 0.4;
  }
  kinds.tint = {stand.light, stand.warm, kSharedTint};
}

void Habitat::grow_forest(Growth& growth, const Ground& ground,
                          const Eigen::Vector2d& place_world) const {
  const Stand stand = stands_.at(place_world);
  // Here and there a tree has fallen, or a few.
  const double gap = step_up(patches(place_world, 30.0, 12), 0.82, 0.88);
  growth.trees *= stand.is_clearing ? 0.04 : stand.density * (1.0 - 0.9 * gap);
  growth.bushes =
      stand.is_clearing ? 0.4 : std::max(growth.bushes, std::max(0.35 * gap, 0.8 * ground.edge));
  if (stand.is_clearing) growth.grass = 0.7;
}

Grove Habitat::grove(const Ground& ground, const Eigen::Vector2d& place_world) const {
  Grove grove = ground.cover == Cover::Crops ? Grove{} : groves_.groups(place_world, ground.slope);
  if (!ground.has_rows) return grove;
  const auto add = [&](const Grove& more) {
    grove.trees = std::max(grove.trees, more.trees);
    grove.bushes = std::max(grove.bushes, more.bushes);
  };
  add(groves_.along_fields(place_world, ground.cover));
  if (ground.is_by_way) add(groves_.along_ways(place_world));
  if (ground.is_by_water) add(groves_.along_waters(place_world));
  // Woods have a mantle of bushes and of young trees.
  add({0.10 * ground.edge, 0.5 * ground.edge * ground.edge});
  grove.trees += groves_.lone_trees(place_world);
  return grove;
}

Growth Habitat::growth(const Ground& ground, const Eigen::Vector2d& place_world) const {
  Growth growth;
  const double below_line_m = this->below_line_m(ground, place_world);
  // 0 at the tree line, 1 where it no longer matters.
  const double lowland = step_up(below_line_m, 0.0, kTreeLineFade_m);
  const double flatness = 1.0 - step_up(ground.slope, 0.75, 1.3);
  const double dwarfs =
      step_up(below_line_m, -350.0, -60.0) * (1.0 - step_up(below_line_m, 60.0, 260.0));

  switch (ground.cover) {
    case Cover::Forest:
      growth.trees = 0.97 * (0.25 + 0.75 * lowland) * flatness;
      growth.bushes = 0.12;
      grow_forest(growth, ground, place_world);
      growth.boulders = 0.04 + 0.3 * step_up(ground.slope, 0.5, 1.0);
      break;
    case Cover::Land: {
      // Woods where it is moist and the noise wants them, meadows between.
      const double woods = this->woods(ground, place_world);
      growth.trees = 0.97 * woods * lowland * flatness;
      growth.bushes = 0.25 * step_up(woods, 0.05, 0.4) * (1.0 - woods) * lowland;
      growth.grass = 0.8 * (1.0 - woods) * step_up(below_line_m, -500.0, -200.0);
      if (woods > kWooded) grow_forest(growth, ground, place_world);
      growth.boulders = 0.03 + 0.5 * step_up(ground.slope, 0.45, 0.9);
      break;
    }
    case Cover::Shrubs:
      growth.trees =
          0.15 * step_up(patches(place_world, 150.0, 7), 0.48, 0.72) * lowland * flatness;
      growth.bushes = 0.1 + 0.9 * step_up(patches(place_world, 60.0, 6), 0.25, 0.6);
      growth.grass = 0.5;
      growth.boulders = 0.1;
      break;
    case Cover::Grass:
      growth.grass = 1.0;
      growth.boulders = 0.02 + 0.2 * step_up(ground.slope, 0.4, 0.9);
      break;
    case Cover::Crops:
      break;
    case Cover::BuiltUp:
      growth.trees = 0.2 * (0.3 + patches(place_world, 90.0, 9)) * lowland;
      growth.bushes = 0.14 + 0.5 * step_up(ground.slope, 0.2, 0.4);  // gardens and thickets
      growth.grass = 0.15;
      break;
    case Cover::Bare:
      growth.trees = 0.02 * step_up(patches(place_world, 200.0, 7), 0.52, 0.7) * lowland * flatness;
      growth.bushes = 0.06 * step_up(patches(place_world, 140.0, 8), 0.52, 0.7) * lowland;
      growth.boulders = 0.55;
      break;
    case Cover::Wetland:
      growth.trees = 0.03 * lowland;
      growth.bushes = 0.06;
      growth.reeds = 0.5 + 0.5 * patches(place_world, 40.0, 10);
      growth.grass = 0.4;
      break;
    case Cover::Snow:
    case Cover::Sea:
    case Cover::Lake:
    case Cover::River:
    case Cover::Seabed:
    case Cover::Outside:
      return Growth{};
  }
  if (is_open_land(ground.cover)) {
    const Grove grove = this->grove(ground, place_world);
    growth.trees = std::max(growth.trees, grove.trees * lowland * flatness);
    growth.bushes = std::max(growth.bushes, grove.bushes * lowland);
  }
  // Krummholz in the belt about the tree line.
  if (below_line_m < kTreeLineFade_m &&
      (ground.cover == Cover::Forest || ground.cover == Cover::Land ||
       ground.cover == Cover::Shrubs || ground.cover == Cover::Grass)) {
    growth.dwarf_pines = dwarfs;
    const double belt = dwarfs * step_up(patches(place_world, 80.0, 11), 0.42, 0.6);
    growth.bushes = std::max(growth.bushes * step_up(below_line_m, -300.0, 0.0), 0.7 * belt);
  }
  if (ground.is_kept_short) growth.trees = growth.bushes = growth.boulders = 0.0;
  return growth;
}

void Habitat::thin_out(Growth& growth, double share) {
  growth.trees *= share;
  growth.bushes *= share;
  growth.dwarf_pines *= share;
  growth.grass *= share;
}

void Habitat::plant_garden(Growth& growth) {
  growth.trees = std::max(growth.trees, 0.10);
  growth.bushes = std::max(growth.bushes, 0.10);
  growth.grass = 0.0;  // it is mown
  growth.boulders = 0.0;
  growth.dwarf_pines = 0.0;
}

void Habitat::plant_garden(TreeKinds& kinds) {
  kinds.dead = 0.0;
  kinds.size *= 0.6;
  kinds.conifers *= 0.4;
  kinds.pines *= 0.5;
  kinds.poplars = 0.06;
}

}  // namespace terracast::tiler
