// KITTI object detection.
//
// Camera   image_2; RDF: x right, y down, z forward. Pixel centres at whole numbers: c and boxes are ours less
//          0.5.
// Frame    KITTI's boxes turn about one axis alone, y down of the rectified camera 0. A camera that looks down
//          or banks has no such frame: the rectified camera 0 is here the camera turned level, so that y is down at
//          its place (the ellipsoid's normal) and z where it looks, along the ground. R0_rect of each frame's calib
//          takes the camera to it, and P2 = K R0_rect^T [I | 0] projects from it, so that
//          x = P2 R0_rect Tr_velo_to_cam X holds as in KITTI and boxes are what they are. Of a level camera
//          R0_rect is the identity.
// label_2  type truncated occluded alpha bbox(left top right bottom) dimensions(height width length)
//          location(centre of the bottom face) rotation_y. bbox is around all of the object, within the image.
// Leaning  What moves may climb and bank: its box here is the upright one, of its heading, around its own.
// occluded 0 where others hide less than a tenth of it, 1 less than half, 2 more.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include "capture/object_labels.h"
#include "core/error.h"
#include "core/image_io.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "export/additions.h"
#include "export/calibration.h"
#include "export/cameras.h"
#include "export/dataset_writer.h"
#include "export/exporter.h"
#include "export/georeference.h"
#include "export/kitti_files.h"
#include "geo/geodesy.h"
#include "geo/units.h"

namespace terracast::exporters {
namespace {

using capture::LabelledObject;
using capture::ObjectView;
using capture::SemanticClass;
using core::ErrorKind;
using core::fail;
using Eigen::Vector3d;

constexpr const char* kFormat = "kitti_object";
/// For forecasts.
constexpr double kBytesPerPixel = 1.6;
constexpr double kPartlyOccluded = 0.1;
constexpr double kLargelyOccluded = 0.5;

/// KITTI's word for a class; null: it labels no such things.
const char* kitti_type(SemanticClass semantic_class) {
  switch (semantic_class) {
    case SemanticClass::Car:
      return "Car";
    case SemanticClass::Van:
      return "Van";
    case SemanticClass::Truck:
      return "Truck";
    case SemanticClass::Person:
      return "Pedestrian";
    case SemanticClass::Train:
      return "Tram";
    case SemanticClass::Bus:
    case SemanticClass::Aircraft:
    case SemanticClass::Helicopter:
    case SemanticClass::Drone:
    case SemanticClass::Ship:
    case SemanticClass::Boat:
      return "Misc";
    default:
      return nullptr;
  }
}

/// The camera turned level: y down at its place, z level where it looks (or, where it looks straight down or up,
/// where the top of its image is).
Eigen::Matrix3d level_from_camera(const geo::WorldFrame& frame,
                                  const geo::Rigid3d& world_from_camera) {
  constexpr double kStraight = 1e-6;
  const Vector3d down =
      world_from_camera.rotation.conjugate() * -frame.up_world(world_from_camera.translation);
  const auto level = [&](const Vector3d& v) { return Vector3d(v - v.dot(down) * down); };
  Vector3d forward = level(Vector3d::UnitZ());
  if (forward.norm() < kStraight) forward = level(-Vector3d::UnitY());
  forward.normalize();
  Eigen::Matrix3d rows;
  rows.row(0) = down.cross(forward).transpose();
  rows.row(1) = down.transpose();
  rows.row(2) = forward.transpose();
  return rows;
}

double wrapped(double angle_rad) { return std::remainder(angle_rad, 2.0 * std::numbers::pi); }

int occlusion_level(double occlusion) {
  return occlusion < kPartlyOccluded ? 0 : occlusion < kLargelyOccluded ? 1 : 2;
}

/// Whole pixels' centres are KITTI's numbers: the image reaches from 0 to its size less 1.
std::string box_text(const capture::ImageBox& box, const geo::CameraIntrinsics& image) {
  const auto edge = [](double edge_px, int size_px) {
    return std::clamp(edge_px - 0.5, 0.0, size_px - 1.0);
  };
  return fmt::format("{:.4f} {:.4f} {:.4f} {:.4f}", edge(box.left, image.width_px),
                     edge(box.top, image.height_px), edge(box.right, image.width_px),
                     edge(box.bottom, image.height_px));
}

struct LabelText {
  std::string text;
  double largest_tilt_rad = 0.0;  ///< of a standing object's vertical axis against the frame's
  std::array<std::int64_t, 7> num_of_type = {};
};
constexpr std::array<const char*, 7> kTypes = {"Car",  "Van",  "Truck",   "Pedestrian",
                                               "Tram", "Misc", "DontCare"};

/// A box as KITTI has them: upright in the levelled frame, turned about y alone.
struct UprightBox {
  Vector3d half = Vector3d::Zero();  ///< along, to its left, up
  Vector3d foot = Vector3d::Zero();  ///< the middle of its lower side
  double rotation_y = 0.0;
  double tilt_rad = 0.0;  ///< of the object's own vertical axis
};

UprightBox upright_box(const LabelledObject& object, const ObjectView& view,
                       const Eigen::Matrix3d& level) {
  const Eigen::Matrix3d level_from_box = level * view.camera_from_box.rotation.toRotationMatrix();
  UprightBox box{.half = object.box.half_size_m};
  box.tilt_rad = std::acos(std::clamp(-level_from_box(1, 2), -1.0, 1.0));
  box.rotation_y = std::atan2(-level_from_box(2, 0), level_from_box(0, 0));
  if (!object.is_moving()) {
    box.foot = level * (view.camera_from_box * Vector3d(0.0, 0.0, -box.half.z()));
    return box;
  }
  // What climbs or banks has an upright box around its own, which keeps its heading.
  const double c = std::cos(box.rotation_y), s = std::sin(box.rotation_y);
  Eigen::Matrix3d upright_from_level;
  upright_from_level << c, 0.0, -s, s, 0.0, c, 0.0, -1.0, 0.0;
  box.half = (upright_from_level * level_from_box).cwiseAbs() * object.box.half_size_m;
  box.foot = level * view.camera_from_box.translation + Vector3d(0.0, box.half.z(), 0.0);
  return box;
}

class KittiObjectExporter final : public Exporter {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("rig", rig_, "Rig to export.");
    visit.key("camera", camera_, "Its camera that becomes image_2.");
    visit.key("min_height_px", min_height_px_,
              "Objects that stand lower than this in the image are rows DontCare.",
              core::between(0.0, 1000.0));
    calibration_.describe(visit);
  }

