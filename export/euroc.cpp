// EuRoC's layout (ASL), for visual-inertial odometry.
//
// Body     B is the first IMU of the exported rigs, its axes the IMU's own; without one the vehicle's body, x forward,
//          y left, z up. R, the frame of the truth, is east, north, up of WGS84 at the sequence's origin.
// T_BS     takes points of a sensor into B: of imu0 the identity, of a camera (x right, y down, z forward) where it stands.
// Stamps   whole nanoseconds since 1970. An image's is that of its middle line's middle of exposure; the frame's time.
// Pixels   centres at whole numbers: c is ours less 0.5.
// Models   pinhole with radial-tangential or equidistant distortion; a camera without distortion has coefficients 0.
// Truth    at each sample of imu0 and at each image, as it was flown: nothing is interpolated but biases at images that
//          fall between two samples.
// ours     range/camK: along the ray, m, float32; sky +inf, no ray NaN. kalibr/ and openvins/: the same calibration in
//          those programs' words.

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
#include "export/kitti_files.h"
#include "export/utc_stamps.h"

namespace terracast::exporters {
namespace {

using core::ErrorKind;
using core::fail;

constexpr const char* kFormat = "euroc";
/// For forecasts: of a grey and a colour image, and of ranges.
constexpr double kGreyBytesPerPixel = 0.6, kColorBytesPerPixel = 1.6, kRangeBytesPerPixel = 4.0;

/// The model with all coefficients stated, as the format has them.
geo::CameraIntrinsics with_all_coefficients(geo::CameraIntrinsics intrinsics) {
  constexpr std::size_t kParameters = 8;  // fx fy cx cy and four coefficients
  if (intrinsics.model != "opencv_fisheye") intrinsics.model = "opencv";
  intrinsics.parameters.resize(kParameters, 0.0);
  return intrinsics;
}

/// What a sequence's files are made of.
struct Flight {
  const capture::SequenceReader& sequence;
  std::string path;
  std::vector<ExportedCamera> cameras;
  std::vector<ImuStream> imus;
  LocalFrame local;
  std::vector<std::vector<std::int64_t>> stamps_ns;  ///< by camera, then frame

  const ImuStream* imu() const { return imus.empty() ? nullptr : &imus.front(); }
  geo::Rigid3d vehicle_from_body() const {
    return imus.empty() ? geo::Rigid3d{} : imus.front().info.body_from_sensor();
  }
  std::string image_file(std::size_t camera, std::size_t frame) const {
    return fmt::format("{}/mav0/{}/data/{}.png", path, cameras[camera].name,
                       stamps_ns[camera][frame]);
  }
  std::string range_file(std::size_t camera, std::size_t frame) const {
    return fmt::format("{}/range/{}/{}.npy", path, cameras[camera].name, stamps_ns[camera][frame]);
  }
};

class EurocExporter final : public Exporter {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("rigs", rigs_, "Rigs to export, their cameras and IMUs; none named: all.");
    visit.key("images", images_,
              "grey, as most programs of visual-inertial odometry read images, or color.",
              core::one_of({"grey", "color"}));
    visit.key("range", has_range_, "Write range images beside (ours, not EuRoC's).");
    calibration_.describe(visit);
  }

  std::unique_ptr<Exporter> clone() const override {
    return std::make_unique<EurocExporter>(*this);
  }

  std::vector<std::string> rigs() const override { return rigs_; }

  void check(const std::vector<capture::CameraCalibration>& cameras) const override {
    for (const ExportedCamera& camera : cameras_taken(*this, cameras))
      check_opencv_model(cameras[static_cast<std::size_t>(camera.camera_index)], kFormat);
  }

  FrameSize frame_size(const std::vector<capture::CameraCalibration>& cameras) const override {
    std::vector<const capture::CameraCalibration*> exported;
    for (const ExportedCamera& camera : cameras_taken(*this, cameras))
      exported.push_back(&cameras[static_cast<std::size_t>(camera.camera_index)]);
    return size_of_images(exported, (is_grey() ? kGreyBytesPerPixel : kColorBytesPerPixel) +
                                        (has_range_ ? kRangeBytesPerPixel : 0.0));
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
        metadata(kFormat, "ASL, as EuRoC's", hash, sequences, conventions(), additions());
    description.set("sequences", std::move(list));
    writer.finish(std::move(description));
  }

