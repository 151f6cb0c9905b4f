#include "tiler/country/building_styles.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "core/random.h"

namespace terracast::tiler::country {
namespace {

using core::random_unit;

struct Palette {
  std::array<std::string_view, 6> walls;
  std::array<std::string_view, 4> roofs;
};

/// Of each manner four, so that towns differ.
constexpr Palette kPalettes[3][4] = {
    {{{"#efe3cc", "#e8d6b8", "#f3ece0", "#dfc19e", "#ead3ba", "#d8c8ae"},
      {"#b2643f", "#a65a3a", "#bd7650", "#9d5238"}},
     {{"#f4f1ea", "#eee9df", "#f7f4ee", "#e3ddd0", "#efe6d6", "#d9d3c7"},
      {"#b46a45", "#a8603f", "#c28059", "#97553a"}},
     {{"#e7c294", "#d99f6c", "#efd9b4", "#c98a63", "#e8ceb0", "#d7ad86"},
      {"#a5553a", "#b0613f", "#8f4b35", "#ba7450"}},
     {{"#e8ddc8", "#d2c2a4", "#c4b08d", "#ddd0b6", "#b9a486", "#e9e2d2"},
      {"#a7694a", "#99593f", "#b57b59", "#8d5a45"}}},
    {{{"#f3efe7", "#e9e2d2", "#efe7d5", "#d9c8a8", "#b08a60", "#f0ece2"},
      {"#5d4a40", "#6a4c3c", "#4d4a49", "#74533f"}},
     {{"#ece3d0", "#9a6f47", "#8a6140", "#e5dac3", "#a97e55", "#f1ebdd"},
      {"#4f4741", "#5a5048", "#6d6259", "#463f3b"}},
     {{"#f0ede6", "#cfd3cf", "#dfdccf", "#e8e0cf", "#c2b59b", "#ebe6da"},
      {"#56585c", "#63666a", "#4a4c50", "#707276"}},
     {{"#efe0c4", "#e3caa0", "#d8b98c", "#f2e8d6", "#a47b52", "#e9d9bb"},
      {"#7a4a36", "#86553e", "#6a4334", "#5a4239"}}},
    {{{"#9d5c46", "#8b503f", "#a86a52", "#c3b49c", "#e6e1d6", "#7f4a3b"},
      {"#4b4c51", "#58595e", "#733f33", "#66483e"}},
     {{"#e8e4da", "#d8d2c4", "#f0ede6", "#c9c0ae", "#b7a58a", "#dcd9d2"},
      {"#8a4636", "#7c4034", "#975342", "#5b4a44"}},
     {{"#9a5a4c", "#ad6e5c", "#d6bf84", "#5f6f78", "#e4e0d8", "#c7c9c4"},
      {"#3f4145", "#4e5054", "#5b3a32", "#68696d"}},
     {{"#b9835f", "#c99d78", "#a87356", "#d9c7ae", "#94604a", "#e3d9c8"},
      {"#9c4f3b", "#8b4636", "#a85f48", "#4d4e52"}}}};

constexpr std::string_view kGrey[] = {"#c9cbcc", "#b4b7b9", "#d9dad8",
                                      "#9ea3a6", "#c7c2b8", "#8e979c"};
constexpr std::string_view kMetal[] = {"#8d979d", "#a9afb2", "#6f7d86",
                                       "#b8bcbd", "#7a6d66", "#5f6f66"};
constexpr std::string_view kFlatRoof[] = {"#8b8a86", "#a3a19c", "#77767a", "#b0aca4"};

template <std::size_t N>
std::string drawn(const std::string_view (&list)[N], std::uint64_t draw, std::uint64_t stream) {
  return std::string(list[core::random_bits(draw, stream, 0) % N]);
}
template <std::size_t N>
std::string drawn(const std::array<std::string_view, N>& list, std::uint64_t draw,
                  std::uint64_t stream) {
  // The first of a palette are the commonest.
  const double u = random_unit(draw, stream, 0);
  return std::string(list[static_cast<std::size_t>(u * u * N * 0.999 + 0.35 * u * (1.0 - u) * N)]);
}

int between(int lowest, int highest, std::uint64_t draw, std::uint64_t stream) {
  return lowest + static_cast<int>(core::random_bits(draw, stream, 1) %
                                   static_cast<std::uint64_t>(highest - lowest + 1));
}

}  // namespace

Tags building_tags(HouseKind kind, BuildingManner manner, int palette, double width_m,
                   std::uint64_t draw) {
  const Palette& own = kPalettes[static_cast<int>(manner)][palette & 3];
  const bool is_alpine = manner == BuildingManner::Alpine;
  std::string building = "yes", wall_material = "plaster", roof_shape = "gabled",
              roof_material = "roof_tiles";
  std::string wall = drawn(own.walls, draw, 1), roof = drawn(own.roofs, draw, 2);
  int levels = 2;
  double height_m = 0.0;  // 0: by levels
  const bool has_slope = width_m < 17.0;
  if (manner == BuildingManner::Northern && (palette == 0 || palette == 3)) wall_material = "brick";
  if (is_alpine && random_unit(draw, 3, 0) < 0.3) wall_material = "wood";
  if (manner != BuildingManner::Southern && random_unit(draw, 3, 1) < 0.35) roof_material = "slate";
  Tags tags;
  switch (kind) {
    case HouseKind::Detached:
      building = random_unit(draw, 4, 0) < 0.6 ? "house" : "detached";
      levels = between(1, 2, draw, 5);
      roof_shape = random_unit(draw, 6, 0) < (manner == BuildingManner::Southern ? 0.5 : 0.2)
                       ? "hipped"
                       : "gabled";
      break;
    case HouseKind::SemiDetached:
      building = "semidetached_house";
      break;
    case HouseKind::Terrace:
      building = "terrace";
      levels = between(2, 3, draw, 5);
      break;
    case HouseKind::OldTown:
      building = random_unit(draw, 4, 0) < 0.5 ? "residential" : "apartments";
      levels = between(3, 4, draw, 5);
      break;
    case HouseKind::Apartments:
      building = "apartments";
      levels = between(4, 6, draw, 5);
      roof_shape = has_slope && random_unit(draw, 6, 0) < 0.6 ? "gabled" : "flat";
      break;
    case HouseKind::Slab:
      building = "apartments";
      levels = between(4, 9, draw, 5);
      roof_shape = "flat";
      wall_material = "concrete";
      if (random_unit(draw, 7, 0) < 0.6) wall = drawn(kGrey, draw, 8);
      break;
    case HouseKind::Office:
      building = "office";
      levels = between(4, 9, draw, 5);
      roof_shape = "flat";
      wall_material = random_unit(draw, 7, 0) < 0.5 ? "glass" : "concrete";
      wall = drawn(kGrey, draw, 8);
      break;
    case HouseKind::Tower:
      building = "office";
      levels = between(12, 34, draw, 5);
      roof_shape = "flat";
      wall_material = "glass";
      wall = drawn(kMetal, draw, 8);
      break;
    case HouseKind::Retail:
      building = "retail";
      levels = 1;
      height_m = 6.5;
      roof_shape = "flat";
      wall_material = "metal";
      wall = drawn(kGrey, draw, 8);
      break;
    case HouseKind::Industrial:
      building = "industrial";
      levels = 1;
      height_m = between(7, 12, draw, 5);
      roof_shape = random_unit(draw, 6, 0) < 0.35 ? "gabled" : "flat";
      wall_material = "metal";
      roof_material = "metal";
      wall = drawn(kMetal, draw, 8);
      roof = drawn(kGrey, draw, 9);
      break;
    case HouseKind::Warehouse:
      building = "warehouse";
      levels = 1;
      height_m = between(9, 14, draw, 5);
      roof_shape = "flat";
      wall_material = "metal";
      roof_material = "metal";
      wall = drawn(kMetal, draw, 8);
      roof = drawn(kGrey, draw, 9);
      break;
    case HouseKind::Church:
      building = "church";
      levels = 1;
      height_m = 14.0;
      wall_material = "stone";
      if (random_unit(draw, 7, 0) < 0.5) wall = "#cfc6b4";
      break;
    case HouseKind::School:
      building = "school";
      levels = between(2, 3, draw, 5);
      roof_shape = random_unit(draw, 6, 0) < 0.6 ? "flat" : "hipped";
      break;
    case HouseKind::Civic:
      building = "civic";
      levels = 3;
      roof_shape = "hipped";
      wall_material = "stone";
      break;
    case HouseKind::FarmHouse:
      building = "farm";
      break;
    case HouseKind::Barn:
      building = "barn";
      levels = 1;
      height_m = 8.0;
      wall_material = is_alpine || random_unit(draw, 7, 0) < 0.4 ? "wood" : wall_material;
      if (wall_material == "wood") wall = "#7d5f43";
      break;
    case HouseKind::Shed:
      building = "shed";
      levels = 1;
      height_m = 3.2;
      roof_shape = "skillion";
      break;
    case HouseKind::Hotel:
      building = "hotel";
      levels = between(3, 6, draw, 5);
      roof_shape = is_alpine ? "gabled" : "flat";
      break;
  }
  if (!has_slope && roof_shape == "gabled" && kind != HouseKind::Barn &&
      kind != HouseKind::Industrial)
    roof_shape = "hipped";
  if (roof_shape == "flat" && roof_material != "metal") {
    roof_material = "tar_paper";
    roof = drawn(kFlatRoof, draw, 9);
  }
  tags = {{"building", building},
          {"building:levels", fmt::format("{}", levels)},
          {"building:material", wall_material},
          {"building:colour", wall},
          {"roof:shape", roof_shape},
          {"roof:material", roof_material},
          {"roof:colour", roof}};
  if (height_m > 0.0) tags.emplace_back("height", text_of(height_m));
  return tags;
}

}  // namespace terracast::tiler::country
