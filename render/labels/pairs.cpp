// Where what one image shows is in another, for every pixel: of two cameras of a rig, or of one at two times. Of a
// rectified pair the disparity is -flow.x.
//
// An OpenEXR file a pair: flow.x and flow.y (float, px, from the pixel's centre to where its point is in the other
// image), sight (uint: 0 the sky or not within the other image, 1 within it but hidden, 2 seen), occluder (uint: the
// instance that hides what is hidden; 0 the ground) and scene_flow.x, .y, .z (float, m, world's axes: to where the point
// is at the time of the other frame). Without a place in the other image flow is NaN; of the sky scene flow is NaN.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "capture/labels.h"
#include "capture/object_labels.h"
#include "capture/sequence_files.h"
#include "core/error.h"
#include "core/log.h"
#include "core/progress.h"
#include "core/registry.h"
#include "core/stop.h"
#include "render/labels/label.h"
#include "render/labels/label_image.h"
#include "render/labels/matches.h"

namespace terracast::render {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;
using Eigen::Vector2d;

std::string camera_name(const capture::CameraCalibration& camera) {
  return camera.rig + "/" + camera.name;
}

int find_camera(const std::vector<capture::CameraCalibration>& cameras, const std::string& name) {
  std::vector<std::string> names;
  for (const capture::CameraCalibration& camera : cameras) names.push_back(camera_name(camera));
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end())
    fail(ErrorKind::Config, "{}", core::unknown_name_message("camera", name, names));
  return static_cast<int>(found - names.begin());
}

std::vector<Eigen::Vector2i> all_pixels(const geo::CameraIntrinsics& image) {
  std::vector<Eigen::Vector2i> pixels;
  for (int y = 0; y < image.height_px; ++y)
    for (int x = 0; x < image.width_px; ++x) pixels.emplace_back(x, y);
  return pixels;
}

/// Of all pixels of an image, row by row.
struct PairImage {
  explicit PairImage(std::size_t num_pixels)
      : flow_x(num_pixels, std::numeric_limits<float>::quiet_NaN()),
        flow_y(flow_x),
        scene_flow({flow_x, flow_x, flow_x}),
        sight(num_pixels, 0),
        occluder(num_pixels, 0) {}
  std::vector<float> flow_x, flow_y;
  std::array<std::vector<float>, 3> scene_flow;
  std::vector<std::uint32_t> sight, occluder;
};

