#include "geo/paths/flight.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "geo/paths/above_ground.h"
#include "geo/paths/place.h"
#include "geo/units.h"

namespace terracast::geo {
namespace {

constexpr double kCheckSpacing_m = 5.0;

/// A path raised along world z by a spline of its parameter.
class RaisedPath final : public Path {
 public:
  RaisedPath(std::shared_ptr<const Path> base, UniformSpline rise_m)
      : base_(std::move(base)), rise_m_(std::move(rise_m)) {}

  PathPoint at(double u) const override {
    PathPoint point = base_->at(u);
    const UniformSpline::Value rise = rise_m_.at(u);
    point.position_world.z() += rise.value;
    point.first.z() += rise.first;
    point.second.z() += rise.second;
    point.third.z() += rise.third;
    return point;
  }
  double end() const override { return base_->end(); }
  bool is_closed() const override { return base_->is_closed(); }
  std::vector<double> joints() const override {
    std::vector<double> joints = base_->joints();
    for (std::size_t i = 1; i < rise_m_.num_intervals(); ++i)
      joints.push_back(static_cast<double>(i) * rise_m_.spacing());
    std::sort(joints.begin(), joints.end());
    const double least = 1e-9 * end();
    const auto is_same = [&](double a, double b) { return b - a < least; };
    joints.erase(std::unique(joints.begin(), joints.end(), is_same), joints.end());
    joints.back() = end();
    return joints;
  }

 private:
  std::shared_ptr<const Path> base_;
  UniformSpline rise_m_;
};

/// The path at one of the places where it is held against the ground.
struct Sample {
  double u;
  double length_m;
  Geodetic place;
  double agl_m;
  double climb_rad;
};

std::vector<Sample> sample_path(const Path& path, const ArcLength& arc_length,
                                const TrajectoryContext& context, double speed_mps) {
  const double total_m = arc_length.total_m();
  constexpr double kFewestSamples = 64.0;
  const auto count =
      static_cast<std::size_t>(std::max(std::ceil(total_m / kCheckSpacing_m), kFewestSamples));
  std::vector<Sample> samples;
  samples.reserve(count + 1);
  for (std::size_t i = 0; i <= count; ++i) {
    Sample sample{};
    sample.length_m = total_m * static_cast<double>(i) / static_cast<double>(count);
    sample.u = arc_length.parameter_at(sample.length_m);
    const PathPoint point = path.at(sample.u);
    sample.place = context.frame.geodetic_from_world(point.position_world);
    const Eigen::Vector3d up = context.frame.up_world(point.position_world);
    sample.climb_rad = std::asin(std::clamp(up.dot(point.first.normalized()), -1.0, 1.0));
    sample.agl_m = agl_on_path_m(sample.place, context, [&] {
      return fmt::format("after {:.0f} m, about t = {:.1f} s", sample.length_m,
                         sample.length_m / speed_mps);
    });
    samples.push_back(sample);
  }
  return samples;
}

/// The rise of a path, found by raising what is too low and smoothing upwards until nothing is.
class Raising {
 public:
  Raising(std::shared_ptr<const Path> base, double follow_length_m, Continuity continuity)
      : base_(std::move(base)),
        continuity_(continuity),
        needed_m_(
            static_cast<std::size_t>(std::max(std::ceil(base_->end() / kCheckSpacing_m), 4.0)) +
                (base_->is_closed() ? 0 : 1),
            0.0),
        reach_(std::max(1, static_cast<int>(std::ceil(follow_length_m / kCheckSpacing_m)))) {}

  /// Asks for `missing_m` more at u than the present rise gives.
  void add(double u, double missing_m) {
    const double present_m = rise_ ? rise_->at(u).value : 0.0;
    const std::size_t num_intervals = needed_m_.size() - (base_->is_closed() ? 0 : 1);
    const double spacing = base_->end() / static_cast<double>(num_intervals);
    const auto interval =
        std::min(static_cast<std::size_t>(std::max(u / spacing, 0.0)), num_intervals - 1);
    needed_m_[interval] = std::max(needed_m_[interval], present_m + missing_m);
  }

