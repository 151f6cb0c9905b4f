#include "validate/readers/mcap.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <set>

#include "core/error.h"
#include "core/image_io.h"
#include "core/printable.h"
#include "validate/readers/euroc_inertial.h"
#include "validate/readers/mcap_bag.h"
#include "validate/readers/sensors.h"
#include "validate/text.h"

namespace terracast::validate {
namespace {

using core::ErrorKind;
using core::fail;

constexpr const char* kTransforms = "tf2_msgs/msg/TFMessage";

/// What all cameras of a sequence share.
struct Flight {
  Bag& bag;
  std::int64_t start_ns = 0;
  std::vector<SensorRecord> sensors = {};             ///< of sensors.json
  std::map<std::string, Pose> mounts = {};            ///< base_link from frame
  std::map<std::int64_t, Pose> local_from_body = {};  ///< by nanoseconds since 1970

  std::int64_t ns_of(double time_s) const { return start_ns + std::llround(1e9 * time_s); }
};

std::string frame_of(const SensorRecord& sensor) {
  return ros_word(sensor.rig) + "/" + ros_word(sensor.name);
}
std::string frame_of(const Camera& camera) {
  return ros_word(camera.rig) + "/" + ros_word(camera.name_in_rig) + "_optical";
}

/// Why two poses are not the same but for the rounding of changes of frames; empty: they are.
std::string difference_of(const Pose& found, const Pose& right) {
  constexpr double kPlace_m = 3e-8, kRotation = 1e-13;
  const auto is_near = [&](const Pose& pose) {
    return (pose.rotation - right.rotation).norm() <= kRotation &&
           (pose.translation - right.translation).norm() <= kPlace_m;
  };
  if (is_near(found)) return {};
  if (is_near(found.inverse()))
    return "is the inverse: points of the child into the parent is right";
  return fmt::format(
      "is {:.3g} m and {:.3g} deg off", (found.translation - right.translation).norm(),
      degrees_from_radians(rotation_angle_rad(right.rotation.transpose() * found.rotation)));
}

void read_static_transforms(const Sequence& sequence, Flight& flight) {
  std::set<std::string> mounted;
  for (const SensorRecord& sensor : flight.sensors) mounted.insert(frame_of(sensor));
  for (const Camera& camera : sequence.cameras) mounted.insert(frame_of(camera));
  bool has_earth = false;
  flight.bag.visit("/tf_static", kTransforms, [&](std::size_t, const ReadMessage& message) {
    const auto fail_repeated = [&](const std::string& child) {
      fail(ErrorKind::Input, "{}: a second transform of {}", message.where, child);
    };
    for (const RosValue& each : message.value.at("transforms").items) {
      const std::string& parent = each.at("header.frame_id").text;
      const std::string& child = each.at("child_frame_id").text;
      const Pose pose = transform_of(each.at("transform"), message.where);
      if (parent == "base_link") {
        if (!mounted.contains(child))
          fail(ErrorKind::Input,
               "{}: a transform of {}, which is no camera of dataset.json and no sensor of "
               "sensors.json",
               message.where, core::first_letters(child, 60));
        if (!flight.mounts.emplace(child, pose).second) fail_repeated(child);
      } else if (parent == "earth" && child == "map") {
        if (has_earth) fail_repeated(child);
        has_earth = true;
        if (const std::string wrong = difference_of(pose, ecef_from_local(sequence.origin));
            !wrong.empty())
          fail(ErrorKind::Input, "{}: map in earth {}, by the origin in dataset.json",
               message.where, wrong);
      } else {
        fail(ErrorKind::Input, "{}: a transform of {} in {}", message.where,
             core::first_letters(child, 60), core::first_letters(parent, 60));
      }
    }
  });
  if (!has_earth)
    fail(ErrorKind::Input, "{}: /tf_static has no transform of map in earth", flight.bag.path());
}

void read_transforms(Flight& flight) {
  flight.bag.visit("/tf", kTransforms, [&](std::size_t, const ReadMessage& message) {
    for (const RosValue& each : message.value.at("transforms").items) {
      if (each.at("header.frame_id").text != "map" || each.at("child_frame_id").text != "base_link")
        fail(ErrorKind::Input, "{}: another transform than of base_link in map", message.where);
      const std::int64_t stamp_ns = stamp_of(each.at("header.stamp"), message.where);
      if (stamp_ns != message.log_ns)
        fail(ErrorKind::Input, "{}: {}", message.where,
             stamp_difference(stamp_ns, message.log_ns, flight.start_ns));
      if (!flight.local_from_body
               .emplace(stamp_ns, transform_of(each.at("transform"), message.where))
               .second)
        fail(ErrorKind::Input, "{}: a second transform of {} ns", message.where, stamp_ns);
    }
  });
}

void check_odometry(const Sequence& sequence, Flight& flight) {
  if (flight.bag.num_messages("/truth/odometry") != static_cast<std::size_t>(sequence.num_frames))
    fail(ErrorKind::Input, "{}: /truth/odometry has {} messages for {} frames", flight.bag.path(),
         flight.bag.num_messages("/truth/odometry"), sequence.num_frames);
  flight.bag.visit(
      "/truth/odometry", "nav_msgs/msg/Odometry", [&](std::size_t, const ReadMessage& message) {
        message.check_frame("map");
        if (const std::string& child = message.value.at("child_frame_id").text;
            child != "base_link")
          fail(ErrorKind::Input, "{}: child_frame_id is \"{}\"; base_link is right", message.where,
               core::first_letters(child, 60));
        const RosValue& pose = message.value.at("pose.pose");
        RosValue transform;
        transform.fields = {{"translation", pose.at("position")},
                            {"rotation", pose.at("orientation")}};
        const auto right = flight.local_from_body.find(message.stamp_ns());
        if (right == flight.local_from_body.end() || message.stamp_ns() != message.log_ns)
          fail(ErrorKind::Input, "{}: /tf has no transform of its stamp", message.where);
        if (const std::string wrong =
                difference_of(transform_of(transform, message.where), right->second);
            !wrong.empty())
          fail(ErrorKind::Input, "{}: its pose {} against /tf", message.where, wrong);
      });
}

/// The IMU whose samples /tf has; null: there is none.
const SensorRecord* first_imu(const Flight& flight) {
  for (const SensorRecord& sensor : flight.sensors)
    if (sensor.kind == "imu" && flight.mounts.contains(frame_of(sensor))) return &sensor;
  return nullptr;
}

/// /tf has a transform at each frame and at each sample of the first IMU, and no other.
void check_times_of_body(const Sequence& sequence, const Flight& flight) {
  std::set<std::int64_t> right;
  for (int frame = 0; frame < sequence.num_frames; ++frame)
    right.insert(flight.ns_of(static_cast<double>(frame) / sequence.rate_hz));
  if (const SensorRecord* imu = first_imu(flight))
    for (const double time_s : imu->times_s) right.insert(flight.ns_of(time_s));
  for (const auto& [stamp_ns, pose] : flight.local_from_body)
    if (!right.contains(stamp_ns))
      fail(ErrorKind::Input,
           "{}: /tf has a transform of {} ns, when there is no frame and no sample of the first "
           "IMU",
           flight.bag.path(), stamp_ns);
  for (const std::int64_t stamp_ns : right)
    if (!flight.local_from_body.contains(stamp_ns))
      fail(ErrorKind::Input,
           "{}: /tf has no transform of {} ns, when there is a frame or a sample of the first IMU",
           flight.bag.path(), stamp_ns);
}

/// Where /tf puts the body at each sample of the first IMU, against the IMU's own record.
void check_body_at_samples(const Sequence& sequence, const Flight& flight) {
  const SensorRecord* imu = first_imu(flight);
  if (imu == nullptr) return;
  const Pose local_from_ecef = ecef_from_local(sequence.origin).inverse();
  for (std::size_t k = 0; k < imu->times_s.size(); ++k) {
    const auto state = imu->imu_state(k);
    if (!state) return;
    const std::int64_t stamp_ns = flight.ns_of(imu->times_s[k]);
    const auto found = flight.local_from_body.find(stamp_ns);
    if (found == flight.local_from_body.end()) continue;  // check_times_of_body() finds it
    const std::string wrong = difference_of(
        found->second, local_from_ecef * state->ecef_from_sensor * imu->body_from_sensor.inverse());
    if (!wrong.empty())
      fail(ErrorKind::Input, "{}: /tf at {} {}, by {}", flight.bag.path(), stamp_ns, wrong,
           imu->file);
  }
}

/// A lens whose coefficients are all 0 leaves places where they are.
Lens perspective_lens(const std::vector<double>& coefficients) {
  Lens lens{.kind = Lens::Kind::Perspective};
  std::copy_n(coefficients.begin(), std::min(coefficients.size(), lens.c.size()), lens.c.begin());
  return lens.c == Lens().c ? Lens() : lens;
}

Lens fisheye_lens(const std::vector<double>& k) {
  return {.kind = Lens::Kind::Fisheye, .c = {k[0], k[1], 0.0, 0.0, k[2], k[3]}};
}

Lens lens_of(const ReadMessage& info) {
  const std::string& model = info.value.at("distortion_model").text;
  const std::vector<double>& d = info.value.at("d").numbers;
  const auto need = [&](std::size_t count) {
    if (d.size() != count)
      fail(ErrorKind::Input, "{}: {} has {} coefficients, not {}", info.where,
           core::first_letters(model, 40), d.size(), count);
  };
  if (model == "equidistant") {
    need(4);
    return fisheye_lens(d);
  }
  if (model != "plumb_bob" && model != "rational_polynomial")
    fail(ErrorKind::Input,
         "{}: distortion_model \"{}\"; plumb_bob, rational_polynomial and equidistant are known",
         info.where, core::first_letters(model, 40));
  need(model == "plumb_bob" ? 5 : 8);
  return perspective_lens(d);
}

/// The lens that dataset.json states; nothing for a model that CameraInfo has not.
std::optional<Lens> stated_lens(const StatedModel& model) {
  constexpr std::size_t kOfPinhole = 4;
  std::vector<double> own;
  if (model.parameters.size() > kOfPinhole)
    own.assign(model.parameters.begin() + kOfPinhole, model.parameters.end());
  if (model.name == "opencv_fisheye" && own.size() == 4) return fisheye_lens(own);
  for (const char* name : {"pinhole", "simple_radial", "radial", "opencv", "full_opencv"})
    if (model.name == name) return perspective_lens(own);
  return std::nullopt;
}

Intrinsics intrinsics_of_info(const ReadMessage& info) {
  const std::vector<double>& k = info.value.at("k").numbers;
  const std::vector<double>& p = info.value.at("p").numbers;
  const std::vector<double>& r = info.value.at("r").numbers;
  if (k.size() != 9 || p.size() != 12 || r.size() != 9)
    fail(ErrorKind::Input, "{}: k, r and p are not of 9, 9 and 12 numbers", info.where);
  const std::vector<double> right_k = {k[0], 0.0, k[2], 0.0, k[4], k[5], 0.0, 0.0, 1.0};
  const std::vector<double> right_p = {k[0], 0.0, k[2], 0.0, 0.0, k[4],
                                       k[5], 0.0, 0.0,  0.0, 1.0, 0.0};
  if (k != right_k || p != right_p || r != std::vector<double>{1, 0, 0, 0, 1, 0, 0, 0, 1})
    fail(ErrorKind::Input,
         "{}: k has a skew, p is not k, or r is no identity: the images are not rectified",
         info.where);
  constexpr double kMostPixels = 1 << 15;
  const double width = info.value.at("width").number, height = info.value.at("height").number;
  if (!(width >= 1.0 && width <= kMostPixels && height >= 1.0 && height <= kMostPixels))
    fail(ErrorKind::Input, "{}: images of {} x {} px", info.where, width, height);
  Intrinsics camera{.width_px = static_cast<int>(width),
                    .height_px = static_cast<int>(height),
                    .fx_px = k[0],
                    .fy_px = k[4],
                    .cx_px = k[2] + 0.5,
                    .cy_px = k[5] + 0.5};
  camera.lens = lens_of(info);
  camera.find_reach();
  return camera;
}

/// Reads the messages of one camera.
class CameraTopics {
 public:
  CameraTopics(Flight& flight, const Sequence& sequence, Camera& camera)
      : flight_(flight),
        sequence_(sequence),
        camera_(camera),
        topic_("/" + ros_word(camera.rig) + "/" + ros_word(camera.name_in_rig)),
        frame_id_(frame_of(camera)) {}

