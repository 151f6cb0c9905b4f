#include "world/embree_scene.h"

#include <embree3/rtcore.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <string_view>
#include <type_traits>

#include "core/error.h"
#include "world/lod.h"

namespace terracast::world {
namespace {

using core::ErrorKind;
using core::fail;

/// The ring adds one cell on each side; the count stays even, as GRID's blocks of two cells want
/// it.
constexpr int kRing = 1;
constexpr int kSceneSamples = kTileSamples + 2 * kRing;
constexpr std::size_t kFloatsPerSample = 3;

// Vertical error of the float arithmetic in a tile, in units of u M, where u = 2^-24 is half a
// float's last place and M the largest coordinate in the tile's frame (half the side, or the
// largest |z|):
//   origin rounded to float                 1 a coordinate
//   direction rounded, over a path <= 4 M   4
//   vertices minus origin                   2
//   edge and plane tests on products of these, 16 and less
// so about 23 u M in the position where a ray meets a triangle; slopes turn horizontal into
// vertical error, the steepest triangle's slope s another 23 s. Epsilon is four times the sum, and
// 2^8 u M = 2^-16 M in tiles less steep than 60 degrees. A cell is 2^-7 M wide in a flat tile, so
// that epsilon is 2^-9 of a cell: the walk passes it in one step.
constexpr double kHalfLastPlace = 0x1.0p-24;
constexpr double kErrorsOfPosition = 23.0;
constexpr double kSafety = 4.0;
constexpr double kLeastEpsilonPerExtent = 0x1.0p-16;
constexpr double kRingPerEpsilon = 4.0;

thread_local std::ptrdiff_t bytes_allocated_here = 0;

bool count_bytes(void*, ssize_t bytes, bool) {
  bytes_allocated_here += bytes;
  return true;
}

/// Embree takes a misspelt instruction set for its slowest one without a word, and "threads" would
/// limit the whole process: only these are let through.
void check_profile(const std::string& profile) {
  static constexpr std::array<std::string_view, 8> kKnown = {"isa=sse2",
                                                             "isa=sse4.2",
                                                             "isa=avx",
                                                             "isa=avx2",
                                                             "isa=avx512",
                                                             "frequency_level=simd128",
                                                             "frequency_level=simd256",
                                                             "frequency_level=simd512"};
  if (profile == "widest") return;
  std::size_t begin = 0;
  for (;;) {
    const std::size_t comma = std::min(profile.find(',', begin), profile.size());
    const std::string part = profile.substr(begin, comma - begin);
    if (std::find(kKnown.begin(), kKnown.end(), part) == kKnown.end())
      fail(ErrorKind::Config,
           "tracing.embree_profile = \"{}\": \"{}\" is none of widest, {}; parts are joined by "
           "commas without blanks",
           profile, part, fmt::join(kKnown, ", "));
    if (comma == profile.size()) return;
    begin = comma + 1;
  }
}

RTCDevice new_device(const std::string& profile) {
  check_profile(profile);
  return rtcNewDevice(profile == "widest" ? nullptr : profile.c_str());
}

[[noreturn]] void refuse_device(const std::string& profile, RTCError error) {
  if (error == RTC_ERROR_OUT_OF_MEMORY)
    fail(ErrorKind::Io,
         "out of memory while Embree starts; give the process more memory (ulimit -v), or fewer "
         "threads (--threads)");
  fail(ErrorKind::Config,
       "tracing.embree_profile = \"{}\": this machine or Embree cannot do it (error {}); "
       "\"widest\" always works",
       profile, static_cast<int>(error));
}

std::string profile_text(RTCDevice device, const std::string& asked, int packet_width) {
  return fmt::format("Embree {}.{}.{}, {}, packets of {}",
                     rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_VERSION_MAJOR),
                     rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_VERSION_MINOR),
                     rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_VERSION_PATCH), asked,
                     packet_width);
}

