#pragma once

#include <array>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "validate/check.h"
#include "validate/frames.h"
#include "validate/null_distribution.h"
#include "validate/transfer.h"

/// Which small mistake in a dataset's metadata explains what two views disagree about.
///
/// Each residual r between two views is linear in small corrections of the metadata, r + J x. For
/// every possible cause alone least squares gives the correction that explains the residuals best,
/// x = -sum(w J r) / sum(w J J). In a right dataset all are 0; a wrong principal point, rotation, scale
/// or time shows at its full size in its own estimate, far below the noise of one pixel.
///
/// Residuals that lie near each other share the ground's relief and its texture, and so their errors: the
/// standard error is that of sums over sixteenths of each image, and over frames, which are left to
/// scatter as they do (a sandwich of clusters), whichever is more.
namespace terracast::validate {

/// Corrections of a camera (in all frames), of one image, or of all images of one frame.
enum Correction {
  kPrincipalX,  ///< px
  kPrincipalY,
  kFocal,      ///< relative
  kScale,      ///< relative, of the depth against the poses
  kTime,       ///< frames: the images were taken so much after their poses
  kLineTime,   ///< relative, of a rolling shutter: its lines follow each other so much slower
  kRotationX,  ///< rad, about the camera's axes
  kRotationY,
  kRotationZ,
  kPositionX,  ///< m, along the camera's axes
  kPositionY,
  kPositionZ,
  kNumCorrections
};

/// One residual with its derivatives; sides: 0 the camera of view a, 1 of view b.
struct Residual {
  double value = 0.0;
  double sigma = 1.0;  ///< what it may deviate by, up to a factor common to all pairs
  int axis = 0;        ///< 0, or 1 of those along the image's columns
  int block = 0;       ///< which sixteenth of the image of `a` it is from: block_of()
  std::array<std::array<double, kNumCorrections>, 2> slopes{};
};

inline constexpr int kNumBlocks = 16;
/// Which sixteenth of an image a pixel lies in, row by row.
int block_of(const Intrinsics& camera, const Eigen::Vector2d& pixel);

/// The slopes of a residual that depends on the point in `b` and on the intrinsics of `b`. Of a rolling `b`, that
/// another line sees a point that has moved is counted; of its intrinsics it is not, which is a few percent.
/// by_point      d r / d point_b
/// by_principal  d r / d (cx, cy) of b
/// by_focal      d r / d (relative focal length) of b
/// by_scale      d r / d (relative depth) of b
void set_slopes(Residual& residual, const ViewPair& pair, const Transfer& transfer,
                const Transfer::Place& place, const Eigen::RowVector3d& by_point,
                const Eigen::Vector2d& by_principal, double by_focal, double by_scale);

class Evidence {
 public:
  struct Sum {
    double slope_residual = 0.0;
    double slope_slope = 0.0;
    double weight = 0.0;
    /// Of the sixteenths' slope_residual and slope_slope: sums of squares, and of their product.
    double residual_squares = 0.0, products = 0.0, slope_squares = 0.0;
    /// What slope_residual may be off by, where all residuals of a pair along an axis are so alike.
    double common = 0.0;
    Sum& operator+=(const Sum& other);
  };
  using Sums = std::array<Sum, kNumCorrections>;

  /// What the residuals of one pair say; made in parallel, added in order.
  struct Part {
    std::array<int, 2> cameras{};
    std::array<int, 2> frames{};
    std::array<Sums, 2> sides{};
    Sums both{};  ///< of one correction common to both sides
    /// Rotation and position of all cameras of a frame alike, along the local frame's axes.
    std::array<Sums, 2> of_frames{};
    std::array<double, 2> pixels_per_metre{};  ///< at the typical depth, for positions
    std::size_t num_residuals = 0;
  };
  /// Weighs the residuals of one pair (Tukey's biweight at 6 times the scale of their median) and
  /// sums them.
  /// common   what all residuals of the pair along each axis may be off by alike
  static Part sum(const ViewPair& pair, const std::vector<Residual>& residuals,
                  const std::array<double, 2>& common = {0.0, 0.0});

  void add(const Part& part);

  /// The smallest corrections that are to be found; 0: not judged. A right dataset may need a tenth of them.
  struct Bounds {
    double principal_px = 0.0;
    double focal_percent = 0.0;
    double scale_percent = 0.0;
    double time_frames = 0.0;
    double line_time_percent = 0.0;
    /// What residuals may be off by in a pattern of whatever kind, that more of them do not average out: slopes that
    /// all but cancel (of time, in steady straight flight) blow it up. By Cauchy and Schwarz it moves an estimate by
    /// this much times sqrt(sum w / sum w J²) at most.
    double pattern = 0.0;
    double time_pattern = 1e-6;  ///< the same, besides, of time
    /// By how much the variance of a sum over pairs is larger than that of as many that share no image.
    double shared = 1.0;
    /// The most that rounding leaves in a residual. It may be alike in all, and moves any estimate by this
    /// much times sqrt(sum w / sum w J²) at most: so much is neither seen nor judged.
    double rounding = 0.0;
    double rotation_deg = 0.0;
    double position_px = 0.0;  ///< the shift that it makes in the image at the typical depth
  };
  /// Results `<prefix>_principal_point`, `_focal_length`, `_scale`, `_time`, of sequences with rolling shutters
  /// `_line_time`, `_rotation`, `_position`, judged by Estimates. A camera that has files of a kind and no residuals is
  /// unseen.
  std::vector<CheckResult> results(const std::string& prefix, const Sequence& sequence,
                                   const Bounds& bounds, std::string FrameFiles::*file,
                                   const std::string& what, const std::string& detects) const;

 private:
  std::vector<int> cameras_without_residuals(const Sequence& sequence,
                                             std::string FrameFiles::*file) const;

  /// Of all pairs that a correction concerns, and of those of each frame.
  struct Target {
    Sums sums{};
    /// slope_residual and slope_slope of the pairs with an image of the frame.
    std::map<int, std::array<std::array<double, 2>, kNumCorrections>> frames;
    void add(const Sums& sums, const std::array<int, 2>& frames);
  };
  Estimate estimate(const Target& target, int cause, double factor, const Bounds& bounds,
                    double allowance, std::string where) const;

  std::map<int, Target> cameras_;  ///< by camera; -1: all alike
  /// By camera (-1: all of the frame alike) and frame.
  std::map<std::pair<int, int>, Target> images_;
  std::map<int, double> pixels_per_metre_;
  std::size_t num_residuals_ = 0;
};

}  // namespace terracast::validate
