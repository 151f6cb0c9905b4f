#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/ledger.h"
#include "geo/geodesy.h"

namespace terracast::geo {

/// What a fix's place is given in.
enum class FixFrame {
  Geodetic,  ///< latitude in deg, longitude in deg, height in m above what the config says
  Ecef,      ///< m
  Local      ///< m, x y z (z up) about an origin that the config names
};

/// What a fix's attitude leads to from the body (x forward, y left, z up).
enum class AttitudeFrame {
  PlaceEnu,  ///< east, north, up of the fix's own place
  Ecef,
  Local  ///< the file's own x y z
};

/// One row of a recording.
struct Fix {
  double time_s = std::numeric_limits<double>::quiet_NaN();  ///< not a number: the row has none
  /// A third number that is not one: the row states no height.
  Eigen::Vector3d place = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  std::optional<Eigen::Quaterniond> attitude;  ///< frame_from_body
  std::optional<Eigen::Quaterniond> gimbal;    ///< the same with the camera's optical axis for x
  std::optional<double> speed_mps;             ///< over ground, as the recorder measured it
  bool starts_part = false;                    ///< nothing is known of the way from the fix before
  std::size_t line =
      0;  ///< where it stands in its file, counted from 1; 0: the format has no lines

  bool has_place() const { return place.allFinite(); }
  bool has_level_place() const {
    return place.head<2>().allFinite();
  }  ///< its height may be missing
};

/// The body's attitude at a time of its own: recorders that filter state it more often than places.
struct TimedAttitude {
  double time_s = 0.0;          ///< on the clock of the fixes
  Eigen::Quaterniond attitude;  ///< frame_from_body
};

/// A recording as its file tells it, in the file's order.
struct FixTable {
  std::vector<Fix> fixes;
  /// Where there are any, they take the place of the fixes' own attitudes of the body.
  std::vector<TimedAttitude> attitudes;
  FixFrame frame = FixFrame::Geodetic;
  AttitudeFrame attitude_frame = AttitudeFrame::PlaceEnu;
  /// UTC at which the file's clock shows 0, in seconds since 1970-01-01T00:00:00Z; nothing: it is not known. Apart from
  /// the times, which as seconds since 1970 would be rounded to 2.4e-7 s.
  std::optional<double> zero_unix_s;
  std::optional<Geodetic> home;  ///< the place (not the height) of take-off

  bool has_utc() const { return zero_unix_s.has_value(); }

  core::Ledger ledger;  ///< columns, elements, attributes, fields
  std::map<std::string, std::size_t>
      empty;                         ///< of the same, those that stand there and hold nothing
  std::vector<std::string> remarks;  ///< what is assumed, and what was chosen
};

/// More are refused.
inline constexpr std::size_t kMostFixes = 2000000;

/// The attitude of aviation: yaw clockwise from north, pitch up, roll to the right, applied in this
/// order to a body x forward, y right, z down in north-east-down. Returns enu_from_body, the body x
/// forward, y left, z up.
Eigen::Quaterniond enu_from_body_by_ned_angles(double yaw_rad, double pitch_rad, double roll_rad);

/// Rotation about z by yaw, then the new y by pitch, then the new x by roll.
Eigen::Quaterniond rotation_by_angles(double yaw_rad, double pitch_rad, double roll_rad);

/// Axes that files give a body: flu, frd (x forward, y right, z down), rdf (x right, y down, z
/// forward), urf (x up, y right, z forward). Returns axes_from_body.
Eigen::Quaterniond axes_from_body(const std::string& axes);

/// Takes north-east-down into east-north-up, and back.
Eigen::Quaterniond enu_from_ned();

}  // namespace terracast::geo
