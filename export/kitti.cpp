// KITTI odometry.
//
// Camera   RDF: x right, y down, z forward. image_0 and image_1 are the left and right camera in
//          grey, image_2 and image_3 the same two in colour; all are rectified and stand where
//          cameras 0 and 1 stand.
// Pixels   centres at whole numbers (the convention of those who read the format): c is ours less
//          0.5.
// Pose     camera 0 of frame i to camera 0 of frame 0, 3 x 4 row-major; frame 0 is the identity.
// calib    P_k = K [I | t] with P_k[0,3] = -fx x_k, x_k along camera 0's x: right cameras negative.
//          Tr takes velodyne points (x forward, y left, z up) to camera 0; without a lidar it is the
//          change of axes alone.
// velodyne a lidar's points about each frame's time (frame_scans.h), carried to that time; labels are
//          SemanticKITTI's, whose readers also look for poses.txt in the sequence's folder.
// depth_2  ours: planar depth of camera 2, float32, m; sky 0.
// disp_2   ours: disparity of camera 2, 16 bit, times 256; 0 where there is none: sky, and where
//          half a count would err by more than max_relative_depth_error of the depth.

#include <algorithm>
#include <cmath>
#include <optional>

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
#include "export/frame_scans.h"
#include "export/georeference.h"
#include "export/kitti_files.h"
#include "export/velodyne.h"

namespace terracast::exporters {
namespace {

using core::ErrorKind;
using core::fail;

constexpr const char* kFormat = "kitti";
/// For forecasts.
constexpr double kBytesPerPixel = 4.3;
constexpr double kCountsPerPixel = 256.0;

/// What became of the pixels of disparity images.
struct DisparityCount {
  std::int64_t num_ground = 0;
  std::int64_t num_held = 0;
  std::int64_t num_too_far = 0;   ///< half a count would err by more than the bound
  std::int64_t num_too_near = 0;  ///< over 16 bits
  double worst_error = 0.0;       ///< relative, in depth, of a held pixel
  double farthest_m = 0.0;        ///< depth that was not held
  int frame = -1, x = 0, y = 0;   ///< of the farthest

  void add(const DisparityCount& other) {
    num_ground += other.num_ground;
    num_held += other.num_held;
    num_too_far += other.num_too_far;
    num_too_near += other.num_too_near;
    worst_error = std::max(worst_error, other.worst_error);
    if (other.farthest_m <= farthest_m) return;
    farthest_m = other.farthest_m;
    frame = other.frame;
    x = other.x;
    y = other.y;
  }
};

class KittiExporter final : public Exporter {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("rig", rig_, "Rig to export: it holds a rectified pair.");
    visit.key("left", left_, "Its left camera: image_0 (grey) and image_2.");
    visit.key("right", right_, "Its right camera: image_1 (grey) and image_3.");
    visit.key("sequence", sequence_,
              "Number of the first sequence, two digits; the others follow.");
    visit.key("disparity", disparity_,
              "16-bit disparity: auto (left out with a warning where too few pixels can be held), "
              "required (an error then), off.",
              core::one_of({"auto", "off", "required"}));
    visit.key("max_relative_depth_error", max_relative_depth_error_,
              "A disparity is invalid where half of its 1/256 px errs by more of the depth. KITTI "
              "itself counts a match as wrong from 5 %.",
              core::between(1e-4, 0.5));
    visit.key("min_disparity_share", min_disparity_share_,
              "Share of the ground's pixels that disparity must hold.", core::between(0.0, 1.0));
    calibration_.describe(visit);
    lidar_.describe(visit);
  }

  std::unique_ptr<Exporter> clone() const override {
    return std::make_unique<KittiExporter>(*this);
  }

  std::vector<std::string> rigs() const override { return {rig_}; }

  void check(const std::vector<capture::CameraCalibration>& cameras) const override {
    const auto& left = cameras[static_cast<std::size_t>(find_camera(cameras, rig_, left_))];
    const auto& right = cameras[static_cast<std::size_t>(find_camera(cameras, rig_, right_))];
    check_pinhole(left, kFormat);
    check_pinhole(right, kFormat);
    rectified_baseline_m(left, right, kFormat);
    check_shutters_of_pair(left, right, kFormat);
    if (sequence_.size() != 2 || sequence_.find_first_not_of("0123456789") != std::string::npos)
      fail(ErrorKind::Config, "kitti: sequence = \"{}\": two digits are right, such as \"00\"",
           sequence_);
  }