  std::unique_ptr<Exporter> clone() const override {
    return std::make_unique<KittiObjectExporter>(*this);
  }

  std::vector<std::string> labels() const override { return {"objects"}; }

  std::vector<std::string> rigs() const override { return {rig_}; }

  void check(const std::vector<capture::CameraCalibration>& cameras) const override {
    const auto& camera = cameras[static_cast<std::size_t>(find_camera(cameras, rig_, camera_))];
    check_pinhole(camera, kFormat);
    if (camera.shutter.is_rolling())
      fail(ErrorKind::Config,
           "{}: camera {}/{} has a rolling shutter (line_time_us = {}); a label's box, angle and "
           "location are "
           "of one time: export a rig without line_time_us",
           kFormat, camera.rig, camera.name, 1e6 * camera.shutter.line_time_s);
  }

  FrameSize frame_size(const std::vector<capture::CameraCalibration>& cameras) const override {
    return size_of_images({&cameras[static_cast<std::size_t>(find_camera(cameras, rig_, camera_))]},
                          kBytesPerPixel);
  }

  void write(const std::vector<capture::SequenceReader>& sequences,
             const std::filesystem::path& folder, const core::Context& context) const override {
    const std::string hash = source_hash(kFormat, *this, sequences);
    DatasetWriter writer(folder, kFormat, hash, context);
    if (writer.is_complete()) {
      context.log.info("{}: finished already, its sources are unchanged", folder.string());
      return;
    }
    core::Json list = core::Json::array();
    LabelText total;
    int first_number = 0;
    for (std::size_t i = 0; i < sequences.size(); ++i) {
      const std::string name = fmt::format("{:02}", i);
      list.push(write_sequence(sequences[i], name, first_number, writer, context, total));
      first_number += static_cast<int>(sequences[i].frames().size());
    }
    core::Json description = metadata(
        kFormat, "KITTI object", hash, sequences,
        {{"pixel_center", "The centre of pixel i is at i: c and boxes are ours less 0.5."},
         {"world_frame", "None of its own; every image's place is in georeference.csv."},
         {"pose", "None: each image stands alone."},
         {"calib",
          "R0_rect turns the camera level (y down, z along the ground where it looks); P2 projects "
          "from there: x = P2 R0_rect Tr_velo_to_cam X."},
         {"label_2",
          "Dimensions and place in the levelled frame of R0_rect; bbox around all of the object "
          "within "
          "the image; occluded 0, 1, 2 from a tenth and half of it hidden on."},
         {"depth", "None."},
         {"sky", "Not labelled."}},
        {});
    core::Json counts = core::Json::object();
    for (std::size_t i = 0; i < kTypes.size(); ++i) counts.set(kTypes[i], total.num_of_type[i]);
    description.set("num_labels", std::move(counts))
        .set("largest_tilt_deg", geo::degrees_from_radians(total.largest_tilt_rad))
        .set("sequences", std::move(list));
    writer.finish(std::move(description));
  }

