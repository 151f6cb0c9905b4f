#include "geo/fixes/placing.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "geo/fixes/fix_format.h"
#include "geo/units.h"

namespace terracast::geo {
namespace {

using core::ErrorKind;
using core::fail;

/// Heights of a recording as ellipsoidal ones.
class Heights {
 public:
  Heights(const FixTable& table, const PlacingOptions& options, const std::string& above,
          const TrajectoryContext& context)
      : above_(above), context_(context), offset_m_(options.height_offset_m) {
    if (above_ == "pressure") {
      offset_m_ += options.pressure_offset_m;
      above_ = "egm96";
    }
    if (above_ == "egm96" && !context.geoid)
      fail(ErrorKind::Config, "heights above egm96 need a geoid, and this world has none");
    if (above_ == "home") offset_m_ += home_height_m(table, options);
  }

  /// Nothing where a height counts from the ground and there is none.
  std::optional<double> ellipsoidal_m(double lat_deg, double lon_deg, double height_m) const {
    if (above_ == "egm96")
      return height_m + offset_m_ + context_.geoid->undulation_m(lat_deg, lon_deg);
    if (above_ != "ground" && above_ != "none") return height_m + offset_m_;
    const auto ground_m = context_.ground_height_m(lat_deg, lon_deg);
    if (!ground_m) return std::nullopt;
    return height_m + offset_m_ + *ground_m;
  }

 private:
  double home_height_m(const FixTable& table, const PlacingOptions& options) const {
    std::optional<Geodetic> home = table.home;
    for (std::size_t i = 0; !home && i < table.fixes.size(); ++i)
      if (table.fixes[i].has_level_place())
        home = Geodetic{table.fixes[i].place.x(), table.fixes[i].place.y(), 0.0};
    if (!home) return 0.0;  // there is no fix to place
    if (!table.home && context_.log)
      context_.log->info("take-off is taken to be at the first fix, {}", text_of(*home));
    const Place place{.lat_deg = home->lat_deg,
                      .lon_deg = home->lon_deg,
                      .height_m = options.home_height_m,
                      .above = options.home_above};
    return context_.frame
        .geodetic_from_world(resolve_place(place, context_, "the place of take-off"))
        .height_m;
  }

  std::string above_;
  const TrajectoryContext& context_;
  double offset_m_;
};

void check_geodetic(const Fix& fix, std::size_t index) {
  constexpr double kLowest_m = -12000.0, kHighest_m = 1000000.0;
  const Eigen::Vector3d& place = fix.place;
  const std::string name = fix.line > 0 ? fmt::format("the fix of line {}", fix.line)
                                        : fmt::format("fix {} (counted from 0)", index);
  if (std::abs(place.x()) > 90.0 || std::abs(place.y()) > 360.0)
    fail(ErrorKind::Input,
         "{} lies at latitude {}, longitude {}; they are in degrees, from -90 to 90 and from -360 "
         "to 360: check their order and the unit",
         name, place.x(), place.y());
  if (place.z() < kLowest_m || place.z() > kHighest_m)
    fail(ErrorKind::Input, "{} is {} m high; heights are {} to {} m: check the unit", name,
         place.z(), kLowest_m, kHighest_m);
}

bool states_no_height(const FixTable& table) {
  return table.frame == FixFrame::Geodetic &&
         std::none_of(table.fixes.begin(), table.fixes.end(),
                      [](const Fix& fix) { return std::isfinite(fix.place.z()); }) &&
         std::any_of(table.fixes.begin(), table.fixes.end(),
                     [](const Fix& fix) { return fix.has_level_place(); });
}

/// The file's own x, y, z in the world.
Rigid3d world_from_local(const PlacingOptions& options, const TrajectoryContext& context) {
  const Eigen::Vector3d origin_world = resolve_place(options.origin, context, "origin");
  // The file's x lies on a heading, so its y on the one 90 degrees before it.
  const Eigen::Quaterniond enu_from_local(Eigen::AngleAxisd(
      radians_from_degrees(90.0 - options.x_heading_deg), Eigen::Vector3d::UnitZ()));
  return {Eigen::Quaterniond(context.frame.world_from_enu(origin_world)) * enu_from_local,
          origin_world};
}

std::string attitude_source(const FixTable& table, const std::string& wanted) {
  bool has_gimbal = false, has_body = false;
  for (const Fix& fix : table.fixes) {
    has_gimbal |= fix.gimbal.has_value();
    has_body |= fix.attitude.has_value();
  }
  has_body |= !table.attitudes.empty();
  if (wanted == "auto") return has_gimbal ? "gimbal" : has_body ? "body" : "path";
  if ((wanted == "gimbal" && !has_gimbal) || (wanted == "body" && !has_body))
    fail(ErrorKind::Config,
         "attitude = \"{}\", and the recording holds no {}; attitude = \"path\" follows the motion",
         wanted, wanted == "gimbal" ? "angles of a gimbal" : "attitude of the body");
  return wanted;
}

/// What the attitudes of a recording lead to, in the world.
struct AttitudeFrames {
  const WorldFrame& world;
  Eigen::Quaterniond world_from_ecef;
  Eigen::Quaterniond world_from_local;

