// Frames over worlds on which things stand, against bare Embree loops over the same rays.
//
//     build/bench/terracast_bench --benchmark_filter=settled --benchmark_repetitions=5
//     export TERRACAST_BENCH_WORLD=out/archipelago/world TERRACAST_BENCH_VIEW=-7900,-900,200,90,12
//     build/bench/terracast_bench --benchmark_filter=settled_world --benchmark_repetitions=5
//
// settled_forest_truth   a million trees in half of the view of 1280x720, rays as of frame_truth, in
//                        which the four rays beside each edge count too (nearly every pixel of a
//                        forest has them). The trees are those of the layer `vegetation`, at the
//                        levels of detail of the tiles on which they stand. Bare Embree has an
//                        instance for each, of the same shapes.
// settled_forest_rays    the primary rays of that view alone
// settled_forest_color   colour of that view: CPU time of a sample
// settled_world_truth, settled_world_color   the same over a tiled world, from a place that looks
//                        along a heading (anticlockwise from east, degrees), turned down by a pitch:
//                        east, north, height above ground in m, heading, pitch in degrees.
//
// `ratio` is the bare loop's CPU time over ours, in turn in one run. The argument is the number of
// threads.
//
// settled_world_climate  alone, on one thread and of the world alone: what a render reads of it before
//                        its first frame, where its sea is, and how open

#include <benchmark/benchmark.h>

#include <cstdlib>
#include <memory>
#include <optional>

#include "core/parallel.h"
#include "core/random.h"
#include "geo/units.h"
#include "render/checked_plan.h"
#include "scene/ground/ground.h"
#include "sensors/camera/frame_renderer.h"
#include "tests/bench/bench_support.h"
#include "tests/bench/frame_rays.h"
#include "tests/bench/view_of_world.h"
#include "tests/world/mountains.h"
#include "tiler/vegetation/plant_library.h"

namespace {

using namespace terracast;

constexpr int kWidth = 1280;
constexpr int kHeight = 720;
constexpr int kFrame = 1;
constexpr int kColorSamples = 1;

using bench::Place;

render::SequencePlan flight(const Place& place, double ground_z_m) {
  return bench::flight_at(place, ground_z_m, kWidth, kHeight);
}

/// A frame, and the same rays for bare Embree.
struct Compared {
  Compared(const world::TileStore& tile_store, std::vector<world::CutTile> cut,
           const render::SequencePlan& sequence)
      : store(tile_store),
        plan(sequence),
        views(plan.states, plan.cameras),
        scene(store, std::move(cut), plan.moving,
              sensors::scene_options(plan, views, {.memory_bytes = 9e9})),
        query(scene.whole()),
        renderer(plan, views, scene),
        bare(store, query.cut(), renderer.views().at(kFrame, 0).center_world),
        rays(bench::rays_of_frame(
            renderer, kFrame, 0,
            {&renderer.views().at(kFrame + 1, 0), &renderer.views().at(kFrame - 1, 0),
             &renderer.views().at(kFrame, 1), &renderer.views().at(kFrame, 2)},
            bare)) {}

