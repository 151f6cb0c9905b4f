#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "core/atomic_file.h"
#include "core/error.h"
#include "tests/support/test_data.h"
#include "tests/support/tiny_world.h"
#include "tests/world/mountains.h"
#include "world/tile_file.h"
#include "world/tile_store.h"

namespace terracast::world {
namespace {

using testing::HasSubstr;

template <class Work>
core::Error error_of(Work&& work) {
  try {
    work();
  } catch (const core::Error& error) {
    return error;
  }
  ADD_FAILURE() << "no error";
  return {core::ErrorKind::Internal, "none"};
}

double ramp_m(double x, double y) { return 100.0 + 0.25 * x - 0.125 * y; }

TEST(TileId, CoversWhatItsHeaderSays) {
  const TileId id{3, -1, 2};
  EXPECT_EQ(id.spacing_m(), 8.0);
  EXPECT_EQ(id.side_m(), 2048.0);
  EXPECT_EQ(id.corner_world(), Eigen::Vector2d(-2048.0, 4096.0));
  EXPECT_EQ(id.name(), "3/-1/2");
  EXPECT_EQ((TileId{-2, 0, 0}).spacing_m(), 0.25);
}

TEST(TileId, ChildrenPartTheirParent) {
  for (const TileId& id : {TileId{3, -1, 2}, TileId{0, -7, -8}, TileId{5, 0, 0}}) {
    for (int quadrant = 0; quadrant < 4; ++quadrant) {
      const TileId child = id.child(quadrant);
      EXPECT_EQ(child.parent(), id);
      EXPECT_TRUE(id.contains(child));
      EXPECT_FALSE(child.contains(id));
      EXPECT_FALSE(id.neighbour(1, 0).contains(child));
      const Eigen::Vector2d corner =
          id.corner_world() + id.side_m() / 2 * Eigen::Vector2d(quadrant & 1, quadrant >> 1);
      EXPECT_EQ(child.corner_world(), corner);
    }
  }
}

TEST(TileId, PlacesOnABorderBelongEastAndNorth) {
  EXPECT_EQ(tile_at(0, 256.0, -256.0), (TileId{0, 1, -1}));
  EXPECT_EQ(tile_at(0, 255.999, -256.001), (TileId{0, 0, -2}));
  EXPECT_EQ(tile_at(2, -0.001, 0.0), (TileId{2, -1, 0}));
  EXPECT_THROW(tile_at(0, std::nan(""), 0.0), core::Error);
}

TEST(TileFile, RoundTripsEveryLayer) {
  test::TinyWorldOptions options;
  options.cover = [](double x, double) { return x < 100 ? Cover::Sea : Cover::Outside; };
  options.moisture = [](double x, double y) { return std::fmod(std::abs(x * y), 256.0) / 256.0; };
  Tile tile = test::make_tile({1, -3, 2}, test::mountain_height_m, options);
  tile.source[77] = 3;
  tile.height_steps[0] = 1 << 23;  // the extremes that floats hold exactly
  tile.height_steps[1] = -(1 << 23);
  const std::vector<std::byte> bytes = encode_tile(tile);
  EXPECT_EQ(decode_tile(bytes, tile.id, "a.tile"), tile);
  EXPECT_EQ(decode_tile(bytes, tile.id, "a.tile", WaterDepth::Read), tile);
  EXPECT_EQ(decode_cover(bytes, tile.id, "a.tile"), tile.cover);
  EXPECT_EQ(encode_tile(tile), bytes);
}

/// With what lies behind them in the file.
TEST(TileFile, BringsDepthsOfWaterWhereTheyAreAskedFor) {
  Tile tile = test::make_tile({1, -3, 2}, test::mountain_height_m);
  for (std::size_t i = 0; i < tile.height_steps.size(); ++i)
    tile.water_depth_steps.push_back(static_cast<std::int32_t>(i % 5000));
  tile.water_depth_steps[9] = 2 << 23;
  tile.objects.instances.emplace_back().provenance.instance_id = 5;
  const std::vector<std::byte> bytes = encode_tile(tile);
  EXPECT_EQ(decode_tile(bytes, tile.id, "a.tile", WaterDepth::Read), tile);
  Tile without = tile;
  without.water_depth_steps.clear();
  EXPECT_EQ(decode_tile(bytes, tile.id, "a.tile"), without);
}

TEST(TileFile, RefusesHeightsThatFloatsDoNotHold) {
  Tile tile = test::make_tile({0, 0, 0}, ramp_m);
  tile.height_steps[5] = (1 << 23) + 1;
  EXPECT_THROW(encode_tile(tile), core::Error);
}

TEST(TileFile, FindsEveryFlippedByte) {
  const Tile tile = test::make_tile({0, 0, 0}, [](double, double) { return 12.0; });
  std::vector<std::byte> bytes = encode_tile(tile);
  ASSERT_LT(bytes.size(), 5000U);
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    for (const std::byte flip : {std::byte{0x01}, std::byte{0x80}, std::byte{0xff}}) {
      bytes[at] ^= flip;
      const core::Error error = error_of([&] { decode_tile(bytes, tile.id, "a.tile"); });
      EXPECT_EQ(error.kind(), core::ErrorKind::Input) << "byte " << at;
      EXPECT_THAT(error.what(), HasSubstr("a.tile")) << "byte " << at;
      EXPECT_THROW(decode_cover(bytes, tile.id, "a.tile"), core::Error) << "byte " << at;
      bytes[at] ^= flip;
    }
  }
}

TEST(TileFile, FindsEveryTruncation) {
  const Tile tile = test::make_tile({0, 0, 0}, [](double, double) { return 12.0; });
  const std::vector<std::byte> bytes = encode_tile(tile);
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_THROW(decode_tile(std::span(bytes).first(size), tile.id, "a.tile"), core::Error);
  std::vector<std::byte> longer = bytes;
  longer.push_back(std::byte{0});
  EXPECT_THROW(decode_tile(longer, tile.id, "a.tile"), core::Error);
}

TEST(TileFile, SaysWhatIsWrongAndWhatToDo) {
  const Tile tile = test::make_tile({0, 0, 0}, ramp_m);
  std::vector<std::byte> bytes = encode_tile(tile);
  EXPECT_THAT(error_of([&] {
                decode_tile(bytes, {0, 1, 0}, "a.tile");
              }).what(),
              HasSubstr("holds tile 0/0/0 where 0/1/0 belongs"));
  bytes[6] = std::byte{9};
  EXPECT_THAT(error_of([&] { decode_tile(bytes, tile.id, "a.tile"); }).what(),
              HasSubstr("version 9"));
  bytes[0] = std::byte{'X'};
  EXPECT_THAT(error_of([&] { decode_tile(bytes, tile.id, "a.tile"); }).what(),
              HasSubstr("not a tile"));
}

TEST(TileStore, ReadsWhatWasWritten) {
  const test::ScratchFolder folder;
  const TileStore store = test::make_tiny_world(folder / "world", ramp_m);
  const TileId id{2, -1, 0};
  ASSERT_NE(store.find(id), nullptr);
  EXPECT_EQ(store.find({2, 5, 5}), nullptr);
  EXPECT_EQ(store.load(id), test::make_tile(id, ramp_m));
  EXPECT_EQ(store.load(id, WaterDepth::Read), test::make_tile(id, ramp_m));
  EXPECT_EQ(store.find(id)->box_world().min(), Eigen::Vector3d(-1024.0, 0.0, -284.0));
  EXPECT_EQ(store.find(id)->box_world().max(), Eigen::Vector3d(0.0, 1024.0, 100.0));
  EXPECT_EQ(inspect_tile(folder / "world", id)->content_hash, store.find(id)->content_hash);
  EXPECT_FALSE(inspect_tile(folder / "world", {2, 5, 5}).has_value());
}

TEST(TileStore, ManifestRoundTrips) {
  const test::ScratchFolder folder;
  WorldManifest manifest = test::make_tiny_world(folder / "a", ramp_m).manifest();
  manifest.seed = 0xfedcba9876543210ULL;
  manifest.sources[0].spacing_m = 0.1;
  manifest.sources[0].num_voids = 12;
  manifest.origin = {.lat_deg = 42.123456789012345, .lon_deg = -1e-17, .height_m = 1.0 / 3.0};
  write_manifest(folder / "a", manifest);
  const WorldManifest read = TileStore::open(folder / "a").manifest();
  EXPECT_EQ(read.seed, manifest.seed);
  EXPECT_EQ(read.origin, manifest.origin);
  EXPECT_EQ(read.sources[0].spacing_m, 0.1);
  EXPECT_EQ(read.sources[0].num_voids, 12);
  ASSERT_EQ(read.tiles.size(), manifest.tiles.size());
  for (std::size_t i = 0; i < read.tiles.size(); ++i) {
    EXPECT_EQ(read.tiles[i].id, manifest.tiles[i].id);
    EXPECT_EQ(read.tiles[i].content_hash, manifest.tiles[i].content_hash);
  }
}

TEST(TileStore, FindsDamage) {
  const test::ScratchFolder folder;
  const std::filesystem::path world = folder / "world";
  const TileStore store = test::make_tiny_world(world, ramp_m);
  const TileId id{2, 0, 0};
  // Another tile, whole, under its name.
  write_tile(world, test::make_tile(id, [](double, double) { return 5.0; }));
  EXPECT_THAT(error_of([&] { store.load(id); }).what(),
              HasSubstr("not the one that manifest.json"));
  std::filesystem::resize_file(tile_path(world, id), 100);
  EXPECT_EQ(error_of([&] { store.load(id); }).kind(), core::ErrorKind::Input);
  EXPECT_FALSE(inspect_tile(world, id).has_value());
  std::filesystem::remove(tile_path(world, id));
  EXPECT_EQ(error_of([&] { store.load(id); }).kind(), core::ErrorKind::Io);
  EXPECT_EQ(error_of([&] { store.load({2, 9, 9}); }).kind(), core::ErrorKind::Input);
}

TEST(TileStore, RefusesManifestsThatAreNotWhole) {
  const test::ScratchFolder folder;
  const std::filesystem::path world = folder / "world";
  EXPECT_EQ(error_of([&] { TileStore::open(world); }).kind(), core::ErrorKind::Io);
  std::filesystem::create_directories(world);
  EXPECT_THAT(error_of([&] { TileStore::open(world); }).what(), HasSubstr("has not finished"));
  test::make_tiny_world(world, ramp_m);
  const std::filesystem::path file = world / "manifest.json";
  const std::string text = core::read_text_file(file);
  const auto refuses = [&](const std::string& damaged) {
    core::write_file(file, std::string_view(damaged));
    EXPECT_EQ(error_of([&] { TileStore::open(world); }).kind(), core::ErrorKind::Input);
  };
  refuses(text.substr(0, text.size() / 2));
  refuses("[]");
  refuses("{\"format\": \"terracast world\"}");
  std::string edited = text;
  edited.replace(edited.find("\"lat_deg\": 46"), 13, "\"lat_deg\": 47");
  refuses(edited);
  core::write_file(file, std::string_view(text));
  TileStore::open(world);
}

}  // namespace
}  // namespace terracast::world
