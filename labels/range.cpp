// Range: how long a pixel's ray is from where it starts (of most models the centre of projection) to what it shows, to
// the bit as it was captured.
//
// An OpenEXR file an image: range_m (float, m), +inf of the sky, NaN of pixels without a ray.

#include "labels/facts_images.h"

namespace terracast::labels {
namespace {

LabelFiles make_range(const LabelInputs& inputs) {
  return make_facts_images(
      inputs, {.kind = "range",
               .extension = ".exr",
               .channels = {{"range_m", "float, m along the pixel's ray; +inf sky, NaN no ray"}},
               .encode = [](const FactsImage& image) {
                 return image.exr({{.name = "range_m",
                                    .type = core::ExrChannel::Type::Float,
                                    .values_float = image.facts.range_m.data()}});
               }});
}

}  // namespace

LabelInfo range_label() {
  return {.name = "range",
          .summary = "Length of every pixel's ray to what it shows.",
          .make = []() -> std::unique_ptr<LabelMaker> {
            return std::make_unique<PlainLabel>(make_range);
          }};
}

}  // namespace terracast::labels
