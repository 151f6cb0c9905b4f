// Where what one image shows is in another, for every pixel: of two cameras of a rig, or of one at two times, or of
// cameras of two sequences. Of a rectified pair the disparity is -flow.x.
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
#include "capture/sequence_files.h"
#include "core/log.h"
#include "core/progress.h"
#include "core/stop.h"
#include "render/labels/label.h"
#include "render/labels/label_image.h"
#include "render/labels/pair_cameras.h"
#include "render/labels/pair_sight.h"

namespace terracast::render {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;

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
        "Pairs of cameras, each as \"RIG/NAME RIG/NAME\", of every sequence, or "
        "\"SEQUENCE/RIG/NAME SEQUENCE/RIG/NAME\", of two that show each other: what the first "
        "shows is looked for in the second. Empty: every camera with every other of its rig.");
    visit.key("frames_apart", frames_apart_,
              "How many frames after the first camera's image that of the second is.",
              core::between(-1000000, 1000000));
  }
  std::unique_ptr<LabelMaker> clone() const override { return std::make_unique<PairsLabel>(*this); }

  void validate() const override { static_cast<void>(camera_pairs()); }

  void check(const JobOutline& job) const override {
    check_camera_pairs(camera_pairs(), frames_apart_, job);
  }

  void make(const LabelInputs& inputs) const override {
    check(outline_of(inputs));
    for (const auto& [name, seconds] : wanted_cameras(inputs)) {
      const capture::SequenceReader* other = nullptr;
      for (const capture::SequenceReader& one : inputs.job.sequences)
        if (one.info().name == name && name != inputs.sequence.info().name) other = &one;
      if (other == nullptr) warn_without_others(seconds, inputs);
      make_images(inputs, seconds, PairSight(inputs, other));
    }
  }

 private:
  /// Cameras that are second, by the first.
  using Seconds = std::map<int, std::vector<int>>;

  std::vector<CameraPair> camera_pairs() const {
    std::vector<CameraPair> pairs;
    for (const std::string& text : cameras_) pairs.push_back(parse_camera_pair(text));
    return pairs;
  }

  static JobOutline outline_of(const LabelInputs& inputs) {
    JobOutline job{.sequences = {}, .has_one_geometry = true};  // as PairSight finds
    const auto add = [&](const capture::SequenceReader& sequence) {
      job.sequences.push_back({sequence.info().name, {}, sequence.info().cameras});
      for (const capture::FrameRecord& frame : sequence.frames())
        job.sequences.back().times_s.push_back(frame.time_s);
    };
    if (inputs.job.sequences.empty()) add(inputs.sequence);
    for (const capture::SequenceReader& sequence : inputs.job.sequences) add(sequence);
    return job;
  }

  void warn_without_others(const Seconds& seconds, const LabelInputs& inputs) const {
    const bool has_others = std::any_of(seconds.begin(), seconds.end(), [](const auto& of_camera) {
      return std::any_of(of_camera.second.begin(), of_camera.second.end(),
                         [&](int second) { return second != of_camera.first; });
    });
    if (!has_others && std::all_of(frames_apart_.begin(), frames_apart_.end(),
                                   [](std::int64_t apart) { return apart == 0; }))
      inputs.context.log.warn(
          "{}: no camera has another beside it, and frames_apart is 0: no pairs",
          inputs.sequence.info().name);
  }

  /// By the second camera's sequence.
  std::map<std::string, Seconds> wanted_cameras(const LabelInputs& inputs) const {
    const std::string& own = inputs.sequence.info().name;
    const auto& cameras = inputs.sequence.info().cameras;
    std::map<std::string, Seconds> wanted;
    const auto cameras_of = [&](const std::string& name) -> const auto& {
      for (const capture::SequenceReader& one : inputs.job.sequences)
        if (one.info().name == name) return one.info().cameras;
      return cameras;
    };
    for (const CameraPair& pair : camera_pairs()) {
      if (!pair.from.sequence.empty() && pair.from.sequence != own) continue;
      const std::string& to = pair.is_across() ? pair.to.sequence : own;
      wanted[to][find_camera(cameras, pair.from.camera)].push_back(
          find_camera(cameras_of(to), pair.to.camera));
    }
    if (!cameras_.empty()) return wanted;
    Seconds& seconds = wanted[own];
    for (std::size_t a = 0; a < cameras.size(); ++a)
      for (std::size_t b = 0; b < cameras.size(); ++b)
        if (cameras[a].rig == cameras[b].rig)
          seconds[static_cast<int>(a)].push_back(static_cast<int>(b));
    return wanted;
  }

  void make_images(const LabelInputs& inputs, const Seconds& seconds,
                   const PairSight& sight) const {
    const auto num_frames = static_cast<int>(inputs.sequence.frames().size());
    core::Progress progress(inputs.context, "images",
                            num_frames * static_cast<std::int64_t>(seconds.size()));
    for (int frame = 0; frame < num_frames; ++frame)
      for (const auto& [camera, others] : seconds) {
        core::throw_if_stop_asked();
        make_image(inputs.sequence, sight, {frame, camera}, others);
        progress.advance();
      }
  }

  /// Of a pair's second camera, below the first's folder.
  static fs::path folder_of_second(const capture::SequenceReader& from,
                                   const capture::SequenceReader& to, int camera) {
    const fs::path folder = camera_name(to.info().cameras[static_cast<std::size_t>(camera)]);
    return &from == &to ? folder : to.info().name / folder;
  }

  /// All pairs of which an image is the first.
  void make_image(const capture::SequenceReader& sequence, const PairSight& sight,
                  const ImageOf& from, const std::vector<int>& seconds) const {
    const auto& cameras = sequence.info().cameras;
    const geo::CameraIntrinsics& image = cameras[static_cast<std::size_t>(from.camera)].intrinsics;
    std::vector<ImageOf> missing;
    const auto file_of = [&](const ImageOf& to) {
      return sequence.folder() / capture::kLabelsFolder / "pairs" /
             camera_name(cameras[static_cast<std::size_t>(from.camera)]) /
             folder_of_second(sequence, sight.to(), to.camera) /
             fmt::format("{:06}_{:06}.exr", from.frame, to.frame);
    };
    for (const int second : seconds)
      for (const std::int64_t apart : frames_apart_) {
        const std::int64_t frame = from.frame + apart;
        if (frame < 0 || frame >= static_cast<std::int64_t>(sight.to().frames().size())) continue;
        const ImageOf to{static_cast<int>(frame), second};
        if (&sight.to() == &sequence && to == from) continue;
        if (!is_label_image_done(file_of(to), sight.source(), image, "occluder"))
          missing.push_back(to);
      }
    if (missing.empty()) return;
    const std::vector<Eigen::Vector2i> pixels = all_pixels(image);
    std::vector<ShownPoint> points;
    std::vector<std::size_t> places;
    const std::vector<std::optional<ShownPoint>> shown = sight.points(from, pixels);
    for (std::size_t i = 0; i < shown.size(); ++i) {
      if (!shown[i]) continue;
      points.push_back(*shown[i]);
      places.push_back(i);
    }
    for (const ImageOf& to : missing) {
      PairImage pair(pixels.size());
      const std::vector<std::optional<Match>> matches = sight.find(points, to);
      for (std::size_t k = 0; k < matches.size(); ++k) {
        if (const auto motion_m = sight.motion(points[k], to.frame))
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
      write(pair, file_of(to), sight.source(), image);
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
