// TartanAir V2.
//
// World    NED: x north, y east, z down, about the sequence's local origin.
// Camera   FRD: x forward, y right, z down; 640 x 640, f = 320, c = (320, 320) with pixel centres
//          at +0.5, the right camera 0.25 m to the right. Readers have these numbers written into
//          their code.
// Pose     camera to world: tx ty tz qx qy qz qw.
// Depth    planar, the bytes of a little-endian float32 in an RGBA PNG in the order in which OpenCV
//          hands them out (B, G, R, A): R is byte 2, G byte 1, B byte 0, A byte 3. Sky 1e5 m or as
//          told.
// Flow     px, from this frame to the next and back. In view: lands in the image. Co-visible: the
//          ray from the other frame's camera to the exact hit point is free; depths are never
//          compared. Sky turns with the camera and is never co-visible; what comes to lie behind
//          the camera has flow 0 and both masks false.

#include <cmath>

#include "capture/channel.h"
#include "capture/labels.h"
#include "core/error.h"
#include "core/image_io.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "export/cameras.h"
#include "export/dataset_writer.h"
#include "export/exporter.h"
#include "export/georeference.h"
#include "export/npy.h"
#include "export/npz.h"

namespace terracast::exporters {
namespace {

using core::ErrorKind;
using core::fail;

constexpr const char* kFormat = "tartanair";
constexpr double kBaseline_m = 0.25;

Eigen::Matrix3d ned_from_enu() {
  return (Eigen::Matrix3d() << 0, 1, 0, 1, 0, 0, 0, 0, -1).finished();
}
Eigen::Matrix3d rdf_from_frd() {
  return (Eigen::Matrix3d() << 0, 1, 0, 0, 0, 1, 1, 0, 0).finished();
}

std::string pose_line(const geo::Rigid3d& enu_from_camera) {
  const Eigen::Vector3d t = ned_from_enu() * enu_from_camera.translation;
  const Eigen::Quaterniond q = canonical(Eigen::Quaterniond(Eigen::Matrix3d(
      ned_from_enu() * enu_from_camera.rotation.toRotationMatrix() * rdf_from_frd())));
  return fmt::format("{:.9f} {:.9f} {:.9f} {:.15f} {:.15f} {:.15f} {:.15f}\n", t.x(), t.y(), t.z(),
                     q.x(), q.y(), q.z(), q.w());
}

/// Depth as a float32's bytes in the order that OpenCV undoes.
core::Image8 depth_png(const core::ImageF& depth_m, float sky_depth_m, const std::string& where) {
  core::Image8 rgba(depth_m.width(), depth_m.height(), 4);
  for (int y = 0; y < depth_m.height(); ++y) {
    for (int x = 0; x < depth_m.width(); ++x) {
      float value_m = depth_m(x, y);
      if (std::isinf(value_m)) {
        value_m = sky_depth_m;
      } else if (!(value_m < sky_depth_m)) {
        fail(ErrorKind::Input,
             "{}, pixel ({}, {}): a depth of {} m cannot be told from the sky's {} m; a greater "
             "sky_depth_m in this export would do",
             where, x, y, value_m, sky_depth_m);
      }
      const auto bits = std::bit_cast<std::uint32_t>(value_m);
      rgba(x, y, 0) = static_cast<std::uint8_t>(bits >> 16);
      rgba(x, y, 1) = static_cast<std::uint8_t>(bits >> 8);
      rgba(x, y, 2) = static_cast<std::uint8_t>(bits);
      rgba(x, y, 3) = static_cast<std::uint8_t>(bits >> 24);
    }
  }
  return rgba;
}

core::Image8 segmentation(const core::ImageU32& semantic_id) {
  core::Image8 classes(semantic_id.width(), semantic_id.height());
  for (std::size_t i = 0; i < classes.data().size(); ++i)
    classes.data()[i] = static_cast<std::uint8_t>(semantic_id.data()[i]);
  return classes;
}

/// Flow in one direction with its two masks.
struct MaskedFlow {
  core::ImageF motion_px;  ///< 2 channels, finite
  core::Image8 is_in_view;
  core::Image8 is_covisible;
};

MaskedFlow masked_flow(const capture::CameraView& from, const capture::CameraView& to,
                       const capture::CameraFrame& facts, std::uint32_t visible_flag) {
  MaskedFlow flow;
  flow.motion_px = capture::flow_image(from, to, facts.range_m);
  const int width = facts.range_m.width(), height = facts.range_m.height();
  flow.is_in_view = core::Image8(width, height);
  flow.is_covisible = core::Image8(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      float& u = flow.motion_px(x, y, 0);
      float& v = flow.motion_px(x, y, 1);
      if (!std::isfinite(u) || !std::isfinite(v)) {
        u = v = 0.0F;
        continue;
      }
      const Eigen::Vector2d target =
          capture::pixel_center(x, y) +
          Eigen::Vector2d(static_cast<double>(u), static_cast<double>(v));
      const bool is_seen =
          (facts.flags(x, y) & visible_flag) != 0 && !std::isinf(facts.range_m(x, y));
      flow.is_covisible(x, y) = is_seen ? 1 : 0;
      // A point that is seen is in view, even where a float's rounding puts it on the border.
      flow.is_in_view(x, y) = is_seen || to.model.contains(target) ? 1 : 0;
    }
  }
  return flow;
}

std::vector<std::byte> planar_npy(const core::ImageF& motion_px) {
  const std::size_t num_pixels = motion_px.num_pixels();
  std::vector<float> planes(2 * num_pixels);
  for (std::size_t i = 0; i < num_pixels; ++i) {
    planes[i] = motion_px.data()[2 * i];
    planes[num_pixels + i] = motion_px.data()[2 * i + 1];
  }
  return npy_bytes(planes, {1, 2, motion_px.height(), motion_px.width()});
}

std::vector<std::byte> flow_npz(const MaskedFlow& forward, const MaskedFlow& backward) {
  const auto mask = [](const core::Image8& image) {
    return npy_bool_bytes(image.data(), {1, image.height(), image.width()});
  };
  // Floats of a flow hardly shrink; masks shrink to nothing.
  return npz_bytes({{"flow_fwd", planar_npy(forward.motion_px), false},
                    {"flow_bwd", planar_npy(backward.motion_px), false},
                    {"fov_mask_fwd", mask(forward.is_in_view), true},
                    {"fov_mask_bwd", mask(backward.is_in_view), true},
                    {"covisible_mask_fwd", mask(forward.is_covisible), true},
                    {"covisible_mask_bwd", mask(backward.is_covisible), true}});
}

/// The older form: steps of 1/64 px, the mask in red, v in green and u in blue, as OpenCV turns
/// them round.
core::Image16 flow_png(const MaskedFlow& forward) {
  constexpr std::uint16_t kOccluded = 1, kOutOfView = 100, kOverRange = 200;
  const core::ImageF& motion_px = forward.motion_px;
  core::Image16 image(motion_px.width(), motion_px.height(), 3);
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      std::uint16_t mask = forward.is_in_view(x, y) == 0     ? kOutOfView
                           : forward.is_covisible(x, y) == 0 ? kOccluded
                                                             : 0;
      for (int k = 0; k < 2; ++k) {
        const double counts = std::round(static_cast<double>(motion_px(x, y, k)) * 64.0) + 32768.0;
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
    visit.key("rig", rig_, "Rig to export: a pair of 640 x 640 px, f = 320 px, 0.25 m apart.");
    visit.key("left", left_, "Its left camera, lcam_front in the dataset.");
    visit.key("right", right_, "Its right camera, rcam_front in the dataset.");
    visit.key("environment", environment_,
              "Name of the dataset's environment folder; empty: the world's name.");
    visit.key("difficulty", difficulty_, "Half of the dataset: Data_easy or Data_hard.",
              core::one_of({"easy", "hard"}));
    visit.key("flow", flow_,
              "Form of the optical flow: npz (float32, both ways, masks) or png (1/64 px, forward, "
              "at most 512 px).",
              core::one_of({"npz", "png"}));
    visit.key("sky_depth_m", sky_depth_m_,
              "Depth of the sky. Ground as far as that is refused: from on high it can be seen "
              "beyond 100 km.",
              core::between(1.0, 1e9));
  }

  std::unique_ptr<Exporter> clone() const override {
    return std::make_unique<TartanAirExporter>(*this);
  }

  void check(const std::vector<capture::CameraCalibration>& cameras) const override {
    const capture::CameraCalibration& left = camera(cameras, left_);
    const capture::CameraCalibration& right = camera(cameras, right_);
    for (const capture::CameraCalibration* each : {&left, &right}) {
      check_pinhole(*each, kFormat);
      const geo::CameraIntrinsics& k = each->intrinsics;
      if (k.width_px != 640 || k.height_px != 640 ||
          k.parameters != std::vector<double>{320.0, 320.0, 320.0, 320.0})
        fail(ErrorKind::Config,
             "tartanair: camera {}/{} is {} x {} px with fx {}, fy {}, cx {}, cy {} px; the format "
             "holds 640 x 640 px with f = 320 px and c = (320, 320) px alone",
             each->rig, each->name, k.width_px, k.height_px, k.parameters[0], k.parameters[1],
             k.parameters[2], k.parameters[3]);
    }
    const double baseline_m = rectified_baseline_m(left, right, kFormat);
    if (!(std::abs(baseline_m - kBaseline_m) <= 1e-9))
      fail(ErrorKind::Config,
           "tartanair: cameras {} and {} of {} are {} m apart; the format's baseline is {} m",
           left_, right_, rig_, baseline_m, kBaseline_m);
    if (!environment_.empty() && environment_ != folder_word(environment_))
      fail(ErrorKind::Config, "tartanair: environment = \"{}\": letters, digits, _ and - are right",
           environment_);
  }

  void write(const std::vector<capture::SequenceReader>& sequences,
             const std::filesystem::path& folder, const core::Context& context) const override {
    const std::string hash = source_hash(kFormat, *this, sequences);
    DatasetWriter writer(folder, kFormat, hash, context);
    if (writer.is_complete()) {
      context.log.info("{}: finished already, its sources are unchanged", folder.string());
      return;
    }
    const std::string environment =
        environment_.empty() ? folder_word(sequences.front().info().world_name) : environment_;
    core::Json list = core::Json::array();
    for (std::size_t i = 0; i < sequences.size(); ++i) {
      const std::string name = fmt::format("P{:03}", i);
      const std::string path = fmt::format("{}/Data_{}/{}", environment, difficulty_, name);
      list.push(write_sequence(sequences[i], name, path, writer, context));
    }
    core::Json labels = core::Json::object();
    for (std::size_t i = 0; i < capture::semantic_class_names().size(); ++i)
      labels.set(capture::semantic_class_names()[i], static_cast<int>(i));
    writer.write(environment + "/seg_label_map.json",
                 core::Json::object().set("name_map", std::move(labels)).text() + "\n");
    core::Json description = metadata(
        kFormat, "TartanAir V2", hash, sequences,
        {{"pixel_center", "The centre of pixel i is at i + 0.5: c = (320, 320)."},
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
         {"imu", "None in this version."}},
        {"dataset.json: this file",
         "georeference.csv: every camera's place on WGS84 and its rotation there"});
    description.set("sky_depth_m", static_cast<double>(static_cast<float>(sky_depth_m_)));
    description.set("sequences", std::move(list));
    writer.finish(std::move(description));
  }

 private:
  const capture::CameraCalibration& camera(const std::vector<capture::CameraCalibration>& cameras,
                                           const std::string& name) const {
    return cameras[static_cast<std::size_t>(find_camera(cameras, rig_, name))];
  }

  core::Json write_sequence(const capture::SequenceReader& sequence, const std::string& name,
                            const std::string& path, DatasetWriter& writer,
                            const core::Context& context) const {
    const auto& cameras = sequence.info().cameras;
    const std::vector<ExportedCamera> exported = {
        {"lcam_front", find_camera(cameras, rig_, left_)},
        {"rcam_front", find_camera(cameras, rig_, right_)}};
    const LocalFrame local = local_frame(sequence);
    for (const ExportedCamera& each : exported) {
      std::string poses;
      for (const capture::FrameRecord& record : sequence.frames())
        poses += pose_line(local_from_camera(local, sequence, record.index, each.camera_index));
      writer.write(fmt::format("{}/pose_{}.txt", path, each.name), poses);
    }
    const std::string georeference = path + "/georeference.csv";
    writer.write(georeference, georeference_csv(sequence, exported));

    const auto num_frames = static_cast<std::int64_t>(sequence.frames().size());
    core::Progress progress(context, "frames", num_frames);
    core::parallel_for(num_frames, [&](std::int64_t i) {
      const auto frame = static_cast<int>(i);
      for (const ExportedCamera& each : exported) write_images(sequence, frame, each, path, writer);
      if (frame + 1 < num_frames) write_flow(sequence, frame, exported[0], path, writer);
      progress.advance();
    });
    return describe_sequence(sequence, local, name, path, georeference, exported);
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
      writer.write(
          depth, core::encode_png(depth_png(
                     capture::depth_image(*model, facts.range_m), static_cast<float>(sky_depth_m_),
                     fmt::format("tartanair: frame {} of {}", frame, each.name))));
    }
    if (!has_seg) writer.write(seg, core::encode_png(segmentation(facts.semantic_id)));
  }

