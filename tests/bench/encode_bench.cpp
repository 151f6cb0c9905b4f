// CPU time and size of what a camera writes for one 1280 x 720 frame: colour as PNG, all facts as
// EXR.
//
//     terracast_bench --benchmark_filter=^encode --benchmark_repetitions=5
//
// The frame is like land from 400 m, seen 30 degrees down: every pixel of the ground has its own
// range and colour, normals and ids change from triangle to triangle (2 to 4 pixels), a tenth of
// the image is sky.

#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdint>

#include "capture/channel.h"
#include "capture/frame.h"
#include "capture/frame_writer.h"
#include "core/hash.h"
#include "core/image_io.h"
#include "core/random.h"

namespace {

using namespace terracast;

constexpr int kWidth = 1280;
constexpr int kHeight = 720;
constexpr double kFocalLength_px = 1000.0;
constexpr double kHeight_m = 400.0;

double unit_noise(std::uint32_t stream, std::int64_t x, std::int64_t y) {
  const std::uint64_t index = static_cast<std::uint64_t>(x) << 32 ^ static_cast<std::uint32_t>(y);
  return static_cast<double>(core::content_hash64(std::as_bytes(std::span(&index, 1))) +
                             stream * 0x9e3779b97f4a7c15ULL) *
         0x1p-64;
}

capture::CameraFrame make_frame() {
  capture::CameraFrame frame;
  frame.color = core::Image8(kWidth, kHeight, 3);
  frame.range_m = core::ImageF(kWidth, kHeight, 1, capture::kSkyRange_m);
  frame.normal_world = core::ImageF(kWidth, kHeight, 3);
  frame.semantic_id = core::ImageU32(kWidth, kHeight);
  frame.instance_id = core::ImageU32(kWidth, kHeight);
  frame.primitive_id = core::ImageU32(kWidth, kHeight, 1, capture::kNoPrimitive);
  frame.flags = core::ImageU32(kWidth, kHeight);
  const double pitch_rad = std::asin(0.5) * 0.55;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double right = (x + 0.5 - kWidth / 2.0) / kFocalLength_px;
      const double down = (y + 0.5 - kHeight / 2.0) / kFocalLength_px;
      const double forward_level = std::cos(pitch_rad) - down * std::sin(pitch_rad);
      const double sink = std::sin(pitch_rad) + down * std::cos(pitch_rad);
      if (sink < 0.004) {
        for (int k = 0; k < 3; ++k)
          frame.color(x, y, k) = static_cast<std::uint8_t>(120 + 20 * k + y / 8);
        continue;
      }
      const double t = kHeight_m / sink;
      const double ground_x = t * forward_level, ground_y = t * right;
      // A cell of the level of detail that serves this distance: 2 to 4 pixels.
      const double cell_m = std::exp2(std::floor(std::log2(3.0 * t / kFocalLength_px)));
      const double cell_x = std::floor(ground_x / cell_m), cell_y = std::floor(ground_y / cell_m);
      const double in_x = ground_x / cell_m - cell_x, in_y = ground_y / cell_m - cell_y;
      const auto ix = static_cast<std::int64_t>(cell_x), iy = static_cast<std::int64_t>(cell_y);
      const std::uint32_t upper = in_x + in_y > 1.0 ? 1 : 0;
      const double slope_x = unit_noise(1, 2 * ix + upper, iy) - 0.5;
      const double slope_y = unit_noise(2, 2 * ix + upper, iy) - 0.5;
      const double rise_m = cell_m * (slope_x * in_x + slope_y * in_y) +
                            20.0 * std::sin(ground_x / 300.0) * std::cos(ground_y / 170.0);
      const double ray = std::sqrt(1.0 + right * right + down * down);
      frame.range_m(x, y) = static_cast<float>((t - rise_m) * ray);
      const double length = std::sqrt(1.0 + slope_x * slope_x + slope_y * slope_y);
      frame.normal_world(x, y, 0) = static_cast<float>(-slope_x / length);
      frame.normal_world(x, y, 1) = static_cast<float>(-slope_y / length);
      frame.normal_world(x, y, 2) = static_cast<float>(1.0 / length);
      const double patch = std::sin(ground_x / 90.0) + std::cos(ground_y / 70.0) + slope_x;
      frame.semantic_id(x, y) = patch > 0.6 ? 3 : patch > -0.5 ? 5 : 6;
      const auto tile_x = static_cast<std::uint32_t>(ix >> 8) & 7;
      const auto tile_y = static_cast<std::uint32_t>(iy >> 8) & 7;
      frame.primitive_id(x, y) = (tile_y << 3 | tile_x) << 17 |
                                 (static_cast<std::uint32_t>(iy) & 255) << 9 |
                                 (static_cast<std::uint32_t>(ix) & 255) << 1 | upper;
      const bool is_hidden = unit_noise(3, ix / 8, iy / 8) < 0.02;
      frame.flags(x, y) = (is_hidden ? 0 : capture::kVisibleNext | capture::kVisiblePrevious) |
                          (x > 60 ? capture::visible_in_camera(1) : 0) |
                          (unit_noise(4, x, y) < 0.002 ? 1U : 0U);
      for (int k = 0; k < 3; ++k)
        frame.color(x, y, k) =
            static_cast<std::uint8_t>(90.0 + 15.0 * k + 20.0 * patch + 30.0 * unit_noise(5, x, y) +
                                      20.0 * unit_noise(6, ix, iy));
    }
  }
  return frame;
}

