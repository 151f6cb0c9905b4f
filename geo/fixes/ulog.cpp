#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "geo/fixes/fix_format.h"
#include "geo/fixes/times.h"
#include "geo/fixes/ulog_file.h"
#include "geo/units.h"

namespace terracast::geo {
namespace {

using core::ErrorKind;
using core::fail;

constexpr std::string_view kGlobal = "vehicle_global_position";
constexpr std::string_view kLocal = "vehicle_local_position";
constexpr std::string_view kGps = "vehicle_gps_position";
constexpr std::string_view kReceiver = "sensor_gps";
constexpr std::string_view kAttitude = "vehicle_attitude";
constexpr std::string_view kBootTime = "boot_time_utc_us";  // information, of newer programs
constexpr double kPerSecond = 1e6;

constexpr std::string_view kRest = "not needed for the motion";
constexpr std::string_view kNoTopic = "states neither the vehicle's place nor its attitude";

constexpr std::array kKnown = {
    core::KnownName{"message A", "names of topics"},
    core::KnownName{"message B", "features of the log, and appended data"},
    core::KnownName{"message D", "records of topics"},
    core::KnownName{"message F", "formats of records"},
    core::KnownName{"message O", "dropouts, of which the log tells"},
    core::KnownName{"message S", "marks by which reading goes on after damage"},
    core::KnownName{"message C", "messages to the pilot", false},
    core::KnownName{"message I",
                    "the vehicle and its program; UTC of the start, where no receiver states it",
                    false},
    core::KnownName{"message L", "messages to the pilot", false},
    core::KnownName{"message M", "the vehicle and its program", false},
    core::KnownName{"message P", "settings", false},
    core::KnownName{"message Q", "settings", false},
    core::KnownName{"message R", "no record follows in any case", false},
    core::KnownName{"vehicle_attitude.q", "attitude, from forward-right-down to north-east-down"},
    core::KnownName{"vehicle_attitude.quat_reset_counter", "jumps of the estimate, which are told"},
    core::KnownName{"vehicle_attitude.timestamp", "times"},
    core::KnownName{"vehicle_attitude.timestamp_sample", "times, instead of timestamp"},
    core::KnownName{"vehicle_attitude.*", kRest, false},
    core::KnownName{"vehicle_global_position.alt", "height above mean sea level in metres"},
    core::KnownName{"vehicle_global_position.alt_ellipsoid", "height above the ellipsoid"},
    core::KnownName{"vehicle_global_position.alt_reset_counter", "jumps, where a part begins"},
    core::KnownName{"vehicle_global_position.alt_valid", "whether there is a height"},
    core::KnownName{"vehicle_global_position.lat", "latitude in degrees"},
    core::KnownName{"vehicle_global_position.lat_lon_reset_counter", "jumps, where a part begins"},
    core::KnownName{"vehicle_global_position.lat_lon_valid", "whether there is a place"},
    core::KnownName{"vehicle_global_position.lon", "longitude in degrees"},
    core::KnownName{"vehicle_global_position.timestamp", "times"},
    core::KnownName{"vehicle_global_position.timestamp_sample", "times, instead of timestamp"},
    core::KnownName{"vehicle_global_position.vel_e", "speed, which the motion is compared with"},
    core::KnownName{"vehicle_global_position.vel_n", "speed, which the motion is compared with"},
    core::KnownName{"vehicle_global_position.*", kRest, false},
    core::KnownName{"vehicle_local_position.ref_alt", "height of the origin above mean sea level"},
    core::KnownName{"vehicle_local_position.ref_lat", "the origin"},
    core::KnownName{"vehicle_local_position.ref_lon", "the origin"},
    core::KnownName{"vehicle_local_position.timestamp", "times"},
    core::KnownName{"vehicle_local_position.timestamp_sample", "times, instead of timestamp"},
    core::KnownName{"vehicle_local_position.v_xy_valid", "whether there is a speed"},
    core::KnownName{"vehicle_local_position.vx", "speed, which the motion is compared with"},
    core::KnownName{"vehicle_local_position.vy", "speed, which the motion is compared with"},
    core::KnownName{"vehicle_local_position.x", "metres north of the origin"},
    core::KnownName{"vehicle_local_position.xy_global", "whether the origin is known"},
    core::KnownName{"vehicle_local_position.xy_reset_counter", "jumps, where a part begins"},
    core::KnownName{"vehicle_local_position.xy_valid", "whether there is a place"},
    core::KnownName{"vehicle_local_position.y", "metres east of the origin"},
    core::KnownName{"vehicle_local_position.z", "metres below the origin"},
    core::KnownName{"vehicle_local_position.z_global", "whether the origin's height is known"},
    core::KnownName{"vehicle_local_position.z_reset_counter", "jumps, where a part begins"},
    core::KnownName{"vehicle_local_position.z_valid", "whether there is a height"},
    core::KnownName{"vehicle_local_position.*", kRest, false},
    core::KnownName{"vehicle_gps_position.alt", "height above mean sea level in millimetres"},
    core::KnownName{"vehicle_gps_position.alt_ellipsoid", "height above the ellipsoid, in mm"},
    core::KnownName{"vehicle_gps_position.altitude_ellipsoid_m", "height above the ellipsoid"},
    core::KnownName{"vehicle_gps_position.altitude_msl_m", "height above mean sea level"},
    core::KnownName{"vehicle_gps_position.fix_type", "whether there is a place"},
    core::KnownName{"vehicle_gps_position.lat", "latitude in ten millionths of a degree"},
    core::KnownName{"vehicle_gps_position.latitude_deg", "latitude"},
    core::KnownName{"vehicle_gps_position.lon", "longitude in ten millionths of a degree"},
    core::KnownName{"vehicle_gps_position.longitude_deg", "longitude"},
    core::KnownName{"vehicle_gps_position.time_utc_usec", "UTC"},
    core::KnownName{"vehicle_gps_position.timestamp", "times"},
    core::KnownName{"vehicle_gps_position.timestamp_sample", "times, instead of timestamp"},
    core::KnownName{"vehicle_gps_position.vel_e_m_s", "speed, which the motion is compared with"},
    core::KnownName{"vehicle_gps_position.vel_n_m_s", "speed, which the motion is compared with"},
    core::KnownName{"vehicle_gps_position.*", kRest, false},
    core::KnownName{"sensor_gps.alt", "height above mean sea level in millimetres"},
    core::KnownName{"sensor_gps.alt_ellipsoid", "height above the ellipsoid, in mm"},
    core::KnownName{"sensor_gps.altitude_ellipsoid_m", "height above the ellipsoid"},
    core::KnownName{"sensor_gps.altitude_msl_m", "height above mean sea level"},
    core::KnownName{"sensor_gps.fix_type", "whether there is a place"},
    core::KnownName{"sensor_gps.lat", "latitude in ten millionths of a degree"},
    core::KnownName{"sensor_gps.latitude_deg", "latitude"},
    core::KnownName{"sensor_gps.lon", "longitude in ten millionths of a degree"},
    core::KnownName{"sensor_gps.longitude_deg", "longitude"},
    core::KnownName{"sensor_gps.time_utc_usec", "UTC"},
    core::KnownName{"sensor_gps.timestamp", "times"},
    core::KnownName{"sensor_gps.timestamp_sample", "times, instead of timestamp"},
    core::KnownName{"sensor_gps.vel_e_m_s", "speed, which the motion is compared with"},
    core::KnownName{"sensor_gps.vel_n_m_s", "speed, which the motion is compared with"},
    core::KnownName{"sensor_gps.*", kRest, false},
    core::KnownName{"topic *", kNoTopic, false}};
constexpr std::array kTables = {core::KnownTable{"ulog", "messages, and fields of topics", kKnown}};

/// The place on the sphere of 6371 km, on which PX4 lays out its local coordinates (azimuthal, equidistant), at a
/// distance from another. On the ellipsoid it would be another place: 3 m off at 1 km.
Eigen::Vector2d moved_on_sphere(double lat_deg, double lon_deg, double north_m, double east_m) {
  constexpr double kRadius_m = 6371000.0;
  const double angle = std::hypot(north_m, east_m) / kRadius_m;
  const double azimuth = std::atan2(east_m, north_m);
  const double lat = radians_from_degrees(lat_deg);
  const double sin_lat = std::clamp(
      std::sin(lat) * std::cos(angle) + std::cos(lat) * std::sin(angle) * std::cos(azimuth), -1.0,
      1.0);
  const double lon_change = std::atan2(std::sin(azimuth) * std::sin(angle) * std::cos(lat),
                                       std::cos(angle) - std::sin(lat) * sin_lat);
  return {degrees_from_radians(std::asin(sin_lat)), lon_deg + degrees_from_radians(lon_change)};
}

/// Of the estimate's moment, where the topic states it: messages come some milliseconds later.
double time_of(const UlogTopic& topic, std::size_t i) {
  if (topic.has_field("timestamp_sample"))
    if (const double sampled = topic.number(i, "timestamp_sample"); sampled > 0.0)
      return sampled / kPerSecond;
  return topic.number(i, "timestamp") / kPerSecond;
}

/// A flag that older firmware does not have is set.
bool is_set(const UlogTopic& topic, std::size_t i, std::string_view flag) {
  return !topic.has_field(flag) || topic.number(i, flag) != 0.0;
}

std::optional<double> speed_of(const UlogTopic& topic, std::size_t i, std::string_view north,
                               std::string_view east) {
  if (!topic.has_field(north) || !topic.has_field(east)) return std::nullopt;
  const double speed = std::hypot(topic.number(i, north), topic.number(i, east));
  if (!std::isfinite(speed)) return std::nullopt;
  return speed;
}

/// The first of a topic's counters of jumps that differ from those of the record before.
class Jumps {
 public:
  explicit Jumps(std::vector<std::string_view> counters) : counters_(std::move(counters)) {}
  bool is_one(const UlogTopic& topic, std::size_t i) const {
    return i > 0 && std::any_of(counters_.begin(), counters_.end(), [&](std::string_view counter) {
             return topic.has_field(counter) &&
                    topic.number(i, counter) != topic.number(i - 1, counter);
           });
  }

