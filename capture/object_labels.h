#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "capture/channel.h"
#include "capture/frame_reader.h"
#include "core/json.h"
#include "geo/rigid3.h"

/// What is known of the objects that a sequence shows, beside its facts: files in the sequence's folder
/// `labels/objects`, made from the world and the capture (render/labels), read by exporters.
///
///     objects.json                    the sequence's objects; written last: the labels are whole when it exists
///     <rig>/<camera>/NNNNNN.json      those that an image shows
namespace terracast::capture {

inline constexpr int kObjectLabelsVersion = 1;

/// A box about an object. x is along it (of vehicles: forward; of buildings the longer side), y to its left,
/// z up at its place; the frame's origin is the box's centre.
struct OrientedBox {
  geo::Rigid3d world_from_box;
  Eigen::Vector3d half_size_m = Eigen::Vector3d::Zero();
  bool operator==(const OrientedBox&) const = default;
};

/// Where the box of something that moves is at a frame's time, and how it goes on.
struct BoxMotion {
  geo::Rigid3d world_from_box;
  Eigen::Vector3d velocity_world_mps = Eigen::Vector3d::Zero();  ///< of the box's centre
  Eigen::Vector3d angular_velocity_box_radps = Eigen::Vector3d::Zero();
  bool operator==(const BoxMotion&) const = default;
};

/// An object of which a sequence shows a pixel or more.
struct LabelledObject {
  std::uint32_t instance_id = 0;
  SemanticClass semantic_class =
      SemanticClass::Object;  ///< of most of its surface; of what moves that of the thing
  std::string layer;          ///< of the world, by name; what moves has none
  std::uint64_t feature = 0;  ///< its number in the layer's source
  std::string prototype;    ///< its name; "": a shape of its own. Of what moves the built-in thing
  OrientedBox box;          ///< of what moves its size alone: ObjectView::motion says where it is
  std::string moving = {};  ///< its name among what moves; "": it stands
  bool operator==(const LabelledObject&) const = default;

  bool is_moving() const { return !moving.empty(); }
};

/// A rectangle of an image, px: pixel i covers i to i + 1.
struct ImageBox {
  double left = 0.0;
  double top = 0.0;
  double right = 0.0;
  double bottom = 0.0;
  double width() const { return right - left; }
  double height() const { return bottom - top; }
  bool operator==(const ImageBox&) const = default;
};

/// An object in an image that shows a pixel of it or more.
struct ObjectView {
  std::uint32_t instance_id = 0;
  std::int64_t num_visible = 0;  ///< pixels that show it
  std::int64_t num_own = 0;      ///< pixels that would show it if it stood alone
  ImageBox visible_px;           ///< around the pixels that show it
  ImageBox whole_px;             ///< around all of it, seen through others, within the image
  double truncation = 0.0;       ///< share of all of it that lies outside the image
  double nearest_m = 0.0;        ///< least range of a pixel that shows it
  geo::Rigid3d camera_from_box;  ///< at the frame's time
  std::optional<BoxMotion> motion = std::nullopt;  ///< nothing: it stands
  bool operator==(const ObjectView&) const = default;

  /// Share of it that others hide, of what lies in the image.
  double occlusion() const {
    return 1.0 - static_cast<double>(num_visible) / static_cast<double>(num_own);
  }
};

/// Which capture labels belong to: the hash of its manifest.json.
/// throws   Io
std::string labels_source(const SequenceReader& sequence);

/// Paths relative to the sequence's folder.
inline constexpr const char* kObjectsFile = "labels/objects/objects.json";
std::string object_views_path(const CameraCalibration& camera, int frame_index);

core::Json json_from_objects(const std::vector<LabelledObject>& objects, const std::string& source);
/// throws   Input: not such a file, of another version or capture, damaged; `file` names it
std::vector<LabelledObject> objects_from_json(const core::Json& json, const std::string& source,
                                              const std::string& file);

core::Json json_from_object_views(const std::vector<ObjectView>& views, const std::string& source);
/// throws   as objects_from_json
std::vector<ObjectView> object_views_from_json(const core::Json& json, const std::string& source,
                                               const std::string& file);

/// The labels of a sequence's objects. Threads: safe.
class ObjectLabels {
 public:
  /// throws   Input: they have not been made, or not of this capture; says what to do
  static ObjectLabels open(const SequenceReader& sequence);

  /// By instance id, ascending.
  const std::vector<LabelledObject>& objects() const { return objects_; }
  /// Index into objects() of an instance.
  /// throws   Input: the sequence's objects do not have it
  std::size_t index_of(std::uint32_t instance_id) const;
  /// Those that an image shows, by instance id, ascending.
  std::vector<ObjectView> views(int frame_index, int camera_index) const;

 private:
  std::filesystem::path folder_;
  std::vector<CameraCalibration> cameras_;
  std::string source_;
  std::vector<LabelledObject> objects_;
};

}  // namespace terracast::capture