  // The spline at u lies within its controls a few knots before and after. Each is a mean over
  // `reach` knots of values widened by so many more, so none is less than what is needed at u.
  std::shared_ptr<const Path> raised() {
    const bool is_closed = base_->is_closed();
    const int more = UniformSpline::reach_of(continuity_);
    rise_.emplace(smoothed(widened(needed_m_, reach_ + more, is_closed), reach_, is_closed),
                  base_->end(), is_closed, continuity_);
    return std::make_shared<RaisedPath>(base_, *rise_);
  }

 private:
  std::shared_ptr<const Path> base_;
  Continuity continuity_;
  std::vector<double> needed_m_;
  int reach_;
  std::optional<UniformSpline> rise_;
};

const Sample& lowest(const std::vector<Sample>& samples) {
  return *std::min_element(samples.begin(), samples.end(),
                           [](const Sample& a, const Sample& b) { return a.agl_m < b.agl_m; });
}

std::vector<SpeedAt> speeds_along(const FlightPlan& plan, const ArcLength& arc_length,
                                  double speed_mps) {
  if (plan.speeds.empty()) return {{0.0, speed_mps}, {arc_length.total_m(), speed_mps}};
  std::vector<SpeedAt> speeds;
  for (const auto& at : plan.speeds) speeds.push_back({arc_length.length_at(at.u), at.speed_mps});
  return speeds;
}

}  // namespace

void AttitudeOptions::describe(core::SchemaVisitor& visit) {
  visit.key("bank", bank, "Roll of the body: as in a coordinated turn, or none.",
            core::one_of({"coordinated", "none"}));
  visit.key("max_bank_deg", max_bank_deg, "Greatest roll of a coordinated turn.",
            core::between(0.0, 80.0));
  visit.key("bank_smoothing_s", bank_smoothing_s, "Time over which the roll is averaged.",
            core::between(0.05, 60.0));
  visit.key("pitch", pitch, "The body's x axis: along the path, or its horizontal part.",
            core::one_of({"path", "level"}));
  visit.key("continuity", continuity,
            "Up to which derivative place and roll are continuous: second (jerk and angular "
            "acceleration jump where pieces of a path meet) or fourth, for inertial sensors.",
            core::one_of({"second", "fourth"}));
}

Attitude AttitudeOptions::attitude() const {
  Attitude attitude;
  attitude.nose = pitch == "level" ? Attitude::Nose::Level : Attitude::Nose::AlongPath;
  attitude.continuity = continuity_of_path();
  if (bank == "coordinated")
    attitude.bank = Attitude::Bank{radians_from_degrees(max_bank_deg), bank_smoothing_s};
  return attitude;
}

double AttitudeOptions::turn_radius_m(double speed_mps) const {
  constexpr double kShareOfBank = 0.8, kLeastBank_deg = 5.0, kUsualBank_deg = 30.0;
  const double bank_deg = bank == "none" ? kUsualBank_deg : std::max(max_bank_deg, kLeastBank_deg);
  return std::max(1.0,
                  speed_mps * speed_mps /
                      (kGravity_mps2 * std::tan(radians_from_degrees(kShareOfBank * bank_deg))));
}

void FlightOptions::describe(core::SchemaVisitor& visit) {
  visit.key("speed_mps", speed_mps, "Speed along the path.", core::between(0.01, 1000.0));
  AttitudeOptions::describe(visit);
  visit.key(
      "min_agl_m", min_agl_m,
      "Least height above the measured ground or water; a lower path is refused. Below 0: paths "
      "under water, so deep at most; they must keep above its bed.",
      core::between(-12000.0, 100000.0));
  visit.key("terrain_following", terrain_following,
            "Raise the path smoothly where it would be lower than min_agl_m.");
  visit.key("follow_length_m", follow_length_m,
            "Length on both sides over which a raised place is smoothed.",
            core::between(10.0, 20000.0));
  visit.key("max_climb_deg", max_climb_deg, "Steepest climb or descent; a steeper path is refused.",
            core::between(1.0, 80.0));
}

std::unique_ptr<Trajectory> fly(const FlightPlan& plan, const FlightOptions& options,
                                const TrajectoryContext& context) {
  TERRACAST_CHECK(context.ground_height_m, "trajectories are held against the ground");
  constexpr double kLongestPath_m = 2e6;
  std::shared_ptr<const Path> path = plan.path;
  ArcLength arc_length(path);
  if (!(arc_length.total_m() <= kLongestPath_m)) {
    core::fail(core::ErrorKind::Config, "the path is {:.0f} km long; at most {:.0f} km are flown",
               arc_length.total_m() / 1000.0, kLongestPath_m / 1000.0);
  }
  // There the velocity would have no direction.
  constexpr double kLeastStretch = 0.01;
  const ArcLength::Slowest& slowest = arc_length.slowest();
  if (slowest.metres_per_u < kLeastStretch * arc_length.total_m() / path->end()) {
    const Geodetic place = context.frame.geodetic_from_world(path->at(slowest.u).position_world);
    core::fail(core::ErrorKind::Config,
               "the path turns back on itself at {}; lead it round there, by a place to the side",
               text_of(place));
  }
  const auto sample = [&] { return sample_path(*path, arc_length, context, options.speed_mps); };
  std::vector<Sample> samples = sample();
  if (options.terrain_following && !context.is_on_surface) {
    // Places between the samples shift as the path rises, so what is raised is looked at again.
    constexpr int kMostRounds = 20;
    Raising raising(path, options.follow_length_m, plan.attitude.continuity);
    for (int round = 0; round < kMostRounds && lowest(samples).agl_m < options.min_agl_m; ++round) {
      for (const Sample& at : samples) {
        const double missing_m = options.min_agl_m - at.agl_m;
        if (missing_m > 0.0) raising.add(at.u, 1.001 * missing_m + 0.01);
      }
      path = raising.raised();
      arc_length = ArcLength(path);
      samples = sample();
    }
  }
  const std::vector<SpeedAt> speeds = speeds_along(plan, arc_length, options.speed_mps);
  const auto motion = [&] {
    return std::make_unique<PathMotion>(path, context.frame, speeds, plan.attitude, plan.laps);
  };
  if (context.is_on_surface) return motion();
  const auto time_of = [&](const Sample& at) {
    return SpeedProfile(speeds, plan.attitude.continuity).time_at(at.length_m);
  };
  const Sample& low = lowest(samples);
  if (low.agl_m < options.min_agl_m) {
    const bool can_follow = !options.terrain_following && !plan.how_to_follow.empty();
    refuse_too_low({low.agl_m, time_of(low), low.place}, options.min_agl_m,
                   plan.how_to_raise(low.u) + (can_follow ? ", or " + plan.how_to_follow : ""));
  }
  const Sample& steepest =
      *std::max_element(samples.begin(), samples.end(), [](const Sample& a, const Sample& b) {
        return std::abs(a.climb_rad) < std::abs(b.climb_rad);
      });
  if (std::abs(steepest.climb_rad) > radians_from_degrees(options.max_climb_deg)) {
    core::fail(
        core::ErrorKind::Input,
        "the path climbs or falls by {:.1f} deg at t = {:.1f} s ({}), more than max_climb_deg = "
        "{:.1f}; {}",
        degrees_from_radians(std::abs(steepest.climb_rad)), time_of(steepest),
        text_of(steepest.place), options.max_climb_deg,
        options.terrain_following ? "lengthen follow_length_m, or fly higher"
                                  : "give it more way, or less difference in height");
  }
  return motion();
}

}  // namespace terracast::geo
