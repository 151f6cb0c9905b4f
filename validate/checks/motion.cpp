#include "validate/body_pose.h"
#include "validate/checks/checker.h"
#include "validate/checks/motion_agreement.h"

/// motion.csv: what it says of the body's velocity, acceleration and turn at each frame's time, against the
/// differences of its poses. Where lines are between the frames' times follows from it.
namespace terracast::validate {

namespace {

/// The body of each frame, by the first camera that has a pose there.
std::vector<std::optional<StatedMotion>> motions_of(const Sequence& sequence) {
  std::vector<std::optional<StatedMotion>> motions(sequence.motion.size());
  for (std::size_t i = 0; i < motions.size(); ++i) {
    const std::optional<Pose> body = local_from_body(sequence, i);
    if (!sequence.motion[i] || !body) continue;
    const BodyMotion& row = *sequence.motion[i];
    motions[i] = StatedMotion{*body, body->rotation * row.velocity_mps,
                              body->rotation * row.acceleration_mps2, row.turn_radps};
  }
  return motions;
}

class MotionChecker : public Checker {
 public:
  std::vector<CheckResult> finish(const Dataset&, const Sequence& sequence) override {
    if (sequence.motion.empty())
      return {skipped_result("motion", "no rolling shutter, of whose lines motion.csv would tell")};
    const std::vector<std::optional<StatedMotion>> motions = motions_of(sequence);
    const double step_s = 1.0 / sequence.rate_hz;
    const char* const kHalf = "Half the smallest error that must be found.";
    return {
        motion_result(
            motions, step_s, kVelocity, 0.01 * typical_speed_mps(motions),
            {"motion_velocity", 0.05, "%",
             "Steps between the body's places against the mean of motion.csv's velocities, by the "
             "speed.",
             kHalf, "0.1 % of velocity; velocities in the world's axes, or of another frame"}),
        motion_result(
            motions, step_s, kAcceleration, 1.0,
            {"motion_acceleration", 0.05, "m/s^2",
             "Changes of velocity between frames against the mean of their accelerations.", kHalf,
             "0.1 m/s^2; forces with gravity in them"}),
        motion_result(motions, step_s, kTurnRate, radians_from_degrees(1.0),
                      {"motion_turn_rate", 0.05, "deg/s",
                       "Turns between the body's attitudes against the mean of their turn rates.",
                       kHalf, "0.1 deg/s; rates in the world's axes; a sign"})};
  }
};

}  // namespace

std::unique_ptr<Checker> make_motion_check(const ValidateOptions&) {
  return std::make_unique<MotionChecker>();
}

}  // namespace terracast::validate