 private:
  std::vector<std::string_view> counters_;
};

/// Logs of PX4: the estimator's places, or the receiver's, with the attitudes that the estimator states more often.
class UlogFixes final : public FixFormat {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("places", places_,
              "Where places come from: global (vehicle_global_position), local "
              "(vehicle_local_position about the origin that it states), gps (the receiver's "
              "vehicle_gps_position or sensor_gps), local_origin (vehicle_local_position about "
              "`origin`, of flights without a receiver); auto: the first of global, local and gps "
              "that the log holds.",
              core::one_of({"auto", "global", "local", "gps", "local_origin"}));
    visit.key("instance", instance_,
              "Which of several estimators or receivers is read, counted from 0.",
              core::between(0.0, 255.0));
  }
  std::unique_ptr<FixFormat> clone() const override { return std::make_unique<UlogFixes>(*this); }
  FixFrame frame() const override {
    return places_ == "local_origin" ? FixFrame::Local : FixFrame::Geodetic;
  }
  std::string heights_above() const override { return frame() == FixFrame::Local ? "" : "egm96"; }

  FixTable read(const std::filesystem::path& file, const std::string& above) const override {
    std::set<std::string, std::less<>> kept;
    for (const std::string_view topic : {kGlobal, kLocal, kGps, kReceiver, kAttitude})
      kept.emplace(topic);
    const UlogFile log(file, std::move(kept));
    FixTable table;
    table.frame = frame();
    table.attitude_frame =
        table.frame == FixFrame::Local ? AttitudeFrame::Local : AttitudeFrame::PlaceEnu;
    table.remarks = log.remarks();
    const Source places = read_places(log, file, above, table);
    const Source attitudes = read_attitudes(log, table);
    const Source clock = count_from_1970(log, table);
    const auto is_read = [&](std::string_view topic, int instance, std::string_view field) {
      const Source source{topic, instance};
      return source == places || source == attitudes ||
             (source == clock && (field == "time_utc_usec" || field == "timestamp"));
    };
    log.count(kKnown, is_read, table.ledger);
    return table;
  }

