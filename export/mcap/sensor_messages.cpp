// IMU              Imu: what it shows; variances of white noise, density^2 rate; no orientation.
// GNSS             NavSatFix, the height above the ellipsoid; its velocity as TwistWithCovarianceStamped, east, north, up
//                  of the antenna's own place. Fixes against a base station are GBAS_FIX; their covariances tell fixed
//                  from floating.
// barometer        FluidPressure.
// magnetometer     MagneticField, tesla.
// rangefinder      Range of light; radar_altimeter: Range in a cone, for which the message has no kind but sound.
// lidar            PointCloud2, one a scan: points as they are shown, in the sensor's frame at each point's own time.

#include "export/mcap/sensor_messages.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <numbers>

#include "export/euroc_files.h"
#include "export/stream_columns.h"

namespace terracast::exporters {
namespace {

using Eigen::Vector3d;

double squared(double value) { return value * value; }

/// A sensor that has messages for each sample.
class SampleMessages : public SensorMessages {
 public:
  explicit SampleMessages(const capture::StreamInfo& stream)
      : num_channels_(stream.channels.size()) {}

  void make(const capture::Samples& samples, const MessageTimes& times,
            const std::function<RosHeader(double)>& header, const Take& take) const override {
    for (std::size_t i = 0; i < samples.times_s.size(); ++i) {
      const double time_s = samples.times_s[i];
      make_one(
          &samples.values[i * num_channels_], header(times.stamps_s[i]),
          [&](std::size_t topic, RosMessage message) { take(topic, time_s, std::move(message)); });
    }
  }

 protected:
  using TakeOne = std::function<void(std::size_t topic, RosMessage message)>;
  virtual void make_one(const double* row, const RosHeader& header, const TakeOne& take) const = 0;

  /// Of three columns, one after the other.
  static Vector3d vector(const double* row, std::size_t first) {
    return {row[first], row[first + 1], row[first + 2]};
  }

 private:
  std::size_t num_channels_;
};

class ImuMessages final : public SampleMessages {
 public:
  explicit ImuMessages(const capture::StreamInfo& stream)
      : SampleMessages(stream),
        gyro_(StreamColumns(stream).at("gyro_x_radps")),
        accel_(StreamColumns(stream).at("accel_x_mps2")) {
    const ImuBelief belief = imu_belief(stream.settings_toml);
    gyro_variance_ = squared(belief.gyro_noise_radps_per_sqrt_hz) * stream.rate_hz;
    accel_variance_ = squared(belief.accel_noise_mps2_per_sqrt_hz) * stream.rate_hz;
  }
  std::vector<SensorTopic> topics() const override { return {{"", "sensor_msgs/msg/Imu"}}; }

 private:
  void make_one(const double* row, const RosHeader& header, const TakeOne& take) const override {
    take(0, imu_message(header, vector(row, gyro_), vector(row, accel_), gyro_variance_,
                        accel_variance_));
  }
  std::size_t gyro_, accel_;
  double gyro_variance_ = 0.0, accel_variance_ = 0.0;
};

class GnssMessages final : public SampleMessages {
 public:
  explicit GnssMessages(const capture::StreamInfo& stream) : SampleMessages(stream), columns_{} {
    constexpr std::array kNames = {"lat_deg",
                                   "lon_deg",
                                   "height_m",
                                   "sigma_horizontal_m",
                                   "sigma_vertical_m",
                                   "fix",
                                   "velocity_north_mps",
                                   "velocity_east_mps",
                                   "velocity_down_mps",
                                   "sigma_velocity_horizontal_mps",
                                   "sigma_velocity_vertical_mps"};
    static_assert(kNames.size() == kNumColumns);
    for (std::size_t i = 0; i < kNames.size(); ++i)
      columns_[i] = StreamColumns(stream).at(kNames[i]);
  }
  std::vector<SensorTopic> topics() const override {
    return {{"/fix", "sensor_msgs/msg/NavSatFix"},
            {"/velocity", "geometry_msgs/msg/TwistWithCovarianceStamped"}};
  }

 private:
  static constexpr std::size_t kNumColumns = 11;