const capture::CameraFrame& frame() {
  static const capture::CameraFrame the_frame = make_frame();
  return the_frame;
}

template <class Encode>
void measure(benchmark::State& state, Encode encode) {
  frame();
  std::size_t num_bytes = 0;
  for (auto _ : state) num_bytes = encode();
  state.counters["MB"] = static_cast<double>(num_bytes) * 1e-6;
  state.counters["ns_per_px"] =
      benchmark::Counter(1e-9 * kWidth * kHeight, benchmark::Counter::kIsIterationInvariantRate |
                                                      benchmark::Counter::kInvert);
}

void encode_color(benchmark::State& state) {
  measure(state, [] { return capture::encode_color(frame()).size(); });
}
BENCHMARK(encode_color)->Unit(benchmark::kMillisecond);

void encode_facts(benchmark::State& state) {
  measure(state, [] { return capture::encode_facts(frame()).size(); });
}
BENCHMARK(encode_facts)->Unit(benchmark::kMillisecond);

/// What a camera costs in all: both files and their hashes.
void encode_camera_frame(benchmark::State& state) {
  measure(state, [] {
    const std::vector<std::byte> png = capture::encode_color(frame());
    const std::vector<std::byte> exr = capture::encode_facts(frame());
    benchmark::DoNotOptimize(core::content_hash(png));
    benchmark::DoNotOptimize(core::content_hash(exr));
    return png.size() + exr.size();
  });
}
BENCHMARK(encode_camera_frame)->Unit(benchmark::kMillisecond);

/// The facts again under each of the container's lossless schemes: the choice that encode_facts
/// makes.
void encode_facts_by_compression(benchmark::State& state) {
  using core::ExrPart;
  const auto scheme = static_cast<ExrPart::Compression>(state.range(0));
  core::ExrImage decoded = core::decode_exr(capture::encode_facts(frame()), "facts").front();
  ExrPart part;
  part.width = decoded.width;
  part.height = decoded.height;
  part.compression = scheme;
  for (const capture::ChannelInfo& channel : capture::channels()) {
    if (channel.is_optional) continue;
    core::ExrChannel& entry = part.channels.emplace_back();
    entry.name = channel.name;
    if (channel.type == "uint") {
      entry.type = core::ExrChannel::Type::Uint;
      entry.values_uint = decoded.uint_channels.at(entry.name).data();
    } else {
      entry.type =
          channel.type == "half" ? core::ExrChannel::Type::Half : core::ExrChannel::Type::Float;
      entry.values_float = decoded.float_channels.at(entry.name).data();
    }
  }
  static constexpr const char* kNames[] = {"none", "rle", "zips"};
  state.SetLabel(kNames[state.range(0)]);
  measure(state, [&] { return core::encode_exr({part}).size(); });
}
BENCHMARK(encode_facts_by_compression)->DenseRange(0, 2)->Unit(benchmark::kMillisecond);

}  // namespace