 private:
  /// An instance of a topic; without a name: none.
  struct Source {
    std::string_view topic;
    int instance = 0;
    bool operator==(const Source&) const = default;
  };

  static constexpr std::array<std::pair<std::string_view, std::string_view>, 5> kSources = {
      {{"global", kGlobal},
       {"local", kLocal},
       {"gps", kGps},
       {"gps", kReceiver},
       {"local_origin", kLocal}}};

  /// Whether a local position says where its origin is.
  static bool is_global(const UlogTopic& topic, std::size_t i) {
    return is_set(topic, i, "xy_global") && topic.number(i, "xy_valid") != 0.0;
  }
  static bool has_global_place(const UlogTopic& topic) {
    for (std::size_t i = 0; i < topic.num_records(); ++i)
      if (is_global(topic, i)) return true;
    return false;
  }

  Source read_places(const UlogFile& log, const std::filesystem::path& file,
                     const std::string& above, FixTable& table) const {
    for (const auto& [source, name] : kSources) {
      const bool is_wanted = places_ == source || (places_ == "auto" && source != "local_origin");
      if (!is_wanted) continue;
      const std::optional<UlogTopic> topic = log.topic(name, static_cast<int>(instance_));
      if (!topic || (places_ == "auto" && name == kLocal && !has_global_place(*topic))) continue;
      refuse_other_heights(*topic, source, above);
      if (topic->num_records() > kMostFixes)
        fail(ErrorKind::Input, "{}: more than {} records of {}; cut the log", file.string(),
             kMostFixes, name);
      for (std::size_t i = 0; i < topic->num_records(); ++i)
        table.fixes.push_back(fix_of(*topic, i, source, above));
      if (source == "local" && above == "home") take_home(*topic, table);
      remark_instances(log, {name, static_cast<int>(instance_)}, table);
      table.remarks.push_back(fmt::format("places are those of {}", name));
      return {name, static_cast<int>(instance_)};
    }
    fail(ErrorKind::Input, "{}: {}", file.string(), what_it_holds(log));
  }