  FrameSize frame_size(const std::vector<capture::CameraCalibration>& cameras) const override {
    const auto& left = cameras[static_cast<std::size_t>(find_camera(cameras, rig_, left_))];
    const auto& right = cameras[static_cast<std::size_t>(find_camera(cameras, rig_, right_))];
    return size_of_images({&left, &right}, kBytesPerPixel);
  }

  void write(const std::vector<capture::SequenceReader>& sequences,
             const std::filesystem::path& folder, const core::Context& context) const override {
    const std::size_t first = static_cast<std::size_t>(std::stoi(sequence_));
    if (first + sequences.size() > 100)
      fail(ErrorKind::Config, "kitti: {} sequences from {} on need more than two digits",
           sequences.size(), sequence_);
    const std::string hash = source_hash(kFormat, *this, sequences);
    DatasetWriter writer(folder, kFormat, hash, context);
    if (writer.is_complete()) {
      context.log.info("{}: finished already, its sources are unchanged", folder.string());
      return;
    }
    core::Json list = core::Json::array();
    std::vector<std::string> paths;
    DisparityCount count;
    bool has_lidar = false;
    for (std::size_t i = 0; i < sequences.size(); ++i) {
      const std::string name = fmt::format("{:02}", first + i);
      paths.push_back("dataset/sequences/" + name);
      core::Json entry = write_sequence(sequences[i], name, paths.back(), writer, context, count);
      has_lidar = has_lidar || entry.has("lidar");
      list.push(std::move(entry));
    }
    std::vector<std::string> additions = {
        "depth_2/NNNNNN.npy: planar depth of camera 2, float32 (height, width), metres, sky 0"};
    const bool has_disparity = keep_disparity(count, paths, writer, context);
    if (has_disparity)
      additions.emplace_back(
          "disp_2/NNNNNN.png: disparity of camera 2 in 1/256 px, 16 bit, 0 where it is not held");
    if (has_lidar)
      additions.emplace_back(
          "instances.csv, where instances are labelled: our instance_id of each label and "
          "instance");
    core::Json description =
        metadata(kFormat, "KITTI odometry", hash, sequences, conventions(has_lidar), additions);
    description.set("disparity", describe_disparity(count, has_disparity));
    description.set("sequences", std::move(list));
    writer.finish(std::move(description));
  }

 private:
  static std::vector<std::pair<std::string, std::string>> conventions(bool has_lidar) {
    std::vector<std::pair<std::string, std::string>> list = {
        {"pixel_center",
         "The centre of pixel i is at i: calib.txt's c is dataset.json's less 0.5."},
        {"world_frame", "Camera 0 of the first frame; its place is in georeference.csv."},
        {"pose", "Camera 0 (x right, y down, z forward) of frame i to camera 0 of frame 0."},
        {"calib",
         has_lidar
             ? "P_k = K [I | t]; Tr takes the lidar's points (x forward, y left, z up) to camera "
               "0; "
               "of sequences without a lidar it is the change of axes alone."
             : "P_k = K [I | t]; Tr is the change of axes from x forward, y left, z up to camera "
               "0."},
        {"depth", "depth_2: along the optical axis, metres, float32."},
        {"disparity", "disp_2: focal length times baseline over depth, times 256, rounded."},
        {"sky", "0 in depth_2 and disp_2."}};
    if (!has_lidar) return list;
    list.emplace_back(
        "velodyne",
        "x, y, z, reflectance of each pulse whose time is nearest to the frame's: those with "
        "floor(time_s * rate_hz + 0.5) of its number, in the order of time. Motion is compensated: "
        "each point is carried from its pulse's time to the frame's, which is the middle of the "
        "scan; bodies that move stay where their pulse met them.");
    list.emplace_back("labels",
                      "SemanticKITTI: the class in the lower 16 bits, 0 where it has none that is "
                      "meant so, the instance in the upper ones.");
    return list;
  }

  /// The least number of 1/256 px whose half step keeps the bound.
  double min_counts() const { return std::ceil(0.5 / max_relative_depth_error_ - 1e-9); }

