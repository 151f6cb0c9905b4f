#include "rigs/rig_template.h"

namespace terracast::rigs {
namespace {

/// A camera on each face of a cube, looking outwards; the names and turns of TartanAir's six.
class CubeRig final : public RigTemplate {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key(
        "half_edge_mm", half_edge_mm_,
        "From the rig's origin out to each face's centre, where its camera stands; 0: all share "
        "one centre.",
        core::between(0.0, 1e6));
  }
  std::unique_ptr<RigTemplate> clone() const override { return std::make_unique<CubeRig>(*this); }
  std::vector<CameraPlace> places() const override {
    const auto face = [&](const char* suffix, double yaw_deg, double pitch_deg,
                          const Eigen::Vector3d& outwards) {
      return CameraPlace{
          suffix, rig_from_camera_of_euler_deg(yaw_deg, pitch_deg, half_edge_mm_ * outwards)};
    };
    return {
        face("_front", 0.0, 0.0, {1.0, 0.0, 0.0}),    face("_left", 90.0, 0.0, {0.0, 1.0, 0.0}),
        face("_right", -90.0, 0.0, {0.0, -1.0, 0.0}), face("_back", 180.0, 0.0, {-1.0, 0.0, 0.0}),
        face("_top", 0.0, -90.0, {0.0, 0.0, 1.0}),    face("_bottom", 0.0, 90.0, {0.0, 0.0, -1.0})};
  }

 private:
  double half_edge_mm_ = 0.0;
};

}  // namespace

RigTemplateInfo cube_rig() {
  return {.name = "cube",
          .summary = "Six cameras on the faces of a cube, looking outwards.",
          .make = [] { return std::unique_ptr<RigTemplate>(new CubeRig); }};
}

}  // namespace terracast::rigs