  /// What to say where there is no place to read.
  std::string what_it_holds(const UlogFile& log) const {
    std::string topics;
    for (const std::string_view name : {kGlobal, kLocal, kGps, kReceiver})
      for (const int instance : log.instances(name))
        topics += fmt::format("{}{} (instance {})", topics.empty() ? "" : ", ", name, instance);
    const bool has_local = log.topic(kLocal, static_cast<int>(instance_)).has_value();
    return fmt::format(
        "it holds no place of the vehicle for places = \"{}\" and instance = {}; it holds {}{}",
        places_, instance_, topics.empty() ? "none at all" : topics,
        has_local ? "; places = \"local_origin\" reads vehicle_local_position about an origin that "
                    "the config states"
                  : "");
  }

  /// throws   Config: the log's heights are not above that
  static void refuse_other_heights(const UlogTopic& topic, std::string_view source,
                                   const std::string& above) {
    if (source == "local_origin" || above == "egm96" || above == "none") return;
    if (above == "home" && source == "local") return;
    const bool has_ellipsoid =
        topic.has_field("alt_ellipsoid") || topic.has_field("altitude_ellipsoid_m");
    if (above == "ellipsoid" && has_ellipsoid) return;
    fail(ErrorKind::Config,
         "above = \"{}\", and {} states no such heights; it states those above mean sea level "
         "(egm96){}{}; {}",
         above, topic.name(), has_ellipsoid ? ", above the ellipsoid" : "",
         source == "local" ? ", above the origin (home)" : "", kNoHeightsWayOut);
  }

  static Fix fix_of(const UlogTopic& topic, std::size_t i, std::string_view source,
                    const std::string& above) {
    static const Jumps global_jumps({"lat_lon_reset_counter", "alt_reset_counter"});
    static const Jumps local_jumps({"xy_reset_counter", "z_reset_counter"});
    Fix fix;
    if (source == "global") {
      fix = global_fix(topic, i, above);
      fix.starts_part = global_jumps.is_one(topic, i);
    } else if (source == "gps") {
      fix = gps_fix(topic, i, above);
    } else {
      fix = source == "local" ? local_fix(topic, i, above) : fix_about_origin(topic, i);
      fix.starts_part = local_jumps.is_one(topic, i);
      if (is_set(topic, i, "v_xy_valid")) fix.speed_mps = speed_of(topic, i, "vx", "vy");
    }
    fix.time_s = time_of(topic, i);
    return fix;
  }

