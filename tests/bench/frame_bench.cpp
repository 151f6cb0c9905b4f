// Frames of `render`: ground truth against bare Embree loops over the same rays, and colour in
// nanoseconds a sample.
//
//     build/bench/terracast_bench --benchmark_filter=frame --benchmark_repetitions=5
//
// frame_truth traces all facts of a camera (range, normals, classes, edges, visibility in the next
// and previous frame and in the rig's two other cameras); bare traces its primary and visibility
// rays and does nothing with the hits. `ratio` is the bare loop's CPU time over ours, measured in
// turn in one run; `tiles_a_ray` and `packet_fill` say in how many tiles a ray is cast and what share
// of the packets' lanes carries one. The argument is the number of threads.
//
// frame_trail renders facts and colour without and with a trail of the tiles that rays come to, in
// turn: with_truth, with_color and with_both are CPU times with it over those without. Its argument is
// the ground: 0 mountains, 1 a plain, over which rays are followed farther than they need to be.

#include <benchmark/benchmark.h>

#include "core/parallel.h"
#include "sensors/camera/frame_renderer.h"
#include "sensors/camera/pixel_blocks.h"
#include "tests/bench/bare_scene.h"
#include "tests/bench/bench_support.h"
#include "tests/support/hills_flight.h"
#include "tests/world/mountains.h"

namespace {

using namespace terracast;

constexpr int kWidth = 720;
constexpr int kHeight = 640;
constexpr int kFrame = 1;

render::SequencePlan flight(const test::HeightFunction& height_m = test::mountain_height_m) {
  render::SequencePlan plan = test::small_plan(3, kWidth, kHeight);
  plan.cameras = test::small_rig(kWidth, kHeight, 25.0);
  plan.conditions.color_samples = 4;
  for (int i = 0; i < 3; ++i) {
    geo::BodyState& state = plan.states[static_cast<std::size_t>(i)];
    state.world_from_body.translation = {200.0 + 8.0 * i, 100.0,
                                         height_m(200.0, 100.0) + 300.0 + i};
  }
  return plan;
}

/// 300 m above sharp mountains, 8 km x 8 km, cells of 1 m to 16 m.
struct Flight {
  static Flight& get() {
    static Flight flight;
    return flight;
  }
  bench::Folder folder{"frame-bench"};
  test::TracedPlan scene{
      test::make_tiny_world(folder.path(), test::mountain_height_m, test::mountain_options(4)),
      flight()};
  bench::BareScene bare{scene.store, scene.query.cut(),
                        scene.renderer.views().at(kFrame, 0).center_world};
  std::vector<std::vector<RTCRayHit16>>
      packets;  ///< primary, then those of each view that is asked
  double num_rays = 0.0;

