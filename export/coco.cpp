// COCO: instances and panoptic segmentation.
//
// Boxes      [x, y, width, height], px, edges: pixel i covers i to i + 1.
// Masks      runs along the columns, as COCO's compressed text; exactly the pixels that show the object.
// Panoptic   a PNG an image, id = R + 256 G + 65536 B, 0 void. A segment of stuff has its category's number; a thing
//            1000 + its place among the objects of the sequence, the same in all of its images.
// Ours       in each annotation beside COCO's members: instance_id, occlusion, truncation, whole_bbox, distance_m.

#include <algorithm>
#include <map>

#include "capture/object_labels.h"
#include "capture/segments.h"
#include "core/error.h"
#include "core/image_io.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "export/additions.h"
#include "export/calibration.h"
#include "export/cameras.h"
#include "export/coco_categories.h"
#include "export/coco_masks.h"
#include "export/dataset_writer.h"
#include "export/exporter.h"
#include "export/georeference.h"

namespace terracast::exporters {
namespace {

using capture::kFirstThingSegment;
using capture::LabelledObject;
using capture::ObjectView;
using capture::Segment;
using core::ErrorKind;
using core::fail;
using core::Json;

constexpr const char* kFormat = "coco";
/// For forecasts.
constexpr double kBytesPerPixel = 1.7;

/// The numbers of an image's segments, by pixel; 0 is void.
core::ImageU32 segment_numbers(const capture::CameraFrame& facts,
                               const capture::ObjectLabels& labels,
                               const CocoCategories& categories) {
  return capture::segment_numbers(facts, [&](std::uint32_t instance, std::uint32_t pixel_class) {
    const std::size_t object = instance == 0 ? 0 : labels.index_of(instance);
    const CocoCategory* category =
        categories.of(instance == 0 ? static_cast<capture::SemanticClass>(pixel_class)
                                    : labels.objects()[object].semantic_class);
    if (category == nullptr) return 0U;
    return instance != 0 && category->is_thing
               ? kFirstThingSegment + static_cast<std::uint32_t>(object)
               : static_cast<std::uint32_t>(category->id);
  });
}

Json box_json(double left, double top, double right, double bottom) {
  return Json::array_of({left, top, right - left, bottom - top});
}

Json box_json(const Segment& segment) {
  return box_json(segment.left, segment.top, segment.right + 1.0, segment.bottom + 1.0);
}

/// What the annotation files say of one image; annotations without their number, which counts over all.
struct ImageText {
  std::string image;
  std::vector<std::string> annotations;
  std::string panoptic;
};

/// A camera of a sequence at a frame, as the dataset numbers them.
struct ImageName {
  std::int64_t id = 0;  ///< from 1
  std::string stem;     ///< "<sequence>/<camera>/NNNNNN"
};

class CocoExporter final : public Exporter {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("rig", rig_, "Rig to export, with all its cameras; empty: all rigs.");
    visit.key("categories", categories_,
              "coco: COCO's own categories; classes that it has no number for are void. own: ours, "
              "numbered as in classes.toml plus 1; trees and buildings are things too.",
              core::one_of({"coco", "own"}));
    visit.key("min_pixels", min_pixels_,
              "Things of which fewer pixels show are no instances; the panoptic images have them.",
              core::between(1, 1000000));
  }

  std::unique_ptr<Exporter> clone() const override { return std::make_unique<CocoExporter>(*this); }

  std::vector<std::string> labels() const override { return {"objects"}; }

  std::vector<std::string> rigs() const override {
    return rig_.empty() ? std::vector<std::string>{} : std::vector{rig_};
  }

  void check(const std::vector<capture::CameraCalibration>& cameras) const override {
    check_provable(*this, cameras);
  }

  FrameSize frame_size(const std::vector<capture::CameraCalibration>& cameras) const override {
    std::vector<const capture::CameraCalibration*> exported;
    for (const ExportedCamera& camera : exported_cameras(cameras))
      exported.push_back(&cameras[static_cast<std::size_t>(camera.camera_index)]);
    return size_of_images(exported, kBytesPerPixel);
  }

