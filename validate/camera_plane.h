#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace terracast::validate {

/// A camera model of any kind, in its own plane: a point that is seen at the place (x', y') stands in the image at
/// (fx x' + cx, fy y' + cy). Written from the publications that docs/cameras.md names, and from the formulas that
/// docs/formats/terracast.md states; it shares no code with the renderer's cameras.
///
/// accuracy   place to ray to place within 1e-11, of the models' own lengths
/// threads    safe
class CameraPlane {
 public:
  virtual ~CameraPlane() = default;

  const std::string& model() const { return model_; }
  /// Its own, which follow on fx, fy, cx, cy.
  const std::vector<double>& parameters() const { return parameters_; }
  bool operator==(const CameraPlane& other) const {
    return model_ == other.model_ && parameters_ == other.parameters_;
  }

  /// Where a point of the camera's frame is seen; for central models a direction of any length will do. Nothing where
  /// the model has no image of it.
  virtual std::optional<Eigen::Vector2d> place_from_point(const Eigen::Vector3d& point) const = 0;
  /// Unit direction of the ray through a place; NaN where none comes in.
  virtual Eigen::Vector3d ray_from_place(const Eigen::Vector2d& place) const = 0;

  /// Whether all rays start at the camera's place.
  virtual bool is_central() const { return true; }
  /// Where the ray through a place starts, in the camera's frame.
  virtual Eigen::Vector3d origin_from_place(const Eigen::Vector2d&) const {
    return Eigen::Vector3d::Zero();
  }
  /// How far a point that is seen is along its own ray from where that starts, and what it changes by.
  virtual double distance_m(const Eigen::Vector3d& point) const { return point.norm(); }
  virtual Eigen::Vector3d distance_gradient(const Eigen::Vector3d& point) const {
    return point.normalized();
  }
  /// By how much x' grows in a turn about the camera, for images that join at their ends; 0 of all others.
  virtual double turn() const { return 0.0; }

 protected:
  CameraPlane(std::string model, std::vector<double> parameters)
      : model_(std::move(model)), parameters_(std::move(parameters)) {}

 private:
  std::string model_;
  std::vector<double> parameters_;
};

/// parameters   the model's own
/// throws       Input: unknown model, another number of parameters, one that is out of the model's range
std::shared_ptr<const CameraPlane> make_camera_plane(const std::string& model,
                                                     const std::vector<double>& parameters);
/// Names of all models that are known.
std::vector<std::string> camera_plane_models();

}  // namespace terracast::validate
