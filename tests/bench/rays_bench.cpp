// Rays of `world` against bare Embree packet loops over the same rays and the same ground, in one run.
//
//     build/bench/terracast_bench --benchmark_filter=rays --benchmark_repetitions=5
//
// Bare means: one scene of all tiles' stitched GRIDs in a float frame about the camera, robust and compact, rays
// ready in float packets, nothing done with the hits. Each iteration traces all rays bare, then by RayQuery; `ratio` is
// the bare loop's CPU time over ours, 1 being as fast as bare Embree.

#include <benchmark/benchmark.h>
#include <embree3/rtcore.h>
#include <unistd.h>

#include <cmath>
#include <ctime>
#include <filesystem>
#include <memory>
#include <vector>

#include "core/parallel.h"
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

double cpu_seconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

double wall_seconds() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// All tiles in one Embree scene about an origin.
class BareScene {
 public:
  BareScene(const world::TileStore& store, const std::vector<world::CutTile>& cut,
            Eigen::Vector3d origin_world)
      : device_(rtcNewDevice(nullptr)),
        scene_(rtcNewScene(device_)),
        origin_world_(std::move(origin_world)) {
    for (const world::CutTile& tile : cut) attach(store.load(tile.id), tile.coarser_sides);
    rtcSetSceneFlags(scene_,
                     static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_COMPACT));
    rtcCommitScene(scene_);
  }
  ~BareScene() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  BareScene(const BareScene&) = delete;
  BareScene& operator=(const BareScene&) = delete;

  std::vector<RTCRayHit16> packets(const std::vector<WorldRay>& rays) const {
    std::vector<RTCRayHit16> result((rays.size() + kPacket - 1) / kPacket);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      RTCRayHit16& packet = result[i / kPacket];
      const std::size_t lane = i % kPacket;
      const Eigen::Vector3f origin = (rays[i].origin_world - origin_world_).cast<float>();
      const Eigen::Vector3f direction = rays[i].direction_world.cast<float>();
      packet.ray.org_x[lane] = origin.x();
      packet.ray.org_y[lane] = origin.y();
      packet.ray.org_z[lane] = origin.z();
      packet.ray.dir_x[lane] = direction.x();
      packet.ray.dir_y[lane] = direction.y();
      packet.ray.dir_z[lane] = direction.z();
      packet.ray.tnear[lane] = static_cast<float>(rays[i].t_min);
      packet.ray.tfar[lane] = static_cast<float>(rays[i].t_max);
      packet.ray.mask[lane] = 0xffffffffU;
      packet.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
    }
    return result;
  }

  void intersect(const std::vector<RTCRayHit16>& packets) const {
    trace(packets, RTC_INTERSECT_CONTEXT_FLAG_COHERENT,
          [this](const int* valid, RTCIntersectContext* context, RTCRayHit16& packet) {
            rtcIntersect16(valid, scene_, context, &packet);
          });
  }
  void occluded(const std::vector<RTCRayHit16>& packets) const {
    trace(packets, RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT,
          [this](const int* valid, RTCIntersectContext* context, RTCRayHit16& packet) {
            rtcOccluded16(valid, scene_, context, &packet.ray);
          });
  }

 private:
  void attach(const world::Tile& tile, std::uint8_t coarser_sides) {
    const std::vector<std::int32_t> half_steps = world::stitched_half_steps(tile, coarser_sides);
    const RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_GRID);
    auto* vertex = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, half_steps.size()));
    auto* grid = static_cast<RTCGrid*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_GRID, 0, RTC_FORMAT_GRID, sizeof(RTCGrid), 1));
    *grid = {0, world::kTileSamples, world::kTileSamples, world::kTileSamples};
    const Eigen::Vector2d corner = tile.id.corner_world() - origin_world_.head<2>();
    for (int j = 0; j < world::kTileSamples; ++j) {
      for (int i = 0; i < world::kTileSamples; ++i) {
        *vertex++ = static_cast<float>(corner.x() + i * tile.id.spacing_m());
        *vertex++ = static_cast<float>(corner.y() + j * tile.id.spacing_m());
        *vertex++ =
            static_cast<float>(tile.center_z_m - origin_world_.z() +
                               half_steps[world::Tile::sample(i, j)] * (world::kHeightStep_m / 2));
      }
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
  }

  template <class Trace>
  static void trace(const std::vector<RTCRayHit16>& packets, RTCIntersectContextFlags flags,
                    const Trace& one) {
    constexpr std::int64_t kPackets = kBlock / static_cast<std::int64_t>(kPacket);
    core::parallel_for_blocks(static_cast<std::int64_t>(packets.size()), kPackets,
                              [&](std::int64_t begin, std::int64_t end) {
                                alignas(64) int valid[kPacket];
                                std::fill(std::begin(valid), std::end(valid), -1);
                                RTCIntersectContext context;
                                rtcInitIntersectContext(&context);
                                context.flags = flags;
                                for (std::int64_t i = begin; i < end; ++i) {
                                  RTCRayHit16 packet = packets[static_cast<std::size_t>(i)];
                                  one(valid, &context, packet);
                                  benchmark::DoNotOptimize(packet.ray.tfar[0]);
                                }
                              });
  }

  RTCDevice device_;
  RTCScene scene_;
  Eigen::Vector3d origin_world_;
};

/// A view of mountains: 8 km x 8 km, cells of 1 m to 16 m, 300 m above ground.
class View {
 public:
  static View& get() {
    static View view;
    return view;
  }

  std::vector<WorldRay> primary;     ///< 4 x 4 pixels after one another
  std::vector<WorldRay> visibility;  ///< from what they hit to another camera
  std::unique_ptr<world::RayQuery> query;
  std::unique_ptr<BareScene> bare;
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
  View()
      : folder_(std::filesystem::temp_directory_path() /
                ("terracast-rays-bench-" + std::to_string(::getpid()))) {
    const world::TileStore store =
        test::make_tiny_world(folder_, test::mountain_height_m, test::mountain_options(4));
    query = std::make_unique<world::RayQuery>(store, world::finest_cut(store),
                                              world::RayQueryOptions{});
    const Eigen::Vector3d camera(200.0, 100.0, *query->surface_z_world(200.0, 100.0) + 300.0);
    bare = std::make_unique<BareScene>(store, query->cut(), camera);
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
  ~View() { std::filesystem::remove_all(folder_); }

  std::filesystem::path folder_;
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
    const double cpu0 = cpu_seconds();
    const double wall0 = wall_seconds();
    bare();
    const double cpu1 = cpu_seconds();
    const double wall1 = wall_seconds();
    ours();
    const double wall2 = wall_seconds();
    bare_cpu_s += cpu1 - cpu0;
    ours_cpu_s += cpu_seconds() - cpu1;
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
  const std::filesystem::path folder = std::filesystem::temp_directory_path() /
                                       ("terracast-rays-bench-" + std::to_string(::getpid()));
  const world::TileStore store = world::TileStore::open(folder);
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
