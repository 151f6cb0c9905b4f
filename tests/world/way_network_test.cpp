#include "world/way_network.h"

#include <gtest/gtest.h>

#include "core/random.h"
#include "tests/support/expect_error.h"
#include "tests/support/test_data.h"
#include "world/tile_store.h"

namespace terracast::world {
namespace {

WayNetwork some_ways() {
  WayNetwork network{.num_nodes = 30, .parts = {}};
  for (std::uint64_t k = 0; k < 40; ++k) {
    const auto draw = [&](std::uint64_t index, double low, double high) {
      return static_cast<std::int32_t>(core::random_between(low, high, 7, k, index));
    };
    WayPart part{.layer = 3,
                 .feature = core::random_bits(7, k, 99),
                 .kind = static_cast<WayKind>(k % kNumWayKinds),
                 .may_go_forward = k % 3 != 0,
                 .may_go_backward = k % 5 != 0,
                 .is_bridge = k % 7 == 0,
                 .is_tunnel = k % 11 == 0,
                 .is_siding = k % 4 == 1 && is_railway(static_cast<WayKind>(k % kNumWayKinds)),
                 .num_lanes = static_cast<std::uint8_t>(1 + k % 8),
                 .max_speed_kmph = static_cast<std::uint16_t>(k == 39 ? 250 : 6 * k),
                 .half_width_steps = draw(0, 1000, 9000),
                 .sidewalk_steps = draw(1, 0, 2000),
                 .lanes_left_steps = draw(2, 1, 1000),
                 .lanes_right_steps = draw(3, -1000, 0),
                 .from_node = static_cast<std::uint32_t>(draw(4, 0, 30)),
                 .to_node = static_cast<std::uint32_t>(draw(5, 0, 30)),
                 .points_steps = {}};
    for (std::uint64_t i = 0; i < 2 + k % 4; ++i)
      part.points_steps.emplace_back(draw(10 + 3 * i, -2e9, 2e9), draw(11 + 3 * i, -2e9, 2e9),
                                     draw(12 + 3 * i, -1e6, 1e6));
    network.parts.push_back(part);
  }
  return network;
}

TEST(WayNetwork, ComesBackAsItWasAndDamageIsFound) {
  const WayNetwork network = some_ways();
  const std::vector<std::byte> bytes = encode_ways(network);
  EXPECT_EQ(decode_ways(bytes, "ways.bin"), network);
  EXPECT_EQ(encode_ways(network), bytes);
  for (std::size_t at = 0; at < bytes.size(); at += 13) {
    std::vector<std::byte> damaged = bytes;
    damaged[at] ^= std::byte{0x10};
    test::expect_error(core::ErrorKind::Input, {"ways.bin"},
                       [&] { decode_ways(damaged, "ways.bin"); });
  }
  for (const std::size_t size : {std::size_t{0}, std::size_t{10}, bytes.size() - 1})
    test::expect_error(core::ErrorKind::Input, {"ways.bin"},
                       [&] { decode_ways(std::span(bytes).first(size), "ways.bin"); });
}

TEST(WayNetwork, WhatIsWellPackedButIsNoNetworkIsRefused) {
  const auto refused = [](const char* why, const auto& change) {
    WayNetwork network = some_ways();
    change(network);
    test::expect_error(core::ErrorKind::Input, {"ways.bin", why},
                       [&] { decode_ways(encode_ways(network), "ways.bin"); });
  };
  refused("node that is not there", [](WayNetwork& n) { n.parts[4].to_node = 30; });
  refused("no two points", [](WayNetwork& n) { n.parts[4].points_steps.resize(1); });
  refused("are one",
          [](WayNetwork& n) { n.parts[4].points_steps[1] = n.parts[4].points_steps[0]; });
  refused("no lanes", [](WayNetwork& n) { n.parts[4].num_lanes = 0; });
  refused("no meaning",
          [](WayNetwork& n) { n.parts[4].kind = static_cast<WayKind>(kNumWayKinds); });
  refused("no meaning", [](WayNetwork& n) { n.parts[4].max_speed_kmph = 251; });
  refused("no meaning", [](WayNetwork& n) {
    n.parts[4].kind = WayKind::Residential;
    n.parts[4].is_siding = true;
  });
  refused("no width", [](WayNetwork& n) { n.parts[4].half_width_steps = 0; });
  refused("no width", [](WayNetwork& n) { n.parts[4].lanes_left_steps = -2000; });
  refused("no width", [](WayNetwork& n) { n.parts[4].half_width_steps = 1 << 19; });
  refused("no width", [](WayNetwork& n) { n.parts[4].sidewalk_steps = 1 << 19; });
  refused("no meaning", [](WayNetwork& n) { n.parts[4].kind = static_cast<WayKind>(200); });
  refused("more nodes", [](WayNetwork& n) { n.num_nodes = 81; });
}

TEST(WayNetwork, ShortWaysAloneAreReadToo) {
  WayNetwork network = some_ways();
  network.parts.resize(20);
  for (WayPart& part : network.parts) part.points_steps.resize(2);
  network.num_nodes = 30;
  for (WayPart& part : network.parts) part.from_node = part.to_node = 0;
  EXPECT_EQ(decode_ways(encode_ways(network), "ways.bin"), network);
}

TEST(WayNetwork, AStoreHoldsItAndFindsAnotherOne) {
  const test::ScratchFolder folder;
  WorldManifest manifest;
  manifest.name = "ways";
  manifest.size_m = 1000.0;
  manifest.ways = write_ways(folder.path(), some_ways());
  write_manifest(folder.path(), manifest);
  EXPECT_EQ(TileStore::open(folder.path()).load_ways(), some_ways());
  WayNetwork other = some_ways();
  other.parts.pop_back();
  write_ways(folder.path(), other);
  test::expect_error(core::ErrorKind::Input, {"ways.bin", "not the ways that manifest.json lists"},
                     [&] { TileStore::open(folder.path()).load_ways(); });
  // A world without any has no file and nothing in its manifest.
  const test::ScratchFolder bare;
  manifest.ways = write_ways(bare.path(), {});
  write_manifest(bare.path(), manifest);
  EXPECT_FALSE(std::filesystem::exists(bare / "ways.bin"));
  EXPECT_TRUE(TileStore::open(bare.path()).load_ways().parts.empty());
}

}  // namespace
}  // namespace terracast::world
