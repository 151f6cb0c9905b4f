// MCAP through the whole program: a flight with sensors of every kind, read by the format's own reader; and files that are
// wrong, each found and named.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "core/atomic_file.h"
#include "core/crc32.h"
#include "core/json.h"
#include "tests/support/bag_reader.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"
#include "validate/dataset.h"
#include "validate/npy.h"
#include "validate/readers/mcap_container.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using core::Json;
using testing::HasSubstr;

constexpr const char* kJob = R"(name = "job"
world = {{name = "job", origin_lat_deg = 46.0, origin_lon_deg = 7.0, size_m = 512.0, outside = "extend", elevation = [{{kind = "plane", vertical_datum = "ellipsoid", height_m = 500.0}}]}}
detail.finest_spacing_m = 2.0
trajectories = [{{name = "P000", kind = "orbit", centre = {{east_m = 0.0, north_m = 0.0, height_m = 40.0, above = "ground"}}, radius_m = 60.0, speed_mps = 12.0, rate_hz = 15.0, num_frames = 8, utc_start = "2025-06-21T10:00:00.123456789Z"}}]
conditions.color_samples = 1

[[rigs]]
name = "down"
mount_pitch_deg = 60.0

[[rigs.cameras]]
name = "left"
model = "opencv"
width_px = 48
height_px = 36
fx_px = 45.0
fy_px = 45.5
k1 = -0.28
k2 = 0.07
p1 = 0.0002

[[rigs.cameras]]
name = "wide"
model = "opencv_fisheye"
width_px = 48
height_px = 36
fx_px = 25.0
k1 = 0.01
offset_mm = [0.0, -110.0, 0.0]

[[rigs.sensors]]
name = "fast"
kind = "imu"
rate_hz = 200.0
offset_mm = [30.0, -20.0, 10.0]
euler_deg = [30.0, 10.0, 180.0]
gyroscope = "{0}/adis16448_kalibr/gyroscope.toml"
accelerometer = "{0}/adis16448_kalibr/accelerometer.toml"

[[rigs.sensors]]
name = "receiver"
kind = "gnss"
rate_hz = 10.0
single = "{0}/gnss_ins_sim_low/single.toml"

[[rigs.sensors]]
name = "air"
kind = "barometer"
rate_hz = 25.0
errors = "{0}/px4_gazebo/barometer.toml"

[[rigs.sensors]]
name = "compass"
kind = "magnetometer"
rate_hz = 50.0
errors = "{0}/gnss_ins_sim_low/magnetometer.toml"

[[rigs.sensors]]
name = "laser"
kind = "rangefinder"
rate_hz = 30.0

[[rigs.sensors]]
name = "radar"
kind = "radar_altimeter"
rate_hz = 20.0
half_angle_deg = 30.0
noise_m = 0.1

[[rigs.sensors]]
name = "spin-16"
kind = "lidar"
rate_hz = 10.0
cycle_us = 5530.0
range_noise_m = 0.03

[[rigs.sensors]]
name = "slow"
kind = "lidar"
rate_hz = 1.0
cycle_us = 16590.0

[[exports]]
format = "mcap"
images = "grey"
)";

/// Runs the job.
/// returns   the dataset
fs::path make_bag(const fs::path& folder) {
  core::write_file(folder / "job.toml", fmt::format(kJob, TERRACAST_SOURCE_DIR "/configs/sensors"));
  const ProgramResult run = run_program(
      {"run", (folder / "job.toml").string(), "--out", (folder / "out").string(), "--quiet"});
  EXPECT_EQ(run.status, 0) << run.output;
  return folder / "out/export/mcap";
}

/// A sensor's table: a map from column to its numbers.
std::map<std::string, std::vector<double>> table_of(const fs::path& csv) {
  std::istringstream text(core::read_text_file(csv));
  std::string line, cell;
  std::getline(text, line);
  std::vector<std::string> names;
  std::istringstream head(line);
  while (std::getline(head, cell, ',')) names.push_back(cell);
  std::map<std::string, std::vector<double>> columns;
  while (std::getline(text, line)) {
    std::istringstream row(line);
    for (const std::string& name : names) {
      std::getline(row, cell, ',');
      columns[name].push_back(std::stod(cell));
    }
  }
  return columns;
}

