#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/image.h"
#include "validate/dataset.h"
#include "validate/shutter.h"

namespace terracast::validate {

/// What one camera recorded in one frame, decoded. An image that the format does not hold, or that
/// could not be read, is empty.
struct LoadedImage {
  core::Image8 color;  ///< 3 channels
  core::ImageF grey;   ///< luma 0 to 255, smoothed by the binomial [1 2 1] / 4 both ways
  core::ImageF
      depth;  ///< m, of what stands still; NaN: none. Planar; of cameras with a plane range
  core::ImageF disparity;  ///< px; NaN: none
  /// Null: none. Copies of the image share it, the largest of all that it holds.
  std::shared_ptr<const FlowFields> flow;
  core::Image8 segmentation;  ///< class indices
  core::ImageF normals;       ///< 3 channels, local frame; NaN: none
  core::ImageU32 instances;   ///< 0: none
  /// The body that each pixel shows, 0 where it stands still; empty: all does.
  core::Image16 moving;
  /// Of the pixels that show what moves, which have no depth beside; NaN: none. Empty as above.
  core::ImageF moving_depth;

  int body_at(int x, int y) const { return moving.empty() ? 0 : moving(x, y); }
  /// Depth of whatever the pixel shows.
  float depth_at(int x, int y) const {
    return body_at(x, y) != 0 ? moving_depth(x, y) : depth(x, y);
  }
  /// Whether a pixel around an image point shows what moves.
  bool shows_moving_near(const Eigen::Vector2d& pixel) const;
  /// Whether all 3 x 3 pixels around an image point show what moves, nearer than a depth.
  bool hides_by_moving(const Eigen::Vector2d& pixel, double depth_m) const;
};
/// The images of a frame, by camera.
using FrameImages = std::vector<std::shared_ptr<const LoadedImage>>;

/// Decodes all images of one frame, in parallel; damage becomes findings.
FrameImages load_frame(const Dataset& dataset, const Sequence& sequence, int frame,
                       Findings& findings);

/// An image with its camera and pose; what two-view checks compare.
struct View {
  int camera_index = 0;
  int frame = 0;
  const Camera* camera = nullptr;
  const LoadedImage* image = nullptr;
  const Sequence* sequence = nullptr;
  Pose local_from_camera;  ///< at the frame's time
  /// Where it is at other times, while the lines of a rolling shutter are exposed; nothing: all are at once.
  std::optional<LineMotion> lines;
  Eigen::Vector3d velocity_camera = Eigen::Vector3d::Zero();          ///< m a frame
  Eigen::Vector3d angular_velocity_camera = Eigen::Vector3d::Zero();  ///< rad a frame
};

struct ViewPair {
  View a;
  View b;
  bool is_same_time() const { return a.frame == b.frame; }
};

/// An image with the pose, and the motion, that a camera has at a frame.
/// returns  nothing where there is none
std::optional<View> view_at(const Sequence& sequence, int camera_index, int frame,
                            const LoadedImage* image);

/// The frames of a sequence that are in memory: the newest and some before it.
class FrameWindow {
 public:
  FrameWindow(const Dataset& dataset, const Sequence& sequence, Findings& findings);
  /// Takes decoded images, one a frame, instead of the dataset's files.
  FrameWindow(const Dataset& dataset, const Sequence& sequence, Findings& findings,
              std::span<const FrameImages> images);

  /// Takes the next frame.
  /// returns  false after the last
  bool advance();

  int frame() const { return frame_; }
  const Dataset& dataset() const { return dataset_; }
  const Sequence& sequence() const { return sequence_; }
  /// Nothing when the frame is not in memory, or the camera has no pose there.
  std::optional<View> view(int camera_index, int frame) const;
  /// Pairs of the newest frame: with the frames before it, both ways, of each camera; and among its
  /// cameras where their fields of view meet.
  std::vector<ViewPair> pairs() const;

  /// A neighbour for exactness, a farther one for its parallax.
  static constexpr int kOffsets[] = {1, 4};

 private:
  const Dataset& dataset_;
  const Sequence& sequence_;
  Findings& findings_;
  int frame_ = -1;
  std::optional<std::span<const FrameImages>> given_;
  std::deque<FrameImages> loaded_;  ///< the last is the newest frame's
};

}  // namespace terracast::validate