  void read(Findings& findings) {
    const auto attempt = [&](auto&& work) { findings.attempt(flight_.bag.path(), work); };
    attempt([&] { read_mount(findings); });
    attempt([&] { read_infos(); });
    attempt([&] { read_images(); });
    if (flight_.bag.has(topic_ + "/depth")) attempt([&] { read_depths(); });
  }

 private:
  std::int64_t frame_ns(std::size_t frame) const {
    return flight_.ns_of(static_cast<double>(frame) / sequence_.rate_hz);
  }

  void read_mount(Findings& findings) {
    const auto mount = flight_.mounts.find(frame_id_);
    if (mount == flight_.mounts.end())
      fail(ErrorKind::Input, "{}: /tf_static has no transform of {}", flight_.bag.path(),
           frame_id_);
    if (camera_.body_from_camera)
      if (const std::string wrong = difference_of(mount->second, *camera_.body_from_camera);
          !wrong.empty())
        findings.add(flight_.bag.path(),
                     fmt::format("/tf_static: {} {} of where dataset.json mounts the camera",
                                 frame_id_, wrong));
    for (std::size_t frame = 0; frame < camera_.local_from_camera.size(); ++frame) {
      const auto body = flight_.local_from_body.find(frame_ns(frame));
      if (body != flight_.local_from_body.end())
        camera_.local_from_camera[frame] = body->second * mount->second;
      else
        findings.add(flight_.bag.path(), fmt::format("/tf has no transform of frame {}", frame));
    }
  }

