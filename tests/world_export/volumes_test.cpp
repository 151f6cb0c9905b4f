#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>

#include <cstdio>
#include <map>
#include <sstream>

#include "core/atomic_file.h"
#include "tests/support/expect_error.h"
#include "tests/world_export/export_world.h"

namespace terracast::world_export {
namespace {

using Volumes = WorldExport;

std::map<std::string, openvdb::FloatGrid::Ptr> read_grids(const fs::path& file) {
  openvdb::initialize();
  std::istringstream in(core::read_text_file(file), std::ios_base::binary);
  openvdb::io::Stream stream(in);
  std::map<std::string, openvdb::FloatGrid::Ptr> grids;
  for (const openvdb::GridBase::Ptr& grid : *stream.getGrids())
    grids[grid->getName()] = openvdb::gridPtrCast<openvdb::FloatGrid>(grid);
  return grids;
}

/// Read by OpenVDB: each voxel's centre, brought into the file's frame by hand, has its density times the extinction.
TEST_F(Volumes, StandTurnedAndScaledWithTheirExtinctionInOpenVdbFiles) {
  const world::VolumePlace place = cloud_place();
  const Region region = around(100.0, 0.0, 120.0);
  write("vdb", region, folder_ / "a.vdb");
  const auto grids = read_grids(folder_ / "a.vdb");
  ASSERT_EQ(grids.size(), 1u);
  ASSERT_TRUE(grids.contains("density_0"));
  const openvdb::FloatGrid& grid = *grids.at("density_0");
  EXPECT_EQ(grid.background(), 0.0f);
  EXPECT_EQ(grid.activeVoxelCount(), 60u);
  geo::Geodetic about;
  const std::string told = grid.metaValue<std::string>("terracast_frame");
  ASSERT_EQ(
      std::sscanf(told.c_str(),
                  "x east, y north, z up, m, at latitude %lf longitude %lf height %lf of WGS84",
                  &about.lat_deg, &about.lon_deg, &about.height_m),
      3)
      << told;
  EXPECT_EQ(about, region.center());
  const openvdb::Vec3d side = grid.voxelSize();
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(side[k], 4.0 * 1.5, 1e-9);

  const world::Volume volume = cloud();
  const Eigen::Matrix3d world_from_enu = frame_->world_from_enu(place.place_world);
  const double c = std::cos(place.heading_rad);
  const double s = std::sin(place.heading_rad);
  const auto accessor = grid.getConstAccessor();
  for (int z = 0; z < 3; ++z)
    for (int y = 0; y < 4; ++y)
      for (int x = 0; x < 5; ++x) {
        const Eigen::Vector3d own =
            volume.lowest_m + 4.0 * Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5);
        const Eigen::Vector3d turned(c * own.x() - s * own.y(), s * own.x() + c * own.y(), own.z());
        const Eigen::Vector3d at =
            enu_from_world(place.place_world + world_from_enu * (place.scale * turned), about);
        const openvdb::Vec3d index = grid.worldToIndex({at.x(), at.y(), at.z()});
        const openvdb::Coord nearest = openvdb::Coord::round(index);
        // Doubles all the way, over a kilometre and a voxel of 6 m.
        EXPECT_LT((index - nearest.asVec3d()).length(), 1e-9);
        const double expected = volume.density[volume.index(x, y, z)] / 255.0 * 0.03;
        EXPECT_NEAR(static_cast<double>(accessor.getValue(nearest)), expected, 1e-7 * expected);
      }
}

TEST_F(Volumes, ThatStandElsewhereAreNotWritten) {
  test::expect_error(core::ErrorKind::Input, {"no volume of the world's 1"},
                     [&] { write("vdb", around(300.0, 100.0, 50.0), folder_ / "a.vdb"); });
  EXPECT_FALSE(fs::exists(folder_ / "a.vdb"));
}

}  // namespace
}  // namespace terracast::world_export