 private:
  static std::vector<std::pair<std::string, std::string>> conventions() {
    return {
        {"pixel_center", "The centre of pixel i is at i: the yaml's c is dataset.json's less 0.5."},
        {"world_frame", "R: east, north, up of WGS84 at the sequence's origin; metres."},
        {"body",
         "B is imu0's frame; without an IMU the vehicle's body: x forward, y left, z up. The "
         "vehicle's body is what body_from_camera in dataset.json and sensors.json is from."},
        {"pose",
         "state_groundtruth_estimate0: B to R, quaternion w x y z; velocity of B's origin along "
         "R's axes. Exact, at each sample of imu0 and at each image."},
        {"T_BS", "Takes points of the sensor into B; of cameras x right, y down, z forward."},
        {"time",
         "Nanoseconds since 1970 (UTC), whole. An image's is the middle of its middle line's "
         "exposure. calibration = \"believed\": by each sensor's own clock, where it has one; "
         "else true. Those of the truth are true."},
        {"imu",
         "What the instrument shows: specific force (+9.8 m/s^2 along what points up at rest) and "
         "turn rate against the stars, so that the Earth's 7.3e-5 rad/s are in it. Biases of the "
         "truth are turn-on, Gauss-Markov and walk, without the Earth's turning."},
        {"depth",
         "range, where it is written: along the ray, metres, float32; NaN where none comes in."},
        {"sky", "+inf in range."}};
  }

  std::vector<std::string> additions() const {
    std::vector<std::string> list = {
        "kalibr/: camchain-imucam.yaml (without an IMU camchain.yaml) and imu.yaml, the "
        "calibration as Kalibr writes it",
        "openvins/: kalibr_imucam_chain.yaml and kalibr_imu_chain.yaml, the same for OpenVINS, "
        "where there is an IMU"};
    if (has_range_)
      list.emplace_back(
          "range/camK/STAMP.npy: range along each pixel's ray, float32 (height, width), metres, "
          "sky +inf");
    return list;
  }

  bool is_grey() const { return images_ == "grey"; }

  /// By the format's rule, rising: names of files are stamps.
  std::vector<std::int64_t> stamps_of(const capture::SequenceReader& sequence,
                                      const ExportedCamera& camera) const {
    const std::int64_t start_ns = unix_nanoseconds(sequence.info().utc_start, 0.0);
    std::vector<std::int64_t> stamps;
    for (const capture::FrameRecord& record : sequence.frames()) {
      stamps.push_back(start_ns +
                       std::llround(1e9 * calibration_.time_s(record, camera.camera_index)));
      if (stamps.back() < 0)
        fail(ErrorKind::Config,
             "{}: frame {} of sequence {} is from before 1970, from where the format counts; a "
             "later utc_start would do",
             kFormat, record.index, sequence.info().name);
      if (stamps.size() > 1 && stamps.back() <= stamps[stamps.size() - 2])
        fail(ErrorKind::Config,
             "{}: by its clock camera {} of sequence {} takes frame {} no later than the one "
             "before it; calibration = \"true\" or less jitter would do",
             kFormat, camera.name, sequence.info().name, record.index);
    }
    return stamps;
  }

  core::Json write_sequence(const capture::SequenceReader& sequence, DatasetWriter& writer,
                            const core::Context& context) const {
    Flight flight{.sequence = sequence,
                  .path = sequence.info().name,
                  .cameras = cameras_taken(*this, sequence.info().cameras),
                  .imus = {},
                  .local = local_frame(sequence),
                  .stamps_ns = {}};
    flight.imus = read_imus(sequence, flight.cameras, calibration_);
    for (std::size_t i = 0; i < flight.cameras.size(); ++i) {
      flight.stamps_ns.push_back(stamps_of(sequence, flight.cameras[i]));
      flight.cameras[i].name = fmt::format("cam{}", i);
    }
    write_inertial(flight, writer);
    write_cameras(flight, writer);
    write_additions(writer, flight.path, sequence, flight.cameras, scan_forms);
    write_images(flight, writer, context);
    return describe_sequence(sequence, flight.local, flight.path, flight.path, flight.cameras,
                             calibration_);
  }

