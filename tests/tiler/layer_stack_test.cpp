#include "tiler/layer_stack.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <set>
#include <tuple>

#include "core/parallel.h"
#include "core/random.h"
#include "tests/tiler/raster_files.h"
#include "tiler/dry_cover.h"
#include "tiler/surface.h"
#include "tiler/tile_builder.h"
#include "world/tile_file.h"

namespace terracast::test {
namespace {

using tiler::Layer;
using tiler::LayerStack;
using tiler::SurfaceSample;
using tiler::WorldSurface;
using world::kHeightStep_m;
using world::TileId;

constexpr double kStackSize_m = 4096.0;

std::int32_t steps_of(double value_m) {
  return static_cast<std::int32_t>(std::lround(value_m / kHeightStep_m));
}

/// A box with its lowest corner at its origin.
world::Shape box(const Eigen::Vector3d& size_m) {
  world::Shape shape;
  for (int k = 0; k < 8; ++k)
    shape.vertices_steps.emplace_back((k & 1) != 0 ? steps_of(size_m.x()) : 0,
                                      (k & 2) != 0 ? steps_of(size_m.y()) : 0,
                                      (k & 4) != 0 ? steps_of(size_m.z()) : 0);
  constexpr std::uint32_t kFaces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6},
                                           {0, 1, 4}, {1, 5, 4}, {2, 6, 3}, {3, 6, 7},
                                           {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  for (const auto& face : kFaces)
    shape.triangles.push_back({.corners = {face[0], face[1], face[2]}, .finish = 0});
  shape.finishes.emplace_back();
  return shape;
}

/// What the layer of the tests puts into the world, by its own number.
struct Placed {
  Eigen::Vector2d corner_m;  ///< the lowest of x and y
  Eigen::Vector3d size_m;
  int coarsest_level = 10;
  bool is_instance = false;
};

/// Boxes where they are told, on the ground.
class Boxes : public Layer {
 public:
  explicit Boxes(std::vector<Placed> placed, std::uint32_t first_id = 1)
      : placed_(std::move(placed)), first_id_(first_id) {
    // A cube of a metre about its foot, for the instances.
    world::Shape cube = box({1.0, 1.0, 1.0});
    for (Eigen::Vector3i& vertex : cube.vertices_steps)
      vertex -= Eigen::Vector3i(steps_of(0.5), steps_of(0.5), 0);
    prototypes_.push_back({.name = "cube", .levels = {{.coarsest_level = 10, .shape = cube}}});
  }

  world::LayerInfo info() const override { return {}; }
  std::string input_hash() const override { return "boxes"; }
  std::span<const world::Prototype> prototypes() const override { return prototypes_; }

  void add_objects(const TileId& id, const tiler::LayerSite& site,
                   world::TileObjects& objects) const override {
    // From the last to the first: the stack brings order.
    for (std::size_t k = placed_.size(); k-- > 0;) {
      const Placed& at = placed_[k];
      const Eigen::Vector2d corner = id.corner_world();
      const Eigen::Vector2d high = at.corner_m + at.size_m.head<2>();
      const bool overlaps = at.corner_m.x() <= corner.x() + id.side_m() && high.x() >= corner.x() &&
                            at.corner_m.y() <= corner.y() + id.side_m() && high.y() >= corner.y();
      if (!overlaps) continue;
      const Eigen::Vector2d middle = at.corner_m + 0.5 * at.size_m.head<2>();
      const double z = site.ground_z_world(middle);
      const world::Provenance provenance{.instance_id = first_id_ + static_cast<std::uint32_t>(k),
                                         .feature = 100 + k};
      if (at.is_instance) {
        world::Instance instance;
        instance.provenance = provenance;
        instance.place_steps = {steps_of(middle.x()), steps_of(middle.y()), steps_of(z)};
        instance.scale = static_cast<std::uint16_t>(std::lround(at.size_m.x() * 4096.0));
        instance.coarsest_level = static_cast<std::int8_t>(at.coarsest_level);
        objects.instances.push_back(instance);
        continue;
      }
      world::Solid solid;
      solid.provenance = provenance;
      solid.place_m = middle.array().floor().cast<int>();
      solid.origin_steps = {steps_of(at.corner_m.x()), steps_of(at.corner_m.y()), steps_of(z)};
      solid.levels = {
          {.coarsest_level = static_cast<std::int8_t>(at.coarsest_level), .shape = box(at.size_m)}};
      objects.solids.push_back(std::move(solid));
    }
  }

