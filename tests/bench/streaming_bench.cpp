// Tiles that come and go: a flight rendered within a memory bound against the same flight with all
// its tiles in memory, in turn in one run.
//
//     build/bench/terracast_bench --benchmark_filter=streaming --benchmark_repetitions=5
//
//     export TERRACAST_BENCH_WORLD=out/archipelago/world TERRACAST_BENCH_VIEW=-7900,-900,200,90,12
//     build/bench/terracast_bench --benchmark_filter=streaming_world --benchmark_repetitions=5
//
// streaming_world   facts and colour of one frame of a view of a tiled world (place_asked()), twice: the
//                   first time loads the tiles, the second is measured. The argument is the memory of
//                   its tiles in per cent of what the view needs; `cpu_ratio` and `ratio` are CPU and wall
//                   time over those with all in memory, in turn in one run, on one thread.
//
// In `streaming` the argument is the bound in per cent of what all tiles of the flight take. `ratio` is the wall time
// with all in memory, loads not counted, over the wall time of the streamed flight, loads and
// waits counted; `prefetch_hits` the share of loads for which no ray had to wait; `reloads` the loads
// over the number of tiles that are loaded at least once when all fit.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <vector>

#include "core/parallel.h"
#include "tests/bench/bench_support.h"
#include "tests/bench/view_of_world.h"
#include "tests/support/hills_flight.h"
#include "tests/world/mountains.h"

namespace {

using namespace terracast;

constexpr int kNumFrames = 24;
constexpr double kStep_m = 100.0;
constexpr double kStart_x = -0.5 * kStep_m * (kNumFrames - 1);

Eigen::Vector3d place_of(int frame) {
  const double x = kStart_x + kStep_m * frame;
  return {x, 0.0, 1800.0};
}

/// Level, a frame every 100 m, some 500 m above sharp mountains, one camera that looks down steeply:
/// each frame sees a part of what the flight does.
render::SequencePlan flight() {
  render::SequencePlan plan = test::small_plan(kNumFrames, 720, 640);
  plan.cameras = test::small_rig(720, 640, 60.0);
  plan.cameras.resize(1);
  plan.detail = {.cell_px = 1.0, .finest_spacing_m = 1.0};
  for (int i = 0; i < kNumFrames; ++i)
    plan.states[static_cast<std::size_t>(i)].world_from_body = {Eigen::Quaterniond::Identity(),
                                                                place_of(i)};
  return plan;
}

/// 8 km x 8 km, cells of 1 m below the flight.
test::TinyWorldOptions corridor() {
  test::TinyWorldOptions options;
  options.finest_level = 0;
  options.coarsest_level = 4;
  options.refine = [](const world::TileId& id) {
    const Eigen::Vector2d center = id.center_world();
    const double x = std::clamp(center.x(), kStart_x, place_of(kNumFrames - 1).x());
    return std::hypot(center.x() - x, center.y()) < 0.9 * id.side_m() + 100.0;
  };
  return options;
}

struct Streaming {
  static Streaming& get() {
    static Streaming streaming;
    return streaming;
  }
  bench::Folder folder{"streaming-bench"};
  world::TileStore store =
      test::make_tiny_world(folder.path(), test::mountain_height_m, corridor());
  std::unique_ptr<test::TracedPlan> in_memory = std::make_unique<test::TracedPlan>(store, flight());
  world::RayQueryStats of_all;

  /// As the render stage does it, without files.
  static double fly(const test::TracedPlan& scene) {
    const double start = bench::wall_seconds();
    sensors::TruthFrame truth;
    for (int frame = 0; frame < kNumFrames; ++frame) {
      std::vector<std::vector<world::Viewpoint>> turns;
      for (int turn = frame; turn < std::min(frame + 4, kNumFrames); ++turn)
        turns.push_back({{.position_world = place_of(turn), .pixels_per_radian = 720.0}});
      scene.query.expect(turns);
      scene.renderer.truth(frame, 0, truth);
      benchmark::DoNotOptimize(scene.renderer.color(frame, 0));
    }
    return bench::wall_seconds() - start;
  }