const Json& field_of(const Json& message, const std::string& path) {
  const Json* at = &message.at("fields");
  std::istringstream names(path);
  for (std::string name; std::getline(names, name, '.');) at = &at->at(name);
  return *at;
}

constexpr std::int64_t kStart_ns = 1'750'500'000'123'456'789;

/// Holds a topic's messages against a sensor's table.
struct Sampled {
  const char* topic;
  const char* file;
  std::vector<std::pair<const char*, const char*>> fields;
  double factor = 1.0;
};
void check_topic(const Bag& bag, const fs::path& sequence, const Sampled& sampled) {
  SCOPED_TRACE(sampled.topic);
  const auto messages = bag.of(sampled.topic);
  const auto table = table_of(sequence / "sensors/down" / sampled.file);
  const std::vector<double>& times_s = table.at("time_s");
  ASSERT_EQ(messages.size(), times_s.size());
  for (std::size_t i = 0; i < messages.size(); ++i) {
    EXPECT_EQ(stamp_ns(*messages[i]), kStart_ns + std::llround(1e9 * times_s[i]));
    for (const auto& [field, column] : sampled.fields)
      EXPECT_DOUBLE_EQ(field_of(*messages[i], field).number(), sampled.factor * table.at(column)[i])
          << field;
  }
}

/// A lidar's clouds against the scans of every frame, one after the other.
struct ScannedTopic {
  const char* topic;
  const char* folder;
  std::size_t num_scans;
  double period_s;
};
void check_points(const Bag& bag, const fs::path& sequence, const ScannedTopic& scanned) {
  SCOPED_TRACE(scanned.topic);
  std::vector<validate::NpyTable> scans;
  for (int frame = 0; frame < 8; ++frame)
    scans.push_back(validate::parse_npy_table(
        core::read_file(sequence / fmt::format("sensors/down/{}/{:06}.npy", scanned.folder, frame)),
        "scan"));
  std::size_t scan = 0, row = 0, num_points = 0;
  const auto clouds = bag.of(scanned.topic);
  ASSERT_EQ(clouds.size(), scanned.num_scans);
  for (std::size_t k = 0; k < clouds.size(); ++k) {
    const double start_s = scanned.period_s * static_cast<double>(k);
    EXPECT_EQ(stamp_ns(*clouds[k]), kStart_ns + std::llround(1e9 * start_s));
    const std::vector<std::byte> bytes = bytes_of_hex(clouds[k]->at("fields").at("data").string());
    ASSERT_EQ(bytes.size(),
              24U * static_cast<std::size_t>(field_of(*clouds[k], "width").integer()));
    for (std::size_t at = 0; at < bytes.size(); at += 24, ++row, ++num_points) {
      while (row == scans.at(scan).num_rows) ++scan, row = 0;
      const validate::NpyTable& table = scans[scan];
      const auto right = [&](const char* column) {
        return table.number(table.column(column, "scan"), row);
      };
      float numbers[5];
      std::uint16_t ring = 0;
      std::memcpy(numbers, &bytes[at], sizeof(numbers));
      std::memcpy(&ring, &bytes[at + 20], sizeof(ring));
      const char* columns[] = {"x_m", "y_m", "z_m", "reflectance"};
      for (int i = 0; i < 4; ++i) ASSERT_EQ(numbers[i], static_cast<float>(right(columns[i])));
      // Half a step of a float32 below 1 is 3e-8.
      ASSERT_NEAR(static_cast<double>(numbers[4]), right("time_s") - start_s, 3.1e-8);
      ASSERT_EQ(ring, right("ring"));
    }
  }
  EXPECT_GT(num_points, 200U);
  while (scan < scans.size() && row == scans[scan].num_rows) ++scan, row = 0;
  EXPECT_EQ(scan, scans.size());
}

