#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "geo/fixes/recording.h"
#include "geo/paths/flight.h"
#include "geo/paths/recorded_motion.h"
#include "geo/trajectory.h"
#include "geo/units.h"

namespace terracast::geo {
namespace {

using core::ErrorKind;
using core::fail;

/// A part of the recording as it is held against the ground.
struct Sample {
  double time_s;  ///< on the part's spline
  Geodetic place;
  std::optional<double> agl_m;  ///< nothing: outside the world
};

/// A stretch of a part that could be flown, and what speaks against it.
struct Stretch {
  std::size_t part;
  double begin_s, end_s;
  std::optional<Sample> outside;  ///< the first place outside the world
  std::optional<Sample> lowest;   ///< of those that are too low
  double duration_s() const { return end_s - begin_s; }
};

std::vector<Sample> sample_part(const SmoothPart& part, const Flattened& flattened,
                                const TrajectoryContext& context) {
  constexpr double kSpacing_m = 5.0, kMostSpacing_s = 1.0;
  constexpr std::size_t kMostSamples = 4000000;
  std::vector<Sample> samples;
  for (double time_s = part.begin_s;;) {
    const PointMotion motion = point_motion_at(*part.position, flattened, time_s);
    Sample sample{.time_s = time_s,
                  .place = context.frame.geodetic_from_world(motion.position),
                  .agl_m = std::nullopt};
    const auto ground_m = context.ground_height_m(sample.place.lat_deg, sample.place.lon_deg);
    if (ground_m && std::isfinite(*ground_m) && context.is_inside(motion.position))
      sample.agl_m = sample.place.height_m - *ground_m;
    samples.push_back(sample);
    if (time_s >= part.end_s) return samples;
    if (samples.size() >= kMostSamples)
      fail(ErrorKind::Input,
           "a part of the recording is longer than {:.0f} km or takes longer than {} s; set "
           "max_gap_s lower, or cut the file",
           kMostSamples * kSpacing_m / 1000.0, kMostSamples);
    const double speed_mps = std::max(motion.velocity.norm(), kSpacing_m / kMostSpacing_s);
    time_s = std::min(time_s + kSpacing_m / speed_mps, part.end_s);
  }
}

/// What to say of a place outside the world that would be inside with its numbers exchanged.
std::string exchange_hint(const Geodetic& place, const TrajectoryContext& context) {
  if (std::abs(place.lon_deg) > 90.0) return "";
  const Eigen::Vector3d exchanged_world =
      context.frame.world_from_geodetic({place.lon_deg, place.lat_deg, place.height_m});
  if (!context.is_inside(exchanged_world) ||
      exchanged_world.norm() > context.frame.world_from_geodetic(place).norm())
    return "";
  return "; with latitude and longitude exchanged it would be inside: check their order";
}

/// The same of a place in radians that was read as degrees.
std::string radian_hint(const Geodetic& place, const TrajectoryContext& context) {
  const double lat_deg = degrees_from_radians(place.lat_deg),
               lon_deg = degrees_from_radians(place.lon_deg);
  if (std::abs(lat_deg) > 90.0 || std::abs(lon_deg) > 180.0) return "";
  if (!context.is_inside(context.frame.world_from_geodetic({lat_deg, lon_deg, place.height_m})) ||
      !context.ground_height_m(lat_deg, lon_deg))
    return "";
  return "; in radians it would be inside: angle_unit = \"rad\" reads those of csv and srt";
}

std::string hint_outside(const Geodetic& place, const TrajectoryContext& context) {
  const std::string exchange = exchange_hint(place, context);
  return exchange.empty() ? radian_hint(place, context) : exchange;
}

/// What the smooth motion asks of a vehicle at most, at its knots and halfway between, and how densely it was recorded:
/// where noise was not smoothed away, it shows here first.
std::string text_of_peaks(const RecordedMotion& motion) {
  constexpr std::size_t kMostKnots = 200000;
  const std::vector<double> knots_s = motion.knots_s();
  const std::size_t stride = 1 + knots_s.size() / kMostKnots;
  double most_mps2 = 0.0, most_mps2_s = 0.0, most_radps = 0.0, most_radps_s = 0.0;
  const auto look_at = [&](double time_s) {
    const MotionState state = motion.at(time_s);
    if (const double a = state.acceleration_world_mps2.norm(); a > most_mps2)
      most_mps2 = a, most_mps2_s = time_s;
    if (const double w = state.angular_velocity_body_radps.norm(); w > most_radps)
      most_radps = w, most_radps_s = time_s;
  };
  for (std::size_t i = 0; i < knots_s.size(); i += stride) {
    look_at(knots_s[i]);
    if (i + 1 < knots_s.size()) look_at(0.5 * (knots_s[i] + knots_s[i + 1]));
  }
  const RecordedRates rates = motion.recorded_rates();
  return fmt::format(
      "{:.4g} fixes a second{}; the smooth motion accelerates by up to {:.3g} m/s^2 (at t = {:.1f} "
      "s) and turns by up to {:.3g} deg/s (at t = {:.1f} s)",
      rates.fixes_hz,
      rates.attitudes_hz ? fmt::format(", {:.4g} attitudes a second", *rates.attitudes_hz) : "",
      most_mps2, most_mps2_s, degrees_from_radians(most_radps), most_radps_s);
}

class Recorded final : public TrajectoryKind {
 public:
  void describe(core::SchemaVisitor& visit) override {
    recording_.describe(visit);
    visit.key(
        "part", part_,
        "Which part is flown, counted from 0, where gaps or `clip` split the recording; -1: the "
        "longest.",
        core::between(-1.0, 1e6));
    visit.key("split", split_,
              "Whether each part becomes a sequence of its own, NAME_0, NAME_1, …; `part` is left "
              "out then.");
    visit.key(
        "outside", outside_,
        "Where the recording leaves the world: clip takes the parts inside, error refuses it.",
        core::one_of({"error", "clip"}));
    visit.key("min_agl_m", min_agl_m_, "Least height above the measured ground.",
              core::between(0.0, 100000.0));
    visit.key("too_low", too_low_,
              "Where it is lower than that (taxiing, landing): clip takes the parts above, error "
              "refuses it.",
              core::one_of({"error", "clip"}));
    attitude_.describe(visit);
    visit.key(
        "slow_mps", slow_mps_,
        "Below this horizontal speed a body whose attitude follows its path keeps the heading of "
        "the faster times before and after, and its nose level.",
        core::between(0.01, 100.0));
  }

