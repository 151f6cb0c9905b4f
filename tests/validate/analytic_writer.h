#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tests/validate/analytic_dataset.h"

/// What the writers of the formats share.
namespace terracast::test {

/// What a dataset says, after the mistake.
struct Said {
  const Recording& recording;
  const Mistake& mistake;
  float sky_depth_m = 0.0F;  ///< what the format writes for the sky

  /// is_format  in the format's own files; else in georeference.csv
  SaidPose pose(std::size_t c, std::size_t f, bool is_format = true) const;
  Eigen::Matrix3d mount(std::size_t c) const;
  double focal(std::size_t c) const {
    return recording.cameras[c].focal_px * (1.0 + mistake.focal_relative);
  }
  double cx(std::size_t c) const {
    return 0.5 * recording.cameras[c].width + mistake.principal_x_px;
  }
  double cy(std::size_t c) const {
    return 0.5 * recording.cameras[c].height + mistake.principal_y_px;
  }
  float depth(std::size_t c, std::size_t f, int x, int y) const;
  core::Image8 classes(std::size_t c, std::size_t f) const;
  core::Image8 color(std::size_t c, std::size_t f) const;
};

/// The bytes of an npy.
/// type  "<f4", "|u1", "|b1"
std::string npy_bytes(const std::string& type, const std::vector<std::size_t>& shape,
                      const void* values, std::size_t num_bytes);
/// Writes arrays ("flow_fwd.npy" and its bytes) into an npz, stored.
void write_npz(const std::filesystem::path& file, const std::map<std::string, std::string>& arrays);

/// "000042".
std::string digits(std::size_t frame);

/// A place on WGS84; the scene's frame is the east, north, up of one.
struct ScenePlace {
  double lat_deg, lon_deg, height_m;
};
ScenePlace place_of_scene(const Eigen::Vector3d& point);
Eigen::Vector3d scene_from_place(const ScenePlace& place);
Eigen::Vector3d ecef_of(const ScenePlace& place);
Eigen::Matrix3d enu_from_scene(const ScenePlace& place);

void write_depth_npy(const Said& said, std::size_t c, std::size_t f,
                     const std::filesystem::path& file);

/// dataset.json and georeference.csv.
void write_metadata(const Said& said, const std::filesystem::path& folder,
                    const std::string& format, const std::string& name, const std::string& path,
                    const std::string& georeference);

}  // namespace terracast::test