 private:
  std::vector<Placed> placed_;
  std::uint32_t first_id_;
  std::vector<world::Prototype> prototypes_;
};

std::shared_ptr<const WorldSurface> surface_with(std::vector<std::unique_ptr<Layer>> layers,
                                                 const std::string& ground = "plane") {
  return tiler::layered_surface(prepare(world_of(ground, kStackSize_m)),
                                LayerStack(kStackSize_m, std::move(layers)));
}
template <class... Layers>
std::vector<std::unique_ptr<Layer>> list_of(Layers... layers) {
  std::vector<std::unique_ptr<Layer>> list;
  (list.push_back(std::move(layers)), ...);
  return list;
}

const world::Solid* solid_of(const world::Tile& tile, std::uint32_t id) {
  for (const world::Solid& solid : tile.objects.solids)
    if (solid.provenance.instance_id == id) return &solid;
  return nullptr;
}

TEST(LayerStack, WhatLiesOverABorderIsInEachTileWholeAndTheSame) {
  // Tiles of level 0 are 256 m wide. One box over the corner of four of them, one inside.
  const auto surface = surface_with(list_of(std::make_unique<Boxes>(
      std::vector<Placed>{{.corner_m = {250.0, 507.0}, .size_m = {20.0, 9.0, 6.0}},
                          {.corner_m = {300.0, 300.0}, .size_m = {20.0, 9.0, 6.0}}})));
  const world::Solid* first = nullptr;
  std::vector<world::Tile> tiles;
  tiles.reserve(16);
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 4; ++x) {
      tiles.push_back(build_tile(*surface, {0, x, y}));
      const bool is_at_corner = x <= 1 && y >= 1 && y <= 2;
      const world::Solid* solid = solid_of(tiles.back(), 1);
      EXPECT_EQ(solid != nullptr, is_at_corner) << x << " " << y;
      EXPECT_EQ(solid_of(tiles.back(), 2) != nullptr, x == 1 && y == 1);
      EXPECT_EQ(tiles.back().objects.solids.size(),
                static_cast<std::size_t>(is_at_corner) + (x == 1 && y == 1 ? 1u : 0u));
      if (solid == nullptr) continue;
      EXPECT_EQ(solid->levels.front().shape.triangles.size(), 12u);
      if (first == nullptr) first = solid;
      EXPECT_EQ(*solid, *first);
    }
}

TEST(LayerStack, WhatIsTooSmallForALevelIsLeftOutThereAndNotBesideFinerTiles) {
  const auto surface = surface_with(list_of(std::make_unique<Boxes>(std::vector<Placed>{
      {.corner_m = {100.0, 100.0}, .size_m = {5.0, 5.0, 5.0}, .coarsest_level = 1},
      {.corner_m = {200.0, 100.0},
       .size_m = {5.0, 5.0, 5.0},
       .coarsest_level = 2,
       .is_instance = true}})));
  const auto num = [&](int level) {
    const world::Tile tile = build_tile(*surface, {level, 0, 0});
    return std::pair(tile.objects.solids.size(), tile.objects.instances.size());
  };
  EXPECT_EQ(num(0), std::pair(std::size_t{1}, std::size_t{1}));
  EXPECT_EQ(num(1), std::pair(std::size_t{1}, std::size_t{1}));
  EXPECT_EQ(num(2), std::pair(std::size_t{0}, std::size_t{1}));
  EXPECT_EQ(num(3), std::pair(std::size_t{0}, std::size_t{0}));
}

TEST(LayerStack, ACoarserTileOverWhoseBorderAnObjectReachesHoldsItForTheFinerOnesSake) {
  // Its place is in the tile (0, 0) of level 2, at x < 1024; it reaches over into (1, 0). Where the cut
  // has tiles of level 1 about its place and of level 2 beside them, it must be in those of level 2.
  const auto surface = surface_with(list_of(std::make_unique<Boxes>(std::vector<Placed>{
      {.corner_m = {1000.0, 100.0}, .size_m = {40.0, 10.0, 5.0}, .coarsest_level = 1}})));
  EXPECT_EQ(solid_of(build_tile(*surface, {2, 0, 0}), 1), nullptr);
  EXPECT_NE(solid_of(build_tile(*surface, {2, 1, 0}), 1), nullptr);
  EXPECT_NE(solid_of(build_tile(*surface, {1, 1, 0}), 1), nullptr);
}

TEST(LayerStack, ObjectsAreInTheOrderOfLayersAndFeatures) {
  const std::vector<Placed> placed = {
      {.corner_m = {10, 10}, .size_m = {5, 5, 5}},
      {.corner_m = {30, 10}, .size_m = {5, 5, 5}},
      {.corner_m = {50, 10}, .size_m = {2, 2, 2}, .is_instance = true},
      {.corner_m = {70, 10}, .size_m = {2, 2, 2}, .is_instance = true}};
  const auto surface = surface_with(
      list_of(std::make_unique<Boxes>(placed, 50), std::make_unique<Boxes>(placed, 1)));
  const world::Tile tile = build_tile(*surface, {0, 0, 0});
  std::vector<std::tuple<int, std::uint64_t, std::uint32_t>> solids, instances;
  for (const world::Solid& solid : tile.objects.solids)
    solids.emplace_back(solid.provenance.layer, solid.provenance.feature,
                        solid.provenance.instance_id);
  for (const world::Instance& instance : tile.objects.instances)
    instances.emplace_back(instance.provenance.layer, instance.provenance.feature,
                           instance.provenance.instance_id);
  using Rows = std::vector<std::tuple<int, std::uint64_t, std::uint32_t>>;
  EXPECT_EQ(solids, (Rows{{0, 100, 50}, {0, 101, 51}, {1, 100, 1}, {1, 101, 2}}));
  EXPECT_EQ(instances, (Rows{{0, 102, 52}, {0, 103, 53}, {1, 102, 3}, {1, 103, 4}}));
  // Each layer has a prototype of its own, counted over the whole world.
  ASSERT_EQ(surface->layers().prototypes().size(), 2u);
  EXPECT_EQ(tile.objects.instances[0].prototype, 0);
  EXPECT_EQ(tile.objects.instances[2].prototype, 1);
}

/// Boxes, the first of which shows the last of the layer's textures, as its prototype does.
class TexturedBoxes final : public Boxes {
 public:
  TexturedBoxes(std::size_t num_textures, std::uint16_t shown, std::uint32_t first_id)
      : Boxes({{.corner_m = {10, 10}, .size_m = {5, 5, 5}}}, first_id) {
    for (std::size_t i = 0; i < num_textures; ++i)
      textures_.push_back(
          {fmt::format("{} of {}", i, num_textures), core::Image8(2, 2, 3, std::uint8_t{7})});
    finish_.material = world::Material::Textured;
    finish_.pattern = shown;
    prototypes_.assign(Boxes::prototypes().begin(), Boxes::prototypes().end());
    prototypes_[0].levels[0].shape.finishes[0] = finish_;
  }
  std::span<const world::Prototype> prototypes() const override { return prototypes_; }
  std::span<const world::Texture> textures() const override { return textures_; }
  void add_objects(const TileId& id, const tiler::LayerSite& site,
                   world::TileObjects& objects) const override {
    const std::size_t first = objects.solids.size();
    Boxes::add_objects(id, site, objects);
    for (std::size_t i = first; i < objects.solids.size(); ++i)
      objects.solids[i].levels[0].shape.finishes[0] = finish_;
  }

