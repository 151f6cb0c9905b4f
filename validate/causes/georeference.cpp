#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "validate/causes/height_fault.h"
#include "validate/causes/trial.h"
#include "validate/sampling.h"

/// Places on WGS84: georeference.csv, the origin of the local frame, and KITTI raw's packets.
namespace terracast::validate {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

const std::vector<std::string_view> kJudges = {"georeference", "georeference_origin", "oxts",
                                               "reprojection"};

/// Who says the places that are off.
enum class Where { Rows, Origin, Packets, RowsOrOrigin };
const char* words_of(Where where) {
  return where == Where::Rows      ? "georeference.csv"
         : where == Where::Origin  ? "origin in dataset.json"
         : where == Where::Packets ? "OXTS packets"
                                   : "georeference.csv against the origin in dataset.json";
}

/// Places poses again: KITTI's by the first row that there is, KITTI raw's by their packets and the
/// origin. Others hold their own.
class Placing {
 public:
  explicit Placing(const Trial& trial) {
    const Pose ecef_from_frame = ecef_from_local(trial.sequence.origin);
    for (const Camera& camera : trial.sequence.cameras) {
      imu_from_camera_.emplace_back();
      if (trial.sequence.oxts.empty() || !trial.sequence.oxts[0] ||
          camera.local_from_camera.empty() || !camera.local_from_camera[0])
        continue;
      imu_from_camera_.back() = trial.sequence.oxts[0]->ecef_from_imu().inverse() *
                                ecef_from_frame * *camera.local_from_camera[0];
    }
  }

  void place(Trial& trial) const {
    const Pose local_from_ecef = ecef_from_local(trial.sequence.origin).inverse();
    if (trial.dataset->format == "kitti_raw") {
      for (std::size_t c = 0; c < imu_from_camera_.size(); ++c) {
        if (!imu_from_camera_[c]) continue;
        auto& poses = trial.sequence.cameras[c].local_from_camera;
        for (std::size_t f = 0; f < poses.size() && f < trial.sequence.oxts.size(); ++f)
          if (trial.sequence.oxts[f])
            poses[f] =
                local_from_ecef * trial.sequence.oxts[f]->ecef_from_imu() * *imu_from_camera_[c];
      }
    } else if (trial.dataset->format == "kitti") {
      for (const Camera& camera : trial.sequence.cameras) {
        std::size_t f = 0;
        const std::size_t count =
            std::min(camera.georeference.size(), camera.local_from_camera.size());
        while (f < count && !(camera.georeference[f] && camera.local_from_camera[f])) ++f;
        if (f == count) continue;
        const Georeference& row = *camera.georeference[f];
        const Pose right =
            local_from_ecef * Pose{enu_from_ecef(row.place).transpose() * row.enu_from_camera,
                                   ecef_from_geodetic(row.place)};
        const Pose moved = right * camera.local_from_camera[f]->inverse();
        for (Camera& other : trial.sequence.cameras)
          for (auto& pose : other.local_from_camera)
            if (pose) pose = moved * *pose;
        trial.local_from_first = moved * trial.local_from_first;
        return;
      }
    }
  }

