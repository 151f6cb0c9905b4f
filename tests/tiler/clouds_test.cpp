#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "core/atomic_file.h"
#include "core/parallel.h"
#include "core/toml_reader.h"
#include "tests/tiler/raster_files.h"
#include "tests/tiler/vector_files.h"
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

/// Of voxels that hold more than a tenth: the highest layer, and how many there are.
struct Extent {
  int highest = 0;
  std::size_t num_filled = 0;
};
Extent extent_of(const world::Volume& volume) {
  Extent extent;
  for (int z = 0; z < volume.size.z(); ++z)
    for (int y = 0; y < volume.size.y(); ++y)
      for (int x = 0; x < volume.size.x(); ++x)
        if (volume.density[volume.index(x, y, z)] > 25) {
          extent.highest = z;
          ++extent.num_filled;
        }
  return extent;
}

TEST(CloudsLayer, SomeCumuliTowerAndSomeLieFlat) {
  std::vector<Extent> extents;
  for (int number = 0; number < 6; ++number)
    extents.push_back(extent_of(tiler::make_cumulus(5, number)));
  for (const Extent& extent : extents) EXPECT_GT(extent.num_filled, 8000U);  // 1.4e7 m3
  // The first is higher than the flat ones by half at least, and holds more.
  for (const std::size_t flat : {3U, 4U, 5U}) {
    EXPECT_GT(extents[0].highest, 3 * extents[flat].highest / 2);
    EXPECT_GT(extents[0].num_filled, 2 * extents[flat].num_filled);
  }
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
  write_text(folder / "empty.vdb", "");
  expect_error(ErrorKind::Input, {"empty.vdb: is empty", "fetch or write it again"},
               [&] { world::read_vdb(folder / "empty.vdb", {}); });
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

/// Four bytes or eight, as OpenVDB stores them.
template <class Number>
std::string bytes_of(Number value) {
  return {reinterpret_cast<const char*>(&value), sizeof value};
}

/// A file of grids, put together from files of one grid each, with or without offsets.
class FileOfGrids {
 public:
  explicit FileOfGrids(bool has_offsets) : has_offsets_(has_offsets) {}

  /// parent   whose values it has; "": its own
  void add(const std::string& name, const world::Volume& volume, const std::string& parent = "") {
    const world::VdbGrid grid{.name = "heat", .volume = &volume};
    const std::vector<std::byte> encoded = world::encode_vdb({&grid, 1});
    const std::string whole(reinterpret_cast<const char*>(encoded.data()), encoded.size());
    const std::string kind = bytes_of(std::uint32_t{16}) + "Tree_float_5_4_3";
    const std::size_t kind_at = whole.find(kind);
    ASSERT_NE(kind_at, std::string::npos);
    std::string body = whole.substr(kind_at + kind.size() + 4 + 3 * 8);
    if (!parent.empty()) {
      // What follows the transform, six vectors behind its kind's name, is the parent's.
      const std::string transform = "UniformScaleTranslateMap";
      const std::size_t at = body.find(transform);
      ASSERT_NE(at, std::string::npos);
      body.resize(at + transform.size() + 6 * 3 * 8);
    }
    if (count_ == 0) {
      head_ = whole.substr(0, kind_at - 8 - 4);
      head_[20] = has_offsets_ ? '\1' : '\0';
    }
    ++count_;
    const std::string texts = bytes_of(static_cast<std::uint32_t>(name.size())) + name + kind +
                              bytes_of(static_cast<std::uint32_t>(parent.size())) + parent;
    const std::size_t begin = head_.size() + 4 + grids_.size() + texts.size() + 3 * 8;
    grids_ += texts;
    for (const std::uint64_t offset : {begin, begin, begin + body.size()})
      grids_ += bytes_of(has_offsets_ ? offset : std::uint64_t{0});
    grids_ += body;
  }
  std::string bytes() const { return head_ + bytes_of(count_) + grids_; }

 private:
  bool has_offsets_;
  std::string head_;  // up to the number of grids
  std::int32_t count_ = 0;
  std::string grids_;
};

TEST(Vdb, GridsOfOneNameAreToldApartAndMayShareTheirValues) {
  const ScratchFolder folder;
  const world::Volume first = small_volume();
  world::Volume second = first;
  second.density.back() = 100;
  const std::string separator = "\x1e";
  for (const bool has_offsets : {false, true}) {
    SCOPED_TRACE(has_offsets ? "with offsets" : "without offsets");
    FileOfGrids file(has_offsets);
    file.add("smoke" + separator + "0", first);
    file.add("smoke" + separator + "1", second);
    file.add("twin", first, "smoke" + separator + "1");
    write_text(folder / "three.vdb", file.bytes());
    const auto density = [&](const std::string& grid) {
      return world::read_vdb(folder / "three.vdb", {.grid = grid}).density;
    };
    EXPECT_EQ(density("smoke[0]"), first.density);
    EXPECT_EQ(density("smoke[1]"), second.density);
    EXPECT_EQ(density("twin"), second.density);
    for (const char* other : {"smoke", ""})
      expect_error(ErrorKind::Input, {"three.vdb", "smoke[0], smoke[1], twin"},
                   [&] { density(other); });
  }
}

/// Seen in November 2026: all of a file was read for one of its grids.
TEST(Vdb, DamageToOneGridLeavesTheOthers) {
  const ScratchFolder folder;
  FileOfGrids file(true);
  file.add("density", small_volume());
  const std::size_t sound_bytes = file.bytes().size();
  file.add("heat", small_volume());
  std::string bytes = file.bytes();
  std::fill(bytes.begin() + static_cast<std::ptrdiff_t>(bytes.size() - sound_bytes / 2),
            bytes.end(), '\xff');
  write_text(folder / "damaged.vdb", bytes);
  EXPECT_EQ(world::read_vdb(folder / "damaged.vdb", {}).density, small_volume().density);
  expect_error(ErrorKind::Input, {"damaged.vdb"},
               [&] { world::read_vdb(folder / "damaged.vdb", {.grid = "heat"}); });
}

TEST(Vdb, AFileWithoutTheRightToReadItIsNotCalledDamaged) {
  const ScratchFolder folder;
  write_text(folder / "closed.vdb", "whatever");
  std::filesystem::permissions(folder / "closed.vdb", std::filesystem::perms::none);
  std::filesystem::permissions(folder.path(), static_cast<std::filesystem::perms>(0755));
  // Root may read all files: it steps down for as long as it takes.
  const uid_t own = ::geteuid();
  if (own == 0) {
    ASSERT_EQ(::seteuid(65534), 0);
  }
  expect_error(ErrorKind::Io, {"closed.vdb", "cannot be read"},
               [&] { world::read_vdb(folder / "closed.vdb", {}); });
  if (own == 0) {
    ASSERT_EQ(::seteuid(0), 0);
  }
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
