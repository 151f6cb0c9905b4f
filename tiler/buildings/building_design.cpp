#include "tiler/buildings/building_design.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "core/random.h"
#include "geo/units.h"
#include "tiler/buildings/building_draws.h"
#include "tiler/buildings/building_finishes.h"
#include "tiler/buildings/building_tags.h"

namespace terracast::tiler {
namespace {

using core::random_unit;

/// The tallest building stands 828 m high (Burj Khalifa); masts are no buildings.
constexpr double kTallest_m = 900.0;
constexpr double kLowest_m = 1.8;
constexpr double kMostLevels = 200.0;

struct KindName {
  std::string_view value;
  BuildingKind kind;
};
constexpr KindName kKinds[] = {
    {"house", BuildingKind::House},
    {"detached", BuildingKind::House},
    {"semidetached_house", BuildingKind::House},
    {"terrace", BuildingKind::House},
    {"bungalow", BuildingKind::House},
    {"villa", BuildingKind::House},
    {"cabin", BuildingKind::House},
    {"farm", BuildingKind::House},
    {"static_caravan", BuildingKind::Garage},
    {"hut", BuildingKind::Garage},
    {"apartments", BuildingKind::Apartments},
    {"residential", BuildingKind::Apartments},
    {"dormitory", BuildingKind::Apartments},
    {"hotel", BuildingKind::Apartments},
    {"commercial", BuildingKind::Commercial},
    {"retail", BuildingKind::Commercial},
    {"supermarket", BuildingKind::Hall},
    {"kiosk", BuildingKind::Garage},
    {"office", BuildingKind::Offices},
    {"public", BuildingKind::Commercial},
    {"civic", BuildingKind::Commercial},
    {"government", BuildingKind::Offices},
    {"school", BuildingKind::Commercial},
    {"university", BuildingKind::Offices},
    {"hospital", BuildingKind::Offices},
    {"train_station", BuildingKind::Commercial},
    {"terminal", BuildingKind::Offices},
    {"industrial", BuildingKind::Hall},
    {"warehouse", BuildingKind::Hall},
    {"hangar", BuildingKind::Hall},
    {"manufacture", BuildingKind::Hall},
    {"sports_hall", BuildingKind::Hall},
    {"stadium", BuildingKind::Hall},
    {"church", BuildingKind::Church},
    {"chapel", BuildingKind::Church},
    {"cathedral", BuildingKind::Church},
    {"garage", BuildingKind::Garage},
    {"garages", BuildingKind::Garage},
    {"shed", BuildingKind::Garage},
    {"service", BuildingKind::Garage},
    {"transformer_tower", BuildingKind::Tower},
    {"parking", BuildingKind::Commercial},
    {"barn", BuildingKind::Barn},
    {"farm_auxiliary", BuildingKind::Barn},
    {"stable", BuildingKind::Barn},
    {"cowshed", BuildingKind::Barn},
    {"sty", BuildingKind::Barn},
    {"boathouse", BuildingKind::Barn},
    {"greenhouse", BuildingKind::Greenhouse},
    {"roof", BuildingKind::Canopy},
    {"carport", BuildingKind::Canopy},
    {"canopy", BuildingKind::Canopy},
    {"tower", BuildingKind::Tower},
    {"water_tower", BuildingKind::Tower},
    {"silo", BuildingKind::Tower},
    {"bell_tower", BuildingKind::Tower},
};

struct RoofName {
  std::string_view value;
  RoofShape shape;
};
constexpr RoofName kRoofs[] = {
    {"flat", RoofShape::Flat},
    {"gabled", RoofShape::Gabled},
    {"pitched", RoofShape::Gabled},
    {"gabled_row", RoofShape::Gabled},
    {"saltbox", RoofShape::Gabled},
    {"cross_gabled", RoofShape::Gabled},
    {"hipped", RoofShape::Hipped},
    {"half-hipped", RoofShape::HalfHipped},
    {"half_hipped", RoofShape::HalfHipped},
    {"side_hipped", RoofShape::Hipped},
    {"hipped-and-gabled", RoofShape::HalfHipped},
    {"pyramidal", RoofShape::Pyramidal},
    {"tented", RoofShape::Pyramidal},
    {"skillion", RoofShape::Skillion},
    {"lean_to", RoofShape::Skillion},
    {"gambrel", RoofShape::Gambrel},
    {"mansard", RoofShape::Mansard},
    {"round", RoofShape::Round},
    {"dome", RoofShape::Dome},
    {"onion", RoofShape::Dome},
    {"cone", RoofShape::Spire},
    {"conical", RoofShape::Spire},
    {"spire", RoofShape::Spire},
};

BuildingKind guessed_kind(const Surroundings& around) {
  if (around.area_m2 < 38.0) return BuildingKind::Garage;
  // A mole, a dock: nobody builds flats in the sea.
  if (around.share_at_sea > 0.5) return BuildingKind::Hall;
  const bool is_town = around.share_built > 0.24;
  if (around.area_m2 > 1800.0 && !is_town && around.num_corners <= 12) return BuildingKind::Hall;
  if (around.area_m2 > (is_town ? 110.0 : 320.0)) return BuildingKind::Apartments;
  return BuildingKind::House;
}

/// Parts of castles and chapels say so in other keys than building=*.
BuildingKind kind_of(const BuildingTags& tags, bool is_part, const Surroundings& around) {
  for (const auto& key :
       {BuildingTags::WordKey("building:part"), BuildingTags::WordKey("building")}) {
    const std::string_view value = tags.value(key);
    for (const KindName& name : kKinds)
      if (name.value == value) {
        // What is called residential is a house where it is small.
        if (name.kind == BuildingKind::Apartments && around.area_m2 < 90.0 &&
            value == "residential")
          return BuildingKind::House;
        return name.kind;
      }
  }
  if (tags.value("amenity") == "place_of_worship") return BuildingKind::Church;
  if (tags.has("shop")) return BuildingKind::Commercial;
  if (tags.value("man_made") == "storage_tank" || tags.value("man_made") == "silo")
    return BuildingKind::Tower;
  return is_part ? BuildingKind::Apartments : guessed_kind(around);
}

double storey_height_m(BuildingKind kind, std::uint64_t own) {
  const double more = random_unit(own, 0, kStorey);
  switch (kind) {
    case BuildingKind::Offices:
      return 3.4 + 0.3 * more;
    case BuildingKind::Commercial:
      return 3.3 + 0.5 * more;
    case BuildingKind::Hall:
      return 5.0 + 1.5 * more;
    case BuildingKind::Church:
      return 7.0 + 2.0 * more;
    case BuildingKind::House:
      return 2.7 + 0.2 * more;
    case BuildingKind::Garage:
      return 2.4 + 0.2 * more;
    case BuildingKind::Barn:
      return 3.6 + 1.0 * more;
    default:
      return 2.9 + 0.2 * more;
  }
}

double guessed_storeys(BuildingKind kind, const Surroundings& around, std::uint64_t own) {
  const double draw = random_unit(own, 0, kStoreys);
  // 0 in the country, 1 in the middle of a city.
  const double density = std::clamp((around.share_built - 0.1) / 0.35, 0.0, 1.0);
  switch (kind) {
    case BuildingKind::House:
      return draw < 0.3 - 0.25 * density ? 1.0 : draw < 0.88 ? 2.0 : 3.0;
    case BuildingKind::Apartments:
      return std::round(3.0 + 3.5 * density * (0.4 + 0.6 * draw) + draw +
                        (around.area_m2 > 700.0 ? 1.0 : 0.0));
    case BuildingKind::Commercial:
      return std::round(1.0 + 3.0 * density + 1.2 * draw);
    case BuildingKind::Offices:
      return std::round(3.0 + 4.0 * density + 3.0 * draw * draw);
    case BuildingKind::Tower:
      return std::round(4.0 + 2.0 * draw);
    default:
      return 1.0;
  }
}

struct LevelTags {
  std::optional<double> levels;
  double roof_levels = 0.0;
  bool was_clamped = false;
};

LevelTags levels_of(const BuildingTags& tags) {
  LevelTags found;
  if (const auto value = tags.most("building:levels"); value && *value > 0.0) {
    found.was_clamped = *value > kMostLevels;
    found.levels = std::min(*value, kMostLevels);
  }
  if (const auto value = tags.most("roof:levels")) found.roof_levels = std::min(*value, 8.0);
  return found;
}

RoofShape guessed_roof(BuildingKind kind, const Surroundings& around, std::uint64_t town,
                       std::uint64_t own) {
  const double draw = random_unit(own, 0, kRoof);
  const bool is_plain = around.num_corners <= 14;
  switch (kind) {
    case BuildingKind::House:
      if (!is_plain) return RoofShape::Hipped;
      return draw < (random_unit(town, 0, kRoof) < 0.5 ? 0.75 : 0.5) ? RoofShape::Gabled
                                                                     : RoofShape::Hipped;
    case BuildingKind::Apartments:
      if (around.width_m > 22.0 || around.area_m2 > 1500.0) return RoofShape::Flat;
      // Old middles of towns have roofs, new blocks none.
      if (around.is_attached)
        return draw < 0.55 ? RoofShape::Gabled : draw < 0.75 ? RoofShape::Hipped : RoofShape::Flat;
      return draw < 0.35 ? RoofShape::Hipped : draw < 0.5 ? RoofShape::Gabled : RoofShape::Flat;
    case BuildingKind::Commercial:
      return around.area_m2 < 500.0 && draw < 0.4 ? RoofShape::Hipped : RoofShape::Flat;
    case BuildingKind::Hall:
      return around.width_m < 45.0 && around.num_corners <= 6 && draw < 0.6 ? RoofShape::Gabled
                                                                            : RoofShape::Flat;
    case BuildingKind::Church:
      return is_plain ? RoofShape::Gabled : RoofShape::Hipped;
    case BuildingKind::Barn:
    case BuildingKind::Greenhouse:
      return RoofShape::Gabled;
    case BuildingKind::Garage:
      return draw < 0.45 ? RoofShape::Flat : draw < 0.7 ? RoofShape::Skillion : RoofShape::Gabled;
    case BuildingKind::Tower:
      return draw < 0.5 ? RoofShape::Pyramidal : RoofShape::Flat;
    default:
      return RoofShape::Flat;
  }
}

double roof_slope(RoofShape shape, BuildingKind kind, const Surroundings& around,
                  std::uint64_t town, std::uint64_t own) {
  const double draw = random_unit(own, 0, kSlope);
  if (shape == RoofShape::Skillion) return 0.12 + 0.1 * draw;
  if (shape == RoofShape::Spire) return 5.0;
  if (shape == RoofShape::Dome) return 1.0;
  if (shape == RoofShape::Mansard || shape == RoofShape::Gambrel) return 0.95;
  if (shape == RoofShape::Round) return 0.5;
  if (kind == BuildingKind::Church) return 1.0 + 0.3 * draw;
  if (kind == BuildingKind::Hall) return 0.14 + 0.06 * draw;
  if (kind == BuildingKind::Greenhouse) return 0.45;
  // Snow slides from what is steep, and clay tiles from what is more than 20 degrees in the south.
  const double latitude = std::abs(around.latitude_deg);
  const double usual = latitude < 46.0 ? 0.36 : latitude < 52.0 ? 0.75 : 0.6;
  const double alpine = std::clamp((around.height_m - 700.0) / 700.0, 0.0, 1.0);
  return usual + alpine * (0.5 - usual) * 0.7 + 0.12 * (random_unit(town, 0, kSlope) - 0.5) +
         0.1 * (draw - 0.5);
}

}  // namespace

bool is_building_word(std::string_view word) {
  if (flag_from_tag(word)) return true;
  return std::any_of(std::begin(kKinds), std::end(kKinds),
                     [&](const KindName& name) { return name.value == word; });
}

bool is_roof_shape_word(std::string_view word) {
  return std::any_of(std::begin(kRoofs), std::end(kRoofs),
                     [&](const RoofName& name) { return name.value == word; });
}

BuildingDesign design_building(const FeatureTags& all_tags, bool is_part,
                               const Surroundings& around, std::optional<double> raster_m,
                               std::uint64_t town, std::uint64_t own) {
  const BuildingTags tags(all_tags);
  BuildingDesign design;
  design.kind = kind_of(tags, is_part, around);
  design.storey_m = storey_height_m(design.kind, own);
  const LevelTags levels = levels_of(tags);

  const bool has_roof_tag = tags.has("roof:shape");
  design.roof = guessed_roof(design.kind, around, town, own);
  if (is_part && !has_roof_tag) design.roof = RoofShape::Flat;
  for (const RoofName& name : kRoofs)
    if (name.value == tags.value("roof:shape")) {
      design.roof = name.shape;
      design.states_roof = true;
    }
  // High blocks have flat roofs, whatever others of their kind have.
  const auto said_height = tags.most("height");
  const double about_m = said_height     ? *said_height
                         : levels.levels ? *levels.levels * design.storey_m
                                         : raster_m.value_or(0.0);
  if (!has_roof_tag && about_m > 25.0 && design.kind != BuildingKind::Church &&
      design.kind != BuildingKind::Tower)
    design.roof = RoofShape::Flat;
  design.roof_slope = roof_slope(design.roof, design.kind, around, town, own);
  if (const auto said = tags.most("roof:height"); said && *said > 0.0)
    design.roof_height_m = std::min(*said, 150.0);
  else if (const auto angle = tags.slope_deg("roof:angle"); angle && *angle > 1.0 && *angle < 85.0)
    design.roof_slope = std::tan(geo::radians_from_degrees(*angle));
  else if (levels.roof_levels > 0.0)
    design.roof_height_m = levels.roof_levels * 2.7;
  design.roof_direction_deg = tags.direction_deg("roof:direction");
  design.ridge_across = tags.value("roof:orientation") == "across";
  const bool is_flat = design.roof == RoofShape::Flat;
  // What a roof adds to walls of so many storeys.
  const double roof_m = is_flat ? 0.4
                        : design.roof_height_m > 0.0
                            ? design.roof_height_m
                            : std::min(design.roof_slope * 0.5 * around.width_m, 8.0);

  double top_m = 0.0;
  if (said_height) {
    top_m = *said_height;
    design.height_source = HeightSource::Height;
    if (levels.levels && *levels.levels >= 1.0)
      design.storey_m =
          std::clamp((top_m - (is_flat ? 0.4 : 0.6 * roof_m)) / *levels.levels, 2.3, 6.0);
  } else if (levels.levels) {
    top_m = *levels.levels * design.storey_m + roof_m;
    design.height_source = HeightSource::Levels;
  } else if (raster_m) {
    // A robust height of the surface lies between eaves and ridge.
    top_m = *raster_m + (is_flat ? 0.0 : 0.4 * std::min(roof_m, 0.8 * *raster_m));
    design.height_source = HeightSource::Raster;
  } else {
    top_m = guessed_storeys(design.kind, around, own) * design.storey_m + roof_m;
    if (design.kind == BuildingKind::Canopy) top_m = 3.4;
    if (design.kind == BuildingKind::Church)
      top_m = std::clamp(0.55 * around.width_m, 4.5, 16.0) + roof_m;
    design.height_source = HeightSource::Guess;
  }
  design.top_m = std::clamp(top_m, kLowest_m, kTallest_m);
  design.was_clamped = levels.was_clamped || design.top_m != top_m;

  double bottom_m = 0.0;
  if (const auto said = tags.middle("min_height"))
    bottom_m = *said;
  else if (const auto level = tags.middle("building:min_level"); level && *level > 0.0)
    bottom_m = *level * design.storey_m;
  if (!(bottom_m >= 0.0) || bottom_m > design.top_m - 0.5) {
    design.was_clamped = true;
    bottom_m = std::clamp(bottom_m, 0.0, std::max(design.top_m - 1.0, 0.0));
  }
  design.bottom_m = bottom_m;
  if (design.top_m - bottom_m < 1.5 && !has_roof_tag) design.roof = RoofShape::Flat;
  choose_finishes(all_tags, around, town, own, design);
  return design;
}

}  // namespace terracast::tiler