  Eigen::Quaterniond world_from(AttitudeFrame frame, const Eigen::Vector3d& position_world) const {
    if (frame == AttitudeFrame::PlaceEnu)
      return Eigen::Quaterniond(world.world_from_enu(position_world));
    return frame == AttitudeFrame::Ecef ? world_from_ecef : world_from_local;
  }
};

/// The times and places of fixes, by time; those without a time left out.
std::vector<PlacedFix> sorted_by_time(const std::vector<PlacedFix>& fixes) {
  std::vector<PlacedFix> sorted;
  for (const PlacedFix& fix : fixes)
    if (std::isfinite(fix.time_s)) sorted.push_back(fix);
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const PlacedFix& a, const PlacedFix& b) { return a.time_s < b.time_s; });
  return sorted;
}

/// The first of those that come later than a time.
std::vector<PlacedFix>::const_iterator after(const std::vector<PlacedFix>& sorted, double time_s) {
  return std::upper_bound(sorted.begin(), sorted.end(), time_s,
                          [](double time, const PlacedFix& fix) { return time < fix.time_s; });
}

/// How far a time is from that of one to that of the next, from 0 to 1.
double share_of(double time_s, const PlacedFix& from, const PlacedFix& to) {
  return std::clamp((time_s - from.time_s) / (to.time_s - from.time_s), 0.0, 1.0);
}

/// On the straight line between the fixes before and after; before the first and after the last, their places. East,
/// north and up differ by 1e-6 rad over 6 m.
Eigen::Vector3d place_at(const std::vector<PlacedFix>& sorted, double time_s) {
  const auto next = after(sorted, time_s);
  if (next == sorted.begin()) return next->position_world;
  if (next == sorted.end()) return sorted.back().position_world;
  const PlacedFix& last = *(next - 1);
  return last.position_world +
         share_of(time_s, last, *next) * (next->position_world - last.position_world);
}

/// In the order of their times; those at the time of another are counted and left out.
void place_attitudes(const FixTable& table, const AttitudeFrames& frames, PlacedFixes& placed) {
  if (table.attitudes.empty()) return;
  const std::vector<PlacedFix> fixes = sorted_by_time(placed.fixes);
  if (fixes.empty()) return;
  std::vector<TimedAttitude> attitudes;
  for (const TimedAttitude& attitude : table.attitudes)
    if (std::isfinite(attitude.time_s)) attitudes.push_back(attitude);
  placed.num_attitudes_without_time = table.attitudes.size() - attitudes.size();
  std::stable_sort(
      attitudes.begin(), attitudes.end(),
      [](const TimedAttitude& a, const TimedAttitude& b) { return a.time_s < b.time_s; });
  constexpr double kLeastStep_s = 1e-6;
  for (const TimedAttitude& attitude : attitudes) {
    if (!placed.attitudes.empty() &&
        attitude.time_s - placed.attitudes.back().time_s < kLeastStep_s) {
      ++placed.num_attitudes_repeated;
      continue;
    }
    PlacedFix result;
    result.time_s = attitude.time_s;
    result.position_world = place_at(fixes, attitude.time_s);
    result.world_from_body =
        frames.world_from(table.attitude_frame, result.position_world) * attitude.attitude;
    placed.attitudes.push_back(std::move(result));
  }
}

