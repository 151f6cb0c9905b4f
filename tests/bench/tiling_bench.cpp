// Tiling against bare GDAL and Embree: what reading the same raster and committing the same number
// of triangles costs.
//
//     build/bench/terracast_bench --benchmark_filter=tiling --benchmark_repetitions=5
//
// tiling opens a raster of 10 m in UTM over 16 km, prepares it as a world and writes all tiles that
// a low flight wants. Bare reads the raster in one call and commits one Embree GRID for each of
// those tiles, with heights looked up bilinearly in the raster: no geodesy, no detail, no checks,
// no file. `ratio` is the bare CPU time over ours, measured in turn in one run. The argument is the
// number of threads.

#include <benchmark/benchmark.h>
#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <vector>

#include "core/parallel.h"
#include "tests/bench/bench_support.h"
#include "tests/tiler/raster_files.h"
#include "tests/world/mountains.h"
#include "tiler/tile_stage.h"

namespace {

using namespace terracast;

constexpr double kSize_m = 16384.0;
constexpr double kSpacing_m = 10.0;
constexpr double kTrianglesPerTile = 2.0 * world::kTileCells * world::kTileCells;

struct Source {
  bench::Folder folder{"tiling-bench-source"};
  std::filesystem::path file = folder.path() / "mountains.tif";
  Eigen::Vector2d middle = test::utm31(test::kOriginLat_deg, test::kOriginLon_deg);

  Source() {
    test::RasterSpec spec = test::utm_spec(kSize_m, kSpacing_m);
    spec.type = GDT_Float32;
    spec.value = [this](double u, double v) {
      return test::mountain_height_m(u - middle.x(), v - middle.y());
    };
    test::write_raster(file, spec);
  }
  static Source& get() {
    static Source source;
    return source;
  }
};

/// A flight of 4 km, 300 m above ground.
tiler::TilePlan flight_over(const tiler::WorldSurface& surface) {
  tiler::TilePlan plan;
  plan.detail.finest_spacing_m = 2.0;
  plan.sequences.emplace_back();
  for (double x = -2000.0; x <= 2000.0; x += 100.0)
    plan.sequences[0].push_back({.position_world = {x, 0.0, surface.sample(x, 0.0).z_world + 300.0},
                                 .pixels_per_radian = 720.0});
  return plan;
}

std::vector<world::TileId> tile(const std::filesystem::path& world_folder, int num_threads) {
  const core::Log log("tile", core::LogLevel::Off);
  const auto surface =
      test::prepare(test::world_of_rasters({Source::get().file}, kSize_m), num_threads);
  const world::TileStore store =
      tiler::run_tile_stage(*surface, flight_over(*surface), world_folder,
                            {.log = log, .num_threads = num_threads, .events_file = {}});
  std::vector<world::TileId> ids;
  for (const world::TileInfo& info : store.manifest().tiles) ids.push_back(info.id);
  return ids;
}

/// A raster in memory, looked up where it is.
struct Heights {
  int width = 0;
  int height = 0;
  std::array<double, 6> gt = {};
  std::vector<float> values;

  explicit Heights(const std::filesystem::path& file) {
    GDALDataset* dataset = GDALDataset::FromHandle(GDALOpen(file.c_str(), GA_ReadOnly));
    width = dataset->GetRasterXSize();
    height = dataset->GetRasterYSize();
    dataset->GetGeoTransform(gt.data());
    values.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    if (dataset->GetRasterBand(1)->RasterIO(GF_Read, 0, 0, width, height, values.data(), width,
                                            height, GDT_Float32, 0, 0, nullptr) != CE_None)
      std::abort();
    GDALClose(dataset);
  }

  float at(double u, double v) const {
    const double x = std::clamp((u - gt[0]) / gt[1] - 0.5, 0.0, width - 1.001);
    const double y = std::clamp((v - gt[3]) / gt[5] - 0.5, 0.0, height - 1.001);
    const auto i = static_cast<std::size_t>(x);
    const auto j = static_cast<std::size_t>(y);
    const auto fx = static_cast<float>(x - static_cast<double>(i));
    const auto fy = static_cast<float>(y - static_cast<double>(j));
    const float* row = values.data() + j * static_cast<std::size_t>(width) + i;
    const float* below = row + width;
    return (row[0] * (1.0F - fx) + row[1] * fx) * (1.0F - fy) +
           (below[0] * (1.0F - fx) + below[1] * fx) * fy;
  }
};

void read_and_commit(const std::vector<world::TileId>& ids) {
  const Source& source = Source::get();
  const Heights heights(source.file);
  const RTCDevice device = rtcNewDevice(nullptr);
  core::parallel_for_blocks(
      static_cast<std::int64_t>(ids.size()), 1, [&](std::int64_t begin, std::int64_t) {
        const world::TileId& id = ids[static_cast<std::size_t>(begin)];
        const RTCScene scene = rtcNewScene(device);
        const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_GRID);
        constexpr std::size_t kVertices =
            static_cast<std::size_t>(world::kTileSamples) * world::kTileSamples;
        auto* vertex = static_cast<float*>(rtcSetNewGeometryBuffer(
            geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, kVertices));
        auto* grid = static_cast<RTCGrid*>(rtcSetNewGeometryBuffer(
            geometry, RTC_BUFFER_TYPE_GRID, 0, RTC_FORMAT_GRID, sizeof(RTCGrid), 1));
        *grid = {0, world::kTileSamples, world::kTileSamples, world::kTileSamples};
        const Eigen::Vector2d corner = id.corner_world();
        for (int j = 0; j < world::kTileSamples; ++j) {
          for (int i = 0; i < world::kTileSamples; ++i) {
            const double x = i * id.spacing_m();
            const double y = j * id.spacing_m();
            *vertex++ = static_cast<float>(x);
            *vertex++ = static_cast<float>(y);
            *vertex++ =
                heights.at(source.middle.x() + corner.x() + x, source.middle.y() + corner.y() + y);
          }
        }
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene, geometry);
        rtcReleaseGeometry(geometry);
        rtcSetSceneFlags(
            scene, static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_COMPACT));
        rtcCommitScene(scene);
        benchmark::DoNotOptimize(scene);
        rtcReleaseScene(scene);
      });
  rtcReleaseDevice(device);
}

void tiling(benchmark::State& state) {
  const int num_threads = static_cast<int>(state.range(0));
  const core::ThreadLimit limit(num_threads);
  double ours_s = 0.0;
  double bare_s = 0.0;
  double tiles = 0.0;
  Source::get();
  for ([[maybe_unused]] const auto _ : state) {
    const bench::Folder folder("tiling-bench");
    const double start = bench::cpu_seconds();
    const std::vector<world::TileId> ids = tile(folder.path() / "world", num_threads);
    const double between = bench::cpu_seconds();
    read_and_commit(ids);
    ours_s += between - start;
    bare_s += bench::cpu_seconds() - between;
    tiles += static_cast<double>(ids.size());
  }
  state.counters["ratio"] = bare_s / ours_s;
  state.counters["tiles"] = tiles / static_cast<double>(state.iterations());
  state.counters["tiles_cpu_s"] = tiles / ours_s;
  state.counters["Mtri_cpu_s"] = 1e-6 * tiles * kTrianglesPerTile / ours_s;
  state.counters["bare_Mtri_cpu_s"] = 1e-6 * tiles * kTrianglesPerTile / bare_s;
}

BENCHMARK(tiling)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();

}  // namespace
