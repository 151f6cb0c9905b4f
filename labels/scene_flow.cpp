// Scene flow: how what a pixel shows moves until the next frame, in space, and whether that frame shows it.
//
// An OpenEXR file a pair of frames: scene_flow.x, .y, .z (float, m, world's axes) and sight (uint), as `pairs` have them
// (labels/pair_label.h). scene_flow.json, written last, says which there are.

#include "labels/motion_label.h"

namespace terracast::labels {
namespace {

class SceneFlowLabel final : public MotionLabel {
 public:
  SceneFlowLabel() : MotionLabel({1}) {}
  std::unique_ptr<LabelMaker> clone() const override {
    return std::make_unique<SceneFlowLabel>(*this);
  }

 private:
  std::string kind() const override { return "scene_flow"; }
  ChannelMeanings meanings() const override {
    return {{"scene_flow.x .y .z", kSceneFlowMeaning}, {"sight", kSightMeaning}};
  }
  std::vector<core::ExrChannel> channels(const PairRoute&, int, int,
                                         PairImage& pair) const override {
    using Type = core::ExrChannel::Type;
    return {{.name = "scene_flow.x", .type = Type::Float, .values_float = pair.scene_flow[0]},
            {.name = "scene_flow.y", .type = Type::Float, .values_float = pair.scene_flow[1]},
            {.name = "scene_flow.z", .type = Type::Float, .values_float = pair.scene_flow[2]},
            {.name = "sight", .type = Type::Uint, .values_uint = pair.sight}};
  }
};

}  // namespace

LabelInfo scene_flow_label() {
  return {
      .name = "scene_flow",
      .summary = "Motion in space of what every pixel shows, to the next frame.",
      .make = []() -> std::unique_ptr<LabelMaker> { return std::make_unique<SceneFlowLabel>(); }};
}

}  // namespace terracast::labels
