#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <string_view>
#include <unordered_map>

#include "core/instance_id.h"
#include "validate/checks/checker.h"
#include "validate/checks/contradictions.h"
#include "validate/checks/motion_agreement.h"

/// What dataset.json and moving.csv say of things that move: that parts go with their things, that velocities,
/// accelerations and turn rates are those of the places, and that masks show bodies within their boxes, of their
/// classes and numbers.
namespace terracast::validate {

namespace {

/// Of places and velocities of doubles, over what is added up of them.
constexpr double kRigidRounding = 1e-6;

StatedMotion stated_motion(const MovingState& state) {
  const Eigen::Matrix3d& rotation = state.local_from_body.rotation;
  return {state.local_from_body, rotation * state.motion.velocity_mps,
          rotation * state.motion.acceleration_mps2, state.motion.turn_radps};
}

/// Of each body the one before it, from 1, that it is a part of; 0: of none that is there.
std::vector<int> owners_of(const Moving& moving) {
  std::vector<int> owners(moving.bodies.size(), 0);
  std::unordered_map<std::string_view, int> things;
  for (std::size_t i = 0; i < owners.size(); ++i) {
    const std::string& part_of = moving.bodies[i].part_of;
    if (part_of.empty())
      things.emplace(moving.names[i], static_cast<int>(i) + 1);
    else if (const auto thing = things.find(part_of); thing != things.end())
      owners[i] = thing->second;
  }
  return owners;
}

/// The directions in which a thing accelerates, as columns, if it may ride the ground: by what is said of its motion
/// alone, no acceleration has a part along a direction near the vertical. Up is that of the world, which is known to a
/// degree. What flies level is so too.
///
/// Vertical velocities and turn rates of what rides are differences over 0.1 s, and it is said not to accelerate up or
/// down: between the kinks of the ground that is not how its places move.
/// returns   nothing where it does accelerate up or down
std::optional<Eigen::MatrixXd> directions_of_rider(
    const std::vector<std::optional<StatedMotion>>& motions) {
  constexpr double kNone = 1e-10;          // of accelerations
  constexpr double kNearVertical = 0.999;  // cosine of 2.6 degrees
  std::vector<const StatedMotion*> stated;
  for (const auto& motion : motions)
    if (motion) stated.push_back(&*motion);
  if (stated.empty()) return std::nullopt;
  Eigen::MatrixX3d accelerations(static_cast<Eigen::Index>(stated.size()), 3);
  for (std::size_t i = 0; i < stated.size(); ++i)
    accelerations.row(static_cast<Eigen::Index>(i)) = stated[i]->acceleration_mps2;
  const Eigen::JacobiSVD<Eigen::MatrixX3d> parts(accelerations, Eigen::ComputeFullV);
  const double least =
      kNone * (std::sqrt(static_cast<double>(stated.size())) + parts.singularValues()[0]);
  Eigen::MatrixXd directions(3, 0);
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  for (Eigen::Index k = 0; k < parts.singularValues().size(); ++k) {
    if (parts.singularValues()[k] <= least) continue;
    directions.conservativeResize(Eigen::NoChange, directions.cols() + 1);
    directions.rightCols<1>() = parts.matrixV().col(k);
    // This leaves the part of up that is orthogonal to all of them.
    up -= parts.matrixV().col(k).z() * parts.matrixV().col(k);
  }
  if (up.norm() <= kNearVertical) return std::nullopt;
  return directions;
}

/// The part of a motion along some directions, given as orthonormal columns.
std::vector<std::optional<StatedMotion>> along(std::vector<std::optional<StatedMotion>> motions,
                                               const Eigen::MatrixXd& directions) {
  const Eigen::Matrix3d part = directions * directions.transpose();
  for (auto& motion : motions)
    if (motion) {
      motion->local_from_body.translation = part * motion->local_from_body.translation;
      motion->velocity_mps = part * motion->velocity_mps;
      motion->acceleration_mps2 = part * motion->acceleration_mps2;
    }
  return motions;
}

/// Numbers, names, models and classes of parts are their things', and things are numbered in their order.
void compare_names(const Moving& moving, const std::vector<int>& owners,
                   FileContradictions& found) {
  std::int64_t next_id = core::kFirstMovingId;
  for (std::size_t i = 0; i < moving.bodies.size(); ++i) {
    const MovingBody& body = moving.bodies[i];
    if (body.instance_id < 0) continue;
    if (body.part_of.empty()) {
      found.expect(body.instance_id == next_id++, "dataset.json: body {} has the instance_id {}",
                   moving.names[i], body.instance_id);
      continue;
    }
    const int owner = owners[i];
    found.expect(owner > 0 && moving.names[i].starts_with(body.part_of + "-"),
                 "dataset.json: body {} is no part of {}", moving.names[i], body.part_of);
    if (owner == 0) continue;
    const MovingBody& thing = moving.bodies[static_cast<std::size_t>(owner - 1)];
    found.expect(body.thing == thing.thing && body.class_name == thing.class_name &&
                     body.instance_id == thing.instance_id,
                 "dataset.json: thing, class or instance_id of {} are not those of {}",
                 moving.names[i], body.part_of);
  }
}

/// A part turns about a place that stands still in its thing, about an axis that does so too; it moves with that place.
void compare_part(const Moving& moving, std::size_t part, int owner, FileContradictions& found) {
  std::optional<Eigen::Vector3d> first_place, first_axis;
  for (std::size_t frame = 0; frame < moving.states.size(); ++frame) {
    const MovingState* of_part = moving.state(static_cast<int>(frame), static_cast<int>(part) + 1);
    const MovingState* of_thing = moving.state(static_cast<int>(frame), owner);
    if (of_part == nullptr || of_thing == nullptr) {
      found.expect(of_part == of_thing, "moving.csv: frame {} has one of {} and {} alone", frame,
                   moving.names[part], moving.bodies[part].part_of);
      continue;
    }
    const Pose thing_from_part = of_thing->local_from_body.inverse() * of_part->local_from_body;
    const Eigen::Vector3d& place = thing_from_part.translation;
    if (!first_place) first_place = place;
    found.expect((place - *first_place).norm() <= kRigidRounding * (1.0 + place.norm()),
                 "moving.csv: {} stands elsewhere on its thing at frame {} than before",
                 moving.names[part], frame);
    const BodyMotion& thing = of_thing->motion;
    const Eigen::Matrix3d& turn = thing_from_part.rotation;
    const Eigen::Vector3d velocity = thing.velocity_mps + thing.turn_radps.cross(place);
    found.expect((turn * of_part->motion.velocity_mps - velocity).norm() <=
                     kRigidRounding * (1.0 + velocity.norm()),
                 "moving.csv: {} does not move with its place on its thing at frame {}",
                 moving.names[part], frame);
    const Eigen::Vector3d own = turn * of_part->motion.turn_radps - thing.turn_radps;
    if (own.norm() <= kRigidRounding) continue;
    if (!first_axis) first_axis = own.normalized();
    found.expect(own.normalized().cross(*first_axis).norm() <= kRigidRounding,
                 "moving.csv: {} turns about another axis at frame {} than before",
                 moving.names[part], frame);
  }
}

class MovingBodiesChecker : public Checker {
 public:
  void frame(const FrameWindow& window, const std::vector<ViewPair>&) override {
    const Sequence& sequence = window.sequence();
    if (!sequence.moving || sequence.moving->bodies.empty()) return;
    for (std::size_t i = 0; i < sequence.cameras.size(); ++i)
      if (const auto view = window.view(static_cast<int>(i), window.frame()))
        compare_image(*sequence.moving, *view);
  }