 private:
  std::vector<std::optional<Pose>> imu_from_camera_;
};

/// Changes the places of one of those who say them.
using Change = std::function<Geodetic(const Geodetic&)>;
void change_places(Trial& trial, Where where, const Change& change) {
  const Placing placing(trial);
  if (where == Where::Rows || where == Where::RowsOrOrigin)
    for (Camera& camera : trial.sequence.cameras)
      for (auto& row : camera.georeference)
        if (row) row->place = change(row->place);
  if (where == Where::Origin) trial.sequence.origin = change(trial.sequence.origin);
  if (where == Where::Packets)
    for (auto& packet : trial.sequence.oxts)
      if (packet) packet->place = change(packet->place);
  placing.place(trial);
}

void add(std::vector<Hypothesis>& hypotheses, const char* name, Where where, int rank, double size,
         const char* unit, const std::string& words, const Change& change) {
  Hypothesis h;
  h.checks = kJudges;
  h.rank = rank + (where == Where::RowsOrOrigin ? 0 : static_cast<int>(where));
  h.undo = [=](Trial& trial, Cause& cause) {
    if (where == Where::Packets && trial.sequence.oxts.empty()) return false;
    change_places(trial, where, change);
    cause.name = name;
    cause.size = size;
    cause.unit = unit;
    cause.words = fmt::format("{}: {}", words_of(where), words);
    return true;
  };
  hypotheses.push_back(std::move(h));
}

/// Where the rows put the cameras (or the body, against the origin), less where they are: in
/// degrees and metres, by medians.
struct Offset {
  double lat_deg = 0.0, lon_deg = 0.0, height_m = 0.0;
};
std::optional<Offset> offset_of(const Trial& trial, bool is_of_origin) {
  const Pose ecef_from_frame = ecef_from_local(trial.sequence.origin);
  std::vector<double> lat, lon, height;
  for (const Camera& camera : trial.sequence.cameras)
    for (std::size_t f = 0; f < camera.georeference.size(); ++f) {
      if (!camera.georeference[f]) continue;
      const Georeference& row = *camera.georeference[f];
      Geodetic right;
      Geodetic found = row.place;
      if (is_of_origin) {
        if (f > 0 || trial.first_frame > 0 || !camera.body_from_camera) continue;
        const Matrix3d ecef_from_camera =
            enu_from_ecef(row.place).transpose() * row.enu_from_camera;
        found =
            geodetic_from_ecef(ecef_from_geodetic(row.place) -
                               ecef_from_camera * camera.body_from_camera->rotation.transpose() *
                                   camera.body_from_camera->translation);
        right = trial.sequence.origin;
      } else {
        if (f >= camera.local_from_camera.size() || !camera.local_from_camera[f]) continue;
        right = geodetic_from_ecef((ecef_from_frame * *camera.local_from_camera[f]).translation);
      }
      lat.push_back(found.lat_deg - right.lat_deg);
      lon.push_back(found.lon_deg - right.lon_deg);
      height.push_back(found.height_m - right.height_m);
    }
  if (lat.empty()) return std::nullopt;
  return Offset{median(lat), median(lon), median(height)};
}

/// Constant offsets, found against the poses, or where these agree (KITTI's are placed by the rows)
/// against the origin, which is the first place rounded.
void add_offsets(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  const Trial& trial = symptoms.trial;
  const bool is_of_origin = !symptoms.fails_result("georeference_position");
  const std::optional<Offset> offset = offset_of(trial, is_of_origin);
  if (!offset) return;
  const double north_m = 111132.0 * offset->lat_deg;
  const double east_m =
      111320.0 * std::cos(radians_from_degrees(trial.sequence.origin.lat_deg)) * offset->lon_deg;
  // The origin is rounded to a metre and 1e-6 degrees.
  const double least_m = is_of_origin ? 1.0 : 5e-4;
  const double height_m = std::abs(offset->height_m) > least_m ? offset->height_m : 0.0;
  const double lat_deg = std::abs(north_m) > least_m ? offset->lat_deg : 0.0;
  const double lon_deg = std::abs(east_m) > least_m ? offset->lon_deg : 0.0;
  const char* about = is_of_origin ? "about " : "";
  // Packets are a third witness. Without them rows and origin are told apart only by the turn of
  // the axes on the way, which `georeference_rotation` sees from 111 m on; KITTI's rows carry the
  // poses along.
  constexpr double kTold_m = 111.0;
  const bool is_either = trial.sequence.oxts.empty() && (trial.dataset->format == "kitti" ||
                                                         std::hypot(north_m, east_m) < kTold_m);
  const std::vector<Where> places = is_either
                                        ? std::vector{Where::RowsOrOrigin}
                                        : std::vector{Where::Rows, Where::Origin, Where::Packets};
  for (const Where where : places) {
    // Rows that are off one way are an origin or packets that are off the other way. Packets that
    // agree with neither are off by the same as the poses.
    const double sign = where == Where::Rows || where == Where::RowsOrOrigin ? 1.0 : -1.0;
    if (height_m != 0.0 && lat_deg == 0.0 && lon_deg == 0.0) {
      const double off_m = sign * height_m;
      const HeightFault fault = height_fault(trial, off_m);
      const std::string words =
          words_of_heights(fault, off_m, about,
                           where == Where::RowsOrOrigin
                               ? "the geoid's height added twice, or left out of the origin?"
                               : "the geoid's height added twice, or left out elsewhere?");
      add(hypotheses, fault == HeightFault::Geoid ? "geoid" : "height_offset", where, 1, off_m, "m",
          words, [off_m](const Geodetic& p) {
            return Geodetic{p.lat_deg, p.lon_deg, p.height_m - off_m};
          });
    } else if (lat_deg != 0.0 || lon_deg != 0.0) {
      const double arcseconds_lat = 3600.0 * sign * lat_deg,
                   arcseconds_lon = 3600.0 * sign * lon_deg;
      if (std::abs(arcseconds_lat) > 3600.0 || std::abs(arcseconds_lon) > 3600.0) continue;
      std::string words = "places are off by ";
      if (lat_deg != 0.0)
        words += fmt::format("{}{:.2f} arc-seconds of latitude ({:.1f} m)", about, arcseconds_lat,
                             sign * north_m);
      if (lon_deg != 0.0)
        words += fmt::format("{}{}{:.2f} arc-seconds of longitude ({:.1f} m)",
                             lat_deg != 0.0 ? " and " : "", about, arcseconds_lon, sign * east_m);
      if (height_m != 0.0) words += fmt::format(" and {:.2f} m of height", sign * height_m);
      const double lat_off = sign * lat_deg, lon_off = sign * lon_deg, h_off = sign * height_m;
      add(hypotheses, "place_offset", where, 2, std::hypot(north_m, east_m), "m", words,
          [=](const Geodetic& p) {
            return Geodetic{p.lat_deg - lat_off, p.lon_deg - lon_off, p.height_m - h_off};
          });
    }
  }
}

/// Rotations of georeference.csv: order, axes, inverse.
void add_rotations(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  if (symptoms.trial.dataset->format == "kitti_raw" && symptoms.fails("oxts")) return;
  struct Turn {
    const char* name;
    const char* words;
    std::function<Matrix3d(const Matrix3d&)> undo;
  };
  Matrix3d swap;
  swap << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  const std::vector<Turn> turns = {
      {"quaternion_order", "quaternions stand as x y z w where w x y z is meant",
       [](const Matrix3d& r) {
         const Eigen::Quaterniond q(r);
         return Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()).toRotationMatrix();
       }},
      {"pose_inverted",
       "rotations are inverted (camera from world where world from camera is meant)",
       [](const Matrix3d& r) -> Matrix3d { return r.transpose(); }},
      {"pose_axes", "rotations lead into north, east, down where east, north, up is meant",
       [swap](const Matrix3d& r) -> Matrix3d { return swap * r; }}};
  for (const Turn& turn : turns) {
    Hypothesis h;
    h.checks = kJudges;
    h.rank = 2;
    h.undo = [turn](Trial& trial, Cause& cause) {
      const Placing placing(trial);
      for (Camera& camera : trial.sequence.cameras)
        for (auto& row : camera.georeference)
          if (row) row->enu_from_camera = turn.undo(row->enu_from_camera);
      placing.place(trial);
      cause.name = turn.name;
      cause.words = fmt::format("georeference.csv: {}", turn.words);
      return true;
    };
    hypotheses.push_back(std::move(h));
  }
}

