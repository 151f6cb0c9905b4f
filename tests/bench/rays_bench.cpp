// Rays of `world` against bare Embree packet loops over the same rays and the same ground, in one
// run.
//
//     build/bench/terracast_bench --benchmark_filter=rays --benchmark_repetitions=5
//
// Bare means: one scene of all tiles' stitched GRIDs in a float frame about the camera, robust and
// compact, rays ready in float packets, nothing done with the hits. Each iteration traces all rays
// bare, then by RayQuery; `ratio` is the bare loop's CPU time over ours, 1 being as fast as bare
// Embree.

#include <benchmark/benchmark.h>

#include <cmath>
#include <memory>
#include <vector>

#include "core/parallel.h"
#include "tests/bench/bare_scene.h"
#include "tests/bench/bench_support.h"
#include "tests/world/mountains.h"
#include "world/ray_query.h"

namespace {

using namespace terracast;
using world::SurfaceHit;
using world::WorldRay;

constexpr int kWidth = 1280;
constexpr int kHeight = 720;
constexpr std::size_t kPacket = 16;
constexpr std::int64_t kBlock = 1024;  // rays a call

/// A view of mountains: 8 km x 8 km, cells of 1 m to 16 m, 300 m above ground.
class View {
 public:
  static View& get() {
    static View view;
    return view;
  }

  bench::Folder folder{"rays-bench"};
  std::vector<WorldRay> primary;     ///< 4 x 4 pixels after one another
  std::vector<WorldRay> visibility;  ///< from what they hit to another camera
  std::unique_ptr<world::RayQuery> query;
  std::unique_ptr<bench::BareScene> bare;
  double bytes_per_triangle = 0.0;

  void intersect(const std::vector<WorldRay>& rays, world::Coherence coherence) {
    hits_.resize(rays.size());
    core::parallel_for_blocks(static_cast<std::int64_t>(rays.size()), kBlock,
                              [&](std::int64_t begin, std::int64_t end) {
                                const auto at = static_cast<std::size_t>(begin);
                                const auto count = static_cast<std::size_t>(end - begin);
                                query->intersect(std::span(rays).subspan(at, count),
                                                 std::span(hits_).subspan(at, count), coherence);
                              });
  }
  void occluded(const std::vector<WorldRay>& rays) {
    answers_.resize(rays.size());
    core::parallel_for_blocks(static_cast<std::int64_t>(rays.size()), kBlock,
                              [&](std::int64_t begin, std::int64_t end) {
                                const auto at = static_cast<std::size_t>(begin);
                                const auto count = static_cast<std::size_t>(end - begin);
                                query->occluded(std::span(rays).subspan(at, count),
                                                std::span(answers_).subspan(at, count));
                              });
  }