  /// Visits a topic that has a message a frame.
  void visit(const std::string& suffix, const std::string& type, const Bag::Visit& visit) {
    const std::size_t count = flight_.bag.num_messages(topic_ + suffix);
    if (count != static_cast<std::size_t>(sequence_.num_frames))
      fail(ErrorKind::Input, "{}: {}{} has {} messages for {} frames", flight_.bag.path(), topic_,
           suffix, count, sequence_.num_frames);
    flight_.bag.visit(
        topic_ + suffix, type,
        [&](std::size_t frame, const ReadMessage& message) {
          const bool is_own = sequence_.states_belief && frame < camera_.stamps_s.size();
          const std::int64_t right_ns =
              is_own ? flight_.ns_of(camera_.stamps_s[frame]) : frame_ns(frame);
          if (message.stamp_ns() != right_ns)
            fail(ErrorKind::Input, "{}: {}", message.where,
                 stamp_difference(message.stamp_ns(), right_ns, flight_.start_ns));
          if (message.log_ns != frame_ns(frame))
            fail(ErrorKind::Input, "{}: of its log time: {}", message.where,
                 stamp_difference(message.log_ns, frame_ns(frame), flight_.start_ns));
          message.check_frame(frame_id_);
          visit(frame, message);
        },
        type != "sensor_msgs/msg/CameraInfo");
  }

