#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "validate/findings.h"
#include "validate/geometry.h"

/// COLMAP's sparse models, text and binary, with rigs and frames.
namespace terracast::validate {

struct ColmapCamera {
  std::string model;  ///< "PINHOLE", …
  std::int64_t width_px = 0;
  std::int64_t height_px = 0;
  std::vector<double> parameters;
  bool operator==(const ColmapCamera&) const = default;
};

struct ColmapPose {
  std::array<double, 4> rotation_wxyz{1.0, 0.0, 0.0, 0.0};
  std::array<double, 3> translation{};
  bool operator==(const ColmapPose&) const = default;

  /// Not normalised: the check `trajectory` measures how far from a rotation it is.
  Pose pose() const;
};

struct ColmapObservation {
  double x_px = 0.0;
  double y_px = 0.0;
  std::int64_t point_id = -1;  ///< -1: no point
  bool operator==(const ColmapObservation&) const = default;
};

struct ColmapImage {
  ColmapPose camera_from_world;
  std::int64_t camera_id = 0;
  std::string name;
  std::vector<ColmapObservation> observations;
  bool operator==(const ColmapImage&) const = default;
};

struct ColmapPoint {
  std::array<double, 3> position{};
  std::array<int, 3> color{};
  double error_px = 0.0;
  std::vector<std::pair<std::int64_t, std::int64_t>> track;  ///< image id, index of the observation
  bool operator==(const ColmapPoint&) const = default;
};

struct ColmapSensor {
  std::int64_t type = 0;  ///< 0 camera
  std::int64_t id = 0;
  bool has_pose = false;
  ColmapPose sensor_from_rig;
  bool operator==(const ColmapSensor&) const = default;
};

struct ColmapRig {
  std::vector<ColmapSensor> sensors;  ///< the first is the reference
  bool operator==(const ColmapRig&) const = default;
};

struct ColmapData {
  std::int64_t type = 0;
  std::int64_t sensor_id = 0;
  std::int64_t image_id = 0;
  bool operator==(const ColmapData&) const = default;
};

struct ColmapFrame {
  std::int64_t rig_id = 0;
  ColmapPose rig_from_world;
  std::vector<ColmapData> data;
  bool operator==(const ColmapFrame&) const = default;
};

struct ColmapModel {
  std::map<std::int64_t, ColmapCamera> cameras;
  std::map<std::int64_t, ColmapImage> images;
  std::map<std::int64_t, ColmapPoint> points;
  std::map<std::int64_t, ColmapRig> rigs;
  std::map<std::int64_t, ColmapFrame> frames;
};

/// What a model's folder holds: programs before 3.12 write no rigs and frames.
enum class ColmapFiles { All, WithoutRigs };

/// Reads the files of a model; damage in one becomes a finding and leaves its part empty.
/// name  of the folder, for findings
ColmapModel read_colmap_text(const std::filesystem::path& folder, const std::string& name,
                             Findings& findings);
ColmapModel read_colmap_binary(const std::filesystem::path& folder, const std::string& name,
                               Findings& findings, ColmapFiles files = ColmapFiles::All);

/// The images of one file alone, images.txt or images.bin.
/// throws  Input: damaged; Io
std::map<std::int64_t, ColmapImage> read_colmap_images_text(const std::filesystem::path& file);
std::map<std::int64_t, ColmapImage> read_colmap_images_binary(const std::filesystem::path& file);

}  // namespace terracast::validate
