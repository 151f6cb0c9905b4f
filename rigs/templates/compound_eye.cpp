#include "core/error.h"
#include "rigs/rig_template.h"

namespace terracast::rigs {
namespace {

using core::ErrorKind;
using core::fail;

/// Cameras on a sphere about the rig's origin, looking outwards. The eye's own axis is forward. In the
/// axes of a camera that looks along it (x right, y down, z forward) a camera's orientation is
/// Rz(roll) Rx(pitch): pitch leads off the axis, roll round it, clockwise as the camera sees it; the image's
/// upper edge points away from the axis. Its centre stands a radius out along its own axis.
class CompoundEyeRig final : public RigTemplate {
 public:
  void describe(core::SchemaVisitor& visit) override {
    const core::Constraint turn = core::between(-360.0, 360.0);
    visit.key("radius_mm", radius_mm_, "From the rig's origin out to each camera.",
              core::between(0.0, 1e6));
    visit.key("ring_cameras", ring_cameras_,
              "Number of cameras of each ring, from the axis outwards.", core::between(1, 24));
    visit.key(
        "ring_pitch_deg", ring_pitch_deg_,
        "Angle of each ring off the eye's axis: 0 along it, 90 across; the elevation is 90 less "
        "this.",
        core::between(0.0, 180.0));
    visit.key(
        "ring_roll_deg", ring_roll_deg_,
        "Where each ring's first camera stands round the axis, clockwise from the top; empty: 0.",
        turn);
    visit.key(
        "roll_deg", roll_deg_,
        "With pitch_deg, instead of rings: where each camera stands round the axis, clockwise from "
        "the top.",
        turn);
    visit.key("pitch_deg", pitch_deg_, "Angle of each camera off the eye's axis.",
              core::between(-180.0, 180.0));
  }

  void validate() const override {
    if (!roll_deg_.empty() || !pitch_deg_.empty()) {
      if (!ring_cameras_.empty() || !ring_pitch_deg_.empty() || !ring_roll_deg_.empty())
        fail(ErrorKind::Config,
             "both rings and the roll_deg and pitch_deg of each camera are given; state one of "
             "them");
      if (roll_deg_.size() != pitch_deg_.size())
        fail(ErrorKind::Config,
             "roll_deg has {} numbers, pitch_deg {}; each camera takes one of both",
             roll_deg_.size(), pitch_deg_.size());
      return;
    }
    if (ring_cameras_.empty())
      fail(ErrorKind::Config,
           "no cameras; give ring_cameras with ring_pitch_deg (as [1, 8] and [0.0, 54.0]), or "
           "roll_deg "
           "with pitch_deg");
    if (ring_cameras_.size() != ring_pitch_deg_.size())
      fail(ErrorKind::Config,
           "ring_cameras has {} numbers, ring_pitch_deg {}; each ring takes one of both",
           ring_cameras_.size(), ring_pitch_deg_.size());
    if (!ring_roll_deg_.empty() && ring_roll_deg_.size() != ring_cameras_.size())
      fail(ErrorKind::Config,
           "ring_roll_deg has {} numbers for {} rings; each takes one, or leave it out",
           ring_roll_deg_.size(), ring_cameras_.size());
  }

  std::unique_ptr<RigTemplate> clone() const override {
    return std::make_unique<CompoundEyeRig>(*this);
  }

  std::vector<CameraPlace> places() const override {
    std::vector<CameraPlace> places;
    const auto add = [&](double roll_deg, double pitch_deg) {
      places.push_back(
          {fmt::format("{}", places.size()), rig_from_eye_camera(roll_deg, pitch_deg, radius_mm_)});
    };
    for (std::size_t i = 0; i < roll_deg_.size(); ++i) add(roll_deg_[i], pitch_deg_[i]);
    for (std::size_t ring = 0; ring < ring_cameras_.size(); ++ring) {
      const double first_deg = ring_roll_deg_.empty() ? 0.0 : ring_roll_deg_[ring];
      const auto count = static_cast<double>(ring_cameras_[ring]);
      for (std::int64_t i = 0; i < ring_cameras_[ring]; ++i)
        add(first_deg + 360.0 * static_cast<double>(i) / count, ring_pitch_deg_[ring]);
    }
    return places;
  }

 private:
  double radius_mm_ = 170.0;
  std::vector<std::int64_t> ring_cameras_;
  std::vector<double> ring_pitch_deg_;
  std::vector<double> ring_roll_deg_;
  std::vector<double> roll_deg_;
  std::vector<double> pitch_deg_;
};

}  // namespace

RigTemplateInfo compound_eye_rig() {
  return {.name = "compound_eye",
          .summary = "Cameras in rings on a sphere, looking outwards: an artificial compound eye.",
          .make = [] { return std::unique_ptr<RigTemplate>(new CompoundEyeRig); }};
}

}  // namespace terracast::rigs