/// Times of single rows that are not their frames'.
void add_times_of_rows(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  if (!symptoms.fails_result("georeference_time")) return;
  Hypothesis h;
  h.checks = {"georeference"};
  h.rank = 1;
  h.undo = [](Trial& trial, Cause& cause) {
    constexpr double kSame_s = 1e-4;  // as the check allows
    std::size_t num_rows = 0, num_wrong = 0;
    for (Camera& camera : trial.sequence.cameras)
      for (std::size_t f = 0; f < camera.georeference.size(); ++f) {
        if (!camera.georeference[f]) continue;
        ++num_rows;
        double& time_s = camera.georeference[f]->time_s;
        const double off_s = time_s - static_cast<double>(f) / trial.sequence.rate_hz;
        if (std::abs(off_s) <= kSame_s) continue;
        time_s -= off_s;
        if (++num_wrong > 1) continue;
        cause.camera = camera.name;
        cause.frame = trial.first_frame + static_cast<int>(f);
        cause.size = off_s;
        cause.words = fmt::format("georeference.csv: the time of {}, frame {} is off by {:.4g} s",
                                  camera.name, cause.frame, off_s);
      }
    cause.name = "time_row";
    cause.unit = "s";
    if (num_wrong > 1) cause.words += fmt::format(", and those of {} more rows", num_wrong - 1);
    return num_wrong > 0 && 3 * num_wrong <= num_rows;
  };
  hypotheses.push_back(std::move(h));
}

