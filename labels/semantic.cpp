// Classes of what pixels show.
//
// A grey PNG of 8 bits an image: the number of the class (configs/classes.toml); sky and pixels without a ray have
// classes of their own. semantic.json has the table of classes.

#include "core/image_io.h"
#include "core/semantic_class.h"
#include "labels/facts_images.h"

namespace terracast::labels {
namespace {

static_assert(core::kNumSemanticClasses <= 256, "a class is 8 bits");

std::vector<std::byte> classes_png(const FactsImage& image) {
  const core::ImageU32& ids = image.facts.semantic_id;
  core::Image8 classes(ids.width(), ids.height());
  for (std::size_t i = 0; i < ids.data().size(); ++i)
    classes.data()[i] = static_cast<std::uint8_t>(ids.data()[i]);
  return core::encode_png(classes);
}

LabelFiles make_semantic(const LabelInputs& inputs) {
  return make_facts_images(inputs,
                           {.kind = "semantic",
                            .extension = ".png",
                            .channels = {{"grey", "8 bits: id of one of `classes`"}},
                            .encode = classes_png},
                           [](core::Json& index) { index.set("classes", classes_json()); });
}

}  // namespace

LabelInfo semantic_label() {
  return {.name = "semantic",
          .summary = "Class of every pixel, as PNG.",
          .make = []() -> std::unique_ptr<LabelMaker> {
            return std::make_unique<PlainLabel>(make_semantic);
          }};
}

}  // namespace terracast::labels
