#include "validate/readers/euroc.h"

#include <algorithm>
#include <cmath>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/printable.h"
#include "validate/readers/euroc_inertial.h"
#include "validate/readers/named_files.h"
#include "validate/readers/terracast_arrays.h"
#include "validate/text.h"

namespace terracast::validate {

namespace {

using core::ErrorKind;
using core::fail;

/// What all cameras of a sequence share.
struct Flight {
  const Dataset& dataset;
  std::int64_t start_ns = 0;
  Pose vehicle_from_body = {};  ///< where imu0 is; without one the body is the vehicle's
  bool has_imu = false;
  double timeshift_cam_imu_s = 0.0;  ///< by which imu0's clock is believed to be ahead
  EurocStates states = {};
};

/// The model that the format has for one without distortion, or with fewer coefficients.
StatedModel with_all_coefficients(StatedModel model) {
  constexpr std::size_t kParameters = 8;
  if (model.name == "pinhole" || model.name == "simple_radial" || model.name == "radial") {
    model.name = "opencv";
    model.parameters.resize(kParameters, 0.0);
  }
  return model;
}

std::vector<double> own_parameters(const StatedModel& model) {
  constexpr std::size_t kOfPinhole = 4;
  if (model.parameters.size() <= kOfPinhole) return {};
  return {model.parameters.begin() + kOfPinhole, model.parameters.end()};
}

/// Of a sensor.yaml, or of a camera of a chain.
/// distortion   the key of the coefficients
Intrinsics read_intrinsics(const YamlKeys& yaml, const std::string& start,
                           const std::string& distortion) {
  const std::vector<double> size = yaml.numbers(start + "resolution", 2);
  const std::vector<double> f = yaml.numbers(start + "intrinsics", 4);
  if (yaml.word(start + "camera_model") != "pinhole")
    fail(ErrorKind::Input, "{} is not pinhole", yaml.where(start + "camera_model"));
  const std::string& model = yaml.word(start + "distortion_model");
  const bool is_radial = model == "radial-tangential" || model == "radtan";
  if (!is_radial && model != "equidistant")
    fail(ErrorKind::Input, "{} = {}; radial-tangential and equidistant are known",
         yaml.where(start + "distortion_model"), core::first_letters(model, 60));
  for (const double length : size)
    if (!(length >= 1.0) || length > (1 << 15) || length != std::floor(length))
      fail(ErrorKind::Input, "{} = {}", yaml.where(start + "resolution"), length);
  Intrinsics camera{.width_px = static_cast<int>(size[0]),
                    .height_px = static_cast<int>(size[1]),
                    .fx_px = f[0],
                    .fy_px = f[1],
                    .cx_px = f[2] + 0.5,
                    .cy_px = f[3] + 0.5};
  camera.plane = make_camera_plane(is_radial ? "opencv" : "opencv_fisheye",
                                   yaml.numbers(start + distortion, 4));
  return camera;
}

/// What is wrong with a mount; empty: nothing.
std::string mount_difference(const Pose& found, const Pose& right) {
  // Both have all digits of the same numbers, and quaternions become matrices.
  constexpr double kRounding = 1e-11;
  const auto is_near = [&](const Pose& pose) {
    return (pose.rotation - right.rotation).norm() <= kRounding &&
           (pose.translation - right.translation).norm() <=
               kRounding * (1.0 + right.translation.norm());
  };
  if (is_near(found)) return {};
  if (is_near(found.inverse())) return "takes points of the body into the camera, the inverse";
  return fmt::format(
      "is {:.3g} deg and {:.3g} m off where dataset.json mounts the camera",
      degrees_from_radians(rotation_angle_rad(right.rotation.transpose() * found.rotation)),
      (found.translation - right.translation).norm());
}

/// Reads a sensor.yaml.
/// returns   T_BS
Pose read_camera_yaml(const Flight& flight, const Sequence& sequence, const std::string& path,
                      Camera& camera, Findings& findings) {
  const YamlKeys yaml(core::read_text_file(flight.dataset.root / path), path);
  const Pose mount = read_t_bs(yaml);
  camera.intrinsics = read_intrinsics(yaml, "", "distortion_coefficients");
  if (camera.stated) {
    const StatedModel model = with_all_coefficients(camera.stated_model);
    camera.stated->plane = make_camera_plane(model.name, own_parameters(model));
  }
  if (yaml.word("sensor_type") != "camera") findings.add(path, "sensor_type is not camera");
  if (yaml.word("comment") != camera.rig + "/" + camera.name_in_rig)
    findings.add(path, fmt::format("the comment is not the camera's name, {}/{}", camera.rig,
                                   camera.name_in_rig));
  if (yaml.number("rate_hz") != sequence.rate_hz)
    findings.add(path, fmt::format("rate_hz = {}, but {} in dataset.json", yaml.number("rate_hz"),
                                   sequence.rate_hz));
  if (camera.body_from_camera)
    if (const std::string wrong =
            mount_difference(mount, flight.vehicle_from_body.inverse() * *camera.body_from_camera);
        !wrong.empty())
      findings.add(path, "T_BS " + wrong);
  return mount;
}

/// When a frame was taken, by the sequence's own count.
std::int64_t frame_ns(const Flight& flight, const Sequence& sequence, std::size_t frame) {
  return flight.start_ns + std::llround(1e9 * (static_cast<double>(frame) / sequence.rate_hz));
}

/// The stamps of the images; those of a camera's own clock where the dataset states what is believed.
std::vector<std::int64_t> read_stamps(const Flight& flight, const Sequence& sequence,
                                      const std::string& path, const Camera& camera,
                                      Findings& findings) {
  const std::string text = core::read_text_file(flight.dataset.root / path);
  std::vector<std::int64_t> stamps;
  bool is_right = true;
  for (const StampedRow& row : stamped_rows(text, path, 2)) {
    if (row.cells[0] != std::to_string(row.stamp_ns) + ".png")
      fail(ErrorKind::Input, "{}: the file is {}, not the stamp with .png", row.where,
           core::first_letters(row.cells[0], 60));
    const std::size_t frame = stamps.size();
    stamps.push_back(row.stamp_ns);
    const bool is_own = sequence.states_belief && frame < camera.stamps_s.size();
    const std::int64_t right_ns = is_own
                                      ? flight.start_ns + std::llround(1e9 * camera.stamps_s[frame])
                                      : frame_ns(flight, sequence, frame);
    if (is_right && row.stamp_ns != right_ns)
      findings.add(row.where, stamp_difference(row.stamp_ns, right_ns, flight.start_ns));
    is_right = is_right && row.stamp_ns == right_ns;
  }
  if (stamps.size() != static_cast<std::size_t>(sequence.num_frames))
    fail(ErrorKind::Input, "{}: {} rows for {} frames", path, stamps.size(), sequence.num_frames);
  return stamps;
}

void read_camera(const Flight& flight, Sequence& sequence, std::size_t index, Findings& findings) {
  Camera& camera = sequence.cameras[index];
  const std::string folder = fmt::format("{}/mav0/cam{}", sequence.path, index);
  if (camera.name != fmt::format("cam{}", index)) {
    findings.add("dataset.json", fmt::format("camera {} is called {}; cam{} is right", index,
                                             core::first_letters(camera.name, 60), index));
    return;
  }
  Pose body_from_camera;
  std::vector<std::int64_t> stamps;
  const std::string yaml = folder + "/sensor.yaml", csv = folder + "/data.csv";
  const bool has_mount = findings.attempt(
      yaml, [&] { body_from_camera = read_camera_yaml(flight, sequence, yaml, camera, findings); });
  if (!findings.attempt(csv,
                        [&] { stamps = read_stamps(flight, sequence, csv, camera, findings); }))
    return;
  const auto find_files = [&](const std::string& of, const char* suffix, bool is_optional,
                              std::string FrameFiles::*member) {
    std::vector<std::string> names;
    for (const std::int64_t stamp_ns : stamps) names.push_back(std::to_string(stamp_ns) + suffix);
    const std::vector<std::string> paths =
        named_files(flight.dataset, of, names, is_optional, findings);
    for (std::size_t i = 0; i < paths.size() && i < camera.files.size(); ++i)
      camera.files[i].*member = paths[i];
  };
  find_files(folder + "/data", ".png", false, &FrameFiles::color);
  if (camera.intrinsics.plane)
    find_files(fmt::format("{}/range/cam{}", sequence.path, index), ".npy", true,
               &FrameFiles::depth);
  if (!has_mount) return;
  for (std::size_t frame = 0; frame < stamps.size(); ++frame) {
    // By its own clock an image's stamp is not when it was taken.
    const bool is_own = sequence.states_belief && !camera.stamps_s.empty();
    const std::int64_t taken_ns = is_own ? frame_ns(flight, sequence, frame) : stamps[frame];
    if (const auto state = flight.states.find(taken_ns); state != flight.states.end())
      camera.local_from_camera[frame] = state->second.local_from_body * body_from_camera;
    else
      findings.add(
          csv, fmt::format("the truth has no row of {}, when frame {} was taken", taken_ns, frame));
    if (index == 0)
      sequence.times_s.push_back(static_cast<double>(taken_ns - flight.start_ns) * 1e-9);
  }
}

/// A camera of a chain against its sensor.yaml, as it was read.
void check_chained(const YamlKeys& chain, std::size_t index, const Camera& camera,
                   const std::string& folder_of_topic) {
  const std::string start = fmt::format("cam{}.", index);
  if (read_intrinsics(chain, start, "distortion_coeffs") != camera.intrinsics)
    fail(ErrorKind::Input, "{}: other intrinsics than sensor.yaml has", chain.where(start));
  if (chain.word(start + "rostopic") != folder_of_topic)
    fail(ErrorKind::Input, "{} is not {}", chain.where(start + "rostopic"), folder_of_topic);
}

Pose read_rows(const YamlKeys& chain, const std::string& key) {
  const std::vector<double> n = chain.numbers(key, 16);
  const Eigen::Matrix4d m =
      Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(n.data());
  if (m.row(3) != Eigen::RowVector4d(0.0, 0.0, 0.0, 1.0))
    fail(ErrorKind::Input, "{} is no rigid motion", chain.where(key));
  return {m.topLeftCorner<3, 3>(), m.topRightCorner<3, 1>()};
}

void check_rows(const YamlKeys& chain, const std::string& key, const Pose& right) {
  if (const std::string wrong = mount_difference(read_rows(chain, key), right); !wrong.empty())
    fail(ErrorKind::Input, "{} {}", chain.where(key), wrong);
}

/// The chains of Kalibr and OpenVINS against what dataset.json says of the cameras.
void check_chains(const Flight& flight, const Sequence& sequence, Findings& findings) {
  const auto mount = [&](std::size_t index) {
    return flight.vehicle_from_body.inverse() * *sequence.cameras[index].body_from_camera;
  };
  const auto check = [&](const std::string& path, auto&& check_mount) {
    findings.attempt(path, [&] {
      const YamlKeys chain(core::read_text_file(flight.dataset.root / path), path);
      for (std::size_t i = 0; i < sequence.cameras.size(); ++i) {
        if (!sequence.cameras[i].intrinsics.plane) continue;  // told above
        check_chained(chain, i, sequence.cameras[i], fmt::format("/cam{}/image_raw", i));
        check_mount(chain, fmt::format("cam{}.", i), i);
        if (flight.has_imu &&
            chain.number(fmt::format("cam{}.timeshift_cam_imu", i)) != flight.timeshift_cam_imu_s)
          fail(ErrorKind::Input, "{}: timeshift_cam_imu of cam{} is not {}", path, i,
               flight.timeshift_cam_imu_s);
      }
    });
  };
  check(sequence.path + (flight.has_imu ? "/kalibr/camchain-imucam.yaml" : "/kalibr/camchain.yaml"),
        [&](const YamlKeys& chain, const std::string& start, std::size_t i) {
          if (flight.has_imu) check_rows(chain, start + "T_cam_imu", mount(i).inverse());
          if (i > 0) check_rows(chain, start + "T_cn_cnm1", mount(i).inverse() * mount(i - 1));
        });
  if (!flight.has_imu) return;
  check(sequence.path + "/openvins/kalibr_imucam_chain.yaml",
        [&](const YamlKeys& chain, const std::string& start, std::size_t i) {
          check_rows(chain, start + "T_imu_cam", mount(i));
        });
}

}  // namespace

void EurocReader::read(const Dataset& dataset, Sequence& sequence, Findings& findings) const {
  std::vector<SensorRecord> imus;
  Flight flight{.dataset = dataset};
  const bool is_known = findings.attempt(sequence.path + "/sensors.json", [&] {
    imus = euroc_imus(dataset, sequence);
    flight.start_ns = parse_utc_ns(sequence.utc_start, "dataset.json: utc_start");
  });
  if (!is_known) return;
  flight.has_imu = !imus.empty();
  if (flight.has_imu) flight.vehicle_from_body = imus.front().body_from_sensor;
  if (flight.has_imu && sequence.states_sensor_stamps && imus.front().clock)
    flight.timeshift_cam_imu_s = imus.front().clock->believed_offset_s;
  flight.states = read_euroc_states(dataset, sequence, imus, flight.start_ns, findings);
  for (std::size_t i = 0; i < imus.size(); ++i)
    check_euroc_imu(dataset, sequence, imus, i, flight.start_ns, findings);
  for (std::size_t i = 0; i < sequence.cameras.size(); ++i)
    read_camera(flight, sequence, i, findings);
  if (std::all_of(sequence.cameras.begin(), sequence.cameras.end(),
                  [](const Camera& camera) { return camera.body_from_camera.has_value(); }))
    check_chains(flight, sequence, findings);
}

core::ImageF EurocReader::depth(const Dataset& dataset, const Camera& camera, int frame) const {
  return read_range(dataset, camera.files[static_cast<std::size_t>(frame)].depth,
                    camera.intrinsics);
}

}  // namespace terracast::validate
