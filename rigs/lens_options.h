#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/schema.h"
#include "geo/camera_model.h"

namespace terracast::rigs {

/// What a camera's model takes beside fx, fy, cx, cy, as keys of the camera: the model's own parameters
/// by their names, or the file that they come from.
class LensOptions {
 public:
  LensOptions() : LensOptions("pinhole") {}
  explicit LensOptions(const std::string& model) { set_model(model); }

  /// Parameters are at their defaults from here on, if it is another model.
  void set_model(const std::string& model);
  /// The parameters of the model that was set which follow on fx, fy, cx, cy.
  /// throws Config: not as many as it has, a model that comes from a file
  void set_own_parameters(std::span<const double> own);
  /// The keys of the model that was set.
  void describe(core::SchemaVisitor& visit);

  /// fx, fy, cx, cy, then what is the model's own; of a model that comes from a file all that is in it.
  /// throws   Config: a model that is read, without a file
  ///          Io, Input: the file cannot be read, or holds something else
  std::vector<double> parameters(double fx, double fy, double cx, double cy) const;

  const geo::CameraModelInfo& model() const { return *model_; }

 private:
  const geo::CameraModelInfo* model_ = nullptr;  ///< of the table
  std::vector<double> own_;
  core::Path rays_;
};

}  // namespace terracast::rigs
