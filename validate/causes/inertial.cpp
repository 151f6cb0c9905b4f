#include "validate/inertial.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "validate/causes/sensor_trial.h"
#include "validate/geodesy.h"

/// Gravity, the Earth's turning, lever arms, axes, units and times of IMUs.
namespace terracast::validate {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Columns of the truth, and of what follows it.
constexpr std::size_t kTrueTurn = 6, kTrueForce = 9, kEndOfTruth = 12;
constexpr double kStandardGravity_mps2 = 9.80665;

Vector3d earth_rate() { return {0.0, 0.0, kEarthRate_radps}; }

Eigen::Map<Vector3d> vector_of(SensorRecord& imu, std::size_t sample, std::size_t column) {
  return Eigen::Map<Vector3d>(&imu.values[sample * imu.num_channels + column]);
}

/// Changes each sample of one instrument, by the IMU's state then.
/// change   of a reading, by the state and the gravity at its place
using Change = std::function<Vector3d(const Vector3d&, const ImuState&, const Vector3d&)>;
bool change_readings(SensorRecord& imu, std::size_t column, const Change& change) {
  for (std::size_t k = 0; k < imu.times_s.size(); ++k) {
    const std::optional<ImuState> state = imu.imu_state(k);
    if (!state) return false;
    const auto reading = vector_of(imu, k, column);
    vector_of(imu, k, column) =
        change(reading, *state, normal_gravity_ecef_mps2(state->ecef_from_sensor.translation));
  }
  return true;
}

void add(std::vector<SensorHypothesis>& hypotheses, const char* name, std::string words, int rank,
         std::size_t column, const Change& change) {
  hypotheses.push_back(simple_cause(name, std::move(words), rank, [=](SensorRecord& imu) {
    return change_readings(imu, column, change);
  }));
}

void add_gravity(const SensorSymptoms& symptoms, std::vector<SensorHypothesis>& hypotheses) {
  const auto along_sensor = [](const ImuState& state, const Vector3d& ecef) {
    return Vector3d(state.ecef_from_sensor.rotation.transpose() * ecef);
  };
  add(hypotheses, "imu_gravity_sign",
      "forces have gravity downwards: at rest they are 9.8 m/s^2 down where up is meant", 1,
      kTrueForce, [=](const Vector3d& f, const ImuState& state, const Vector3d& g) {
        return Vector3d(f - 2.0 * along_sensor(state, g));
      });
  add(hypotheses, "imu_gravity_missing",
      "forces lack gravity: at rest they are 0 where 9.8 m/s^2 upwards is meant", 1, kTrueForce,
      [=](const Vector3d& f, const ImuState& state, const Vector3d& g) {
        return Vector3d(f - along_sensor(state, g));
      });
  const Vector3d world_down = -Vector3d(ecef_from_local(symptoms.sequence.origin).rotation.col(2));
  for (const double size_mps2 : {9.81, kStandardGravity_mps2, 9.8})
    for (const bool is_worlds : {false, true})
      add(hypotheses, "imu_gravity_constant",
          fmt::format("gravity is {} m/s^2 everywhere, {}, where that of the place is meant",
                      size_mps2, is_worlds ? "along the world's vertical" : "downwards"),
          1, kTrueForce, [=](const Vector3d& f, const ImuState& state, const Vector3d& g) {
            const Vector3d down = is_worlds ? world_down : Vector3d(g.normalized());
            return Vector3d(f + along_sensor(state, size_mps2 * down - g));
          });
  add(hypotheses, "imu_gravity_vertical",
      "gravity is along the vertical of the world's origin, where that of the place is meant", 1,
      kTrueForce, [=](const Vector3d& f, const ImuState& state, const Vector3d& g) {
        return Vector3d(f + along_sensor(state, g.norm() * world_down - g));
      });
}

void add_earth(std::vector<SensorHypothesis>& hypotheses) {
  add(hypotheses, "imu_earth_rate", "turn rates lack the Earth's turning, 7.3e-5 rad/s", 1,
      kTrueTurn, [](const Vector3d& w, const ImuState& state, const Vector3d&) {
        return Vector3d(w + state.ecef_from_sensor.rotation.transpose() * earth_rate());
      });
  add(hypotheses, "imu_coriolis", "forces lack Coriolis' force, 2 W x v", 1, kTrueForce,
      [](const Vector3d& f, const ImuState& state, const Vector3d&) {
        return Vector3d(f + 2.0 * state.ecef_from_sensor.rotation.transpose() *
                                earth_rate().cross(state.velocity_ecef_mps));
      });
}

/// Readings of the body's reference point. The state may be that of the sensor all the same.
void add_arm(const SensorSymptoms& symptoms, std::vector<SensorHypothesis>& hypotheses) {
  const Vector3d arm = symptoms.sensor.body_from_sensor.translation;
  constexpr double kSmallest_m = 1e-6;
  if (!(arm.norm() > kSmallest_m)) return;
  for (const bool is_state_right : {true, false}) {
    SensorHypothesis h;
    h.undo = [=](SensorRecord& imu, Cause& cause) {
      const Vector3d arm_sensor = imu.body_from_sensor.rotation.transpose() * arm;
      constexpr std::size_t kPlace = 12;
      for (std::size_t k = 0; is_state_right && k < imu.times_s.size(); ++k)
        if (const auto state = imu.imu_state(k))
          vector_of(imu, k, kPlace) -= state->ecef_from_sensor.rotation * arm_sensor;
      imu.body_from_sensor.translation.setZero();
      cause.name = "imu_arm";
      cause.size = arm.norm();
      cause.unit = "m";
      cause.words = fmt::format(
          "forces are those of the body's reference point: the lever arm of ({:.6g}, {:.6g}, "
          "{:.6g}) m is left out",
          arm.x(), arm.y(), arm.z());
      return true;
    };
    hypotheses.push_back(std::move(h));
  }
}

struct Instrument {
  const char* words;
  std::vector<std::size_t> columns;
};
const std::vector<Instrument>& instruments() {
  static const std::vector<Instrument> all = {{"turn rates", {kTrueTurn}},
                                              {"forces", {kTrueForce}},
                                              {"turn rates and forces", {kTrueTurn, kTrueForce}}};
  return all;
}

/// Turns all readings of some instruments by a rotation that depends on the state.
void add_turned(std::vector<SensorHypothesis>& hypotheses, const Instrument& of, const char* words,
                const std::function<Matrix3d(const ImuState&)>& right_from_wrong) {
  hypotheses.push_back(
      simple_cause("imu_frame", fmt::format("{} {}", of.words, words), 2, [=](SensorRecord& imu) {
        bool is_done = true;
        for (const std::size_t column : of.columns)
          is_done = is_done && change_readings(imu, column,
                                               [&](const Vector3d& reading, const ImuState& state,
                                                   const Vector3d&) -> Vector3d {
                                                 return right_from_wrong(state) * reading;
                                               });
        return is_done;
      }));
}

void add_frames(const SensorSymptoms& symptoms, std::vector<SensorHypothesis>& hypotheses) {
  const Matrix3d sensor_from_body = symptoms.sensor.body_from_sensor.rotation.transpose();
  const Matrix3d ecef_from_enu = ecef_from_local(symptoms.sequence.origin).rotation;
  for (const Instrument& of : instruments()) {
    if (!sensor_from_body.isIdentity(1e-9))
      add_turned(hypotheses, of, "are along the body's axes where the sensor's are meant",
                 [=](const ImuState&) { return sensor_from_body; });
    add_turned(hypotheses, of,
               "are along the world's axes (east, north, up) where the sensor's are meant",
               [=](const ImuState& state) -> Matrix3d {
                 return state.ecef_from_sensor.rotation.transpose() * ecef_from_enu;
               });
  }
}

/// Readings that follow from the states a step before and after, beside those that are there.
std::vector<VectorPair> predicted(const SensorRecord& imu, std::size_t column) {
  std::vector<VectorPair> pairs;
  constexpr std::size_t kMost = 400;
  const std::size_t stride = std::max<std::size_t>(1, imu.times_s.size() / kMost);
  for (std::size_t k = 1; k + 1 < imu.times_s.size(); k += stride) {
    const auto before = imu.imu_state(k - 1), now = imu.imu_state(k), after = imu.imu_state(k + 1);
    if (!before || !now || !after) return {};
    const Matrix3d sensor_from_ecef = now->ecef_from_sensor.rotation.transpose();
    const double between_s = 2.0 / imu.rate_hz;
    const Vector3d turn = rotation_vector(before->ecef_from_sensor.rotation.transpose() *
                                          after->ecef_from_sensor.rotation) /
                              between_s +
                          sensor_from_ecef * earth_rate();
    const Vector3d force =
        sensor_from_ecef * ((after->velocity_ecef_mps - before->velocity_ecef_mps) / between_s +
                            2.0 * earth_rate().cross(now->velocity_ecef_mps) -
                            normal_gravity_ecef_mps2(now->ecef_from_sensor.translation));
    const double* row = imu.row(k) + column;
    pairs.push_back({column == kTrueTurn ? turn : force, {row[0], row[1], row[2]}});
  }
  return pairs;
}

void add_axes(const SensorSymptoms& symptoms, std::vector<SensorHypothesis>& hypotheses) {
  const auto of_turn = exchange_of_axes(predicted(symptoms.sensor, kTrueTurn));
  const auto of_force = exchange_of_axes(predicted(symptoms.sensor, kTrueForce));
  const auto add_one = [&](const Instrument& of, const Matrix3d& wrong_from_right) {
    const bool is_sign = wrong_from_right == -Matrix3d::Identity();
    hypotheses.push_back(
        simple_cause(is_sign ? "imu_sign" : "imu_axes",
                     is_sign ? fmt::format("{} have the other sign", of.words)
                             : fmt::format("axes of {} are exchanged: {}", of.words,
                                           words_of_axes(wrong_from_right)),
                     1, [=](SensorRecord& imu) {
                       for (const std::size_t column : of.columns)
                         for (std::size_t k = 0; k < imu.times_s.size(); ++k)
                           vector_of(imu, k, column) =
                               wrong_from_right.transpose() * Vector3d(vector_of(imu, k, column));
                       return true;
                     }));
  };
  if (of_turn) add_one(instruments()[0], *of_turn);
  if (of_force) add_one(instruments()[1], *of_force);
  if (of_turn && of_force && *of_turn == *of_force) add_one(instruments()[2], *of_turn);
}

void add_units(std::vector<SensorHypothesis>& hypotheses) {
  struct Unit {
    std::size_t column;
    const char* words;
    double right_of_wrong;
  };
  for (const Unit& unit :
       {Unit{kTrueTurn, "turn rates are in degrees a second where radians are meant", kPi / 180.0},
        Unit{kTrueTurn, "turn rates are in degrees an hour where radians a second are meant",
             kPi / 180.0 / 3600.0},
        Unit{kTrueTurn, "turn rates were taken for degrees and turned into radians once too often",
             180.0 / kPi},
        Unit{kTrueForce, "forces are in g where m/s^2 are meant", kStandardGravity_mps2},
        Unit{kTrueForce, "forces are in mg where m/s^2 are meant", 1e-3 * kStandardGravity_mps2}})
    hypotheses.push_back(simple_cause("imu_unit", unit.words, 1, [=](SensorRecord& imu) {
      for (std::size_t k = 0; k < imu.times_s.size(); ++k)
        vector_of(imu, k, unit.column) *= unit.right_of_wrong;
      return true;
    }));
}

}  // namespace

void make_inertial_causes(const SensorSymptoms& symptoms,
                          std::vector<SensorHypothesis>& hypotheses) {
  const SensorRecord& imu = symptoms.sensor;
  if (imu.kind != "imu" || imu.num_channels < kEndOfTruth || imu.times_s.empty()) return;
  if (symptoms.fails("inertial")) {
    add_gravity(symptoms, hypotheses);
    add_earth(hypotheses);
    add_arm(symptoms, hypotheses);
    add_frames(symptoms, hypotheses);
    add_axes(symptoms, hypotheses);
    add_units(hypotheses);
    add_late(symptoms, kTrueTurn, kEndOfTruth, "readings", hypotheses);
  }
  if (symptoms.fails("sensors"))
    add_late(symptoms, 0, imu.num_channels, "readings and states", hypotheses);
}

}  // namespace terracast::validate