 private:
  world::Finish finish_;
  std::vector<world::Texture> textures_;
  std::vector<world::Prototype> prototypes_;
};

TEST(LayerStack, TexturesAreCountedOverAllLayers) {
  const auto surface = surface_with(
      list_of(std::make_unique<TexturedBoxes>(3, 2, 1), std::make_unique<TexturedBoxes>(2, 1, 10)));
  const std::vector<world::Texture>& textures = surface->layers().textures();
  ASSERT_EQ(textures.size(), 5u);
  const world::Tile tile = build_tile(*surface, {0, 0, 0});
  ASSERT_EQ(tile.objects.solids.size(), 2u);
  const auto shown_by = [&](const world::Finish& finish) { return textures[finish.pattern].name; };
  for (std::size_t layer = 0; layer < 2; ++layer) {
    const char* expected = layer == 0 ? "2 of 3" : "1 of 2";
    EXPECT_EQ(shown_by(tile.objects.solids[layer].levels[0].shape.finishes[0]), expected);
    EXPECT_EQ(shown_by(surface->layers().prototypes()[layer].levels[0].shape.finishes[0]),
              expected);
  }
  expect_error(core::ErrorKind::Internal, {"texture", "2 of 2"},
               [] { surface_with(list_of(std::make_unique<TexturedBoxes>(2, 2, 1))); });
}

TEST(LayerStack, IdsThatAreNoneOrThereTwiceAreRefused) {
  const std::vector<Placed> placed = {{.corner_m = {10, 10}, .size_m = {5, 5, 5}},
                                      {.corner_m = {30, 10}, .size_m = {5, 5, 5}}};
  const auto build = [&](std::uint32_t first, std::uint32_t second) {
    const auto surface = surface_with(
        list_of(std::make_unique<Boxes>(placed, first), std::make_unique<Boxes>(placed, second)));
    build_tile(*surface, {0, 0, 0});
  };
  EXPECT_NO_THROW(build(1, 3));
  expect_error(core::ErrorKind::Internal, {"tile", "id"}, [&] { build(1, 2); });
  expect_error(core::ErrorKind::Internal, {"tile", "id"}, [&] { build(0, 5); });
}

TEST(LayerStack, NothingReachesAboveTheTopOfTheTilesObjects) {
  std::vector<Placed> placed;
  for (std::uint64_t k = 0; k < 40; ++k) {
    const double size_m = core::random_between(1.0, 12.0, 3, 1, k);
    placed.push_back({.corner_m = {core::random_between(-20.0, 250.0, 3, 2, k),
                                   core::random_between(-20.0, 250.0, 3, 3, k)},
                      .size_m = {size_m, size_m, size_m},
                      .is_instance = k % 2 == 0});
  }
  const auto surface = surface_with(list_of(std::make_unique<Boxes>(placed)));
  const world::Tile tile = build_tile(*surface, {0, 0, 0});
  double top_m = -1e9;
  for (const world::Solid& solid : tile.objects.solids)
    for (const Eigen::Vector3i& vertex : solid.levels.front().shape.vertices_steps)
      top_m = std::max(top_m, (solid.origin_steps + vertex).z() * kHeightStep_m);
  for (const world::Instance& instance : tile.objects.instances)
    top_m = std::max(top_m, instance.place_steps.z() * kHeightStep_m + instance.scale / 4096.0);
  const double stated_m = tile.center_z_m + tile.objects_top_steps * kHeightStep_m;
  EXPECT_GE(stated_m, top_m - 1e-9);
  // An instance may lean and turn: its reach is the diagonal of its half foot and its height.
  EXPECT_LE(stated_m, top_m + 12.0 * (std::sqrt(1.5) - 1.0) + kHeightStep_m);
  EXPECT_EQ(build_tile(*surface, {0, 4, 4}).objects_top_steps, world::Tile::kNoObjects);
}

TEST(LayerStack, TilesAreTheSameBytesInAnyOrderAndFromAnyNumberOfThreads) {
  std::vector<Placed> placed;
  for (std::uint64_t k = 0; k < 300; ++k) {
    const double size_m = core::random_between(1.0, 60.0, 5, 1, k);
    placed.push_back({.corner_m = {core::random_between(-1100.0, 1100.0, 5, 2, k),
                                   core::random_between(-1100.0, 1100.0, 5, 3, k)},
                      .size_m = {size_m, size_m, size_m},
                      .coarsest_level = static_cast<int>(k % 4),
                      .is_instance = k % 3 == 0});
  }
  std::vector<TileId> ids;
  for (int level = 0; level <= 2; ++level)
    for (int y = -1; y < 1; ++y)
      for (int x = -1; x < 1; ++x) ids.push_back({level, x, y});
  const auto bytes_of = [&](int num_threads, std::uint64_t order) {
    const auto surface = surface_with(list_of(std::make_unique<Boxes>(placed)), "fractal");
    std::vector<TileId> shuffled = ids;
    for (std::size_t i = shuffled.size(); i > 1; --i)
      std::swap(shuffled[i - 1], shuffled[core::random_bits(order, 1, i) % i]);
    std::map<std::string, std::vector<std::byte>> bytes;
    std::mutex mutex;
    const core::ThreadLimit limit(num_threads);
    core::parallel_for(static_cast<std::int64_t>(shuffled.size()), [&](std::int64_t i) {
      const world::Tile tile = build_tile(*surface, shuffled[static_cast<std::size_t>(i)]);
      std::vector<std::byte> encoded = world::encode_tile(tile);
      const std::lock_guard lock(mutex);
      bytes[tile.id.name()] = std::move(encoded);
    });
    return bytes;
  };
  const auto first = bytes_of(1, 1);
  EXPECT_EQ(first.size(), ids.size());
  EXPECT_EQ(bytes_of(1, 2), first);
  EXPECT_EQ(bytes_of(2, 3), first);
}

/// Raises the ground by 10 m, and calls it by turns crops and nothing.
class Raised : public Layer {
 public:
  Raised(double lift_m, std::optional<world::Cover> cover) : lift_m_(lift_m), cover_(cover) {}
  world::LayerInfo info() const override { return {}; }
  std::string input_hash() const override { return "raised"; }
  double lift_m(const Eigen::Vector2d&, const SurfaceSample&) const override { return lift_m_; }
  std::optional<world::Cover> cover(const Eigen::Vector2d& place,
                                    const SurfaceSample&) const override {
    return place.x() > 0.0 ? cover_ : std::nullopt;
  }
  bool holds(const Eigen::Vector2d& place, double radius_m) const override {
    return std::abs(place.x() - 50.0) < 10.0 + radius_m;
  }

