// Bottom: how long a pixel's ray is, straight on as if there were no water, to what lies below the water that it meets; of
// other pixels to what they show. To the bit as it was captured.
//
// An OpenEXR file an image: bottom_range_m (float, m), +inf of the sky, NaN of pixels without a ray.

#include "core/error.h"
#include "labels/facts_images.h"

namespace terracast::labels {
namespace {

LabelFiles make_bottom(const LabelInputs& inputs) {
  return make_facts_images(
      inputs,
      {.kind = "bottom",
       .extension = ".exr",
       .channels = {{"bottom_range_m",
                     "float, m along the pixel's ray in the world without water; +inf sky, NaN no "
                     "ray"}},
       .encode = [](const FactsImage& image) {
         if (image.facts.bottom_range_m.num_pixels() == 0)
           core::fail(core::ErrorKind::Input,
                      "camera {}/{}: the capture holds no bottom_range_m; render it with "
                      "conditions.bottom_range = true",
                      image.camera.rig, image.camera.name);
         return image.exr({{.name = "bottom_range_m",
                            .type = core::ExrChannel::Type::Float,
                            .values_float = image.facts.bottom_range_m.data()}});
       }});
}

class BottomLabel final : public PlainLabel {
 public:
  BottomLabel() : PlainLabel(make_bottom) {}
  std::unique_ptr<LabelMaker> clone() const override {
    return std::make_unique<BottomLabel>(*this);
  }
  void check(std::span<const SequenceOutline> sequences, const core::Log&) const override {
    for (const SequenceOutline& sequence : sequences)
      if (!sequence.has_bottom_range)
        core::fail(
            core::ErrorKind::Config,
            "labels \"bottom\" are made of bottom_range_m; state conditions.bottom_range = true");
  }
};

}  // namespace

LabelInfo bottom_label() {
  return {.name = "bottom",
          .summary = "Length of every pixel's ray to what lies below the water.",
          .make = []() -> std::unique_ptr<LabelMaker> { return std::make_unique<BottomLabel>(); }};
}

}  // namespace terracast::labels
