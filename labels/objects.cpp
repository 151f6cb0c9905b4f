// What stands in the images: for every object its class, source and oriented box, and for every image that shows it
// its boxes, how much of it others hide and how much lies outside.
//
// Pixels that would show an object alone are found by the pixels' own rays, by the decision that made the image
// (world/triangle_crossing.h): those that show it are among them. The box around all of it follows from its
// edges, so that it does not end at pixels. What moves is looked for where it is when each line is exposed.

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>

#include "capture/sequence_files.h"
#include "core/error.h"
#include "core/log.h"
#include "core/progress.h"
#include "labels/images.h"
#include "labels/label.h"
#include "labels/object_outline.h"
#include "labels/objects_of_sequence.h"
#include "labels/shown_objects.h"

namespace terracast::labels {
namespace {

namespace fs = std::filesystem;
using capture::ObjectView;
using core::ErrorKind;
using core::Json;

/// What an image shows of one object.
struct Shown {
  std::int64_t num_pixels = 0;
  int left = 0, top = 0, right = 0, bottom = 0;  ///< the pixels themselves
  float nearest_m = 0.0F;
};

std::map<std::uint32_t, Shown> shown_in(const capture::CameraFrame& facts) {
  std::map<std::uint32_t, Shown> all;
  std::uint32_t last_id = 0;
  Shown* last = nullptr;
  for (int y = 0; y < facts.instance_id.height(); ++y) {
    for (int x = 0; x < facts.instance_id.width(); ++x) {
      const std::uint32_t id = facts.instance_id(x, y);
      if (id == 0) continue;
      if (id != last_id) {
        last = &all[id];
        last_id = id;
      }
      if (last->num_pixels++ == 0) {
        *last = {.num_pixels = 1,
                 .left = x,
                 .top = y,
                 .right = x,
                 .bottom = y,
                 .nearest_m = facts.range_m(x, y)};
        continue;
      }
      last->left = std::min(last->left, x);
      last->right = std::max(last->right, x);
      last->bottom = y;
      last->nearest_m = std::min(last->nearest_m, facts.range_m(x, y));
    }
  }
  return all;
}

/// The box of all of an object, within an image.
capture::ImageBox clipped_box(const Outline& outline, const OwnPixels& own, int width_px,
                              int height_px) {
  const capture::ImageBox& box = outline.box_px;
  const auto clip = [](double edge_px, int size_px) {
    return std::clamp(edge_px, 0.0, static_cast<double>(size_px));
  };
  return {clip(std::min(box.left, own.left), width_px), clip(std::min(box.top, own.top), height_px),
          clip(std::max(box.right, own.right), width_px),
          clip(std::max(box.bottom, own.bottom), height_px)};
}

/// One image of a sequence.
class ImageLabels {
 public:
  ImageLabels(const capture::SequenceReader& sequence, int frame, int camera)
      : record_(sequence.frames()[static_cast<std::size_t>(frame)]),
        model_(
            geo::make_camera(sequence.info().cameras[static_cast<std::size_t>(camera)].intrinsics)),
        view_(sequence.view(*model_, frame, camera)),
        facts_(sequence.read_camera(frame, camera, capture::SequenceReader::kFacts)) {}

  /// objects   of the sequence, by instance id
  std::vector<ObjectView> views(const std::vector<ShownObject>& objects) const {
    std::vector<ObjectView> views;
    const std::map<std::uint32_t, Shown> all = shown_in(facts_);
    if (all.empty()) return views;
    const PixelRays rays(view_);
    for (const auto& [id, shown] : all) {
      const auto object = std::lower_bound(objects.begin(), objects.end(), id,
                                           [](const ShownObject& one, std::uint32_t wanted) {
                                             return one.label.instance_id < wanted;
                                           });
      TERRACAST_CHECK(object != objects.end() && object->label.instance_id == id, "object {}", id);
      views.push_back(view_of_object(*object, shown, rays));
    }
    return views;
  }