  core::Json write_sequence(const capture::SequenceReader& sequence, const std::string& name,
                            const std::string& path, DatasetWriter& writer,
                            const core::Context& context, DisparityCount& total) const {
    const auto& cameras = sequence.info().cameras;
    const int left = find_camera(cameras, rig_, left_);
    const int right = find_camera(cameras, rig_, right_);
    for (const int camera : {left, right})
      calibration_.check_is_true(sequence.info(), camera, kFormat);
    const double baseline_m = rectified_baseline_m(
        cameras[static_cast<std::size_t>(left)], cameras[static_cast<std::size_t>(right)], kFormat);
    const std::vector<ExportedCamera> exported = {
        {"image_0", left}, {"image_1", right}, {"image_2", left}, {"image_3", right}};
    const LocalFrame local = local_frame(sequence);

    const std::optional<FrameScans> scans =
        FrameScans::find(sequence, rig_, lidar_, kFormat, context);
    const std::string poses = relative_poses(sequence, local, left);
    writer.write(fmt::format("dataset/poses/{}.txt", name), poses);
    if (scans) writer.write(path + "/poses.txt", poses);
    std::string times;
    const double start_s = calibration_.time_s(sequence.frames().front(), left);
    for (const capture::FrameRecord& record : sequence.frames())
      times += fmt::format("{:.9e}\n", calibration_.time_s(record, left) - start_s);
    writer.write(path + "/times.txt", times);
    writer.write(path + "/calib.txt",
                 calibration(cameras[static_cast<std::size_t>(left)], baseline_m, scans));
    write_additions(writer, path, sequence, exported, scan_forms);

    const auto num_frames = static_cast<std::int64_t>(sequence.frames().size());
    std::vector<DisparityCount> counts(static_cast<std::size_t>(num_frames));
    core::Progress progress(context, "frames", num_frames);
    core::parallel_for(num_frames, [&](std::int64_t i) {
      const auto frame = static_cast<int>(i);
      const auto image = [&](int number) {
        return fmt::format("{}/image_{}/{:06}.png", path, number, frame);
      };
      write_grey_and_color(sequence, frame, left, image(0), image(2), writer);
      write_grey_and_color(sequence, frame, right, image(1), image(3), writer);
      counts[static_cast<std::size_t>(i)] =
          write_depth(sequence, frame, left, baseline_m, path, writer);
      progress.advance();
    });
    for (const DisparityCount& count : counts) total.add(count);
    core::Json entry = describe_sequence(sequence, local, name, path, exported, calibration_);
    if (scans) entry.set("lidar", write_odometry_scans(*scans, path, writer, context));
    return entry;
  }

  static std::string calibration(const capture::CameraCalibration& camera, double baseline_m,
                                 const std::optional<FrameScans>& scans) {
    std::string text;
    for (int k = 0; k < 4; ++k)
      text += fmt::format("P{}: {}\n", k,
                          number_line(kitti_projection(camera, k % 2 == 1 ? baseline_m : 0.0)));
    Eigen::Matrix<double, 3, 4> camera_from_velodyne;
    camera_from_velodyne << 0, -1, 0, 0, 0, 0, -1, 0, 1, 0, 0, 0;
    if (scans) {
      const geo::Rigid3d mount =
          camera.body_from_camera().inverse() * scans->stream().body_from_sensor();
      camera_from_velodyne << mount.rotation.toRotationMatrix(), mount.translation;
    }
    return text + fmt::format("Tr: {}\n", number_line(camera_from_velodyne));
  }

  DisparityCount write_depth(const capture::SequenceReader& sequence, int frame, int left,
                             double baseline_m, const std::string& path,
                             DatasetWriter& writer) const {
    const std::string depth_file = fmt::format("{}/depth_2/{:06}.npy", path, frame);
    const bool has_depth = writer.keep(depth_file);
    if (has_depth && disparity_ == "off") return {};
    const core::ImageF depth_m = depth_with_empty_sky(sequence, frame, left);
    if (!has_depth) writer.write(depth_file, core::npy_bytes(depth_m));
    if (disparity_ == "off") return {};
    DisparityCount count;
    const double focal_length_px =
        sequence.info().cameras[static_cast<std::size_t>(left)].intrinsics.parameters[0];
    const core::Image16 counts =
        disparity_counts(depth_m, focal_length_px * baseline_m, frame, count);
    writer.write_kept(fmt::format("{}/disp_2/{:06}.png", path, frame),
                      [&] { return core::encode_png(counts); });
    return count;
  }

