// Tiles that come and go: a flight rendered within a memory bound against the same flight with all
// its tiles in memory, in turn in one run.
//
//     build/bench/terracast_bench --benchmark_filter=streaming --benchmark_repetitions=5
//
// The argument is the bound in per cent of what all tiles of the flight take. `ratio` is the wall time
// with all in memory, loads not counted, over the wall time of the streamed flight, loads and
// waits counted; `prefetch_hits` the share of loads for which no ray had to wait; `reloads` the loads
// over the number of tiles that are loaded at least once when all fit.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "core/parallel.h"
#include "tests/bench/bench_support.h"
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
  std::unique_ptr<test::Scene> in_memory = std::make_unique<test::Scene>(store, flight());
  world::RayQueryStats of_all;

  /// As the render stage does it, without files.
  static double fly(const test::Scene& scene) {
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
    const test::Scene scene(streaming.store, flight(), {.memory_bytes = bytes});
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

BENCHMARK(streaming)
    ->ArgName("per_cent")
    ->Arg(100)
    ->Arg(50)
    ->Arg(25)
    ->Iterations(1)
    ->Unit(benchmark::kSecond)
    ->UseRealTime();

}  // namespace