  void write(const std::vector<capture::SequenceReader>& sequences,
             const std::filesystem::path& folder, const core::Context& context) const override {
    const std::string hash = source_hash(kFormat, *this, sequences);
    DatasetWriter writer(folder, kFormat, hash, context);
    if (writer.is_complete()) {
      context.log.info("{}: finished already, its sources are unchanged", folder.string());
      return;
    }
    const CocoCategories categories(categories_ == "own");
    Json list = Json::array();
    std::vector<ImageText> images;
    for (const capture::SequenceReader& sequence : sequences)
      list.push(write_sequence(sequence, categories, writer, context, images));
    write_annotations(sequences, categories, images, writer);
    Json description =
        metadata(kFormat, "COCO instances and panoptic", hash, sequences,
                 {{"pixel_center", "Boxes are edges: pixel i covers i to i + 1."},
                  {"world_frame", "None of its own; every image's place is in georeference.csv."},
                  {"pose", "None: each image stands alone."},
                  {"segmentation",
                   "Runs along the columns, compressed text: the pixels that show the object."},
                  {"panoptic",
                   "PNG, id = R + 256 G + 65536 B, 0 void; stuff: its category; things: 1000 and "
                   "up, the same "
                   "in all images of a sequence."},
                  {"categories", categories_ == "own" ? "Classes of terracast plus 1."
                                                      : "COCO's, of its panoptic task."},
                  {"depth", "None; distance_m is that of the nearest pixel that shows an object."},
                  {"sky", "A category of stuff."}},
                 {"annotations: instance_id, occlusion (share that others hide), truncation (share "
                  "outside the "
                  "image), whole_bbox (around all of the object, within the image), distance_m"});
    description.set("sequences", std::move(list));
    writer.finish(std::move(description));
  }

 private:
  /// Called RIG_NAME.
  std::vector<ExportedCamera> exported_cameras(
      const std::vector<capture::CameraCalibration>& cameras) const {
    std::vector<ExportedCamera> exported = cameras_taken(*this, cameras);
    for (ExportedCamera& camera : exported)
      std::replace(camera.name.begin(), camera.name.end(), '/', '_');
    return exported;
  }

  Json write_sequence(const capture::SequenceReader& sequence, const CocoCategories& categories,
                      DatasetWriter& writer, const core::Context& context,
                      std::vector<ImageText>& images) const {
    const std::string name = folder_word(sequence.info().name);
    const std::string path = "sequences/" + name;
    const std::vector<ExportedCamera> exported = exported_cameras(sequence.info().cameras);
    write_additions(writer, path, sequence, exported, scan_forms);
    const capture::ObjectLabels labels = capture::ObjectLabels::open(sequence);
    capture::check_num_things(labels.objects().size(), "coco: sequence " + sequence.info().name);

    const std::size_t first = images.size();
    const std::size_t num_images = sequence.frames().size() * exported.size();
    images.resize(first + num_images);
    core::Progress progress(context, "images", static_cast<std::int64_t>(num_images));
    core::parallel_for(static_cast<std::int64_t>(num_images), [&](std::int64_t i) {
      const auto place = static_cast<std::size_t>(i);
      const auto frame = static_cast<int>(place / exported.size());
      const ExportedCamera& camera = exported[place % exported.size()];
      const ImageName image{.id = static_cast<std::int64_t>(first + place) + 1,
                            .stem = fmt::format("{}/{}/{:06}", name, camera.name, frame)};
      images[first + place] =
          write_image(sequence, frame, camera, labels, categories, image, writer);
      progress.advance();
    });
    const LocalFrame local = local_frame(sequence);
    return describe_sequence(sequence, local, name, path, exported, StatedCalibration());
  }

  ImageText write_image(const capture::SequenceReader& sequence, int frame,
                        const ExportedCamera& camera, const capture::ObjectLabels& labels,
                        const CocoCategories& categories, const ImageName& name,
                        DatasetWriter& writer) const {
    const capture::CameraFrame facts =
        sequence.read_camera(frame, camera.camera_index, capture::SequenceReader::kAll);
    writer.write_kept("images/" + name.stem + ".png",
                      [&] { return core::encode_png(facts.color); });
    const core::ImageU32 numbers = segment_numbers(facts, labels, categories);
    writer.write_kept("panoptic/" + name.stem + ".png",
                      [&] { return core::encode_png(capture::image_of_segments(numbers)); });
    ImageText text;
    text.image = Json::object()
                     .set("id", name.id)
                     .set("width", facts.color.width())
                     .set("height", facts.color.height())
                     .set("file_name", name.stem + ".png")
                     .set("sequence", sequence.info().name)
                     .set("camera", camera.name)
                     .set("frame", frame)
                     .text(-1);
    const std::map<std::uint32_t, Segment> segments = capture::segments_of(numbers);
    text.panoptic = panoptic_text(name, segments, labels, categories);
    text.annotations =
        annotation_texts(name, segments, labels, labels.views(frame, camera.camera_index),
                         categories, facts.color.width(), facts.color.height());
    return text;
  }

  static int category_of(std::uint32_t number, const capture::ObjectLabels& labels,
                         const CocoCategories& categories) {
    if (number < kFirstThingSegment) return static_cast<int>(number);
    return categories.of(labels.objects()[number - kFirstThingSegment].semantic_class)->id;
  }