 private:
  Streaming() {
    fly(*in_memory);
    of_all = in_memory->query.stats();
  }
};

void streaming(benchmark::State& state) {
  Streaming& streaming = Streaming::get();
  const double bytes = 1e-2 * static_cast<double>(state.range(0)) *
                       static_cast<double>(streaming.of_all.bytes_resident);
  double in_memory_s = 0.0;
  double streamed_s = 0.0;
  world::RayQueryStats stats;
  for ([[maybe_unused]] const auto _ : state) {
    in_memory_s += Streaming::fly(*streaming.in_memory);
    const test::TracedPlan scene(streaming.store, flight(), {.memory_bytes = bytes});
    streamed_s += Streaming::fly(scene);
    stats = scene.query.stats();
  }
  state.counters["ratio"] = in_memory_s / streamed_s;
  state.counters["frame_ms"] =
      1e3 * streamed_s / (static_cast<double>(state.iterations()) * kNumFrames);
  state.counters["bound_MB"] = 1e-6 * bytes;
  state.counters["tiles"] = static_cast<double>(streaming.of_all.num_tiles_loaded);
  state.counters["reloads"] = static_cast<double>(stats.num_tiles_loaded) /
                              static_cast<double>(streaming.of_all.num_tiles_loaded);
  state.counters["prefetch_hits"] = 1.0 - static_cast<double>(stats.num_tiles_waited) /
                                              static_cast<double>(stats.num_tiles_loaded);
}

// A view of a tiled world.

constexpr int kViewWidth = 640;
constexpr int kViewHeight = 480;

struct ViewOfWorld {
  explicit ViewOfWorld(const bench::Place& place, const char* folder)
      : store(world::TileStore::open(folder)) {
    const world::RayQuery ground(store, world::finest_cut(store), {});
    plan = bench::flight_at(place, ground.surface_z_world(place.east_m, place.north_m).value(),
                            kViewWidth, kViewHeight);
    plan.detail = {.cell_px = 2.0, .finest_spacing_m = 1.0};
    in_memory = std::make_unique<test::TracedPlan>(store, plan);
    look(*in_memory);
    const world::RayQueryStats stats = in_memory->query.stats();
    need_bytes = static_cast<double>(stats.bytes_resident);
    num_tiles = static_cast<double>(stats.num_tiles_loaded);
    // What is no tile's.
    const double least = in_memory->query.least_memory_bytes();
    aside_bytes = std::min(least, static_cast<double>(stats.bytes_of_prototypes));
  }
  static ViewOfWorld* get() {
    static const std::unique_ptr<ViewOfWorld> view = []() -> std::unique_ptr<ViewOfWorld> {
      const char* folder = std::getenv("TERRACAST_BENCH_WORLD");
      const std::optional<bench::Place> place = bench::place_asked();
      if (folder == nullptr || !place) return nullptr;
      return std::make_unique<ViewOfWorld>(*place, folder);
    }();
    return view.get();
  }

  static void look(const test::TracedPlan& scene) {
    sensors::TruthFrame truth;
    scene.renderer.truth(1, 0, truth);
    benchmark::DoNotOptimize(truth);
    benchmark::DoNotOptimize(scene.renderer.color(1, 0));
  }

  world::TileStore store;
  render::SequencePlan plan;
  std::unique_ptr<test::TracedPlan> in_memory;
  double need_bytes = 0.0;
  double aside_bytes = 0.0;
  double num_tiles = 0.0;
};

void streaming_world(benchmark::State& state) {
  ViewOfWorld* const view = ViewOfWorld::get();
  if (view == nullptr) {
    state.SkipWithError("TERRACAST_BENCH_WORLD and TERRACAST_BENCH_VIEW name no view of a world");
    return;
  }
  const core::ThreadLimit limit(1);
  const double bytes =
      view->aside_bytes + 1e-2 * static_cast<double>(state.range(0)) * view->need_bytes;
  const test::TracedPlan scene(view->store, view->plan, {.memory_bytes = bytes});
  ViewOfWorld::look(scene);
  const world::RayQueryStats before = scene.query.stats();
  double cpu_s[2] = {};
  double wall_s[2] = {};
  for ([[maybe_unused]] const auto _ : state) {
    for (const bool is_streamed : {false, true}) {
      const double cpu = bench::cpu_seconds();
      const double wall = bench::wall_seconds();
      ViewOfWorld::look(is_streamed ? scene : *view->in_memory);
      cpu_s[is_streamed ? 1 : 0] += bench::cpu_seconds() - cpu;
      wall_s[is_streamed ? 1 : 0] += bench::wall_seconds() - wall;
    }
  }
  const world::RayQueryStats stats = scene.query.stats();
  const auto frames = static_cast<double>(state.iterations());
  state.counters["cpu_ratio"] = cpu_s[1] / cpu_s[0];
  state.counters["ratio"] = wall_s[1] / wall_s[0];
  state.counters["in_memory_s"] = cpu_s[0] / frames;
  state.counters["bound_MB"] = 1e-6 * bytes;
  state.counters["tiles"] = view->num_tiles;
  state.counters["loads"] =
      static_cast<double>(stats.num_tiles_loaded - before.num_tiles_loaded) / frames;
  state.counters["unpacked"] =
      static_cast<double>(stats.num_tiles_unpacked - before.num_tiles_unpacked) / frames;
}

BENCHMARK(streaming_world)
    ->ArgName("per_cent")
    ->Arg(120)
    ->Arg(50)
    ->Arg(25)
    ->Arg(10)
    ->Iterations(1)
    ->Unit(benchmark::kSecond)
    ->UseRealTime();

BENCHMARK(streaming)
    ->ArgName("per_cent")
    ->Arg(100)
    ->Arg(50)
    ->Arg(25)
    ->Iterations(1)
    ->Unit(benchmark::kSecond)
    ->UseRealTime();

}  // namespace
