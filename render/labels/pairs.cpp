// Where what one image shows is in another, for every pixel: of two cameras of a rig, or of one at two times, or of
// cameras of two sequences. Of a rectified pair the disparity is -flow.x.
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
#include "core/stop.h"
#include "render/labels/label.h"
#include "render/labels/label_image.h"
#include "render/labels/pair_cameras.h"
#include "render/labels/pair_sight.h"

namespace terracast::render {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;
using core::Json;
using Eigen::Vector2d;

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
        "Pairs of cameras, each as \"RIG/NAME RIG/NAME\", of every sequence that has both, or "
        "\"SEQUENCE/RIG/NAME SEQUENCE/RIG/NAME\", of two (which needs shared_geometry): what the "
        "first shows is looked for in the second. Empty: every camera with every other of its "
        "rig.");
    visit.key("frames_apart", frames_apart_,
              "How many frames after the first camera's image that of the second is.",
              core::between(-1000000, 1000000));
  }

  void validate() const override {
    if (frames_apart_.empty())
      fail(ErrorKind::Config, "pairs: frames_apart is empty; 0 is the same frame");
    for (const std::string& text : cameras_) {
      const CameraPair pair = parse_camera_pair(text);
      if (!pair.is_across() && pair.from.camera == pair.to.camera && is_of_one_time())
        fail(ErrorKind::Config,
             "pairs: cameras: \"{}\" with frames_apart = 0 is each image with itself; give the "
             "frames apart, as frames_apart = [1], or another camera",
             text);
    }
  }
  std::unique_ptr<LabelMaker> clone() const override { return std::make_unique<PairsLabel>(*this); }

  void check(std::span<const SequenceOutline> sequences, const core::Log& log) const override {
    const std::vector<CameraPair> pairs = camera_pairs();
    check_camera_pairs(pairs, frames_apart_, sequences);
    bool has_pair = sequences.empty() || !is_of_one_time() ||
                    std::any_of(pairs.begin(), pairs.end(),
                                [](const CameraPair& pair) { return pair.is_across(); });
    const SequenceOutline* longest = nullptr;  // of those that have pairs of their own
    for (const SequenceOutline& sequence : sequences) {
      const Seconds within = wanted_within(sequence.name, sequence.cameras);
      has_pair = has_other_camera(within) || has_pair;
      if (!within.empty() && (longest == nullptr || sequence.num_frames > longest->num_frames))
        longest = &sequence;
    }
    if (!has_pair)
      fail(ErrorKind::Config,
           "pairs: no camera has another beside it on its rig, and frames_apart is 0: there is no "
           "pair; give frames_apart = [1], or name cameras of several rigs");
    for (const std::int64_t apart : frames_apart_)
      for (const SequenceOutline& sequence : sequences) {
        if (std::abs(apart) < sequence.num_frames ||
            wanted_within(sequence.name, sequence.cameras).empty())
          continue;
        if (std::abs(apart) >= longest->num_frames)
          fail(ErrorKind::Config,
               "pairs: frames_apart = {}: no sequence is so long; the longest, {}, has {} frames",
               apart, longest->name, longest->num_frames);
        log.warn("pairs: frames_apart = {}: sequence {} has {} frames, and so no such pair", apart,
                 sequence.name, sequence.num_frames);
      }
  }

  LabelFiles make(const LabelInputs& inputs) const override {
    tell_left_out(inputs);
    const std::vector<Route> routes = routes_of(inputs);
    for (const Route& route : routes) make_images(inputs, route);
    return write_index(inputs.sequence, routes);
  }

 private:
  /// Cameras that are second, by the first.
  using Seconds = std::map<int, std::vector<int>>;

  /// From images of a sequence to its own, or to those of another.
  struct Route {
    const capture::SequenceReader& from;
    const capture::SequenceReader& to;
    Seconds seconds;
    bool is_across() const { return &from != &to; }
    const capture::CameraCalibration& first_camera(int camera) const {
      return from.info().cameras[static_cast<std::size_t>(camera)];
    }
    const capture::CameraCalibration& second_camera(int camera) const {
      return to.info().cameras[static_cast<std::size_t>(camera)];
    }
    bool has_pair(const ImageOf& first, const ImageOf& second) const {
      return second.frame >= 0 && second.frame < static_cast<int>(to.frames().size()) &&
             (is_across() || first != second);
    }
    /// Of the pair's file, in the folder of pairs.
    std::string name_of(const ImageOf& first, const ImageOf& second) const {
      return fmt::format("{}/{}{}/{:06}_{:06}.exr", camera_name(first_camera(first.camera)),
                         is_across() ? to.info().name + "/" : "",
                         camera_name(second_camera(second.camera)), first.frame, second.frame);
    }
  };

  std::vector<CameraPair> camera_pairs() const {
    std::vector<CameraPair> pairs;
    for (const std::string& text : cameras_) pairs.push_back(parse_camera_pair(text));
    return pairs;
  }

  bool is_of_one_time() const {
    return std::all_of(frames_apart_.begin(), frames_apart_.end(),
                       [](std::int64_t apart) { return apart == 0; });
  }

  static bool has_other_camera(const Seconds& others) {
    return std::any_of(others.begin(), others.end(), [](const auto& of_camera) {
      return std::any_of(of_camera.second.begin(), of_camera.second.end(),
                         [&](int second) { return second != of_camera.first; });
    });
  }

  /// Whether a pair is of the cameras of a sequence that carries all that pairs name.
  static bool is_of(const CameraPair& pair, const std::string& sequence) {
    return !pair.is_across() && (pair.from.sequence.empty() || pair.from.sequence == sequence);
  }

  /// Of pairs that other sequences have.
  /// throws   Config: none has
  void tell_left_out(const LabelInputs& inputs) const {
    const capture::SequenceInfo& own = inputs.sequence.info();
    const auto& all = inputs.job.sequences;
    for (const CameraPair& pair : camera_pairs()) {
      if (!is_of(pair, own.name) || has_cameras(own.cameras, pair)) continue;
      const bool has_any = std::any_of(all.begin(), all.end(), [&](const auto& sequence) {
        return has_cameras(sequence.info().cameras, pair);
      });
      if (!has_any)
        for (const PairEnd& end : {pair.from, pair.to}) find_camera(own.cameras, end.camera);
      inputs.context.log.info("pairs: sequence {} has not both {} and {}: without this pair",
                              own.name, pair.from.camera, pair.to.camera);
    }
  }

  /// Of a sequence's own cameras.
  Seconds wanted_within(const std::string& name,
                        const std::vector<capture::CameraCalibration>& cameras) const {
    Seconds wanted;
    for (const CameraPair& pair : camera_pairs())
      if (is_of(pair, name) && has_cameras(cameras, pair))
        wanted[find_camera(cameras, pair.from.camera)].push_back(
            find_camera(cameras, pair.to.camera));
    if (!cameras_.empty()) return wanted;
    for (std::size_t a = 0; a < cameras.size(); ++a)
      for (std::size_t b = 0; b < cameras.size(); ++b)
        if (cameras[a].rig == cameras[b].rig)
          wanted[static_cast<int>(a)].push_back(static_cast<int>(b));
    return wanted;
  }

  std::vector<Route> routes_of(const LabelInputs& inputs) const {
    const capture::SequenceReader& own = inputs.sequence;
    std::vector<Route> routes;
    Seconds within = wanted_within(own.info().name, own.info().cameras);
    if (!within.empty()) routes.push_back({own, own, std::move(within)});
    for (const capture::SequenceReader& other : inputs.job.sequences) {
      Seconds seconds;
      for (const CameraPair& pair : camera_pairs())
        if (pair.is_across() && pair.from.sequence == own.info().name &&
            pair.to.sequence == other.info().name)
          seconds[find_camera(own.info().cameras, pair.from.camera)].push_back(
              find_camera(other.info().cameras, pair.to.camera));
      if (!seconds.empty()) routes.push_back({own, other, std::move(seconds)});
    }
    return routes;
  }

  void make_images(const LabelInputs& inputs, const Route& route) const {
    if (!route.is_across() && !has_other_camera(route.seconds) && is_of_one_time())
      inputs.context.log.warn(
          "{}: no camera has another beside it, and frames_apart is 0: no pairs",
          inputs.sequence.info().name);
    const PairSight sight(inputs, route.is_across() ? &route.to : nullptr);
    const auto num_frames = static_cast<int>(route.from.frames().size());
    core::Progress progress(inputs.context, "images",
                            num_frames * static_cast<std::int64_t>(route.seconds.size()));
    for (int frame = 0; frame < num_frames; ++frame)
      for (const auto& [camera, seconds] : route.seconds) {
        core::throw_if_stop_asked();
        make_image(route, sight, {frame, camera}, seconds);
        progress.advance();
      }
  }

  static ImageOf image_apart(const ImageOf& from, std::int64_t apart, int camera) {
    return {static_cast<int>(from.frame + apart), camera};
  }

  /// All files, that of the index itself among them.
  LabelFiles write_index(const capture::SequenceReader& sequence,
                         const std::vector<Route>& routes) const {
    LabelFiles all = {"pairs.json"};
    Json pairs = Json::array();
    for (const Route& route : routes)
      for (const auto& [first, seconds] : route.seconds)
        for (const int second : std::set(seconds.begin(), seconds.end()))
          for (const std::int64_t apart : std::set(frames_apart_.begin(), frames_apart_.end()))
            list_files(route, first, second, apart, all, pairs);
    Json index = Json::object();
    index.set("format", "terracast pairs")
        .set("version", 1)
        .set("capture", capture::labels_source(sequence))
        .set("pairs", std::move(pairs));
    index.write(sequence.folder() / capture::kLabelsFolder / "pairs/pairs.json");
    return all;
  }

  /// Adds what there is of two cameras so many frames apart.
  static void list_files(const Route& route, int first, int second, std::int64_t apart,
                         LabelFiles& all, Json& pairs) {
    Json files = Json::array();
    std::size_t num_files = 0;
    for (int frame = 0; frame < static_cast<int>(route.from.frames().size()); ++frame) {
      const ImageOf from{frame, first}, to = image_apart(from, apart, second);
      if (!route.has_pair(from, to)) continue;
      const std::string name = route.name_of(from, to);
      all.insert(name);
      files.push(name);
      ++num_files;
    }
    if (num_files == 0) return;
    const bool is_other_camera = first != second || route.is_across();
    Json pair = Json::object();
    pair.set("camera", camera_name(route.first_camera(first)))
        .set("other_camera", camera_name(route.second_camera(second)));
    if (route.is_across())
      pair.set("other_sequence", route.to.info().name)
          .set("other_capture", capture::labels_source(route.to));
    pair.set("frames_apart", apart)
        .set("differs_in", difference_of(is_other_camera, apart != 0))
        .set("files", std::move(files));
    pairs.push(std::move(pair));
  }

  /// All pairs of which an image is the first.
  void make_image(const Route& route, const PairSight& sight, const ImageOf& from,
                  const std::vector<int>& seconds) const {
    const geo::CameraIntrinsics& image = route.first_camera(from.camera).intrinsics;
    std::vector<ImageOf> missing;
    const auto file_of = [&](const ImageOf& to) {
      return route.from.folder() / capture::kLabelsFolder / "pairs" / route.name_of(from, to);
    };
    for (const int second : seconds)
      for (const std::int64_t apart : frames_apart_) {
        const ImageOf to = image_apart(from, apart, second);
        if (route.has_pair(from, to) &&
            !is_label_image_done(file_of(to), sight.source(), image, "occluder"))
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
