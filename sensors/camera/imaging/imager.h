#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "capture/frame.h"
#include "core/image.h"
#include "sensors/camera/imaging/development.h"
#include "sensors/camera/imaging/exposure_control.h"
#include "sensors/camera/imaging/image_sensor.h"
#include "sensors/camera/imaging/imaging_options.h"
#include "sensors/camera/imaging/soiling.h"

namespace terracast::sensors {

/// What a camera makes of the light of a frame.
struct Photo {
  core::Image8 color;
  core::Image16 raw;  ///< digital numbers of a mosaic; empty without one
  std::optional<double>
      exposure_ev;  ///< stops above the sequence's fixed exposure; nothing where no camera was in between
};

/// What stands in the capture of a camera's imaging.
capture::CameraImaging describe_imaging(const ImagingOptions& options,
                                        const capture::CameraCalibration& camera, std::int64_t seed,
                                        const std::string& sequence);

/// One camera of a sequence: from the light that comes to its pixels to its image, through lens, exposure,
/// sensor and color. Threads: safe.
class Imager {
 public:
  /// level, balance   of the sequence's light: exposure at 0 stops, and gains by which a level white
  ///                  board is white
  /// model            must outlive the imager
  Imager(const ImagingOptions& options, const capture::CameraCalibration& camera,
         const geo::CameraModel& model, std::int64_t seed, const std::string& sequence, float level,
         const scene::Color& balance);

  /// light         linear radiance, three channels
  /// exposure_ev   stops above the sequence's fixed exposure
  /// grey          mean of the light at the scene's balance, of white_balance = "grey_world"
  Photo photograph(core::ImageF light, int frame, double exposure_ev,
                   const scene::Color& grey) const;

 private:
  void pass_lens(core::ImageF& light) const;
  scene::Color gains(const scene::Color& grey) const;

  ImagingOptions options_;
  Eigen::Vector2d center_px_;
  core::ImageF vignetting_;  ///< empty: none
  Soiling soiling_;
  std::optional<ImageSensor> sensor_;
  Development development_;
  float level_;
  scene::Color balance_;
};

/// The imagers of a sequence's cameras, where they have one, and who says how to expose.
class Imagers {
 public:
  /// options   one a camera, or none at all: no camera has an imager
  /// models    of the cameras; must outlive the imagers
  Imagers(const std::vector<ImagingOptions>& options,
          const std::vector<capture::CameraCalibration>& cameras,
          const std::vector<const geo::CameraModel*>& models, std::vector<double> times_s,
          std::int64_t seed, const std::string& sequence, float level, const scene::Color& balance,
          LightMeters::Look look);

  bool has(int camera) const {
    return !imagers_.empty() && imagers_[static_cast<std::size_t>(camera)] != nullptr;
  }
  /// Of a camera that has an imager.
  Photo photograph(core::ImageF light, int frame, int camera) const;
  double exposure_ev(int frame, int camera) const;

 private:
  double wanted_ev_at(int frame, int camera) const;

  std::vector<ImagingOptions> options_;
  std::vector<std::vector<int>> rigs_;  ///< the cameras of each camera's rig
  std::vector<double> times_s_;
  std::vector<std::unique_ptr<const Imager>> imagers_;
  LightMeters meters_;
};

}  // namespace terracast::sensors