  std::vector<CheckResult> finish(const Dataset&, const Sequence& sequence) override {
    constexpr const char* kName = "moving_bodies";
    if (!sequence.moving || sequence.moving->bodies.empty())
      return {skipped_result(kName, "nothing moves")};
    const Moving& moving = *sequence.moving;
    const std::vector<int> owners = owners_of(moving);
    compare_names(moving, owners, found_);
    for (std::size_t i = 0; i < owners.size(); ++i)
      if (owners[i] > 0) compare_part(moving, i, owners[i], found_);
    CheckResult result = found_.result(kName);
    result.summary = fmt::format(
        "Names and numbers of {} bodies, parts against their things, and {} pixels of masks "
        "against boxes, classes and instances.",
        moving.bodies.size(), num_pixels_);
    result.reason = "Poses and motions are doubles; parts are mounted on their things.";
    result.detects =
        "a part that stands beside its place by 2 micrometres; a box that what is seen sticks out "
        "of; another class";
    std::vector<CheckResult> results = motions(moving, 1.0 / sequence.rate_hz);
    results.insert(results.begin(), std::move(result));
    return results;
  }

 private:
  void compare_image(const Moving& moving, const View& view) {
    const core::Image16& bodies = view.image->moving;
    for (int y = 0; y < bodies.height(); ++y)
      for (int x = 0; x < bodies.width(); ++x)
        if (bodies(x, y) != 0) compare_pixel(moving, view, x, y, bodies(x, y));
  }

