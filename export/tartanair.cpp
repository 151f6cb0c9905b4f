// TartanAir V2.
//
// World    NED: x north, y east, z down, about the sequence's local origin.
// Camera   FRD: x forward, y right, z down; 640 x 640, f = 320, c = (320, 320) with pixel centres
//          at +0.5, the right camera 0.25 m to the right. Readers have these numbers written into
//          their code. A side's faces (front, left, right, back, top, bottom) share one centre;
//          top's image has backward at its upper edge, bottom's forward.
// Name     P000, P001, …; of TartanGround's kinds of motion P0000, P1000 or P2000 and on.
// Pose     camera to world: tx ty tz qx qy qz qw.
// Depth    planar, the bytes of a little-endian float32 in an RGBA PNG in the order in which OpenCV
//          hands them out (B, G, R, A): R is byte 2, G byte 1, B byte 0, A byte 3. Sky 1e5 m or as
//          told.
// Flow     px, from this frame to the next and back. In view: lands in the image. Co-visible: the
//          ray from the other frame's camera to the exact hit point is free; depths are never
//          compared. Sky turns with the camera and is never co-visible; what comes to lie behind
//          the camera has flow 0 and both masks false.

#include <cmath>
#include <numbers>

#include "capture/labels.h"
#include "core/error.h"
#include "core/image_io.h"
#include "core/npy.h"
#include "core/npz.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "export/additions.h"
#include "export/calibration.h"
#include "export/cameras.h"
#include "export/dataset_writer.h"
#include "export/exporter.h"
#include "export/frame_scans.h"
#include "export/georeference.h"
#include "export/tartanair_files.h"
#include "export/tartanair_sensors.h"
#include "geo/units.h"