 private:
  Flight() {
    const sensors::ViewTable& views = scene.renderer.views();
    const sensors::View& view = views.at(kFrame, 0);
    const sensors::TruthFrame truth = scene.renderer.truth(kFrame, 0);
    const auto grid = sensors::PixelGrid::of_squares(kWidth, kHeight, 32);
    std::vector<world::WorldRay> rays;
    for (int unit = 0; unit < grid.num_units(); ++unit)
      sensors::for_each_pixel(grid.unit(unit), [&](int x, int y) {
        rays.push_back({.origin_world = view.center_world,
                        .direction_world = view.ray_world({x + 0.5, y + 0.5})});
      });
    add(rays);
    for (const sensors::View* other : {&views.at(kFrame + 1, 0), &views.at(kFrame - 1, 0),
                                       &views.at(kFrame, 1), &views.at(kFrame, 2)}) {
      rays.clear();
      for (int unit = 0; unit < grid.num_units(); ++unit) {
        sensors::for_each_pixel(grid.unit(unit), [&](int x, int y) {
          const auto pixel = static_cast<std::size_t>(y * kWidth + x);
          const Eigen::Vector3d& point = truth.point_world[pixel];
          if (std::isinf(truth.range_m[pixel]) || !other->has_in_image(point)) return;
          rays.push_back({.origin_world = other->center_world,
                          .direction_world = point - other->center_world,
                          .t_max = 1.0 + 1e-6});
        });
      }
      add(rays);
    }
  }
  void add(const std::vector<world::WorldRay>& rays) {
    packets.push_back(bare.packets(rays));
    num_rays += static_cast<double>(rays.size());
  }
};

void frame_truth(benchmark::State& state) {
  Flight& flight = Flight::get();
  const core::ThreadLimit limit(static_cast<int>(state.range(0)));
  double bare_s = 0.0;
  double ours_s = 0.0;
  sensors::TruthFrame truth;  // used again, as the render stage does
  const world::RayQueryStats before = flight.scene.query.stats();
  for ([[maybe_unused]] const auto _ : state) {
    const double start = bench::cpu_seconds();
    for (const auto& packets : flight.packets) flight.bare.intersect(packets);
    const double between = bench::cpu_seconds();
    flight.scene.renderer.truth(kFrame, 0, truth);
    benchmark::DoNotOptimize(truth);
    bare_s += between - start;
    ours_s += bench::cpu_seconds() - between;
  }
  const double frames = static_cast<double>(state.iterations());
  state.counters["ratio"] = bare_s / ours_s;
  state.counters["rays"] = flight.num_rays;
  state.counters["bare_cpu_ms"] = 1e3 * bare_s / frames;
  state.counters["ours_cpu_ms"] = 1e3 * ours_s / frames;
  const world::RayQueryStats after = flight.scene.query.stats();
  const auto num_casts = static_cast<double>(after.num_casts - before.num_casts);
  state.counters["tiles_a_ray"] = num_casts / static_cast<double>(after.num_rays - before.num_rays);
  state.counters["packet_fill"] =
      num_casts / static_cast<double>(after.num_lanes - before.num_lanes);
  state.counters["ours_ns_a_ray"] = 1e9 * ours_s / frames / flight.num_rays;
}

void frame_color(benchmark::State& state) {
  Flight& flight = Flight::get();
  const core::ThreadLimit limit(static_cast<int>(state.range(0)));
  const double start = bench::cpu_seconds();
  for ([[maybe_unused]] const auto _ : state)
    benchmark::DoNotOptimize(flight.scene.renderer.color(kFrame, 0));
  const double samples = 4.0 * kWidth * kHeight * static_cast<double>(state.iterations());
  state.counters["cpu_ns_a_sample"] = 1e9 * (bench::cpu_seconds() - start) / samples;
}

double plain_height_m(double x, double y) {
  return 1200.0 + 2.0 * std::sin(0.05 * x) * std::cos(0.04 * y);
}

/// The flight over either ground.
test::TracedPlan& scene_over(std::int64_t ground) {
  if (ground == 0) return Flight::get().scene;
  static bench::Folder folder("frame-bench-plain");
  static test::TracedPlan scene(
      test::make_tiny_world(folder.path(), plain_height_m, test::mountain_options(4)),
      flight(plain_height_m));
  return scene;
}

void frame_trail(benchmark::State& state) {
  const test::TracedPlan& scene = scene_over(state.range(0));
  const core::ThreadLimit limit(1);
  world::RayTrail trail(scene.query.cut().size());
  sensors::TruthFrame truth;
  double truth_s[2] = {};  // without, with
  double color_s[2] = {};
  int num_turns = 0;
  for ([[maybe_unused]] const auto _ : state) {
    for (int i = 0; i < 2; ++i) {
      const int is_told = (i + num_turns) % 2;
      world::RayTrail* const told = is_told != 0 ? &trail : nullptr;
      trail.clear();
      const double start = bench::cpu_seconds();
      scene.renderer.truth(kFrame, 0, truth, told);
      const double between = bench::cpu_seconds();
      benchmark::DoNotOptimize(scene.renderer.color(kFrame, 0, told));
      truth_s[is_told] += between - start;
      color_s[is_told] += bench::cpu_seconds() - between;
    }
    ++num_turns;
  }
  state.counters["with_truth"] = truth_s[1] / truth_s[0];
  state.counters["with_color"] = color_s[1] / color_s[0];
  state.counters["with_both"] = (truth_s[1] + color_s[1]) / (truth_s[0] + color_s[0]);
  state.counters["tiles"] = static_cast<double>(scene.query.cut().size());
}

/// Ground materials and light alone, without rays.
void frame_shading(benchmark::State& state) {
  Flight& flight = Flight::get();
  const scene::Ground& ground = flight.scene.renderer.ground();
  const double footprint_m = 1e-2 * static_cast<double>(state.range(0));
  scene::GroundPlaces places;
  world::SurfaceSample surface;
  surface.cover = world::Cover::Land;
  surface.moisture = 0.5;
  surface.source = 0;
  surface.spacing_m = 1.0;
  scene::GroundPacket packet;
  scene::GroundLook look;
  scene::ViewPacket view{};
  scene::Lanes3f radiance;
  for (int i = 0; i < scene::kLanes; ++i) {
    view.direction[0][i] = 0.8f;
    view.direction[2][i] = -0.6f;
    view.distance_m[i] = 1000.0f;
    view.sun_share[i] = 1.0f;
  }
  double x = 0.0;
  for ([[maybe_unused]] const auto _ : state) {
    x += 13.7;
    for (int i = 0; i < scene::kLanes; ++i)
      places.set(i, {x + i * footprint_m, 77.0, 900.0}, Eigen::Vector3d(0.4, 0.2, 1.0).normalized(),
                 surface, footprint_m);
    ground.set(places, packet);
    ground.look(packet, look);
    scene::shade_ground(packet, look, view, flight.scene.renderer.sky(), radiance);
    benchmark::DoNotOptimize(radiance);
  }
  state.counters["ns_a_sample"] =
      benchmark::Counter(static_cast<double>(state.iterations()) * scene::kLanes * 1e-9,
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

BENCHMARK(frame_truth)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();
BENCHMARK(frame_color)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();
BENCHMARK(frame_trail)->ArgName("ground")->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);
BENCHMARK(frame_shading)->ArgName("footprint_cm")->Arg(3)->Arg(30)->Arg(300);

}  // namespace
