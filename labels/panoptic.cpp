// Panoptic images: every pixel has the number of a segment, which is a thing, or all of a class that cannot be counted.
//
// A PNG an image, number = red + 256 green + 65536 blue: 0 no ray; stuff has its class's id + 1; a thing 1000 + its place
// among the sequence's objects by instance id, the same in all images. Objects whose class cannot be counted are stuff.
// panoptic.json lists the segments of every image in the form of COCO's panoptic task, with our classes as categories.

#include <algorithm>

#include "capture/segments.h"
#include "core/error.h"
#include "core/image_io.h"
#include "core/semantic_class.h"
#include "labels/facts_images.h"
#include "labels/images.h"
#include "labels/objects_of_sequence.h"

namespace terracast::labels {
namespace {

using capture::kFirstThingSegment;
using core::Json;
using core::SemanticClass;

/// What numbers stand for in a sequence.
class SegmentTable {
 public:
  explicit SegmentTable(std::vector<ShownObject> objects) : objects_(std::move(objects)) {}

  std::uint32_t number_of(std::uint32_t instance_id, std::uint32_t pixel_class) const {
    if (instance_id == 0) return number_of_stuff(static_cast<SemanticClass>(pixel_class));
    const auto found = std::lower_bound(objects_.begin(), objects_.end(), instance_id,
                                        [](const ShownObject& one, std::uint32_t wanted) {
                                          return one.label.instance_id < wanted;
                                        });
    TERRACAST_CHECK(found != objects_.end() && found->label.instance_id == instance_id, "object {}",
                    instance_id);
    if (!core::semantic_classes()[static_cast<std::size_t>(found->label.semantic_class)].is_thing)
      return number_of_stuff(found->label.semantic_class);
    return kFirstThingSegment + static_cast<std::uint32_t>(found - objects_.begin());
  }

  Json describe(std::uint32_t number, const capture::Segment& segment) const {
    Json one = Json::object();
    one.set("id", static_cast<std::int64_t>(number))
        .set("category_id", static_cast<int>(class_of(number)))
        .set("area", segment.area)
        .set("bbox", Json::array()
                         .push(segment.left)
                         .push(segment.top)
                         .push(segment.right + 1 - segment.left)
                         .push(segment.bottom + 1 - segment.top))
        .set("iscrowd", 0);
    if (number >= kFirstThingSegment)
      one.set("instance_id",
              static_cast<std::int64_t>(objects_[number - kFirstThingSegment].label.instance_id));
    return one;
  }

 private:
  static std::uint32_t number_of_stuff(SemanticClass semantic_class) {
    return semantic_class == SemanticClass::Nothing
               ? 0
               : static_cast<std::uint32_t>(semantic_class) + 1;
  }
  SemanticClass class_of(std::uint32_t number) const {
    return number < kFirstThingSegment ? static_cast<SemanticClass>(number - 1)
                                       : objects_[number - kFirstThingSegment].label.semantic_class;
  }

  std::vector<ShownObject> objects_;  ///< by instance id
};

/// The members "images" and "annotations".
/// segments   of every image
void add_images(const capture::SequenceReader& sequence, std::vector<Json> segments, Json& index) {
  Json images = Json::array(), annotations = Json::array();
  const auto& cameras = sequence.info().cameras;
  for (std::size_t i = 0; i < segments.size(); ++i) {
    const capture::CameraCalibration& camera = cameras[i % cameras.size()];
    const auto frame = static_cast<int>(i / cameras.size());
    const std::string file = facts_image_path(camera, frame, ".png");
    images.push(Json::object()
                    .set("id", static_cast<std::int64_t>(i) + 1)
                    .set("file_name", file)
                    .set("width", camera.intrinsics.width_px)
                    .set("height", camera.intrinsics.height_px)
                    .set("frame", frame)
                    .set("camera", camera.rig + "/" + camera.name));
    annotations.push(Json::object()
                         .set("image_id", static_cast<std::int64_t>(i) + 1)
                         .set("file_name", file)
                         .set("segments_info", std::move(segments[i])));
  }
  index.set("images", std::move(images)).set("annotations", std::move(annotations));
}

LabelFiles make_panoptic(const LabelInputs& inputs) {
  std::vector<ShownObject> objects = objects_of_sequence(inputs);
  capture::check_num_things(objects.size(), "panoptic");
  const SegmentTable table(std::move(objects));
  std::vector<Json> segments(static_cast<std::size_t>(num_images(inputs.sequence)));
  const auto encode = [&](const FactsImage& image) {
    const core::ImageU32 numbers = capture::segment_numbers(
        image.facts, [&](std::uint32_t instance_id, std::uint32_t pixel_class) {
          return table.number_of(instance_id, pixel_class);
        });
    Json list = Json::array();
    for (const auto& [number, segment] : capture::segments_of(numbers))
      list.push(table.describe(number, segment));
    segments[static_cast<std::size_t>(image.number)] = std::move(list);
    return core::encode_png(capture::image_of_segments(numbers));
  };
  return make_facts_images(
      inputs,
      {.kind = "panoptic",
       .extension = ".png",
       .channels = {{"red, green, blue",
                     "8 bits each: red + 256 green + 65536 blue is the id of a segment; 0 no ray"}},
       .index_indent = -1,
       .encode = encode},
      [&](Json& index) {
        index.set("categories", classes_json());
        add_images(inputs.sequence, std::move(segments), index);
      });
}

}  // namespace

LabelInfo panoptic_label() {
  return {.name = "panoptic",
          .summary = "Segment of every pixel, a thing or a class, and a table of each image's.",
          .make = []() -> std::unique_ptr<LabelMaker> {
            return std::make_unique<PlainLabel>(make_panoptic);
          }};
}

}  // namespace terracast::labels