  void validate() const override {
    recording_.validate();
    if (split_ && part_ >= 0)
      fail(ErrorKind::Config,
           "part = {} takes one part, and split = true takes them all; leave one of them out",
           part_);
  }

  std::unique_ptr<TrajectoryKind> clone() const override {
    return std::make_unique<Recorded>(*this);
  }

  std::unique_ptr<Trajectory> build(const TrajectoryContext& context) const override {
    validate();
    const Recording recording = read_recording(recording_, context, attitude_.continuity_of_path());
    const std::vector<Stretch> stretches = stretches_of(recording, context);
    const std::size_t chosen = choose(stretches);
    if (context.log && !is_told_)
      tell_of_file(recording.facts, recording_.file.written, *context.log);
    if (context.log) tell(recording, stretches, chosen, *context.log);
    const Stretch& stretch = stretches[chosen];
    refuse_if_unfit(stretch, context);
    const SmoothPart& part = recording.parts[stretch.part];
    const RecordedMotion::Window window{stretch.begin_s, stretch.end_s};
    Attitude attitude = attitude_.attitude();
    attitude.slow_mps = slow_mps_;
    auto motion = part.rotation
                      ? std::make_unique<RecordedMotion>(context.frame, *part.position, window,
                                                         recording.zero_unix_s, *part.rotation)
                      : std::make_unique<RecordedMotion>(context.frame, *part.position, window,
                                                         recording.zero_unix_s, attitude);
    if (context.log) context.log->info("{}", text_of_peaks(*motion));
    return motion;
  }

  bool is_split() const override { return split_; }