  void make_one(const double* row, const RosHeader& header, const TakeOne& take) const override {
    constexpr double kSingle = 1.0;
    constexpr std::int8_t kFix = 0, kGroundBasedFix = 2;
    std::array<double, kNumColumns> v{};
    for (std::size_t i = 0; i < kNumColumns; ++i) v[i] = row[columns_[i]];
    take(0, nav_sat_fix_message(header, {.lat_deg = v[0], .lon_deg = v[1], .height_m = v[2]},
                                v[5] == kSingle ? kFix : kGroundBasedFix, squared(v[3]),
                                squared(v[4])));
    take(1, velocity_message(header, {v[7], v[6], -v[8]},
                             {squared(v[9]), squared(v[9]), squared(v[10])}));
  }
  std::array<std::size_t, kNumColumns> columns_;
};

class BarometerMessages final : public SampleMessages {
 public:
  explicit BarometerMessages(const capture::StreamInfo& stream)
      : SampleMessages(stream),
        pressure_(StreamColumns(stream).at("pressure_pa")),
        variance_(squared(number_of_settings(stream, "errors", "noise_pa"))) {}
  std::vector<SensorTopic> topics() const override {
    return {{"", "sensor_msgs/msg/FluidPressure"}};
  }

 private:
  void make_one(const double* row, const RosHeader& header, const TakeOne& take) const override {
    take(0, fluid_pressure_message(header, row[pressure_], variance_));
  }
  std::size_t pressure_;
  double variance_;
};

class MagnetometerMessages final : public SampleMessages {
 public:
  explicit MagnetometerMessages(const capture::StreamInfo& stream)
      : SampleMessages(stream),
        field_(StreamColumns(stream).at("field_x_nt")),
        variance_t2_(squared(kTeslaOfNanotesla *
                             number_of_settings(stream, "errors", "noise_nt_per_sqrt_hz")) *
                     stream.rate_hz) {}
  std::vector<SensorTopic> topics() const override {
    return {{"", "sensor_msgs/msg/MagneticField"}};
  }

 private:
  static constexpr double kTeslaOfNanotesla = 1e-9;
  void make_one(const double* row, const RosHeader& header, const TakeOne& take) const override {
    take(0, magnetic_field_message(header, kTeslaOfNanotesla * vector(row, field_), variance_t2_));
  }
  std::size_t field_;
  double variance_t2_;
};

class RangeMessages final : public SampleMessages {
 public:
  explicit RangeMessages(const capture::StreamInfo& stream)
      : SampleMessages(stream), column_(StreamColumns(stream).at("range_m")) {
    limits_.is_light = stream.kind == "rangefinder";
    limits_.least_m = static_cast<float>(number_of_settings(stream, "", "least_range_m"));
    limits_.most_m = static_cast<float>(number_of_settings(stream, "", "most_range_m"));
    if (limits_.is_light) return;
    limits_.field_of_view_rad = static_cast<float>(
        2.0 * number_of_settings(stream, "", "half_angle_deg") * std::numbers::pi / 180.0);
    noise_m_ = number_of_settings(stream, "", "noise_m");
    noise_share_ = number_of_settings(stream, "", "noise_share");
  }
  std::vector<SensorTopic> topics() const override { return {{"", "sensor_msgs/msg/Range"}}; }