 private:
  core::Json write_sequence(const capture::SequenceReader& sequence, const std::string& name,
                            int first_number, DatasetWriter& writer, const core::Context& context,
                            LabelText& total) const {
    const int camera = find_camera(sequence.info().cameras, rig_, camera_);
    calibration_.check_is_true(sequence.info(), camera, kFormat);
    const std::vector<ExportedCamera> exported = {{"image_2", camera}};
    const LocalFrame local = local_frame(sequence);
    const std::string path = "sequences/" + name;
    write_additions(writer, path, sequence, exported, scan_forms);
    const capture::ObjectLabels labels = capture::ObjectLabels::open(sequence);
    const geo::WorldFrame world(sequence.info().origin);

    const auto num_frames = static_cast<std::int64_t>(sequence.frames().size());
    std::vector<LabelText> texts(static_cast<std::size_t>(num_frames));
    core::Progress progress(context, "frames", num_frames);
    core::parallel_for(num_frames, [&](std::int64_t i) {
      const auto frame = static_cast<int>(i);
      const auto file = [&](const char* kind, const char* suffix) {
        return fmt::format("training/{}/{:06}{}", kind, first_number + frame, suffix);
      };
      const Eigen::Matrix3d level =
          level_from_camera(world, sequence.world_from_camera(frame, camera));
      writer.write_kept(file("image_2", ".png"), [&] {
        return core::encode_png(
            sequence.read_camera(frame, camera, capture::SequenceReader::kAll).color);
      });
      LabelText& text = texts[static_cast<std::size_t>(i)];
      text =
          label_text(labels, labels.views(frame, camera),
                     sequence.info().cameras[static_cast<std::size_t>(camera)].intrinsics, level);
      writer.write(file("label_2", ".txt"), text.text);
      writer.write(file("calib", ".txt"),
                   calibration(sequence.info().cameras[static_cast<std::size_t>(camera)], level));
      progress.advance();
    });
    for (const LabelText& text : texts) {
      total.largest_tilt_rad = std::max(total.largest_tilt_rad, text.largest_tilt_rad);
      for (std::size_t k = 0; k < kTypes.size(); ++k) total.num_of_type[k] += text.num_of_type[k];
    }
    core::Json entry = describe_sequence(sequence, local, name, path, exported, calibration_);
    entry.set("first_number", first_number);
    return entry;
  }