  world::TileStore store;
  render::SequencePlan plan;
  sensors::ViewTable views;
  scene::Scene scene;
  const world::RayQuery& query;
  sensors::FrameRenderer renderer;
  bench::BareScene bare;
  bench::FrameRays rays;
};

// A forest: all that is left of the way ahead, where a million trees stand in view.

constexpr double kForestReach_m = 8192.0;
constexpr double kTreeSpacing_m = 4.4;
constexpr Place kForestPlace = {
    .east_m = 0.0, .north_m = 0.0, .agl_m = 250.0, .heading_deg = 0.0, .pitch_deg = 20.0};

double hill_m(double x, double y) {
  return 400.0 + 60.0 * std::sin(x * 0.0021) * std::cos(y * 0.0017) +
         8.0 * std::sin(x * 0.017 + y * 0.013);
}

std::uint32_t column_of(double x) {
  return static_cast<std::uint32_t>((x + kForestReach_m) / kTreeSpacing_m);
}

/// Puts trees on a leaf of the store, one in each square of a grid.
void plant(const tiler::PlantLibrary& plants, world::Tile& tile) {
  static const std::vector<tiler::PlantModel> models = [&] {
    std::vector<tiler::PlantModel> all;
    for (const char* species : {"birch", "spruce", "oak"})
      for (const tiler::PlantModel& model : plants.of(species)) all.push_back(model);
    return all;
  }();
  const Eigen::Vector2d corner = tile.id.corner_world();
  const double side_m = tile.id.side_m();
  const auto num_columns = static_cast<std::uint32_t>(2.0 * kForestReach_m / kTreeSpacing_m);
  double top_m = 0.0;
  for (std::uint32_t j = column_of(corner.y()); j <= column_of(corner.y() + side_m); ++j) {
    for (std::uint32_t i = column_of(corner.x()); i <= column_of(corner.x() + side_m); ++i) {
      const std::uint64_t number = std::uint64_t{j} * num_columns + i;
      const double x = (i + core::random_unit(11, number, 0)) * kTreeSpacing_m - kForestReach_m;
      const double y = (j + core::random_unit(11, number, 1)) * kTreeSpacing_m - kForestReach_m;
      // The left half of the view, as far as its side.
      if (x < 100.0 || y < 2.0 || y > 0.62 * x) continue;
      if (x < corner.x() || x >= corner.x() + side_m || y < corner.y() || y >= corner.y() + side_m)
        continue;
      const std::uint64_t bits = core::random_bits(12, number, 0);
      const tiler::PlantModel& model = models[bits % models.size()];
      world::Instance tree;
      tree.provenance = {
          .instance_id = static_cast<std::uint32_t>(number + 1), .layer = 0, .feature = number};
      tree.prototype = model.prototype;
      tree.place_steps = {static_cast<int>(std::lround(x / world::kHeightStep_m)),
                          static_cast<int>(std::lround(y / world::kHeightStep_m)),
                          static_cast<int>(std::lround(hill_m(x, y) / world::kHeightStep_m))};
      tree.heading = static_cast<std::uint16_t>(bits >> 32);
      tree.scale = static_cast<std::uint16_t>(3300 + (bits >> 20) % 1600);
      top_m = std::max(top_m, hill_m(x, y) + model.height_m * 1.4 - tile.center_z_m);
      tile.objects.instances.push_back(tree);
    }
  }
  if (!tile.objects.instances.empty())
    tile.objects_top_steps = static_cast<std::int32_t>(std::ceil(top_m / world::kHeightStep_m));
}

world::TileStore make_forest(const std::filesystem::path& folder) {
  test::TinyWorldOptions options = test::mountain_options(5);
  options.refine = [](const world::TileId& id) {
    return id.center_world().norm() < 1.1 * id.side_m() + 50.0;
  };
  const world::TileStore bare = test::make_tiny_world(folder, hill_m, options);
  const std::shared_ptr<const tiler::PlantLibrary> plants = tiler::PlantLibrary::grown();
  world::WorldManifest manifest = bare.manifest();
  manifest.layers.push_back({.name = "forest",
                             .kind = "vegetation",
                             .source = "",
                             .content_hash = "",
                             .licence = "CC0",
                             .accuracy = "",
                             .counts = {}});
  for (std::size_t row = 0; row < plants->prototypes().size(); ++row)
    manifest.prototypes.push_back(world::write_prototype(folder, row, plants->prototypes()[row]));
  for (const world::CutTile& leaf : world::finest_cut(bare)) {
    world::Tile tile = bare.load(leaf.id);
    plant(*plants, tile);
    const auto info = std::find_if(manifest.tiles.begin(), manifest.tiles.end(),
                                   [&](const world::TileInfo& one) { return one.id == leaf.id; });
    *info = world::write_tile(folder, tile);
  }
  world::write_manifest(folder, manifest);
  return world::TileStore::open(folder);
}

Compared& forest() {
  static const bench::Folder folder("forest-bench");
  static const world::TileStore store = make_forest(folder.path());
  static Compared compared(store, world::finest_cut(store),
                           flight(kForestPlace, hill_m(kForestPlace.east_m, kForestPlace.north_m)));
  return compared;
}

// A tiled world.

/// Null: none is asked for.
Compared* tiled_world() {
  static const std::unique_ptr<Compared> compared = []() -> std::unique_ptr<Compared> {
    const char* folder = std::getenv("TERRACAST_BENCH_WORLD");
    const std::optional<Place> place = bench::place_asked();
    if (folder == nullptr || !place) return nullptr;
    const world::TileStore store = world::TileStore::open(folder);
    const world::RayQuery ground(store, world::finest_cut(store), {});
    render::SequencePlan plan =
        flight(*place, ground.surface_z_world(place->east_m, place->north_m).value());
    plan.detail = {.cell_px = 2.0, .finest_spacing_m = 1.0};
    return std::make_unique<Compared>(
        store,
        world::choose_cut(store, render::viewpoints_of(plan.states, plan.cameras), plan.detail),
        plan);
  }();
  return compared.get();
}

// What is measured.

template <class Bare, class Ours>
void compare(benchmark::State& state, const Compared& compared, double num_rays, const Bare& bare,
             const Ours& ours) {
  const core::ThreadLimit limit(static_cast<int>(state.range(0)));
  double bare_s = 0.0;
  double ours_s = 0.0;
  for ([[maybe_unused]] const auto _ : state) {
    const double start = bench::cpu_seconds();
    bare();
    const double between = bench::cpu_seconds();
    ours();
    bare_s += between - start;
    ours_s += bench::cpu_seconds() - between;
  }
  const auto frames = static_cast<double>(state.iterations());
  state.counters["ratio"] = bare_s / ours_s;
  state.counters["bare_ns_a_ray"] = 1e9 * bare_s / frames / num_rays;
  state.counters["ours_ns_a_ray"] = 1e9 * ours_s / frames / num_rays;
  state.counters["rays"] = num_rays;
  state.counters["objects_share"] = compared.rays.share_of_objects;
  state.counters["sky_share"] = compared.rays.share_of_sky;
  state.counters["edge_rays"] = compared.rays.num_edge_rays;
  state.counters["instances"] = static_cast<double>(compared.bare.num_instances());
  state.counters["solids"] = static_cast<double>(compared.bare.num_solids());
  state.counters["tiles"] = static_cast<double>(compared.query.cut().size());
}

void measure_truth(benchmark::State& state, const Compared& compared) {
  sensors::TruthFrame truth;
  compare(
      state, compared, compared.rays.num_rays,
      [&] {
        for (const auto& packets : compared.rays.packets) compared.bare.intersect(packets);
      },
      [&] {
        compared.renderer.truth(kFrame, 0, truth);
        benchmark::DoNotOptimize(truth);
      });
}

/// Primary rays in the order of the frame's pixels, to hits without what is known of their surface.
void measure_rays(benchmark::State& state, const Compared& compared) {
  const sensors::View& view = compared.renderer.views().at(kFrame, 0);
  std::vector<world::WorldRay> rays;
  bench::for_each_traced_pixel(kWidth, kHeight, [&](int x, int y) {
    rays.push_back(
        {.origin_world = view.center_world, .direction_world = view.ray_world({x + 0.5, y + 0.5})});
  });
  std::vector<world::SurfaceHit> hits(rays.size());
  compare(
      state, compared, static_cast<double>(rays.size()),
      [&] { compared.bare.intersect(compared.rays.packets.front()); },
      [&] {
        constexpr std::int64_t kBlock = 1024;
        core::parallel_for_blocks(static_cast<std::int64_t>(rays.size()), kBlock,
                                  [&](std::int64_t begin, std::int64_t end) {
                                    const auto at = static_cast<std::size_t>(begin);
                                    const auto count = static_cast<std::size_t>(end - begin);
                                    compared.query.intersect(std::span(rays).subspan(at, count),
                                                             std::span(hits).subspan(at, count),
                                                             world::Coherence::Coherent);
                                  });
      });
}

void measure_color(benchmark::State& state, const Compared& compared) {
  const core::ThreadLimit limit(static_cast<int>(state.range(0)));
  const double start = bench::cpu_seconds();
  for ([[maybe_unused]] const auto _ : state)
    benchmark::DoNotOptimize(compared.renderer.color(kFrame, 0));
  const double samples = static_cast<double>(kColorSamples) * kWidth * kHeight *
                         static_cast<double>(state.iterations());
  state.counters["cpu_ns_a_sample"] = 1e9 * (bench::cpu_seconds() - start) / samples;
}

void settled_forest_truth(benchmark::State& state) { measure_truth(state, forest()); }
void settled_forest_rays(benchmark::State& state) { measure_rays(state, forest()); }
void settled_forest_color(benchmark::State& state) { measure_color(state, forest()); }

template <void (*kMeasure)(benchmark::State&, const Compared&)>
void over_world(benchmark::State& state) {
  if (const Compared* compared = tiled_world())
    kMeasure(state, *compared);
  else
    state.SkipWithError("TERRACAST_BENCH_WORLD and TERRACAST_BENCH_VIEW name no view of a world");
}
void settled_world_truth(benchmark::State& state) { over_world<measure_truth>(state); }
void settled_world_rays(benchmark::State& state) { over_world<measure_rays>(state); }
void settled_world_color(benchmark::State& state) { over_world<measure_color>(state); }

void settled_world_climate(benchmark::State& state) {
  const char* folder = std::getenv("TERRACAST_BENCH_WORLD");
  if (folder == nullptr) {
    state.SkipWithError("TERRACAST_BENCH_WORLD names no world");
    return;
  }
  const world::TileStore store = world::TileStore::open(folder);
  for ([[maybe_unused]] const auto _ : state) benchmark::DoNotOptimize(scene::climate_of(store, 1));
}

BENCHMARK(settled_forest_truth)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond);
BENCHMARK(settled_forest_rays)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond);
BENCHMARK(settled_forest_color)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond);
BENCHMARK(settled_world_truth)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond);
BENCHMARK(settled_world_rays)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond);
BENCHMARK(settled_world_color)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond);
BENCHMARK(settled_world_climate)->Unit(benchmark::kMillisecond);

}  // namespace