  void read_infos() {
    visit("/camera_info", "sensor_msgs/msg/CameraInfo",
          [&](std::size_t frame, const ReadMessage& message) {
            const Intrinsics found = intrinsics_of_info(message);
            if (camera_.stated && stated_lens(camera_.stated_model) != found.lens)
              fail(ErrorKind::Input, "{}: another distortion than dataset.json states",
                   message.where);
            if (frame > 0 && !(found == camera_.intrinsics))
              fail(ErrorKind::Input, "{}: other intrinsics than in the message before",
                   message.where);
            camera_.intrinsics = found;
          });
  }

  std::string place_of(const ReadMessage& message, std::string_view kind) const {
    const RosValue& data = message.value.at("data");
    return fmt::format("{}#{:012}+{}.{}", flight_.bag.path(), message.offset + data.bytes_at,
                       data.num_bytes, kind);
  }

  /// Of packed numbers, bytes a pixel.
  void check_image(const ReadMessage& message, const std::string& encoding, double pixel_bytes) {
    const RosValue& value = message.value;
    if (value.at("encoding").text != encoding || value.at("is_bigendian").number != 0.0)
      fail(ErrorKind::Input, "{}: of the encoding {}; {} is right, little-endian", message.where,
           core::first_letters(value.at("encoding").text, 40), encoding);
    if (value.at("width").number != camera_.intrinsics.width_px ||
        value.at("height").number != camera_.intrinsics.height_px ||
        value.at("step").number != pixel_bytes * camera_.intrinsics.width_px ||
        static_cast<double>(value.at("data").num_bytes) !=
            pixel_bytes * camera_.intrinsics.width_px * camera_.intrinsics.height_px)
      fail(ErrorKind::Input, "{}: another size than camera_info has", message.where);
  }

