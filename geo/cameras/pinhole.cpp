#include <Eigen/SVD>
#include <algorithm>

#include "core/packet_code.h"
#include "geo/camera_model.h"

namespace terracast::geo {
namespace {

struct Pinhole {
  double fx, fy, cx, cy;
  double width_px, height_px;
};

TERRACAST_PACKET_CODE
void find_in_pinhole_image(const Pinhole& given, const VectorBlock& rays,
                           std::int32_t (&is_in)[VectorBlock::kVectors]) {
  const Pinhole c = given;
  double in[VectorBlock::kVectors];
  for (int i = 0; i < VectorBlock::kVectors; ++i) {
    const double u = c.fx * (rays.x[i] / rays.z[i]) + c.cx;
    const double v = c.fy * (rays.y[i] / rays.z[i]) + c.cy;
    in[i] = core::truth((rays.z[i] > 0.0) & (u >= 0.0) & (v >= 0.0) & (u < c.width_px) &
                        (v < c.height_px));
  }
  for (int i = 0; i < VectorBlock::kVectors; ++i) is_in[i] = static_cast<std::int32_t>(in[i]);
}

TERRACAST_PACKET_CODE
void find_pinhole_rays(const Pinhole& given, const PixelBlock& pixels,
                       VectorBlock& __restrict rays) {
  const Pinhole c = given;
  for (int i = 0; i < PixelBlock::kPixels; ++i) {
    rays.x[i] = (pixels.x[i] - c.cx) / c.fx;
    rays.y[i] = (pixels.y[i] - c.cy) / c.fy;
    rays.z[i] = 1.0;
  }
}

/// u = fx x / z + cx, v = fy y / z + cy.
class PinholeCamera final : public CameraModel {
 public:
  explicit PinholeCamera(const CameraIntrinsics& intrinsics)
      : CameraModel(intrinsics),
        fx_(intrinsics.parameters[0]),
        fy_(intrinsics.parameters[1]),
        cx_(intrinsics.parameters[2]),
        cy_(intrinsics.parameters[3]) {
    finest_pixels_per_radian_ = largest_pixels_per_radian();
  }

  Eigen::Vector3d ray_from_pixel(const Eigen::Vector2d& pixel) const override {
    return {(pixel.x() - cx_) / fx_, (pixel.y() - cy_) / fy_, 1.0};
  }

  void find_rays(const PixelBlock& pixels, VectorBlock& rays_camera) const override {
    find_pinhole_rays(parameters(), pixels, rays_camera);
  }

  std::optional<Eigen::Vector2d> pixel_from_ray(const Eigen::Vector3d& ray_camera) const override {
    if (!(ray_camera.z() > 0.0) || !ray_camera.allFinite()) return std::nullopt;
    return Eigen::Vector2d(fx_ * (ray_camera.x() / ray_camera.z()) + cx_,
                           fy_ * (ray_camera.y() / ray_camera.z()) + cy_);
  }

  std::uint32_t find_in_image(const VectorBlock& rays_camera) const override {
    std::int32_t is_in[VectorBlock::kVectors];
    find_in_pinhole_image(parameters(), rays_camera, is_in);
    std::uint32_t in_image = 0;
    for (int i = 0; i < VectorBlock::kVectors; ++i)
      in_image |= static_cast<std::uint32_t>(is_in[i]) << i;
    return in_image;
  }

  Eigen::Matrix<double, 2, 3> pixel_jacobian(const Eigen::Vector3d& ray_camera) const override {
    const double per_z = 1.0 / ray_camera.z();
    Eigen::Matrix<double, 2, 3> jacobian;
    jacobian << fx_ * per_z, 0.0, -fx_ * ray_camera.x() * per_z * per_z,  //
        0.0, fy_ * per_z, -fy_ * ray_camera.y() * per_z * per_z;
    return jacobian;
  }

  double finest_pixels_per_radian() const override { return finest_pixels_per_radian_; }

 private:
  Pinhole parameters() const {
    return {.fx = fx_,
            .fy = fy_,
            .cx = cx_,
            .cy = cy_,
            .width_px = static_cast<double>(width_px()),
            .height_px = static_cast<double>(height_px())};
  }

  // At a unit ray the Jacobian's null space is the ray, so its largest singular value is pixels a
  // radian in the direction that spreads most. It grows with |x / z| and with |y / z|: a corner has
  // the largest of both.
  double largest_pixels_per_radian() const {
    double largest = 0.0;
    for (const double u : {0.0, static_cast<double>(width_px())}) {
      for (const double v : {0.0, static_cast<double>(height_px())}) {
        const Eigen::Vector3d ray = ray_from_pixel({u, v}).normalized();
        const Eigen::JacobiSVD<Eigen::MatrixXd> svd(pixel_jacobian(ray));
        largest = std::max(largest, svd.singularValues()[0]);
      }
    }
    return largest;
  }

  double fx_, fy_, cx_, cy_;
  double finest_pixels_per_radian_ = 0.0;
};

std::unique_ptr<CameraModel> make_pinhole(const CameraIntrinsics& intrinsics) {
  return std::make_unique<PinholeCamera>(intrinsics);
}

}  // namespace

CameraModelInfo pinhole_camera() {
  return {.name = "pinhole",
          .summary = "Central projection on a plane, without distortion.",
          .parameters = {},
          .make = make_pinhole};
}

}  // namespace terracast::geo
