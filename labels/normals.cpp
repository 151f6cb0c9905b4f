// Normals of what pixels show, of length 1, toward the side that is seen: along the world's axes, along the camera's (x
// right, y down, z forward; of a rolling shutter as the camera stands when the pixel's line is exposed), or both. The
// capture holds them as halves: a direction is good to 0.03 degrees.
//
// An OpenEXR file an image: normal_camera.x, .y, .z and normal_world.x, .y, .z (float), NaN of the sky and of pixels
// without a ray.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "labels/facts_images.h"

namespace terracast::labels {
namespace {

using Eigen::Vector3d;

constexpr std::array<std::string_view, 2> kFrames = {"camera", "world"};

/// x, y and z of all pixels.
using Planes = std::array<std::vector<float>, 3>;

Planes normals_of(const FactsImage& image, bool is_in_camera) {
  const core::ImageF& normal_world = image.facts.normal_world;
  Planes planes;
  planes.fill(
      std::vector<float>(normal_world.num_pixels(), std::numeric_limits<float>::quiet_NaN()));
  std::size_t place = 0;
  for (int y = 0; y < normal_world.height(); ++y)
    for (int x = 0; x < normal_world.width(); ++x, ++place) {
      if (!std::isfinite(image.facts.range_m(x, y))) continue;
      Vector3d normal(static_cast<double>(normal_world(x, y, 0)),
                      static_cast<double>(normal_world(x, y, 1)),
                      static_cast<double>(normal_world(x, y, 2)));
      if (is_in_camera)
        normal = image.view.pose_of_line(capture::pixel_center(x, y)).rotation.conjugate() * normal;
      normal.normalize();
      for (std::size_t axis = 0; axis < 3; ++axis)
        planes[axis][place] = static_cast<float>(normal[static_cast<int>(axis)]);
    }
  return planes;
}

class NormalsLabel final : public LabelMaker {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("frames", frames_, "Along whose axes: world, camera, or both.",
              {.choices = {kFrames.begin(), kFrames.end()}, .min_size = 1, .max_size = 2});
  }
  std::unique_ptr<LabelMaker> clone() const override {
    return std::make_unique<NormalsLabel>(*this);
  }

  LabelFiles make(const LabelInputs& inputs) const override {
    FactsImages images{.kind = "normals", .extension = ".exr"};
    if (has("camera"))
      images.channels.emplace_back(
          "normal_camera.x .y .z",
          "float, unit vector: x right, y down, z forward; NaN sky and no ray");
    if (has("world"))
      images.channels.emplace_back(
          "normal_world.x .y .z",
          "float, unit vector along the world's axes: x east, y north, z up at its origin; NaN sky "
          "and no ray");
    images.encode = [this](const FactsImage& image) { return encode(image); };
    return make_facts_images(inputs, images);
  }

 private:
  bool has(std::string_view frame) const {
    return std::find(frames_.begin(), frames_.end(), frame) != frames_.end();
  }

  std::vector<std::byte> encode(const FactsImage& image) const {
    std::array<Planes, kFrames.size()> planes;
    std::vector<core::ExrChannel> channels;
    for (std::size_t frame = 0; frame < kFrames.size(); ++frame) {
      if (!has(kFrames[frame])) continue;
      planes[frame] = normals_of(image, kFrames[frame] == "camera");
      for (std::size_t axis = 0; axis < 3; ++axis)
        channels.push_back({.name = fmt::format("normal_{}.{}", kFrames[frame], "xyz"[axis]),
                            .type = core::ExrChannel::Type::Float,
                            .values_float = planes[frame][axis]});
    }
    return image.exr(std::move(channels));
  }

  std::vector<std::string> frames_ = {"world", "camera"};
};

}  // namespace

LabelInfo normals_label() {
  return {.name = "normals",
          .summary = "Normal of every pixel's surface, along the axes of the world or the camera.",
          .make = []() -> std::unique_ptr<LabelMaker> { return std::make_unique<NormalsLabel>(); }};
}

}  // namespace terracast::labels
