#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "core/atomic_file.h"
#include "core/parallel.h"
#include "core/toml_reader.h"
#include "tests/tiler/raster_files.h"
#include "tiler/clouds/cumulus.h"
#include "tiler/layer_stack.h"
#include "world/vdb/vdb_file.h"

namespace terracast::test {
namespace {

using core::ErrorKind;

std::shared_ptr<const tiler::WorldSurface> world_with_clouds(const std::string& toml,
                                                             double size_m = 16384.0) {
  tiler::WorldOptions options = world_of("plane", size_m);
  tiler::LayerOptions layer;
  core::TomlDocument::parse("kind = \"clouds\"\n" + toml, "layer.toml").read(layer);
  options.layers.push_back(layer);
  const core::Log log("tile", core::LogLevel::Off);
  const core::Context context{.log = log, .num_threads = 0, .events_file = {}};
  return tiler::layered_surface(tiler::WorldSurface::prepare(options, context), context);
}

world::Volume small_volume() {
  world::Volume volume;
  volume.name = "smoke";
  volume.size = {9, 6, 5};
  volume.voxel_m = 2.0;
  volume.lowest_m = {-9.0, -6.0, 1.0};
  for (int i = 0; i < 9 * 6 * 5; ++i)
    volume.density.push_back(static_cast<std::uint8_t>(i % 7 == 0 ? 0 : 255 - i % 200));
  volume.density[0] = 200;  // its corners are in it
  volume.density.back() = 255;
  return volume;
}

TEST(CloudsLayer, CumuliHangAtTheirBaseAboveTheEllipsoid) {
  const auto surface = world_with_clouds("cover = 0.15\nbase_m = 1500.0\nextinction_per_m = 0.04");
  const auto& places = surface->layers().volume_places();
  EXPECT_GT(places.size(), 20u);
  for (const world::VolumePlace& place : places) {
    EXPECT_NEAR(surface->frame().geodetic_from_world(place.place_world).height_m, 1500.0, 40.0);
    EXPECT_EQ(place.extinction_per_m, 0.04);
    EXPECT_LT(place.volume, static_cast<int>(surface->layers().volumes().size()));
  }
  // More of them where more is asked for.
  EXPECT_LT(2 * world_with_clouds("cover = 0.03")->layers().volume_places().size(), places.size());
}

TEST(CloudsLayer, ACumulusIsTheSameForAnyThreadsAndWithinItsVolume) {
  const world::Volume cumulus = tiler::make_cumulus(7, 2);
  const core::ThreadLimit limit(1);
  EXPECT_EQ(tiler::make_cumulus(7, 2), cumulus);
  EXPECT_NE(tiler::make_cumulus(8, 2).density, cumulus.density);
  std::size_t num_full = 0;
  const Eigen::Vector3i& size = cumulus.size;
  for (int z = 0; z < size.z(); ++z)
    for (int y = 0; y < size.y(); ++y)
      for (int x = 0; x < size.x(); ++x) {
        const std::uint8_t density = cumulus.density[cumulus.index(x, y, z)];
        num_full += density > 128 ? 1 : 0;
        const bool is_outer = x == 0 || y == 0 || z == 0 || x == size.x() - 1 ||
                              y == size.y() - 1 || z == size.z() - 1;
        if (is_outer) {
          EXPECT_EQ(density, 0);
        }
      }
  const double volume_m3 = static_cast<double>(num_full) * std::pow(cumulus.voxel_m, 3);
  // As a ball of 250 m to one of 600 m.
  EXPECT_GT(volume_m3, 6.5e7);
  EXPECT_LT(volume_m3, 9e8);
}

TEST(Vdb, AFileHoldsTheVolumeAndIsTheSameEachTime) {
  const ScratchFolder folder;
  const world::Volume volume = small_volume();
  const world::VdbGrid grid{.name = "density", .volume = &volume};
  const std::vector<std::byte> bytes = world::encode_vdb({&grid, 1});
  EXPECT_EQ(bytes, world::encode_vdb({&grid, 1}));
  core::write_file(folder / "smoke.vdb", bytes);
  world::Volume read = world::read_vdb(folder / "smoke.vdb", {});
  read.name = volume.name;
  EXPECT_EQ(read.size, volume.size);
  EXPECT_TRUE(read.lowest_m.isApprox(volume.lowest_m, 1e-12));
  for (std::size_t i = 0; i < volume.density.size(); ++i)
    EXPECT_EQ(int{read.density[i]}, int{volume.density[i]});

  // A film's file, in centimetres with y up.
  world::VdbGrid film = grid;
  film.file_from_volume.linear() << 100, 0, 0, 0, 0, 100, 0, -100, 0;
  core::write_file(folder / "film.vdb", world::encode_vdb({&film, 1}));
  const world::Volume turned =
      world::read_vdb(folder / "film.vdb", {.unit_m = 0.01, .is_upward_y = true});
  EXPECT_EQ(turned.size, volume.size);
  EXPECT_TRUE(turned.lowest_m.isApprox(volume.lowest_m, 1e-9));
  for (std::size_t i = 0; i < volume.density.size(); ++i)
    EXPECT_NEAR(turned.density[i], volume.density[i], 1);
}

TEST(Vdb, BadFilesAreClearErrors) {
  const ScratchFolder folder;
  expect_error(ErrorKind::Io, {"none.vdb"}, [&] { world::read_vdb(folder / "none.vdb", {}); });
  std::ofstream(folder / "text.vdb")
      << "This is no volume, but a line of text that goes on for a while.";
  expect_error(ErrorKind::Input, {"text.vdb", "OpenVDB"},
               [&] { world::read_vdb(folder / "text.vdb", {}); });
  const world::Volume volume = small_volume();
  const world::VdbGrid grid{.name = "heat", .volume = &volume};
  const std::vector<std::byte> bytes = world::encode_vdb({&grid, 1});
  core::write_file(folder / "heat.vdb", bytes);
  expect_error(ErrorKind::Input, {"heat", "density"},
               [&] { world::read_vdb(folder / "heat.vdb", {.grid = "density"}); });
  expect_error(ErrorKind::Input, {"voxel_m"},
               [&] { world::read_vdb(folder / "heat.vdb", {.voxel_m = 1e-3}); });
  core::write_file(folder / "cut.vdb", std::span(bytes).first(bytes.size() / 2));
  expect_error(ErrorKind::Input, {"cut.vdb"}, [&] { world::read_vdb(folder / "cut.vdb", {}); });
}

TEST(CloudsLayer, AVolumeOfAFileStandsWhereItIsPlaced) {
  const ScratchFolder folder;
  const world::Volume volume = small_volume();
  const world::VdbGrid grid{.name = "density", .volume = &volume};
  core::write_file(folder / "smoke.vdb", world::encode_vdb({&grid, 1}));
  const auto surface =
      world_with_clouds("source = \"vdb\"\nfile = \"" + (folder / "smoke.vdb").string() +
                        "\"\nlat_deg = 42.51\nlon_deg = 1.52\nheight_m = 321.0");
  ASSERT_EQ(surface->layers().volume_places().size(), 1u);
  const geo::Geodetic place =
      surface->frame().geodetic_from_world(surface->layers().volume_places()[0].place_world);
  EXPECT_NEAR(place.lat_deg, 42.51, 1e-9);
  EXPECT_NEAR(place.lon_deg, 1.52, 1e-9);
  EXPECT_NEAR(place.height_m, 321.0, 1e-6);
  expect_error(ErrorKind::Config, {"file"}, [] { world_with_clouds("source = \"vdb\""); });
}

}  // namespace
}  // namespace terracast::test
