#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <cstring>
#include <fstream>
#include <map>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/image_io.h"
#include "core/json.h"
#include "core/log.h"
#include "core/parallel.h"
#include "job/stages.h"
#include "tests/e2e/tiny_job.h"
#include "tests/support/test_data.h"
#include "tests/support/tiny_world.h"
#include "validate/checks/checker.h"
#include "validate/oracle_pixels.h"

/// A small job exported in every format: as it is, the oracle finds nothing; each corruption fails the
/// result that names it.
namespace terracast::validate {
namespace {

namespace fs = std::filesystem;
using test::ScratchFolder;
using testing::HasSubstr;

/// A pair of small images, and TartanAir's two pairs, over steep ground.
std::string job_text() {
  const std::string rigs = std::string(TERRACAST_SOURCE_DIR) + "/configs/rigs/";
  std::string text = test::tiny_job_text(R"(
rigs = ["pair"]

[[exports]]
format = "kitti"
rig = "pair"
left = "left"
right = "right"
min_disparity_share = 0.0

[[exports]]
format = "kitti_raw"
rig = "pair"
left = "left"
right = "right"

[[exports]]
format = "tartanair"
sky_depth_m = 1e6

[[exports]]
format = "tartanair_v1"
sky_depth_m = 1e6
)");
  for (const auto& [from, to] : std::vector<std::pair<std::string, std::string>>{
           {"size_m = 4096.0", "size_m = 2048.0"},
           {"relief_m = 300.0", "relief_m = 400.0"},
           {"finest_spacing_m = 4.0", "finest_spacing_m = 4.0\ncell_px = 4.0"},
           {"mount_pitch_deg = 40.0", "mount_pitch_deg = 18.0"},
           {"height_m = 250.0", "height_m = 110.0"},
           {"num_frames = 4", "num_frames = 2"},
           {"[[trajectories]]",
            "[[rigs]]\nextends = \"" + rigs +
                "tartan2.toml\"\nmount_pitch_deg = 12.0\n\n[[rigs]]\n" + "extends = \"" + rigs +
                "tartan_v1.toml\"\nmount_pitch_deg = 12.0\n\n[[trajectories]]"}})
    text = test::replaced(text, from, to);
  return text;
}

/// The job, made once for all tests of the program.
class MadeJob {
 public:
  static const MadeJob& get() {
    static const MadeJob job;
    return job;
  }
  fs::path world() const { return folder_ / "out/world"; }
  fs::path dataset(const std::string& format) const { return folder_ / "out/export" / format; }

