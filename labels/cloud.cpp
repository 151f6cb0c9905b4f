// What a sequence saw, as points: where the rays of its pixels met the world, one to a voxel, the one seen from nearest.
// What moves is no part of it.

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <tuple>
#include <unordered_map>

#include "capture/labels.h"
#include "capture/object_labels.h"
#include "capture/sequence_files.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/instance_id.h"
#include "core/json.h"
#include "core/log.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "labels/finished.h"
#include "labels/label.h"
#include "labels/voxel.h"

namespace terracast::labels {
namespace {

namespace fs = std::filesystem;
using core::Json;
using Eigen::Vector3d;

struct CloudPoint {
  Vector3d place_world;
  std::array<float, 3> normal_world;
  std::array<std::uint8_t, 3> color;
  std::uint8_t semantic_class = 0;
  std::uint32_t instance_id = 0;
  float range_m = 0.0F;
};

using Cloud = std::unordered_map<Voxel, CloudPoint, VoxelHash>;

/// Keeps the point seen from nearer; of two as near the first.
void put(Cloud& cloud, const Voxel& voxel, const CloudPoint& point) {
  const auto [known, is_new] = cloud.emplace(voxel, point);
  if (!is_new && point.range_m < known->second.range_m) known->second = point;
}

/// Of one image, and how many pixels were left out because what they show moves.
struct ImageCloud {
  Cloud points;
  std::int64_t num_moving = 0;
};

ImageCloud cloud_of_image(const capture::SequenceReader& sequence, int frame, int camera,
                          double voxel_m) {
  const auto model =
      geo::make_camera(sequence.info().cameras[static_cast<std::size_t>(camera)].intrinsics);
  const capture::CameraView view = sequence.view(*model, frame, camera);
  const capture::CameraFrame facts = sequence.read_camera(frame, camera);
  ImageCloud cloud;
  for (int y = 0; y < facts.range_m.height(); ++y) {
    for (int x = 0; x < facts.range_m.width(); ++x) {
      const float range_m = facts.range_m(x, y);
      if (!std::isfinite(range_m)) continue;  // sky, or no ray
      if (core::is_moving_id(facts.instance_id(x, y))) {
        ++cloud.num_moving;
        continue;
      }
      CloudPoint point{
          .place_world = capture::point_world(view, capture::pixel_center(x, y), double{range_m}),
          .normal_world = {},
          .color = {},
          .semantic_class = static_cast<std::uint8_t>(facts.semantic_id(x, y)),
          .instance_id = facts.instance_id(x, y),
          .range_m = range_m};
      for (int k = 0; k < 3; ++k) {
        const auto i = static_cast<std::size_t>(k);
        point.normal_world[i] = facts.normal_world(x, y, k);
        point.color[i] = facts.color(x, y, k);
      }
      put(cloud.points, voxel_of(point.place_world, voxel_m), point);
    }
  }
  return cloud;
}

/// Little-endian, whatever the machine.
template <class Value>
void append(std::string& text, Value value) {
  static_assert(std::endian::native == std::endian::little);
  std::array<char, sizeof value> bytes;
  std::memcpy(bytes.data(), &value, sizeof value);
  text.append(bytes.data(), bytes.size());
}

std::string ply_text(const capture::SequenceInfo& info, const Cloud& cloud) {
  std::vector<const Cloud::value_type*> points;
  points.reserve(cloud.size());
  for (const Cloud::value_type& entry : cloud) points.push_back(&entry);
  std::sort(points.begin(), points.end(),
            [](const auto* a, const auto* b) { return a->first < b->first; });
  std::string text = fmt::format(
      "ply\nformat binary_little_endian 1.0\n"
      "comment what sequence {} saw\n"
      "comment x east, y north, z up, m, at latitude {} longitude {} height {} of WGS84\n"
      "element vertex {}\n"
      "property double x\nproperty double y\nproperty double z\n"
      "property float nx\nproperty float ny\nproperty float nz\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\n"
      "property uchar class\nproperty uint instance\nproperty float range\nend_header\n",
      info.name, info.origin.lat_deg, info.origin.lon_deg, info.origin.height_m, points.size());
  constexpr std::size_t kPointBytes = 3 * 8 + 3 * 4 + 4 + 4 + 4;
  text.reserve(text.size() + kPointBytes * points.size());
  for (const auto* entry : points) {
    const CloudPoint& point = entry->second;
    for (int k = 0; k < 3; ++k) append(text, point.place_world[k]);
    for (const float value : point.normal_world) append(text, value);
    for (const std::uint8_t value : point.color) append(text, value);
    append(text, point.semantic_class);
    append(text, point.instance_id);
    append(text, point.range_m);
  }
  return text;
}

class CloudLabel final : public LabelMaker {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("voxel_m", voxel_m_,
              "Side of the voxels, of each of which the point seen from nearest is kept.",
              core::between(0.001, 10000.0));
  }
  std::unique_ptr<LabelMaker> clone() const override { return std::make_unique<CloudLabel>(*this); }