 private:
  ObjectView view_of_object(const ShownObject& object, const Shown& shown,
                            const PixelRays& rays) const {
    const std::uint32_t id = object.label.instance_id;
    const Placement placement = placement_at(object, record_);
    const Outline outline = outline_of(placement, view_);
    // Where roundings or another place of the object keep its outline from what shows, that belongs to it.
    Outline around = outline;
    around.box_px = {std::min(outline.box_px.left, double(shown.left)),
                     std::min(outline.box_px.top, double(shown.top)),
                     std::max(outline.box_px.right, shown.right + 1.0),
                     std::max(outline.box_px.bottom, shown.bottom + 1.0)};
    const OwnPixels own = own_pixels(placement, rays, around,
                                     [&](int x, int y) { return facts_.instance_id(x, y) == id; });
    return {.instance_id = id,
            .num_visible = shown.num_pixels,
            .num_own = own.count,
            .visible_px = {double(shown.left), double(shown.top), shown.right + 1.0,
                           shown.bottom + 1.0},
            .whole_px = clipped_box(outline, own, rays.width_px(), rays.height_px()),
            .truncation = truncation_of(placement, view_, outline),
            .nearest_m = static_cast<double>(shown.nearest_m),
            .camera_from_box = view_.world_from_camera.inverse() * placement.world_from_box,
            .motion = placement.motion};
  }

  const capture::FrameRecord& record_;
  std::unique_ptr<geo::CameraModel> model_;
  capture::CameraView view_;
  capture::CameraFrame facts_;
};

/// Whether a file of views is there, and of this capture.
bool is_done(const fs::path& file, const std::string& source) {
  if (!fs::exists(file)) return false;
  try {
    capture::object_views_from_json(Json::read(file), source, file.string());
    return true;
  } catch (const core::Error& error) {
    if (error.kind() == ErrorKind::Input) return false;
    throw;
  }
}

/// Whether all is there, and of this capture.
bool is_finished(const capture::SequenceReader& sequence, const std::string& source) {
  if (!fs::exists(sequence.folder() / capture::kObjectsFile)) return false;
  try {
    capture::ObjectLabels::open(sequence);
  } catch (const core::Error& error) {
    if (error.kind() == ErrorKind::Input) return false;
    throw;
  }
  std::atomic<bool> is_whole = true;
  for_each_image(sequence, [&](int frame, int camera) {
    const auto& calibration = sequence.info().cameras[static_cast<std::size_t>(camera)];
    if (is_whole &&
        !is_done(sequence.folder() / capture::object_views_path(calibration, frame), source))
      is_whole = false;
  });
  return is_whole;
}

class ObjectsLabel final : public LabelMaker {
 public:
  void describe(core::SchemaVisitor&) override {}
  std::unique_ptr<LabelMaker> clone() const override {
    return std::make_unique<ObjectsLabel>(*this);
  }

  LabelFiles make(const LabelInputs& inputs) const override {
    const capture::SequenceReader& sequence = inputs.sequence;
    const std::string source = capture::labels_source(sequence);
    if (is_finished(sequence, source)) {
      inputs.context.log.info("{}: objects are labelled already", sequence.info().name);
      return files_of(sequence);
    }
    const std::vector<ShownObject> objects = objects_of_sequence(inputs);
    inputs.context.log.info("{}: labelling {} objects", sequence.info().name, objects.size());
    write_views(inputs, objects, source);
    std::vector<capture::LabelledObject> listed;
    for (const ShownObject& object : objects) listed.push_back(object.label);
    capture::json_from_objects(listed, source).write(sequence.folder() / capture::kObjectsFile);
    return files_of(sequence);
  }

 private:
  static LabelFiles files_of(const capture::SequenceReader& sequence) {
    const fs::path folder = fs::path(capture::kLabelsFolder) / "objects";
    LabelFiles files = {fs::path(capture::kObjectsFile).lexically_relative(folder)};
    for (const auto& camera : sequence.info().cameras)
      for (int frame = 0; frame < static_cast<int>(sequence.frames().size()); ++frame)
        files.insert(
            fs::path(capture::object_views_path(camera, frame)).lexically_relative(folder));
    return files;
  }

  static void write_views(const LabelInputs& inputs, const std::vector<ShownObject>& objects,
                          const std::string& source) {
    const capture::SequenceReader& sequence = inputs.sequence;
    core::Progress progress(inputs.context, "images labelled", num_images(sequence));
    for_each_image(sequence, [&](int frame, int camera) {
      const auto& calibration = sequence.info().cameras[static_cast<std::size_t>(camera)];
      const fs::path file = sequence.folder() / capture::object_views_path(calibration, frame);
      if (is_done(file, source)) return progress.skip();
      const ImageLabels image(sequence, frame, camera);
      capture::json_from_object_views(image.views(objects), source).write(file, -1);
      progress.advance();
    });
  }
};

}  // namespace

LabelInfo objects_label() {
  return {.name = "objects",
          .summary =
              "Boxes in the image and in space, occlusion, truncation, class and source of "
              "every object that an image shows.",
          .make = []() -> std::unique_ptr<LabelMaker> { return std::make_unique<ObjectsLabel>(); }};
}

}  // namespace terracast::labels