  void write_flow(const capture::SequenceReader& sequence, int frame, const ExportedCamera& left,
                  const std::string& path, DatasetWriter& writer) const {
    const std::string stem = fmt::format("{}/flow_lcam_front/{:06}_{:06}", path, frame, frame + 1);
    const std::string file = flow_ == "npz" ? stem + "_lcam_front_flow.npz" : stem + "_flow.png";
    if (writer.keep(file)) return;
    const auto model = geo::make_camera(
        sequence.info().cameras[static_cast<std::size_t>(left.camera_index)].intrinsics);
    const capture::CameraView now{*model, sequence.world_from_camera(frame, left.camera_index)};
    const capture::CameraView next{*model,
                                   sequence.world_from_camera(frame + 1, left.camera_index)};
    const MaskedFlow forward = masked_flow(
        now, next, sequence.read_camera(frame, left.camera_index, capture::SequenceReader::kFacts),
        capture::kVisibleNext);
    if (flow_ == "png") {
      writer.write(file, core::encode_png(flow_png(forward)));
      return;
    }
    const MaskedFlow backward = masked_flow(
        next, now,
        sequence.read_camera(frame + 1, left.camera_index, capture::SequenceReader::kFacts),
        capture::kVisiblePrevious);
    writer.write(file, flow_npz(forward, backward));
  }

  std::string rig_ = "tartan2";
  std::string left_ = "lcam_front";
  std::string right_ = "rcam_front";
  std::string environment_;
  std::string difficulty_ = "easy";
  std::string flow_ = "npz";
  double sky_depth_m_ = 1e5;
};

}  // namespace

ExporterInfo tartanair_exporter() {
  return {
      .name = kFormat,
      .summary = "TartanAir V2: stereo images, depth, segmentation, flow, poses.",
      .make = []() -> std::unique_ptr<Exporter> { return std::make_unique<TartanAirExporter>(); }};
}

}  // namespace terracast::exporters
