// Where what one image shows is in another, for every pixel: of two cameras of a rig, or of one at two times. Of a
// rectified pair the disparity is -flow.x.
//
// An OpenEXR file a pair: flow.x and flow.y (float, px, from the pixel's centre to where its point is in the other
// image), sight (uint: 0 the sky or not within the other image, 1 within it but hidden, 2 seen), occluder (uint: the
// instance that hides what is hidden; 0 the ground) and scene_flow.x, .y, .z (float, m, world's axes: to where the point
// is at the time of the other frame). Without a place in the other image flow is NaN; of the sky scene flow is NaN.
// pairs.json, written last, says which pairs there are and what each of them is.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "capture/labels.h"
#include "capture/object_labels.h"
#include "capture/sequence_files.h"
#include "core/error.h"
#include "core/json.h"
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
using core::Json;
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

/// Both cameras of "RIG/NAME RIG/NAME".
std::array<std::string, 2> names_of_pair(const std::string& pair) {
  const std::size_t blank = pair.find(' ');
  const std::array names = {pair.substr(0, blank),
                            blank == std::string::npos ? std::string() : pair.substr(blank + 1)};
  for (const std::string& name : names)
    if (std::count(name.begin(), name.end(), '/') != 1 || name.front() == '/' ||
        name.back() == '/' || name.find(' ') != std::string::npos)
      fail(ErrorKind::Config, "pairs: cameras: \"{}\" is no pair; \"RIG/NAME RIG/NAME\" is right",
           pair);
  return names;
}

