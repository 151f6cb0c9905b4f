// Frames against Blender's Cycles on the processor: the same ground as a mesh, the same camera, sun
// and number of samples. Needs Debian's `blender`, and is skipped where that is missing.
//
//     build/bench/terracast_bench --benchmark_filter=cycles --benchmark_repetitions=3
//
// sample_ratio   wall time of a further sample a pixel: (17 samples - 1) / 16, Cycles' over ours
// frame_ratio    wall time of a warm frame with one sample a pixel and ground truth, written to disk:
//                Cycles' depth, normal, flow and object index; ours all facts, which are more
// depth_difference   median of |their depth - ours| / ours at one frame: both see the same view
// Both sides use two threads, uncompressed EXR and fast PNG; the scene is built before (cycles_first_s
// is Cycles' first frame, which builds its own). Cycles has one sun, no bounces, a diffuse ground
// with one noise texture; ours is the ground that every capture has.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <vector>

#include "capture/frame_writer.h"
#include "core/atomic_file.h"
#include "core/image_io.h"
#include "core/json.h"
#include "core/parallel.h"
#include "tests/bench/bench_support.h"
#include "tests/support/hills_flight.h"
#include "tests/world/mountains.h"

namespace {

using namespace terracast;

constexpr int kWidth = 1280;
constexpr int kHeight = 720;
constexpr double kFocalLength_px = kWidth;  // as test::small_rig has it
constexpr int kNumFrames = 6;
constexpr int kManySamples = 17;
constexpr int kNumThreads = 2;
/// Depths differ by this share at most, in the median: a hundredth of a pixel on ground that is seen
/// at 45 degrees (1 / 1280 a pixel); rounding to float takes 6e-8.
constexpr double kSameView = 1e-5;

render::SequencePlan flight(int num_samples) {
  render::SequencePlan plan = test::small_plan(kNumFrames, kWidth, kHeight);
  plan.cameras = test::small_rig(kWidth, kHeight, 25.0);
  plan.cameras.resize(1);
  plan.conditions.color_samples = num_samples;
  for (int i = 0; i < kNumFrames; ++i) {
    geo::BodyState& state = plan.states[static_cast<std::size_t>(i)];
    state.world_from_body.translation = {200.0 + 8.0 * i, 100.0,
                                         test::mountain_height_m(200.0, 100.0) + 300.0 + i};
  }
  return plan;
}

template <class T>
void append(std::ofstream& file, const std::vector<T>& values) {
  file.write(reinterpret_cast<const char*>(values.data()),
             static_cast<std::streamsize>(values.size() * sizeof(T)));
}

/// The tiles that the flight is rendered from, as triangles; returns how many.
std::int64_t write_mesh(const test::TracedPlan& scene, const std::filesystem::path& folder) {
  std::ofstream vertices(folder / "vertices.f32", std::ios::binary);
  std::ofstream triangles(folder / "triangles.i32", std::ios::binary);
  std::int32_t first = 0;
  for (const world::CutTile& cut : scene.query.cut()) {
    const world::Tile tile = scene.store.load(cut.id);
    const Eigen::Vector2d corner = cut.id.corner_world();
    std::vector<float> xyz;
    std::vector<std::int32_t> indices;
    for (int j = 0; j < world::kTileSamples; ++j)
      for (int i = 0; i < world::kTileSamples; ++i) {
        for (const double value : {corner.x() + i * cut.id.spacing_m(),
                                   corner.y() + j * cut.id.spacing_m(), tile.z_world(i, j)})
          xyz.push_back(static_cast<float>(value));
        if (i == world::kTileCells || j == world::kTileCells) continue;
        const std::int32_t at = first + static_cast<std::int32_t>(world::Tile::sample(i, j));
        const std::int32_t up = at + world::kTileSamples;
        for (const std::int32_t index : {at, at + 1, up, at + 1, up + 1, up})
          indices.push_back(index);
      }
    first += world::kTileSamples * world::kTileSamples;
    append(vertices, xyz);
    append(triangles, indices);
  }
  return static_cast<std::int64_t>(scene.query.cut().size()) * 2 * world::kTileCells *
         world::kTileCells;
}

void write_scene(const test::TracedPlan& scene, const std::filesystem::path& folder) {
  core::Json poses = core::Json::array();
  for (int frame = 0; frame < kNumFrames; ++frame) {
    const sensors::View& view = scene.renderer.views().at(frame, 0);
    core::Json rows = core::Json::array();
    for (int row = 0; row < 3; ++row)
      rows.push(
          core::Json::array_of({view.world_from_camera(row, 0), view.world_from_camera(row, 1),
                                view.world_from_camera(row, 2), view.center_world[row]}));
    rows.push(core::Json::array_of({0.0, 0.0, 0.0, 1.0}));
    poses.push(std::move(rows));
  }
  const Eigen::Vector3d& sun = scene.renderer.sky().daylight().sun_direction_world;
  core::Json::object()
      .set("width_px", kWidth)
      .set("height_px", kHeight)
      .set("focal_px", kFocalLength_px)
      .set("sun_direction_world", core::Json::array_of({sun.x(), sun.y(), sun.z()}))
      .set("world_from_camera", std::move(poses))
      .write(folder / "scene.json");
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

/// Median wall time of what is done for each frame but the first.
template <class Work>
double warm_s(const Work& work) {
  std::vector<double> times;
  for (int frame = 0; frame < kNumFrames; ++frame) {
    const double start = bench::wall_seconds();
    work(frame);
    if (frame > 0) times.push_back(bench::wall_seconds() - start);
  }
  return median(times);
}

/// Median difference of Cycles' depths from ours, as a share of them: that both see the same.
double depth_difference(const test::TracedPlan& scene, const std::filesystem::path& exr,
                        int frame) {
  const std::vector<core::ExrImage> parts = core::decode_exr(core::read_file(exr), exr.string());
  const core::ImageF& theirs = parts.at(0).float_channels.at("ViewLayer.Depth.Z");
  const sensors::View& view = scene.renderer.views().at(frame, 0);
  const sensors::TruthFrame truth = scene.renderer.truth(frame, 0);
  std::vector<double> differences;
  for (std::size_t i = 0; i < truth.range_m.size(); ++i) {
    if (std::isinf(truth.range_m[i])) continue;
    const double depth_m = view.camera_from_world(truth.point_world[i]).z();
    differences.push_back(std::abs(static_cast<double>(theirs.data()[i]) - depth_m) / depth_m);
  }
  TERRACAST_CHECK(!differences.empty(), "frame {} sees no ground", frame);
  return median(std::move(differences));
}

void cycles(benchmark::State& state) {
  if (std::system("blender --version >/dev/null 2>&1") != 0) {
    state.SkipWithError("there is no blender: apt-get install blender");
    return;
  }
  const core::ThreadLimit limit(kNumThreads);
  const bench::Folder folder("cycles-bench");
  const world::TileStore store = test::make_tiny_world(
      folder.path() / "world", test::mountain_height_m, test::mountain_options(4));
  const test::TracedPlan one(store, flight(1));
  const test::TracedPlan many(store, flight(kManySamples));
  const std::int64_t num_triangles = write_mesh(one, folder.path());
  write_scene(one, folder.path());
  const std::string command = "blender -b --factory-startup --python " TERRACAST_SOURCE_DIR
                              "/tests/bench/cycles/render.py -- " +
                              folder.path().string() + " " + std::to_string(kNumThreads) + " " +
                              std::to_string(kManySamples) + " >" + folder.path().string() +
                              "/blender.log 2>&1";
  for ([[maybe_unused]] const auto _ : state) {
    sensors::TruthFrame truth;
    const double ours_frame_s = warm_s([&](int frame) {
      one.renderer.truth(frame, 0, truth);
      truth.facts.color = one.renderer.color(frame, 0);
      core::write_file(folder.path() / "color.png", capture::encode_color(truth.facts));
      core::write_file(folder.path() / "facts.exr", capture::encode_facts(truth.facts));
    });
    const auto color_s = [&](const test::TracedPlan& scene) {
      return warm_s([&](int frame) {
        core::write_file(folder.path() / "color.png",
                         core::encode_png(scene.renderer.color(frame, 0)));
      });
    };
    const double ours_sample_s = (color_s(many) - color_s(one)) / (kManySamples - 1);
    if (std::system(command.c_str()) != 0) {
      state.SkipWithError("blender failed");
      return;
    }
    const double difference = depth_difference(
        one, folder.path() / ("1-1-" + std::to_string(kNumFrames - 1) + ".exr"), kNumFrames - 1);
    if (difference > kSameView) {
      state.SkipWithError("Cycles does not see what ours sees");
      return;
    }
    const core::Json times = core::Json::read(folder.path() / "times.json");
    const auto warm = [&](const char* series) {
      return median(times.at(series).at("warm_s").numbers());
    };
    const double sample_s = (warm("many") - warm("one")) / (kManySamples - 1);
    state.counters["sample_ratio"] = sample_s / ours_sample_s;
    state.counters["frame_ratio"] = warm("facts") / ours_frame_s;
    state.counters["ours_sample_ms"] = 1e3 * ours_sample_s;
    state.counters["cycles_sample_ms"] = 1e3 * sample_s;
    state.counters["ours_frame_ms"] = 1e3 * ours_frame_s;
    state.counters["cycles_frame_ms"] = 1e3 * warm("facts");
    state.counters["cycles_first_s"] = times.at("facts").at("first_s").number();
    state.counters["cycles_peak_MB"] = 1e-6 * times.at("peak_bytes").number();
    state.counters["ours_tiles_MB"] = 1e-6 * static_cast<double>(one.query.stats().bytes_resident);
    state.counters["depth_difference"] = difference;
    state.counters["Mtri"] = 1e-6 * static_cast<double>(num_triangles);
  }
}

BENCHMARK(cycles)->Iterations(1)->Unit(benchmark::kSecond)->UseRealTime();

}  // namespace