/// On the shortest turn between the attitudes before and after; nothing before the first, after the last, and between
/// two that are more than max_gap_s apart.
std::optional<Eigen::Quaterniond> attitude_at(const std::vector<PlacedFix>& attitudes,
                                              double time_s, double max_gap_s) {
  const auto next = after(attitudes, time_s);
  if (next == attitudes.begin()) return std::nullopt;
  const PlacedFix& last = *(next - 1);
  if (last.time_s == time_s) return last.world_from_body;
  if (next == attitudes.end() || next->time_s - last.time_s > max_gap_s) return std::nullopt;
  return last.world_from_body->slerp(share_of(time_s, last, *next), *next->world_from_body);
}

/// Moves places from the recorded point to the body's reference point.
/// world_from_body   the body's attitude at each fix
void apply_lever_arm(const Eigen::Vector3d& arm_body,
                     const std::vector<std::optional<Eigen::Quaterniond>>& world_from_body,
                     double max_gap_s, PlacedFixes& placed) {
  std::vector<PlacedFix> moved;
  bool starts_part = false;
  for (std::size_t i = 0; i < placed.fixes.size(); ++i) {
    PlacedFix& fix = placed.fixes[i];
    starts_part |= fix.starts_part;
    const std::optional<Eigen::Quaterniond> attitude =
        placed.attitudes.empty() ? world_from_body[i]
                                 : attitude_at(placed.attitudes, fix.time_s, max_gap_s);
    if (!attitude) {
      ++placed.num_without_attitude;
      continue;
    }
    fix.position_world += *attitude * arm_body;
    fix.starts_part = starts_part;
    starts_part = false;
    moved.push_back(std::move(fix));
  }
  placed.fixes = std::move(moved);
}

/// throws   Config: the recording has no attitude of the body
void refuse_arm_without_attitude(const FixTable& table) {
  if (!table.attitudes.empty() ||
      std::any_of(table.fixes.begin(), table.fixes.end(),
                  [](const Fix& fix) { return fix.attitude.has_value(); }))
    return;
  fail(ErrorKind::Config,
       "lever_arm_m is along the body's axes, and the recording holds no attitude of the body; "
       "leave it out");
}

}  // namespace

void PlacingOptions::describe(core::SchemaVisitor& visit, FixFrame frame,
                              const std::string& own_above) {
  if (frame == FixFrame::Local) {
    visit.section("origin", origin, "Where the recording's x = y = z = 0 is.");
    visit.key(
        "x_heading_deg", x_heading_deg,
        "Direction of the recording's x axis, clockwise from north; its z is up. 90: x is east, "
        "y north.",
        core::between(-360.0, 360.0));
  }
  if (frame == FixFrame::Geodetic) {
    visit.key("above", above,
              own_above.empty()
                  ? "What the recorded heights are above; it has to be said: WGS84, mean sea level "
                    "(EGM96), the ground, the place of take-off; or pressure altitude; none: they "
                    "are not read, and it flies height_offset_m above the ground."
                  : "What the recorded heights are above; empty: as the format says; none: they "
                    "are not read, and it flies height_offset_m above the ground.",
              core::one_of({"", "ellipsoid", "egm96", "ground", "home", "pressure", "none"}));
    // A manual without a config shows the keys of each choice.
    const bool shows_all = above.empty() && own_above.empty();
    if (above == "pressure" || shows_all) {
      core::Constraint range = core::between(-5000.0, 5000.0);
      range.required = !shows_all;
      visit.key(
          "pressure_offset_m", pressure_offset_m,
          "With above = \"pressure\": height above EGM96 less pressure altitude (1013.25 hPa), "
          "about 8.2 m for each hPa that the pressure at sea level is above 1013.25.",
          range);
    }
    if (above == "home" || shows_all) {
      visit.key("home_height_m", home_height_m, "Height of the place of take-off.",
                core::between(-12000.0, 100000.0));
      visit.key("home_above", home_above, "What home_height_m counts from.",
                core::one_of({"ellipsoid", "egm96", "ground"}));
    }
  }
  visit.key("height_offset_m", height_offset_m, "Raises the whole recording.",
            core::between(-100000.0, 100000.0));
  visit.key("attitude", attitude,
            "The body's axes: the gimbal's (x along the camera's axis), the recorded body's, or "
            "along the path; auto: the first of these that the recording holds.",
            core::one_of({"auto", "gimbal", "body", "path"}));
  visit.key(
      "lever_arm_m", lever_arm_m,
      "From the point whose places are recorded (an antenna, an inertial unit) to the body's "
      "reference point, along the body's axes: forward, left, up. Needs recorded attitudes of "
      "the body.",
      core::size_of(3));
}

