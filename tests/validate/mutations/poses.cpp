#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numbers>

#include "core/json.h"
#include "tests/validate/analytic_writer.h"
#include "tests/validate/mutations/edits.h"

namespace terracast::test {

void add_pose_mutations(std::vector<Mutation>& list) {
  const Catalogue add(list);
  add(
      "PosesInverted", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_raw_poses(d, folder, [](Matrix3d& r, Vector3d& t) {
          t = -(r.transpose() * t);
          r.transposeInPlace();
        });
      },
      says({"poses", "are inverted"}));
  add(
      "RotationsTransposed", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_raw_poses(d, folder, [](Matrix3d& r, Vector3d&) { r.transposeInPlace(); });
      },
      says({"poses", "transposed rotations"}));
  add(
      "QuaternionOrder", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        if (d.format == "colmap") {
          Mistake mistake;
          mistake.colmap.raw_pose = [](Quaterniond& q, Vector3d&) {
            q = Quaterniond(q.x(), q.y(), q.z(), q.w());
          };
          write_colmap(d.recording, folder, mistake);
        } else if (is_tartan(d)) {
          for (const SceneCamera& camera : d.recording.cameras) {
            const fs::path file = folder / sequence_path(d) / ("pose_" + camera.name + ".txt");
            std::vector<std::string> lines = lines_of(file);
            for (std::string& line : lines) {
              const std::vector<double> n = numbers_of(line);
              line = joined({n[0], n[1], n[2], n[6], n[3], n[4], n[5]});
            }
            write_lines(file, lines);
          }
        } else {
          edit_georeference(d, folder, [](std::array<double, 8>& row) {
            row = {row[0], row[1], row[2], row[3], row[5], row[6], row[7], row[4]};
          });
        }
      },
      [](const RightDataset& d) {
        return Expected{{is_tartan(d)           ? "quaternions that stand as w x y z"
                         : d.format == "colmap" ? "quaternions that stand as x y z w"
                                                : "quaternions stand as x y z w"},
                        std::nullopt,
                        0.0};
      });
  add(
      "FlippedAxis", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_raw_poses(d, folder, [](Matrix3d&, Vector3d& t) { t.y() = -t.y(); });
      },
      says({"flipped axis", "y of the positions has the opposite sign"}));
  add(
      "CameraAxes", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        const bool is_relative = d.format.starts_with("kitti");
        edit_raw_poses(d, folder, [&](Matrix3d& r, Vector3d& t) {
          const Matrix3d up_and_back = Vector3d(1, -1, -1).asDiagonal();
          // Camera to world; COLMAP's are the other way round, KITTI's between two cameras.
          if (d.format == "colmap" || is_relative) {
            r = up_and_back * r;
            t = up_and_back * t;
          }
          if (d.format != "colmap") r = r * up_and_back;
        });
      },
      [](const RightDataset& d) {
        // Straight ahead nothing turns and nothing moves to the side: that y and z are flipped is
        // that the way is.
        const bool is_inversion = d.path == Path::Straight && d.format.starts_with("kitti");
        return Expected{{is_inversion ? "poses are inverted" : "axes"}, std::nullopt, 0.0};
      });
  add(
      "NedForEnu", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        Matrix3d swap;
        swap << 0, 1, 0, 1, 0, 0, 0, 0, -1;
        if (is_tartan(d)) {
          edit_raw_poses(d, folder, [&](Matrix3d& r, Vector3d& t) {
            r = swap * r;
            t = swap * t;
          });
        } else if (d.format == "colmap") {
          edit_raw_poses(d, folder, [&](Matrix3d& r, Vector3d&) { r = r * swap; });
        } else if (d.format == "kitti") {
          edit_georeference(d, folder, [&](std::array<double, 8>& row) {
            const Quaterniond q(
                Matrix3d(swap * Quaterniond(row[4], row[5], row[6], row[7]).toRotationMatrix()));
            row = {row[0], row[1], row[2], row[3], q.w(), q.x(), q.y(), q.z()};
          });
        } else {
          edit_packets(d, folder, [](std::vector<double>& n) {
            n[4] = -n[4];
            n[5] = 0.5 * std::numbers::pi - n[5];
          });
        }
      },
      says({"east, north, up", "north, east, down"}));
  add(
      "PositionAxesSwapped", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_raw_poses(d, folder,
                       [](Matrix3d&, Vector3d& t) { t = Vector3d(t.y(), t.x(), t.z()); });
      },
      says({"poses", "positions in other axes: (y, x, z) is meant"}));
  add(
      "OtherCameraAxes", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        // Right, down, forward in TartanAir's rows, forward, left, up in the others.
        Matrix3d frd_from_rdf, flu_from_rdf;
        frd_from_rdf << 0, 0, 1, 1, 0, 0, 0, 1, 0;
        flu_from_rdf << 0, 0, 1, -1, 0, 0, 0, -1, 0;
        edit_raw_poses(d, folder, [&](Matrix3d& r, Vector3d& t) {
          if (is_tartan(d)) {
            r = r * frd_from_rdf;
            return;
          }
          r = flu_from_rdf * r;
          t = flu_from_rdf * t;
          if (d.format != "colmap") r = r * flu_from_rdf.transpose();
        });
      },
      [](const RightDataset& d) {
        // Where nothing turns only positions show axes.
        const bool is_relative = d.path == Path::Straight && d.format.starts_with("kitti");
        return Expected{
            {"poses", is_relative    ? "positions in other axes: "
                      : is_tartan(d) ? "right, down, forward where forward, right, down is meant"
                                     : "forward, left, up where right, down, forward is meant"},
            std::nullopt,
            0.0};
      });
  struct Unit {
    const char* name;
    const char* words;
    double factor;
  };
  for (const Unit& unit : {Unit{"PosesInMillimetres", "in millimetres where metres are meant", 1e3},
                           Unit{"PosesInCentimetres", "in centimetres where metres are meant", 1e2},
                           Unit{"PosesInKilometres", "in kilometres where metres are meant", 1e-3},
                           Unit{"PosesInFeet", "in feet where metres are meant", 1.0 / 0.3048}})
    add(
        unit.name, kAll,
        [unit](const RightDataset& d, const fs::path& folder) {
          edit_raw_poses(d, folder, [&](Matrix3d&, Vector3d& t) { t *= unit.factor; });
        },
        says({"poses", unit.words}, unit.factor, 1e-9));
  const auto shift_poses = [](std::size_t more, std::size_t less) {
    return [=](const RightDataset& d, const fs::path& folder) {
      write_poses(d, folder, [&](std::size_t c, std::size_t f) {
        return true_pose(d, c, f + more - std::min(f + more, less));
      });
    };
  };
  add("PosesShifted", kAll, shift_poses(1, 0),
      says({"poses", "shifted by 1 frame", "frame after"}, 1.0, 0.0));
  add("PosesShiftedByTwo", kAll, shift_poses(2, 0),
      says({"poses", "shifted by 2 frames", "frame after"}, 2.0, 0.0));
  add("PosesShiftedBack", kAll, shift_poses(0, 1),
      says({"poses", "shifted by 1 frame", "frame before"}, -1.0, 0.0));
  add(
      "AllPosesShifted", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        // All that says where cameras are, from the same origin.
        RightDataset later = d;
        const Vector3d step = d.longer.body_world[1] - d.longer.body_world[0];
        const auto start_later = [](auto& values) { values.erase(values.begin()); };
        Recording& path = later.longer;
        start_later(path.body_world);
        start_later(path.world_from_body);
        start_later(path.velocity_mps);
        start_later(path.acceleration_mps2);
        start_later(path.rate_body_radps);
        for (Vector3d& place : path.body_world) place -= step;
        if (is_tartan(d)) {
          const auto pose = [&](std::size_t c, std::size_t f) { return true_pose(later, c, f); };
          write_poses(later, folder, pose);
          write_georeference(later, folder, pose);
          return;
        }
        const auto count = static_cast<std::ptrdiff_t>(d.recording.body_world.size());
        const auto take = [&](auto& values, const auto& from) {
          values.assign(from.begin(), from.begin() + count);
        };
        take(later.recording.body_world, path.body_world);
        take(later.recording.world_from_body, path.world_from_body);
        take(later.recording.velocity_mps, path.velocity_mps);
        take(later.recording.acceleration_mps2, path.acceleration_mps2);
        take(later.recording.rate_body_radps, path.rate_body_radps);
        if (d.format == "kitti") write_kitti(later.recording, folder);
        if (d.format == "kitti_raw") write_kitti_raw(later.recording, folder);
        if (d.format == "colmap") write_colmap(later.recording, folder);
      },
      [](const RightDataset& d) {
        return Expected{
            {d.format == "kitti_raw" ? "OXTS packets" : "poses",
             "georeference.csv are shifted by 1 frame: each is that of the frame after"},
            1.0,
            0.0};
      });
  add(
      "PoseRowOff", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        write_poses(d, folder, [&](std::size_t c, std::size_t f) {
          SaidPose pose = true_pose(d, c, f);
          if (f == 2) pose.centre += 0.25 * pose.rotation.col(0);
          return pose;
        });
      },
      says({"the pose of frame 2 is wrong: it is off by 0.25 m and 0 deg"}));
  add(
      "PoseRowTwice", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        write_poses(d, folder,
                    [&](std::size_t c, std::size_t f) { return true_pose(d, c, f == 2 ? 1 : f); });
      },
      says({"the pose of frame 2 is wrong", "that of frame 1"}));
  add(
      "Float32", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        if (!is_tartan(d)) {
          if (d.format == "kitti_raw")
            edit_packets(d, folder, [&](std::vector<double>& n) {
              n[0] = single(n[0]);
              n[1] = single(n[1]);
            });
          else
            edit_georeference(d, folder, [&](std::array<double, 8>& row) {
              row[1] = single(row[1]);
              row[2] = single(row[2]);
            });
          return;
        }
        // Poses about an origin 40 km to the west.
        const Vector3d far_scene(-40000.0, 0.0, 0.0);
        const ScenePlace place = place_of_scene(far_scene);
        const Matrix3d enu = enu_from_scene(place);
        write_poses(d, folder, [&](std::size_t c, std::size_t f) {
          const SaidPose p = true_pose(d, c, f);
          const Vector3d centre = enu * (p.centre - far_scene);
          return SaidPose{enu * p.rotation,
                          {single(centre.x()), single(centre.y()), single(centre.z())}};
        });
        edit_stated(folder, [&](core::Json& sequence) {
          sequence.set("origin", core::Json::object()
                                     .set("lat_deg", place.lat_deg)
                                     .set("lon_deg", place.lon_deg)
                                     .set("height_m", place.height_m));
        });
      },
      says({"32-bit floats"}));
  add(
      "TranslationsOfFloat32", {"colmap"},
      [](const RightDataset& d, const fs::path& folder) {
        Recording far = d.recording;
        for (Vector3d& place : far.body_world) place.x() += 40000.0;
        Mistake mistake;
        mistake.colmap.raw_pose = [](Quaterniond&, Vector3d& t) {
          t = Vector3d(single(t.x()), single(t.y()), single(t.z()));
        };
        write_colmap(far, folder, mistake);
      },
      says({"poses of images.bin are rounded to 32-bit floats 40.0 km from their origin"}));
  add(
      "PosesSwapped", {"tartanair", "tartanair_v1", "colmap"},
      [](const RightDataset& d, const fs::path& folder) {
        const std::size_t last = d.recording.cameras.size() - 1;
        write_poses(d, folder, [&](std::size_t c, std::size_t f) {
          return true_pose(d, c == last ? last - 1 : c == last - 1 ? last : c, f);
        });
      },
      [](const RightDataset& d) {
        const auto& cameras = d.recording.cameras;
        return Expected{{fmt::format("poses of '{}' and '{}' are swapped",
                                     cameras[cameras.size() - 2].name, cameras.back().name)},
                        std::nullopt,
                        0.0};
      });
  const auto edit_baseline = [](double factor) {
    return [factor](const RightDataset& d, const fs::path& folder) {
      if (d.format.starts_with("kitti")) {
        edit_calibration(d, folder, {.baseline_factor = factor});
        return;
      }
      const std::size_t last = d.recording.cameras.size() - 1;
      write_poses(d, folder, [&](std::size_t c, std::size_t f) {
        SaidPose p = true_pose(d, c, f);
        const SaidPose reference = true_pose(d, 0, f);
        if (c == last) p.centre = reference.centre + factor * (p.centre - reference.centre);
        return p;
      });
    };
  };
  add("Baseline", kAll, edit_baseline(1.1), [](const RightDataset& d) {
    const double right_m = is_tartan(d) ? 0.25 : 0.5;
    return Expected{
        {"baseline", fmt::format("is {:.4f} m where {:.4f} m is right", 1.1 * right_m, right_m)},
        0.1 * right_m,
        1e-5};
  });
  add("BaselineSign", kAll, edit_baseline(-1.0), says({"baseline", "opposite sign"}));
  add(
      "ColorsOfCamerasSwapped", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        const std::size_t last = d.recording.cameras.size() - 1;
        edit_colors(d, folder, 0, [&](std::size_t c, std::size_t f) {
          return d.recording.color[c == last ? last - 1 : c == last - 1 ? last : c][f];
        });
      },
      [](const RightDataset& d) {
        const auto& cameras = d.recording.cameras;
        return Expected{{fmt::format("colours of '{}' and '{}' are swapped",
                                     cameras[cameras.size() - 2].name, cameras.back().name)},
                        std::nullopt,
                        0.0};
      });
}

}  // namespace terracast::test
