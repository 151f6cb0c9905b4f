#pragma once

#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/image.h"
#include "core/json.h"
#include "tests/validate/analytic_writer.h"
#include "tests/validate/mutations/mutations.h"

/// What the corruptions change: where a format keeps a thing, and how it is written anew.
namespace terracast::test {

namespace fs = std::filesystem;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector2d;
using Eigen::Vector3d;

inline const std::vector<std::string> kAll = {"tartanair", "tartanair_v1", "kitti", "kitti_raw",
                                              "colmap"};
inline const std::vector<std::string> kFlow = {"tartanair", "tartanair_v1"};
/// Each camera has poses of its own, and depth.
inline const std::vector<std::string> kPosed = {"tartanair", "tartanair_v1", "colmap"};
inline const std::vector<std::string> kKitti = {"kitti", "kitti_raw"};
inline const std::vector<std::string> kCalibrated = {"kitti", "kitti_raw", "colmap"};

inline bool is_tartan(const RightDataset& d) { return d.format.starts_with("tartanair"); }

// ---------------------------------------------------------------- where files stand

std::string sequence_path(const RightDataset& d);
fs::path color_file(const RightDataset& d, std::size_t c, std::size_t f);
/// Empty where the camera has no depth.
fs::path depth_file(const RightDataset& d, std::size_t c, std::size_t f);
fs::path georeference_file(const RightDataset& d);

// ---------------------------------------------------------------- colours, depth, classes

void edit_colors(const RightDataset& d, const fs::path& folder, std::size_t first_camera,
                 const std::function<core::Image8(std::size_t c, std::size_t f)>& color);
float sky_of(const RightDataset& d);
/// A depth image as bytes, as the format stores it.
void write_depth(const RightDataset& d, const fs::path& folder, std::size_t c, std::size_t f,
                 const std::vector<float>& values);
/// Writes all depths anew: a function of the true depth (infinite for sky) and the pixel's ray.
void edit_depths(const RightDataset& d, const fs::path& folder,
                 const std::function<double(double depth_m, const Vector3d& ray)>& change);
/// The same of the pixels' places in the true images.
void write_depths(const RightDataset& d, const fs::path& folder,
                  const std::function<double(std::size_t c, std::size_t f, int x, int y)>& depth_m);
/// A number that went through a 32-bit float. Volatile: g++ 12 at -O2 drops two such conversions
/// that stand side by side.
double single(double value);
void copy_over(const fs::path& from, const fs::path& to);
void write_classes(const RightDataset& d, const fs::path& folder, std::size_t c, std::size_t f,
                   const core::Image8& classes);

// ---------------------------------------------------------------- text

std::vector<std::string> lines_of(const fs::path& file);
void write_lines(const fs::path& file, const std::vector<std::string>& lines);
std::vector<double> numbers_of(std::string line, char separator = ' ');
std::string joined(const std::vector<double>& numbers);
/// Columns of georeference.csv: time, latitude, longitude, height, w, x, y, z.
void edit_georeference(const RightDataset& d, const fs::path& folder,
                       const std::function<void(std::array<double, 8>&)>& change);
/// Thirty numbers of each packet.
void edit_packets(const RightDataset& d, const fs::path& folder,
                  const std::function<void(std::vector<double>&)>& change);

/// The places and rotations of georeference.csv anew, from each camera and frame.
void write_georeference(const RightDataset& d, const fs::path& folder,
                        const std::function<SaidPose(std::size_t c, std::size_t f)>& pose);

// ---------------------------------------------------------------- dataset.json

/// What it says of the sequence, and of its cameras.
void edit_stated(const fs::path& folder, const std::function<void(core::Json& sequence)>& change);
void edit_stated_cameras(const fs::path& folder,
                         const std::function<void(std::size_t c, core::Json& camera)>& change);

// ---------------------------------------------------------------- calibration

struct Calibration {
  double focal_factor = 1.0;
  Vector2d centre_px = Vector2d::Zero();  ///< added
  double baseline_factor = 1.0;
  Vector3d moved_m =
      Vector3d::Zero();  ///< the right cameras of KITTI's pairs: right, down, forward
  double size_factor = 1.0;
};
/// Calibration files of all cameras; of the last one in COLMAP and TartanAir where it is a baseline.
void edit_calibration(const RightDataset& d, const fs::path& folder, const Calibration& wrong);

// ---------------------------------------------------------------- poses

SaidPose true_pose(const RightDataset& d, std::size_t c, std::size_t f);

using RawChange = std::function<void(Matrix3d&, Vector3d&)>;
/// Rows of the pose file as matrices; COLMAP's images (and frames) likewise.
void edit_raw_poses(const RightDataset& d, const fs::path& folder, const RawChange& change);
/// Writes poses of the pose file anew, from world-from-camera of each camera and frame; KITTI's in
/// the true first one.
void write_poses(const RightDataset& d, const fs::path& folder,
                 const std::function<SaidPose(std::size_t c, std::size_t f)>& pose);

// ---------------------------------------------------------------- flow

struct Flow {
  std::vector<Vector2d> flow;
  std::vector<bool> in_view, covisible;
};
/// From frame to frame, in closed form, of the left camera; the principal point may be off.
Flow flow_between(const RightDataset& d, std::size_t from, std::size_t to, double off_px = 0.0);

using FlowOf = std::function<Flow(std::size_t f)>;
/// Writes the flow of each pair anew: forward of what `forward` says, backward likewise.
void write_flows(const RightDataset& d, const fs::path& folder, const FlowOf& forward,
                 const FlowOf& backward);
/// A change of every right flow.
void edit_flows(const RightDataset& d, const fs::path& folder,
                const std::function<void(Flow&)>& change);

// ---------------------------------------------------------------- what compression leaves

/// Coefficients of 8 x 8 blocks rounded to steps, as JPEG's table for brightness has them at quality
/// 50, times `scale`; each channel alone.
core::Image8 compressed(const core::Image8& image, double scale);
core::Image8 with_channels_swapped(core::Image8 image);
/// Half a pixel to the right and down: each pixel is the mean of itself and those left, above and beside these.
core::Image8 shifted_by_half(const core::Image8& image);

// ---------------------------------------------------------------- the catalogue

/// What the named cause must say; a size and its tolerance.
std::function<Expected(const RightDataset&)> says(std::vector<std::string> words);
std::function<Expected(const RightDataset&)> says(std::vector<std::string> words, double size,
                                                  double tolerance);

/// Adds corruptions to the list, one a call.
class Catalogue {
 public:
  /// is_in_one_format  of each corruption that it adds
  explicit Catalogue(std::vector<Mutation>& list, bool is_in_one_format = false)
      : list_(list), is_in_one_format_(is_in_one_format) {}
  void operator()(const char* name, std::vector<std::string> formats,
                  std::function<void(const RightDataset&, const fs::path& folder)> change,
                  std::function<Expected(const RightDataset&)> expected,
                  bool is_listed = true) const {
    list_.push_back({name, std::move(formats), std::move(change), std::move(expected), is_listed,
                     is_in_one_format_});
  }

 private:
  std::vector<Mutation>& list_;
  bool is_in_one_format_ = false;
};

/// One a file of this folder.
void add_camera_mutations(std::vector<Mutation>& list);
void add_pose_mutations(std::vector<Mutation>& list);
void add_time_mutations(std::vector<Mutation>& list);
void add_depth_mutations(std::vector<Mutation>& list);
void add_far_depth_mutations(std::vector<Mutation>& list);
void add_flow_mutations(std::vector<Mutation>& list);
void add_color_mutations(std::vector<Mutation>& list);
void add_georeference_mutations(std::vector<Mutation>& list);
void add_place_mutations(std::vector<Mutation>& list);
void add_label_mutations(std::vector<Mutation>& list);
void add_file_mutations(std::vector<Mutation>& list);
void add_order_mutations(std::vector<Mutation>& list);
void add_point_mutations(std::vector<Mutation>& list);

}  // namespace terracast::test