  void read_images() {
    if (flight_.bag.has(topic_ + "/image_raw/compressed")) {
      visit("/image_raw/compressed", "sensor_msgs/msg/CompressedImage",
            [&](std::size_t frame, const ReadMessage& message) {
              if (message.value.at("format").text.find("png") == std::string::npos)
                fail(ErrorKind::Input, "{}: of the format {}; png is right", message.where,
                     core::first_letters(message.value.at("format").text, 40));
              camera_.files[frame].color = place_of(message, "png");
            });
      return;
    }
    visit("/image_raw", "sensor_msgs/msg/Image",
          [&](std::size_t frame, const ReadMessage& message) {
            const bool is_grey = message.value.at("encoding").text == "mono8";
            check_image(message, is_grey ? "mono8" : "rgb8", is_grey ? 1.0 : 3.0);
            camera_.files[frame].color = place_of(message, is_grey ? "mono8" : "rgb8");
          });
  }

  void read_depths() {
    visit("/depth", "sensor_msgs/msg/Image", [&](std::size_t frame, const ReadMessage& message) {
      check_image(message, "32FC1", 4.0);
      camera_.files[frame].depth = place_of(message, "32FC1");
    });
  }

  Flight& flight_;
  const Sequence& sequence_;
  Camera& camera_;
  std::string topic_, frame_id_;
};

/// The bytes that FrameFiles names, and their kind.
std::pair<std::vector<std::byte>, std::string> bytes_of_place(const Dataset& dataset,
                                                              const std::string& place) {
  const std::size_t hash = place.rfind('#'), plus = place.rfind('+'), dot = place.rfind('.');
  TERRACAST_CHECK(hash < plus && plus < dot && dot < place.size(), "{}", place);
  const std::string path = place.substr(0, hash);
  const auto offset = parse_integer(place.substr(hash + 1, plus - hash - 1), place);
  const auto count = parse_integer(place.substr(plus + 1, dot - plus - 1), place);
  return {read_bytes_at(dataset.root / path, place, static_cast<std::uint64_t>(offset),
                        static_cast<std::uint64_t>(count)),
          place.substr(dot + 1)};
}

}  // namespace

void McapReader::read(const Dataset& dataset, Sequence& sequence, Findings& findings) const {
  const std::string path = sequence.path + "/" + sequence.name + ".mcap";
  findings.attempt(path, [&] {
    Bag bag(dataset, sequence);
    Flight flight{.bag = bag,
                  .start_ns = parse_utc_ns(sequence.utc_start, "dataset.json: utc_start")};
    const std::string sensors_file = sequence.path + "/sensors.json";
    findings.attempt(sensors_file, [&] { flight.sensors = read_sensors(dataset, sequence); });
    findings.attempt(path, [&] { read_static_transforms(sequence, flight); });
    findings.attempt(path, [&] { read_transforms(flight); });
    findings.attempt(path, [&] { check_odometry(sequence, flight); });
    findings.attempt(path, [&] { check_times_of_body(sequence, flight); });
    findings.attempt(path, [&] { check_body_at_samples(sequence, flight); });
    for (int frame = 0; frame < sequence.num_frames; ++frame)
      sequence.times_s.push_back(static_cast<double>(frame) / sequence.rate_hz);
    for (Camera& camera : sequence.cameras) CameraTopics(flight, sequence, camera).read(findings);
    findings.attempt(sensors_file, [&] {
      check_bag_sensors(dataset, sequence, flight.sensors, flight.start_ns, flight.mounts, bag,
                        findings);
    });
    if (const std::vector<std::string> others = bag.left_over(); !others.empty())
      findings.add(path, fmt::format("{} topics of nothing that dataset.json or sensors.json has, "
                                     "such as {}",
                                     others.size(), core::first_letters(others.front(), 100)));
  });
}

core::ImageF McapReader::depth(const Dataset& dataset, const Camera& camera, int frame) const {
  const std::string& place = camera.files[static_cast<std::size_t>(frame)].depth;
  const auto [bytes, kind] = bytes_of_place(dataset, place);
  const Intrinsics& lens = camera.intrinsics;
  if (bytes.size() != sizeof(float) * static_cast<std::size_t>(lens.width_px) *
                          static_cast<std::size_t>(lens.height_px))
    fail(ErrorKind::Input, "{}: {} bytes for {} x {} px", place, bytes.size(), lens.width_px,
         lens.height_px);
  core::ImageF depth_m(lens.width_px, lens.height_px);
  std::memcpy(depth_m.data().data(), bytes.data(), bytes.size());
  for (int y = 0; y < lens.height_px; ++y)
    for (int x = 0; x < lens.width_px; ++x) {
      float& depth = depth_m(x, y);
      if (!std::isnan(depth) && !(depth > 0.0F))
        fail(ErrorKind::Input, "{}: pixel ({}, {}): depth {}; above 0, +inf or NaN is right", place,
             x, y, depth);
      if (!std::isfinite(depth)) depth = std::numeric_limits<float>::quiet_NaN();
    }
  return depth_m;
}

bool is_part_of_bag(const std::string& place) { return place.find(".mcap#") != std::string::npos; }

core::Image8 read_bag_image(const Dataset& dataset, const std::string& place,
                            const Intrinsics& size) {
  const auto [bytes, kind] = bytes_of_place(dataset, place);
  core::Image8 read;
  if (kind == "png") {
    auto image = core::decode_png(bytes, place);
    if (!std::holds_alternative<core::Image8>(image))
      fail(ErrorKind::Input, "{}: a PNG of 16 bits", place);
    read = std::move(std::get<core::Image8>(image));
  } else {
    const int channels = kind == "mono8" ? 1 : 3;
    const auto right = static_cast<std::size_t>(size.width_px) *
                       static_cast<std::size_t>(size.height_px) *
                       static_cast<std::size_t>(channels);
    if (bytes.size() != right)
      fail(ErrorKind::Input, "{}: {} bytes for {} x {} px", place, bytes.size(), size.width_px,
           size.height_px);
    read = core::Image8(size.width_px, size.height_px, channels);
    std::memcpy(read.data().data(), bytes.data(), bytes.size());
  }
  if (read.width() != size.width_px || read.height() != size.height_px)
    fail(ErrorKind::Input, "{}: {} x {} px; {} x {} are right", place, read.width(), read.height(),
         size.width_px, size.height_px);
  return read;
}

}  // namespace terracast::validate
