// TartanAir V1.
//
// World    NED: x north, y east, z down, about the sequence's local origin.
// Camera   FRD: x forward, y right, z down; 640 x 480, f = 320, c = (320, 240) with pixel centres
//          at +0.5, the right camera 0.25 m to the right.
// Pose     camera to world: tx ty tz qx qy qz qw.
// Depth    planar, float32, m; sky 1e5 m or as told.
// Flow     of the left camera, px, from this frame to the next: float32 (height, width, 2). Its mask
//          is 0 where the next frame's camera sees the exact hit point by a free ray, 1 where
//          something hides it (cross and self occlusion are not told apart) and in the sky, 100
//          where it leaves the image. Sky turns with the camera; what comes to lie behind it has
//          flow 0. The format's own generator mixed two rules of pixel centres; this flow is exact.

#include "capture/labels.h"
#include "core/error.h"
#include "core/image_io.h"
#include "core/npy.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "export/additions.h"
#include "export/calibration.h"
#include "export/cameras.h"
#include "export/dataset_writer.h"
#include "export/exporter.h"
#include "export/georeference.h"
#include "export/tartanair_files.h"

namespace terracast::exporters {
namespace {

constexpr const char* kFormat = "tartanair_v1";
/// For forecasts.
constexpr double kBytesPerPixel = 7.5;

core::Image8 flow_mask(const MaskedFlow& flow) {
  core::Image8 mask(flow.motion_px.width(), flow.motion_px.height());
  for (int y = 0; y < mask.height(); ++y)
    for (int x = 0; x < mask.width(); ++x) mask(x, y) = static_cast<std::uint8_t>(flow.mask(x, y));
  return mask;
}

class TartanAirV1Exporter final : public Exporter {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("rig", rig_, "Rig to export: a pair of 640 x 480 px, f = 320 px, 0.25 m apart.");
    visit.key("left", left_, "Its left camera.");
    visit.key("right", right_, "Its right camera.");
    visit.key("environment", environment_,
              "Name of the dataset's environment folder; empty: the world's name.");
    visit.key("difficulty", difficulty_, "Half of the dataset: Easy or Hard.",
              core::one_of({"Easy", "Hard"}));
    visit.key("sky_depth_m", sky_depth_m_,
              "Depth of the sky. Ground as far as that is refused: from on high it can be seen "
              "beyond 100 km.",
              core::between(1.0, 1e9));
  }

  std::unique_ptr<Exporter> clone() const override {
    return std::make_unique<TartanAirV1Exporter>(*this);
  }

  std::vector<std::string> rigs() const override { return {rig_}; }

  void check(const std::vector<capture::CameraCalibration>& cameras) const override {
    const auto& left = cameras[static_cast<std::size_t>(find_camera(cameras, rig_, left_))];
    const auto& right = cameras[static_cast<std::size_t>(find_camera(cameras, rig_, right_))];
    for (const capture::CameraCalibration* each : {&left, &right})
      check_tartanair_camera(*each, 640, 480, kFormat);
    check_tartanair_pair(left, right, kFormat);
    check_environment(environment_, kFormat);
  }

  std::uint32_t flags() const override { return capture::kEdge | capture::kVisibleNext; }

  FrameSize frame_size(const std::vector<capture::CameraCalibration>& cameras) const override {
    const auto& left = cameras[static_cast<std::size_t>(find_camera(cameras, rig_, left_))];
    const auto& right = cameras[static_cast<std::size_t>(find_camera(cameras, rig_, right_))];
    return size_of_images({&left, &right}, kBytesPerPixel);
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
    core::Json list = core::Json::array();
    for (std::size_t i = 0; i < sequences.size(); ++i) {
      const std::string name = fmt::format("P{:03}", i);
      list.push(write_sequence(sequences[i], name,
                               fmt::format("{}/{}/{}", environment, difficulty_, name), writer,
                               context));
    }
    writer.write(environment + "/seg_label_map.json", seg_label_map());
    core::Json description = metadata(
        kFormat, "TartanAir V1", hash, sequences,
        {{"pixel_center", "The centre of pixel i is at i + 0.5: c = (320, 240)."},
         {"world_frame", "North, east, down of WGS84 at the sequence's origin; metres."},
         {"pose",
          "Camera (x forward, y right, z down) to world: tx ty tz qx qy qz qw, a line a frame."},
         {"depth", "Along the optical axis, metres, float32 (height, width)."},
         {"sky", fmt::format("Depth {}; flow of the direction at infinity, mask 1 or 100; class "
                             "sky.",
                             static_cast<float>(sky_depth_m_))},
         {"flow",
          "Left camera, pixels to the next frame, float32 (height, width, 2); mask 0 seen there by "
          "a ray, 1 occluded (of either kind) or sky, 100 out of view."},
         {"segmentation", "Class index, uint8 (height, width); names in seg_label_map.json."}},
        {"seg_label_map.json: names of the classes, as TartanAir V2 has them"});
    description.set("sky_depth_m", static_cast<double>(static_cast<float>(sky_depth_m_)));
    description.set("sequences", std::move(list));
    writer.finish(std::move(description));
  }