/// Places of single rows that are not where their poses are; more than a third of all is no single mistake.
void add_rows(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  if (!symptoms.fails_result("georeference_position")) return;
  Hypothesis h;
  h.checks = {"georeference"};
  h.rank = 1;
  h.undo = [](Trial& trial, Cause& cause) {
    constexpr double kSame_m = 1e-3;  // as the check allows
    const Pose ecef_from_frame = ecef_from_local(trial.sequence.origin);
    std::size_t num_rows = 0, num_wrong = 0;
    for (Camera& camera : trial.sequence.cameras)
      for (std::size_t f = 0; f < camera.georeference.size(); ++f) {
        if (!camera.georeference[f] || f >= camera.local_from_camera.size() ||
            !camera.local_from_camera[f])
          continue;
        ++num_rows;
        Georeference& row = *camera.georeference[f];
        const Vector3d right_ecef = (ecef_from_frame * *camera.local_from_camera[f]).translation;
        const Vector3d off_m =
            enu_from_ecef(row.place) * (ecef_from_geodetic(row.place) - right_ecef);
        if (off_m.norm() <= kSame_m) continue;
        row.place = geodetic_from_ecef(right_ecef);
        if (++num_wrong > 1) continue;
        cause.camera = camera.name;
        cause.frame = trial.first_frame + static_cast<int>(f);
        cause.size = off_m.norm();
        cause.words = fmt::format(
            "georeference.csv: the place of {}, frame {} is off by ({:.3g}, {:.3g}, {:.3g}) m to "
            "the east, north and up",
            camera.name, cause.frame, off_m.x(), off_m.y(), off_m.z());
      }
    cause.name = "place_row";
    cause.unit = "m";
    if (num_wrong > 1) cause.words += fmt::format("; {} more are off", num_wrong - 1);
    return num_wrong > 0 && 3 * num_wrong <= num_rows;
  };
  hypotheses.push_back(std::move(h));
}

/// Rows of another frame.
void add_shifts(std::vector<Hypothesis>& hypotheses) {
  for (const int shift : {1, -1}) {
    Hypothesis h;
    h.checks = kJudges;
    h.rank = 5;
    h.undo = [shift](Trial& trial, Cause& cause) {
      const Placing placing(trial);
      for (Camera& camera : trial.sequence.cameras) {
        const auto old = camera.georeference;
        for (std::size_t f = 0; f < old.size(); ++f) {
          const auto from = static_cast<std::ptrdiff_t>(f) - shift;
          if (from < 0 || from >= static_cast<std::ptrdiff_t>(old.size()) ||
              !old[static_cast<std::size_t>(from)] || !old[f]) {
            camera.georeference[f].reset();
            continue;
          }
          camera.georeference[f] = old[static_cast<std::size_t>(from)];
          camera.georeference[f]->time_s = old[f]->time_s;
        }
      }
      placing.place(trial);
      cause.name = "georeference_shifted";
      cause.size = shift;
      cause.unit = "frames";
      cause.words = fmt::format(
          "georeference.csv: places and rotations are shifted by 1 frame: each is that of the "
          "frame {}",
          shift > 0 ? "after" : "before");
      return true;
    };
    hypotheses.push_back(std::move(h));
  }
}