void PlacingOptions::validate(FixFrame frame, const std::string& own_above) const {
  if (frame == FixFrame::Geodetic && above.empty() && own_above.empty())
    fail(ErrorKind::Config,
         "above is not given: say what the recorded heights are above, which is one of ellipsoid, "
         "egm96, ground, home, or pressure with a pressure_offset_m; where the file has none, {}",
         kNoHeightsWayOut);
  for (const double part : lever_arm_m)
    if (!std::isfinite(part))
      fail(ErrorKind::Config, "lever_arm_m: {} is not a finite number of metres", part);
}

PlacedFixes place_fixes(const FixTable& table, const PlacingOptions& options,
                        const std::string& heights_above, double max_gap_s,
                        const TrajectoryContext& context) {
  PlacedFixes placed;
  placed.attitude_from = attitude_source(table, options.attitude);
  const WorldFrame& frame = context.frame;
  const Rigid3d world_from_ecef = frame.ecef_from_world().inverse();
  const bool has_none = states_no_height(table);
  placed.is_over_ground = heights_above == "none" || (has_none && heights_above == "ground");
  if (has_none && !placed.is_over_ground)
    fail(ErrorKind::Config,
         "the recording states no heights, while above = \"{}\" asks for them; {}", heights_above,
         kNoHeightsWayOut);
  const Heights heights(table, options, heights_above, context);
  const Rigid3d local =
      table.frame == FixFrame::Local ? world_from_local(options, context) : Rigid3d{};
  const AttitudeFrames frames{frame, world_from_ecef.rotation, local.rotation};
  if (!options.lever_arm_m.empty()) refuse_arm_without_attitude(table);
  std::vector<std::optional<Eigen::Quaterniond>> world_from_body;  // of placed.fixes
  bool starts_part = false;
  for (std::size_t i = 0; i < table.fixes.size(); ++i) {
    Fix fix = table.fixes[i];
    starts_part |= fix.starts_part;
    if (placed.is_over_ground) fix.place.z() = 0.0;
    if (!fix.has_place()) {
      ++(fix.has_level_place() && table.frame == FixFrame::Geodetic ? placed.num_without_height
                                                                    : placed.num_without_place);
      continue;
    }
    PlacedFix result;
    result.time_s = fix.time_s;
    result.speed_mps = fix.speed_mps;
    result.recorded = result.held = fix.place;
    if (table.frame != FixFrame::Ecef) result.held.z() = 0.0;
    if (table.frame == FixFrame::Geodetic) {
      check_geodetic(fix, i);
      const auto height_m = heights.ellipsoidal_m(fix.place.x(), fix.place.y(), fix.place.z());
      if (!height_m) {
        ++placed.num_without_ground;
        starts_part = true;
        continue;
      }
      result.position_world = frame.world_from_geodetic({fix.place.x(), fix.place.y(), *height_m});
    } else {
      result.position_world = (table.frame == FixFrame::Ecef ? world_from_ecef : local) * fix.place;
      result.position_world += options.height_offset_m * frame.up_world(result.position_world);
    }
    std::optional<Eigen::Quaterniond> body;
    if (fix.attitude)
      body = frames.world_from(table.attitude_frame, result.position_world) * *fix.attitude;
    if (placed.attitude_from == "body") result.world_from_body = body;
    // A gimbal's angles are always about the place's own axes.
    if (placed.attitude_from == "gimbal" && fix.gimbal)
      result.world_from_body =
          frames.world_from(AttitudeFrame::PlaceEnu, result.position_world) * *fix.gimbal;
    world_from_body.push_back(body);
    result.starts_part = starts_part;
    starts_part = false;
    placed.fixes.push_back(std::move(result));
  }
  place_attitudes(table, frames, placed);
  if (!options.lever_arm_m.empty())
    apply_lever_arm(Eigen::Vector3d(options.lever_arm_m.data()), world_from_body, max_gap_s,
                    placed);
  return placed;
}

}  // namespace terracast::geo
