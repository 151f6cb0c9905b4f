#include <array>

#include "core/random.h"
#include "tiler/objects/hull.h"

namespace terracast::tiler {
namespace {

using core::SemanticClass;
using Eigen::Vector3d;
using world::Material;

constexpr std::array<Color, 6> kBoxColors = {
    {{150, 54, 38}, {36, 74, 124}, {60, 104, 74}, {196, 196, 190}, {200, 120, 40}, {104, 60, 58}}};

struct Finishes {
  FinishNumber hull, red, deck, white, glass, dark, funnel, crane;
};
Finishes finishes_of(ThingMesh& mesh, const Color& hull, const Color& deck, const Color& funnel) {
  return {mesh.finish(Material::Paint, hull),         mesh.finish(Material::Paint, {126, 40, 32}),
          mesh.finish(Material::Paint, deck),         mesh.finish(Material::Paint, {234, 234, 230}),
          mesh.finish(Material::Glass, {40, 46, 54}), mesh.finish(Material::Metal, {46, 47, 50}),
          mesh.finish(Material::Paint, funnel),       mesh.finish(Material::Paint, {214, 176, 60})};
}

/// A block of decks with rows of windows; the wheelhouse on top has wings over the ship's breadth.
void add_house(ThingMesh& mesh, const Finishes& f, double rear_m, double front_m, double half_m,
               double foot_m, int num_decks, double wing_m, int detail) {
  const double storey = 2.9;
  const double top = foot_m + num_decks * storey;
  mesh.box({rear_m, -half_m, foot_m - 1.0}, {front_m, half_m, top}, f.white);
  if (detail == 0)
    for (int k = 1; k < num_decks; ++k) {
      const double z = foot_m + k * storey;
      // A deck's edge, and panes below it.
      mesh.box({rear_m - 0.5, -half_m - 0.5, z - 0.12}, {front_m + 0.4, half_m + 0.5, z + 0.03},
               f.white);
      for (double y = -half_m + 1.2; y < half_m - 1.0; y += 2.4)
        mesh.box({front_m - 0.2, y - 0.4, z - 1.7}, {front_m + 0.03, y + 0.4, z - 0.8}, f.glass);
    }
  mesh.box({front_m - 5.0, -wing_m, top - 0.1}, {front_m + 0.3, wing_m, top + 0.25}, f.white);
  mesh.tapered_box({front_m - 5.5, -0.82 * half_m, top + 0.1},
                   {front_m - 0.2, 0.82 * half_m, top + 1.2}, {front_m - 5.5, -0.82 * half_m},
                   {front_m - 0.1, 0.82 * half_m}, f.white);
  mesh.tapered_box({front_m - 5.4, -0.83 * half_m, top + 1.15},
                   {front_m - 0.05, 0.83 * half_m, top + 2.2}, {front_m - 5.4, -0.85 * half_m},
                   {front_m + 0.2, 0.85 * half_m}, f.glass);
  mesh.box({front_m - 5.8, -0.9 * half_m, top + 2.1}, {front_m + 0.5, 0.9 * half_m, top + 2.6},
           f.white);
}

void add_funnel(ThingMesh& mesh, const Finishes& f, double x_m, double y_m, double length_m,
                double foot_m, double height_m) {
  mesh.tapered_box({x_m - 0.5 * length_m, y_m - 0.3 * length_m, foot_m - 0.5},
                   {x_m + 0.5 * length_m, y_m + 0.3 * length_m, foot_m + height_m},
                   {x_m - 0.45 * length_m, y_m - 0.25 * length_m},
                   {x_m + 0.38 * length_m, y_m + 0.25 * length_m}, f.funnel);
  mesh.box({x_m - 0.3 * length_m, y_m - 0.15 * length_m, foot_m + height_m - 0.3},
           {x_m + 0.2 * length_m, y_m + 0.15 * length_m, foot_m + height_m + 0.6}, f.dark);
}

void add_mast(ThingMesh& mesh, const Finishes& f, double x_m, double foot_m, double top_m,
              int detail) {
  mesh.cone({x_m, 0.0, foot_m - 0.5}, {x_m, 0.0, top_m}, 0.45, 0.2, detail == 0 ? 8 : 4, f.white,
            f.white);
  if (detail == 0) mesh.box({x_m - 0.2, -2.5, top_m - 3.2}, {x_m + 0.2, 2.5, top_m - 2.9}, f.white);
}

/// Containers in bays across the ship, 13 abreast at most; on coarse levels a block a bay.
void add_containers(ThingMesh& mesh, double rear_m, double front_m, double deck_m, double beam_m,
                    int most_tiers, int detail, std::uint64_t seed) {
  const double pitch = 12.192 + 0.8;
  const int num_bays = static_cast<int>((front_m - rear_m) / pitch);
  const int num_rows = static_cast<int>((beam_m - 0.6) / 2.52);
  std::array<FinishNumber, kBoxColors.size()> colors{};
  for (std::size_t k = 0; k < colors.size(); ++k)
    colors[k] = mesh.finish(Material::SheetMetal, kBoxColors[k], SemanticClass::Container);
  std::uint64_t number = 0;
  for (int bay = 0; bay < num_bays; ++bay) {
    const double x = rear_m + bay * pitch;
    const int bay_tiers = std::max(most_tiers - (bay == num_bays - 1   ? 2
                                                 : bay == num_bays - 2 ? 1
                                                                       : 0),
                                   1);
    const int rows = bay == num_bays - 1 ? num_rows - 4 : num_rows;
    // Piles of one height and colour side by side are one box on fine levels; a whole bay on coarse ones.
    const int step = detail == 0 ? 1 : detail == 1 ? 3 : rows;
    for (int row = 0; row < rows; row += step) {
      const std::uint64_t draw = core::random_bits(seed, 7, number++);
      const int tiers = detail == 0 ? bay_tiers - static_cast<int>(draw % 5 == 0) : bay_tiers;
      const double from_y = -0.5 * rows * 2.52 + row * 2.52;
      const double to_y = from_y + std::min(step, rows - row) * 2.52 - 0.08;
      if (detail == 0) {
        // Two colours a pile, cut at a seeded height.
        const int cut =
            1 + static_cast<int>((draw >> 8U) % static_cast<std::uint64_t>(std::max(tiers - 1, 1)));
        const double cut_z = deck_m + 2.6 * std::min(cut, tiers);
        mesh.box({x, from_y, deck_m}, {x + 12.192, to_y, cut_z - 0.02},
                 colors[(draw >> 16U) % colors.size()]);
        if (cut < tiers)
          mesh.box({x, from_y, cut_z}, {x + 12.192, to_y, deck_m + 2.6 * tiers},
                   colors[(draw >> 24U) % colors.size()]);
      } else {
        mesh.box({x, from_y, deck_m}, {x + 12.192, to_y, deck_m + 2.6 * tiers},
                 colors[(draw >> 16U) % colors.size()]);
      }
    }
  }
}

void build_container_ship(ThingMesh& mesh, double length, double beam, double draught, double deck,
                          int tiers, int detail, int variant) {
  static constexpr std::array<Color, 3> kHulls = {{{28, 44, 86}, {112, 24, 30}, {34, 66, 58}}};
  const Finishes f = finishes_of(mesh, kHulls[static_cast<std::size_t>(variant)], {112, 62, 48},
                                 kHulls[static_cast<std::size_t>(variant)]);
  const double bow = 0.5 * length;
  add_hull(mesh,
           {.length_m = length,
            .beam_m = beam,
            .draught_m = draught,
            .deck_z_m = deck,
            .bow_rise_m = 3.2,
            .bow_m = 0.26 * length,
            .stern_m = 0.14 * length,
            .transom = 0.86,
            .rake_m = 0.035 * length},
           detail, f.hull, f.red, f.deck);
  const double house = -bow + 0.24 * length;
  const int decks = tiers + 3;
  add_house(mesh, f, house - 13.0, house, 0.36 * beam, deck, decks, 0.5 * beam, detail);
  add_funnel(mesh, f, house - 17.5, 0.0, 6.5, deck, 2.9 * decks - 3.0);
  add_containers(mesh, house + 2.5, bow - 0.135 * length, deck + 0.9, beam, tiers, detail, 11);
  add_containers(mesh, -bow + 3.0, house - 21.0, deck + 0.9, beam, tiers - 1, detail, 12);
  add_mast(mesh, f, house - 3.0, deck + 2.9 * decks + 2.6, deck + 2.9 * decks + 12.0, detail);
  add_mast(mesh, f, bow - 0.05 * length, deck + 2.6, deck + 15.0, detail);
}

void build_bulker(ThingMesh& mesh, int detail, int variant) {
  static constexpr std::array<Color, 3> kHulls = {{{30, 32, 36}, {120, 36, 34}, {40, 84, 66}}};
  const Finishes f = finishes_of(mesh, kHulls[static_cast<std::size_t>(variant)], {122, 54, 44},
                                 kHulls[(static_cast<std::size_t>(variant) + 1) % 3]);
  const double bow = 114.5;
  const double deck = 6.0;
  add_hull(mesh,
           {.length_m = 229.0,
            .beam_m = 32.26,
            .draught_m = 14.4,
            .deck_z_m = deck,
            .bow_rise_m = 2.4,
            .bow_m = 30.0,
            .stern_m = 30.0,
            .transom = 0.72,
            .rake_m = 4.0},
           detail, f.hull, f.red, f.deck);
  add_house(mesh, f, -bow + 12.0, -bow + 24.0, 12.0, deck, 5, 16.0, detail);
  add_funnel(mesh, f, -bow + 8.0, 0.0, 6.0, deck, 13.0);
  // Seven holds: coamings with covers.
  for (int k = 0; k < 7; ++k) {
    const double x = -bow + 30.0 + k * 24.5;
    mesh.box({x, -8.6, deck - 0.5}, {x + 16.5, 8.6, deck + 1.6}, f.deck);
    mesh.tapered_box({x - 0.4, -9.0, deck + 1.4}, {x + 16.9, 9.0, deck + 2.4}, {x + 0.2, -8.4},
                     {x + 16.3, 8.4}, mesh.finish(Material::Paint, {150, 74, 58}));
    if (detail == 0)
      for (const double at : {0.33, 0.66})
        mesh.box({x - 0.5 + at * 16.9, -9.1, deck + 1.5}, {x - 0.2 + at * 16.9, 9.1, deck + 2.0},
                 f.dark);
  }
  if (detail < 2)  // deck cranes between the holds
    for (int k = 0; k < 4; ++k) {
      const double x = -bow + 50.2 + k * 49.0 - (k == 3 ? 24.5 : 0.0);
      mesh.cylinder({x, 0.0, deck - 0.5}, {x, 0.0, deck + 14.0}, 1.2, detail == 0 ? 10 : 6, f.crane,
                    f.crane);
      mesh.box({x - 1.6, -1.6, deck + 11.0}, {x + 1.8, 1.6, deck + 15.0}, f.crane);
      mesh.bar({x + 1.0, 0.0, deck + 13.0}, {x + 22.0, 0.0, deck + 8.2}, 0.9, f.crane);
    }
  add_mast(mesh, f, -bow + 20.0, deck + 17.0, deck + 24.0, detail);
  add_mast(mesh, f, bow - 8.0, deck + 2.0, deck + 13.0, detail);
}

void build_tanker(ThingMesh& mesh, int detail, int variant) {
  static constexpr std::array<Color, 2> kHulls = {{{32, 34, 40}, {112, 34, 36}}};
  const Finishes f =
      finishes_of(mesh, kHulls[static_cast<std::size_t>(variant)], {108, 62, 52}, {44, 72, 120});
  const double bow = 91.5;
  const double deck = 6.4;
  add_hull(mesh,
           {.length_m = 183.0,
            .beam_m = 32.2,
            .draught_m = 12.0,
            .deck_z_m = deck,
            .bow_rise_m = 2.2,
            .bow_m = 27.0,
            .stern_m = 26.0,
            .transom = 0.7,
            .rake_m = 3.0},
           detail, f.hull, f.red, f.deck);
  add_house(mesh, f, -bow + 13.0, -bow + 25.0, 12.5, deck, 5, 16.1, detail);
  add_funnel(mesh, f, -bow + 8.5, 0.0, 6.5, deck, 13.5);
  const FinishNumber pipe = mesh.finish(Material::Metal, {150, 96, 80});
  // Pipes along the middle, the manifold across amidships, a catwalk and tank hatches.
  for (const double y : {-1.8, -0.6, 0.6, 1.8})
    if (detail < 2)
      mesh.bar({-bow + 27.0, y, deck + 1.3}, {bow - 24.0, y, deck + 1.3}, 0.55, pipe,
               detail == 0 ? 8 : 4);
  mesh.box({-bow + 26.0, -3.4, deck - 0.2}, {bow - 26.0, -2.6, deck + 2.2}, f.deck);
  for (const double x : {-4.0, -1.5, 1.0, 3.5})
    mesh.bar({x, -14.2, deck + 1.6}, {x, 14.2, deck + 1.6}, 0.6, pipe, detail == 0 ? 8 : 4);
  if (detail == 0)
    for (int k = 0; k < 6; ++k)
      for (const double y : {-9.0, 9.0})
        mesh.cylinder({-bow + 36.0 + k * 20.0, y, deck - 0.3},
                      {-bow + 36.0 + k * 20.0, y, deck + 1.2}, 0.9, 8, pipe, pipe);
  mesh.cylinder({3.0, 5.5, deck - 0.3}, {3.0, 5.5, deck + 10.0}, 0.8, 8, f.crane, f.crane);
  mesh.bar({3.0, 5.5, deck + 9.4}, {-14.0, 5.5, deck + 7.0}, 0.7, f.crane);
  add_mast(mesh, f, -bow + 20.0, deck + 17.0, deck + 24.0, detail);
  add_mast(mesh, f, bow - 8.0, deck + 2.0, deck + 12.0, detail);
}

void build_ferry(ThingMesh& mesh, int detail, int variant) {
  static constexpr std::array<Color, 3> kHulls = {{{236, 236, 232}, {28, 54, 110}, {176, 30, 36}}};
  const Finishes f =
      finishes_of(mesh, kHulls[static_cast<std::size_t>(variant)], {70, 108, 84}, kHulls[1]);
  const double bow = 93.05;
  const double half = 13.85;
  const double deck = 12.0;
  add_hull(mesh,
           {.length_m = 186.1,
            .beam_m = 27.7,
            .draught_m = 6.5,
            .deck_z_m = deck,
            .bow_rise_m = 1.5,
            .bow_m = 46.0,
            .stern_m = 14.0,
            .transom = 0.96,
            .rake_m = 7.0},
           detail, f.hull, f.red, f.deck);
  // Decks of cabins, stepped at front and rear, with rows of windows.
  double rear = -bow + 6.0;
  double front = bow - 34.0;
  double z = deck;
  for (int k = 0; k < 4; ++k) {
    const double inset = k == 0 ? 0.06 : 0.6 + 0.5 * k;
    mesh.loft(
        {ring_at(z - 0.6, {{rear, -half + inset},
                           {front - 8.0, -half + inset},
                           {front, -0.6 * half},
                           {front, 0.6 * half},
                           {front - 8.0, half - inset},
                           {rear, half - inset}}),
         ring_at(z + 2.75, {{rear, -half + inset},
                            {front - 9.0, -half + inset},
                            {front - 1.0, -0.6 * half},
                            {front - 1.0, 0.6 * half},
                            {front - 9.0, half - inset},
                            {rear, half - inset}})},
        [&](std::size_t, std::size_t) { return f.white; }, f.white, k == 3 ? f.deck : f.white);
    if (detail == 0)
      for (double x = rear + 3.0; x < front - 12.0; x += 3.2) {
        mesh.box({x, half - inset - 0.3, z + 0.9}, {x + 1.7, half - inset + 0.03, z + 1.9},
                 f.glass);
        mesh.box({x, -half + inset - 0.03, z + 0.9}, {x + 1.7, -half + inset + 0.3, z + 1.9},
                 f.glass);
      }
    z += 2.8;
    rear += k == 0 ? 4.0 : 9.0;
    front -= 5.0;
  }
  // Wheelhouse with its wings, funnels, lifeboats.
  mesh.box({front - 6.0, -half - 0.0, z - 0.2}, {front + 3.0, half + 0.0, z + 1.0}, f.white);
  mesh.box({front - 5.8, -half + 0.3, z + 0.9}, {front + 3.1, half - 0.3, z + 2.0}, f.glass);
  mesh.box({front - 6.2, -half + 0.1, z + 1.9}, {front + 3.3, half - 0.1, z + 2.6}, f.white);
  add_funnel(mesh, f, -bow + 42.0, -5.0, 8.0, z - 0.2, 8.0);
  add_funnel(mesh, f, -bow + 42.0, 5.0, 8.0, z - 0.2, 8.0);
  if (detail < 2) {
    const FinishNumber orange = mesh.finish(Material::Paint, {226, 98, 24});
    for (int k = 0; k < 4; ++k)
      for (const double side : {-1.0, 1.0})
        mesh.loft({ring_across(-10.0 + 14.0 * k,
                               cut_rectangle({side * (half - 1.15) - 1.1, deck + 3.2},
                                             {side * (half - 1.15) + 1.1, deck + 5.0}, 0.5)),
                   ring_across(-2.0 + 14.0 * k,
                               cut_rectangle({side * (half - 1.15) - 1.1, deck + 3.2},
                                             {side * (half - 1.15) + 1.1, deck + 5.0}, 0.5))},
                  orange);
  }
  add_mast(mesh, f, front - 3.0, z + 2.0, z + 12.0, detail);
}

void build_cargo(ThingMesh& mesh, int detail, int variant) {
  static constexpr std::array<Color, 3> kHulls = {{{36, 62, 108}, {40, 88, 62}, {122, 40, 36}}};
  const Finishes f =
      finishes_of(mesh, kHulls[static_cast<std::size_t>(variant)], {104, 70, 54}, {200, 160, 50});
  const double bow = 45.0;
  const double deck = 3.6;
  add_hull(mesh,
           {.length_m = 90.0,
            .beam_m = 13.6,
            .draught_m = 5.0,
            .deck_z_m = deck,
            .bow_rise_m = 2.4,
            .bow_m = 15.0,
            .stern_m = 11.0,
            .transom = 0.8,
            .rake_m = 2.5},
           detail, f.hull, f.red, f.deck);
  add_house(mesh, f, -bow + 4.0, -bow + 12.0, 5.2, deck, 3, 6.7, detail);
  add_funnel(mesh, f, -bow + 3.6, 0.0, 3.0, deck, 8.5);
  mesh.box({-bow + 15.0, -5.4, deck - 0.4}, {bow - 17.0, 5.4, deck + 1.6}, f.hull);
  for (int k = 0; k < 6; ++k)
    mesh.box({-bow + 15.2 + 9.6 * k, -5.7, deck + 1.5}, {-bow + 24.6 + 9.6 * k, 5.7, deck + 2.2},
             f.deck);
  add_mast(mesh, f, -bow + 9.0, deck + 11.0, deck + 17.0, detail);
  add_mast(mesh, f, bow - 5.0, deck + 2.0, deck + 10.0, detail);
}

ThingInfo ship(std::string name, const Vector3d& size_m, std::string_view source, int num_variants,
               std::vector<int> levels, std::function<void(ThingMesh&, int, int)> build) {
  return {.name = std::move(name),
          .family = {},
          .semantic_class = SemanticClass::Ship,
          .stance = Stance::Floats,
          .size_m = size_m,
          .source = source,
          .coarsest_levels = std::move(levels),
          .num_variants = num_variants,
          .build = std::move(build)};
}

}  // namespace

std::vector<ThingInfo> ships();
std::vector<ThingInfo> ships() {
  return {ship("container_ship", {294.1, 32.31, 47.9},
               "Panama Canal Authority, limits of the old locks: 294.13 x 32.31 m, 12.04 m draught",
               3, {0, 1, 3, 6},
               [](ThingMesh& m, int d, int v) {
                 build_container_ship(m, 294.1, 32.31, 12.04, 9.8, 6, d, v);
               }),
          ship("feeder_ship", {147.9, 23.3, 38.2},
               "feeders of 1100 TEU: 147.9 x 23.3 m, 8.5 m draught (type CV 1100)", 3, {0, 1, 3, 5},
               [](ThingMesh& m, int d, int v) {
                 build_container_ship(m, 147.9, 23.3, 8.5, 5.9, 4, d, v);
               }),
          ship("bulk_carrier", {229.0, 32.26, 30.0},
               "Kamsarmax: 229 m (berth of Port Kamsar) x 32.26 m, 14.4 m draught", 3, {0, 1, 3, 6},
               [](ThingMesh& m, int d, int v) { build_bulker(m, d, v); }),
          ship("tanker", {183.0, 32.2, 30.4},
               "product tankers of 50 000 t (MR): 183 x 32.2 m, 12 m draught", 2, {0, 1, 3, 6},
               [](ThingMesh& m, int d, int v) { build_tanker(m, d, v); }),
          ship("ferry", {186.1, 27.7, 35.2},
               "ferry Star (2007), Helsinki to Tallinn: 186.1 x 27.7 m, 6.5 m draught", 3,
               {0, 1, 3, 6}, [](ThingMesh& m, int d, int v) { build_ferry(m, d, v); }),
          ship("coaster", {90.0, 13.6, 20.6}, "coasters of 3700 t: 90 x 13.6 m, 5 to 5.5 m draught",
               3, {0, 1, 3, 5}, [](ThingMesh& m, int d, int v) { build_cargo(m, d, v); })};
}

}  // namespace terracast::tiler