  static Fix global_fix(const UlogTopic& topic, std::size_t i, const std::string& above) {
    Fix fix;
    fix.speed_mps = speed_of(topic, i, "vel_n", "vel_e");
    if (!is_set(topic, i, "lat_lon_valid")) return fix;
    fix.place.head<2>() = Eigen::Vector2d(topic.number(i, "lat"), topic.number(i, "lon"));
    if (above != "none" && is_set(topic, i, "alt_valid"))
      fix.place.z() = topic.number(i, above == "ellipsoid" ? "alt_ellipsoid" : "alt");
    return fix;
  }

  static Fix local_fix(const UlogTopic& topic, std::size_t i, const std::string& above) {
    Fix fix;
    if (!is_global(topic, i)) return fix;
    fix.place.head<2>() = moved_on_sphere(topic.number(i, "ref_lat"), topic.number(i, "ref_lon"),
                                          topic.number(i, "x"), topic.number(i, "y"));
    const bool has_height =
        topic.number(i, "z_valid") != 0.0 && (above == "home" || is_set(topic, i, "z_global"));
    if (above != "none" && has_height)
      fix.place.z() = (above == "home" ? 0.0 : topic.number(i, "ref_alt")) - topic.number(i, "z");
    return fix;
  }

  /// East, north, up.
  static Fix fix_about_origin(const UlogTopic& topic, std::size_t i) {
    Fix fix;
    if (topic.number(i, "xy_valid") == 0.0 || topic.number(i, "z_valid") == 0.0) return fix;
    fix.place = {topic.number(i, "y"), topic.number(i, "x"), -topic.number(i, "z")};
    return fix;
  }

  static Fix gps_fix(const UlogTopic& topic, std::size_t i, const std::string& above) {
    // 2: without heights.
    constexpr double kPlane = 2.0, kSpace = 3.0;
    constexpr double kPerDegree = 1e7, kPerMetre = 1e3;
    Fix fix;
    fix.speed_mps = speed_of(topic, i, "vel_n_m_s", "vel_e_m_s");
    const double fix_type = topic.number(i, "fix_type");
    if (fix_type < kPlane) return fix;
    const bool has_height = above != "none" && fix_type >= kSpace;
    if (topic.has_field("latitude_deg")) {
      fix.place.head<2>() =
          Eigen::Vector2d(topic.number(i, "latitude_deg"), topic.number(i, "longitude_deg"));
      if (has_height)
        fix.place.z() =
            topic.number(i, above == "ellipsoid" ? "altitude_ellipsoid_m" : "altitude_msl_m");
    } else {
      fix.place.head<2>() =
          Eigen::Vector2d(topic.number(i, "lat"), topic.number(i, "lon")) / kPerDegree;
      if (has_height)
        fix.place.z() = topic.number(i, above == "ellipsoid" ? "alt_ellipsoid" : "alt") / kPerMetre;
    }
    return fix;
  }

  static void take_home(const UlogTopic& topic, FixTable& table) {
    for (std::size_t i = 0; !table.home && i < topic.num_records(); ++i)
      if (is_global(topic, i))
        table.home = Geodetic{topic.number(i, "ref_lat"), topic.number(i, "ref_lon"), 0.0};
  }

  static void remark_instances(const UlogFile& log, const Source& source, FixTable& table) {
    if (const std::size_t count = log.instances(source.topic).size(); count > 1)
      table.remarks.push_back(fmt::format("{} has {} instances, of which {} is read", source.topic,
                                          count, source.instance));
  }