class PairsLabel final : public LabelMaker {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key(
        "cameras", cameras_,
        "Pairs of cameras, each as \"RIG/NAME RIG/NAME\": what the first shows is looked for in "
        "the second. Empty: every camera with every other of its rig.");
    visit.key("frames_apart", frames_apart_,
              "How many frames after the first camera's image that of the second is.",
              core::between(-1000000, 1000000));
  }
  std::unique_ptr<LabelMaker> clone() const override { return std::make_unique<PairsLabel>(*this); }

  void make(const LabelInputs& inputs) const override {
    const capture::SequenceReader& sequence = inputs.sequence;
    const std::map<int, std::vector<int>> others = wanted_cameras(sequence.info().cameras);
    const Matcher matcher(sequence, inputs.store, inputs.moving);
    const std::string source = capture::labels_source(sequence);
    const auto num_frames = static_cast<int>(sequence.frames().size());
    const bool has_others = std::any_of(others.begin(), others.end(), [](const auto& of_camera) {
      return std::any_of(of_camera.second.begin(), of_camera.second.end(),
                         [&](int second) { return second != of_camera.first; });
    });
    if (!has_others && std::all_of(frames_apart_.begin(), frames_apart_.end(),
                                   [](std::int64_t apart) { return apart == 0; }))
      inputs.context.log.warn(
          "{}: no camera has another beside it, and frames_apart is 0: no pairs",
          sequence.info().name);
    core::Progress progress(inputs.context, "images",
                            num_frames * static_cast<std::int64_t>(others.size()));
    for (int frame = 0; frame < num_frames; ++frame)
      for (const auto& [camera, seconds] : others) {
        core::throw_if_stop_asked();
        make_image(sequence, matcher, {frame, camera}, seconds, source);
        progress.advance();
      }
  }

 private:
  /// By the first camera.
  std::map<int, std::vector<int>> wanted_cameras(
      const std::vector<capture::CameraCalibration>& cameras) const {
    std::map<int, std::vector<int>> wanted;
    for (const std::string& pair : cameras_) {
      const std::size_t blank = pair.find(' ');
      if (blank == std::string::npos)
        fail(ErrorKind::Config, "pairs: cameras: \"{}\" is no pair; \"RIG/NAME RIG/NAME\" is right",
             pair);
      wanted[find_camera(cameras, pair.substr(0, blank))].push_back(
          find_camera(cameras, pair.substr(blank + 1)));
    }
    if (!cameras_.empty()) return wanted;
    for (std::size_t a = 0; a < cameras.size(); ++a)
      for (std::size_t b = 0; b < cameras.size(); ++b)
        if (cameras[a].rig == cameras[b].rig)
          wanted[static_cast<int>(a)].push_back(static_cast<int>(b));
    return wanted;
  }

  /// All pairs of which an image is the first.
  void make_image(const capture::SequenceReader& sequence, const Matcher& matcher,
                  const ImageOf& from, const std::vector<int>& seconds,
                  const std::string& source) const {
    const auto& cameras = sequence.info().cameras;
    const geo::CameraIntrinsics& image = cameras[static_cast<std::size_t>(from.camera)].intrinsics;
    std::vector<ImageOf> missing;
    const auto file_of = [&](const ImageOf& to) {
      return sequence.folder() / capture::kLabelsFolder / "pairs" /
             camera_name(cameras[static_cast<std::size_t>(from.camera)]) /
             camera_name(cameras[static_cast<std::size_t>(to.camera)]) /
             fmt::format("{:06}_{:06}.exr", from.frame, to.frame);
    };
    for (const int second : seconds)
      for (const std::int64_t apart : frames_apart_) {
        const std::int64_t frame = from.frame + apart;
        if (frame < 0 || frame >= static_cast<std::int64_t>(sequence.frames().size())) continue;
        const ImageOf to{static_cast<int>(frame), second};
        if (to != from && !is_label_image_done(file_of(to), source, image, "occluder"))
          missing.push_back(to);
      }
    if (missing.empty()) return;
    const std::vector<Eigen::Vector2i> pixels = all_pixels(image);
    std::vector<ShownPoint> points;
    std::vector<std::size_t> places;
    const std::vector<std::optional<ShownPoint>> shown = matcher.points(from, pixels);
    for (std::size_t i = 0; i < shown.size(); ++i) {
      if (!shown[i]) continue;
      points.push_back(*shown[i]);
      places.push_back(i);
    }
    for (const ImageOf& to : missing) {
      PairImage pair(pixels.size());
      const std::vector<std::optional<Match>> matches = matcher.find(points, to);
      for (std::size_t k = 0; k < matches.size(); ++k) {
        if (const auto motion_m = matcher.motion(points[k], to.frame))
          for (int axis = 0; axis < 3; ++axis)
            pair.scene_flow[static_cast<std::size_t>(axis)][places[k]] =
                static_cast<float>((*motion_m)[axis]);
        if (!matches[k]) continue;
        const Eigen::Vector2i& pixel = pixels[places[k]];
        const Vector2d flow = matches[k]->pixel - capture::pixel_center(pixel.x(), pixel.y());
        pair.flow_x[places[k]] = static_cast<float>(flow.x());
        pair.flow_y[places[k]] = static_cast<float>(flow.y());
        pair.sight[places[k]] = matches[k]->is_visible ? 2 : 1;
        pair.occluder[places[k]] = matches[k]->occluder_id;
      }
      write(pair, file_of(to), source, image);
    }
  }

  static void write(const PairImage& pair, const fs::path& file, const std::string& source,
                    const geo::CameraIntrinsics& image) {
    using Type = core::ExrChannel::Type;
    write_label_image(
        file, source, image, "pair",
        {{.name = "flow.x", .type = Type::Float, .values_float = pair.flow_x},
         {.name = "flow.y", .type = Type::Float, .values_float = pair.flow_y},
         {.name = "occluder", .type = Type::Uint, .values_uint = pair.occluder},
         {.name = "scene_flow.x", .type = Type::Float, .values_float = pair.scene_flow[0]},
         {.name = "scene_flow.y", .type = Type::Float, .values_float = pair.scene_flow[1]},
         {.name = "scene_flow.z", .type = Type::Float, .values_float = pair.scene_flow[2]},
         {.name = "sight", .type = Type::Uint, .values_uint = pair.sight}});
  }

  std::vector<std::string> cameras_;
  std::vector<std::int64_t> frames_apart_ = {0};
};

}  // namespace

LabelInfo pairs_label() {
  return {.name = "pairs",
          .summary =
              "Where every pixel's point is in another camera's image or frame, whether it is seen "
              "there, what hides it, and how it moves.",
          .make = []() -> std::unique_ptr<LabelMaker> { return std::make_unique<PairsLabel>(); }};
}

}  // namespace terracast::render
