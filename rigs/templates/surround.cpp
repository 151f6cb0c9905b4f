#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "geo/units.h"
#include "rigs/rig_template.h"

namespace terracast::rigs {
namespace {

/// Cameras on the outline of a vehicle, a rectangle about the rig's origin, each where the line from the
/// origin in its direction leaves it.
class SurroundRig final : public RigTemplate {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("yaw_deg", yaw_deg_, "Where each camera looks, positive to the left.",
              core::between(-360.0, 360.0));
    visit.key("pitch_deg", pitch_deg_, "How far each camera looks down.",
              core::between(-90.0, 90.0));
    visit.key("length_mm", length_mm_, "Length of the outline, forward.", core::between(0.0, 1e6));
    visit.key("width_mm", width_mm_, "Width of the outline.", core::between(0.0, 1e6));
    visit.key("height_mm", height_mm_, "Height of the cameras above the rig's origin.",
              core::between(-1e6, 1e6));
  }
  void validate() const override {
    if (yaw_deg_.empty())
      core::fail(core::ErrorKind::Config,
                 "yaw_deg is empty; a surround rig has a camera for each yaw");
  }
  std::unique_ptr<RigTemplate> clone() const override {
    return std::make_unique<SurroundRig>(*this);
  }
  std::vector<CameraPlace> places() const override {
    std::vector<CameraPlace> places;
    for (const double yaw_deg : yaw_deg_) {
      const double yaw_rad = geo::radians_from_degrees(yaw_deg);
      const Eigen::Vector2d outwards(std::cos(yaw_rad), std::sin(yaw_rad));
      const auto until = [](double half_mm, double component) {
        return component == 0.0 ? std::numeric_limits<double>::infinity()
                                : half_mm / std::abs(component);
      };
      const double distance_mm =
          std::min(until(0.5 * length_mm_, outwards.x()), until(0.5 * width_mm_, outwards.y()));
      places.push_back({fmt::format("{}", places.size()),
                        rig_from_camera_of_euler_deg(
                            yaw_deg, pitch_deg_,
                            {outwards.x() * distance_mm, outwards.y() * distance_mm, height_mm_})});
    }
    return places;
  }

 private:
  std::vector<double> yaw_deg_ = {0.0, -55.0, -110.0, 180.0, 110.0, 55.0};
  double pitch_deg_ = 0.0;
  double length_mm_ = 4000.0;
  double width_mm_ = 1800.0;
  double height_mm_ = 0.0;
};

}  // namespace

RigTemplateInfo surround_rig() {
  return {.name = "surround",
          .summary = "Cameras on the outline of a vehicle, looking all round.",
          .make = [] { return std::unique_ptr<RigTemplate>(new SurroundRig); }};
}

}  // namespace terracast::rigs