 private:
  core::Json write_sequence(const capture::SequenceReader& sequence, const std::string& name,
                            const std::string& path, DatasetWriter& writer,
                            const core::Context& context) const {
    const auto& cameras = sequence.info().cameras;
    const std::vector<ExportedCamera> exported = {{"left", find_camera(cameras, rig_, left_)},
                                                  {"right", find_camera(cameras, rig_, right_)}};
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
      if (frame + 1 < num_frames)
        write_flow(sequence, frame, exported[0].camera_index, path, writer);
      progress.advance();
    });
    return describe_sequence(sequence, local, name, path, exported, StatedCalibration());
  }

  void write_images(const capture::SequenceReader& sequence, int frame, const ExportedCamera& each,
                    const std::string& path, DatasetWriter& writer) const {
    const auto file = [&](const char* kind, const char* suffix) {
      return fmt::format("{}/{}_{}/{:06}_{}{}", path, kind, each.name, frame, each.name, suffix);
    };
    const std::string image = file("image", ".png"), depth = file("depth", "_depth.npy"),
                      seg = file("seg", "_seg.npy");
    const bool has_image = writer.keep(image);
    const bool has_depth = writer.keep(depth);
    const bool has_seg = writer.keep(seg);
    if (has_image && has_depth && has_seg) return;
    const capture::CameraFrame facts = sequence.read_camera(frame, each.camera_index);
    if (!has_image) writer.write(image, core::encode_png(facts.color));
    if (!has_depth) {
      const auto model = geo::make_camera(
          sequence.info().cameras[static_cast<std::size_t>(each.camera_index)].intrinsics);
      writer.write(depth, core::npy_bytes(depth_before_sky(
                              capture::depth_image(*model, facts.range_m), sky_depth_m_,
                              fmt::format("tartanair_v1: frame {} of {}", frame, each.name))));
    }
    if (!has_seg) writer.write(seg, core::npy_bytes(segmentation(facts.semantic_id)));
  }

  static void write_flow(const capture::SequenceReader& sequence, int frame, int left,
                         const std::string& path, DatasetWriter& writer) {
    const std::string stem = fmt::format("{}/flow/{:06}_{:06}", path, frame, frame + 1);
    const std::string flow_file = stem + "_flow.npy", mask_file = stem + "_mask.npy";
    const bool has_flow = writer.keep(flow_file);
    const bool has_mask = writer.keep(mask_file);
    if (has_flow && has_mask) return;
    const MaskedFlow flow = forward_flow(sequence, frame, left);
    if (!has_flow) writer.write(flow_file, core::npy_bytes(flow.motion_px));
    if (!has_mask) writer.write(mask_file, core::npy_bytes(flow_mask(flow)));
  }

  std::string rig_ = "tartan_v1";
  std::string left_ = "left";
  std::string right_ = "right";
  std::string environment_;
  std::string difficulty_ = "Easy";
  double sky_depth_m_ = 1e5;
};

}  // namespace

ExporterInfo tartanair_v1_exporter() {
  return {.name = kFormat,
          .summary = "TartanAir V1: stereo images of 640 x 480, depth, segmentation, flow, poses.",
          .make = []() -> std::unique_ptr<Exporter> {
            return std::make_unique<TartanAirV1Exporter>();
          }};
}

}  // namespace terracast::exporters