/// The job is run once for all tests of a process.
struct McapFlight : testing::Test {
  static inline std::unique_ptr<ScratchFolder> folder;
  static inline fs::path dataset;
  void SetUp() override {
    if (folder) return;
    folder = std::make_unique<ScratchFolder>();
    dataset = make_bag(*folder / "job");
  }
  static void TearDownTestSuite() { folder.reset(); }
};

TEST_F(McapFlight, AnotherReaderFindsAllThatTheSensorsShow) {
  const Json report = Json::read(*folder / "job/out/report/mcap/report.json");
  EXPECT_TRUE(report.at("ok").boolean());
  const fs::path sequence = dataset / "P000";
  const Bag bag = read_bag(sequence / "P000.mcap");
  check_topic(bag, sequence,
              {"/down/fast",
               "fast.csv",
               {{"angular_velocity.x", "gyro_x_radps"},
                {"angular_velocity.z", "gyro_z_radps"},
                {"linear_acceleration.y", "accel_y_mps2"},
                {"linear_acceleration.z", "accel_z_mps2"}}});
  check_topic(bag, sequence,
              {"/down/receiver/fix",
               "receiver.csv",
               {{"latitude", "lat_deg"}, {"longitude", "lon_deg"}, {"altitude", "height_m"}}});
  check_topic(bag, sequence,
              {"/down/receiver/velocity",
               "receiver.csv",
               {{"twist.twist.linear.x", "velocity_east_mps"},
                {"twist.twist.linear.y", "velocity_north_mps"}}});
  check_topic(bag, sequence, {"/down/air", "air.csv", {{"fluid_pressure", "pressure_pa"}}});
  check_topic(bag, sequence,
              {"/down/compass", "compass.csv", {{"magnetic_field.x", "field_x_nt"}}, 1e-9});
  for (const char* name : {"laser", "radar"}) {
    const auto table = table_of(sequence / "sensors/down" / (std::string(name) + ".csv"));
    const auto ranges = bag.of(std::string("/down/") + name);
    ASSERT_EQ(ranges.size(), table.at("time_s").size());
    for (std::size_t i = 0; i < ranges.size(); ++i)
      EXPECT_EQ(static_cast<float>(field_of(*ranges[i], "range").number()),
                static_cast<float>(table.at("range_m")[i]));
  }
  check_points(bag, sequence, {"/down/spin_16", "spin-16", 5, 0.1});
  check_points(bag, sequence, {"/down/slow", "slow", 1, 1.0});
  // Densities squared, times the rate; the believed deviations of a fix.
  const Json& imu = *bag.of("/down/fast").front();
  EXPECT_DOUBLE_EQ(field_of(imu, "angular_velocity_covariance").numbers()[4],
                   1.87e-4 * 1.87e-4 * 200.0);
  EXPECT_EQ(field_of(imu, "orientation_covariance").numbers()[0], -1.0);
  const auto fixes = table_of(sequence / "sensors/down/receiver.csv");
  const Json& fix = *bag.of("/down/receiver/fix").front();
  EXPECT_DOUBLE_EQ(field_of(fix, "position_covariance").numbers()[8],
                   std::pow(fixes.at("sigma_vertical_m")[0], 2));
  EXPECT_EQ(field_of(fix, "position_covariance_type").integer(), 2);
  EXPECT_THAT(core::read_text_file(sequence / "metadata.yaml"),
              HasSubstr(fmt::format("  message_count: {}\n", bag.messages.size())));
}

template <class Number>
Number number_at(const std::vector<std::byte>& bytes, std::size_t at) {
  Number number;
  std::memcpy(&number, &bytes.at(at), sizeof(number));
  return number;
}
template <class Number>
void put_at(std::vector<std::byte>& bytes, std::size_t at, Number number) {
  std::memcpy(&bytes.at(at), &number, sizeof(number));
}