/// What tells one image of a pair from the other.
std::string_view difference_of(bool is_other_camera, bool is_other_frame) {
  if (!is_other_frame) return "camera";
  return is_other_camera ? "camera and frame" : "frame";
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

  void validate() const override {
    if (frames_apart_.empty())
      fail(ErrorKind::Config, "pairs: frames_apart is empty; 0 is the same frame");
    for (const std::string& pair : cameras_) {
      const std::array<std::string, 2> names = names_of_pair(pair);
      if (names[0] == names[1] && is_of_one_time())
        fail(ErrorKind::Config,
             "pairs: cameras: \"{}\" with frames_apart = 0 is each image with itself; give the "
             "frames apart, as frames_apart = [1], or another camera",
             pair);
    }
  }
  std::unique_ptr<LabelMaker> clone() const override { return std::make_unique<PairsLabel>(*this); }

  void check(std::span<const SequenceOutline> sequences, const core::Log& log) const override {
    bool has_pair = sequences.empty() || !is_of_one_time();
    const SequenceOutline* longest = nullptr;
    for (const SequenceOutline& sequence : sequences) {
      has_pair = has_other_camera(wanted_cameras(sequence.cameras)) || has_pair;
      if (longest == nullptr || sequence.num_frames > longest->num_frames) longest = &sequence;
    }
    if (!has_pair)
      fail(ErrorKind::Config,
           "pairs: no camera has another beside it on its rig, and frames_apart is 0: there is no "
           "pair; give frames_apart = [1], or name cameras of several rigs");
    for (const std::int64_t apart : frames_apart_)
      for (const SequenceOutline& sequence : sequences) {
        if (std::abs(apart) < sequence.num_frames) continue;
        if (std::abs(apart) >= longest->num_frames)
          fail(ErrorKind::Config,
               "pairs: frames_apart = {}: no sequence is so long; the longest, {}, has {} frames",
               apart, longest->name, longest->num_frames);
        log.warn("pairs: frames_apart = {}: sequence {} has {} frames, and so no such pair", apart,
                 sequence.name, sequence.num_frames);
      }
  }

  LabelFiles make(const LabelInputs& inputs) const override {
    const capture::SequenceReader& sequence = inputs.sequence;
    const std::map<int, std::vector<int>> others = wanted_cameras(sequence.info().cameras);
    const Matcher matcher(sequence, inputs.store, inputs.moving);
    const std::string source = capture::labels_source(sequence);
    const auto num_frames = static_cast<int>(sequence.frames().size());
    if (!has_other_camera(others) && is_of_one_time())
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
    return write_index(sequence, others, source);
  }

 private:
  bool is_of_one_time() const {
    return std::all_of(frames_apart_.begin(), frames_apart_.end(),
                       [](std::int64_t apart) { return apart == 0; });
  }

  static bool has_other_camera(const std::map<int, std::vector<int>>& others) {
    return std::any_of(others.begin(), others.end(), [](const auto& of_camera) {
      return std::any_of(of_camera.second.begin(), of_camera.second.end(),
                         [&](int second) { return second != of_camera.first; });
    });
  }

  /// By the first camera.
  std::map<int, std::vector<int>> wanted_cameras(
      const std::vector<capture::CameraCalibration>& cameras) const {
    std::map<int, std::vector<int>> wanted;
    for (const std::string& pair : cameras_) {
      const std::array<std::string, 2> names = names_of_pair(pair);
      wanted[find_camera(cameras, names[0])].push_back(find_camera(cameras, names[1]));
    }
    if (!cameras_.empty()) return wanted;
    for (std::size_t a = 0; a < cameras.size(); ++a)
      for (std::size_t b = 0; b < cameras.size(); ++b)
        if (cameras[a].rig == cameras[b].rig)
          wanted[static_cast<int>(a)].push_back(static_cast<int>(b));
    return wanted;
  }

  static ImageOf image_apart(const ImageOf& from, std::int64_t apart, int camera) {
    return {static_cast<int>(from.frame + apart), camera};
  }

  static bool is_pair(const capture::SequenceReader& sequence, const ImageOf& from,
                      const ImageOf& to) {
    return to.frame >= 0 && to.frame < static_cast<int>(sequence.frames().size()) && to != from;
  }

  static std::string name_of(const std::vector<capture::CameraCalibration>& cameras,
                             const ImageOf& from, const ImageOf& to) {
    return fmt::format(
        "{}/{}/{:06}_{:06}.exr", camera_name(cameras[static_cast<std::size_t>(from.camera)]),
        camera_name(cameras[static_cast<std::size_t>(to.camera)]), from.frame, to.frame);
  }

  /// All files, that of the index itself among them.
  LabelFiles write_index(const capture::SequenceReader& sequence,
                         const std::map<int, std::vector<int>>& others,
                         const std::string& source) const {
    const auto& cameras = sequence.info().cameras;
    LabelFiles all = {"pairs.json"};
    Json pairs = Json::array();
    for (const auto& [first, seconds] : others)
      for (const int second : std::set(seconds.begin(), seconds.end()))
        for (const std::int64_t apart : std::set(frames_apart_.begin(), frames_apart_.end())) {
          Json files = Json::array();
          std::size_t num_files = 0;
          for (int frame = 0; frame < static_cast<int>(sequence.frames().size()); ++frame) {
            const ImageOf from{frame, first}, to = image_apart(from, apart, second);
            if (!is_pair(sequence, from, to)) continue;
            const std::string name = name_of(cameras, from, to);
            all.insert(name);
            files.push(name);
            ++num_files;
          }
          if (num_files == 0) continue;
          pairs.push(
              Json::object()
                  .set("camera", camera_name(cameras[static_cast<std::size_t>(first)]))
                  .set("other_camera", camera_name(cameras[static_cast<std::size_t>(second)]))
                  .set("frames_apart", apart)
                  .set("differs_in", difference_of(first != second, apart != 0))
                  .set("files", std::move(files)));
        }
    Json index = Json::object();
    index.set("format", "terracast pairs")
        .set("version", 1)
        .set("capture", source)
        .set("pairs", std::move(pairs));
    index.write(sequence.folder() / capture::kLabelsFolder / "pairs/pairs.json");
    return all;
  }

  /// All pairs of which an image is the first.
  void make_image(const capture::SequenceReader& sequence, const Matcher& matcher,
                  const ImageOf& from, const std::vector<int>& seconds,
                  const std::string& source) const {
    const auto& cameras = sequence.info().cameras;
    const geo::CameraIntrinsics& image = cameras[static_cast<std::size_t>(from.camera)].intrinsics;
    std::vector<ImageOf> missing;
    const auto file_of = [&](const ImageOf& to) {
      return sequence.folder() / capture::kLabelsFolder / "pairs" / name_of(cameras, from, to);
    };
    for (const int second : seconds)
      for (const std::int64_t apart : frames_apart_) {
        const ImageOf to = image_apart(from, apart, second);
        if (is_pair(sequence, from, to) &&
            !is_label_image_done(file_of(to), source, image, "occluder"))
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
