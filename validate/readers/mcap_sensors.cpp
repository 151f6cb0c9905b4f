// Samples of sensors in a bag, against those of sensors.json.

#include <fmt/ranges.h>

#include <array>
#include <cmath>
#include <cstring>

#include "core/error.h"
#include "validate/readers/euroc_inertial.h"
#include "validate/readers/mcap_bag.h"
#include "validate/readers/sensors.h"

namespace terracast::validate {
namespace {

using core::ErrorKind;
using core::fail;

/// A field of a message and what it is of a sample.
struct SampledField {
  std::string_view field, channel;
  double factor = 1.0;
};
/// A topic of a kind of sensor.
struct SampledTopic {
  std::string_view kind, suffix, type;
  std::vector<SampledField> fields;
};

const std::vector<SampledTopic>& sampled_topics() {
  static const std::vector<SampledTopic> topics = {
      {"imu",
       "",
       "sensor_msgs/msg/Imu",
       {{"angular_velocity.x", "gyro_x_radps"},
        {"angular_velocity.y", "gyro_y_radps"},
        {"angular_velocity.z", "gyro_z_radps"},
        {"linear_acceleration.x", "accel_x_mps2"},
        {"linear_acceleration.y", "accel_y_mps2"},
        {"linear_acceleration.z", "accel_z_mps2"}}},
      {"gnss",
       "/fix",
       "sensor_msgs/msg/NavSatFix",
       {{"latitude", "lat_deg"}, {"longitude", "lon_deg"}, {"altitude", "height_m"}}},
      {"gnss",
       "/velocity",
       "geometry_msgs/msg/TwistWithCovarianceStamped",
       {{"twist.twist.linear.x", "velocity_east_mps"},
        {"twist.twist.linear.y", "velocity_north_mps"},
        {"twist.twist.linear.z", "velocity_down_mps", -1.0}}},
      {"barometer", "", "sensor_msgs/msg/FluidPressure", {{"fluid_pressure", "pressure_pa"}}},
      {"magnetometer",
       "",
       "sensor_msgs/msg/MagneticField",
       {{"magnetic_field.x", "field_x_nt", 1e-9},
        {"magnetic_field.y", "field_y_nt", 1e-9},
        {"magnetic_field.z", "field_z_nt", 1e-9}}},
      {"rangefinder", "", "sensor_msgs/msg/Range", {{"range", "range_m"}}},
      {"radar_altimeter", "", "sensor_msgs/msg/Range", {{"range", "range_m"}}}};
  return topics;
}

std::size_t channel_of(const SensorRecord& sensor, std::string_view name) {
  for (std::size_t k = 0; k < sensor.channels.size(); ++k)
    if (sensor.channels[k] == name) return k;
  fail(ErrorKind::Input, "{}: no column {}", sensor.file, name);
}

/// Of a double; of a float32.
constexpr double kSameDouble = 1e-14, kSameFloat = 6e-8;

/// Of one message against its sample.
void check_sample(const SampledTopic& topic, const SensorRecord& sensor, std::size_t index,
                  const ReadMessage& message) {
  const double rounding = topic.type == "sensor_msgs/msg/Range" ? kSameFloat : kSameDouble;
  for (const SampledField& field : topic.fields) {
    const double right = field.factor * sensor.row(index)[channel_of(sensor, field.channel)];
    const double found = message.value.at(field.field).number;
    if (found == right || std::abs(found - right) <= rounding * std::abs(right)) continue;
    fail(ErrorKind::Input, "{}: {} is {}, but {} by {}{}", message.where, field.field, found, right,
         sensor.file, found == -right ? ": the other sign" : "");
  }
  if (sensor.kind == "imu" && message.value.at("orientation_covariance").numbers.at(0) != -1.0)
    fail(ErrorKind::Input, "{}: orientation_covariance does not begin with -1: it has none",
         message.where);
}

/// stamp_s   that its header should have; it was logged when it was true
void check_stamp(const ReadMessage& message, double stamp_s, double time_s, std::int64_t start_ns) {
  for (const auto& [found_ns, right_s] :
       {std::pair{message.stamp_ns(), stamp_s}, std::pair{message.log_ns, time_s}}) {
    const std::int64_t right_ns = start_ns + std::llround(1e9 * right_s);
    if (found_ns != right_ns)
      fail(ErrorKind::Input, "{}: {}", message.where,
           stamp_difference(found_ns, right_ns, start_ns));
  }
}

void check_samples(const SampledTopic& topic, const SensorRecord& sensor, bool is_by_clock,
                   std::int64_t start_ns, const std::string& frame, Bag& bag) {
  const std::string name = "/" + frame + std::string(topic.suffix);
  if (bag.num_messages(name) != sensor.times_s.size())
    fail(ErrorKind::Input, "{}: {} has {} messages for {} samples of {}", bag.path(), name,
         bag.num_messages(name), sensor.times_s.size(), sensor.file);
  bag.visit(name, std::string(topic.type), [&](std::size_t i, const ReadMessage& message) {
    check_stamp(message, sensor.stated_s(i, is_by_clock), sensor.times_s[i], start_ns);
    message.check_frame(frame);
    check_sample(topic, sensor, i, message);
  });
}

/// The points of a sequence's scans, one after the other, frame by frame.
class ScannedPoints {
 public:
  ScannedPoints(const Dataset& dataset, const Sequence& sequence, const SensorRecord& scanner)
      : dataset_(dataset), sequence_(sequence), scanner_(scanner) {}

