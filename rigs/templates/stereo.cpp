#include "rigs/rig_template.h"

namespace terracast::rigs {
namespace {

/// Two cameras side by side; the left one stands at the rig's origin.
class StereoRig final : public RigTemplate {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("baseline_mm", baseline_mm_, "How far the right camera stands from the left.",
              core::between(0.001, 1e6));
    visit.key("vergence_deg", vergence_deg_,
              "Angle between the two axes, half of it each: positive where they meet ahead. 0: a "
              "rectified pair.",
              core::between(-180.0, 180.0));
  }
  std::unique_ptr<RigTemplate> clone() const override { return std::make_unique<StereoRig>(*this); }
  std::vector<CameraPlace> places() const override {
    const Eigen::Vector3d right_mm(0.0, -baseline_mm_, 0.0);
    return {
        {"_left", rig_from_camera_of_euler_deg(-0.5 * vergence_deg_, 0.0, {0.0, 0.0, 0.0})},
        {"_right", rig_from_camera_of_euler_deg(0.5 * vergence_deg_, 0.0, right_mm)},
    };
  }

 private:
  double baseline_mm_ = 500.0;
  double vergence_deg_ = 0.0;
};

}  // namespace

RigTemplateInfo stereo_rig() {
  return {.name = "stereo",
          .summary = "Two cameras side by side, parallel or turned to each other.",
          .make = [] { return std::unique_ptr<RigTemplate>(new StereoRig); }};
}

}  // namespace terracast::rigs