 private:
  double lift_m_;
  std::optional<world::Cover> cover_;
};

TEST(LayerStack, WhatLayersRaiseFadesOutAtTheSquaresBorder) {
  const auto surface = surface_with(list_of(std::make_unique<Raised>(10.0, std::nullopt),
                                            std::make_unique<Raised>(-4.0, std::nullopt)));
  const auto bare = prepare(world_of("plane", kStackSize_m));
  const auto lift_m = [&](double x, double y) {
    return surface->sample(x, y).z_world - bare->sample(x, y).z_world;
  };
  EXPECT_NEAR(lift_m(0.0, 0.0), 6.0, 1e-9);
  EXPECT_NEAR(lift_m(2048.0 - 100.0, 0.0), 6.0, 1e-9);
  EXPECT_NEAR(lift_m(2048.0 - 50.0, 0.0), 3.0, 1e-9);
  EXPECT_NEAR(lift_m(-2048.0 + 25.0, 800.0), 1.5, 1e-9);
  EXPECT_NEAR(lift_m(0.0, 2048.0), 0.0, 1e-12);
  EXPECT_NEAR(lift_m(0.0, 2100.0), 0.0, 1e-12);
  // Tiles hold what sample() says, at all levels.
  for (const TileId& id : {TileId{0, 7, -1}, TileId{2, 1, -1}, TileId{2, -2, 1}}) {
    const world::Tile tile = build_tile(*surface, id);
    const Eigen::Vector2d corner = id.corner_world();
    for (const auto& [i, j] : {std::pair(0, 0), {100, 31}, {256, 256}, {231, 0}})
      EXPECT_NEAR(
          tile.z_world(i, j),
          surface->sample(corner.x() + i * id.spacing_m(), corner.y() + j * id.spacing_m()).z_world,
          0.5 * kHeightStep_m + 1e-9);
  }
}

TEST(LayerStack, TheFirstLayerThatKnowsTheCoverIsBelieved) {
  const auto surface = surface_with(list_of(std::make_unique<Raised>(0.0, world::Cover::Crops),
                                            std::make_unique<Raised>(0.0, world::Cover::Forest)));
  EXPECT_EQ(surface->sample(10.0, 0.0).cover, world::Cover::Crops);
  EXPECT_EQ(surface->sample(-10.0, 0.0).cover, world::Cover::Land);
  EXPECT_EQ(surface->sample(3000.0, 0.0).cover, world::Cover::Outside);
}

/// Asks for free places, and puts a cube on each.
class Asking : public Boxes {
 public:
  explicit Asking(std::map<double, bool>& answers) : Boxes({}), answers_(answers) {}
  void add_objects(const TileId&, const tiler::LayerSite& site,
                   world::TileObjects&) const override {
    for (const double x : {20.0, 38.0, 50.0, 62.0, 80.0}) answers_[x] = site.is_free({x, 5.0}, 5.0);
  }
  bool holds(const Eigen::Vector2d&, double) const override {
    return true;
  }  // itself does not count