  bool is_by_clock() const { return sequence_.states_sensor_stamps && scanner_.clock.has_value(); }

  static constexpr std::array kColumns = {"time_s",      "x_m",  "y_m",           "z_m",
                                          "reflectance", "ring", "return_number", "num_returns"};
  using Point = std::array<double, kColumns.size()>;

  /// The columns of the next point; nothing where there is none.
  std::optional<Point> next() {
    while (row_ == num_rows_) {
      if (frame_ == sequence_.num_frames) return std::nullopt;
      const NpyTable table = read_scans(dataset_, scanner_, frame_++);
      for (std::size_t k = 0; k < kColumns.size(); ++k)
        columns_[k] =
            table.numbers(k == 0 && is_by_clock() ? "stamp_s" : kColumns[k], scanner_.file);
      num_rows_ = table.num_rows;
      row_ = 0;
    }
    Point point;
    for (std::size_t k = 0; k < point.size(); ++k) point[k] = columns_[k][row_];
    ++row_;
    return point;
  }

 private:
  const Dataset& dataset_;
  const Sequence& sequence_;
  const SensorRecord& scanner_;
  int frame_ = 0;
  std::size_t row_ = 0, num_rows_ = 0;
  std::array<std::vector<double>, kColumns.size()> columns_;
};

/// Where the fields of a cloud's points are that must be there.
struct CloudFields {
  struct Type {
    double datatype;  ///< of sensor_msgs/PointField
    std::size_t num_bytes;
  };
  struct Field {
    const char* name;
    Type type;
  };
  static constexpr Type kFloat32{7.0, 4}, kUint16{4.0, 2}, kUint8{2.0, 1};
  /// In the order of ScannedPoints::kColumns.
  static constexpr std::array<Field, ScannedPoints::kColumns.size()> kFields = {
      {{"time", kFloat32},
       {"x", kFloat32},
       {"y", kFloat32},
       {"z", kFloat32},
       {"intensity", kFloat32},
       {"ring", kUint16},
       {"return_number", kUint8},
       {"num_returns", kUint8}}};

  std::array<std::size_t, kFields.size()> offsets{};
  std::size_t point_bytes = 0;