  /// By distance, the nearest first.
  LabelText label_text(const capture::ObjectLabels& labels, std::vector<ObjectView> views,
                       const geo::CameraIntrinsics& image, const Eigen::Matrix3d& level) const {
    std::stable_sort(views.begin(), views.end(), [](const ObjectView& a, const ObjectView& b) {
      return a.camera_from_box.translation.norm() < b.camera_from_box.translation.norm();
    });
    LabelText label;
    for (const ObjectView& view : views) {
      const LabelledObject& object = labels.objects()[labels.index_of(view.instance_id)];
      const char* type = kitti_type(object.semantic_class);
      if (type == nullptr) continue;
      const bool is_small = view.whole_px.height() < min_height_px_;
      label.text += is_small ? dont_care_row(view, image)
                             : object_row(type, object, view, image, level, label);
      const char* counted = is_small ? "DontCare" : type;
      for (std::size_t k = 0; k < kTypes.size(); ++k)
        label.num_of_type[k] += std::string_view(kTypes[k]) == counted ? 1 : 0;
    }
    return label;
  }

  static std::string dont_care_row(const ObjectView& view, const geo::CameraIntrinsics& image) {
    return fmt::format("DontCare -1 -1 -10 {} -1 -1 -1 -1000 -1000 -1000 -10\n",
                       box_text(view.whole_px, image));
  }

  static std::string object_row(const char* type, const LabelledObject& object,
                                const ObjectView& view, const geo::CameraIntrinsics& image,
                                const Eigen::Matrix3d& level, LabelText& label) {
    const UprightBox box = upright_box(object, view, level);
    if (!object.is_moving())
      label.largest_tilt_rad = std::max(label.largest_tilt_rad, box.tilt_rad);
    const double alpha = wrapped(box.rotation_y - std::atan2(box.foot.x(), box.foot.z()));
    return fmt::format("{} {:.4f} {} {:.6f} {} {:.4f} {:.4f} {:.4f} {:.4f} {:.4f} {:.4f} {:.6f}\n",
                       type, view.truncation, occlusion_level(view.occlusion()), alpha,
                       box_text(view.whole_px, image), 2.0 * box.half.z(), 2.0 * box.half.y(),
                       2.0 * box.half.x(), box.foot.x(), box.foot.y(), box.foot.z(),
                       box.rotation_y);
  }

  static std::string calibration(const capture::CameraCalibration& camera,
                                 const Eigen::Matrix3d& level) {
    Eigen::Matrix<double, 3, 4> projection = Eigen::Matrix<double, 3, 4>::Zero();
    projection.leftCols<3>() = kitti_camera_matrix(camera) * level.transpose();
    std::string text;
    for (int k = 0; k < 4; ++k) text += fmt::format("P{}: {}\n", k, number_line(projection));
    Eigen::Matrix3d camera_from_velodyne;
    camera_from_velodyne << 0, -1, 0, 0, 0, -1, 1, 0, 0;
    Eigen::Matrix<double, 3, 4> velodyne = Eigen::Matrix<double, 3, 4>::Zero();
    velodyne.leftCols<3>() = camera_from_velodyne;
    const geo::Rigid3d camera_from_body = camera.body_from_camera().inverse();
    Eigen::Matrix<double, 3, 4> imu;
    imu.leftCols<3>() =
        camera_from_velodyne.transpose() * camera_from_body.rotation.toRotationMatrix();
    imu.col(3) = camera_from_velodyne.transpose() * camera_from_body.translation;
    return text + fmt::format("R0_rect: {}\nTr_velo_to_cam: {}\nTr_imu_to_velo: {}\n",
                              number_line(level), number_line(velodyne), number_line(imu));
  }

  std::string rig_ = "mcs4";
  std::string camera_ = "cam0";
  double min_height_px_ = 0.0;
  StatedCalibration calibration_;
};

}  // namespace

ExporterInfo kitti_object_exporter() {
  return {.name = kFormat,
          .summary =
              "KITTI object: images, calibration, boxes of vehicles and people in the image and in "
              "space.",
          .make = []() -> std::unique_ptr<Exporter> {
            return std::make_unique<KittiObjectExporter>();
          }};
}

}  // namespace terracast::exporters
