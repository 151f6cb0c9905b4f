// KITTI's points, SemanticKITTI's labels and TartanAir's clouds as they are written by hand, and cut off.

#include "validate/readers/velodyne.h"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "core/semantic_class.h"
#include "tests/support/expect_error.h"

namespace terracast::test {
namespace {

template <class Number>
std::vector<std::byte> packed(const std::vector<Number>& numbers, const std::string& before = {}) {
  std::vector<std::byte> bytes(before.size() + numbers.size() * sizeof(Number));
  std::memcpy(bytes.data(), before.data(), before.size());
  std::memcpy(bytes.data() + before.size(), numbers.data(), numbers.size() * sizeof(Number));
  return bytes;
}

/// `work` refuses its input, in words that hold these.
template <class Work>
void expect_refused(const Work& work, const std::string& words) {
  expect_error(core::ErrorKind::Input, {words}, work);
}

TEST(Velodyne, PointsAreFourFloats) {
  const auto points =
      validate::parse_velodyne(packed<float>({1, 2, 3, 0.5F, -4, 5, -6, 0}), "a.bin");
  ASSERT_EQ(points.size(), 2U);
  EXPECT_EQ(points[1].place, Eigen::Vector3d(-4, 5, -6));
  EXPECT_EQ(points[0].reflectance, 0.5);
  EXPECT_TRUE(validate::parse_velodyne({}, "a.bin").empty());
  expect_refused([] { validate::parse_velodyne(packed<float>({1, 2, 3}), "a.bin"); }, "a.bin");
  expect_refused(
      [] {
        validate::parse_velodyne(packed<float>({1, 2, std::numeric_limits<float>::infinity(), 0}),
                                 "a.bin");
      },
      "not finite");
  EXPECT_EQ(validate::parse_velodyne_float64(packed<double>({1, 2, 3, 0.5})).size(), 1U);
}

TEST(Velodyne, LabelsHaveTheClassInTheLowerHalf) {
  const auto labels =
      validate::parse_labels(packed<std::uint32_t>({72, 3U << 16U | 252U}), "a.label");
  ASSERT_EQ(labels.size(), 2U);
  EXPECT_EQ(labels[1], (validate::ScanLabel{.label = 252, .instance = 3}));
  expect_refused(
      [] {
        validate::parse_labels(packed<std::uint8_t>({1, 2, 3}), "a.label");
      },
      "a.label");
}

// Numbers of semantic-kitti.yaml, and of the table in docs/formats/kitti.md.
TEST(Velodyne, ClassesHaveTheNumbersOfSemanticKitti) {
  const auto label_of = [](core::SemanticClass one, bool is_moving = false) {
    return validate::semantic_kitti_of(static_cast<std::size_t>(one), is_moving);
  };
  EXPECT_EQ(label_of(core::SemanticClass::Car), 10);
  EXPECT_EQ(label_of(core::SemanticClass::Car, true), 252);
  EXPECT_EQ(label_of(core::SemanticClass::Train, true), 256);
  EXPECT_EQ(label_of(core::SemanticClass::Tree), 70);
  EXPECT_EQ(label_of(core::SemanticClass::Grass, true), 72);
  EXPECT_EQ(label_of(core::SemanticClass::Lake), 0);
  for (std::size_t i = 0; i < core::kNumSemanticClasses; ++i)
    for (const bool is_moving : {false, true})
      EXPECT_TRUE(validate::is_semantic_kitti_label(validate::semantic_kitti_of(i, is_moving)));
  EXPECT_FALSE(validate::is_semantic_kitti_label(12));
  EXPECT_TRUE(validate::has_instances(257));
  EXPECT_FALSE(validate::has_instances(70));
}

TEST(Velodyne, InstancesAreTold) {
  const std::string header = "label,instance,instance_id\n";
  const auto ids = validate::parse_instances(header + "252,1,1073741824\n", "i.csv");
  EXPECT_EQ(ids.at({252, 1}), 1073741824);
  for (const std::string wrong : {"252,1\n", "252,70000,1\n", "252,1,1\n252,1,2\n", "a,1,1\n"})
    expect_refused([&] { validate::parse_instances(header + wrong, "i.csv"); }, "i.csv");
  expect_refused([] { validate::parse_instances("", "i.csv"); }, "i.csv:1");
}

TEST(Velodyne, ACloudOfTartanAirHasThreeFloats) {
  const std::string start = "ply\nformat binary_little_endian 1.0\nelement vertex 2\n";
  const std::string properties = "property float x\nproperty float y\nproperty float z\n";
  const auto cloud = [](const std::string& header) {
    return packed<float>({1, 2, 3, 4, 5, 6}, header + "end_header\n");
  };
  const auto points = validate::parse_lidar_ply(cloud(start + properties), "a.ply");
  ASSERT_EQ(points.size(), 2U);
  EXPECT_EQ(points[1].place, Eigen::Vector3d(4, 5, 6));
  for (const std::string& wrong :
       {start + "property double x\nproperty float y\nproperty float z\n",
        start + properties + "property float i\n",
        "ply\nformat binary_little_endian 1.0\nelement vertex 99999999999\n" + properties,
        "ply\nformat ascii 1.0\nelement vertex 2\n" + properties, std::string("ply\n")})
    expect_refused([&] { validate::parse_lidar_ply(cloud(wrong), "a.ply"); }, "a.ply");
}

}  // namespace
}  // namespace terracast::test