  std::vector<std::unique_ptr<TrajectoryKind>> split(const TrajectoryContext& context,
                                                     double least_duration_s) const override {
    validate();
    const Recording recording = read_recording(recording_, context, attitude_.continuity_of_path());
    const std::vector<Stretch> stretches = stretches_of(recording, context);
    if (context.log) tell_of_file(recording.facts, recording_.file.written, *context.log);
    std::vector<std::unique_ptr<TrajectoryKind>> kinds;
    for (std::size_t i = 0; i < stretches.size(); ++i) {
      if (stretches[i].duration_s() < least_duration_s) continue;
      auto kind = std::make_unique<Recorded>(*this);
      kind->split_ = false;
      kind->is_told_ = true;
      kind->part_ = static_cast<std::int64_t>(i);
      kinds.push_back(std::move(kind));
    }
    if (context.log)
      context.log->info(
          "{} of {} parts ({}) last the {:.1f} s that the frames take and become "
          "sequences",
          kinds.size(), stretches.size(), list_of(stretches), least_duration_s);
    return kinds;
  }

 private:
  /// What could be flown of a recording; at least one.
  std::vector<Stretch> stretches_of(const Recording& recording,
                                    const TrajectoryContext& context) const {
    TERRACAST_CHECK(context.ground_height_m, "trajectories are held against the ground");
    const Flattened flattened(context.frame.origin());
    std::vector<Stretch> stretches;
    for (std::size_t i = 0; i < recording.parts.size(); ++i)
      add_stretches(i, sample_part(recording.parts[i], flattened, context), context.is_on_surface,
                    stretches);
    if (stretches.empty()) {
      const Geodetic first = sample_part(recording.parts[0], flattened, context)[0].place;
      std::string hint;  // the flight may begin outside
      for (const auto& part : recording.parts)
        for (const Sample& sample : sample_part(part, flattened, context))
          if (hint.empty()) hint = hint_outside(sample.place, context);
      fail(ErrorKind::Input,
           "{}: no part of the recording is inside the world and {} m above ground; it begins at "
           "{}{}",
           recording_.file.resolved.string(), min_agl_m_, text_of(first), hint);
    }
    return stretches;
  }

  /// Cuts a part where clipping asks for it; elsewhere what is unfit is noted.
  /// is_on_surface   how high it is does not matter
  void add_stretches(std::size_t part, const std::vector<Sample>& samples, bool is_on_surface,
                     std::vector<Stretch>& stretches) const {
    // A flight at just the least height is one.
    constexpr double kAglTolerance_m = 0.01;
    bool is_open = false;
    for (const Sample& sample : samples) {
      const bool is_outside = !sample.agl_m;
      const bool is_low =
          !is_outside && !is_on_surface && *sample.agl_m < min_agl_m_ - kAglTolerance_m;
      if ((is_outside && outside_ == "clip") || (is_low && too_low_ == "clip")) {
        is_open = false;
        continue;
      }
      if (!is_open) stretches.push_back({part, sample.time_s, sample.time_s, {}, {}});
      is_open = true;
      Stretch& stretch = stretches.back();
      stretch.end_s = sample.time_s;
      if (is_outside && !stretch.outside) stretch.outside = sample;
      if (is_low && (!stretch.lowest || *sample.agl_m < *stretch.lowest->agl_m))
        stretch.lowest = sample;
    }
    std::erase_if(stretches, [](const Stretch& stretch) { return stretch.duration_s() == 0.0; });
  }

  std::size_t choose(const std::vector<Stretch>& stretches) const {
    if (part_ >= 0) {
      if (static_cast<std::size_t>(part_) >= stretches.size())
        fail(ErrorKind::Config, "part = {}; the recording has {}: {}", part_, stretches.size(),
             list_of(stretches));
      return static_cast<std::size_t>(part_);
    }
    return static_cast<std::size_t>(std::max_element(stretches.begin(), stretches.end(),
                                                     [](const Stretch& a, const Stretch& b) {
                                                       return a.duration_s() < b.duration_s();
                                                     }) -
                                    stretches.begin());
  }

