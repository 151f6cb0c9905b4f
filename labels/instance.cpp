// Which object each pixel shows.
//
// An OpenEXR file an image: instance_id (uint, 32 bits), the same in all images of a sequence, and of what stands in all of
// a world; 0 of the ground, the sky and pixels without a ray. instance.json says what the objects are.

#include "core/semantic_class.h"
#include "labels/facts_images.h"
#include "labels/objects_of_sequence.h"

namespace terracast::labels {
namespace {

core::Json list_of(const std::vector<ShownObject>& objects) {
  core::Json list = core::Json::array();
  for (const ShownObject& object : objects) {
    const capture::LabelledObject& label = object.label;
    core::Json one = core::Json::object();
    one.set("id", static_cast<std::int64_t>(label.instance_id))
        .set("class", core::semantic_class_names()[static_cast<std::size_t>(label.semantic_class)]);
    if (label.is_moving())
      one.set("moving", label.moving);
    else
      one.set("layer", label.layer);
    if (!label.prototype.empty()) one.set("prototype", label.prototype);
    list.push(std::move(one));
  }
  return list;
}

LabelFiles make_instance(const LabelInputs& inputs) {
  return make_facts_images(
      inputs,
      {.kind = "instance",
       .extension = ".exr",
       .channels = {{"instance_id", "uint: id of one of `instances`; 0 ground, sky and no ray"}},
       .encode =
           [](const FactsImage& image) {
             return image.exr({{.name = "instance_id",
                                .type = core::ExrChannel::Type::Uint,
                                .values_uint = image.facts.instance_id.data()}});
           }},
      [&](core::Json& index) { index.set("instances", list_of(objects_of_sequence(inputs))); });
}

}  // namespace

LabelInfo instance_label() {
  return {.name = "instance",
          .summary = "Object that every pixel shows, and a table of the objects.",
          .make = []() -> std::unique_ptr<LabelMaker> {
            return std::make_unique<PlainLabel>(make_instance);
          }};
}

}  // namespace terracast::labels