/// Makes the CRCs of a changed file right: of chunks and data; that of the summary becomes 0, which is none.
void mend_crcs(std::vector<std::byte>& file) {
  for (std::size_t at = 8;;) {
    const auto opcode = std::to_integer<int>(file.at(at));
    const auto length = number_at<std::uint64_t>(file, at + 1);
    if (opcode == 6) {
      constexpr std::size_t kHead = 40;  // times, size, CRC, compression "", size
      put_at(file, at + 9 + 24,
             core::crc32_of(std::span(file).subspan(at + 9 + kHead, length - kHead)));
    }
    if (opcode == 15) {
      put_at(file, at + 9, core::crc32_of(std::span(file).first(at)));
      put_at(file, file.size() - 12, std::uint32_t{0});
      return;
    }
    at += 9 + length;
  }
}

void replace_all(std::vector<std::byte>& file, std::string_view from, std::string_view to) {
  ASSERT_EQ(from.size(), to.size());
  std::string_view text(reinterpret_cast<const char*>(file.data()), file.size());
  std::size_t count = 0;
  for (std::size_t at = text.find(from); at != std::string_view::npos; at = text.find(from, at + 1))
    std::memcpy(&file[at], to.data(), to.size()), ++count;
  EXPECT_GT(count, 0U) << from;
}

/// What validate's reader finds.
std::string findings_of(const fs::path& dataset) {
  validate::Findings findings;
  validate::read_dataset(dataset, "", findings);
  std::string all;
  for (const std::string& line : findings.lines()) all += line + "\n";
  return all;
}

/// Moves a message of /tf, and whatever is logged at its time.
void restamp_transform(std::vector<std::byte>& file, std::size_t message, std::int64_t by_ns) {
  const auto old_ns = number_at<std::int64_t>(file, message - 16);
  for (std::size_t at = 0; at + 8 <= file.size(); ++at)
    if (std::int64_t found = 0; std::memcpy(&found, &file[at], 8), found == old_ns)
      put_at(file, at, old_ns + by_ns);
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  put_at(file, message + 8, static_cast<std::int32_t>((old_ns + by_ns) / kSecond_ns));
  put_at(file, message + 12, static_cast<std::uint32_t>((old_ns + by_ns) % kSecond_ns));
}

TEST_F(McapFlight, MissingScansAreFound) {
  EXPECT_EQ(findings_of(dataset), "");
  const fs::path path = dataset / "P000/sensors.json";
  const std::string right = core::read_text_file(path);
  std::string wrong = right;
  const std::size_t rate = wrong.find("\"rate_hz\": 1.0", wrong.find("\"slow\""));
  ASSERT_NE(rate, std::string::npos) << wrong;
  wrong.replace(rate, 14, "\"rate_hz\": 4.0");
  core::write_file(path, wrong);
  EXPECT_THAT(findings_of(dataset), HasSubstr("/down/slow: 1 messages; one of each scan is right"));
  core::write_file(path, right);
}