 private:
  MadeJob() : folder_(fs::temp_directory_path() / fmt::format("terracast-oracle-{}", ::getpid())) {
    const core::Log log("test", core::LogLevel::Off);
    const core::Context context{.log = log};
    const job::OutputFolders out(folder_ / "out");
    const job::Job job = job::prepare_job(
        job::load_run_config(test::write_text(folder_ / "job.toml", job_text()), {}), context);
    const world::TileStore store = job::tile(job, out.world, context);
    job::render(job, store, {}, out.captures, context);
    job::export_formats(job.config, out, context);
  }
  ~MadeJob() {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  fs::path folder_;
};

using Results = std::map<std::string, CheckResult>;

/// What the oracle alone says of a dataset.
Results ask_oracle(const fs::path& folder, std::int64_t samples = 60,
                   const fs::path& world = MadeJob::get().world()) {
  Findings findings;
  const Dataset dataset = read_dataset(folder, "", findings);
  ValidateOptions options;
  options.world = world;
  options.oracle_samples = samples;
  const auto info = std::find_if(checks().begin(), checks().end(),
                                 [](const CheckInfo& check) { return check.name == "oracle"; });
  Results results;
  for (const Sequence& sequence : dataset.sequences) {
    const std::unique_ptr<Checker> checker = info->make(options);
    FrameWindow window(dataset, sequence, findings);
    while (window.advance()) checker->frame(window, {});
    for (CheckResult& result : checker->finish(dataset, sequence))
      results[result.name] = std::move(result);
  }
  return results;
}

std::string failed(const Results& results) {
  std::string names;
  for (const auto& [name, result] : results)
    if (!result.ok) names += fmt::format("{} = {} ({}); ", name, result.value, result.worst);
  return names;
}

const std::vector<std::string> kFormats = {"colmap", "kitti", "kitti_raw", "tartanair",
                                           "tartanair_v1"};

TEST(DatasetOracle, FindsNothingInADatasetOfAnyFormat) {
  for (const std::string& format : kFormats) {
    const Results results = ask_oracle(MadeJob::get().dataset(format), 150);
    EXPECT_EQ(failed(results), "") << format;
    for (const char* name : {"oracle_geometry", "oracle_depth", "oracle_class", "oracle_edges"}) {
      ASSERT_TRUE(results.contains(name)) << format;
      EXPECT_FALSE(results.at(name).skipped) << format << ": " << name;
    }
    // A share near 1: the bound is what rounding does, no more.
    EXPECT_GT(results.at("oracle_depth").value, 0.5) << format;
    EXPECT_EQ(results.at("oracle_occlusion").skipped, format.starts_with("kitti")) << format;
  }
}

TEST(DatasetOracle, TakesPixelsOfEveryKind) {
  const MadeJob& job = MadeJob::get();
  const oracle::WorldFolder world(job.world());
  PixelKinds kinds;
  for (const char* format : {"colmap", "tartanair"}) {
    Findings findings;
    const Dataset dataset = read_dataset(job.dataset(format), "", findings);
    const Sequence& sequence = dataset.sequences.at(0);
    std::vector<oracle::TileKey> tiles;
    for (const auto& tile :
         oracle::read_shown_geometry(dataset.root / sequence.geometry, sequence.geometry).tiles)
      tiles.push_back(tile.key);
    const oracle::ExactWorld terrain(world, tiles, world_from_enu_of(world));
    FrameWindow window(dataset, sequence, findings);
    ASSERT_TRUE(window.advance());
    const View view = *window.view(0, 0);
    kinds.add(choose_pixels(terrain,
                            {view, world_from_local(world, sequence) * view.local_from_camera,
                             pose_rounding(format, 0.0)},
                            200, 1)
                  .kinds);
  }
  EXPECT_EQ(kinds.num_random, 400);
  EXPECT_GE(kinds.num_sky, 10);
  EXPECT_GE(kinds.num_grazing, 20);
  EXPECT_GE(kinds.num_near_edge, 20);
  EXPECT_GE(kinds.num_border, 20);
  EXPECT_GE(kinds.num_level_change, 3);
  EXPECT_GE(kinds.num_beside_silhouette, 20);
}

// The edge of a cliff, straight across an image of one row: half a thousandth of a pixel from the
// centres of its pixels, and two.
TEST(OraclePixels, AreOnASilhouetteWithinAThousandthOfAPixel) {
  const ScratchFolder scratch;
  test::make_tiny_world(scratch.path(), [](double x, double) { return x <= 0.0 ? 64.0 : 0.0; });
  const oracle::WorldFolder world(scratch.path());
  std::vector<oracle::TileKey> tiles;
  for (const int x : {-1, 0})
    for (const int y : {-1, 0}) tiles.push_back({2, x, y});
  const oracle::ExactWorld terrain(world, tiles, world_from_enu_of(world));
  constexpr double kFocal_px = 100.0;
  View view;
  OracleView placed{.view = view, .world_from_camera = {}, .rounding = {}};
  // 100 m before the edge and 30 m above it, looking east.
  placed.world_from_camera.rotation << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  placed.world_from_camera.translation = {-100.0, 0.0, 94.0};
  for (const double off_px : {-5e-4, 5e-4, -2e-3, 2e-3}) {
    Camera camera;
    camera.intrinsics = {.width_px = 64,
                         .height_px = 1,
                         .fx_px = kFocal_px,
                         .fy_px = kFocal_px,
                         .cx_px = 32.0,
                         .cy_px = 0.5 + off_px - 0.3 * kFocal_px};
    placed.view.camera = &camera;
    const OraclePixels chosen = choose_pixels(terrain, placed, 100, 1);
    EXPECT_EQ(chosen.kinds.num_random, 100);
    for (const OraclePixel& pixel : chosen.pixels) {
      EXPECT_TRUE(pixel.hit);
      EXPECT_EQ(pixel.is_on_silhouette, std::abs(off_px) < 1e-3) << off_px << ", " << pixel.x;
    }
  }
}

TEST(DatasetOracle, SaysTheSameForAnyThreads) {
  const auto say = [&](int num_threads) {
    const core::ThreadLimit limit(num_threads);
    std::string text;
    for (const auto& [name, result] : ask_oracle(MadeJob::get().dataset("colmap")))
      text += fmt::format("{} {} {} {}\n", name, result.value, result.worst, result.summary);
    return text;
  };
  EXPECT_EQ(say(1), say(2));
}

// ---- corruptions

/// Bytes of a file as values, changed in place.
/// skip   bytes before the first value
template <class Value, class Change>
void change_values(const fs::path& file, std::size_t skip, const Change& change) {
  std::vector<std::byte> bytes = core::read_file(file);
  for (std::size_t at = skip; at + sizeof(Value) <= bytes.size(); at += sizeof(Value)) {
    Value value;
    std::memcpy(&value, &bytes[at], sizeof(Value));
    change(value, (at - skip) / sizeof(Value));
    std::memcpy(&bytes[at], &value, sizeof(Value));
  }
  core::write_file(file, bytes);
}

/// Of an npy of version 1.
std::size_t npy_header(const fs::path& file) {
  const std::vector<std::byte> bytes = core::read_file(file);
  return 10U + static_cast<std::size_t>(bytes.at(8)) + 256U * static_cast<std::size_t>(bytes.at(9));
}

template <class Value, class Change>
void change_npy(const fs::path& file, const Change& change) {
  change_values<Value>(file, npy_header(file), change);
}

std::vector<fs::path> files_named(const fs::path& folder, const std::string& part) {
  std::vector<fs::path> found;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file() && entry.path().string().find(part) != std::string::npos)
      found.push_back(entry.path());
  std::sort(found.begin(), found.end());
  return found;
}

struct Geometry {
  explicit Geometry(const fs::path& dataset)
      : file(files_named(dataset, "geometry.json").at(0)),
        json(core::Json::read(file)),
        tiles(json.at("tiles").strings()) {}
  void write() {
    core::Json changed = core::Json::object();
    for (const auto& [name, value] : json.members())
      changed.set(name, name == "tiles" ? core::Json::array_of(tiles) : value);
    changed.write(file);
  }
  fs::path file;
  core::Json json;
  std::vector<std::string> tiles;
};

/// Every four of the finest tiles become their parent, with its own hash.
void coarsen(const fs::path& folder) {
  Geometry geometry(folder);
  const auto store = world::TileStore::open(MadeJob::get().world());
  std::map<world::TileId, int> parents;
  std::vector<std::string> kept;
  const int finest = std::stoi(geometry.tiles.front());
  for (const std::string& tile : geometry.tiles) {
    world::TileId id;
    ASSERT_EQ(std::sscanf(tile.c_str(), "%d/%d/%d", &id.level, &id.x, &id.y), 3);
    if (id.level == finest)
      ++parents[id.parent()];
    else
      kept.push_back(tile);
  }
  for (const auto& [id, count] : parents) {
    ASSERT_EQ(count, 4);
    kept.push_back(id.name() + " " + store.find(id)->content_hash);
  }
  geometry.tiles = kept;
  geometry.write();
}

/// Depths of the first frame as another diagonal of each cell would have them: from (x, y) to (x+1,
/// y+1).
void turn_diagonals(const fs::path& folder) {
  const oracle::WorldFolder world(MadeJob::get().world());
  Findings findings;
  const Dataset dataset = read_dataset(folder, "", findings);
  const Sequence& sequence = dataset.sequences.at(0);
  std::vector<oracle::TileKey> tiles;
  for (const auto& tile :
       oracle::read_shown_geometry(folder / sequence.geometry, sequence.geometry).tiles)
    tiles.push_back(tile.key);
  const oracle::ExactWorld terrain(world, tiles, world_from_enu_of(world));
  FrameWindow window(dataset, sequence, findings);
  ASSERT_TRUE(window.advance());
  const View view = *window.view(sequence.camera_index("image_2"), 0);
  const OracleView placed{view, world_from_local(world, sequence) * view.local_from_camera, {}};
  int num_changed = 0;
  const auto width = static_cast<std::size_t>(view.camera->intrinsics.width_px);
  change_npy<float>(folder / view.camera->files[0].depth, [&](float& depth, std::size_t index) {
    const Eigen::Vector2d pixel(static_cast<double>(index % width) + 0.5,
                                static_cast<double>(index / width) + 0.5);
    const oracle::ExactRay ray = placed.ray(pixel);
    const auto hit = terrain.first_hit(ray);
    if (!hit) return;
    const auto surface = terrain.surface(hit->tile);
    const int i = hit->cell_x, j = hit->cell_y;
    for (const auto& [x, y] : {std::pair(i + 1, j), std::pair(i, j + 1)}) {
      const Eigen::Vector3d a = surface->vertex_world(i, j), b = surface->vertex_world(x, y),
                            c = surface->vertex_world(i + 1, j + 1);
      const Eigen::Vector3d normal = (b - a).cross(c - a);
      const double t =
          normal.dot(a - ray.origin_world) / normal.dot(ray.through_world - ray.origin_world);
      const Eigen::Vector3d at =
          (ray.origin_world + t * (ray.through_world - ray.origin_world) - a) / surface->spacing_m;
      const bool is_in_cell = at.x() >= 0.0 && at.y() >= 0.0 && at.x() <= 1.0 && at.y() <= 1.0;
      if (!is_in_cell || (at.x() > at.y()) != (x > i)) continue;
      depth = static_cast<float>(t * OracleView::kThrough_m);
      ++num_changed;
      return;
    }
  });
  EXPECT_GT(num_changed, 1000);
}

struct Corruption {
  std::string name;
  std::string format;
  std::function<void(const fs::path& folder)> corrupt;
  std::string result;  ///< that fails
  std::string words;   ///< in its worst place
};

std::vector<Corruption> corruptions() {
  const auto step = [](float value, int count) {
    for (int k = 0; k < count; ++k)
      value = std::nextafter(value, std::numeric_limits<float>::infinity());
    return value;
  };
  const auto each_file = [](const std::string& part, const auto& change) {
    return [=](const fs::path& folder) {
      const std::vector<fs::path> files = files_named(folder, part);
      ASSERT_FALSE(files.empty());
      for (const fs::path& file : files) change(file);
    };
  };
  return {
      {"three steps of float32 on every depth", "colmap",
       each_file("/depth/",
                 [=](const fs::path& file) {
                   change_npy<float>(file, [=](float& depth, std::size_t) {
                     if (depth > 0.0F) depth = step(depth, 3);
                   });
                 }),
       "oracle_depth", "depth"},
      {"one count of disparity", "kitti",
       each_file("/disp_2/",
                 [](const fs::path& file) {
                   auto image = std::get<core::Image16>(
                       core::decode_png(core::read_file(file), "disparity"));
                   for (std::uint16_t& count : image.data())
                     if (count > 0) ++count;
                   core::write_file(file, core::encode_png(image));
                 }),
       "oracle_depth", "disparity"},
      {"the other diagonal of every cell", "kitti", turn_diagonals, "oracle_depth", "depth"},
      {"tiles of a neighbour's level", "kitti", coarsen, "oracle_depth", "depth"},
      {"the same, seen by the rule", "kitti", coarsen, "oracle_geometry", "px a cell"},
      {"sky painted as ground", "kitti_raw",
       each_file("/depth_02/",
                 [](const fs::path& file) {
                   change_npy<float>(file, [](float& depth, std::size_t) {
                     if (depth == 0.0F) depth = 5000.0F;
                   });
                 }),
       "oracle_class", "where sky is"},
      {"land called sea", "tartanair_v1",
       each_file("_seg.npy",
                 [](const fs::path& file) {
                   change_npy<std::uint8_t>(file, [](std::uint8_t& index, std::size_t) {
                     if (index > 2) index = 2;
                   });
                 }),
       "oracle_class", "sea, where land is"},
      {"an inverted mask", "tartanair_v1",
       each_file("_mask.npy",
                 [](const fs::path& file) {
                   change_npy<std::uint8_t>(file, [](std::uint8_t& value, std::size_t) {
                     if (value < 2) value = 1 - value;
                   });
                 }),
       "oracle_occlusion", "claimed"},
      {"points three micrometres above the ground", "colmap",
       [](const fs::path& folder) {
         const fs::path file = files_named(folder, "sparse/0/points3D.bin").at(0);
         std::vector<std::byte> bytes = core::read_file(file);
         std::size_t at = 8;
         while (at < bytes.size()) {
           double z = 0.0;
           std::memcpy(&z, &bytes[at + 24], 8);
           z += 3e-6;
           std::memcpy(&bytes[at + 24], &z, 8);
           std::uint64_t length = 0;  // after id, place, colour and error
           std::memcpy(&length, &bytes[at + 43], 8);
           at += 51 + 8 * length;
         }
         core::write_file(file, bytes);
       },
       "oracle_occlusion", "from the ground"},
      {"a hole", "kitti",
       [](const fs::path& folder) {
         Geometry geometry(folder);
         geometry.tiles.erase(geometry.tiles.begin() + 3);
         geometry.write();
       },
       "oracle_geometry", "no tile covers"},
      {"a tile of other content", "kitti",
       [](const fs::path& folder) {
         Geometry geometry(folder);
         geometry.tiles[3].replace(geometry.tiles[3].size() - 32, 32, std::string(32, '0'));
         geometry.write();
       },
       "oracle_geometry", "the world's holds"},
      {"damage", "kitti",
       [](const fs::path& folder) {
         const fs::path file = files_named(folder, "geometry.json").at(0);
         fs::resize_file(file, fs::file_size(file) / 2);
       },
       "oracle_geometry", "geometry.json"},
  };
}

TEST(DatasetOracle, FindsEachCorruption) {
  const ScratchFolder scratch;
  for (const Corruption& corruption : corruptions()) {
    SCOPED_TRACE(corruption.name);
    const fs::path folder = scratch / "data";
    fs::remove_all(folder);
    fs::copy(MadeJob::get().dataset(corruption.format), folder, fs::copy_options::recursive);
    corruption.corrupt(folder);
    const Results results = ask_oracle(folder);
    ASSERT_TRUE(results.contains(corruption.result));
    EXPECT_FALSE(results.at(corruption.result).ok) << results.at(corruption.result).summary;
    EXPECT_THAT(results.at(corruption.result).worst, HasSubstr(corruption.words));
  }
}

TEST(DatasetOracle, AnotherWorldIsAnError) {
  const ScratchFolder scratch;
  test::make_tiny_world(scratch / "world", [](double, double) { return 7.0; });
  try {
    ask_oracle(MadeJob::get().dataset("kitti"), 10, scratch / "world");
    ADD_FAILURE() << "no error";
  } catch (const core::Error& error) {
    EXPECT_EQ(error.kind(), core::ErrorKind::Input);
    EXPECT_THAT(error.what(), HasSubstr("give the world that it was rendered from"));
  }
  try {
    ask_oracle(MadeJob::get().dataset("kitti"), 10, scratch / "nowhere");
    ADD_FAILURE() << "no error";
  } catch (const core::Error& error) {
    EXPECT_EQ(error.kind(), core::ErrorKind::Io);
  }
}

TEST(DatasetOracle, ADatasetThatDoesNotSayWhatItShowsIsAnError) {
  const ScratchFolder scratch;
  const fs::path folder = scratch / "data";
  fs::copy(MadeJob::get().dataset("kitti"), folder, fs::copy_options::recursive);
  const std::string text = core::read_text_file(folder / "dataset.json");
  core::write_file(folder / "dataset.json", test::replaced(text, "\"geometry\":", "\"other\":"));
  try {
    ask_oracle(folder, 10);
    ADD_FAILURE() << "no error";
  } catch (const core::Error& error) {
    EXPECT_EQ(error.kind(), core::ErrorKind::Input);
    EXPECT_THAT(error.what(), HasSubstr("which tiles"));
  }
}

TEST(DatasetOracle, WithoutAWorldIsSkipped) {
  const Results results = ask_oracle(MadeJob::get().dataset("kitti"), 10, fs::path());
  ASSERT_EQ(results.size(), 1U);
  EXPECT_TRUE(results.at("oracle").skipped);
  EXPECT_FALSE(results.at("oracle").is_unseen);
}

}  // namespace
}  // namespace terracast::validate
