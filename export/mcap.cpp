// MCAP with messages of ROS 2: every sensor of a flight on one clock, for viewers and `ros2 bag play`.
//
// Files    a folder a sequence, which is a bag of rosbag2: <sequence>.mcap and metadata.yaml.
// Frames   earth (WGS84, Earth-fixed) > map (east, north, up at the sequence's origin) > base_link (the vehicle: x forward,
//          y left, z up) > RIG/SENSOR (the sensor's own axes) and RIG/CAMERA_optical (x right, y down, z forward).
//          /tf_static holds all but map > base_link, which /tf has at each frame and each sample of the first IMU.
// Times    log times are true, nanoseconds since 1970; a header's stamp is what the sensor's clock shows. An image's is the
//          middle of its middle line's exposure; a cloud's is the start of its scan.
// Pixels   centres at whole numbers: c is ours less 0.5.
// Models   plumb_bob, rational_polynomial, equidistant.
// Depth    32FC1, along the optical axis, m; sky +inf, nothing known NaN (REP 118).
// Truth    /tf, /truth/odometry and depth; all else is what instruments show.

#include <fmt/ranges.h>

#include <algorithm>

#include "core/error.h"
#include "core/progress.h"
#include "export/additions.h"
#include "export/calibration.h"
#include "export/cameras.h"
#include "export/dataset_writer.h"
#include "export/exporter.h"
#include "export/georeference.h"
#include "export/mcap/bag_writer.h"

namespace terracast::exporters {
namespace {

constexpr const char* kFormat = "mcap";

class McapExporter final : public Exporter {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("rigs", rigs_, "Rigs to export, their cameras and sensors; none named: all.");
    visit.key("images", colors_, "color, or grey, as most programs of odometry read images.",
              core::one_of({"color", "grey"}));
    visit.key("encoding", encoding_,
              "png: sensor_msgs/CompressedImage. raw: sensor_msgs/Image, which needs no plug-in of "
              "image_transport, and takes more space.",
              core::one_of({"png", "raw"}));
    visit.key("depth", has_depth_, "Write depth images (sensor_msgs/Image, 32FC1).");
    calibration_.describe(visit);
  }

  std::unique_ptr<Exporter> clone() const override { return std::make_unique<McapExporter>(*this); }

  std::vector<std::string> rigs() const override { return rigs_; }

  void check(const std::vector<capture::CameraCalibration>& cameras) const override {
    for (const ExportedCamera& taken : cameras_taken(*this, cameras)) {
      const std::string& model =
          cameras[static_cast<std::size_t>(taken.camera_index)].intrinsics.model;
      const auto known = ros_camera_models();
      if (std::find(known.begin(), known.end(), model) == known.end())
        core::fail(core::ErrorKind::Config,
                   "{}: camera {} is of the model {}; ROS's CameraInfo holds {}; name other rigs, "
                   "or export it as terracast, which holds every model",
                   kFormat, taken.name, model, fmt::join(known, ", "));
    }
  }

  FrameSize frame_size(const std::vector<capture::CameraCalibration>& cameras) const override {
    std::vector<const capture::CameraCalibration*> exported;
    for (const ExportedCamera& camera : cameras_taken(*this, cameras))
      exported.push_back(&cameras[static_cast<std::size_t>(camera.camera_index)]);
    const bool is_grey = images().is_grey;
    const double image = images().is_png ? (is_grey ? 0.6 : 1.6) : (is_grey ? 1.0 : 3.0);
    return size_of_images(exported, image + (has_depth_ ? 4.0 : 0.0));
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
    for (const capture::SequenceReader& sequence : sequences)
      list.push(write_sequence(sequence, writer, context));
    core::Json description =
        metadata(kFormat, "MCAP 0, ros2", hash, sequences, conventions(), additions());
    description.set("sequences", std::move(list));
    writer.finish(std::move(description));
  }

 private:
  BagImages images() const {
    return {.is_grey = colors_ == "grey", .is_png = encoding_ == "png", .has_depth = has_depth_};
  }

