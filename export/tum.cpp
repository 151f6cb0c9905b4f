// The layout of TUM's RGB-D benchmark, which programs of RGB-D odometry and most tools of trajectories read.
//
// Folders  one a camera, RIG/CAMERA of a sequence: what the benchmark calls a sequence.
// Lists    rgb.txt and depth.txt, rows of a stamp and a file; three lines that begin with # before them, which some readers
//          skip by their number. associations.txt has both in one row and no such lines.
// Stamps   seconds since 1970 with nine decimals, made of whole nanoseconds; equal of an image and its depth. Files are
//          called by them.
// Poses    timestamp tx ty tz qx qy qz qw: into east, north, up of WGS84 at the sequence's origin. Cameras are x right, y
//          down, z forward.
// Depth    along the optical axis, 16 bits, depth_factor a metre; 0 where there is none or it does not fit.
// ours     range/: along the ray, m, float32; sky +inf, no ray NaN. trajectories/: of the body and of IMUs.

#include <algorithm>
#include <cmath>

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
#include "export/euroc_files.h"
#include "export/exporter.h"
#include "export/georeference.h"
#include "export/utc_stamps.h"

namespace terracast::exporters {
namespace {

using core::ErrorKind;
using core::fail;

constexpr const char* kFormat = "tum";
/// For forecasts: of an image and its depth, and of ranges.
constexpr double kBytesPerPixel = 3.0, kRangeBytesPerPixel = 4.0;
constexpr double kMostCounts = 65535.0;

constexpr const char* kPoseColumns = "# timestamp tx ty tz qx qy qz qw\n";
constexpr const char* kFileColumns = "# timestamp filename\n";

/// A row, for evo: single blanks, none at the end.
std::string pose_row(std::int64_t stamp_ns, const geo::Rigid3d& local_from_source) {
  const Eigen::Quaterniond q = canonical(local_from_source.rotation);
  const Eigen::Vector3d& t = local_from_source.translation;
  // Adding 0 turns -0 into 0.
  return fmt::format("{} {:.9f} {:.9f} {:.9f} {:.15f} {:.15f} {:.15f} {:.15f}\n",
                     seconds_with_nanoseconds(stamp_ns), t.x() + 0.0, t.y() + 0.0, t.z() + 0.0,
                     q.x() + 0.0, q.y() + 0.0, q.z() + 0.0, q.w());
}

/// The head of a file of poses.
std::string pose_head(const std::string& of_what) {
  return fmt::format("# ground truth trajectory\n# {}\n{}", of_what, kPoseColumns);
}

/// What depth images cannot hold.
struct DepthCount {
  std::int64_t num_pixels = 0;   ///< that show a surface
  std::int64_t num_too_far = 0;  ///< of these, left out
  std::int64_t num_too_near = 0;
  std::int64_t num_behind = 0;  ///< 90 degrees or more off the axis, where depth is not above 0
  double farthest_m = 0.0;

  std::int64_t num_left_out() const { return num_too_far + num_too_near + num_behind; }

  DepthCount& operator+=(const DepthCount& other) {
    num_pixels += other.num_pixels;
    num_too_far += other.num_too_far;
    num_too_near += other.num_too_near;
    num_behind += other.num_behind;
    farthest_m = std::max(farthest_m, other.farthest_m);
    return *this;
  }
};

/// Depth in counts. Sky and what does not fit are 0; the latter are counted.
core::Image16 depth_counts(const core::ImageF& depth_m, double factor, DepthCount& count) {
  core::Image16 counts(depth_m.width(), depth_m.height());
  for (std::size_t i = 0; i < depth_m.data().size(); ++i) {
    const auto value_m = static_cast<double>(depth_m.data()[i]);
    if (!std::isfinite(value_m)) continue;
    const double value = std::round(factor * value_m);
    ++count.num_pixels;
    count.farthest_m = std::max(count.farthest_m, value_m);
    if (value_m <= 0.0)
      ++count.num_behind;
    else if (value < 1.0)
      ++count.num_too_near;
    else if (value > kMostCounts)
      ++count.num_too_far;
    else
      counts.data()[i] = static_cast<std::uint16_t>(value);
  }
  return counts;
}

/// What a sequence's files are made of.
struct Flight {
  const capture::SequenceReader& sequence;
  std::string path;
  std::vector<ExportedCamera> cameras;
  LocalFrame local;
  std::int64_t start_ns = 0;
  std::vector<std::int64_t> stamps_ns;  ///< by frame