namespace terracast::exporters {
namespace {

using core::ErrorKind;
using core::fail;

constexpr const char* kFormat = "tartanair";
/// For forecasts.
constexpr double kBytesPerPixel = 11.0;

/// A direction that cameras of the format look in.
struct Face {
  std::string_view name;
  double angle_rad;
  Eigen::Vector3d
      axis_frd;  ///< of the turn from the front camera's axes, x forward, y right, z down
};

/// Those beside the front: cameras of the rig that are called lcam_left, rcam_top, …
const std::vector<Face>& side_faces() {
  constexpr double kQuarter_rad = 0.5 * std::numbers::pi;
  static const std::vector<Face> faces = {{"left", -kQuarter_rad, Eigen::Vector3d::UnitZ()},
                                          {"right", kQuarter_rad, Eigen::Vector3d::UnitZ()},
                                          {"back", 2.0 * kQuarter_rad, Eigen::Vector3d::UnitZ()},
                                          {"top", kQuarter_rad, Eigen::Vector3d::UnitY()},
                                          {"bottom", -kQuarter_rad, Eigen::Vector3d::UnitY()}};
  return faces;
}

/// throws   Config: the camera does not stand where the front one of its side stands, or is turned
///          otherwise than its name says
void check_face(const capture::CameraCalibration& front, const capture::CameraCalibration& camera,
                const Face& face) {
  constexpr double kTolerance = 1e-9;  // of rad and m: rounding, not a misalignment
  const geo::Rigid3d front_from_camera = front.rig_from_camera.inverse() * camera.rig_from_camera;
  const Eigen::Vector3d axis_rdf = rdf_from_frd() * face.axis_frd;
  const double off_rad = front_from_camera.rotation.angularDistance(
      Eigen::Quaterniond(Eigen::AngleAxisd(face.angle_rad, axis_rdf)));
  const double off_m = front_from_camera.translation.norm();
  if (off_rad <= kTolerance && off_m <= kTolerance) return;
  fail(ErrorKind::Config,
       "tartanair: camera {} of {} stands {:.3g} m from {} and is turned {:.3g} deg from where the "
       "format's {} looks; the six faces of a side share one centre (configs/rigs/tartan12.toml "
       "has them)",
       camera.name, camera.rig, off_m, front.name, geo::degrees_from_radians(off_rad), camera.name);
}

/// throws   Config: either has a rolling shutter, and the images of a side have no one pose
void check_face_shutters(const capture::CameraCalibration& front,
                         const capture::CameraCalibration& camera) {
  for (const capture::CameraCalibration* each : {&front, &camera})
    if (each->shutter.is_rolling())
      fail(ErrorKind::Config,
           "tartanair: camera {} of {} has a rolling shutter (line_time_us = {}); readers stitch "
           "the six faces of "
           "a side into one image of one pose, and their seams would be of several times: a front "
           "pair alone, or "
           "line_time_us = 0, is right",
           each->name, each->rig, 1e6 * each->shutter.line_time_s);
}

/// Depth as a float32's bytes in the order that OpenCV undoes.
core::Image8 depth_png(const core::ImageF& depth_m) {
  core::Image8 rgba(depth_m.width(), depth_m.height(), 4);
  for (int y = 0; y < depth_m.height(); ++y) {
    for (int x = 0; x < depth_m.width(); ++x) {
      const auto bits = std::bit_cast<std::uint32_t>(depth_m(x, y));
      rgba(x, y, 0) = static_cast<std::uint8_t>(bits >> 16);
      rgba(x, y, 1) = static_cast<std::uint8_t>(bits >> 8);
      rgba(x, y, 2) = static_cast<std::uint8_t>(bits);
      rgba(x, y, 3) = static_cast<std::uint8_t>(bits >> 24);
    }
  }
  return rgba;
}

std::vector<std::byte> planar_npy(const core::ImageF& motion_px) {
  const std::size_t num_pixels = motion_px.num_pixels();
  std::vector<float> planes(2 * num_pixels);
  for (std::size_t i = 0; i < num_pixels; ++i) {
    planes[i] = motion_px.data()[2 * i];
    planes[num_pixels + i] = motion_px.data()[2 * i + 1];
  }
  return core::npy_bytes(planes, {1, 2, motion_px.height(), motion_px.width()});
}

std::vector<std::byte> flow_npz(const MaskedFlow& forward, const MaskedFlow& backward) {
  const auto mask = [](const core::Image8& image) {
    return core::npy_bool_bytes(image.data(), {1, image.height(), image.width()});
  };
  // Floats of a flow hardly shrink; masks shrink to nothing.
  return core::npz_bytes({{"flow_fwd", planar_npy(forward.motion_px), false},
                          {"flow_bwd", planar_npy(backward.motion_px), false},
                          {"fov_mask_fwd", mask(forward.is_in_view), true},
                          {"fov_mask_bwd", mask(backward.is_in_view), true},
                          {"covisible_mask_fwd", mask(forward.is_covisible), true},
                          {"covisible_mask_bwd", mask(backward.is_covisible), true}});
}

/// Of the older form.
constexpr double kFlowStep_px = 1.0 / 64.0;

/// The older form: the mask in red, v in green and u in blue, as OpenCV turns them round.
core::Image16 flow_png(const MaskedFlow& forward) {
  constexpr std::uint16_t kOverRange = 200;
  const core::ImageF& motion_px = forward.motion_px;
  core::Image16 image(motion_px.width(), motion_px.height(), 3);
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      std::uint16_t mask = forward.mask(x, y);
      for (int k = 0; k < 2; ++k) {
        const double counts =
            std::round(static_cast<double>(motion_px(x, y, k)) / kFlowStep_px) + 32768.0;
        if (!(counts >= 0.0 && counts <= 65535.0)) mask = kOverRange;
        image(x, y, 2 - k) = static_cast<std::uint16_t>(std::clamp(counts, 0.0, 65535.0));
      }
      image(x, y, 0) = mask;
    }
  }
  return image;
}