TEST_F(McapFlight, WrongFilesAreFoundAndNamed) {
  const fs::path path = dataset / "P000/P000.mcap";
  const std::vector<std::byte> right = core::read_file(path);
  const validate::BagFile bag = validate::read_bag_file(path, "P000.mcap");
  const auto message = [&](const char* topic, std::size_t index) {
    return static_cast<std::size_t>(bag.topics.at(topic).messages.at(index).offset);
  };
  const auto negate = [](std::vector<std::byte>& file, std::size_t at) {
    put_at(file, at, -number_at<double>(file, at));
  };
  using File = std::vector<std::byte>;
  struct Row {
    std::function<void(File&)> change;
    const char* words;
    bool mends = true;
  };
  // Where fields stand in messages: a head of 4, a stamp of 8, the text of the frame, then multiples of 8 after the head.
  constexpr std::size_t kImuForces = 228, kFixAltitude = 52, kQuaternion = 68, kOdometryChild = 24;
  constexpr std::size_t kCloudWidth = 36;
  const auto end_of_cloud =
      message("/down/spin_16", 0) +
      static_cast<std::size_t>(bag.topics.at("/down/spin_16").messages.at(0).num_bytes);
  const std::vector<Row> rows = {
      {[&](File& file) { negate(file, message("/down/fast", 3) + kImuForces + 16); },
       "linear_acceleration.z is"},
      {[&](File& file) {
         const std::size_t at = message("/down/receiver/fix", 1) + kFixAltitude;
         put_at(file, at, number_at<double>(file, at) - 48.0);
       },
       "altitude is"},
      {[&](File& file) {
         const std::size_t at = message("/down/air", 2) + 4;
         put_at(file, at, number_at<std::int32_t>(file, at) + 1);
       },
       "a stamp is 1.000000000 s off"},
      {[&](File& file) {
         put_at(file, end_of_cloud - 1 - 24, 1.0F);  // x of the last point
       },
       "point "},
      {[&](File& file) { file[end_of_cloud - 3] ^= std::byte{1}; },
       "point "},  // return_number of the last
      {[&](File& file) { file[end_of_cloud - 2] ^= std::byte{1}; }, "point "},  // num_returns
      {[&](File& file) { file[end_of_cloud - 1] = std::byte{0}; }, "is_dense is 0"},
      {[&](File& file) {
         const std::size_t at = message("/down/spin_16", 0);
         const auto width = number_at<std::uint32_t>(file, at + kCloudWidth);
         put_at(file, end_of_cloud - 1 - 24 * std::size_t{width} - 8, std::uint32_t{24});
       },
       "row_step is 24"},
      {[&](File& file) { restamp_transform(file, message("/tf", 1), 1); },
       "when there is no frame and no sample of the first IMU"},
      {[&](File& file) {
         const std::size_t at = message("/tf", 2);
         restamp_transform(file, at,
                           number_at<std::int64_t>(file, message("/tf", 1) - 16) -
                               number_at<std::int64_t>(file, at - 16));
       },
       "/tf: message 2: a second transform of"},
      {[&](File& file) { replace_all(file, "down/wide_optical", "down/wade_optical"); },
       "a transform of down/wade_optical, which is no camera"},
      {[&](File& file) { replace_all(file, "down/wide_optical", "down/left_optical"); },
       "a second transform of down/left_optical"},
      {[&](File& file) { put_at(file, message("/truth/odometry", 1) + kOdometryChild, 'B'); },
       "child_frame_id is \"Base_link\""},
      // x y z w becomes w x y z.
      {[&](File& file) {
         const std::size_t at = message("/tf", 4) + kQuaternion;
         double q[4];
         std::memcpy(q, &file[at], sizeof(q));
         for (int i = 0; i < 4; ++i)
           put_at(file, at + 8 * static_cast<std::size_t>(i), q[(i + 3) % 4]);
       },
       "/tf at"},
      {[&](File& file) { replace_all(file, "float64 x\nfloat64 y\n", "float64 y\nfloat64 x\n"); },
       "map in earth is"},
      {[&](File& file) { replace_all(file, "durability: 1\n", "durability: 2\n"); },
       "/tf_static is offered without durability 1"},
      {[&](File& file) { replace_all(file, "plumb_bob", "plump_bob"); }, "distortion_model"},
      {[&](File& file) { replace_all(file, "down/left_optical", "down/levt_optical"); },
       "/tf_static has no transform of down/left_optical"},
      {[&](File& file) { replace_all(file, "32FC1", "16UC1"); }, "of the encoding 16UC1"},
      {[&](File& file) { file[message("/down/left/depth", 2) + 900] ^= std::byte{1}; },
       "the CRC of the chunk is", false},
      {[&](File& file) { file.resize(file.size() - 100); }, "bytes announced", false},
      {[&](File& file) { file[0] = std::byte{0x88}; }, "it begins otherwise", false}};
  for (const Row& row : rows) {
    SCOPED_TRACE(row.words);
    File file = right;
    row.change(file);
    if (row.mends) mend_crcs(file);
    core::write_file(path, file);
    EXPECT_THAT(findings_of(dataset), HasSubstr(row.words));
  }
  core::write_file(path, right);
}

}  // namespace
}  // namespace terracast::test
