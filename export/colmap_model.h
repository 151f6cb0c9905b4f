#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "geo/camera_model.h"
#include "geo/geodesy.h"
#include "geo/rigid3.h"

/// A COLMAP reconstruction and its forms on disk: text and binary in COLMAP 3.12's files with rigs
/// and frames, of which older programs read the other three, and the database that COLMAP's
/// programs work on. Ids start at 1.
namespace terracast::exporters {

/// A camera model in COLMAP's words.
struct ColmapLens {
  const char* model = "PINHOLE";
  std::int32_t number = 1;         ///< of the model, in binary files and the database
  std::vector<double> parameters;  ///< in the model's order, pixel centres at +0.5
};

/// throws Config: COLMAP has no such model; says which it has
ColmapLens colmap_lens(const geo::CameraIntrinsics& intrinsics);
/// throws Config: as colmap_lens; the image holds rays of 90 degrees and more off the axis, which COLMAP's
/// models do not know
void check_colmap_camera(const geo::CameraIntrinsics& intrinsics);

struct ColmapCamera {
  std::uint32_t id = 0;
  std::string folder;  ///< of its images: "mcs4/cam0"
  int width_px = 0;
  int height_px = 0;
  ColmapLens lens;
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
  geo::Geodetic place;  ///< of the camera's centre
  std::vector<ColmapObservation> observations;
};

struct ColmapPoint {
  std::uint64_t id = 0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  std::array<std::uint8_t, 3> color{};
  /// Mean distance of its observations from its projection by the images' poses: 0, but of rolling shutters.
  double error_px = 0.0;
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

/// database.db: cameras and images under the model's ids, no features. COLMAP 3.8's schema, where
/// the camera's place (latitude, longitude, ellipsoidal height) stands beside each image, and the
/// table pose_priors of 3.10 to 3.13 with the same; later versions turn either into their own.
std::vector<std::byte> colmap_database(const ColmapModel& model);

/// rig_config.json: the rigs for `colmap rig_configurator` of 3.12 and later.
std::string colmap_rig_config(const ColmapModel& model);

/// georegistration.txt: name, latitude, longitude, ellipsoidal height of each image, for `colmap
/// model_aligner --ref_images_path`. Its ENU starts at the first line's place.
std::string colmap_georegistration(const ColmapModel& model);

}  // namespace terracast::exporters
