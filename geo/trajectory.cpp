#include "geo/trajectory.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "core/registry.h"
#include "geo/sun.h"

// Every kind of trajectory, in alphabetical order: X(name) is geo/trajectories/name.cpp, which
// defines `TrajectoryKindInfo name_trajectory()`.
#define TERRACAST_TRAJECTORY_KINDS(X)                                                    \
  X(corridor)                                                                            \
  X(explore)                                                                             \
  X(facade) X(fixed_wing) X(forward) X(loop) X(orbit) X(quadrotor) X(recorded) X(survey) \
      X(waypoints)

namespace terracast::geo {

#define TERRACAST_DECLARE(name) TrajectoryKindInfo name##_trajectory();
TERRACAST_TRAJECTORY_KINDS(TERRACAST_DECLARE)
#undef TERRACAST_DECLARE

namespace {

const std::string kAutomatic = "auto";

std::string utc_of_first_frame(const TrajectoryOptions& options, const Trajectory& motion) {
  if (options.utc_start != kAutomatic) return options.utc_start;
  if (const std::optional<double> start = motion.utc_start_unix_s())
    return utc_from_unix_seconds(*start + options.start_s);
  return "2025-06-21T10:00:00Z";
}

}  // namespace

std::vector<double> sorted_knots(std::vector<double> knots_s) {
  std::sort(knots_s.begin(), knots_s.end());
  knots_s.erase(std::unique(knots_s.begin(), knots_s.end()), knots_s.end());
  return knots_s;
}

std::span<const TrajectoryKindInfo> trajectory_kinds() {
#define TERRACAST_ENTRY(name) name##_trajectory(),
  static const std::array table = {TERRACAST_TRAJECTORY_KINDS(TERRACAST_ENTRY)};
#undef TERRACAST_ENTRY
  return table;
}

void MotionOptions::describe_kind(core::SchemaVisitor& visit) {
  visit.key("kind", kind, "Kind of motion; it decides the keys below.",
            core::required(core::one_of(core::registry_names(trajectory_kinds()))));
}

void MotionOptions::describe_keys(core::SchemaVisitor& visit) {
  // A manual without a config shows the keys of the commonest kind.
  kind_options_.describe(visit, trajectory_kinds(), "kind of trajectory",
                         kind.empty() ? "waypoints" : kind);
}

void TrajectoryOptions::describe(core::SchemaVisitor& visit) {
  constexpr double kMostFrames = 1e7;
  visit.key("name", name, "Name of the sequence and of its folder.");
  describe_kind(visit);
  visit.key("rate_hz", rate_hz, "Frames a second.", core::between(0.001, 100000.0));
  visit.key("num_frames", num_frames, "Number of frames; 0: as many as the motion holds.",
            core::between(0.0, kMostFrames));
  visit.key("start_s", start_s, "Time of the first frame on the motion.", core::at_least(0.0));
  visit.key("utc_start", utc_start,
            "UTC of the first frame; the sun stands accordingly. auto: a recording's own time of "
            "day, or 2025-06-21T10:00:00Z.");
  visit.key(
      "shown_as", shown_as,
      "The thing as which the body is seen from the cameras of the other trajectories, at the same "
      "time after their first frame, such as quadcopter (`terracast list things`); empty: it is "
      "not.");
  visit.key("rigs", rigs,
            "Names of the [[rigs]] that the body carries; none named, or an empty list: all.",
            {.min_size = 1});
  describe_keys(visit);
}

void TrajectoryOptions::validate() const {
  const auto is_plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-';
  };
  if (name.empty() || !std::all_of(name.begin(), name.end(), is_plain)) {
    core::fail(core::ErrorKind::Config,
               "name = \"{}\" is no name for a sequence's folder; use letters, digits, _ and -",
               name);
  }
  if (utc_start != kAutomatic) unix_seconds_from_utc(utc_start);
  if (has_kind_options()) kind_options().validate();
}

std::vector<std::unique_ptr<TrajectoryKind>> TrajectoryKind::split(const TrajectoryContext&,
                                                                   double) const {
  return {};
}

std::vector<TrajectoryOptions> split_sequences(const TrajectoryOptions& options,
                                               const TrajectoryContext& context) {
  if (!options.kind_options().is_split()) return {options};
  return core::with_context(
      [&] {
        TrajectoryContext at_rate = context;
        at_rate.rate_hz = options.rate_hz;
        const double num_steps = std::max<double>(static_cast<double>(options.num_frames), 2.0) - 1;
        const double least_s = options.start_s + num_steps / options.rate_hz;
        std::vector<TrajectoryOptions> sequences;
        for (auto& part : options.kind_options().split(at_rate, least_s)) {
          sequences.push_back(options);
          sequences.back().split_from = options.name;
          sequences.back().name = fmt::format("{}_{}", options.name, sequences.size() - 1);
          sequences.back().set_kind_options(std::move(part));
        }
        if (sequences.empty())
          core::fail(core::ErrorKind::Input,
                     "no part of it lasts {:.3f} s, the time of its frames at {} Hz from {} s on",
                     least_s, options.rate_hz, options.start_s);
        return sequences;
      },
      "splitting trajectory " + options.name);
}

MotionState BodyMotion::at(double time_s) const {
  MotionState state = trajectory->at(start_s + time_s);
  state.time_s = time_s;
  return state;
}

SampledFrames sample_frames(const TrajectoryOptions& options, const TrajectoryContext& context) {
  return core::with_context(
      [&] {
        TrajectoryContext at_rate = context;
        at_rate.rate_hz = options.rate_hz;
        const std::shared_ptr<const Trajectory> motion = options.kind_options().build(at_rate);
        // A frame at the very end counts although the sum of times rounds past it.
        constexpr double kTimeTolerance_s = 1e-9;
        const double available_s = motion->duration_s() + kTimeTolerance_s - options.start_s;
        const double num_fitting =
            available_s < 0.0 ? 0.0 : std::floor(available_s * options.rate_hz) + 1.0;
        constexpr double kMostFrames = 1e7;
        const double wanted =
            options.num_frames > 0 ? static_cast<double>(options.num_frames) : num_fitting;
        if (wanted > num_fitting || wanted > kMostFrames || wanted < 1.0) {
          core::fail(
              core::ErrorKind::Config,
              "{:.0f} frames at {} Hz from {} s on are asked for; the motion lasts {:.3f} s, "
              "which holds {:.0f} (at most {:.0f} are taken)",
              wanted, options.rate_hz, options.start_s, motion->duration_s(), num_fitting,
              kMostFrames);
        }
        std::vector<BodyState> states(static_cast<std::size_t>(wanted));
        for (std::size_t i = 0; i < states.size(); ++i) {
          const double time_s = static_cast<double>(i) / options.rate_hz;
          const double on_motion_s = std::min(options.start_s + time_s, motion->duration_s());
          states[i] = motion->at(on_motion_s);
          states[i].time_s = time_s;
          if (context.reach_s > 0.0)
            states[i].terms = fit_terms(
                states[i],
                [&](double offset_s) { return motion->at(on_motion_s + offset_s).world_from_body; },
                context.reach_s);
        }
        return SampledFrames{.states = std::move(states),
                             .motion = {.trajectory = motion, .start_s = options.start_s},
                             .utc_start = utc_of_first_frame(options, *motion)};
      },
      "flying trajectory " + options.name);
}

}  // namespace terracast::geo