void check_embree(RTCDevice device, const char* doing) {
  const RTCError error = rtcGetDeviceError(device);
  if (error == RTC_ERROR_OUT_OF_MEMORY)
    fail(ErrorKind::Io, "out of memory while {}; lower tracing.memory_bytes", doing);
  TERRACAST_CHECK(error == RTC_ERROR_NONE, "Embree error {} while {}", static_cast<int>(error),
                  doing);
}

/// The largest rise a metre of a tile's triangles along x or y, both together.
double steepest_slope(const std::vector<std::int32_t>& half_steps, double spacing_m) {
  std::int64_t steepest = 0;
  for (int j = 0; j < kTileCells; ++j) {
    for (int i = 0; i < kTileCells; ++i) {
      const auto z = [&](int x, int y) {
        return std::int64_t{half_steps[Tile::sample(i + x, j + y)]};
      };
      const std::int64_t lower = std::abs(z(1, 0) - z(0, 0)) + std::abs(z(0, 1) - z(0, 0));
      const std::int64_t upper = std::abs(z(1, 1) - z(0, 1)) + std::abs(z(1, 1) - z(1, 0));
      steepest = std::max({steepest, lower, upper});
    }
  }
  return static_cast<double>(steepest) * (kHeightStep_m / 2.0) / spacing_m;
}

struct Release {
  void operator()(RTCGeometry geometry) const { rtcReleaseGeometry(geometry); }
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};
using GeometryHandle = std::unique_ptr<std::remove_pointer_t<RTCGeometry>, Release>;
using SceneHandle = std::unique_ptr<std::remove_pointer_t<RTCScene>, Release>;

int clamped_sample(int k) { return std::clamp(k - kRing, 0, kTileCells); }

}  // namespace

