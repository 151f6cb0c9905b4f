#include <gtest/gtest.h>

#include "core/toml_reader.h"
#include "export/exporter.h"
#include "rigs/rig.h"

namespace terracast::cli {
namespace {

/// The cameras of a rig file that is shipped.
std::vector<capture::CameraCalibration> cameras_of(const std::string& rig) {
  const std::filesystem::path folder = std::filesystem::path(TERRACAST_SOURCE_DIR) / "configs/rigs";
  return rigs::build_cameras({core::read_toml<rigs::RigOptions>(folder / (rig + ".toml"))});
}

void expect_fits(const std::string& export_toml, const std::string& rig) {
  exporters::ExportOptions options;
  core::TomlDocument::parse(export_toml, "test.toml").read(options);
  EXPECT_NO_THROW(options.exporter().check(cameras_of(rig))) << export_toml << rig;
}

TEST(RigFiles, FitTheFormatsThatTheyAreMadeFor) {
  expect_fits("format = \"kitti\"", "mcs4");
  expect_fits("format = \"kitti_raw\"", "mcs4");
  expect_fits("format = \"tartanair\"", "tartan2");
  expect_fits("format = \"tartanair\"\nrig = \"tartan12\"", "tartan12");
  expect_fits("format = \"tartanair_v1\"", "tartan_v1");
}

TEST(RigFiles, Tartan12SeesEveryDirectionOncePerSide) {
  const auto cameras = cameras_of("tartan12");
  ASSERT_EQ(cameras.size(), 12U);
  for (int i = 0; i < 3000; ++i) {
    // Directions spread over the sphere by the golden angle.
    const double z = 1.0 - 2.0 * (i + 0.5) / 3000.0, turn = 2.399963229728653 * i;
    const Eigen::Vector3d direction_rig(std::sqrt(1.0 - z * z) * std::cos(turn),
                                        std::sqrt(1.0 - z * z) * std::sin(turn), z);
    int num_seen[2] = {0, 0};
    for (const auto& camera : cameras) {
      const Eigen::Vector3d ray = camera.rig_from_camera.rotation.conjugate() * direction_rig;
      if (ray.z() > 0.0 && std::abs(ray.x()) < ray.z() && std::abs(ray.y()) < ray.z())
        ++num_seen[camera.name.starts_with('l') ? 0 : 1];
    }
    EXPECT_EQ(num_seen[0], 1);
    EXPECT_EQ(num_seen[1], 1);
  }
}

}  // namespace
}  // namespace terracast::cli
