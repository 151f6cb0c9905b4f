#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace terracast::geo {

/// What a camera model needs to be made again: its name and its parameters, pixels with centres at
/// +0.5.
struct CameraIntrinsics {
  std::string model = "pinhole";
  int width_px = 0;
  int height_px = 0;
  std::vector<double> parameters;  ///< fx, fy, cx, cy, then the model's own in their order
  bool operator==(const CameraIntrinsics&) const = default;
};

/// pixel_from_ray errs by less than this share of the image's size and the pixel's place together; a ray
/// of ray_from_pixel is that of an image point as near. OpenCvCameras and PublishedCameras tests, against 64-bit mantissas.
inline constexpr double kPixelRounding = 1e-12;

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

/// Maps points of the camera frame to pixels and back. Within its domain, which each model states, a
/// camera is one to one; beyond it image points have no ray, and points no image.
///
/// accuracy   ray_from_pixel, then pixel_from_ray: 1e-9 px in images of up to 10 000 px; CameraLaws
/// threads    safe
class CameraModel {
 public:
  virtual ~CameraModel() = default;

  const CameraIntrinsics& intrinsics() const { return intrinsics_; }
  int width_px() const { return intrinsics_.width_px; }
  int height_px() const { return intrinsics_.height_px; }

  /// Direction in the camera frame of an image point; z = 1 for models on a plane before the camera
  /// (so that a ray's parameter is depth), unit length otherwise; NaN where no ray comes in.
  virtual Eigen::Vector3d ray_from_pixel(const Eigen::Vector2d& pixel) const = 0;

  /// Whether all rays start at the camera frame's origin.
  virtual bool is_central() const { return true; }

  /// Where the ray of an image point starts, in the camera frame.
  virtual Eigen::Vector3d origin_from_pixel(const Eigen::Vector2d&) const {
    return Eigen::Vector3d::Zero();
  }

  /// The same of several image points, to the last bit.
  virtual void find_rays(const PixelBlock& pixels, VectorBlock& rays_camera) const {
    for (int i = 0; i < PixelBlock::kPixels; ++i) {
      const Eigen::Vector3d ray = ray_from_pixel({pixels.x[i], pixels.y[i]});
      rays_camera.x[i] = ray.x();
      rays_camera.y[i] = ray.y();
      rays_camera.z[i] = ray.z();
    }
  }

  /// Image point of a camera-frame point; for central cameras of a direction, of any length. Nothing
  /// beyond the model's domain. It may lie outside the image.
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

  /// The largest number of pixels of the image that a radian spans: what the level of detail must
  /// serve. Where columns meet in a pole, they are counted as at the equator: they show no more.
  virtual double finest_pixels_per_radian() const = 0;

  /// The same of what spans as many pixels from near and from far: pixels of a metre.
  virtual double finest_pixels_per_m() const { return 0.0; }

  bool contains(const Eigen::Vector2d& pixel) const {
    return pixel.x() >= 0.0 && pixel.y() >= 0.0 && pixel.x() < width_px() &&
           pixel.y() < height_px();
  }

 protected:
  explicit CameraModel(CameraIntrinsics intrinsics) : intrinsics_(std::move(intrinsics)) {}

 private:
  CameraIntrinsics intrinsics_;
};

/// A parameter that a model has beside fx, fy, cx, cy; a key of a camera in a config.
struct CameraParameter {
  std::string_view name;
  std::string_view meaning;
  double default_value = 0.0;
  double lowest = -std::numeric_limits<double>::infinity();
  double highest = std::numeric_limits<double>::infinity();
};

struct CameraModelInfo {
  std::string_view name;
  std::string_view summary;
  /// Its own, which follow on fx, fy, cx, cy.
  std::span<const CameraParameter> parameters;
  /// Of parameters that make_camera has looked at.
  /// throws Config: what contradicts between them
  std::unique_ptr<CameraModel> (*make)(const CameraIntrinsics&);
  /// fx, fy of an image that just holds all that the model can see, for models of such images.
  Eigen::Vector2d (*whole_view)(int width_px, int height_px) = nullptr;
  /// All parameters of a model that comes from a file; more follow on its own.
  /// throws Io, Input: no such file, or not one of the model's
  std::vector<double> (*read)(const std::filesystem::path& path) = nullptr;

  /// "fx, fy, cx, cy, k1, k2"
  std::string parameter_names() const;
};

/// The table of models.
std::span<const CameraModelInfo> camera_models();

/// throws Config: unknown model, wrong number of parameters, one out of its range, size or focal
/// length not positive
std::unique_ptr<CameraModel> make_camera(const CameraIntrinsics& intrinsics);

}  // namespace terracast::geo
