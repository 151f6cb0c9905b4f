#include "validate/navigation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "validate/causes/sensor_trial.h"
#include "validate/geodesy.h"
#include "validate/text.h"

/// Heights, units, axes, arms and times of receivers, barometers and magnetometers.
namespace terracast::validate {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// A receiver's columns, of what is shown and, from kReceiverTruth on, of the truth.
enum ReceiverColumn : std::size_t { kLat, kLon, kHeight, kMsl, kNorth, kEast, kDown };
constexpr std::size_t kReceiverTruth = 12;

/// Which of a sensor's columns a mistake is in.
struct Part {
  const char* words;
  std::vector<std::size_t> starts;
};
std::vector<Part> parts_of(std::size_t truth) {
  return {{"", {0, truth}}, {"shown ", {0}}, {"true ", {truth}}};
}

/// A mistake in rows of a receiver, from the first column of what is shown or true on.
using UndoRow = std::function<bool(double* row)>;

void add(std::vector<SensorHypothesis>& hypotheses, const char* name, const std::string& words,
         std::size_t truth, const UndoRow& undo) {
  for (const Part& part : parts_of(truth))
    hypotheses.push_back(simple_cause(name, part.words + words, 1, [=](SensorRecord& sensor) {
      for (std::size_t k = 0; k < sensor.times_s.size(); ++k)
        for (const std::size_t start : part.starts)
          if (!undo(&sensor.values[k * sensor.num_channels + start])) return false;
      return true;
    }));
}

void add_places(const SensorSymptoms& symptoms, std::vector<SensorHypothesis>& hypotheses) {
  const auto add_one = [&](const char* name, const char* words, const UndoRow& undo) {
    add(hypotheses, name, words, kReceiverTruth, undo);
  };
  add_one("gnss_swapped", "latitudes and longitudes are exchanged", [](double* row) {
    std::swap(row[kLat], row[kLon]);
    return true;
  });
  add_one("gnss_unit", "latitudes and longitudes are in radians where degrees are meant",
          [](double* row) {
            row[kLat] = degrees_from_radians(row[kLat]);
            row[kLon] = degrees_from_radians(row[kLon]);
            return true;
          });
  add_one("gnss_unit", "latitudes and longitudes are in units of 1e-7 degrees", [](double* row) {
    row[kLat] *= 1e-7;
    row[kLon] *= 1e-7;
    return true;
  });
  add_one("gnss_heights",
          "heights above the ellipsoid and above mean sea level stand in each other's columns",
          [](double* row) {
            std::swap(row[kHeight], row[kMsl]);
            return true;
          });
  const auto undulation = [undulation_m = symptoms.undulation_m](const double* row) {
    return undulation_m ? undulation_m(std::clamp(row[kLat], -90.0, 90.0), row[kLon])
                        : std::nullopt;
  };
  add_one("gnss_height_msl", "heights are above mean sea level where the ellipsoid is meant",
          [=](double* row) {
            if (std::abs(row[kHeight] - row[kMsl]) > 1e-6) return false;
            const std::optional<double> up_m = undulation(row);
            if (up_m) row[kHeight] += *up_m;
            return up_m.has_value();
          });
  add_one("gnss_height_ellipsoid", "heights above mean sea level are those above the ellipsoid",
          [=](double* row) {
            if (std::abs(row[kHeight] - row[kMsl]) > 1e-6) return false;
            const std::optional<double> up_m = undulation(row);
            if (up_m) row[kMsl] -= *up_m;
            return up_m.has_value();
          });
}

void add_velocities(const SensorSymptoms& symptoms, std::vector<SensorHypothesis>& hypotheses) {
  const auto add_one = [&](const char* name, const char* words, const UndoRow& undo) {
    add(hypotheses, name, words, kReceiverTruth, undo);
  };
  add_one("gnss_velocity_axes",
          "velocities are to the east, to the north and up where north, east and down are meant",
          [](double* row) {
            std::swap(row[kNorth], row[kEast]);
            row[kDown] = -row[kDown];
            return true;
          });
  add_one("gnss_velocity_axes", "velocities to the north and to the east are exchanged",
          [](double* row) {
            std::swap(row[kNorth], row[kEast]);
            return true;
          });
  add_one("gnss_velocity_sign", "velocities are up where down is meant", [](double* row) {
    row[kDown] = -row[kDown];
    return true;
  });
  for (const auto& [factor, words] :
       {std::pair{1.0 / 3.6, "velocities are in km/h where m/s are meant"},
        std::pair{1852.0 / 3600.0, "velocities are in knots where m/s are meant"}})
    add_one("gnss_velocity_unit", words, [factor = factor](double* row) {
      for (const std::size_t column : {kNorth, kEast, kDown}) row[column] *= factor;
      return true;
    });
  const Matrix3d origin_from_ecef = ecef_from_local(symptoms.sequence.origin).rotation.transpose();
  add_one("gnss_velocity_place",
          "velocities are along the world's axes where those of the antenna's place are meant",
          [=](double* row) {
            if (!(std::abs(row[kLat]) <= 90.0)) return false;
            const Vector3d world(row[kEast], row[kNorth], -row[kDown]);
            const Vector3d own = enu_from_ecef({row[kLat], row[kLon], row[kHeight]}) *
                                 (origin_from_ecef.transpose() * world);
            row[kNorth] = own.y();
            row[kEast] = own.x();
            row[kDown] = -own.z();
            return true;
          });
}

/// The antenna elsewhere on the body: where, by least squares.
void add_antenna(const SensorSymptoms& symptoms, std::vector<SensorHypothesis>& hypotheses) {
  const SensorRecord& gnss = symptoms.sensor;
  Vector3d sum = Vector3d::Zero();
  int count = 0;
  for (const SampleAtFrame& at : samples_at_frames(symptoms.sequence, gnss)) {
    const double* truth = gnss.row(at.sample) + kReceiverTruth;
    if (!(std::abs(truth[kLat]) <= 90.0)) return;
    sum += at.ecef_from_body.inverse() *
           ecef_from_geodetic({truth[kLat], truth[kLon], truth[kHeight]});
    ++count;
  }
  if (count < 2) return;
  const Vector3d arm = sum / count, stated = gnss.body_from_sensor.translation;
  constexpr double kSame_m = 1e-4;
  const bool is_left_out = arm.norm() < kSame_m;
  if ((arm - stated).norm() < kSame_m) return;
  SensorHypothesis h;
  // A body that flies straight without turning is a sample late or has another arm: the former is simpler.
  h.rank = is_left_out ? 1 : 3;
  h.undo = [=](SensorRecord& sensor, Cause& cause) {
    sensor.body_from_sensor.translation = is_left_out ? Vector3d(Vector3d::Zero()) : arm;
    cause.name = is_left_out ? "antenna_left_out" : "antenna_moved";
    cause.size = (arm - stated).norm();
    cause.unit = "m";
    cause.words =
        is_left_out
            ? fmt::format(
                  "places and velocities are those of the body's reference point: the antenna's "
                  "lever arm of ({:.6g}, {:.6g}, {:.6g}) m is left out",
                  stated.x(), stated.y(), stated.z())
            : fmt::format(
                  "places are those of an antenna at ({:.4f}, {:.4f}, {:.4f}) m on the body, not "
                  "at ({:.4f}, {:.4f}, {:.4f}) m",
                  arm.x(), arm.y(), arm.z(), stated.x(), stated.y(), stated.z());
    return true;
  };
  hypotheses.push_back(std::move(h));
}

void add_barometer(const SensorSymptoms& symptoms, std::vector<SensorHypothesis>& hypotheses) {
  constexpr std::size_t kShown = 0, kTruth = 1, kAltitude = 2;
  for (const auto& [factor, words] : {std::pair{100.0, "pressures are in hPa where Pa are meant"},
                                      std::pair{1000.0, "pressures are in kPa where Pa are meant"}})
    for (const bool is_both : {true, false})
      hypotheses.push_back(simple_cause("baro_unit", (is_both ? "" : "true ") + std::string(words),
                                        1, [=, factor = factor](SensorRecord& sensor) {
                                          for (std::size_t k = 0; k < sensor.times_s.size(); ++k) {
                                            double* row = &sensor.values[k * sensor.num_channels];
                                            row[kTruth] *= factor;
                                            if (is_both) row[kShown] *= factor;
                                          }
                                          return true;
                                        }));
  hypotheses.push_back(simple_cause(
      "baro_geopotential", "pressures are those of heights that are taken for geopotential ones", 1,
      [](SensorRecord& sensor) {
        // The geopotential height of which the model's own conversion makes the height that is there.
        constexpr double kEarth_m = 6356766.0, kSame = 1e-9;
        for (std::size_t k = 0; k < sensor.times_s.size(); ++k) {
          double* row = &sensor.values[k * sensor.num_channels];
          const double geometric_m = kEarth_m * row[kAltitude] / (kEarth_m - row[kAltitude]);
          const double wrong_pa =
              standard_pressure_pa(geometric_m, sensor.sea_level_pressure_pa, sensor.warmer_k);
          if (!(std::abs(row[kTruth] - wrong_pa) <= kSame * wrong_pa)) return false;
          row[kTruth] =
              standard_pressure_pa(row[kAltitude], sensor.sea_level_pressure_pa, sensor.warmer_k);
        }
        return true;
      }));
  // With its pressure, which goes by it.
  const bool is_pressure_right = !symptoms.fails("navigation_pressure");
  const Sequence& sequence = symptoms.sequence;
  const Undulation undulation_m = symptoms.undulation_m;
  hypotheses.push_back(simple_cause(
      "baro_height", "altitudes are above the ellipsoid where mean sea level is meant", 1,
      [=, &sequence](SensorRecord& sensor) {
        if (!undulation_m) return false;
        const std::vector<SampleAtFrame> at = samples_at_frames(sequence, sensor);
        if (at.empty()) return false;
        const Geodetic place =
            geodetic_from_ecef((at.front().ecef_from_body * sensor.body_from_sensor).translation);
        for (const SampleAtFrame& one : at) {
          const Geodetic here =
              geodetic_from_ecef((one.ecef_from_body * sensor.body_from_sensor).translation);
          const std::optional<double> up_m = undulation_m(here.lat_deg, here.lon_deg);
          double* row = &sensor.values[one.sample * sensor.num_channels];
          if (!up_m || !(std::abs(row[kAltitude] - here.height_m) < 1e-3)) return false;
        }
        const std::optional<double> up_m = undulation_m(place.lat_deg, place.lon_deg);
        for (std::size_t k = 0; up_m && k < sensor.times_s.size(); ++k) {
          double* row = &sensor.values[k * sensor.num_channels];
          double of_sample_m = *up_m;
          const auto found = std::find_if(
              at.begin(), at.end(), [&](const SampleAtFrame& one) { return one.sample == k; });
          if (found != at.end()) {
            const Geodetic here =
                geodetic_from_ecef((found->ecef_from_body * sensor.body_from_sensor).translation);
            of_sample_m = undulation_m(here.lat_deg, here.lon_deg).value_or(*up_m);
          }
          row[kAltitude] -= of_sample_m;
          if (is_pressure_right)
            row[kTruth] =
                standard_pressure_pa(row[kAltitude], sensor.sea_level_pressure_pa, sensor.warmer_k);
        }
        return up_m.has_value();
      }));
}

/// Fields by the poses and the model, beside those that are there.
std::vector<VectorPair> predicted_fields(const SensorSymptoms& symptoms) {
  double start_unix_s = 0.0;
  try {
    start_unix_s = 1e-9 * static_cast<double>(parse_utc_ns(symptoms.sequence.utc_start, ""));
  } catch (const core::Error& error) {
    if (error.kind() != core::ErrorKind::Input) throw;
    return {};
  }
  constexpr std::size_t kTruth = 3;
  const SensorRecord& sensor = symptoms.sensor;
  std::vector<VectorPair> pairs;
  for (const SampleAtFrame& at : samples_at_frames(symptoms.sequence, sensor)) {
    const Pose pose = at.ecef_from_body * sensor.body_from_sensor;
    const double year = decimal_year(start_unix_s + sensor.times_s[at.sample]);
    const double* row = sensor.row(at.sample) + kTruth;
    pairs.push_back({pose.rotation.transpose() * magnetic_field_ecef_nt(pose.translation, year),
                     {row[0], row[1], row[2]}});
  }
  return pairs;
}

void add_magnetometer(const SensorSymptoms& symptoms, std::vector<SensorHypothesis>& hypotheses) {
  constexpr std::size_t kTruth = 3;
  const auto change = [](SensorRecord& sensor, const Part& part, const Matrix3d& right_from_wrong) {
    for (std::size_t k = 0; k < sensor.times_s.size(); ++k)
      for (const std::size_t start : part.starts) {
        Eigen::Map<Vector3d> field(&sensor.values[k * sensor.num_channels + start]);
        field = right_from_wrong * Vector3d(field);
      }
    return true;
  };
  const Part truth = parts_of(kTruth)[2], both = parts_of(kTruth)[0];
  for (const auto& [factor, words] : {std::pair{1e3, "fields are in microtesla where nT are meant"},
                                      std::pair{1e5, "fields are in gauss where nT are meant"},
                                      std::pair{1e9, "fields are in tesla where nT are meant"}})
    for (const Part& part : {both, truth})
      hypotheses.push_back(
          simple_cause("mag_unit", words, 1, [=, factor = factor](SensorRecord& sensor) {
            return change(sensor, part, factor * Matrix3d::Identity());
          }));
  if (const auto axes = exchange_of_axes(predicted_fields(symptoms))) {
    const bool is_sign = *axes == -Matrix3d::Identity();
    for (const Part& part : {both, truth})
      hypotheses.push_back(simple_cause(
          is_sign ? "mag_sign" : "mag_axes",
          is_sign ? "fields have the other sign"
                  : fmt::format("axes of fields are exchanged: {}", words_of_axes(*axes)),
          1, [=, m = Matrix3d(axes->transpose())](SensorRecord& sensor) {
            return change(sensor, part, m);
          }));
  }
  const Matrix3d sensor_from_body = symptoms.sensor.body_from_sensor.rotation.transpose();
  if (!sensor_from_body.isIdentity(1e-9))
    for (const Part& part : {both, truth})
      hypotheses.push_back(simple_cause(
          "mag_frame", "fields are along the body's axes where the sensor's are meant", 1,
          [=](SensorRecord& sensor) { return change(sensor, part, sensor_from_body); }));
}

}  // namespace

void make_navigation_causes(const SensorSymptoms& symptoms,
                            std::vector<SensorHypothesis>& hypotheses) {
  const SensorRecord& sensor = symptoms.sensor;
  const bool is_known =
      sensor.kind == "gnss" || sensor.kind == "barometer" || sensor.kind == "magnetometer";
  if (!is_known || sensor.times_s.empty() || !symptoms.fails("navigation")) return;
  if (sensor.kind == "gnss") {
    add_places(symptoms, hypotheses);
    add_velocities(symptoms, hypotheses);
    add_antenna(symptoms, hypotheses);
    add_late(symptoms, kReceiverTruth, kReceiverTruth + 7, "true places and velocities",
             hypotheses);
  }
  if (sensor.kind == "barometer") add_barometer(symptoms, hypotheses);
  if (sensor.kind == "magnetometer") add_magnetometer(symptoms, hypotheses);
  add_late(symptoms, 0, sensor.num_channels, "values", hypotheses);
}

}  // namespace terracast::validate