  std::int64_t stamp_ns(double time_s) const { return start_ns + std::llround(1e9 * time_s); }
  /// "rgb/1750500000.123456789.png".
  std::string file(const char* folder, std::size_t frame, const char* suffix) const {
    return fmt::format("{}/{}{}", folder, seconds_with_nanoseconds(stamps_ns[frame]), suffix);
  }
  std::string folder_of(const ExportedCamera& camera) const { return path + "/" + camera.name; }
};

class TumExporter final : public Exporter {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("rigs", rigs_, "Rigs to export, their cameras and IMUs; none named: all.");
    visit.key("depth_factor", depth_factor_,
              "What a metre counts in depth images; farther than 65535 / depth_factor is 0. TUM's "
              "own is 5000, which ends at 13.107 m; of others readers must be told.",
              core::between(1.0, 100000.0));
    visit.key("range", has_range_, "Write range images beside (ours, not TUM's).");
  }
  std::unique_ptr<Exporter> clone() const override { return std::make_unique<TumExporter>(*this); }
  std::vector<std::string> rigs() const override { return rigs_; }

  void check(const std::vector<capture::CameraCalibration>& cameras) const override {
    for (const ExportedCamera& camera : cameras_taken(*this, cameras))
      check_opencv_model(cameras[static_cast<std::size_t>(camera.camera_index)], kFormat);
  }

  FrameSize frame_size(const std::vector<capture::CameraCalibration>& cameras) const override {
    std::vector<const capture::CameraCalibration*> exported;
    for (const ExportedCamera& camera : cameras_taken(*this, cameras))
      exported.push_back(&cameras[static_cast<std::size_t>(camera.camera_index)]);
    return size_of_images(exported, kBytesPerPixel + (has_range_ ? kRangeBytesPerPixel : 0.0));
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
    DepthCount count;
    for (const capture::SequenceReader& sequence : sequences)
      list.push(write_sequence(sequence, writer, context, count));
    tell_left_out(count, context.log);
    core::Json description =
        metadata(kFormat, "TUM RGB-D", hash, sequences, conventions(), additions());
    core::Json depth = core::Json::object();
    depth.set("factor", depth_factor_);
    depth.set("pixels", count.num_pixels);
    depth.set("left_out", count.num_left_out());
    depth.set("too_far", count.num_too_far);
    depth.set("too_near", count.num_too_near);
    depth.set("behind", count.num_behind);
    depth.set("reach_m", reach_m());
    description.set("depth_images", std::move(depth));
    description.set("sequences", std::move(list));
    writer.finish(std::move(description));
  }

 private:
  /// The greatest depth that fits.
  double reach_m() const { return kMostCounts / depth_factor_; }

  std::vector<std::pair<std::string, std::string>> conventions() const {
    return {
        {"pixel_center",
         "The format states no intrinsics; those of dataset.json have the centre of pixel i at i + "
         "0.5, and are to be given to programs that have it at i with c less 0.5."},
        {"world_frame", "East, north, up of WGS84 at the sequence's origin; metres."},
        {"pose",
         "timestamp tx ty tz qx qy qz qw, to that frame: groundtruth.txt of a camera (x right, y "
         "down, z forward) at each of its images, trajectories/body.txt of the vehicle's body (x "
         "forward, y left, z up), trajectories/RIG/IMU.txt of an IMU at its samples."},
        {"time",
         "Seconds since 1970 (UTC), nine decimals; true. An image's is the middle of its middle "
         "line's exposure, and its depth's the same."},
        {"depth",
         fmt::format("Along the optical axis, 16-bit PNG, {} counts a metre; 0 where no surface is "
                     "nearer than {:.6g} m, and where a pixel looks 90 degrees or more off the "
                     "axis. range, where it is written: along the ray, metres, "
                     "float32; NaN where none comes in.",
                     depth_factor_, reach_m())},
        {"sky", "0 in depth, +inf in range."}};
  }