EmbreeDevice::EmbreeDevice(const std::string& profile)
    : device_(new_device(profile)), profile_asked_(profile) {
  if (device_ == nullptr) refuse_device(profile, rtcGetDeviceError(nullptr));
  rtcSetDeviceMemoryMonitorFunction(device_, count_bytes, nullptr);
  packet_width_ =
      rtcGetDeviceProperty(device_, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0 ? 16 : 8;
  profile_ = profile_text(device_, profile, packet_width_);
}

EmbreeDevice::~EmbreeDevice() { rtcReleaseDevice(device_); }

// Bytes of a triangle, by the 13 and more that it has in the file, when most is held: the file and
// its inflated bytes 26, the shape 16, what the tree is built of 100, its blocks 60 and nodes 20. Of an
// instance, by its 33: 66, the list 40, what the tree is built of 150, the tree 40. Strips and areas
// take less, but for the grids over them, which are bounded (paint_index.cpp) and far smaller than what
// a bare tile has to spare.
std::size_t TileScene::most_bytes_while_loading(std::size_t objects_bytes) {
  constexpr std::size_t kMostPerByte = 20;
  return kMostBytesWhileLoading + kMostPerByte * objects_bytes;
}

// Of objects that are shown, what they are built of beside what they keep: of a triangle 200 bytes beside 76,
// of an instance 530 beside 164, both with lists that have just grown to twice their size. Of those that
// are not, their bytes deflated, inflated and decoded.
std::size_t TileScene::most_bytes_while_loading(std::size_t objects_bytes,
                                                std::size_t scene_bytes) {
  constexpr std::size_t kMostPerByteUnshown = 4;
  constexpr std::size_t kMostPerByteKept = 4;
  return std::min(most_bytes_while_loading(objects_bytes), kMostBytesWhileLoading +
                                                               kMostPerByteUnshown * objects_bytes +
                                                               kMostPerByteKept * scene_bytes);
}

TileScene::TileScene(const EmbreeDevice& device, Tile tile, std::uint8_t coarser_sides,
                     const Eigen::Vector3d& frame_shift_m, const ObjectRules* rules)
    : id_(tile.id),
      center_world_(0.0, 0.0, tile.center_z_m),
      cover_(std::move(tile.cover)),
      moisture_(std::move(tile.moisture)),
      source_(std::move(tile.source)) {
  take_objects(tile, rules);
  build(device, stitched_half_steps(tile, coarser_sides), frame_shift_m);
}

TileScene::TileScene(const EmbreeDevice& device, const PackedTile& packed,
                     const Eigen::Vector3d& frame_shift_m)
    : id_(packed.id),
      objects_(packed.objects ? std::make_unique<const ObjectScene>(*packed.objects) : nullptr),
      paint_(packed.paint),
      center_world_(0.0, 0.0, packed.center_z_m),
      cover_(packed.cover.unpacked()),
      moisture_(packed.moisture.unpacked()),
      source_(packed.source.unpacked()) {
  build(device, packed.heights.unpacked(), frame_shift_m);
}

PackedTile TileScene::packed() const {
  std::vector<std::int32_t> half_steps;
  half_steps.reserve(static_cast<std::size_t>(kTileSamples) * kTileSamples);
  for (int j = 0; j < kTileSamples; ++j)
    for (int i = 0; i < kTileSamples; ++i)  // exact in Embree's floats
      half_steps.push_back(static_cast<std::int32_t>(grid_.z(i, j) * (2.0 / kHeightStep_m)));
  return {.id = id_,
          .center_z_m = center_world_.z(),
          .heights = PackedHeights(std::move(half_steps)),
          .cover = PackedBytes(cover_),
          .moisture = PackedBytes(moisture_),
          .source = PackedBytes(source_),
          .objects = objects_ != nullptr ? std::optional(objects_->packed()) : std::nullopt,
          .paint = paint_};
}

void TileScene::build(const EmbreeDevice& device, const std::vector<std::int32_t>& half_steps,
                      const Eigen::Vector3d& frame_shift_m) {
  center_world_.head<2>() = id_.center_world().head<2>();
  for (int axis = 0; axis < 2; ++axis)
    center_world_[axis] += std::fmod(frame_shift_m[axis], id_.spacing_m());
  const auto [lowest, highest] = std::minmax_element(half_steps.begin(), half_steps.end());
  const double half_step_m = kHeightStep_m / 2.0;
  highest_z_world_ = center_world_.z() + *highest * half_step_m;
  const double half_side_m = id_.side_m() / 2.0;
  const double extent_m =
      std::max({half_side_m, std::abs(*lowest * half_step_m), std::abs(*highest * half_step_m)});
  const double slope = steepest_slope(half_steps, id_.spacing_m());
  epsilon_m_ = extent_m * std::max(kLeastEpsilonPerExtent,
                                   kSafety * kErrorsOfPosition * (1.0 + slope) * kHalfLastPlace);
  const double ring_m = kRingPerEpsilon * epsilon_m_;

  const std::ptrdiff_t bytes_before = bytes_allocated_here;
  const GeometryHandle geometry(rtcNewGeometry(device.handle(), RTC_GEOMETRY_TYPE_GRID));
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
      geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
      kFloatsPerSample * sizeof(float), static_cast<std::size_t>(kSceneSamples) * kSceneSamples));
  auto* grid = static_cast<RTCGrid*>(rtcSetNewGeometryBuffer(
      geometry.get(), RTC_BUFFER_TYPE_GRID, 0, RTC_FORMAT_GRID, sizeof(RTCGrid), 1));
  check_embree(device.handle(), "building a tile's scene");
  *grid = {
      .startVertexID = 0, .stride = kSceneSamples, .width = kSceneSamples, .height = kSceneSamples};
  const Eigen::Vector2d corner = id_.corner_world();
  const auto place_tile = [&](int k, int axis) {
    const double place = corner[axis] + clamped_sample(k) * id_.spacing_m() - center_world_[axis];
    const double outward = k == 0 ? -ring_m : k == kSceneSamples - 1 ? ring_m : 0.0;
    return static_cast<float>(place + outward);
  };
  float* vertex = vertices;
  for (int j = 0; j < kSceneSamples; ++j) {
    for (int i = 0; i < kSceneSamples; ++i) {
      *vertex++ = place_tile(i, 0);
      *vertex++ = place_tile(j, 1);
      *vertex++ = static_cast<float>(
          half_steps[Tile::sample(clamped_sample(i), clamped_sample(j))] * half_step_m);
    }
  }
  rtcSetGeometryMask(geometry.get(), 0xffffffffU);
  rtcCommitGeometry(geometry.get());
  SceneHandle scene(rtcNewScene(device.handle()));
  rtcSetSceneFlags(scene.get(),
                   static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_COMPACT));
  rtcSetSceneBuildQuality(scene.get(), RTC_BUILD_QUALITY_MEDIUM);
  rtcAttachGeometryByID(scene.get(), geometry.get(), 0);
  // Tiles are built inside ray queries, which may run inside tasks. In an arena of its own the
  // building thread cannot pick up one of those tasks while it waits, which could wait for this
  // very tile.
  tbb::task_arena(1).execute([&] { rtcCommitScene(scene.get()); });
  const RTCError error = rtcGetDeviceError(device.handle());
  if (error != RTC_ERROR_NONE)
    fail(error == RTC_ERROR_OUT_OF_MEMORY ? ErrorKind::Io : ErrorKind::Internal,
         "Embree error {} while building the scene of tile {} ({}: out of memory; lower "
         "tracing.memory_bytes)",
         static_cast<int>(error), id_.name(), static_cast<int>(RTC_ERROR_OUT_OF_MEMORY));

  grid_ = {.z_tile = vertices + kFloatsPerSample * (kRing * kSceneSamples + kRing) + 2,
           .sample_stride = kFloatsPerSample,
           .row_stride = kFloatsPerSample * kSceneSamples,
           .corner_x_world = corner.x(),
           .corner_y_world = corner.y(),
           .center_z_m = center_world_.z(),
           .spacing_m = id_.spacing_m(),
           .inverse_spacing = 1.0 / id_.spacing_m()};
  find_entry_tops();
  num_bytes_ = static_cast<std::size_t>(bytes_allocated_here - bytes_before) + sizeof *this +
               cover_.size() + moisture_.size() + source_.size() +
               entry_tops_.size() * sizeof(double) +
               (objects_ != nullptr ? objects_->num_bytes() : 0) +
               (paint_ != nullptr ? paint_->num_bytes() : 0);
  scene_ = scene.release();
}