 private:
  std::map<double, bool>& answers_;
};

TEST(LayerStack, APlaceIsFreeWhereNoOtherLayerHoldsIt) {
  std::map<double, bool> answers;
  const auto surface = surface_with(
      list_of(std::make_unique<Raised>(0.0, std::nullopt), std::make_unique<Asking>(answers)),
      "plane");
  build_tile(*surface, {0, 0, 0});
  EXPECT_EQ(answers, (std::map<double, bool>{
                         {20.0, true}, {38.0, false}, {50.0, false}, {62.0, false}, {80.0, true}}));
  // Nothing stands in water.
  const auto lake = surface_with(
      list_of(std::make_unique<Raised>(0.0, world::Cover::Lake), std::make_unique<Asking>(answers)),
      "plane");
  build_tile(*lake, {0, 0, 0});
  for (const auto& [x, is_free] : answers) EXPECT_FALSE(is_free) << x;
}

/// Raises the ground, and knows what covers it in the north.
class Striped : public Raised, public tiler::DryCover {
 public:
  using Raised::Raised;
  std::optional<world::Cover> cover(const Eigen::Vector2d& place_world,
                                    const SurfaceSample& ground) const override {
    return place_world.y() < 60.0 ? std::nullopt : Raised::cover(place_world, ground);
  }
};

/// Raises the ground, and knows of a round lake.
class Pond : public Raised {
 public:
  using Raised::Raised;
  std::optional<world::Cover> cover(const Eigen::Vector2d& place_world,
                                    const SurfaceSample&) const override {
    return (place_world - Eigen::Vector2d(100.0, 100.0)).norm() < 70.0
               ? std::optional(world::Cover::Lake)
               : std::nullopt;
  }
};

/// Asks the site what the whole surface knows, too.
class Comparing : public Boxes {
 public:
  explicit Comparing(int& num_asked) : Boxes({}), num_asked_(num_asked) {}
  void add_objects(const TileId& id, const tiler::LayerSite& site,
                   world::TileObjects&) const override {
    for (int k = 0; k < 2000; ++k) {
      const Eigen::Vector2d at =
          id.corner_world() + id.side_m() * Eigen::Vector2d(core::random_unit(1, 2, 2 * k),
                                                            core::random_unit(1, 2, 2 * k + 1));
      const SurfaceSample whole = surface->sample(at.x(), at.y());
      EXPECT_EQ(site.ground_z_world(at), whole.z_world);
      EXPECT_EQ(site.cover(at), whole.cover);
      EXPECT_EQ(site.is_free(at, 0.0),
                !world::is_water(whole.cover) && std::abs(at.x() - 50.0) >= 10.0);
      ++num_asked_;
    }
  }
  std::shared_ptr<const WorldSurface> surface;

 private:
  int& num_asked_;
};

TEST(LayerStack, WhatASiteIsAskedIsWhatTheWholeSurfaceKnows) {
  int num_asked = 0;
  auto asking = std::make_unique<Comparing>(num_asked);
  Comparing& comparing = *asking;
  const auto surface =
      surface_with(list_of(std::make_unique<Striped>(1.0, world::Cover::Crops),
                           std::make_unique<Pond>(0.25, std::nullopt),
                           std::make_unique<Striped>(0.5, world::Cover::Forest), std::move(asking)),
                   "fractal");
  comparing.surface = surface;
  for (const TileId& id : {TileId{0, 0, 0}, TileId{0, -1, 0}, TileId{2, 1, 1}, TileId{3, 0, 0}})
    build_tile(*surface, id);
  comparing.surface.reset();
  EXPECT_EQ(num_asked, 8000);
}

}  // namespace
}  // namespace terracast::test