  core::Image16 disparity_counts(const core::ImageF& depth_m, double focal_baseline_pxm, int frame,
                                 DisparityCount& count) const {
    core::Image16 image(depth_m.width(), depth_m.height());
    for (int y = 0; y < image.height(); ++y) {
      for (int x = 0; x < image.width(); ++x) {
        const auto depth = static_cast<double>(depth_m(x, y));
        if (depth == 0.0) continue;
        ++count.num_ground;
        const double exact = kCountsPerPixel * focal_baseline_pxm / depth;
        const double rounded = std::round(exact);
        if (rounded > 65535.0) {
          ++count.num_too_near;
        } else if (rounded < min_counts()) {
          ++count.num_too_far;
          if (depth > count.farthest_m) {
            count.farthest_m = depth;
            count.frame = frame;
            count.x = x;
            count.y = y;
          }
        } else {
          ++count.num_held;
          count.worst_error = std::max(count.worst_error, std::abs(exact / rounded - 1.0));
          image(x, y) = static_cast<std::uint16_t>(rounded);
        }
      }
    }
    return image;
  }

  /// Whether the disparity images stay; they go where they would be nearly empty.
  bool keep_disparity(const DisparityCount& count, const std::vector<std::string>& paths,
                      DatasetWriter& writer, const core::Context& context) const {
    if (disparity_ == "off") return false;
    const double share = count.num_ground == 0 ? 0.0
                                               : static_cast<double>(count.num_held) /
                                                     static_cast<double>(count.num_ground);
    if (count.num_ground > 0 && share >= min_disparity_share_) {
      context.log.info(
          "disparity holds {:.1f} % of the ground's pixels (depth within {:.2g} %); {} are too far "
          "and {} too near, and marked invalid",
          100.0 * share, 100.0 * count.worst_error, count.num_too_far, count.num_too_near);
      return true;
    }
    const std::string reason = fmt::format(
        "16-bit disparity holds {:.1f} % of the ground's pixels within {} of their depth, and must "
        "hold {} %; {} are too far, such as pixel ({}, {}) of frame {} at {:.0f} m, and {} too "
        "near. A longer baseline or focal length is right, or another max_relative_depth_error or "
        "min_disparity_share",
        100.0 * share, max_relative_depth_error_, 100.0 * min_disparity_share_, count.num_too_far,
        count.x, count.y, count.frame, count.farthest_m, count.num_too_near);
    if (disparity_ == "required") fail(ErrorKind::Input, "kitti: {}", reason);
    context.log.warn("disp_2 is left out: {}", reason);
    for (const std::string& path : paths) writer.remove_folder(path + "/disp_2");
    return false;
  }

  core::Json describe_disparity(const DisparityCount& count, bool has_disparity) const {
    core::Json json = core::Json::object();
    json.set("stored", has_disparity);
    if (disparity_ == "off") return json;
    return json.set("max_relative_depth_error", max_relative_depth_error_)
        .set("min_count", static_cast<std::int64_t>(min_counts()))
        .set("num_ground_pixels", count.num_ground)
        .set("num_held", count.num_held)
        .set("num_too_far", count.num_too_far)
        .set("num_too_near", count.num_too_near)
        .set("worst_relative_depth_error", count.worst_error);
  }

  std::string rig_ = "mcs4";
  std::string left_ = "cam0";
  std::string right_ = "cam3";
  std::string sequence_ = "00";
  std::string disparity_ = "auto";
  double max_relative_depth_error_ = 0.05;
  double min_disparity_share_ = 0.1;
  StatedCalibration calibration_;
  LidarChoice lidar_;
};

}  // namespace

ExporterInfo kitti_exporter() {
  return {.name = kFormat,
          .summary =
              "KITTI odometry: rectified pair, poses, calibration, depth, disparity, lidar with "
              "SemanticKITTI's labels.",
          .make = []() -> std::unique_ptr<Exporter> { return std::make_unique<KittiExporter>(); }};
}

}  // namespace terracast::exporters