TileScene::~TileScene() { rtcReleaseScene(scene_); }

void TileScene::take_objects(Tile& tile, const ObjectRules* rules) {
  TileObjects& objects = tile.objects;
  if (!objects.strips.empty() || !objects.areas.empty())
    paint_ = std::make_shared<const PaintIndex>(tile.id, std::move(objects.strips),
                                                std::move(objects.areas));
  if (objects.solids.empty() && objects.instances.empty()) return;
  TERRACAST_CHECK(rules != nullptr, "tile {} has objects and no rules for them", tile.id.name());
  const double top_z_world = tile.center_z_m + tile.objects_top_steps * kHeightStep_m;
  objects_ = std::make_unique<const ObjectScene>(tile.id, objects, top_z_world, *rules,
                                                 fmt::format("tile {}", tile.id.name()));
  if (objects_->is_empty()) objects_.reset();
  objects = {};
}

void TileScene::find_entry_tops() {
  for (int side = 0; side < 4; ++side) {
    const int across = side % 2 == 0 ? 0 : kTileCells;
    for (int block = 0; block < kEntryBlocks; ++block) {
      double top = -std::numeric_limits<double>::infinity();
      for (int k = block * kEntryBlockCells; k <= (block + 1) * kEntryBlockCells; ++k)
        top = std::max(top, side < 2 ? grid_.z(across, k) : grid_.z(k, across));
      entry_tops_.push_back(center_world_.z() + top + 2.0 * clear_m());
    }
  }
  entry_tops_.insert(entry_tops_.end(), kEntryBlocks, highest_z_world_ + clear_m());
}

TileScene::NamedCell TileScene::cell_of(float u, float v) {
  const int x = static_cast<int>(u * static_cast<float>(kSceneSamples - 1)) - kRing;
  const int y = static_cast<int>(v * static_cast<float>(kSceneSamples - 1)) - kRing;
  return {std::clamp(x, 0, kTileCells - 1), std::clamp(y, 0, kTileCells - 1)};
}

}  // namespace terracast::world