  std::vector<std::string> additions() const {
    std::vector<std::string> list = {
        "trajectories/: of the body at each frame, of IMUs at their samples"};
    if (has_range_)
      list.emplace_back(
          "RIG/CAMERA/range/STAMP.npy: range along each pixel's ray, float32 (height, width), "
          "metres, sky +inf");
    return list;
  }

  void tell_left_out(const DepthCount& count, const core::Log& log) const {
    if (count.num_too_far > 0)
      log.warn(
          "{}: {} of {} pixels that show a surface are 0 in the depth images, which hold up to "
          "{:.6g} m with depth_factor = {}; the farthest is {:.6g} m away, for which depth_factor "
          "= {:.0f} would do",
          kFormat, count.num_too_far, count.num_pixels, reach_m(), depth_factor_, count.farthest_m,
          std::max(1.0, std::floor(kMostCounts / count.farthest_m)));
    if (count.num_too_near > 0)
      log.warn(
          "{}: {} of {} pixels that show a surface are 0 in the depth images, being nearer "
          "than half a count of depth_factor = {}",
          kFormat, count.num_too_near, count.num_pixels, depth_factor_);
    if (count.num_behind > 0)
      log.warn(
          "{}: {} of {} pixels that show a surface look 90 degrees or more off the axis, where "
          "depth images hold nothing; range = true has them",
          kFormat, count.num_behind, count.num_pixels);
  }

  core::Json write_sequence(const capture::SequenceReader& sequence, DatasetWriter& writer,
                            const core::Context& context, DepthCount& count) const {
    const capture::SequenceInfo& info = sequence.info();
    Flight flight{.sequence = sequence,
                  .path = info.name,
                  .cameras = cameras_taken(*this, info.cameras),
                  .local = local_frame(sequence),
                  .start_ns = unix_nanoseconds(info.utc_start, 0.0),
                  .stamps_ns = {}};
    for (const capture::FrameRecord& record : sequence.frames()) {
      flight.stamps_ns.push_back(flight.stamp_ns(record.time_s));
      if (flight.stamps_ns.back() < 0)
        fail(ErrorKind::Config,
             "{}: frame {} of sequence {} is from before 1970, from where the format counts; a "
             "later utc_start would do",
             kFormat, record.index, info.name);
    }
    write_trajectories(flight, writer);
    for (const ExportedCamera& camera : flight.cameras) write_lists(flight, camera, writer);
    write_additions(writer, flight.path, sequence, flight.cameras, scan_forms);
    count += write_images(flight, writer, context);
    return describe_sequence(sequence, flight.local, flight.path, flight.path, flight.cameras,
                             StatedCalibration());
  }

  static void write_trajectories(const Flight& flight, DatasetWriter& writer) {
    std::string body = pose_head("of the vehicle's body: x forward, y left, z up");
    for (const capture::FrameRecord& record : flight.sequence.frames())
      body += pose_row(flight.stamp_ns(record.time_s),
                       flight.local.local_from_world * record.world_from_body);
    writer.write(flight.path + "/trajectories/body.txt", body);
    const geo::Rigid3d local_from_ecef =
        geo::WorldFrame(flight.local.origin).ecef_from_world().inverse();
    for (const ImuStream& imu : read_imus(flight.sequence, flight.cameras, StatedCalibration())) {
      const std::string name = imu.info.rig + "/" + imu.info.name;
      std::string rows = pose_head("of the IMU " + name + " at its samples");
      for (const ImuSample& sample : imu.samples)
        rows += pose_row(flight.stamp_ns(sample.time_s), local_from_ecef * sample.ecef_from_imu);
      writer.write(fmt::format("{}/trajectories/{}.txt", flight.path, name), rows);
    }
  }

