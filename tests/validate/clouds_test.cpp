// PLY, PCD and LAS as they are written by hand, and cut off.

#include "validate/readers/clouds.h"

#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include "core/random.h"
#include "tests/support/expect_error.h"
#include "validate/geodesy.h"
#include "validate/npy.h"

namespace terracast::test {
namespace {

using validate::Cloud;

std::vector<std::byte> bytes_of(const std::string& text) {
  std::vector<std::byte> bytes(text.size());
  std::memcpy(bytes.data(), text.data(), text.size());
  return bytes;
}

template <class Number>
void put(Number number, std::string& text) {
  text.append(reinterpret_cast<const char*>(&number), sizeof(Number));
}

std::string ply() {
  std::string text =
      "ply\nformat binary_little_endian 1.0\nelement vertex 2\nproperty double x\nproperty double "
      "y\nproperty double z\nproperty double time\nproperty float intensity\nproperty ushort "
      "ring\nproperty uchar return_number\nproperty uchar num_returns\nproperty uchar "
      "class_id\nproperty uint instance_id\nend_header\n";
  for (const double at : {1.0, 2.0}) {
    for (int axis = 0; axis < 3; ++axis) put(at + axis, text);
    put(10.0 * at, text);
    put(0.25F, text);
    put(std::uint16_t{7}, text);
    put(std::uint8_t{1}, text);
    put(std::uint8_t{2}, text);
    put(std::uint8_t{28}, text);
    put(std::uint32_t{123456}, text);
  }
  return text;
}

TEST(Clouds, APlyIsReadByItsHeader) {
  const Cloud cloud = validate::parse_ply(bytes_of(ply()), "a.ply");
  ASSERT_EQ(cloud.rows.size(), 2U);
  EXPECT_EQ(cloud.rows[1].place, Eigen::Vector3d(2.0, 3.0, 4.0));
  EXPECT_EQ(cloud.rows[1].time_s, 20.0);
  EXPECT_EQ(cloud.rows[1].intensity, 0.25);
  EXPECT_EQ(cloud.rows[1].num_returns, 2);
  EXPECT_EQ(cloud.rows[1].instance_id, 123456);
}

/// Cut off anywhere, with bytes that are others: an Input error, or a cloud.
void harm(const std::string& text,
          const std::function<void(const std::vector<std::byte>&)>& parse) {
  const auto survive = [&](const std::string& harmed) {
    try {
      parse(bytes_of(harmed));
    } catch (const core::Error& error) {
      EXPECT_EQ(error.kind(), core::ErrorKind::Input) << error.message();
    }
  };
  for (std::size_t size = 0; size < text.size(); ++size) {
    EXPECT_THROW(parse(bytes_of(text.substr(0, size))), core::Error) << size;
  }
  for (std::uint64_t run = 0; run < 20000; ++run) {
    std::string harmed = text;
    const auto count = 1 + core::random_bits(1, run, 0) % 4;
    for (std::uint64_t k = 1; k <= count; ++k)
      harmed[core::random_bits(2, run, k) % harmed.size()] =
          static_cast<char>(core::random_bits(3, run, k));
    survive(harmed);
  }
}

TEST(Clouds, WhatIsCutOffOrDamagedIsAnInputError) {
  harm(ply(), [](const auto& bytes) { validate::parse_ply(bytes, "a.ply"); });
  std::string pcd =
      "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z time intensity ring return_number num_returns "
      "class_id "
      "instance_id\nSIZE 4 4 4 8 4 2 1 1 1 4\nTYPE F F F F F U U U U U\nCOUNT 1 1 1 1 1 1 1 1 1 "
      "1\nWIDTH 1\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 1\nDATA binary\n";
  pcd += std::string(33, '\x01');
  EXPECT_EQ(validate::parse_pcd(bytes_of(pcd), "a.pcd").rows.size(), 1U);
  harm(pcd, [](const auto& bytes) { validate::parse_pcd(bytes, "a.pcd"); });
  std::string npy("\x93NUMPY\x01\x00", 8);
  std::string header =
      "{'descr': [('time_s', '<f8'), ('ring', '<u2')], 'fortran_order': False, 'shape': (3,), }";
  header.append(63 - (10 + header.size()) % 64, ' ');
  header += '\n';
  npy += static_cast<char>(header.size());
  npy += '\0';
  npy += header + std::string(30, '\x02');
  EXPECT_EQ(validate::parse_npy_table(bytes_of(npy), "a.npy").num_rows, 3U);
  harm(npy, [](const auto& bytes) { validate::parse_npy_table(bytes, "a.npy"); });
}

// GeographicLib's documented example, and the meridian that is shrunk by 0.9996: a quarter of it is 10 001 965.729 m.
TEST(ValidateGeodesy, UtmIsThatOfPublishedPlaces) {
  const Eigen::Vector2d baghdad = validate::utm_from_geodetic(32638, 33.3, 44.4);
  EXPECT_NEAR(baghdad.x(), 444140.54, 0.006);
  EXPECT_NEAR(baghdad.y(), 3684706.36, 0.006);
  EXPECT_NEAR(validate::utm_from_geodetic(32631, 90.0 - 1e-9, 3.0).y(), 0.9996 * 10001965.729,
              1e-3);
  EXPECT_NEAR(validate::utm_from_geodetic(32731, -10.0, 3.0).y() +
                  validate::utm_from_geodetic(32631, 10.0, 3.0).y(),
              1e7, 1e-8);
}

}  // namespace
}  // namespace terracast::test
