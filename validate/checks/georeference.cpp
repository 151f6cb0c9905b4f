#include <fmt/format.h>

#include "validate/checks/checker.h"

/// Poses of the format's files, placed by the origin of their local frame on WGS84, against the
/// rows of georeference.csv.
namespace terracast::validate {

namespace {

class GeoreferenceChecker : public Checker {
 public:
  std::vector<CheckResult> finish(const Dataset&, const Sequence& sequence) override {
    CheckResult position;
    position.name = "georeference_position";
    position.bound = 1e-3;
    position.unit = "m";
    CheckResult rotation;
    rotation.name = "georeference_rotation";
    rotation.bound = 1e-3;
    rotation.unit = "deg";
    CheckResult time;
    time.name = "georeference_time";
    time.bound = 1e-4;
    time.unit = "s";
    CheckResult mount;
    mount.name = "georeference_rigidity";
    mount.bound = 1e-3;
    mount.unit = "deg";
    CheckResult origin;
    origin.name = "georeference_origin";
    origin.bound = kOriginBound_m;
    origin.unit = "m";
    const Pose ecef_from_local_frame = ecef_from_local(sequence.origin);
    std::size_t num_rows = 0;
    for (const Camera& camera : sequence.cameras)
      for (std::size_t i = 0; i < camera.georeference.size(); ++i) {
        if (!camera.georeference[i]) continue;
        const Georeference& row = *camera.georeference[i];
        const std::string where = fmt::format("{}, frame {}", camera.name, i);
        note_worst(time, std::abs(row.time_s - static_cast<double>(i) / sequence.rate_hz), where);
        if (i < sequence.times_s.size())
          note_worst(time, std::abs(row.time_s - sequence.times_s[i]),
                     where + " (the format's own times)");
        const Eigen::Matrix3d ecef_from_camera =
            enu_from_ecef(row.place).transpose() * row.enu_from_camera;
        if (const Camera& first = sequence.cameras[0];
            camera.body_from_camera && first.body_from_camera && first.georeference[i]) {
          const Eigen::Matrix3d ecef_from_first =
              enu_from_ecef(first.georeference[i]->place).transpose() *
              first.georeference[i]->enu_from_camera;
          const Eigen::Matrix3d body =
              ecef_from_camera * camera.body_from_camera->rotation.transpose();
          const Eigen::Matrix3d first_body =
              ecef_from_first * first.body_from_camera->rotation.transpose();
          note_worst(mount, degrees_from_radians(rotation_angle_rad(body.transpose() * first_body)),
                     where);
        }
        if (i == 0 && camera.body_from_camera) {
          const Eigen::Vector3d body_local =
              ecef_from_local_frame.inverse() *
              (ecef_from_geodetic(row.place) - ecef_from_camera *
                                                   camera.body_from_camera->rotation.transpose() *
                                                   camera.body_from_camera->translation);
          note_worst(origin, body_local.norm(),
                     fmt::format("{}: ({:.3f}, {:.3f}, {:.3f}) m east, north and up of the origin",
                                 where, body_local.x(), body_local.y(), body_local.z()));
        }
        if (!camera.local_from_camera[i]) continue;
        ++num_rows;
        const Pose posed = ecef_from_local_frame * *camera.local_from_camera[i];
        note_worst(position, (posed.translation - ecef_from_geodetic(row.place)).norm(), where);
        note_worst(
            rotation,
            degrees_from_radians(rotation_angle_rad(posed.rotation.transpose() * ecef_from_camera)),
            where);
      }
    position.summary = fmt::format(
        "Camera centres of {} poses, by the origin ({:.6f}, {:.6f}, {:.1f} m) and WGS84, against "
        "georeference.csv.",
        num_rows, sequence.origin.lat_deg, sequence.origin.lon_deg, sequence.origin.height_m);
    position.reason = "13 decimals of a degree are 1e-8 m, and poses hold at least nine digits.";
    position.detects = "2 mm; a pose row of another frame; a datum, an axis or a sign";
    rotation.summary =
        "Rotations of the same poses against those of the file (in the ENU of each place).";
    rotation.reason =
        "Nine digits leave 1e-7 deg; the turn of the ENU between origin and camera is 1e-5 deg a "
        "metre.";
    rotation.detects = "0.01 deg";
    time.summary = fmt::format("Time stamps against frame / {} Hz, and against the format's own.",
                               sequence.rate_hz);
    time.reason = "Times of seven digits are good to 1e-5 s.";
    time.detects = "one frame of time";
    mount.summary =
        "The body's rotation, found from each camera and its mount of dataset.json, is the same "
        "for all cameras.";
    mount.reason = rotation.reason;
    mount.detects = "0.01 deg of one mount";
    origin.summary =
        "The body's first place, by georeference.csv and the mounts of dataset.json, against the "
        "origin of the local frame.";
    origin.reason =
        "The origin is that place, rounded to 1e-6 degrees and whole metres: 0.52 m at most.";
    origin.detects =
        "heights above the geoid in one of the two; an arc-second; latitude for longitude";
    if (!sequence.cameras.empty()) {
      CheckResult::Plot map{"trajectory, seen from above", "east, m", "north, m", {}, {}};
      CheckResult::Plot height{"height above the origin", "frame", "m", {}, {}};
      const auto& poses = sequence.cameras[0].local_from_camera;
      for (std::size_t i = 0; i < poses.size(); ++i) {
        if (!poses[i]) continue;
        map.x.push_back(poses[i]->translation.x());
        map.y.push_back(poses[i]->translation.y());
        height.x.push_back(static_cast<double>(i));
        height.y.push_back(poses[i]->translation.z());
      }
      position.plots = {map, height};
    }
    std::vector<CheckResult> results{position, rotation, time, mount, origin};
    for (CheckResult& result : results) result.ok = result.value <= result.bound;
    if (num_rows == 0)
      for (CheckResult& result : results) {
        result.ok = false;
        result.worst = "no pose has a row in georeference.csv";
      }
    else if (sequence.has_poses_of_rows)
      for (CheckResult* result : {&results[0], &results[1]}) {
        std::vector<CheckResult::Plot> plots = std::move(result->plots);
        *result =
            unseen_result(result->name, "the format has no poses but those of georeference.csv");
        result->plots = std::move(plots);
      }
    return results;
  }
};

}  // namespace

std::unique_ptr<Checker> make_georeference_check(const ValidateOptions&) {
  return std::make_unique<GeoreferenceChecker>();
}

}  // namespace terracast::validate
