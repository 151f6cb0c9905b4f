#include <fmt/format.h>

#include <bit>
#include <cstring>
#include <string>

#include "export/clouds/cloud.h"

// PLY and PCD: a header of text, then rows of numbers.

namespace terracast::exporters {
namespace {

static_assert(std::endian::native == std::endian::little);

template <class Number>
void put(Number number, std::vector<std::byte>& bytes) {
  const auto* at = reinterpret_cast<const std::byte*>(&number);
  bytes.insert(bytes.end(), at, at + sizeof(Number));
}

std::vector<std::byte> begun(const std::string& header) {
  std::vector<std::byte> bytes(header.size());
  std::memcpy(bytes.data(), header.data(), header.size());
  return bytes;
}

void put_labels(const CloudPoint& point, std::vector<std::byte>& bytes) {
  put(point.reflectance, bytes);
  put(point.ring, bytes);
  put(point.return_number, bytes);
  put(point.num_returns, bytes);
  put(point.class_id, bytes);
  put(point.instance_id, bytes);
}

}  // namespace

std::vector<std::byte> ply_bytes(std::span<const CloudPoint> points) {
  std::vector<std::byte> bytes = begun(fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment points in the frame of the sequence's poses, "
      "m; time s\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n"
      "property double time\nproperty float intensity\nproperty ushort ring\nproperty uchar "
      "return_number\nproperty uchar num_returns\nproperty uchar class_id\nproperty uint "
      "instance_id\nend_header\n",
      points.size()));
  for (const CloudPoint& point : points) {
    for (int axis = 0; axis < 3; ++axis) put(point.local[axis], bytes);
    put(point.time_s, bytes);
    put_labels(point, bytes);
  }
  return bytes;
}

std::vector<std::byte> pcd_bytes(std::span<const CloudPoint> points) {
  const Eigen::Vector3d eye =
      points.empty() ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : points.front().origin_local;
  std::vector<std::byte> bytes = begun(fmt::format(
      "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z time intensity ring "
      "return_number num_returns class_id instance_id\nSIZE 4 4 4 8 4 2 1 1 1 4\nTYPE F F F F F U "
      "U "
      "U U U\nCOUNT 1 1 1 1 1 1 1 1 1 1\nWIDTH {0}\nHEIGHT 1\nVIEWPOINT {1} {2} {3} 1 0 0 0\n"
      "POINTS {0}\nDATA binary\n",
      points.size(), eye.x(), eye.y(), eye.z()));
  for (const CloudPoint& point : points) {
    for (int axis = 0; axis < 3; ++axis) put(static_cast<float>(point.local[axis]), bytes);
    put(point.time_s, bytes);
    put_labels(point, bytes);
  }
  return bytes;
}

}  // namespace terracast::exporters