class TartanAirExporter final : public Exporter {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("rig", rig_,
              "Rig to export: a pair of 640 x 640 px, f = 320 px, 0.25 m apart. Its cameras called "
              "lcam_left, rcam_top and so on are exported with it.");
    visit.key("left", left_, "Its left camera, lcam_front in the dataset.");
    visit.key("right", right_, "Its right camera, rcam_front in the dataset.");
    visit.key("environment", environment_,
              "Name of the dataset's environment folder; empty: the world's name.");
    visit.key("difficulty", difficulty_,
              "Part of the dataset: Data_easy or Data_hard; TartanGround's Data_omni (P0000, …), "
              "Data_diff (P1000, …) or Data_anymal (P2000, …).",
              core::one_of({"easy", "hard", "omni", "diff", "anymal"}));
    visit.key("flow", flow_,
              "Form of the optical flow: npz (float32, both ways, masks) or png (1/64 px, forward, "
              "at most 512 px).",
              core::one_of({"npz", "png"}));
    visit.key("sky_depth_m", sky_depth_m_,
              "Depth of the sky. Ground as far as that is refused: from on high it can be seen "
              "beyond 100 km.",
              core::between(1.0, 1e9));
    lidar_.describe(visit);
    visit.key("imu", imu_,
              "Write imu/, where the rig has an IMU at its left camera's place with ten samples a "
              "frame, or a whole multiple of ten.");
  }

  std::unique_ptr<Exporter> clone() const override {
    return std::make_unique<TartanAirExporter>(*this);
  }

  std::vector<std::string> rigs() const override { return {rig_}; }

  void check(const std::vector<capture::CameraCalibration>& cameras) const override {
    for (const ExportedCamera& each : exported_cameras(cameras))
      check_tartanair_camera(cameras[static_cast<std::size_t>(each.camera_index)], 640, 640,
                             kFormat);
    check_tartanair_pair(camera(cameras, left_), camera(cameras, right_), kFormat);
    for (const Face& face : side_faces())
      for (const bool is_left : {true, false})
        if (const auto* each = side_camera(cameras, face, is_left)) {
          check_face(camera(cameras, is_left ? left_ : right_), *each, face);
          check_face_shutters(camera(cameras, is_left ? left_ : right_), *each);
        }
    check_environment(environment_, kFormat);
  }

  std::uint32_t flags() const override {
    constexpr std::uint32_t kForward = capture::kEdge | capture::kVisibleNext;
    return flow_ == "npz" ? kForward | capture::kVisiblePrevious : kForward;
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
    const std::string environment = environment_of(environment_, sequences);
    const Numbering numbering = numbering_of(sequences.size());
    core::Json list = core::Json::array();
    bool has_lidar = false, has_imu = false;
    for (std::size_t i = 0; i < sequences.size(); ++i) {
      const std::string name = fmt::format("P{:0{}}", numbering.first + i, numbering.num_digits);
      const std::string path = fmt::format("{}/Data_{}/{}", environment, difficulty_, name);
      core::Json entry = write_sequence(sequences[i], name, path, writer, context);
      has_lidar = has_lidar || entry.has("lidar");
      has_imu = has_imu || entry.has("imu");
      list.push(std::move(entry));
    }
    writer.write(environment + "/seg_label_map.json", seg_label_map());
    std::vector<std::pair<std::string, std::string>> conventions = {
        {"pixel_center", "The centre of pixel i is at i + 0.5: c = (320, 320)."},
        {"world_frame", "North, east, down of WGS84 at the sequence's origin; metres."},
        {"pose",
         "Camera (x forward, y right, z down) to world: tx ty tz qx qy qz qw, a line a frame."},
        {"depth",
         "Along the optical axis, metres; float32 bytes in an RGBA PNG, in OpenCV's order."},
        {"sky", fmt::format("Depth {}; flow of the direction at infinity, never co-visible; "
                            "class sky.",
                            static_cast<float>(sky_depth_m_))},
        {"flow",
         flow_ == "npz"
             ? "Pixels to the next frame and back, float32; masks by rays, not by depths."
             : "Pixels to the next frame times 64 plus 32768; mask 0 valid, 1 occluded or sky, "
               "100 out of view, 200 over range."},
        {"segmentation", "Class index; names in seg_label_map.json."},
        {"imu", has_imu
                    ? "Truth at lcam_front, x forward, y right, z down, ten samples a frame; acc "
                      "has TartanAir's gravity of 9.8 m/s^2, downwards at the sequence's origin."
                    : "None in this version."}};
    if (has_lidar)
      conventions.emplace_back(
          "lidar",
          "x right, y forward, z up of lcam_front, about its centre: each pulse whose time is "
          "nearest to the frame's (floor(time_s * rate_hz + 0.5) is its number), carried to the "
          "frame's time; bodies that move stay where their pulse met them.");
    core::Json description =
        metadata(kFormat, numbering.format_version, hash, sequences, conventions, {});
    description.set("sky_depth_m", static_cast<double>(static_cast<float>(sky_depth_m_)));
    description.set("sequences", std::move(list));
    writer.finish(std::move(description));
  }

 private:
  const capture::CameraCalibration& camera(const std::vector<capture::CameraCalibration>& cameras,
                                           const std::string& name) const {
    return cameras[static_cast<std::size_t>(find_camera(cameras, rig_, name))];
  }

  /// A camera beside the front ones; null where the rig has none of the name.
  const capture::CameraCalibration* side_camera(
      const std::vector<capture::CameraCalibration>& cameras, const Face& face,
      bool is_left) const {
    const int index = side_camera_index(cameras, face, is_left);
    return index < 0 ? nullptr : &cameras[static_cast<std::size_t>(index)];
  }
  int side_camera_index(const std::vector<capture::CameraCalibration>& cameras, const Face& face,
                        bool is_left) const {
    const std::string name = fmt::format("{}cam_{}", is_left ? 'l' : 'r', face.name);
    for (std::size_t i = 0; i < cameras.size(); ++i)
      if (cameras[i].rig == rig_ && cameras[i].name == name) return static_cast<int>(i);
    return -1;
  }

  /// The front pair, then whatever other faces the rig has.
  std::vector<ExportedCamera> exported_cameras(
      const std::vector<capture::CameraCalibration>& cameras) const {
    std::vector<ExportedCamera> exported = {
        {"lcam_front", find_camera(cameras, rig_, left_), flow_ == "png" ? kFlowStep_px : 0.0},
        {"rcam_front", find_camera(cameras, rig_, right_)}};
    for (const Face& face : side_faces())
      for (const bool is_left : {true, false})
        if (const int index = side_camera_index(cameras, face, is_left); index >= 0)
          exported.push_back({cameras[static_cast<std::size_t>(index)].name, index});
    return exported;
  }

  struct Numbering {
    const char* format_version;
    std::size_t first;
    int num_digits;
  };
  /// TartanGround counts each kind of motion by its own thousand.
  Numbering numbering_of(std::size_t num_sequences) const {
    if (difficulty_ == "easy" || difficulty_ == "hard") return {"TartanAir V2", 0, 3};
    constexpr std::size_t kMost = 1000;
    if (num_sequences > kMost)
      fail(ErrorKind::Config, "tartanair: {} sequences; TartanGround numbers at most {} of a kind",
           num_sequences, kMost);
    return {"TartanGround (TartanAir V2)",
            difficulty_ == "omni"   ? 0
            : difficulty_ == "diff" ? kMost
                                    : 2 * kMost,
            4};
  }

  core::Json write_sequence(const capture::SequenceReader& sequence, const std::string& name,
                            const std::string& path, DatasetWriter& writer,
                            const core::Context& context) const {
    const std::vector<ExportedCamera> exported = exported_cameras(sequence.info().cameras);
    const LocalFrame local = local_frame(sequence);
    for (const ExportedCamera& each : exported)
      writer.write(fmt::format("{}/pose_{}.txt", path, each.name),
                   ned_poses(sequence, local, each.camera_index));
    write_additions(writer, path, sequence, exported, scan_forms);

    const auto num_frames = static_cast<std::int64_t>(sequence.frames().size());
    core::Progress progress(context, "frames", num_frames);
    core::parallel_for(num_frames, [&](std::int64_t i) {
      const auto frame = static_cast<int>(i);
      for (const ExportedCamera& each : exported) write_images(sequence, frame, each, path, writer);
      if (frame + 1 < num_frames) write_flow(sequence, frame, exported[0], path, writer);
      progress.advance();
    });
    core::Json entry =
        describe_sequence(sequence, local, name, path, exported, StatedCalibration());
    const int left = exported[0].camera_index;
    if (const auto scans = FrameScans::find(sequence, rig_, lidar_, kFormat, context))
      entry.set("lidar", write_tartanair_scans(*scans, left, path, writer, context));
    if (!imu_) return entry;
    core::Json imu = write_tartanair_imu(sequence, rig_, left, path, writer, context);
    if (!imu.is_null()) entry.set("imu", std::move(imu));
    return entry;
  }

  void write_images(const capture::SequenceReader& sequence, int frame, const ExportedCamera& each,
                    const std::string& path, DatasetWriter& writer) const {
    const auto file = [&](const char* kind, const char* suffix) {
      return fmt::format("{}/{}_{}/{:06}_{}{}.png", path, kind, each.name, frame, each.name,
                         suffix);
    };
    const std::string image = file("image", ""), depth = file("depth", "_depth"),
                      seg = file("seg", "_seg");
    const bool has_image = writer.keep(image);
    const bool has_depth = writer.keep(depth);
    const bool has_seg = writer.keep(seg);
    if (has_image && has_depth && has_seg) return;
    const capture::CameraFrame facts = sequence.read_camera(frame, each.camera_index);
    if (!has_image) writer.write(image, core::encode_png(facts.color));
    if (!has_depth) {
      const auto model = geo::make_camera(
          sequence.info().cameras[static_cast<std::size_t>(each.camera_index)].intrinsics);
      writer.write(depth, core::encode_png(depth_png(depth_before_sky(
                              capture::depth_image(*model, facts.range_m), sky_depth_m_,
                              fmt::format("tartanair: frame {} of {}", frame, each.name)))));
    }
    if (!has_seg) writer.write(seg, core::encode_png(segmentation(facts.semantic_id)));
  }

  void write_flow(const capture::SequenceReader& sequence, int frame, const ExportedCamera& left,
                  const std::string& path, DatasetWriter& writer) const {
    const std::string stem = fmt::format("{}/flow_lcam_front/{:06}_{:06}", path, frame, frame + 1);
    const std::string file = flow_ == "npz" ? stem + "_lcam_front_flow.npz" : stem + "_flow.png";
    if (writer.keep(file)) return;
    const MaskedFlow forward = forward_flow(sequence, frame, left.camera_index);
    if (flow_ == "png") {
      writer.write(file, core::encode_png(flow_png(forward)));
      return;
    }
    writer.write(file, flow_npz(forward, backward_flow(sequence, frame, left.camera_index)));
  }

  std::string rig_ = "tartan2";
  std::string left_ = "lcam_front";
  std::string right_ = "rcam_front";
  std::string environment_;
  std::string difficulty_ = "easy";
  std::string flow_ = "npz";
  double sky_depth_m_ = 1e5;
  LidarChoice lidar_;
  bool imu_ = true;
};

}  // namespace

ExporterInfo tartanair_exporter() {
  return {
      .name = kFormat,
      .summary = "TartanAir V2: stereo images, depth, segmentation, flow, poses, lidar, IMU.",
      .make = []() -> std::unique_ptr<Exporter> { return std::make_unique<TartanAirExporter>(); }};
}

}  // namespace terracast::exporters
