// Depth: how far along the optical axis what a pixel shows lies before the camera, whatever its model; of a rolling
// shutter before the camera at the time of the pixel's line. Of fisheyes and panoramas it is below 0 behind the camera.
// Where rays start at many places, it counts from the plane in which they do.
//
// An OpenEXR file an image: depth.Z (float, m), +inf of the sky, NaN of pixels without a ray.

#include "labels/facts_images.h"

namespace terracast::labels {
namespace {

LabelFiles make_depth(const LabelInputs& inputs) {
  return make_facts_images(
      inputs, {.kind = "depth",
               .extension = ".exr",
               .channels = {{"depth.Z",
                             "float, m along the optical axis; below 0 behind the camera, which "
                             "wide models see; +inf sky, NaN no ray"}},
               .encode = [](const FactsImage& image) {
                 const core::ImageF depth_m =
                     capture::depth_image(image.view.model, image.facts.range_m);
                 return image.exr({{.name = "depth.Z",
                                    .type = core::ExrChannel::Type::Float,
                                    .values_float = depth_m.data()}});
               }});
}

}  // namespace

LabelInfo depth_label() {
  return {.name = "depth",
          .summary = "Depth of every pixel along the optical axis, of every camera model.",
          .make = []() -> std::unique_ptr<LabelMaker> {
            return std::make_unique<PlainLabel>(make_depth);
          }};
}

}  // namespace terracast::labels
