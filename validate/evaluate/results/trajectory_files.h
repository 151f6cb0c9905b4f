#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "validate/evaluate/task.h"

/// Trajectories that methods write.
namespace terracast::validate {

struct ResultTrajectory {
  std::string form;  ///< "TUM", "KITTI", "TartanAir", "COLMAP"
  /// One a frame; nothing where the result has none. In the sequence's local frame (east, north,
  /// up at its origin), as far as the form tells: of TUM and COLMAP the result's own world is taken
  /// for it, of TartanAir its north, east, down; KITTI's first camera is laid on the truth's.
  std::vector<std::optional<Pose>> world_from_camera;
  std::vector<std::string> notes;
};

/// The trajectory of a subject: a file, or in a folder <sequence>.txt, <sequence>.tum or
/// <sequence>/images.bin (images.txt); of several cameras <sequence>/<camera>.txt and so on.
/// throws  Input: none is there
std::filesystem::path find_trajectory(const std::filesystem::path& result, const Subject& subject);

/// Poses of the subject's camera (x right, y down, z forward), camera to world, by the form that
/// name and columns tell:
///   8 columns   TUM: time_s tx ty tz qx qy qz qw; a row belongs to the nearest frame by time
///   12 columns  KITTI odometry: rows of the 3 x 4 matrix from a frame's camera to the first's
///   7 columns   TartanAir: tx ty tz qx qy qz qw, camera x forward, y right, z down to a world
///               north, east, down
///   images.txt, images.bin   COLMAP, of any of its models; images by the name of their file
/// The n-th row of KITTI and TartanAir is frame n; a row of `nan` is a frame that the method lost,
/// as are those behind the last row. Lines that begin with # are passed over.
/// throws  Input: damage; more rows than frames; no pose of any frame
ResultTrajectory read_trajectory(const std::filesystem::path& file, const Subject& subject,
                                 double time_offset_s, double max_time_difference_s);

/// A trajectory at its own times.
struct TimedTrajectory {
  std::vector<double> times_s;                         ///< from the first frame, increasing
  std::vector<std::optional<Pose>> world_from_camera;  ///< one a time
};
/// Rows of TUM's form, whatever their rate.
/// throws  Input: damage, another form, or times that do not increase
TimedTrajectory read_timed_trajectory(const std::filesystem::path& file, double time_offset_s);

/// A trajectory with a row without pose for each that it lacks.
struct FilledTrajectory {
  TimedTrajectory rows;
  double interval_s = 0.0;      ///< the median of the rows within the frames' times
  std::int64_t num_filled = 0;  ///< rows added
};
/// Rows are lacking in gaps of more than 1.5 median intervals, and from the first frame to the first row
/// and from the last row to the last frame; they are added at that interval, or at a millionth of the
/// frames' time if that is longer. Rows beyond the frames stay as they are.
/// frame_times_s  increasing
FilledTrajectory fill_gaps(const TimedTrajectory& trajectory,
                           std::span<const double> frame_times_s);

/// Times of the frames, s from the first: the format's own, else frame / rate.
std::vector<double> frame_times_s(const Sequence& sequence);

}  // namespace terracast::validate
