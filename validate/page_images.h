#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/image.h"
#include "core/json.h"
#include "validate/dataset.h"
#include "validate/place.h"

/// The images that the report's page shows: which of a dataset's, and what of each.
namespace terracast::validate {

/// The longer side of what the page holds of an image is at most this; a wider image is taken at
/// every n-th pixel.
constexpr int kPageImagePx = 480;
/// About as many images are shown, beside the worst of each check.
constexpr int kPageImages = 60;
/// No more cameras of a frame are shown, beside the worst of each check.
constexpr int kPageCameras = 24;

/// The images to show: evenly spaced frames over all sequences, each with its cameras, and
/// `places`. At most max(kPageImages, 2 * kPageCameras) + places.size(), in the order of sequence,
/// camera, frame.
std::vector<Place> choose_page_images(const Dataset& dataset, const std::vector<Place>& places);

/// How many values lie between powers of two: four bins to each.
class OctaveHistogram {
 public:
  void add(double value);
  void add(const OctaveHistogram& other);
  /// {"edges", "counts"}, from the first bin that holds something to the last; null without any.
  core::Json json() const;

 private:
  std::map<int, std::int64_t> counts_;  ///< by floor(4 log2(value))
};

/// One image as the page shows it. Grids hold every `step`-th pixel of the image, exactly as it is
/// stored: value (x, y) is that of pixel (step x + step / 2, step y + step / 2).
struct PageImage {
  Place place;
  int width = 0;  ///< of the grids
  int height = 0;
  int step = 1;
  std::optional<Pose> local_from_camera;  ///< at the frame's time
  std::optional<LineMotion> lines;        ///< of a rolling shutter
  core::Image8 color;                     ///< means of step x step pixels
  core::ImageF depth;                     ///< m; NaN: none
  std::string script;                     ///< the values of all layers, for the page
  std::vector<std::string> layers;
  int residual_frame = -1;  ///< the frame that the residuals of depth are against
  double median_depth_m = 0.0;
  /// Where the image's border lies on the ground, local frame; far parts are drawn in to
  /// kFarDepths times the median depth. Empty without depth or pose.
  std::vector<Eigen::Vector3d> footprint;
  /// Share of the pixels with depth that the camera's next frame has in its image.
  std::optional<double> overlap;
  OctaveHistogram depths_m, flows_px;
  std::array<std::int64_t, 90> slopes{};  ///< pixels by the slope of the ground, whole degrees
  std::map<int, std::int64_t> classes;    ///< pixels by class
};

/// Beyond so many median depths of an image the ground is neither in footprints nor in the cloud.
constexpr double kFarDepths = 4.0;

/// The place in the local frame of a point of a camera, as the line through an image point sees it.
Eigen::Vector3d local_point(const PageImage& image, const Intrinsics& camera,
                            const Eigen::Vector2d& pixel, const Eigen::Vector3d& point_camera);

/// Reads an image's files and makes what the page shows. What cannot be read is left out: the check
/// `structure` has named it.
/// index    the image's number on the page
/// threads  safe
PageImage make_page_image(const Dataset& dataset, const Place& place, std::size_t index);

}  // namespace terracast::validate