  static void write_inertial(const Flight& flight, DatasetWriter& writer) {
    const std::string mav = flight.path + "/mav0";
    const std::int64_t start_ns = unix_nanoseconds(flight.sequence.info().utc_start, 0.0);
    const bool has_imu = flight.imu() != nullptr;
    writer.write(mav + "/body.yaml",
                 fmt::format("# The body that T_BS and the truth are of.\ncomment: {}\n",
                             has_imu ? "imu0's frame" : "the vehicle's body"));
    writer.write(mav + "/state_groundtruth_estimate0/data.csv",
                 states_csv(inertial_states(flight.sequence, flight.local, flight.imu())));
    writer.write(mav + "/state_groundtruth_estimate0/sensor.yaml", states_yaml(has_imu));
    for (std::size_t k = 0; k < flight.imus.size(); ++k) {
      const ImuStream& imu = flight.imus[k];
      const std::string folder = fmt::format("{}/imu{}", mav, k);
      writer.write(folder + "/data.csv", imu_csv(imu, start_ns));
      writer.write(folder + "/sensor.yaml",
                   imu_yaml(imu, k == 0 ? geo::Rigid3d{}
                                        : flight.vehicle_from_body().inverse() *
                                              imu.info.body_from_sensor()));
      writer.write(
          fmt::format("{}/kalibr/imu{}.yaml", flight.path, k == 0 ? "" : std::to_string(k)),
          kalibr_imu(imu, k));
    }
    if (has_imu)
      writer.write(flight.path + "/openvins/kalibr_imu_chain.yaml", openvins_imu(*flight.imu()));
  }

  void write_cameras(const Flight& flight, DatasetWriter& writer) const {
    const capture::SequenceInfo& info = flight.sequence.info();
    std::vector<ChainedCamera> chain;
    for (std::size_t i = 0; i < flight.cameras.size(); ++i) {
      const capture::CameraCalibration& stated =
          calibration_.cameras(info)[static_cast<std::size_t>(flight.cameras[i].camera_index)];
      chain.push_back(
          {.name = stated.rig + "/" + stated.name,
           .intrinsics = with_all_coefficients(stated.intrinsics),
           .imu_from_camera = flight.vehicle_from_body().inverse() * stated.body_from_camera()});
      const std::string folder = flight.path + "/mav0/" + flight.cameras[i].name;
      writer.write(folder + "/data.csv", images_csv(flight.stamps_ns[i]));
      writer.write(folder + "/sensor.yaml", camera_yaml(chain[i].name, chain[i].intrinsics,
                                                        info.rate_hz, chain[i].imu_from_camera));
    }
    const std::optional<double> shift_s = timeshift_cam_imu_s(flight);
    writer.write(fmt::format("{}/kalibr/{}", flight.path,
                             shift_s ? "camchain-imucam.yaml" : "camchain.yaml"),
                 kalibr_chain(chain, shift_s));
    if (shift_s)
      writer.write(flight.path + "/openvins/kalibr_imucam_chain.yaml",
                   openvins_chain(chain, *shift_s));
  }

  /// t_imu = t_cam + this, by what is believed of the IMU's clock; nothing of the cameras' is known beforehand.
  std::optional<double> timeshift_cam_imu_s(const Flight& flight) const {
    if (flight.imu() == nullptr) return std::nullopt;
    const std::optional<capture::StreamClock>& clock = flight.imu()->info.clock;
    return calibration_.is_believed() && clock ? clock->believed_offset_s : 0.0;
  }

  void write_images(const Flight& flight, DatasetWriter& writer,
                    const core::Context& context) const {
    const std::size_t num_cameras = flight.cameras.size();
    const auto num_images =
        static_cast<std::int64_t>(flight.sequence.frames().size() * num_cameras);
    core::Progress progress(context, "images", num_images);
    core::parallel_for(num_images, [&](std::int64_t i) {
      const std::size_t frame = static_cast<std::size_t>(i) / num_cameras;
      const std::size_t camera = static_cast<std::size_t>(i) % num_cameras;
      const auto read = [&](capture::SequenceReader::Parts part) {
        return flight.sequence.read_camera(static_cast<int>(frame),
                                           flight.cameras[camera].camera_index, part);
      };
      writer.write_kept(flight.image_file(camera, frame), [&] {
        const core::Image8 color = read(capture::SequenceReader::kColor).color;
        return core::encode_png(is_grey() ? grey_of(color) : color);
      });
      if (has_range_)
        writer.write_kept(flight.range_file(camera, frame), [&] {
          return core::npy_bytes(read(capture::SequenceReader::kFacts).range_m);
        });
      progress.advance();
    });
  }

  std::vector<std::string> rigs_;
  std::string images_ = "grey";
  bool has_range_ = true;
  StatedCalibration calibration_;
};

}  // namespace

ExporterInfo euroc_exporter() {
  return {.name = kFormat,
          .summary = "EuRoC's layout for visual-inertial odometry: images, IMUs, exact states.",
          .make = []() -> std::unique_ptr<Exporter> { return std::make_unique<EurocExporter>(); }};
}

}  // namespace terracast::exporters