  /// Those of the instance whose places are read, or else of the first.
  Source read_attitudes(const UlogFile& log, FixTable& table) const {
    Source source{kAttitude, static_cast<int>(instance_)};
    if (!log.topic(kAttitude, source.instance)) source.instance = 0;
    const std::optional<UlogTopic> topic = log.topic(kAttitude, source.instance);
    if (!topic) return {};
    remark_instances(log, source, table);
    static const Jumps jumps({"quat_reset_counter"});
    std::size_t num_jumps = 0;
    for (std::size_t i = 0; i < topic->num_records(); ++i) {
      num_jumps += jumps.is_one(*topic, i) ? 1 : 0;
      const Eigen::Quaterniond q(topic->number(i, "q", 0), topic->number(i, "q", 1),
                                 topic->number(i, "q", 2), topic->number(i, "q", 3));
      if (!q.coeffs().allFinite() || q.coeffs().isZero(0.0)) {
        ++table.empty["vehicle_attitude.q"];
        continue;
      }
      constexpr double kNormTolerance = 0.01;
      if (std::abs(q.norm() - 1.0) > kNormTolerance)
        fail(ErrorKind::Input, "{}: the quaternion has length {:.4f}; rotations have 1",
             topic->where(i), q.norm());
      if (table.attitudes.size() >= kMostFixes)
        fail(ErrorKind::Input, "{}: more than {} attitudes; cut the log", topic->where(i),
             kMostFixes);
      table.attitudes.push_back(
          {time_of(*topic, i), enu_from_ned() * q.normalized() * axes_from_body("frd")});
    }
    if (num_jumps > 0)
      table.remarks.push_back(fmt::format(
          "the estimate of the attitude jumped {} time{}; the smooth motion turns there", num_jumps,
          num_jumps == 1 ? "" : "s"));
    return source;
  }

  /// The receiver states UTC beside the time since the start; the median of their differences holds for the whole log.
  /// Where it states none, that of the start which newer logs hold.
  static Source count_from_1970(const UlogFile& log, FixTable& table) {
    std::vector<double> starts_unix_s;
    Source source;
    for (const std::string_view name : {kGps, kReceiver}) {
      const std::vector<int> instances = log.instances(name);
      if (instances.empty() || !starts_unix_s.empty()) continue;
      const UlogTopic topic = *log.topic(name, instances.front());
      if (!topic.has_field("time_utc_usec")) continue;
      source = {name, instances.front()};
      starts_unix_s = starts_of(topic, table);
    }
    if (starts_unix_s.empty()) {
      const auto boot_us = log.information("uint64_t " + std::string(kBootTime));
      const double boot_s = boot_us ? static_cast<double>(*boot_us) / kPerSecond : 0.0;
      if (boot_us && is_plausible(boot_s)) table.zero_unix_s = boot_s;
      return {};
    }
    const auto middle =
        starts_unix_s.begin() + static_cast<std::ptrdiff_t>(starts_unix_s.size() / 2);
    std::nth_element(starts_unix_s.begin(), middle, starts_unix_s.end());
    table.zero_unix_s = *middle;
    return source;
  }

  /// From 2000 to 2200.
  static bool is_plausible(double utc_s) {
    constexpr double kIn2000_s = 946684800.0;
    return utc_s > kIn2000_s && is_unix_time(utc_s);
  }

  /// UTC of the log's time 0 by each record of a receiver that states a time; times that cannot be are told.
  static std::vector<double> starts_of(const UlogTopic& topic, FixTable& table) {
    std::vector<double> starts_unix_s;
    std::size_t num_wrong = 0;
    for (std::size_t i = 0; i < topic.num_records(); ++i) {
      const double utc_s = topic.number(i, "time_utc_usec") / kPerSecond;
      if (is_plausible(utc_s))
        starts_unix_s.push_back(utc_s - topic.number(i, "timestamp") / kPerSecond);
      else if (utc_s != 0.0)  // it knows none yet
        ++num_wrong;
    }
    if (num_wrong > 0)
      table.remarks.push_back(
          fmt::format("{} times of {} are not between 2000 and 2200, and are not taken for UTC",
                      num_wrong, topic.name()));
    return starts_unix_s;
  }

  std::string places_ = "auto";
  std::int64_t instance_ = 0;
};

}  // namespace

FixFormatInfo ulog_fixes() {
  return {.name = "ulog",
          .summary = "Logs of PX4 (.ulg): the estimator's places and attitudes, or the receiver's.",
          .make = [] { return std::unique_ptr<FixFormat>(new UlogFixes); },
          .known = kTables};
}

}  // namespace terracast::geo