 private:
  View() {
    const world::TileStore store =
        test::make_tiny_world(folder.path(), test::mountain_height_m, test::mountain_options(4));
    query = std::make_unique<world::RayQuery>(store, world::finest_cut(store),
                                              world::RayQueryOptions{});
    const Eigen::Vector3d camera(200.0, 100.0, *query->surface_z_world(200.0, 100.0) + 300.0);
    bare = std::make_unique<bench::BareScene>(store, query->cut(), camera);
    const double focal_length_px = kWidth / 2.0 / std::tan(35.0 * M_PI / 180.0);
    const double pitch_rad = 20.0 * M_PI / 180.0;
    for (int block = 0; block < kWidth / 4 * (kHeight / 4); ++block) {
      for (int k = 0; k < 16; ++k) {
        const double u = 4 * (block % (kWidth / 4)) + k % 4 + 0.5 - kWidth / 2.0;
        const double v = 4 * (block / (kWidth / 4)) + k / 4 + 0.5 - kHeight / 2.0;
        const Eigen::Vector3d forward(std::cos(pitch_rad), 0.0, -std::sin(pitch_rad));
        const Eigen::Vector3d down(-std::sin(pitch_rad), 0.0, -std::cos(pitch_rad));
        const Eigen::Vector3d right(0.0, -1.0, 0.0);
        primary.push_back(
            {.origin_world = camera,
             .direction_world = (focal_length_px * forward + u * right + v * down).normalized()});
      }
    }
    intersect(primary, world::Coherence::Coherent);
    const Eigen::Vector3d other = camera + Eigen::Vector3d(10.0, 25.0, 3.0);
    for (std::size_t i = 0; i < primary.size(); ++i) {
      if (hits_[i].is_sky()) continue;
      const Eigen::Vector3d point = camera + hits_[i].t * primary[i].direction_world;
      visibility.push_back({.origin_world = point, .direction_world = other - point, .t_max = 1.0});
    }
    visibility.resize(visibility.size() / kPacket * kPacket);
    const world::RayQueryStats stats = query->stats();
    bytes_per_triangle =
        static_cast<double>(stats.bytes_resident) /
        (2.0 * world::kTileCells * world::kTileCells * static_cast<double>(stats.num_tiles_loaded));
  }
  std::vector<SurfaceHit> hits_;
  std::vector<std::uint8_t> answers_;
};

template <class Bare, class Ours>
void compare(benchmark::State& state, std::size_t num_rays, const Bare& bare, const Ours& ours) {
  const core::ThreadLimit limit(static_cast<int>(state.range(0)));
  double bare_cpu_s = 0.0;
  double ours_cpu_s = 0.0;
  double bare_wall_s = 0.0;
  double ours_wall_s = 0.0;
  for ([[maybe_unused]] const auto _ : state) {
    const double cpu0 = bench::cpu_seconds();
    const double wall0 = bench::wall_seconds();
    bare();
    const double cpu1 = bench::cpu_seconds();
    const double wall1 = bench::wall_seconds();
    ours();
    const double wall2 = bench::wall_seconds();
    bare_cpu_s += cpu1 - cpu0;
    ours_cpu_s += bench::cpu_seconds() - cpu1;
    bare_wall_s += wall1 - wall0;
    ours_wall_s += wall2 - wall1;
    state.SetIterationTime(wall2 - wall1);
  }
  const double rays = static_cast<double>(num_rays) * static_cast<double>(state.iterations());
  state.counters["ratio"] = bare_cpu_s / ours_cpu_s;
  state.counters["bare_Mrays_cpu_s"] = 1e-6 * rays / bare_cpu_s;
  state.counters["ours_Mrays_cpu_s"] = 1e-6 * rays / ours_cpu_s;
  state.counters["bare_Mrays_wall_s"] = 1e-6 * rays / bare_wall_s;
  state.counters["ours_Mrays_wall_s"] = 1e-6 * rays / ours_wall_s;
  state.counters["bytes_per_triangle"] = View::get().bytes_per_triangle;
}

void rays_primary(benchmark::State& state) {
  View& view = View::get();
  const auto packets = view.bare->packets(view.primary);
  compare(
      state, view.primary.size(), [&] { view.bare->intersect(packets); },
      [&] { view.intersect(view.primary, world::Coherence::Coherent); });
}

void rays_visibility(benchmark::State& state) {
  View& view = View::get();
  const auto packets = view.bare->packets(view.visibility);
  compare(
      state, view.visibility.size(), [&] { view.bare->occluded(packets); },
      [&] { view.occluded(view.visibility); });
}

/// What a frame's facts need: the primary rays and visibility from one other camera.
void rays_facts(benchmark::State& state) {
  View& view = View::get();
  const auto primary = view.bare->packets(view.primary);
  const auto visibility = view.bare->packets(view.visibility);
  compare(
      state, view.primary.size() + view.visibility.size(),
      [&] {
        view.bare->intersect(primary);
        view.bare->occluded(visibility);
      },
      [&] {
        view.intersect(view.primary, world::Coherence::Coherent);
        view.occluded(view.visibility);
      });
}

void rays_tile_load(benchmark::State& state) {
  View& view = View::get();
  const world::CutTile tile = view.query->cut().front();
  const Eigen::Vector2d center = tile.id.center_world();
  const world::TileStore store = world::TileStore::open(view.folder.path());
  for ([[maybe_unused]] const auto _ : state) {
    const world::RayQuery query(store, {tile}, {});
    benchmark::DoNotOptimize(query.surface_z_world(center.x(), center.y()));
  }
}

BENCHMARK(rays_primary)->Arg(1)->Arg(2)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK(rays_visibility)->Arg(1)->Arg(2)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK(rays_facts)->Arg(1)->Arg(2)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK(rays_tile_load)->Unit(benchmark::kMillisecond);

}  // namespace
