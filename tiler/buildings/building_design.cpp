#include "tiler/buildings/building_design.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string_view>

#include "core/random.h"

namespace terracast::tiler {
namespace {

using Color = std::array<std::uint8_t, 3>;
using core::random_bits;
using core::random_unit;
using core::SemanticClass;
using world::FacadeStyle;
using world::Material;

/// The tallest building stands 828 m high (Burj Khalifa); masts are no buildings.
constexpr double kTallest_m = 900.0;
constexpr double kLowest_m = 1.8;
constexpr double kMostLevels = 200.0;

enum Draw : std::uint64_t {
  kStoreys,
  kStorey,
  kRoof,
  kSlope,
  kWallColor,
  kWallMaterial,
  kRoofColor,
  kShade,
  kStyle,
  kTint,
};

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

struct ColorName {
  std::string_view name;
  Color color;
};
// CSS names (https://www.w3.org/TR/css-color-4/#named-colors) that buildings have.
constexpr ColorName kColors[] = {
    {"white", {255, 255, 255}},     {"black", {0, 0, 0}},           {"gray", {128, 128, 128}},
    {"grey", {128, 128, 128}},      {"lightgray", {211, 211, 211}}, {"lightgrey", {211, 211, 211}},
    {"darkgray", {169, 169, 169}},  {"darkgrey", {169, 169, 169}},  {"silver", {192, 192, 192}},
    {"dimgray", {105, 105, 105}},   {"slategray", {112, 128, 144}}, {"red", {255, 0, 0}},
    {"darkred", {139, 0, 0}},       {"maroon", {128, 0, 0}},        {"firebrick", {178, 34, 34}},
    {"brown", {165, 42, 42}},       {"sienna", {160, 82, 45}},      {"tan", {210, 180, 140}},
    {"beige", {245, 245, 220}},     {"ivory", {255, 255, 240}},     {"cream", {255, 253, 208}},
    {"yellow", {255, 255, 0}},      {"gold", {255, 215, 0}},        {"orange", {255, 165, 0}},
    {"pink", {255, 192, 203}},      {"salmon", {250, 128, 114}},    {"coral", {255, 127, 80}},
    {"green", {0, 128, 0}},         {"darkgreen", {0, 100, 0}},     {"lightgreen", {144, 238, 144}},
    {"olive", {128, 128, 0}},       {"blue", {0, 0, 255}},          {"navy", {0, 0, 128}},
    {"lightblue", {173, 216, 230}}, {"skyblue", {135, 206, 235}},   {"steelblue", {70, 130, 180}},
    {"purple", {128, 0, 128}},      {"wheat", {245, 222, 179}},     {"khaki", {240, 230, 140}},
    {"peru", {205, 133, 63}},       {"chocolate", {210, 105, 30}},  {"linen", {250, 240, 230}},
    {"sandybrown", {244, 164, 96}}, {"indianred", {205, 92, 92}},   {"rosybrown", {188, 143, 143}},
};

// Harmonious sets, from the lime, clay and stone of their countries. Warm ones south of 46 degrees.
constexpr Color kWarmPlasters[] = {{226, 205, 168}, {233, 220, 190}, {222, 184, 142},
                                   {214, 168, 130}, {238, 229, 210}, {228, 196, 150},
                                   {219, 177, 152}, {240, 232, 218}};
constexpr Color kCoolPlasters[] = {{233, 230, 221}, {222, 218, 205}, {238, 236, 231},
                                   {214, 207, 188}, {226, 214, 184}, {205, 203, 196},
                                   {218, 222, 214}, {230, 221, 203}};
constexpr Color kBricks[] = {{142, 78, 60}, {156, 92, 70}, {128, 70, 56}, {168, 110, 84}};
constexpr Color kStones[] = {{158, 150, 136}, {140, 134, 124}, {172, 160, 140}, {150, 138, 118}};
constexpr Color kConcretes[] = {{186, 183, 176}, {202, 199, 192}, {168, 166, 160}, {214, 208, 198}};
constexpr Color kWoods[] = {{112, 80, 54}, {134, 98, 66}, {92, 66, 48}, {150, 116, 82}};
constexpr Color kSheets[] = {{176, 180, 182}, {150, 158, 164}, {196, 194, 184}, {126, 142, 152},
                             {160, 168, 158}, {206, 208, 206}, {168, 152, 128}, {104, 124, 146},
                             {148, 104, 88},  {186, 178, 160}};
// From clay that burns red to clay that burns yellow, new and of many years.
constexpr Color kClays[] = {{166, 92, 62}, {176, 106, 72}, {150, 88, 62},  {188, 122, 84},
                            {160, 98, 72}, {182, 112, 74}, {140, 86, 66},  {198, 142, 102},
                            {164, 94, 66}, {150, 98, 76},  {174, 114, 82}, {132, 80, 62}};
constexpr Color kDarkTiles[] = {{108, 66, 54}, {92, 72, 66}, {120, 74, 58}, {84, 78, 76}};
constexpr Color kSlates[] = {{86, 90, 96}, {74, 78, 84}, {98, 100, 102}, {80, 84, 94}};
constexpr Color kFelts[] = {
    {134, 130, 124}, {150, 146, 138}, {118, 116, 112}, {166, 160, 150}, {182, 178, 170}};
constexpr Color kMetals[] = {{142, 150, 154}, {112, 122, 128}, {164, 168, 168}, {104, 116, 110},
                             {150, 146, 136}, {122, 92, 80},   {96, 112, 128},  {176, 176, 172},
                             {128, 134, 120}, {134, 130, 126}};

Color pick(std::span<const Color> colors, std::uint64_t bits) {
  return colors[static_cast<std::size_t>(bits % colors.size())];
}

/// A little lighter or darker, warmer or cooler, as no two houses are alike.
Color varied(Color color, std::uint64_t own) {
  const double light = core::random_between(0.93, 1.07, own, 0, kShade);
  const double warmth = core::random_between(-0.025, 0.025, own, 0, kTint);
  const std::array<double, 3> gain = {light * (1.0 + warmth), light, light * (1.0 - warmth)};
  for (std::size_t k = 0; k < 3; ++k)
    color[k] = static_cast<std::uint8_t>(
        std::clamp(std::lround(gain[k] * static_cast<double>(color[k])), 0L, 255L));
  return color;
}

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
BuildingKind kind_of(const FeatureTags& tags, bool is_part, const Surroundings& around) {
  for (const std::string_view key : {"building:part", "building"}) {
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

LevelTags levels_of(const FeatureTags& tags) {
  LevelTags found;
  if (const auto value = tags.number("building:levels"); value && *value > 0.0) {
    found.was_clamped = *value > kMostLevels;
    found.levels = std::min(*value, kMostLevels);
  }
  if (const auto value = tags.number("roof:levels"); value && *value >= 0.0)
    found.roof_levels = std::min(*value, 8.0);
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

std::optional<Material> wall_material(std::string_view name) {
  if (name == "brick" || name == "bricks") return Material::Brick;
  if (name == "plaster" || name == "stucco" || name == "render" || name == "clay" ||
      name == "cement_block" || name == "mud")
    return Material::Plaster;
  if (name == "stone" || name == "sandstone" || name == "limestone" || name == "granite" ||
      name == "marble" || name == "masonry")
    return Material::StoneWall;
  if (name == "concrete" || name == "reinforced_concrete" || name == "cement")
    return Material::ConcreteWall;
  if (name == "wood" || name == "timber_framing" || name == "bamboo") return Material::WoodWall;
  if (name == "glass" || name == "mirror") return Material::GlassFacade;
  if (name == "metal" || name == "steel" || name == "tin" || name == "metal_plates" ||
      name == "aluminium")
    return Material::SheetMetal;
  return std::nullopt;
}

std::optional<Material> roof_material(std::string_view name) {
  if (name == "roof_tiles" || name == "tile" || name == "tiles" || name == "clay")
    return Material::RoofTiles;
  if (name == "slate" || name == "stone" || name == "asphalt_shingle" || name == "shingle")
    return Material::Slate;
  if (name == "concrete" || name == "tar_paper" || name == "gravel" || name == "asphalt" ||
      name == "bitumen" || name == "eternit" || name == "grass")
    return Material::FlatRoof;
  if (name == "metal" || name == "copper" || name == "tin" || name == "zinc" || name == "steel" ||
      name == "metal_sheet" || name == "aluminium")
    return Material::MetalRoof;
  if (name == "thatch" || name == "reed") return Material::Thatch;
  if (name == "glass" || name == "solar_panels" || name == "acrylic_glass") return Material::Glass;
  if (name == "wood") return Material::Planks;
  return std::nullopt;
}

std::span<const Color> colors_of(Material material, bool is_warm) {
  switch (material) {
    case Material::Brick:
      return kBricks;
    case Material::StoneWall:
      return kStones;
    case Material::ConcreteWall:
      return kConcretes;
    case Material::WoodWall:
    case Material::Planks:
    case Material::Thatch:
      return kWoods;
    case Material::SheetMetal:
      return kSheets;
    case Material::RoofTiles:
      return kClays;
    case Material::Slate:
      return kSlates;
    case Material::FlatRoof:
      return kFelts;
    case Material::MetalRoof:
      return kMetals;
    case Material::GlassFacade:
    case Material::Glass:
      return kSlates;
    default:
      return is_warm ? std::span<const Color>(kWarmPlasters) : kCoolPlasters;
  }
}

FacadeStyle style_of(const BuildingDesign& design, const Surroundings& around, std::uint64_t own) {
  const double draw = random_unit(own, 0, kStyle);
  switch (design.kind) {
    case BuildingKind::House:
      return std::abs(around.latitude_deg) < 47.0 ? FacadeStyle::Shutters : FacadeStyle::House;
    case BuildingKind::Apartments:
      if (around.is_attached && around.share_built > 0.3 && draw < 0.5) return FacadeStyle::Shops;
      return std::abs(around.latitude_deg) < 47.0 && around.is_attached && draw < 0.8
                 ? FacadeStyle::Shutters
                 : FacadeStyle::Apartments;
    case BuildingKind::Commercial:
      return FacadeStyle::Shops;
    case BuildingKind::Offices:
      return design.top_m > 45.0 || draw < 0.3 ? FacadeStyle::CurtainWall : FacadeStyle::Offices;
    case BuildingKind::Church:
      return FacadeStyle::Church;
    case BuildingKind::Garage:
      return FacadeStyle::Garage;
    default:
      return FacadeStyle::Hall;
  }
}

void choose_finishes(const FeatureTags& tags, const Surroundings& around, std::uint64_t town,
                     std::uint64_t own, BuildingDesign& design) {
  const double latitude = std::abs(around.latitude_deg);
  const bool is_warm = latitude < 46.0;
  const bool is_alpine = around.height_m > 800.0 && latitude < 55.0;
  const double draw = random_unit(own, 0, kWallMaterial);
  Material wall = Material::Plaster;
  switch (design.kind) {
    case BuildingKind::House:
      if (is_alpine)
        wall = draw < 0.45   ? Material::StoneWall
               : draw < 0.65 ? Material::WoodWall
                             : Material::Plaster;
      else if (latitude > 49.0 && random_unit(town, 0, kWallMaterial) < 0.6)
        wall = draw < 0.65 ? Material::Brick : Material::Plaster;
      break;
    case BuildingKind::Apartments:
      if (design.top_m > 24.0 && draw < 0.5) wall = Material::ConcreteWall;
      if (is_alpine && draw < 0.35) wall = Material::StoneWall;
      break;
    case BuildingKind::Commercial:
      wall = draw < 0.4 ? Material::ConcreteWall : wall;
      break;
    case BuildingKind::Offices:
      wall = draw < 0.4 ? Material::GlassFacade : Material::ConcreteWall;
      break;
    case BuildingKind::Hall:
      wall = draw < 0.7 ? Material::SheetMetal : Material::ConcreteWall;
      break;
    case BuildingKind::Church:
      wall = draw < 0.6 ? Material::StoneWall : wall;
      break;
    case BuildingKind::Barn:
      wall = draw < 0.6 ? Material::WoodWall : Material::StoneWall;
      break;
    case BuildingKind::Greenhouse:
      wall = Material::Glass;
      break;
    case BuildingKind::Canopy:
      wall = Material::Metal;
      break;
    case BuildingKind::Tower:
      wall = draw < 0.5 ? Material::StoneWall : Material::ConcreteWall;
      break;
    default:
      break;
  }
  if (const auto said = wall_material(tags.value("building:material"))) wall = *said;
  design.wall.material = wall;
  design.wall.semantic_class = SemanticClass::Building;
  design.wall.color_srgb =
      varied(pick(colors_of(wall, is_warm), random_bits(own, 0, kWallColor)), own);
  for (const char* key : {"building:colour", "building:color", "building:facade:colour"})
    if (const auto said = color_from_text(std::string(tags.value(key)))) {
      design.wall.color_srgb = *said;
      break;
    }
  FacadeStyle style = style_of(design, around, own);
  if (wall == Material::GlassFacade) style = FacadeStyle::CurtainWall;
  const bool has_windows = design.kind != BuildingKind::Canopy &&
                           design.kind != BuildingKind::Greenhouse &&
                           !(design.kind == BuildingKind::Tower);
  if (has_windows)
    design.wall.pattern = world::facade_pattern(
        style,
        static_cast<std::uint8_t>(std::clamp(std::lround(10.0 * design.storey_m), 1L, 255L)));

  const bool is_flat = design.roof == RoofShape::Flat;
  Material roof = Material::FlatRoof;
  std::span<const Color> colors = kFelts;
  if (!is_flat) {
    // A town's roofs are of what its country has; a few are not.
    const double kind = std::clamp(
        random_unit(town, 0, kRoofColor) * 0.8 + random_unit(own, 0, kRoofColor) * 0.2, 0.0, 1.0);
    const double slate = is_alpine ? 0.75 : is_warm ? 0.04 : latitude < 49.0 ? 0.25 : 0.4;
    roof = kind < slate ? Material::Slate : Material::RoofTiles;
    colors = roof == Material::Slate ? std::span<const Color>(kSlates)
             : is_warm || latitude < 49.0 || random_unit(own, 1, kRoofColor) < 0.5
                 ? std::span<const Color>(kClays)
                 : kDarkTiles;
    if (design.kind == BuildingKind::Hall || (design.kind == BuildingKind::Garage && draw < 0.5)) {
      roof = Material::MetalRoof;
      colors = kMetals;
    }
    if (design.roof == RoofShape::Dome) {
      roof = Material::MetalRoof;
      colors = kMetals;
    }
    if (design.kind == BuildingKind::Greenhouse) roof = Material::Glass;
  } else if (design.kind == BuildingKind::Canopy) {
    roof = Material::MetalRoof;
    colors = kMetals;
  }
  if (const auto said = roof_material(tags.value("roof:material"))) {
    roof = *said;
    colors = colors_of(roof, is_warm);
  }
  design.roofing.material = roof;
  design.roofing.semantic_class = SemanticClass::Building;
  design.roofing.color_srgb =
      varied(pick(colors, random_bits(own, 1, kRoofColor)), random_bits(own, 2, kRoofColor));
  for (const char* key : {"roof:colour", "roof:color"})
    if (const auto said = color_from_text(std::string(tags.value(key)))) {
      design.roofing.color_srgb = *said;
      break;
    }
  design.trim.material = is_flat ? Material::Concrete : Material::Plaster;
  design.trim.semantic_class = SemanticClass::Building;
  design.trim.color_srgb = varied(is_flat ? Color{176, 174, 168} : Color{196, 186, 170}, own);
}

}  // namespace

std::optional<std::array<std::uint8_t, 3>> color_from_text(const std::string& text) {
  std::string name;
  for (const char c : text)
    if (c != ' ' && c != '_' && c != '-')
      name += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  for (const ColorName& known : kColors)
    if (known.name == name) return known.color;
  if (name.empty() || name[0] != '#' || (name.size() != 4 && name.size() != 7)) return std::nullopt;
  Color color = {};
  const std::size_t digits = name.size() == 4 ? 1 : 2;
  for (std::size_t k = 0; k < 3; ++k) {
    int value = 0;
    for (std::size_t d = 0; d < digits; ++d) {
      const char c = name[1 + k * digits + d];
      const int digit = c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
      if (digit < 0) return std::nullopt;
      value = 16 * value + digit;
    }
    color[k] = static_cast<std::uint8_t>(digits == 1 ? 17 * value : value);
  }
  return color;
}

BuildingDesign design_building(const FeatureTags& tags, bool is_part, const Surroundings& around,
                               std::optional<double> raster_m, std::uint64_t town,
                               std::uint64_t own) {
  BuildingDesign design;
  design.kind = kind_of(tags, is_part, around);
  design.storey_m = storey_height_m(design.kind, own);
  const LevelTags levels = levels_of(tags);

  const bool has_roof_tag = tags.has("roof:shape");
  design.roof = guessed_roof(design.kind, around, town, own);
  if (is_part && !has_roof_tag) design.roof = RoofShape::Flat;
  for (const RoofName& name : kRoofs)
    if (name.value == tags.value("roof:shape")) design.roof = name.shape;
  // High blocks have flat roofs, whatever others of their kind have.
  const auto said_height = tags.number("height");
  const double about_m = said_height && *said_height > 0.0 ? *said_height
                         : levels.levels                   ? *levels.levels * design.storey_m
                                                           : raster_m.value_or(0.0);
  if (!has_roof_tag && about_m > 25.0 && design.kind != BuildingKind::Church &&
      design.kind != BuildingKind::Tower)
    design.roof = RoofShape::Flat;
  design.roof_slope = roof_slope(design.roof, design.kind, around, town, own);
  if (const auto said = tags.number("roof:height"); said && *said > 0.0)
    design.roof_height_m = std::min(*said, 150.0);
  else if (const auto angle = tags.number("roof:angle"); angle && *angle > 1.0 && *angle < 85.0)
    design.roof_slope = std::tan(*angle * 0.017453292519943295);
  else if (levels.roof_levels > 0.0)
    design.roof_height_m = levels.roof_levels * 2.7;
  if (const auto said = tags.number("roof:direction"); said && std::abs(*said) <= 720.0)
    design.roof_direction_deg = *said;
  design.ridge_across = tags.value("roof:orientation") == "across";
  const bool is_flat = design.roof == RoofShape::Flat;
  // What a roof adds to walls of so many storeys.
  const double roof_m = is_flat ? 0.4
                        : design.roof_height_m > 0.0
                            ? design.roof_height_m
                            : std::min(design.roof_slope * 0.5 * around.width_m, 8.0);

  double top_m = 0.0;
  if (said_height && *said_height > 0.0) {
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
  if (const auto said = tags.number("min_height"))
    bottom_m = *said;
  else if (const auto level = tags.number("building:min_level"); level && *level > 0.0)
    bottom_m = *level * design.storey_m;
  if (!(bottom_m >= 0.0) || bottom_m > design.top_m - 0.5) {
    design.was_clamped = true;
    bottom_m = std::clamp(bottom_m, 0.0, std::max(design.top_m - 1.0, 0.0));
  }
  design.bottom_m = bottom_m;
  if (design.top_m - bottom_m < 1.5 && !has_roof_tag) design.roof = RoofShape::Flat;
  choose_finishes(tags, around, town, own, design);
  return design;
}

}  // namespace terracast::tiler
