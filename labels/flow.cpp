// Optical flow of every camera to its next and its previous frame, with what is hidden and by what, what leaves the view,
// and what is not there then.
//
// An OpenEXR file a pair of frames: flow.x and flow.y (float, px), sight and occluder (uint), as `pairs` have them
// (labels/pair_label.h). flow.json, written last, says which there are.

#include "labels/motion_label.h"

namespace terracast::labels {
namespace {

class FlowLabel final : public MotionLabel {
 public:
  FlowLabel() : MotionLabel({1, -1}) {}
  std::unique_ptr<LabelMaker> clone() const override { return std::make_unique<FlowLabel>(*this); }

 private:
  std::string kind() const override { return "flow"; }
  ChannelMeanings meanings() const override {
    return {{"flow.x .y", kFlowMeaning}, {"sight", kSightMeaning}, {"occluder", kOccluderMeaning}};
  }
  std::vector<core::ExrChannel> channels(const PairRoute&, int, int,
                                         PairImage& pair) const override {
    using Type = core::ExrChannel::Type;
    return {{.name = "flow.x", .type = Type::Float, .values_float = pair.flow_x},
            {.name = "flow.y", .type = Type::Float, .values_float = pair.flow_y},
            {.name = "occluder", .type = Type::Uint, .values_uint = pair.occluder},
            {.name = "sight", .type = Type::Uint, .values_uint = pair.sight}};
  }
};

}  // namespace

LabelInfo flow_label() {
  return {.name = "flow",
          .summary =
              "Optical flow to the next and the previous frame, with what is hidden and by what, "
              "and what is out of view.",
          .make = []() -> std::unique_ptr<LabelMaker> { return std::make_unique<FlowLabel>(); }};
}

}  // namespace terracast::labels
