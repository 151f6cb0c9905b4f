#include "tiler/buildings/building_finishes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "core/random.h"
#include "tiler/buildings/building_draws.h"
#include "tiler/buildings/building_tags.h"
#include "world/facade.h"

namespace terracast::tiler {
namespace {

using Color = std::array<std::uint8_t, 3>;
using core::random_bits;
using core::random_unit;
using core::SemanticClass;
using world::FacadeStyle;
using world::Material;

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

/// A colour as OpenStreetMap writes it: #rgb, #rrggbb or a CSS name.
std::optional<Color> color_from_text(const std::string& text) {
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

}  // namespace

bool is_wall_material_word(std::string_view word) { return wall_material(word).has_value(); }
bool is_roof_material_word(std::string_view word) { return roof_material(word).has_value(); }
bool is_color_word(std::string_view word) { return color_from_text(std::string(word)).has_value(); }

void choose_finishes(const FeatureTags& all_tags, const Surroundings& around, std::uint64_t town,
                     std::uint64_t own, BuildingDesign& design) {
  const BuildingTags tags(all_tags);
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
  using Key = BuildingTags::WordKey;
  for (const Key& key :
       {Key("building:colour"), Key("building:color"), Key("building:facade:colour")})
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
  for (const Key& key : {Key("roof:colour"), Key("roof:color")})
    if (const auto said = color_from_text(std::string(tags.value(key)))) {
      design.roofing.color_srgb = *said;
      break;
    }
  design.trim.material = is_flat ? Material::Concrete : Material::Plaster;
  design.trim.semantic_class = SemanticClass::Building;
  design.trim.color_srgb = varied(is_flat ? Color{176, 174, 168} : Color{196, 186, 170}, own);
}

}  // namespace terracast::tiler