/// Latitudes and longitudes as 32-bit floats: half a step of 42 degrees is 0.2 m.
void add_float32(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  const auto is_single = [](double value) {
    return std::abs(static_cast<double>(static_cast<float>(value)) - value) < 1e-12;
  };
  for (const Where where : {Where::Rows, Where::Packets}) {
    std::size_t num_single = 0, count = 0;
    const auto look = [&](const Geodetic& place) {
      ++count;
      if (is_single(place.lat_deg) && is_single(place.lon_deg)) ++num_single;
    };
    if (where == Where::Rows) {
      for (const Camera& camera : symptoms.trial.sequence.cameras)
        for (const auto& row : camera.georeference)
          if (row) look(row->place);
    } else {
      for (const auto& packet : symptoms.trial.sequence.oxts)
        if (packet) look(packet->place);
    }
    if (count < 2 || num_single != count) continue;
    Hypothesis h;
    h.checks = {"georeference", "oxts", "reprojection"};
    h.rank = 0;
    h.marks = {"georeference", "georeference_origin", "oxts",
               "reprojection", "trajectory",          "photometric"};
    h.undo = [where](Trial&, Cause& cause) {
      cause.name = "place_float32";
      cause.words = fmt::format(
          "{}: latitude and longitude are rounded to 32-bit floats, which are 0.1 to 1 m apart",
          words_of(where));
      return true;
    };
    hypotheses.push_back(std::move(h));
  }
}

/// Places in metres, where these read as latitudes and longitudes near 0.
void add_axes(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  const Pose ecef_from_frame = ecef_from_local(symptoms.trial.sequence.origin);
  add(hypotheses, "place_axes", Where::Rows, 1, 0.0, "",
      "places are metres east, north, up where latitude, longitude and height are meant",
      [=](const Geodetic& p) {
        return geodetic_from_ecef(ecef_from_frame * Vector3d(p.lat_deg, p.lon_deg, p.height_m));
      });
  add(hypotheses, "place_axes", Where::Rows, 1, 0.0, "",
      "places are metres north, east, down where latitude, longitude and height are meant",
      [=](const Geodetic& p) {
        return geodetic_from_ecef(ecef_from_frame * Vector3d(p.lon_deg, p.lat_deg, -p.height_m));
      });
}

/// Numbers that the reader refused as places: "…: latitude 4708927.2, longitude 123308.1, height 4287525.6 is no place".
void add_no_places(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  for (const CheckResult& result : symptoms.failed) {
    if (result.name != "structure" || result.worst.find(kUnfitPlace[0]) == std::string::npos)
      continue;
    Vector3d found;
    const std::size_t at = result.worst.find(": latitude ");
    if (at == std::string::npos ||
        std::sscanf(result.worst.c_str() + at, ": latitude %lf, longitude %lf, height %lf",
                    &found[0], &found[1], &found[2]) != 3)
      continue;
    const Geodetic& origin = symptoms.trial.sequence.origin;
    constexpr double kNear_m = 1e6;
    if ((found - ecef_from_geodetic(origin)).norm() > kNear_m) continue;
    Hypothesis h;
    h.checks = {"structure"};
    h.marks = {"structure", "georeference", "georeference_origin", "trajectory"};
    h.undo = [](Trial&, Cause& cause) {
      cause.name = "place_axes";
      cause.explains = kUnfitPlace;
      cause.words =
          "georeference.csv: places are Earth-centred x, y, z (ECEF) where latitude, longitude and "
          "height are meant";
      return true;
    };
    hypotheses.push_back(std::move(h));
  }
}

}  // namespace

void make_georeference_causes(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  if (!symptoms.fails("georeference") && !symptoms.fails("georeference_origin") &&
      !symptoms.fails("oxts"))
    return;
  const Trial& trial = symptoms.trial;
  add_float32(symptoms, hypotheses);
  for (const Where where : {Where::Rows, Where::Origin, Where::Packets}) {
    add(hypotheses, "lat_lon_swapped", where, 1, 0.0, "", "latitude and longitude are swapped",
        [](const Geodetic& p) {
          return Geodetic{p.lon_deg, p.lat_deg, p.height_m};
        });
    add(hypotheses, "place_unit", where, 1, 0.0, "",
        "latitude and longitude are in radians where degrees are meant", [](const Geodetic& p) {
          return Geodetic{degrees_from_radians(p.lat_deg), degrees_from_radians(p.lon_deg),
                          p.height_m};
        });
  }
  add_axes(symptoms, hypotheses);
  add_no_places(symptoms, hypotheses);
  add_offsets(symptoms, hypotheses);
  add_rotations(symptoms, hypotheses);
  add_rows(symptoms, hypotheses);
  add_times_of_rows(symptoms, hypotheses);
  if (trial.num_frames() > 2) add_shifts(hypotheses);
}

}  // namespace terracast::validate