  static std::string panoptic_text(const ImageName& name,
                                   const std::map<std::uint32_t, Segment>& segments,
                                   const capture::ObjectLabels& labels,
                                   const CocoCategories& categories) {
    Json list = Json::array();
    for (const auto& [number, segment] : segments)
      list.push(Json::object()
                    .set("id", static_cast<std::int64_t>(number))
                    .set("category_id", category_of(number, labels, categories))
                    .set("area", segment.area)
                    .set("bbox", box_json(segment))
                    .set("iscrowd", 0));
    return Json::object()
        .set("image_id", name.id)
        .set("file_name", name.stem + ".png")
        .set("segments_info", std::move(list))
        .text(-1);
  }

  /// All of an annotation but its opening brace and its id.
  std::vector<std::string> annotation_texts(const ImageName& name,
                                            const std::map<std::uint32_t, Segment>& segments,
                                            const capture::ObjectLabels& labels,
                                            const std::vector<ObjectView>& views,
                                            const CocoCategories& categories, int width_px,
                                            int height_px) const {
    std::vector<std::string> texts;
    for (const ObjectView& view : views) {
      const std::size_t object = labels.index_of(view.instance_id);
      const auto found = segments.find(kFirstThingSegment + static_cast<std::uint32_t>(object));
      if (found == segments.end()) continue;  // no thing
      const Segment& segment = found->second;
      if (segment.area != view.num_visible)
        fail(ErrorKind::Input,
             "coco: {}.png shows {} pixels of object {}, and its labels say {}; label again",
             name.stem, segment.area, view.instance_id, view.num_visible);
      if (segment.area < min_pixels_) continue;
      const capture::ImageBox& whole = view.whole_px;
      texts.push_back(
          Json::object()
              .set("image_id", name.id)
              .set("category_id", category_of(found->first, labels, categories))
              .set("segmentation", Json::object()
                                       .set("size", Json::array().push(height_px).push(width_px))
                                       .set("counts", text_of_runs(segment.runs)))
              .set("area", segment.area)
              .set("bbox", box_json(segment))
              .set("iscrowd", 0)
              .set("instance_id", static_cast<std::int64_t>(view.instance_id))
              .set("occlusion", view.occlusion())
              .set("truncation", view.truncation)
              .set("whole_bbox", box_json(whole.left, whole.top, whole.right, whole.bottom))
              .set("distance_m", view.nearest_m)
              .text(-1)
              .substr(1));
    }
    return texts;
  }

  static std::string head_text(const std::vector<capture::SequenceReader>& sequences) {
    std::vector<std::string> licences;
    for (const capture::SequenceReader& sequence : sequences)
      for (const std::string& licence : sequence.info().licences)
        if (std::find(licences.begin(), licences.end(), licence) == licences.end())
          licences.push_back(licence);
    Json list = Json::array();
    for (std::size_t i = 0; i < licences.size(); ++i)
      list.push(Json::object()
                    .set("id", static_cast<std::int64_t>(i) + 1)
                    .set("name", licences[i])
                    .set("url", ""));
    const std::string text =
        Json::object()
            .set("info", Json::object().set("description", sequences.front().info().world_name))
            .set("licenses", std::move(list))
            .text(-1);
    return text.substr(0, text.size() - 1);
  }

  static void write_annotations(const std::vector<capture::SequenceReader>& sequences,
                                const CocoCategories& categories,
                                const std::vector<ImageText>& images, DatasetWriter& writer) {
    std::string list, instances, panoptic;
    std::int64_t num_annotations = 0;
    for (const ImageText& image : images) {
      list += (list.empty() ? "" : ",\n") + image.image;
      panoptic += (panoptic.empty() ? "" : ",\n") + image.panoptic;
      for (const std::string& annotation : image.annotations) {
        ++num_annotations;
        instances += fmt::format("{}{{\"id\": {}, {}", num_annotations == 1 ? "" : ",\n",
                                 num_annotations, annotation);
      }
    }
    const auto file = [&](bool is_panoptic, const std::string& annotations) {
      return fmt::format(
          "{},\n\"images\": [\n{}\n],\n\"annotations\": [\n{}\n],\n\"categories\": {}}}\n",
          head_text(sequences), list, annotations, categories.json(is_panoptic).text(-1));
    };
    writer.write("annotations/instances.json", file(false, instances));
    writer.write("annotations/panoptic.json", file(true, panoptic));
  }

  std::string rig_;
  std::string categories_ = "coco";
  std::int64_t min_pixels_ = 1;
};

}  // namespace

ExporterInfo coco_exporter() {
  return {.name = kFormat,
          .summary = "COCO: masks and boxes of instances, panoptic images.",
          .make = []() -> std::unique_ptr<Exporter> { return std::make_unique<CocoExporter>(); }};
}

}  // namespace terracast::exporters