  void refuse_if_unfit(const Stretch& stretch, const TrajectoryContext& context) const {
    if (stretch.outside) {
      const std::string hint = hint_outside(stretch.outside->place, context);
      fail(ErrorKind::Input, "the recording leaves the world's ground at t = {:.1f} s ({}){}",
           stretch.outside->time_s - stretch.begin_s, text_of(stretch.outside->place),
           hint.empty() ? "; outside = \"clip\" takes the parts inside" : hint);
    }
    if (!stretch.lowest) return;
    const double agl_m = *stretch.lowest->agl_m;
    fail(ErrorKind::Input,
         "the recording is {} at t = {:.1f} s ({}); raise it by height_offset_m, or leave such "
         "parts out by too_low = \"clip\"",
         agl_m < 0.0 ? fmt::format("{:.1f} m below the ground", -agl_m)
                     : fmt::format("{:.1f} m above the ground, less than min_agl_m = {:.1f} m,",
                                   agl_m, min_agl_m_),
         stretch.lowest->time_s - stretch.begin_s, text_of(stretch.lowest->place));
  }

  /// "0: 12.0 s to 310.5 s, 1: …", times from the first fix on.
  static std::string list_of(const std::vector<Stretch>& stretches) {
    constexpr std::size_t kMostListed = 20;
    std::string text;
    for (std::size_t i = 0; i < std::min(stretches.size(), kMostListed); ++i)
      text += fmt::format("{}{}: {:.1f} s to {:.1f} s", i == 0 ? "" : ", ", i, stretches[i].begin_s,
                          stretches[i].end_s);
    return stretches.size() > kMostListed ? text + ", ..." : text;
  }

  void tell(const Recording& recording, const std::vector<Stretch>& stretches, std::size_t chosen,
            const core::Log& log) const {
    const std::string summary =
        fmt::format("{}: {}", recording_.file.written, summary_of(recording, recording_));
    const CleaningCounts& counts = recording.dropped;
    if (recording.num_without_place + recording.num_without_height + recording.num_without_ground +
            recording.num_without_attitude + recording.num_attitudes_repeated +
            recording.num_attitudes_without_time + counts.num_without_time +
            counts.num_of_same_time + counts.num_out_of_order + counts.num_impossible +
            counts.num_in_short_parts >
        0)
      log.warn("{}", summary);
    else
      log.info("{}", summary);
    if (stretches.size() > 1 && part_ < 0)
      log.warn(
          "{} parts ({}), of which `part` chooses one, and split = true takes all; part {} is "
          "flown",
          stretches.size(), list_of(stretches), chosen);
    const Stretch& stretch = stretches[chosen];
    const SmoothPart& part = recording.parts[stretch.part];
    if (stretch.begin_s > part.begin_s || stretch.end_s < part.end_s)
      log.info("flown from {:.1f} s to {:.1f} s of {:.1f} s to {:.1f} s; the rest is clipped",
               stretch.begin_s, stretch.end_s, part.begin_s, part.end_s);
    log.info(
        "residuals of {} fixes: {:.2f} m horizontally, {:.2f} m vertically{}; {} beyond 3 sigma; "
        "attitude by the {}{}",
        part.num_fixes, part.horizontal_rms_m, part.vertical_rms_m,
        part.rotation ? fmt::format(", {:.2f} deg", part.attitude_rms_deg) : "", part.num_outliers,
        recording.attitude_from,
        part.median_speed_difference_mps
            ? fmt::format("; recorded speeds differ by {:.2f} m/s (median)",
                          *part.median_speed_difference_mps)
            : "");
  }

  RecordingOptions recording_;
  std::int64_t part_ = -1;
  bool split_ = false;
  bool is_told_ = false;  ///< split() told of the file
  std::string outside_ = "error";
  double min_agl_m_ = 5.0;
  std::string too_low_ = "error";
  AttitudeOptions attitude_;
  double slow_mps_ = 1.0;
};

}  // namespace

TrajectoryKindInfo recorded_trajectory() {
  return {.name = "recorded",
          .summary = "A flight that was recorded, from a file of fixes.",
          .make = [] { return std::unique_ptr<TrajectoryKind>(new Recorded); }};
}

}  // namespace terracast::geo
