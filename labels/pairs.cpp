// Where what one image shows is in another, for every pixel: of two cameras of a rig, or of one at two times, or of
// cameras of two sequences. Of a rectified pair the disparity is -flow.x.
//
// An OpenEXR file a pair: flow.x and flow.y (float, px), sight and occluder (uint) and scene_flow.x, .y, .z (float, m), as
// labels/pair_label.h says. pairs.json, written last, says which pairs there are and what each of them is.

#include <algorithm>

#include "core/error.h"
#include "core/log.h"
#include "labels/pair_cameras.h"
#include "labels/pair_label.h"

namespace terracast::labels {
namespace {

using core::ErrorKind;
using core::fail;

class PairsLabel final : public PairLabel {
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
    const std::vector<CameraPair> pairs = parse_camera_pairs(cameras_);
    check_camera_pairs(pairs, frames_apart_, sequences, log);
    bool has_pair = sequences.empty() || !is_of_one_time() ||
                    std::any_of(pairs.begin(), pairs.end(),
                                [](const CameraPair& pair) { return pair.is_across(); });
    for (const SequenceOutline& sequence : sequences)
      has_pair = has_other_camera(wanted_within(sequence.name, sequence.cameras)) || has_pair;
    if (!has_pair)
      fail(ErrorKind::Config,
           "pairs: no camera has another beside it on its rig, and frames_apart is 0: there is no "
           "pair; give frames_apart = [1], or name cameras of several rigs");
    std::vector<SequenceOutline> with_pairs;
    for (const SequenceOutline& sequence : sequences)
      if (!wanted_within(sequence.name, sequence.cameras).empty()) with_pairs.push_back(sequence);
    check_frames_apart("pairs", frames_apart_, with_pairs, log);
  }

 private:
  std::string kind() const override { return "pairs"; }
  std::set<std::int64_t> frames_apart() const override {
    return {frames_apart_.begin(), frames_apart_.end()};
  }

  ChannelMeanings meanings() const override {
    return {{"flow.x .y", kFlowMeaning},
            {"sight", kSightMeaning},
            {"occluder", kOccluderMeaning},
            {"scene_flow.x .y .z", kSceneFlowMeaning}};
  }

  std::vector<core::ExrChannel> channels(const PairRoute&, int, int,
                                         PairImage& pair) const override {
    using Type = core::ExrChannel::Type;
    return {{.name = "flow.x", .type = Type::Float, .values_float = pair.flow_x},
            {.name = "flow.y", .type = Type::Float, .values_float = pair.flow_y},
            {.name = "occluder", .type = Type::Uint, .values_uint = pair.occluder},
            {.name = "scene_flow.x", .type = Type::Float, .values_float = pair.scene_flow[0]},
            {.name = "scene_flow.y", .type = Type::Float, .values_float = pair.scene_flow[1]},
            {.name = "scene_flow.z", .type = Type::Float, .values_float = pair.scene_flow[2]},
            {.name = "sight", .type = Type::Uint, .values_uint = pair.sight}};
  }

  bool is_of_one_time() const {
    return std::all_of(frames_apart_.begin(), frames_apart_.end(),
                       [](std::int64_t apart) { return apart == 0; });
  }

  static bool has_other_camera(const SecondCameras& others) {
    return std::any_of(others.begin(), others.end(), [](const auto& of_camera) {
      return std::any_of(of_camera.second.begin(), of_camera.second.end(),
                         [&](int second) { return second != of_camera.first; });
    });
  }

  /// Of a sequence's own cameras.
  SecondCameras wanted_within(const std::string& name,
                              const std::vector<capture::CameraCalibration>& cameras) const {
    if (!cameras_.empty()) return named_pairs(parse_camera_pairs(cameras_), name, cameras);
    SecondCameras wanted;
    for (std::size_t a = 0; a < cameras.size(); ++a)
      for (std::size_t b = 0; b < cameras.size(); ++b)
        if (cameras[a].rig == cameras[b].rig)
          wanted[static_cast<int>(a)].insert(static_cast<int>(b));
    return wanted;
  }

  std::vector<PairRoute> routes_of(const LabelInputs& inputs) const override {
    const capture::SequenceReader& own = inputs.sequence;
    tell_left_out(kind(), parse_camera_pairs(cameras_), inputs);
    std::vector<PairRoute> routes;
    SecondCameras within = wanted_within(own.info().name, own.info().cameras);
    if (!within.empty() && !has_other_camera(within) && is_of_one_time())
      inputs.context.log.warn(
          "{}: no camera has another beside it, and frames_apart is 0: no pairs", own.info().name);
    if (!within.empty()) routes.push_back({own, own, std::move(within)});
    for (const capture::SequenceReader& other : inputs.job.sequences) {
      SecondCameras seconds;
      for (const CameraPair& pair : parse_camera_pairs(cameras_))
        if (pair.is_across() && pair.from.sequence == own.info().name &&
            pair.to.sequence == other.info().name)
          seconds[find_camera(own.info().cameras, pair.from.camera)].insert(
              find_camera(other.info().cameras, pair.to.camera));
      if (!seconds.empty()) routes.push_back({own, other, std::move(seconds)});
    }
    return routes;
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

}  // namespace terracast::labels