  void compare_pixel(const Moving& moving, const View& view, int x, int y, int number) {
    const MovingState* state = moving.state(view.frame, number);
    if (state == nullptr) return;  // `structure` tells of it
    ++num_pixels_;
    const MovingBody& body = moving.bodies[static_cast<std::size_t>(number - 1)];
    const std::string& name = moving.names[static_cast<std::size_t>(number - 1)];
    const LoadedImage& image = *view.image;
    if (!image.instances.empty() && body.instance_id >= 0)
      found_.expect(image.instances(x, y) == body.instance_id, [&] {
        return fmt::format("{}: instance {}, where {} is", place_of(view, x, y),
                           image.instances(x, y), name);
      });
    if (!image.segmentation.empty() && !body.class_name.empty()) {
      const auto known = view.sequence->classes.find(image.segmentation(x, y));
      found_.expect(known != view.sequence->classes.end() && known->second == body.class_name, [&] {
        return fmt::format("{}: another class than {}, where {} is", place_of(view, x, y),
                           body.class_name, name);
      });
    }
    const auto depth_m =
        static_cast<double>(image.moving_depth.empty() ? NAN : image.moving_depth(x, y));
    if (view.lines || body.box_m.isEmpty() || !std::isfinite(depth_m)) return;
    const Eigen::Vector3d point_camera =
        view.camera->intrinsics.point_from_pixel({x + 0.5, y + 0.5}, depth_m);
    const Eigen::Vector3d point_body =
        state->local_from_body.inverse() * (view.local_from_camera * point_camera);
    // Float32 of the distance, and the decimals of the formats' poses.
    const double allowed_m = 1e-3 + 1e-6 * depth_m;
    const double out_m = body.box_m.exteriorDistance(point_body);
    found_.expect(out_m <= allowed_m, [&] {
      return fmt::format("{}: {} sticks out of its box by {:.3g} m", place_of(view, x, y), name,
                         out_m);
    });
  }

  /// Whether a body turns by less than half a turn from frame to frame: else its attitudes do not tell how fast.
  static bool is_slow_turn(const std::vector<std::optional<StatedMotion>>& body, double step_s) {
    return std::all_of(body.begin(), body.end(), [&](const auto& motion) {
      return !motion || motion->turn_body_radps.norm() * step_s < kPi;
    });
  }

  /// Of each quantity the worst thing's of those whose motion is exact; parts are held against their things.
  static std::vector<CheckResult> motions(const Moving& moving, double step_s) {
    const char* const kHalf = "Half the smallest error that must be found.";
    std::vector<CheckResult> worst;
    int num_riding = 0;
    for (std::size_t i = 0; i < moving.bodies.size(); ++i) {
      if (!moving.bodies[i].part_of.empty()) continue;
      std::vector<std::optional<StatedMotion>> body(moving.states.size());
      for (std::size_t frame = 0; frame < body.size(); ++frame)
        if (const MovingState* state =
                moving.state(static_cast<int>(frame), static_cast<int>(i) + 1))
          body[frame] = stated_motion(*state);
      const std::optional<Eigen::MatrixXd> directions = directions_of_rider(body);
      if (directions) {
        ++num_riding;
        if (directions->cols() == 0) continue;
        body = along(std::move(body), *directions);
      }
      const std::vector<CheckResult> own = {
          motion_result(body, step_s, kVelocity, 0.01 * typical_speed_mps(body),
                        {"moving_velocity", 0.05, "%",
                         "Steps between bodies' places against the mean of moving.csv's "
                         "velocities, by the speed; the worst body.",
                         kHalf, "0.1 % of velocity; velocities in the world's axes"}),
          motion_result(body, step_s, kAcceleration, 1.0,
                        {"moving_acceleration", 0.05, "m/s^2",
                         "Changes of velocity between frames against the mean of their "
                         "accelerations; the worst body.",
                         kHalf, "0.1 m/s^2"}),
          directions ? unseen_result("moving_turn_rate", moving.names[i] + " may ride the ground")
          : !is_slow_turn(body, step_s)
              ? unseen_result("moving_turn_rate", moving.names[i] + " turns too fast to tell")
              : motion_result(
                    body, step_s, kTurnRate, radians_from_degrees(1.0),
                    {"moving_turn_rate", 0.05, "deg/s",
                     "Turns between bodies' attitudes against the mean of their turn rates; "
                     "the worst body.",
                     kHalf, "0.1 deg/s; a sign"})};
      if (worst.empty()) worst = own;
      for (std::size_t k = 0; k < own.size(); ++k)
        if ((worst[k].skipped && !own[k].skipped) ||
            (!own[k].skipped && own[k].value > worst[k].value)) {
          worst[k] = own[k];
          worst[k].worst = moving.names[i] + ": " + worst[k].worst;
        }
    }
    if (worst.empty())
      for (const char* name : {"moving_velocity", "moving_acceleration", "moving_turn_rate"})
        worst.push_back(unseen_result(
            name, num_riding > 0
                      ? "all that moves rides the ground, or goes level, and at one speed straight "
                        "on: vertical velocities and turn rates of what rides are means over 0.1 s"
                      : "nothing moves but parts of what is not there"));
    else if (num_riding > 0)
      for (CheckResult& result : worst)
        result.summary +=
            result.name == "moving_turn_rate"
                ? fmt::format(" {} that ride the ground, or go level, are left out.", num_riding)
                : fmt::format(
                      " Of {} that ride the ground, or go level, only the directions in "
                      "which they accelerate count.",
                      num_riding);
    return worst;
  }

  FileContradictions found_;
  std::int64_t num_pixels_ = 0;
};

}  // namespace

std::unique_ptr<Checker> make_moving_bodies_check(const ValidateOptions&) {
  return std::make_unique<MovingBodiesChecker>();
}

}  // namespace terracast::validate