  LabelFiles make(const LabelInputs& inputs) const override {
    const capture::SequenceReader& sequence = inputs.sequence;
    const fs::path folder = sequence.folder() / capture::kLabelsFolder / "cloud";
    const fs::path record = folder / "cloud.json";
    const fs::path file = folder / "cloud.ply";
    const LabelFiles files = {"cloud.json", "cloud.ply"};
    Json wanted = Json::object();
    wanted.set("format", "terracast cloud")
        .set("version", 1)
        .set("capture", capture::labels_source(sequence))
        .set("voxel_m", voxel_m_);
    if (is_label_finished(record, file, wanted)) {
      inputs.context.log.info("{}: its cloud is there already", sequence.info().name);
      return files;
    }
    const ImageCloud cloud = cloud_of(sequence, inputs.context);
    const std::string text = ply_text(sequence.info(), cloud.points);
    core::write_file(file, text);
    wanted.set("points", static_cast<std::int64_t>(cloud.points.size()));
    if (!sequence.info().moving.empty()) wanted.set("moving_pixels_left_out", cloud.num_moving);
    wanted.set("xxh3_128", core::content_hash(text));
    wanted.write(record);
    inputs.context.log.info("{}: {} points", file.string(), cloud.points.size());
    return files;
  }

 private:
  ImageCloud cloud_of(const capture::SequenceReader& sequence, const core::Context& context) const {
    const auto num_cameras = static_cast<std::int64_t>(sequence.info().cameras.size());
    const std::int64_t num_images =
        num_cameras * static_cast<std::int64_t>(sequence.frames().size());
    constexpr int kAhead = 16;  // clouds of images in memory
    std::vector<ImageCloud> clouds(static_cast<std::size_t>(num_images));
    ImageCloud all;
    core::Progress progress(context, "images", num_images);
    core::parallel_in_order(
        num_images, kAhead,
        [&](std::int64_t i) {
          clouds[static_cast<std::size_t>(i)] =
              cloud_of_image(sequence, static_cast<int>(i / num_cameras),
                             static_cast<int>(i % num_cameras), voxel_m_);
        },
        [&](std::int64_t i) {
          ImageCloud& own = clouds[static_cast<std::size_t>(i)];
          for (const auto& [voxel, point] : own.points) put(all.points, voxel, point);
          all.num_moving += own.num_moving;
          own = ImageCloud();
          progress.advance();
        });
    return all;
  }

  double voxel_m_ = 0.25;
};

}  // namespace

LabelInfo cloud_label() {
  return {
      .name = "cloud",
      .summary = "What was seen, as a PLY of points with normals, colors, classes and instances.",
      .make = []() -> std::unique_ptr<LabelMaker> { return std::make_unique<CloudLabel>(); }};
}

}  // namespace terracast::labels
