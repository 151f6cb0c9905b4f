#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "geo/rigid3.h"

/// A COLMAP reconstruction and its two forms on disk, COLMAP 3.12's files with rigs and frames;
/// older programs read the other three. Ids start at 1.
namespace terracast::exporters {

struct ColmapCamera {
  std::uint32_t id = 0;
  int width_px = 0;
  int height_px = 0;
  std::array<double, 4> parameters{};  ///< of PINHOLE: fx fy cx cy, pixel centres at +0.5
};

/// A rig's first sensor is its reference and has no pose.
struct ColmapRig {
  std::uint32_t id = 0;
  std::uint32_t reference_camera_id = 0;
  std::vector<std::pair<std::uint32_t, geo::Rigid3d>> others;  ///< camera id, sensor_from_rig
};

struct ColmapFrame {
  std::uint32_t id = 0;
  std::uint32_t rig_id = 0;
  geo::Rigid3d rig_from_world;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> images;  ///< camera id, image id
};

struct ColmapObservation {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  std::uint64_t point_id = 0;
};

struct ColmapImage {
  std::uint32_t id = 0;
  std::uint32_t camera_id = 0;
  std::string name;
  geo::Rigid3d camera_from_world;
  std::vector<ColmapObservation> observations;
};

struct ColmapPoint {
  std::uint64_t id = 0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  std::array<std::uint8_t, 3> color{};
  std::vector<std::pair<std::uint32_t, std::uint32_t>>
      track;  ///< image id, index of its observation
};

struct ColmapModel {
  std::vector<ColmapCamera> cameras;
  std::vector<ColmapRig> rigs;
  std::vector<ColmapFrame> frames;
  std::vector<ColmapImage> images;
  std::vector<ColmapPoint> points;
};

/// A file of a model's folder.
struct ColmapFile {
  std::string name;
  std::vector<std::byte> bytes;
};

/// cameras.txt, frames.txt, images.txt, points3D.txt, rigs.txt; 17 digits.
std::vector<ColmapFile> colmap_text_files(const ColmapModel& model);
/// The same with .bin, little-endian.
std::vector<ColmapFile> colmap_binary_files(const ColmapModel& model);

}  // namespace terracast::exporters