  static std::vector<std::pair<std::string, std::string>> conventions() {
    return {
        {"pixel_center",
         "The centre of pixel i is at i: CameraInfo's c is dataset.json's less 0.5."},
        {"world_frame", "map: east, north, up of WGS84 at the sequence's origin; metres."},
        {"frames",
         "earth (WGS84, Earth-fixed), map (east, north, up at the sequence's origin), base_link "
         "(the vehicle: x forward, y left, z up), RIG/SENSOR, RIG/CAMERA_optical (x right, y down, "
         "z forward); transforms take points of the child into the parent."},
        {"pose",
         "/tf: base_link in map, exact, at each frame and at each sample of the first IMU."},
        {"time",
         "Log times are true, whole nanoseconds since 1970 (UTC); a header's stamp is what the "
         "sensor's clock shows. An image's is the middle of its middle line's exposure, a cloud's "
         "the start of its scan."},
        {"imu",
         "What the instrument shows: specific force (+9.8 m/s^2 along what points up at rest) and "
         "turn rate against the stars. No orientation: orientation_covariance begins with -1."},
        {"gnss", "altitude is above the ellipsoid; velocity is along east, north and up."},
        {"depth", "Along the optical axis, metres, float32; NaN where nothing is known."},
        {"sky", "+inf in depth."}};
  }

  static std::vector<std::string> additions() {
    return {"metadata.yaml: rosbag2's description of the folder, which makes it a bag"};
  }

  /// Of the file's own record.
  std::map<std::string, std::string> about(const capture::SequenceReader& sequence,
                                           const BagPlan& plan, const LocalFrame& local) const {
    const capture::SequenceInfo& info = sequence.info();
    return {{"sequence", info.name},
            {"utc_start", info.utc_start},
            {"rate_hz", fmt::format("{}", info.rate_hz)},
            {"map_lat_deg", fmt::format("{}", local.origin.lat_deg)},
            {"map_lon_deg", fmt::format("{}", local.origin.lon_deg)},
            {"map_height_m", fmt::format("{}", local.origin.height_m)},
            {"calibration", calibration_.name()},
            {"licences", fmt::format("{}", fmt::join(info.licences, "\n"))},
            {"left_out", fmt::format("{}", fmt::join(plan.left_out, ", "))}};
  }

  core::Json write_sequence(const capture::SequenceReader& sequence, DatasetWriter& writer,
                            const core::Context& context) const {
    const capture::SequenceInfo& info = sequence.info();
    const std::string& path = info.name;
    const LocalFrame local = local_frame(sequence);
    const BagPlan plan = plan_bag(*this, info, images());
    if (!plan.left_out.empty())
      context.log.warn(
          "{}: {} sensors of sequence {} are left out, for which ROS has no message: {}", kFormat,
          plan.left_out.size(), info.name, fmt::join(plan.left_out, ", "));
    const std::vector<ExportedCamera> cameras = cameras_taken(*this, info.cameras);
    write_bag(sequence, plan, local, writer, context);
    write_additions(writer, path, sequence, cameras, scan_forms);
    core::Json entry = describe_sequence(sequence, local, info.name, path, cameras, calibration_);
    if (!plan.left_out.empty()) entry.set("left_out", core::Json::array_of(plan.left_out));
    return entry;
  }

  void write_bag(const capture::SequenceReader& sequence, const BagPlan& plan,
                 const LocalFrame& local, DatasetWriter& writer,
                 const core::Context& context) const {
    const std::string& name = sequence.info().name;
    const std::string file = name + ".mcap", yaml = name + "/metadata.yaml";
    const auto num_images =
        static_cast<std::int64_t>(sequence.frames().size() * plan.cameras.size());
    core::Progress progress(context, "images", num_images);
    const bool has_file = writer.keep(name + "/" + file);
    if (has_file && writer.keep(yaml)) {
      progress.skip(num_images);
      return;
    }
    std::string description;
    const BagImages written = images();
    writer.write_by(name + "/" + file, [&](const std::filesystem::path& temporary) {
      description = BagWriter(sequence, plan, written, calibration_, local)
                        .write(temporary, file, about(sequence, plan, local), progress);
    });
    writer.write(yaml, bag_metadata_yaml(description));
  }

  std::vector<std::string> rigs_;
  std::string colors_ = "color";
  std::string encoding_ = "png";
  bool has_depth_ = true;
  StatedCalibration calibration_;
};

}  // namespace

ExporterInfo mcap_exporter() {
  return {.name = kFormat,
          .summary = "MCAP with messages of ROS 2: all sensors, transforms and depth on one clock.",
          .make = []() -> std::unique_ptr<Exporter> { return std::make_unique<McapExporter>(); }};
}

}  // namespace terracast::exporters
