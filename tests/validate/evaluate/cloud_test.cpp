#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/random.h"
#include "tests/support/test_data.h"
#include "tests/validate/evaluate/wall_flight.h"
#include "validate/evaluate/cloud_error.h"
#include "validate/evaluate/cloud_truth.h"
#include "validate/evaluate/results/cloud_files.h"
#include "validate/oracle/nearest_points.h"

/// Scores of clouds: by brute force, by closed forms, and files by hand.
namespace terracast::validate {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using test::ScratchFolder;
using testing::ElementsAre;
using testing::HasSubstr;

std::vector<Vector3d> random_points(std::size_t count, std::uint64_t stream, double extent_m) {
  std::vector<Vector3d> points;
  for (std::size_t i = 0; i < count; ++i)
    points.emplace_back(extent_m * core::random_unit(7, stream, 3 * i),
                        extent_m * core::random_unit(7, stream, 3 * i + 1),
                        0.1 * extent_m * core::random_unit(7, stream, 3 * i + 2));
  return points;
}

std::vector<double> brute_distances(const std::vector<Vector3d>& points,
                                    const std::vector<Vector3d>& queries) {
  std::vector<double> distances;
  for (const Vector3d& query : queries) {
    double least = std::numeric_limits<double>::infinity();
    for (const Vector3d& point : points) least = std::min(least, (query - point).norm());
    distances.push_back(least);
  }
  return distances;
}

std::vector<std::byte> bytes_of(const std::string& text) {
  std::vector<std::byte> bytes(text.size());
  std::memcpy(bytes.data(), text.data(), text.size());
  return bytes;
}

TEST(NearestPoints, AreThoseOfBruteForce) {
  for (const std::size_t count : {1U, 2U, 40U, 3000U}) {
    std::vector<Vector3d> points = random_points(count, 1, 50.0);
    points.insert(points.end(), points.begin(), points.end());  // each twice
    const std::vector<Vector3d> queries = random_points(2000, 2, 60.0);
    const std::vector<double> found = nearest_distances_m(points, queries);
    const std::vector<double> right = brute_distances(points, queries);
    // Three squares are added in another order: 3 units in the last place of the sum.
    for (std::size_t i = 0; i < queries.size(); ++i)
      ASSERT_NEAR(found[i], right[i], 1e-15 * (1.0 + right[i]) * 4.0);
  }
}

/// Equal points, points on a line and in a plane are no harder than others.
TEST(NearestPoints, RepeatedPointsCostNothing) {
  const std::vector<Vector3d> same(200'000, Vector3d(1.0, 2.0, 3.0));
  const auto begin = std::chrono::steady_clock::now();
  for (const double distance_m : nearest_distances_m(same, same)) ASSERT_EQ(distance_m, 0.0);
  std::vector<Vector3d> flat;
  for (int i = 0; i < 200'000; ++i) flat.emplace_back(i % 3, 0.0, 0.0);
  for (const double distance_m : nearest_distances_m(flat, flat)) ASSERT_EQ(distance_m, 0.0);
  // Linear search would take 4e10 steps each: minutes.
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(60));
}

TEST(CloudCropping, LeavesOutAndCounts) {
  const std::vector<Vector3d> truth{{0, 0, 0}, {10, 10, 10}, {5, 5, 5}};
  const std::vector<Vector3d> result{{1, 1, 1}, {10.4, 10, 10}, {30, 5, 5}, {5, 5, 5}};
  const CroppedClouds by_truth = crop_clouds(truth, result, CloudCrop::Truth, 0.5);
  EXPECT_EQ(by_truth.num_result_outside, 1);
  EXPECT_EQ(by_truth.num_truth_outside, 0);
  EXPECT_EQ(by_truth.bounds.max(), Vector3d(10.5, 10.5, 10.5));
  const CroppedClouds common = crop_clouds(truth, result, CloudCrop::Common, 0.5);
  EXPECT_EQ(common.bounds.min(), Vector3d(1, 1, 1));
  EXPECT_EQ(common.bounds.max(), Vector3d(10, 10, 10));
  EXPECT_EQ(common.num_truth_outside, 1);
  EXPECT_EQ(common.num_result_outside, 2);
  const CroppedClouds all = crop_clouds(truth, result, CloudCrop::None, 0.5);
  EXPECT_EQ(all.result.size(), 4U);
  EXPECT_TRUE(all.bounds.isEmpty());
  // Clouds that do not meet have nothing in common.
  EXPECT_TRUE(crop_clouds(truth, {{20, 0, 0}}, CloudCrop::Common, 0.5).truth.empty());
}

TEST(CloudErrors, SharesCountTheDistanceItself) {
  EXPECT_EQ(share_within(std::vector<double>{0.0, 0.1, 0.2, 0.3}, 0.2), 75.0);
}

std::string las(int minor, std::size_t header_bytes, int format, std::size_t row_bytes,
                const std::vector<std::array<std::int32_t, 3>>& rows) {
  std::string text(header_bytes, '\0');
  const auto put = [&](std::size_t at, auto value) {
    std::memcpy(&text[at], &value, sizeof(value));
  };
  std::memcpy(text.data(), "LASF", 4);
  put(24, std::uint8_t{1});
  put(25, static_cast<std::uint8_t>(minor));
  put(94, static_cast<std::uint16_t>(header_bytes));
  put(96, static_cast<std::uint32_t>(header_bytes));
  put(104, static_cast<std::uint8_t>(format));
  put(105, static_cast<std::uint16_t>(row_bytes));
  if (minor < 4) put(107, static_cast<std::uint32_t>(rows.size()));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    put(131 + 8 * axis, 0.001);
    put(155 + 8 * axis, 400'000.0);
  }
  if (minor >= 4) put(247, std::uint64_t{rows.size()});
  for (const auto& row : rows) {
    test::ByteWriter bytes;
    for (const std::int32_t value : row) bytes.put(value);
    bytes.text.resize(row_bytes);
    text += bytes.text;
  }
  return text;
}

std::vector<Vector3d> points_in(const std::string& text, const std::string& name) {
  return parse_point_cloud(bytes_of(text), name).points;
}

TEST(CloudFiles, AreReadAsTheirFormatsSay) {
  const std::vector<Vector3d> right{{1.5, -2.0, 3.25}, {4.0, 5.0, 6.0}};
  const std::string rows = "1.5 -2 3.25 9\n4 5 6 8\n";
  EXPECT_EQ(points_in("ply\r\nformat ascii 1.0\r\nelement vertex 2\r\nproperty float x\r\nproperty "
                      "float y\r\nproperty float z\r\nproperty uchar red\r\nend_header\r\n" +
                          rows,
                      "a.PLY"),
            right);
  test::ByteWriter big;
  const auto put_big = [&](auto value) {
    std::string bytes(sizeof(value), '\0');
    std::memcpy(bytes.data(), &value, sizeof(value));
    big.put_text(std::string(bytes.rbegin(), bytes.rend()));
  };
  for (const Vector3d& point : right) {
    put_big(std::uint16_t{7});
    for (const int axis : {2, 0, 1}) put_big(static_cast<float>(point[axis]));
  }
  EXPECT_EQ(points_in("ply\nformat binary_big_endian 1.0\nelement vertex 2\nproperty ushort "
                      "ring\nproperty float z\nproperty float x\nproperty float y\nend_header\n" +
                          big.text,
                      "a.ply"),
            right);
  test::ByteWriter little;
  for (const Vector3d& point : right) {
    for (int axis = 0; axis < 3; ++axis) little.put(point[axis]);
    little.put(std::uint32_t{0}).put(1.0F).put(1.0F).put(1.0F);
  }
  const std::string pcd =
      "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z rgb normal\nSIZE 8 8 8 4 4\nTYPE F F F U F\nCOUNT 1 "
      "1 1 1 "
      "3\nWIDTH 2\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ";
  EXPECT_EQ(points_in(pcd + "binary\n" + little.text, "a.pcd"), right);
  EXPECT_EQ(points_in(pcd + "ascii\n1.5 -2 3.25 0 1 1 1\n4 5 6 0 1 1 1\n", "a.pcd"), right);
  EXPECT_EQ(points_in("# id x y z r g b error track\n7 1.5 -2 3.25 1 2 3 0.5 1 2\n9 4 5 6 1 2 3 "
                      "0.5\n",
                      "points3D.txt"),
            right);
  test::ByteWriter colmap;
  colmap.put(std::uint64_t{2});
  for (const Vector3d& point : right) {
    colmap.put(std::uint64_t{5});
    for (int axis = 0; axis < 3; ++axis) colmap.put(point[axis]);
    colmap.put_text("rgb").put(0.5).put(std::uint64_t{1}).put(std::uint64_t{0});
  }
  EXPECT_EQ(points_in(colmap.text, "points3D.bin"), right);
  EXPECT_EQ(points_in("x,y,z,i\n1.5,-2,3.25,9\n4, 5 ,6,\n", "a.csv"), right);
  EXPECT_EQ(points_in("1.5;-2;3.25\n4;5;6\n", "a.txt"), right);
  for (const auto& [minor, header, format, size] :
       {std::tuple{0, 227U, 0, 20U}, {2, 227U, 3, 34U}, {3, 235U, 1, 28U}, {4, 375U, 6, 30U}}) {
    const auto points =
        points_in(las(minor, header, format, size, {{1500, -2000, 3250}, {4, 5, 6}}), "a.las");
    ASSERT_EQ(points.size(), 2U);
    EXPECT_LT((points[0] - Vector3d(400'001.5, 399'998.0, 400'003.25)).norm(), 1e-9) << minor;
  }
}

/// LAS 1.4, tables 8 and 16: bit 7 of byte 15 of formats 0 to 5, bit 2 of that of formats 6 to 10.
TEST(CloudFiles, WithheldPointsOfLasAreLeftOutAndCounted) {
  for (const auto& [minor, header, format, size, bit] :
       {std::tuple{2, 227U, 3, 34U, 0x80}, {4, 375U, 6, 30U, 0x04}}) {
    std::string file = las(minor, header, format, size, {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}});
    file[header + size + 15] = static_cast<char>(bit);
    file[header + 15] = static_cast<char>(0xFF & ~bit);  // all other marks
    const PointCloud cloud = parse_point_cloud(bytes_of(file), "a.las");
    EXPECT_EQ(cloud.points.size(), 2U);
    EXPECT_EQ(cloud.num_withheld, 1);
  }
}

TEST(CloudFiles, WhatIsNoPointIsCounted) {
  const PointCloud cloud = parse_point_cloud(
      bytes_of(
          "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty "
          "float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n1 2 3\nnan "
          "nan nan\n4 5 6\n3 0 1 2\n"),
      "mesh.ply");
  EXPECT_EQ(cloud.points.size(), 2U);
  EXPECT_EQ(cloud.num_invalid, 1);
  EXPECT_THAT(cloud.unused, ElementsAre("1 of face"));
}

TEST(CloudFiles, DamageIsRefusedWithTheFilesName) {
  const auto refused = [](const std::string& text, const std::string& name) {
    try {
      parse_point_cloud(bytes_of(text), name);
    } catch (const core::Error& error) {
      EXPECT_EQ(error.kind(), core::ErrorKind::Input) << text;
      EXPECT_THAT(error.message(), HasSubstr(name)) << text;
      return true;
    }
    return false;
  };
  const std::string head = "ply\nformat ascii 1.0\nelement vertex ";
  const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
  EXPECT_TRUE(refused("", "a.ply"));
  EXPECT_TRUE(refused(head + "99999999999999\n" + xyz + "end_header\n1 2 3\n", "a.ply"));
  EXPECT_TRUE(refused(head + "29999999\n" + xyz + "end_header\n1 2 3\n", "a.ply"));
  EXPECT_TRUE(refused(head + "-1\n" + xyz + "end_header\n", "a.ply"));
  EXPECT_TRUE(refused(head + "0\n" + xyz + "end_header\n", "a.ply"));
  EXPECT_TRUE(refused(head + "1\nproperty float x\nproperty float y\nend_header\n1 2\n", "a.ply"));
  EXPECT_TRUE(refused(head + "1\n" + xyz + "end_header\n1 2 x\n", "a.ply"));
  EXPECT_TRUE(refused(head + "1\n" + xyz + "end_header\n1 2 3 4\n", "a.ply"));
  EXPECT_TRUE(refused(head + "1\n" + xyz + "end_header\n1 2 inf\n", "a.ply"));
  EXPECT_TRUE(refused(head + "1\n" + xyz + "end_header\n1 2 1e10\n", "a.ply"));
  EXPECT_TRUE(refused(head + "1\n" + xyz + "property float x\nend_header\n1 2 3 4\n", "a.ply"));
  EXPECT_TRUE(refused(head + "1\n" + xyz, "a.ply"));
  const std::string pcd = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 1\n";
  EXPECT_TRUE(refused(pcd + "DATA binary_compressed\n12345678", "a.pcd"));
  EXPECT_TRUE(refused(pcd + "DATA binary\n12345678", "a.pcd"));
  EXPECT_TRUE(
      refused("FIELDS x y z\nSIZE 4 4\nTYPE F F F\nPOINTS 1\nDATA ascii\n1 2 3\n", "a.pcd"));
  EXPECT_TRUE(
      refused("FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 4000000000000\nPOINTS "
              "1\nDATA binary\n123456789012",
              "a.pcd"));
  EXPECT_TRUE(refused(las(2, 227, 128 + 1, 28, {{1, 2, 3}}), "a.las"));  // packed
  EXPECT_TRUE(refused(las(5, 375, 6, 30, {{1, 2, 3}}), "a.las"));
  EXPECT_TRUE(refused(las(2, 227, 0, 8, {{1, 2, 3}}), "a.las"));
  // Less than a point of format 6 needs.
  EXPECT_TRUE(refused(las(4, 375, 6, 20, {{1, 2, 3}}), "a.las"));
  EXPECT_TRUE(refused("1 2 3\n4 5\n", "a.xyz"));
  // Cells that are empty, decimal commas, another separator than the first row's, another number.
  EXPECT_TRUE(refused("1.0,,3.0,255\n", "a.csv"));
  EXPECT_TRUE(refused("1,5;2,5;3,5\n", "a.csv"));
  EXPECT_TRUE(refused("1,5 2,5 3,5\n", "a.xyz"));
  EXPECT_TRUE(refused("1,2,3\n4;5;6\n", "a.csv"));
  EXPECT_TRUE(refused("1 2 3 4\n1 2 3\n", "a.xyz"));
  // More than the header counts.
  EXPECT_TRUE(refused(head + "1\n" + xyz + "end_header\n1 2 3\n4 5 6\n", "a.ply"));
  EXPECT_TRUE(refused(head + "1\n" + xyz + "element face 0\nend_header\n1 2 3\n4 5 6\n", "a.ply"));
  EXPECT_FALSE(refused(head + "1\n" + xyz + "end_header\n1 2 3\n \n", "a.ply"));
  EXPECT_TRUE(refused("ply\nformat binary_little_endian 1.0\nelement vertex 1\n" + xyz +
                          "end_header\n" + std::string(13, '\0'),
                      "a.ply"));
  EXPECT_TRUE(refused(pcd + "DATA ascii\n1 2 3\n4 5 6\n", "a.pcd"));
  EXPECT_TRUE(refused(pcd + "DATA binary\n" + std::string(24, '\0'), "a.pcd"));
  EXPECT_FALSE(refused("WIDTH 1\nHEIGHT 1\n" + pcd + "DATA ascii\n1 2 3\n", "a.pcd"));
  for (const char* const size :
       {"WIDTH 2\nHEIGHT 1\n", "WIDTH 1\nHEIGHT 0\n", "WIDTH 4294967297\nHEIGHT 4294967297\n"})
    EXPECT_TRUE(refused(size + pcd + "DATA ascii\n1 2 3\n", "a.pcd")) << size;
  EXPECT_TRUE(refused("1 2 3\n", "a.obj"));
  EXPECT_TRUE(refused("1 2 3\n", "a.laz"));
  EXPECT_TRUE(refused(std::string(8, '\xff'), "points3D.bin"));
  // Whatever is cut off from a binary file is missed.
  const std::string whole = las(4, 375, 6, 30, {{1, 2, 3}, {4, 5, 6}});
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_TRUE(refused(whole.substr(0, size), "a.las")) << size;
}

class EvaluateCloud : public testing::Test {
 protected:
  fs::path write_points(const std::string& name, const std::vector<Vector3d>& points) const {
    std::string text;
    for (const Vector3d& point : points)
      text += fmt::format("{} {} {}\n", point.x(), point.y(), point.z());
    core::write_file(scratch_ / name, text);
    return scratch_ / name;
  }
  EvaluateOptions options(const fs::path& truth, const fs::path& result) const {
    return {.task = "cloud", .truth = truth, .result = result};
  }
  ScratchFolder scratch_;
};

TEST_F(EvaluateCloud, FiguresAreThoseOfBruteForce) {
  const std::vector<Vector3d> truth = random_points(700, 3, 8.0),
                              result = random_points(900, 4, 8.0);
  EvaluateOptions own = options(write_points("is.xyz", truth), write_points("says.xyz", result));
  own.crop = CloudCrop::None;
  own.cloud_distances_m = {0.5, 0.2};
  const Evaluation evaluation = test::evaluate(own);
  const auto accuracy = brute_distances(truth, result),
             completeness = brute_distances(result, truth);
  const auto mean = [](const std::vector<double>& values, int power) {
    double sum = 0.0;
    for (const double value : values) sum += std::pow(value, power);
    return sum / static_cast<double>(values.size());
  };
  const auto share = [](const std::vector<double>& values, double most) {
    double count = 0.0;
    for (const double value : values) count += value <= most ? 1.0 : 0.0;
    return 100.0 * count / static_cast<double>(values.size());
  };
  constexpr double kRounding = 1e-12;
  EXPECT_NEAR(test::figure(evaluation, "accuracy"), mean(accuracy, 1), kRounding);
  EXPECT_NEAR(test::figure(evaluation, "accuracy RMS"), std::sqrt(mean(accuracy, 2)), kRounding);
  EXPECT_NEAR(test::figure(evaluation, "completeness"), mean(completeness, 1), kRounding);
  EXPECT_NEAR(test::figure(evaluation, "completeness RMS"), std::sqrt(mean(completeness, 2)),
              kRounding);
  EXPECT_NEAR(test::figure(evaluation, "Chamfer"),
              0.5 * (mean(accuracy, 1) + mean(completeness, 1)), kRounding);
  EXPECT_NEAR(test::figure(evaluation, "Chamfer squared"),
              mean(accuracy, 2) + mean(completeness, 2), kRounding);
  for (const double most : {0.2, 0.5}) {
    const double p = share(accuracy, most), r = share(completeness, most);
    EXPECT_NEAR(test::figure(evaluation, fmt::format("precision {} m", most)), p, 1e-10);
    EXPECT_NEAR(test::figure(evaluation, fmt::format("recall {} m", most)), r, 1e-10);
    EXPECT_NEAR(test::figure(evaluation, fmt::format("F {} m", most)), 2 * p * r / (p + r), 1e-10);
    EXPECT_GT(p, 1.0);
    EXPECT_LT(p, 100.0);
  }
}

/// A grid, shifted by a quarter of its step: each point is 0.25 m off, both ways.
TEST_F(EvaluateCloud, AShiftedGridIsOffByItsShift) {
  std::vector<Vector3d> truth, shifted;
  for (int x = 0; x < 20; ++x)
    for (int y = 0; y < 20; ++y) {
      truth.emplace_back(x, y, 7.0);
      shifted.emplace_back(x + 0.25, y, 7.0);
    }
  shifted.emplace_back(500.0, 0.0, 7.0);  // beyond the bounds
  const fs::path report = scratch_ / "report";
  const Evaluation evaluation = test::evaluate(
      options(write_points("is.xyz", truth), write_points("says.xyz", shifted)), report);
  EXPECT_EQ(test::figure(evaluation, "accuracy"), 0.25);
  EXPECT_EQ(test::figure(evaluation, "Chamfer"), 0.25);
  EXPECT_EQ(test::figure(evaluation, "Chamfer squared"), 0.125);
  EXPECT_EQ(test::figure(evaluation, "F 0.1 m"), 0.0);
  EXPECT_EQ(test::figure(evaluation, "F 0.25 m"), 100.0);
  EXPECT_THAT(test::notes_of(evaluation),
              HasSubstr("1 points of the result and 0 of the truth are outside and left out"));
  EXPECT_TRUE(fs::exists(report / "index.html"));
}

/// A half of the truth has no result: it costs completeness, not accuracy, unless cropped away.
TEST_F(EvaluateCloud, WhatIsMissingCostsRecall) {
  std::vector<Vector3d> truth, half;
  for (int x = 0; x < 40; ++x) truth.emplace_back(x, 0.0, 0.0);
  half.assign(truth.begin(), truth.begin() + 20);
  EvaluateOptions own = options(write_points("is.xyz", truth), write_points("says.xyz", half));
  own.cloud_distances_m = {0.5};
  const Evaluation evaluation = test::evaluate(own);
  EXPECT_EQ(test::figure(evaluation, "precision 0.5 m"), 100.0);
  EXPECT_EQ(test::figure(evaluation, "recall 0.5 m"), 50.0);
  EXPECT_EQ(test::figure(evaluation, "completeness"), 210.0 / 40.0);  // 1 + … + 20
  own.crop = CloudCrop::Common;
  EXPECT_EQ(test::figure(test::evaluate(own), "recall 0.5 m"), 100.0);
  own.crop = CloudCrop::Truth;
  own.result = write_points("far.xyz", {{1000.0, 0.0, 0.0}});
  try {
    test::evaluate(own);
    ADD_FAILURE();
  } catch (const core::Error& error) {
    EXPECT_THAT(error.message(), HasSubstr("both must be in one frame"));
  }
}

/// Of a dataset its depth images are the truth: a wall 50 m ahead.
TEST_F(EvaluateCloud, DepthImagesAreATruth) {
  const test::Recording flight = test::wall_flight(2, 50.0, {0.0, 0.0, 0.0});
  test::write_kitti(flight, scratch_ / "truth");
  // The camera's wall, every pixel, moved back by 0.2 m.
  std::vector<Vector3d> wall;
  for (int y = 0; y < test::kWallHeight; ++y)
    for (int x = 0; x < test::kWallWidth; ++x) {
      const double u = (x + 0.5 - 0.5 * test::kWallWidth) / test::kWallFocal_px;
      const double v = (y + 0.5 - 0.5 * test::kWallHeight) / test::kWallFocal_px;
      wall.push_back(flight.rotation(0, 0) * Vector3d(50.0 * u, 50.0 * v, 50.2) +
                     flight.centre(0, 0));
    }
  const Evaluation evaluation =
      test::evaluate(options(scratch_ / "truth", write_points("wall.xyz", wall)));
  // KITTI's depth has steps of 1/256 m, places 1e-6 m.
  EXPECT_NEAR(test::figure(evaluation, "accuracy"), 0.2, 1.0 / 256.0);
  EXPECT_NEAR(test::figure(evaluation, "completeness"), 0.2, 1.0 / 256.0);
  EXPECT_EQ(test::figure(evaluation, "F 0.1 m"), 0.0);
  EXPECT_EQ(test::figure(evaluation, "F 0.25 m"), 100.0);
  EXPECT_THAT(test::notes_of(evaluation),
              HasSubstr("points of 2 depth images, all pixels of each"));
  EvaluateOptions near = options(scratch_ / "truth", scratch_ / "wall.xyz");
  near.max_depth_m = 40.0;
  EXPECT_THROW(test::evaluate(near), core::Error);
}

/// Every second row and column of the wall: of four pixels one is a true point, two are one pixel's width
/// away, one sqrt(2) of it. So a result of all pixels is (2 + sqrt(2)) / 4 widths off, without an error.
TEST_F(EvaluateCloud, AThinnedTruthSaysHowFarItsOwnPixelsAre) {
  test::write_kitti(test::wall_flight(2, 50.0, {0.0, 0.0, 0.0}), scratch_ / "truth");
  Findings findings;
  const Dataset dataset = read_dataset(scratch_ / "truth", "", findings);
  const Subject subject{.dataset = dataset, .sequence = dataset.sequences.front()};
  EXPECT_TRUE(true_cloud(subject, 100.0).left_out.empty());
  const TrueCloud thinned =
      true_cloud(subject, 100.0, 2 * (test::kWallWidth / 2) * (test::kWallHeight / 2));
  EXPECT_EQ(thinned.points.size(), 2U * (test::kWallWidth / 2) * (test::kWallHeight / 2));
  ASSERT_EQ(thinned.left_out.size(), 100'000U);
  const double width_m = 50.0 / test::kWallFocal_px;
  double sum_m = 0.0;
  for (const double distance_m : nearest_distances_m(thinned.points, thinned.left_out))
    sum_m += distance_m;
  // Four standard errors: the deviation of one distance is 0.52 widths.
  EXPECT_NEAR(sum_m / 100'000.0, (2.0 + std::sqrt(2.0)) / 4.0 * width_m,
              4.0 * 0.52 * width_m / std::sqrt(100'000.0));
  EXPECT_NEAR(share_within(nearest_distances_m(thinned.points, thinned.left_out), 0.5 * width_m),
              25.0, 4.0 * 100.0 * std::sqrt(0.25 * 0.75 / 100'000.0));
}

}  // namespace
}  // namespace terracast::validate
