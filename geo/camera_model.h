#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace terracast::geo {

/// What a camera model needs to be made again: its name and its parameters in the model's own
/// order, pixels with centres at +0.5.
struct CameraIntrinsics {
  std::string model = "pinhole";
  int width_px = 0;
  int height_px = 0;
  std::vector<double> parameters;  ///< pinhole: fx, fy, cx, cy
  bool operator==(const CameraIntrinsics&) const = default;
};

/// Rays or points of a frame, field by field, for what works on several together.
struct VectorBlock {
  static constexpr int kVectors = 8;
  alignas(64) double x[kVectors];
  double y[kVectors];
  double z[kVectors];
};

/// Image points, field by field.
struct PixelBlock {
  static constexpr int kPixels = VectorBlock::kVectors;
  alignas(64) double x[kPixels];
  double y[kPixels];
};

/// Maps directions of the camera frame to pixels and back. Threads: safe.
class CameraModel {
 public:
  virtual ~CameraModel() = default;

  const CameraIntrinsics& intrinsics() const { return intrinsics_; }
  int width_px() const { return intrinsics_.width_px; }
  int height_px() const { return intrinsics_.height_px; }

  /// Direction in the camera frame of an image point; z = 1 for models whose view is less than a
  /// half-space (so that a ray's parameter is depth), unit length otherwise.
  virtual Eigen::Vector3d ray_from_pixel(const Eigen::Vector2d& pixel) const = 0;

  /// The same of several image points, to the last bit.
  virtual void find_rays(const PixelBlock& pixels, VectorBlock& rays_camera) const {
    for (int i = 0; i < PixelBlock::kPixels; ++i) {
      const Eigen::Vector3d ray = ray_from_pixel({pixels.x[i], pixels.y[i]});
      rays_camera.x[i] = ray.x();
      rays_camera.y[i] = ray.y();
      rays_camera.z[i] = ray.z();
    }
  }

  /// Image point of a camera-frame point or direction (any length); nothing when it is behind the
  /// camera. It may lie outside the image.
  virtual std::optional<Eigen::Vector2d> pixel_from_ray(
      const Eigen::Vector3d& ray_camera) const = 0;

  /// Which rays project into the image, a bit each: as pixel_from_ray and contains say.
  virtual std::uint32_t find_in_image(const VectorBlock& rays_camera) const {
    std::uint32_t in_image = 0;
    for (int i = 0; i < VectorBlock::kVectors; ++i) {
      const std::optional<Eigen::Vector2d> pixel =
          pixel_from_ray({rays_camera.x[i], rays_camera.y[i], rays_camera.z[i]});
      if (pixel && contains(*pixel)) in_image |= std::uint32_t{1} << i;
    }
    return in_image;
  }

  /// d pixel / d ray at a ray that projects.
  virtual Eigen::Matrix<double, 2, 3> pixel_jacobian(const Eigen::Vector3d& ray_camera) const = 0;

  /// The largest number of pixels a radian spans: what the level of detail must serve.
  virtual double finest_pixels_per_radian() const = 0;

  bool contains(const Eigen::Vector2d& pixel) const {
    return pixel.x() >= 0.0 && pixel.y() >= 0.0 && pixel.x() < width_px() &&
           pixel.y() < height_px();
  }

 protected:
  explicit CameraModel(CameraIntrinsics intrinsics) : intrinsics_(std::move(intrinsics)) {}

 private:
  CameraIntrinsics intrinsics_;
};

struct CameraModelInfo {
  std::string_view name;
  std::string_view summary;
  std::string_view parameters;  ///< their names, in order
  std::unique_ptr<CameraModel> (*make)(const CameraIntrinsics&);
};

/// The table of models.
std::span<const CameraModelInfo> camera_models();

/// throws Config: unknown model, wrong number of parameters, size or focal length not positive
std::unique_ptr<CameraModel> make_camera(const CameraIntrinsics& intrinsics);

}  // namespace terracast::geo