 private:
  void make_one(const double* row, const RosHeader& header, const TakeOne& take) const override {
    RosRange range = limits_;
    range.range_m = static_cast<float>(row[column_]);
    if (std::isfinite(row[column_]))
      range.variance_m2 =
          static_cast<float>(squared(std::max(noise_m_, noise_share_ * row[column_])));
    take(0, range_message(header, range));
  }
  std::size_t column_;
  RosRange limits_;
  double noise_m_ = 0.0, noise_share_ = 0.0;
};

class LidarMessages final : public SensorMessages {
 public:
  explicit LidarMessages(const capture::StreamInfo& stream)
      : num_channels_(stream.channels.size()), columns_{} {
    constexpr std::array kNames = {"x_m",  "y_m",           "z_m",        "reflectance",
                                   "ring", "return_number", "num_returns"};
    static_assert(kNames.size() == kNumColumns);
    for (std::size_t i = 0; i < kNames.size(); ++i)
      columns_[i] = StreamColumns(stream).at(kNames[i]);
  }
  std::vector<SensorTopic> topics() const override { return {{"", "sensor_msgs/msg/PointCloud2"}}; }
  void make(const capture::Samples& scans, const MessageTimes& times,
            const std::function<RosHeader(double)>& header, const Take& take) const override {
    const std::vector<double>& ticks_s = times.ticks_s;
    std::size_t row = 0;
    for (std::size_t k = 0; k < ticks_s.size(); ++k) {
      const std::size_t begin = row;
      while (row < scans.times_s.size() &&
             (k + 1 == ticks_s.size() || scans.times_s[row] < ticks_s[k + 1]))
        ++row;
      take(0, ticks_s[k],
           point_cloud_message(header(times.tick_stamps_s[k]), kFields, kPointBytes,
                               points(scans, times, begin, row, times.tick_stamps_s[k])));
    }
  }

 private:
  static constexpr std::size_t kNumColumns = 7;
  static constexpr std::uint32_t kPointBytes = 24;
  static constexpr std::array kFields = {RosPointField{"x", 0, RosPointField::kFloat32},
                                         RosPointField{"y", 4, RosPointField::kFloat32},
                                         RosPointField{"z", 8, RosPointField::kFloat32},
                                         RosPointField{"intensity", 12, RosPointField::kFloat32},
                                         RosPointField{"time", 16, RosPointField::kFloat32},
                                         RosPointField{"ring", 20, RosPointField::kUint16},
                                         RosPointField{"return_number", 22, RosPointField::kUint8},
                                         RosPointField{"num_returns", 23, RosPointField::kUint8}};

  /// Rows begin … end - 1, as kFields has them; their stamps from the message's own on.
  std::vector<std::byte> points(const capture::Samples& scans, const MessageTimes& times,
                                std::size_t begin, std::size_t end, double start_s) const {
    std::vector<std::byte> bytes((end - begin) * kPointBytes);
    std::byte* to = bytes.data();
    const auto put = [&to](auto number) {
      std::memcpy(to, &number, sizeof(number));
      to += sizeof(number);
    };
    for (std::size_t row = begin; row < end; ++row) {
      const double* values = &scans.values[row * num_channels_];
      for (std::size_t i = 0; i < 4; ++i) put(static_cast<float>(values[columns_[i]]));
      put(static_cast<float>(times.stamps_s[row] - start_s));
      put(static_cast<std::uint16_t>(values[columns_[4]]));
      put(static_cast<std::uint8_t>(values[columns_[5]]));
      put(static_cast<std::uint8_t>(values[columns_[6]]));
    }
    return bytes;
  }

  std::size_t num_channels_;
  std::array<std::size_t, kNumColumns> columns_;
};

template <class Messages>
std::unique_ptr<SensorMessages> made(const capture::StreamInfo& stream) {
  return std::make_unique<Messages>(stream);
}

struct KindOfSensor {
  std::string_view name;
  std::unique_ptr<SensorMessages> (*make)(const capture::StreamInfo&);
};
constexpr std::array kKinds = {KindOfSensor{"barometer", made<BarometerMessages>},
                               KindOfSensor{"gnss", made<GnssMessages>},
                               KindOfSensor{"imu", made<ImuMessages>},
                               KindOfSensor{"lidar", made<LidarMessages>},
                               KindOfSensor{"magnetometer", made<MagnetometerMessages>},
                               KindOfSensor{"radar_altimeter", made<RangeMessages>},
                               KindOfSensor{"rangefinder", made<RangeMessages>}};

}  // namespace

std::unique_ptr<SensorMessages> sensor_messages(const capture::StreamInfo& stream) {
  const auto found = std::find_if(kKinds.begin(), kKinds.end(), [&](const KindOfSensor& kind) {
    return kind.name == stream.kind;
  });
  return found == kKinds.end() ? nullptr : found->make(stream);
}

}  // namespace terracast::exporters
