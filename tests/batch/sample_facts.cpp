#include "tests/batch/sample_facts.h"

#include <fmt/format.h>

#include <limits>

#include "core/sha256.h"

namespace terracast::batch {

DatasetFacts sample_facts() {
  DatasetFacts facts;
  facts.publication = {.name = "valleys",
                       .title = "Flights through valleys",
                       .description = "Low flights.\n\nFor depth and odometry.",
                       .version = "1.2.0",
                       .licence = "CC-BY-4.0",
                       .url = "https://example.org/valleys",
                       .creators = {"An Institute", "A Person"},
                       .date_published = "2025-06-21",
                       .cite_as = "@misc{valleys,\n  title = {Flights through valleys}\n}"};
  facts.runs = {"run0", "run1"};
  const auto add = [&](const char* run, const char* sequence, const char* world, Split split,
                       int group, double lat_deg, double lon_deg) {
    SequenceFacts one;
    one.run = run;
    one.sequence = sequence;
    one.world = world;
    one.split = split;
    one.group = group;
    one.formats = {"kitti", "colmap"};
    one.num_frames = 400;
    one.num_cameras = 3;
    one.swept = std::string("world.name = \"") + world + "\"";
    one.utc_start = "2025-06-21T10:00:00Z";
    one.duration_s = 39.9;
    one.track_length_m = 1500.5;
    one.lat_deg = one.south_deg = one.north_deg = lat_deg;
    one.lon_deg = one.west_deg = one.east_deg = lon_deg;
    one.lowest_m = 1200.0;
    one.highest_m = 1350.25;
    one.num_ground_cells = 321;
    facts.sequences.push_back(one);
  };
  add("run0", "north", "andorra", Split::Train, 0, 42.6, 1.5);
  add("run0", "south", "andorra", Split::Test, 1, 42.4, 1.6);
  add("run1", "coast", "taveuni", Split::Val, 2, -16.9, -179.99);
  facts.places = {{.world = "taveuni",
                   .ground = "0123456789abcdef",
                   .origin = {.lat_deg = -16.85, .lon_deg = -179.97},
                   .size_m = 25600.0,
                   .licences = {"generated; free of rights"}},
                  {.world = "andorra",
                   .ground = "earth",
                   .origin = {.lat_deg = 42.5404, .lon_deg = 1.5796},
                   .size_m = 51200.0,
                   .licences = {"SRTM, NASA/USGS; public domain", "ODbL-1.0"}}};
  facts.cameras = {{"stereo", "right", "pinhole", 1241, 376, 718.856, 718.856},
                   {"stereo", "left", "pinhole", 1241, 376, 718.856, 718.856},
                   {"down", "cam0", "pinhole", 720, 640, 720.0, 719.5}};
  facts.splits = {.margin_m = 1500.0};
  facts.within_m = 3000.0;
  facts.split_words = "The 3 sequences fall into 3 groups.";
  facts.checks = {{.name = "reprojection",
                   .unit = "of the depth",
                   .value = 4.18e-05,
                   .bound = 0.002,
                   .run = "run1",
                   .format = "colmap",
                   .num_measured = 4},
                  {.name = "colmap_points",
                   .unit = "points (at least)",
                   .value = 4001.0,
                   .bound = 2000.0,
                   .is_lower_bound = true,
                   .run = "run0",
                   .format = "colmap",
                   .num_measured = 2,
                   .num_unseen = 1}};
  const auto add_file = [&](const std::string& path, std::uint64_t num_bytes) {
    facts.files.push_back({path, num_bytes, core::sha256(path)});
  };
  for (const char* run : {"run0", "run1"})
    for (const char* format : {"kitti", "colmap"}) {
      add_file(fmt::format("{}/{}/dataset.json", format, run), 5000);
      for (int i = 0; i < 4; ++i)
        add_file(fmt::format("{}/{}/images/{:06}.png", format, run, i), 1000000);
    }
  add_file("colmap/run0/north/sparse/0/points3D.bin", 70000);
  add_file("index.jsonl", 900);
  add_file("statistics.json", 1234);
  for (const std::string_view split : kSplitNames)
    add_file(fmt::format("splits/{}.txt", split), 20);
  add_file("plots/map.png", 43210);
  add_file("plots/depth.png", 4321);
  facts.plots = {{"plots/map.png", "All sequences by split"},
                 {"plots/depth.png", "Depth of all pixels"}};
  facts.making = {
      .program_version = "0.1.0", .configs = {"valleys"}, .seeds = {4, 1, 2, 9}, .sweep_seed = 7};
  return facts;
}

}  // namespace terracast::batch