  void write_lists(const Flight& flight, const ExportedCamera& camera,
                   DatasetWriter& writer) const {
    std::string rgb = fmt::format("# color images\n# camera {}\n{}", camera.name, kFileColumns);
    std::string depth =
        fmt::format("# depth maps\n# depth_factor: {}\n{}", depth_factor_, kFileColumns);
    std::string both;
    std::string poses = pose_head("camera " + camera.name + ": x right, y down, z forward");
    for (std::size_t frame = 0; frame < flight.stamps_ns.size(); ++frame) {
      const std::string stamp = seconds_with_nanoseconds(flight.stamps_ns[frame]);
      const std::string of_rgb = stamp + " " + flight.file("rgb", frame, ".png");
      const std::string of_depth = stamp + " " + flight.file("depth", frame, ".png");
      rgb += of_rgb + "\n";
      depth += of_depth + "\n";
      both += of_rgb + " " + of_depth + "\n";
      poses += pose_row(flight.stamps_ns[frame],
                        local_from_camera(flight.local, flight.sequence, static_cast<int>(frame),
                                          camera.camera_index));
    }
    const std::string folder = flight.folder_of(camera);
    writer.write(folder + "/rgb.txt", rgb);
    writer.write(folder + "/depth.txt", depth);
    writer.write(folder + "/associations.txt", both);
    writer.write(folder + "/groundtruth.txt", poses);
  }

  DepthCount write_images(const Flight& flight, DatasetWriter& writer,
                          const core::Context& context) const {
    const std::size_t num_cameras = flight.cameras.size();
    const std::size_t num_images = flight.stamps_ns.size() * num_cameras;
    std::vector<DepthCount> counts(num_images);
    core::Progress progress(context, "images", static_cast<std::int64_t>(num_images));
    core::parallel_for(static_cast<std::int64_t>(num_images), [&](std::int64_t i) {
      const auto image = static_cast<std::size_t>(i);
      counts[image] =
          write_image(flight, image / num_cameras, flight.cameras[image % num_cameras], writer);
      progress.advance();
    });
    DepthCount sum;
    for (const DepthCount& count : counts) sum += count;
    return sum;
  }

  /// An image with its depth, which is looked at also where its file was kept: what it leaves out is counted.
  DepthCount write_image(const Flight& flight, std::size_t frame, const ExportedCamera& camera,
                         DatasetWriter& writer) const {
    const auto read = [&](capture::SequenceReader::Parts part) {
      return flight.sequence.read_camera(static_cast<int>(frame), camera.camera_index, part);
    };
    const std::string folder = flight.folder_of(camera) + "/";
    writer.write_kept(folder + flight.file("rgb", frame, ".png"), [&] {
      return core::encode_png(read(capture::SequenceReader::kColor).color);
    });
    const core::ImageF range_m = read(capture::SequenceReader::kFacts).range_m;
    const auto model = geo::make_camera(
        flight.sequence.info().cameras[static_cast<std::size_t>(camera.camera_index)].intrinsics);
    DepthCount count;
    const core::Image16 depth =
        depth_counts(capture::depth_image(*model, range_m), depth_factor_, count);
    writer.write_kept(folder + flight.file("depth", frame, ".png"),
                      [&] { return core::encode_png(depth); });
    if (has_range_)
      writer.write_kept(folder + flight.file("range", frame, ".npy"),
                        [&] { return core::npy_bytes(range_m); });
    return count;
  }

  std::vector<std::string> rigs_;
  double depth_factor_ = 5000.0;
  bool has_range_ = true;
};

}  // namespace

ExporterInfo tum_exporter() {
  return {.name = kFormat,
          .summary = "TUM's RGB-D layout: images with depth, and trajectories that evo opens.",
          .make = []() -> std::unique_ptr<Exporter> { return std::make_unique<TumExporter>(); }};
}

}  // namespace terracast::exporters
