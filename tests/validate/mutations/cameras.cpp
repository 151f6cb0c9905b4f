#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "core/json.h"
#include "tests/validate/mutations/edits.h"

namespace terracast::test {

void add_camera_mutations(std::vector<Mutation>& list) {
  const Catalogue add(list);
  add(
      "HalfPixel", kCalibrated,
      [](const RightDataset& d, const fs::path& folder) {
        edit_calibration(d, folder, {.centre_px = {0.5, 0.5}});
      },
      says({"principal point off by (0.5, 0.5) px", "half a pixel"}, std::sqrt(0.5), 1e-6));
  add(
      "HalfPixelOfFlow", kFlow,
      [](const RightDataset& d, const fs::path& folder) {
        write_flows(
            d, folder, [&](std::size_t f) { return flow_between(d, f, f + 1, -0.5); },
            [&](std::size_t f) { return flow_between(d, f + 1, f, -0.5); });
      },
      says({"principal point off by (-0.50, -0.50) px", "flow"}, std::sqrt(0.5), 0.01));
  add(
      "FocalLength", kCalibrated,
      [](const RightDataset& d, const fs::path& folder) {
        edit_calibration(d, folder, {.focal_factor = 1.01});
      },
      says({"focal length off by +1.000 %"}, 1.0, 1e-6));
  add(
      "CalibrationOfOtherSize", kCalibrated,
      [](const RightDataset& d, const fs::path& folder) {
        edit_calibration(d, folder, {.size_factor = 2.0});
      },
      says({"stale", "320 x 256 px"}, 2.0, 1e-6));
  add(
      "CalibrationBeforeChange", kCalibrated,
      [](const RightDataset& d, const fs::path& folder) {
        edit_calibration(d, folder, {.focal_factor = 0.996, .centre_px = {1.3, -0.7}});
      },
      says({"stale", "focal length off by -0.400 %", "(1.30, -0.70) px"}, -0.4, 1e-6));

  // The same said wrongly by dataset.json alone.
  const auto scale = [](core::Json& camera, const char* member, double factor) {
    camera.set(member, factor * camera.at(member).number());
  };
  add(
      "StatedHalfPixel", kAll,
      [](const RightDataset&, const fs::path& folder) {
        edit_stated_cameras(folder, [](std::size_t, core::Json& camera) {
          for (const char* member : {"cx_px", "cy_px"})
            camera.set(member, camera.at(member).number() + 0.5);
        });
      },
      says({"principal point off by (0.5, 0.5) px", "half a pixel", "in dataset.json"},
           std::sqrt(0.5), 1e-6));
  add(
      "StatedFocalLength", kAll,
      [=](const RightDataset&, const fs::path& folder) {
        edit_stated_cameras(folder, [&](std::size_t, core::Json& camera) {
          for (const char* member : {"fx_px", "fy_px"}) scale(camera, member, 1.01);
        });
      },
      says({"focal length off by +1.000 %", "in dataset.json"}, 1.0, 1e-6));
  add(
      "StatedOtherSize", kAll,
      [=](const RightDataset&, const fs::path& folder) {
        edit_stated_cameras(folder, [&](std::size_t, core::Json& camera) {
          for (const char* member : {"width_px", "height_px"})
            camera.set(member, 2 * camera.at(member).integer());
          for (const char* member : {"fx_px", "fy_px", "cx_px", "cy_px"})
            scale(camera, member, 2.0);
        });
      },
      says({"stale", "2 times as large", "in dataset.json"}, 2.0, 1e-6));

  // Mounts of the last camera, in the format's files and in dataset.json.
  const Matrix3d turn =
      Eigen::AngleAxisd(0.5 * std::numbers::pi / 180.0, Vector3d::UnitY()).toRotationMatrix();
  const Vector3d move_m(0.02, 0.03, -0.01);
  const auto edit_last_pose = [](const std::function<void(SaidPose&, const SaidPose&)>& change) {
    return [change](const RightDataset& d, const fs::path& folder) {
      write_poses(d, folder, [&](std::size_t c, std::size_t f) {
        SaidPose pose = true_pose(d, c, f);
        if (c + 1 == d.recording.cameras.size()) change(pose, true_pose(d, 0, f));
        return pose;
      });
    };
  };
  const auto last_camera_says = [](const char* before, const char* after, double size) {
    return [=](const RightDataset& d) {
      return Expected{
          {fmt::format("{}{}", before, d.recording.cameras.back().name), after}, size, 1e-5};
    };
  };
  add("MountTurned", kPosed, edit_last_pose([=](SaidPose& pose, const SaidPose&) {
        pose.rotation = pose.rotation * turn;
      }),
      last_camera_says("the mount of ", " is turned by 0.5 deg", 0.5));
  add(
      "MountMoved", kAll,
      [=](const RightDataset& d, const fs::path& folder) {
        if (d.format.starts_with("kitti"))
          edit_calibration(d, folder, {.moved_m = move_m});
        else
          edit_last_pose([=](SaidPose& pose, const SaidPose& first) {
            pose.centre += first.rotation * move_m;
          })(d, folder);
      },
      last_camera_says("the mount of ", " is moved by (0.02, 0.03, -0.01) m", move_m.norm()));
  const auto edit_last_mount = [](const std::function<void(SaidPose&, const SaidPose&)>& change) {
    return [change](const RightDataset& d, const fs::path& folder) {
      edit_stated_cameras(folder, [&](std::size_t c, core::Json& json) {
        if (c + 1 < d.recording.cameras.size()) return;
        const SceneCamera& first = d.recording.cameras[0];
        const SceneCamera& last = d.recording.cameras[c];
        SaidPose mount{last.body_from_camera, last.offset_body};
        change(mount, {first.body_from_camera, first.offset_body});
        const Quaterniond q(mount.rotation);
        const Vector3d& t = mount.centre;
        json.set("body_from_camera",
                 core::Json::object()
                     .set("rotation_wxyz",
                          core::Json::array_of(std::vector<double>{q.w(), q.x(), q.y(), q.z()}))
                     .set("translation_m",
                          core::Json::array_of(std::vector<double>{t.x(), t.y(), t.z()})));
      });
    };
  };
  add("StatedMountTurned", kAll, edit_last_mount([=](SaidPose& mount, const SaidPose&) {
        mount.rotation = mount.rotation * turn;
      }),
      last_camera_says("the mount of ", " in dataset.json is turned by 0.5 deg", 0.5));
  add("StatedMountMoved", kAll, edit_last_mount([=](SaidPose& mount, const SaidPose& first) {
        mount.centre += first.rotation * move_m;
      }),
      last_camera_says("the mount of ", " in dataset.json is moved by (0.02, 0.03, -0.01) m",
                       move_m.norm()));
  const auto scale_stated_baseline = [=](double factor) {
    return edit_last_mount([=](SaidPose& mount, const SaidPose& first) {
      mount.centre = first.centre + factor * (mount.centre - first.centre);
    });
  };
  add("StatedBaseline", kAll, scale_stated_baseline(1.1), [](const RightDataset& d) {
    const double right_m = is_tartan(d) ? 0.25 : 0.5;
    return Expected{{"baseline", " in dataset.json is ",
                     fmt::format("{:.4f} m where {:.4f} m is right", 1.1 * right_m, right_m)},
                    0.1 * right_m,
                    1e-5};
  });
  add("StatedBaselineSign", kAll, scale_stated_baseline(-1.0),
      says({"baseline", " in dataset.json has the opposite sign"}));

  // Depths, and colours with their depths, of the last two cameras.
  const auto swap_last_two = [](bool has_color) {
    return [=](const RightDataset& d, const fs::path& folder) {
      const std::size_t last = d.recording.cameras.size() - 1;
      for (std::size_t f = 0; f < d.recording.body_world.size(); ++f)
        for (const bool is_color : {false, true}) {
          if (is_color && !has_color) continue;
          const auto file = is_color ? color_file : depth_file;
          copy_over(d.folder / file(d, last, f), folder / file(d, last - 1, f));
          copy_over(d.folder / file(d, last - 1, f), folder / file(d, last, f));
        }
    };
  };
  const auto swapped = [](const char* what) {
    return [=](const RightDataset& d) {
      const auto& cameras = d.recording.cameras;
      return Expected{{fmt::format("{} of '{}' and '{}' are swapped", what,
                                   cameras[cameras.size() - 2].name, cameras.back().name)},
                      std::nullopt,
                      0.0};
    };
  };
  add("DepthsSwapped", kPosed, swap_last_two(false), swapped("depths"));
  add("ImagesSwapped", kPosed, swap_last_two(true), swapped("images"));
}

}  // namespace terracast::test
