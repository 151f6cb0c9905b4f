#include "capture/object_labels.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "capture/json_parts.h"
#include "capture/sequence_files.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/instance_id.h"

namespace terracast::capture {
namespace {

using core::ErrorKind;
using core::fail;
using core::Json;

Json labels_header(const std::string& source) {
  return Json::object()
      .set("format", "terracast object labels")
      .set("version", kObjectLabelsVersion)
      .set("capture", source);
}

void check_header(const Json& json, const std::string& source, const std::string& file) {
  if (!json.is_object() || !json.has("format") ||
      json.at("format").string() != "terracast object labels")
    fail(ErrorKind::Input, "{}: not a file of object labels", file);
  if (json.at("version").integer() != kObjectLabelsVersion)
    fail(ErrorKind::Input,
         "{}: version {} of object labels, and this program reads {}; label again", file,
         json.at("version").integer(), kObjectLabelsVersion);
  if (json.at("capture").string() != source)
    fail(ErrorKind::Input, "{}: of another capture than the one beside it; label again", file);
}

Json json_from_box(const ImageBox& box) {
  return Json::array_of({box.left, box.top, box.right, box.bottom});
}

ImageBox image_box(const Source& source, const Json& json, const char* what) {
  const std::vector<double> edges = source.numbers(json, 4, what);
  if (!(edges[0] <= edges[2] && edges[1] <= edges[3]))
    fail(ErrorKind::Input, "{}: {} = {:g}, {:g}, {:g}, {:g} is no left, top, right, bottom",
         source.file, what, edges[0], edges[1], edges[2], edges[3]);
  return {edges[0], edges[1], edges[2], edges[3]};
}

/// Features may pass what other programs hold as numbers: they stand as text.
std::uint64_t feature_of(const Json& json, const std::string& file) {
  const std::string& text = json.string();
  std::uint64_t feature = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), feature);
  if (error != std::errc() || end != text.data() + text.size())
    fail(ErrorKind::Input, "{}: feature \"{}\" is no whole number of 64 bits", file, text);
  return feature;
}

std::uint32_t instance_of(const Source& source, const Json& json) {
  return static_cast<std::uint32_t>(source.count(json, 0xffffffffLL, "instance_id"));
}

Json json_from_object(const LabelledObject& object) {
  Json json = Json::object();
  json.set("instance_id", static_cast<std::int64_t>(object.instance_id))
      .set("class", semantic_class_names()[static_cast<std::size_t>(object.semantic_class)]);
  if (object.is_moving())
    json.set("moving", object.moving).set("thing", object.prototype);
  else
    json.set("layer", object.layer)
        .set("feature", fmt::format("{}", object.feature))
        .set("prototype", object.prototype)
        .set("world_from_box", json_from_rigid(object.box.world_from_box));
  json.set("half_size_m", json_from_vector(object.box.half_size_m));
  return json;
}

LabelledObject object_from_json(const Json& json, const Source& source) {
  const auto names = semantic_class_names();
  const auto name = std::find(names.begin(), names.end(), json.at("class").string());
  if (name == names.end())
    fail(ErrorKind::Input, "{}: class \"{}\" is none that is known", source.file,
         json.at("class").string());
  LabelledObject object;
  object.instance_id = instance_of(source, json.at("instance_id"));
  object.semantic_class = static_cast<SemanticClass>(name - names.begin());
  object.box.half_size_m = source.vector(json.at("half_size_m"), "half_size_m");
  if (!(object.box.half_size_m.minCoeff() >= 0.0))
    fail(ErrorKind::Input, "{}: object {} has a negative half_size_m", source.file,
         object.instance_id);
  if (json.has("moving")) {
    object.moving = json.at("moving").string();
    object.prototype = json.at("thing").string();
  } else {
    object.layer = json.at("layer").string();
    object.feature = feature_of(json.at("feature"), source.file);
    object.prototype = json.at("prototype").string();
    object.box.world_from_box = source.rigid(json.at("world_from_box"), "world_from_box");
  }
  if (object.is_moving() != core::is_moving_id(object.instance_id))
    fail(ErrorKind::Input, "{}: object {} {} a name among what moves", source.file,
         object.instance_id, object.is_moving() ? "stands, and has" : "moves, and has not");
  return object;
}

/// Lists in which each has a larger id than the one before.
template <class Item>
void check_order(const std::vector<Item>& items, const std::string& file) {
  for (std::size_t i = 0; i < items.size(); ++i)
    if (items[i].instance_id == 0 || (i > 0 && items[i - 1].instance_id >= items[i].instance_id))
      fail(ErrorKind::Input, "{}: instance ids must ascend from 1: {} stands at {}", file,
           items[i].instance_id, i);
}

}  // namespace

std::string labels_source(const SequenceReader& sequence) {
  return core::content_hash_of_file(sequence.folder() / kManifestFile);
}

std::string object_views_path(const CameraCalibration& camera, int frame_index) {
  return fmt::format("{}/objects/{}/{}/{:06}.json", kLabelsFolder, camera.rig, camera.name,
                     frame_index);
}

Json json_from_objects(const std::vector<LabelledObject>& objects, const std::string& source) {
  Json list = Json::array();
  for (const LabelledObject& object : objects) list.push(json_from_object(object));
  Json json = labels_header(source);
  json.set("objects", std::move(list));
  core::add_content_hash(json);
  return json;
}

