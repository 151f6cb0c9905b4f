#include <cmath>

#include "geo/units.h"
#include "rigs/rig_template.h"

namespace terracast::rigs {
namespace {

/// Cameras on an upright cylinder about the rig's origin, looking outwards.
class CylinderRig final : public RigTemplate {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("num_cameras", num_cameras_, "Number of cameras.", core::between(1, 24));
    visit.key("radius_mm", radius_mm_, "From the axis out to each camera.",
              core::between(0.0, 1e6));
    visit.key("first_yaw_deg", first_yaw_deg_,
              "Where the first camera looks, positive to the left.", core::between(-360.0, 360.0));
    visit.key("step_deg", step_deg_,
              "From camera to camera, positive to the left; 0: the whole circle in equal steps.",
              core::between(-360.0, 360.0));
    visit.key("pitch_deg", pitch_deg_, "How far each camera looks down.",
              core::between(-90.0, 90.0));
  }
  std::unique_ptr<RigTemplate> clone() const override {
    return std::make_unique<CylinderRig>(*this);
  }
  std::vector<CameraPlace> places() const override {
    const double step_deg =
        step_deg_ != 0.0 ? step_deg_ : 360.0 / static_cast<double>(num_cameras_);
    std::vector<CameraPlace> places;
    for (std::int64_t i = 0; i < num_cameras_; ++i) {
      const double yaw_deg = first_yaw_deg_ + step_deg * static_cast<double>(i);
      const double yaw_rad = geo::radians_from_degrees(yaw_deg);
      places.push_back({fmt::format("{}", i),
                        rig_from_camera_of_euler_deg(yaw_deg, pitch_deg_,
                                                     {radius_mm_ * std::cos(yaw_rad),
                                                      radius_mm_ * std::sin(yaw_rad), 0.0})});
    }
    return places;
  }

 private:
  std::int64_t num_cameras_ = 6;
  double radius_mm_ = 300.0;
  double first_yaw_deg_ = 0.0;
  double step_deg_ = 0.0;
  double pitch_deg_ = 0.0;
};

}  // namespace

RigTemplateInfo cylinder_rig() {
  return {.name = "cylinder",
          .summary = "Cameras round an upright cylinder, looking outwards.",
          .make = [] { return std::unique_ptr<RigTemplate>(new CylinderRig); }};
}

}  // namespace terracast::rigs