  explicit CloudFields(const ReadMessage& cloud) {
    point_bytes = static_cast<std::size_t>(whole_of(cloud.value.at("point_step"), cloud.where));
    for (std::size_t k = 0; k < kFields.size(); ++k) {
      const auto& [name, type] = kFields[k];
      bool is_there = false;
      for (const RosValue& field : cloud.value.at("fields").items) {
        if (field.at("name").text != name) continue;
        offsets[k] = static_cast<std::size_t>(whole_of(field.at("offset"), cloud.where));
        is_there = field.at("datatype").number == type.datatype &&
                   offsets[k] + type.num_bytes <= point_bytes;
      }
      if (!is_there)
        fail(ErrorKind::Input, "{}: no field {} of its right type within a point", cloud.where,
             name);
    }
  }
};

template <class Number>
double number_at(const std::byte* at) {
  Number number;
  std::memcpy(&number, at, sizeof(Number));
  return static_cast<double>(number);
}

void check_cloud(const Dataset& dataset, const ReadMessage& cloud, const std::string& path,
                 std::int64_t start_ns, ScannedPoints& scans) {
  const CloudFields fields(cloud);
  const RosValue& data = cloud.value.at("data");
  const auto num_points =
      static_cast<std::uint64_t>(whole_of(cloud.value.at("width"), cloud.where));
  if (cloud.value.at("height").number != 1.0 || data.num_bytes % fields.point_bytes != 0 ||
      data.num_bytes / fields.point_bytes != num_points)
    fail(ErrorKind::Input, "{}: {} bytes for {} points of {}", cloud.where, data.num_bytes,
         num_points, fields.point_bytes);
  if (cloud.value.at("row_step").number != static_cast<double>(data.num_bytes))
    fail(ErrorKind::Input, "{}: row_step is {}; {} is right", cloud.where,
         cloud.value.at("row_step").number, data.num_bytes);
  if (cloud.value.at("is_dense").number != 1.0 || cloud.value.at("is_bigendian").number != 0.0)
    fail(ErrorKind::Input,
         "{}: is_dense is {} and is_bigendian {}; true (all points are finite) and false are right",
         cloud.where, cloud.value.at("is_dense").number, cloud.value.at("is_bigendian").number);
  const std::vector<std::byte> bytes =
      read_bytes_at(dataset.root / path, path, cloud.offset + data.bytes_at, data.num_bytes);
  for (std::size_t i = 0; i < num_points; ++i) {
    const auto right = scans.next();
    if (!right) fail(ErrorKind::Input, "{}: more points than the scans have", cloud.where);
    const std::byte* point = &bytes[i * fields.point_bytes];
    // The message counts a point's time from its own stamp.
    const double since_s = (*right)[0] - 1e-9 * static_cast<double>(cloud.stamp_ns() - start_ns);
    constexpr double kStampRounding_s = 1e-9;
    bool is_right = std::abs(number_at<float>(point + fields.offsets[0]) - since_s) <=
                    kSameFloat * std::abs(since_s) + kStampRounding_s;
    for (std::size_t k = 1; k < 5; ++k) {
      const double found = number_at<float>(point + fields.offsets[k]);
      is_right = is_right && std::abs(found - (*right)[k]) <= kSameFloat * std::abs((*right)[k]);
    }
    is_right = is_right && number_at<std::uint16_t>(point + fields.offsets[5]) == (*right)[5] &&
               number_at<std::uint8_t>(point + fields.offsets[6]) == (*right)[6] &&
               number_at<std::uint8_t>(point + fields.offsets[7]) == (*right)[7];
    if (!is_right)
      fail(ErrorKind::Input,
           "{}: point {} is not that of the scans (time, x, y, z, intensity, ring, "
           "return_number, num_returns)",
           cloud.where, i);
  }
}

/// Scans begin at multiples of their period, from the first frame's time to the last one's.
void check_number_of_clouds(const Sequence& sequence, const SensorRecord& scanner,
                            std::size_t num_clouds, const std::string& where) {
  const auto count = static_cast<double>(num_clouds);
  const double last_frame_s = (sequence.num_frames - 1) / sequence.rate_hz;
  if (num_clouds == 0 || (count - 1.0) / scanner.rate_hz > last_frame_s ||
      count / scanner.rate_hz <= last_frame_s)
    fail(ErrorKind::Input,
         "{}: {} messages; one of each scan is right, which begin {} times a second from 0 to "
         "{} s",
         where, num_clouds, scanner.rate_hz, last_frame_s);
}

void check_clouds(const Dataset& dataset, const Sequence& sequence, const SensorRecord& scanner,
                  std::int64_t start_ns, const std::string& frame, Bag& bag) {
  check_number_of_clouds(sequence, scanner, bag.num_messages("/" + frame),
                         bag.path() + ": /" + frame);
  ScannedPoints scans(dataset, sequence, scanner);
  bag.visit("/" + frame, "sensor_msgs/msg/PointCloud2",
            [&](std::size_t i, const ReadMessage& cloud) {
              const double time_s = static_cast<double>(i) / scanner.rate_hz;
              check_stamp(cloud, scans.is_by_clock() ? scanner.clock->reading_s(time_s) : time_s,
                          time_s, start_ns);
              cloud.check_frame(frame);
              check_cloud(dataset, cloud, bag.path(), start_ns, scans);
            });
  if (scans.next())
    fail(ErrorKind::Input, "{}: /{} has fewer points than {}", bag.path(), frame, scanner.file);
}

void check_mount(const std::map<std::string, Pose>& mounts, const SensorRecord& sensor,
                 const std::string& frame, const std::string& path) {
  constexpr double kRounding = 1e-11;
  const auto found = mounts.find(frame);
  if (found == mounts.end())
    fail(ErrorKind::Input, "{}: /tf_static has no transform of {}", path, frame);
  const Pose& right = sensor.body_from_sensor;
  if (!((found->second.rotation - right.rotation).norm() <= kRounding) ||
      !((found->second.translation - right.translation).norm() <=
        kRounding * (1.0 + right.translation.norm())))
    fail(ErrorKind::Input, "{}: /tf_static mounts {} otherwise than sensors.json", path, frame);
}

}  // namespace

void check_bag_sensors(const Dataset& dataset, const Sequence& sequence,
                       const std::vector<SensorRecord>& sensors, std::int64_t start_ns,
                       const std::map<std::string, Pose>& mounts, Bag& bag, Findings& findings) {
  for (const SensorRecord& sensor : sensors) {
    const std::string frame = ros_word(sensor.rig) + "/" + ros_word(sensor.name);
    const bool is_exported =
        std::any_of(sequence.cameras.begin(), sequence.cameras.end(),
                    [&](const Camera& camera) { return camera.rig == sensor.rig; });
    // A rig without cameras may have been left out.
    if (!is_exported && !mounts.contains(frame)) continue;
    if (sensor.kind.find('.') != std::string::npos) continue;  // of a plug-in
    if (sensor.kind == "events") continue;                     // the bag leaves them out
    findings.attempt(bag.path(), [&] {
      check_mount(mounts, sensor, frame, bag.path());
      if (sensor.is_scan) check_clouds(dataset, sequence, sensor, start_ns, frame, bag);
      for (const SampledTopic& topic : sampled_topics())
        if (topic.kind == sensor.kind)
          check_samples(topic, sensor, sequence.states_sensor_stamps, start_ns, frame, bag);
    });
  }
}

}  // namespace terracast::validate