std::vector<LabelledObject> objects_from_json(const Json& json, const std::string& source_hash,
                                              const std::string& file) {
  const Source source{file};
  check_header(json, source_hash, file);
  const Json& list = json.at("objects");
  if (!list.is_array()) fail(ErrorKind::Input, "{}: objects must be a list", file);
  std::vector<LabelledObject> objects;
  for (std::size_t i = 0; i < list.size(); ++i)
    objects.push_back(object_from_json(list.at(i), source));
  check_order(objects, file);
  source.whole(json);
  return objects;
}

Json json_from_object_views(const std::vector<ObjectView>& views, const std::string& source) {
  Json list = Json::array();
  for (const ObjectView& view : views) {
    Json one = Json::object();
    one.set("instance_id", static_cast<std::int64_t>(view.instance_id))
        .set("visible_pixels", view.num_visible)
        .set("own_pixels", view.num_own)
        .set("visible_box_px", json_from_box(view.visible_px))
        .set("whole_box_px", json_from_box(view.whole_px))
        .set("occlusion", view.occlusion())
        .set("truncation", view.truncation)
        .set("nearest_m", view.nearest_m)
        .set("camera_from_box", json_from_rigid(view.camera_from_box));
    if (view.motion)
      one.set("world_from_box", json_from_rigid(view.motion->world_from_box))
          .set("velocity_world_mps", json_from_vector(view.motion->velocity_world_mps))
          .set("angular_velocity_box_radps",
               json_from_vector(view.motion->angular_velocity_box_radps));
    list.push(std::move(one));
  }
  Json json = labels_header(source);
  json.set("objects", std::move(list));
  core::add_content_hash(json);
  return json;
}

std::vector<ObjectView> object_views_from_json(const Json& json, const std::string& source_hash,
                                               const std::string& file) {
  const Source source{file};
  check_header(json, source_hash, file);
  const Json& list = json.at("objects");
  if (!list.is_array()) fail(ErrorKind::Input, "{}: objects must be a list", file);
  std::vector<ObjectView> views(list.size());
  for (std::size_t i = 0; i < list.size(); ++i) {
    const Json& one = list.at(i);
    ObjectView& view = views[i];
    view = {.instance_id = instance_of(source, one.at("instance_id")),
            .num_visible = source.count(one.at("visible_pixels"), kMaxPixels, "visible_pixels"),
            .num_own = source.count(one.at("own_pixels"), kMaxPixels, "own_pixels"),
            .visible_px = image_box(source, one.at("visible_box_px"), "visible_box_px"),
            .whole_px = image_box(source, one.at("whole_box_px"), "whole_box_px"),
            .truncation = source.finite(one.at("truncation"), "truncation"),
            .nearest_m = source.finite(one.at("nearest_m"), "nearest_m"),
            .camera_from_box = source.rigid(one.at("camera_from_box"), "camera_from_box")};
    if (core::is_moving_id(view.instance_id))
      view.motion = BoxMotion{
          .world_from_box = source.rigid(one.at("world_from_box"), "world_from_box"),
          .velocity_world_mps = source.vector(one.at("velocity_world_mps"), "velocity_world_mps"),
          .angular_velocity_box_radps =
              source.vector(one.at("angular_velocity_box_radps"), "angular_velocity_box_radps")};
    if (view.num_visible < 1 || view.num_own < view.num_visible)
      fail(ErrorKind::Input, "{}: object {} shows {} of {} pixels", file, view.instance_id,
           view.num_visible, view.num_own);
    if (!(view.truncation >= 0.0 && view.truncation <= 1.0))
      fail(ErrorKind::Input, "{}: object {} has a truncation of {:g}; 0 to 1 is right", file,
           view.instance_id, view.truncation);
  }
  check_order(views, file);
  source.whole(json);
  return views;
}

ObjectLabels ObjectLabels::open(const SequenceReader& sequence) {
  const std::filesystem::path file = sequence.folder() / kObjectsFile;
  if (!std::filesystem::exists(file))
    fail(ErrorKind::Input, "{}: its objects are not labelled; run `terracast label` first",
         sequence.folder().string());
  ObjectLabels labels;
  labels.folder_ = sequence.folder();
  labels.cameras_ = sequence.info().cameras;
  labels.source_ = labels_source(sequence);
  labels.objects_ = objects_from_json(Json::read(file), labels.source_, file.string());
  return labels;
}

std::size_t ObjectLabels::index_of(std::uint32_t instance_id) const {
  const auto found = std::lower_bound(
      objects_.begin(), objects_.end(), instance_id,
      [](const LabelledObject& object, std::uint32_t id) { return object.instance_id < id; });
  if (found == objects_.end() || found->instance_id != instance_id)
    fail(ErrorKind::Input, "{}: has no object {}, which an image shows; label again",
         (folder_ / kObjectsFile).string(), instance_id);
  return static_cast<std::size_t>(found - objects_.begin());
}

std::vector<ObjectView> ObjectLabels::views(int frame_index, int camera_index) const {
  const std::filesystem::path file =
      folder_ / object_views_path(cameras_.at(static_cast<std::size_t>(camera_index)), frame_index);
  return object_views_from_json(Json::read(file), source_, file.string());
}

}  // namespace terracast::capture
