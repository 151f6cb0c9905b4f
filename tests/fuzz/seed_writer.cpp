// Writes seeds of what terracast writes itself, and of what GDAL writes for us: terracast_fuzz_seeds tests/fuzz/seeds.
// To be run again when the version of one of the formats changes. Other seeds are written by hand.

#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <cstdio>
#include <cstring>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/image_io.h"
#include "core/ledger.h"
#include "export/mcap/mcap_file.h"
#include "export/mcap/ros_definitions.h"
#include "export/mcap/ros_messages.h"
#include "tests/fuzz/scratch.h"
#include "tests/fuzz/small_dataset.h"
#include "tests/support/tiny_capture.h"
#include "tests/support/tiny_world.h"
#include "world/objects_file.h"
#include "world/raster_info.h"
#include "world/sealed_file.h"
#include "world/tile_file.h"
#include "world/vdb/vdb_file.h"
#include "world/volume.h"
#include "world/way_network.h"

namespace terracast::fuzz {
namespace {

namespace fs = std::filesystem;

/// Longer seeds make slow inputs.
constexpr std::size_t kLongestSeed = 8192;

class SeedFolder {
 public:
  explicit SeedFolder(fs::path folder) : folder_(std::move(folder)) {}

  void write(const std::string& target, const std::string& name, Bytes bytes) const {
    fs::create_directories(folder_ / target);
    write_bytes(folder_ / target / name, bytes);
  }
  void write(const std::string& target, const std::string& name, std::string_view text) const {
    write(target, name, bytes_of(text));
  }

 private:
  fs::path folder_;
};

Bytes bytes_of_octets(const std::vector<std::uint8_t>& octets) {
  return std::as_bytes(std::span(octets));
}

world::Prototype small_prototype() {
  world::Shape shape;
  shape.vertices_steps = {{0, 0, 0}, {1024, 0, 0}, {0, 1024, 0}};
  shape.uv = {{0.0F, 0.0F}, {1.0F, 0.0F}, {0.0F, 1.0F}};
  shape.triangles = {{.corners = {0, 1, 2}, .finish = 0}};
  shape.finishes = {{.material = world::Material::Paint, .color_srgb = {200, 10, 10}}};
  return {.name = "thing", .levels = {{.coarsest_level = 3, .shape = shape}}};
}

world::TileObjects small_objects() {
  world::TileObjects objects;
  objects.solids.push_back({.provenance = {.instance_id = 1, .layer = 0, .feature = 7},
                            .place_m = {-700, 1100},
                            .origin_steps = {-716800, 1126400, 0},
                            .levels = small_prototype().levels});
  objects.instances.push_back({.provenance = {.instance_id = 2, .layer = 0, .feature = 8},
                               .prototype = 0,
                               .place_steps = {-716800, 1126400, 0}});
  return objects;
}

void write_tiles(const SeedFolder& seeds) {
  const auto flat = [](double, double) { return 0.0; };
  world::Tile tile = test::make_tile({1, -3, 2}, flat);
  seeds.write("tile", "flat.tile", world::encode_tile(tile));
  tile.objects = small_objects();
  tile.objects_top_steps = 2048;
  seeds.write("tile", "objects.tile", world::encode_tile(tile));
  // Header with a top of objects, five layers of which nothing is stated, objects.
  std::vector<std::uint8_t> layers(80 + 5 * 2);
  const std::int32_t top_steps = 2048;
  std::memcpy(layers.data() + 48, &top_steps, sizeof top_steps);
  seeds.write("tile_layers", "flat.bin", bytes_of_octets(layers));
  const std::vector<std::uint8_t> objects = world::bytes_of_objects(small_objects());
  layers.insert(layers.end(), objects.begin(), objects.end());
  seeds.write("tile_layers", "objects.bin", bytes_of_octets(layers));
}

/// A sealed file, and what is sealed in it.
void write_sealed(const SeedFolder& seeds, const std::string& target, const std::string& inner,
                  const char* magic, std::uint16_t version, Bytes bytes) {
  world::SealedKind kind = {
      .magic = {}, .version = version, .most_bytes = std::size_t{1} << 26, .what = "a seed"};
  std::memcpy(kind.magic.data(), magic, kind.magic.size());
  seeds.write(target, "small.bin", bytes);
  seeds.write(inner, "small.bin", bytes_of_octets(world::unsealed(kind, bytes, "seed")));
}

void write_world_parts(const SeedFolder& seeds) {
  write_sealed(seeds, "prototype", "prototype_shapes", "TCPROT", world::kPrototypeFileVersion,
               world::encode_prototype(small_prototype()));
  world::WayNetwork ways{.num_nodes = 2, .parts = {}};
  ways.parts.push_back({.layer = 0,
                        .feature = 7,
                        .max_speed_kmph = 50,
                        .half_width_steps = 3072,
                        .lanes_left_steps = 2048,
                        .lanes_right_steps = -2048,
                        .from_node = 0,
                        .to_node = 1,
                        .points_steps = {{0, 0, 0}, {102400, 0, 0}}});
  write_sealed(seeds, "ways", "ways_parts", "TCWAYS", world::kWayFileVersion,
               world::encode_ways(ways));
  const world::Volume volume{.name = "cloud",
                             .size = {3, 2, 2},
                             .voxel_m = 10.0,
                             .density = {0, 10, 20, 0, 255, 3, 0, 0, 0, 1, 1, 1}};
  const std::vector<std::byte> bytes = world::encode_volume(volume);
  seeds.write("volume", "small.volume", bytes);
  std::vector<std::byte> voxels(bytes.begin(), bytes.begin() + 64);
  for (const std::uint8_t value : volume.density) voxels.push_back(static_cast<std::byte>(value));
  seeds.write("volume_voxels", "small.bin", voxels);
  const std::vector<world::VdbGrid> grids = {
      {.name = "density", .volume = &volume, .notes = {{"note", "text"}}}};
  seeds.write("vdb_lengths", "small.vdb", world::encode_vdb(grids));
}

void write_world(const SeedFolder& seeds) {
  const fs::path folder = scratch_folder("seed_world");
  core::Ledger ledger;
  ledger.use("height", 3);
  ledger.ignore("name", "a name changes nothing", 2);
  ledger.miss("wake");
  ledger.misunderstand("height", "tall");
  seeds.write("ledger", "small.json", ledger.json().text());
  world::WorldManifest manifest;
  manifest.name = "hills";
  manifest.input_hash = std::string(32, '0');
  manifest.origin = {.lat_deg = 42.5, .lon_deg = 1.5, .height_m = 0.0};
  manifest.size_m = 1024.0;
  manifest.coarsest_level = 2;
  manifest.outside = "error";
  manifest.sources.resize(1);
  manifest.sources[0].name = "dem.tif";
  manifest.sources[0].kind = "raster";
  manifest.sources[0].ledger = ledger;
  manifest.layers.resize(1);
  manifest.layers[0].name = "cover";
  manifest.layers[0].counts = {{"samples", 4}};
  manifest.prototypes.push_back({.name = "thing", .content_hash = std::string(32, '1')});
  manifest.textures.push_back(
      {.name = "paint", .width_px = 2, .height_px = 2, .content_hash = std::string(32, '2')});
  manifest.volumes.push_back(
      {.name = "cloud", .size = {3, 2, 2}, .content_hash = std::string(32, '3')});
  manifest.volume_places.push_back({.volume = 0, .layer = 0});
  manifest.tiles.push_back({.id = {1, -3, 2},
                            .lowest_z_world = 0.0,
                            .highest_z_world = 1.0,
                            .num_bytes = 100,
                            .content_hash = std::string(32, '4')});
  world::write_manifest(folder, manifest);
  seeds.write("world_manifest", "small.json", core::read_text_file(folder / "manifest.json"));
  world::WorldRasters rasters;
  world::RasterInfo raster{.name = "dem.tif",
                           .horizontal_crs = "EPSG:4326",
                           .pipeline = "",
                           .is_geographic = true,
                           .geotransform = {1.4, 0.1, 0.0, 42.6, 0.0, -0.1},
                           .width_px = 2,
                           .height_px = 2};
  rasters.sources = {raster};
  rasters.land_cover.resize(1);
  rasters.land_cover[0].resize(1);
  rasters.land_cover[0][0].raster = raster;
  world::write_rasters(folder, manifest.input_hash, rasters,
                       [](std::size_t, std::size_t, int, std::span<std::uint8_t>) {});
  seeds.write("rasters_of_world", "small.json", core::read_text_file(folder / "rasters.json"));
}

void write_capture(const SeedFolder& seeds) {
  const fs::path folder = test::write_tiny_capture(scratch_folder("seed_capture"),
                                                   {.num_frames = 2, .has_tartan2 = false});
  for (const auto& [target, file] :
       std::map<std::string, std::string>{{"capture_sequence", "sequence.json"},
                                          {"capture_frame", "frames/000000.json"},
                                          {"capture_tracks", "tracks.json"},
                                          {"capture_manifest", "manifest.json"}})
    seeds.write(target, "tiny.json", core::read_text_file(folder / file));
}

void write_images(const SeedFolder& seeds) {
  core::Image16 deep(3, 2, 1, 1000);
  seeds.write("png", "grey16.png", core::encode_png(deep));
  core::Image8 color(3, 2, 4, 100);
  seeds.write("png", "rgba.png", core::encode_png(color));
  const std::vector<float> depth = {1.0F, 2.0F, 3.0F, 4.0F, 5.0F, 6.0F};
  const std::vector<std::uint32_t> ids = {1, 2, 3, 4, 5, 6};
  using core::ExrChannel;
  using core::ExrPart;
  const ExrPart facts{.name = "facts",
                      .width = 3,
                      .height = 2,
                      .channels = {{"depth", ExrChannel::Type::Float, depth},
                                   {"ids", ExrChannel::Type::Uint, {}, ids}},
                      .compression = ExrPart::Compression::None,
                      .attributes = {{"note", "text"}}};
  ExrPart half = facts;
  half.name = "half";
  half.channels = {{"depth", ExrChannel::Type::Half, depth}};
  half.compression = ExrPart::Compression::Rle;
  seeds.write("exr", "one_part.exr", core::encode_exr({facts}));
  seeds.write("exr", "two_parts.exr", core::encode_exr({facts, half}));
}

/// A small GeoTIFF over the worlds of the targets.
void write_raster(const SeedFolder& seeds, const std::string& target, const std::string& name,
                  GDALDataType type, int num_bands, const char* option) {
  GDALAllRegister();
  const fs::path file = scratch_folder("seed_raster") / name;
  const char* options[] = {option, nullptr};
  GDALDataset* dataset = GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
      file.c_str(), 12, 12, num_bands, type, const_cast<char**>(options));
  if (dataset == nullptr) core::fail(core::ErrorKind::Internal, "{}: GDAL writes none", name);
  OGRSpatialReference crs;
  crs.SetFromUserInput("EPSG:4326");
  dataset->SetSpatialRef(&crs);
  std::array<double, 6> corner = {1.497, 0.0005, 0.0, 42.503, 0.0, -0.0005};
  dataset->SetGeoTransform(corner.data());
  std::vector<double> values(144);
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = static_cast<double>(10 + 10 * (i % 3));
  for (int band = 1; band <= num_bands; ++band)
    if (dataset->GetRasterBand(band)->RasterIO(GF_Write, 0, 0, 12, 12, values.data(), 12, 12,
                                               GDT_Float64, 0, 0, nullptr) != CE_None)
      core::fail(core::ErrorKind::Internal, "{}: GDAL writes none", name);
  GDALClose(dataset);
  seeds.write(target, name, core::read_file(file, kLongestSeed));
}

void write_rasters_of_gdal(const SeedFolder& seeds) {
  write_raster(seeds, "raster_tif", "float.tif", GDT_Float32, 1, "COMPRESS=NONE");
  write_raster(seeds, "raster_tif", "deflated.tif", GDT_Int16, 1, "COMPRESS=DEFLATE");
  write_raster(seeds, "raster_tif", "lzw.tif", GDT_UInt16, 1, "COMPRESS=LZW");
  write_raster(seeds, "color_raster", "rgb.tif", GDT_Byte, 3, "COMPRESS=NONE");
  write_raster(seeds, "color_raster", "grey16.tif", GDT_UInt16, 1, "COMPRESS=NONE");
  write_raster(seeds, "cover_raster", "bytes.tif", GDT_Byte, 1, "COMPRESS=NONE");
}

void write_datasets(const SeedFolder& seeds) {
  for (const std::string format : {"coco", "colmap", "euroc", "kitti", "kitti_object", "kitti_raw",
                                   "mcap", "tartanair", "tartanair_v1", "terracast", "tum"}) {
    const SmallDataset dataset(format);
    std::string model;
    for (const auto& [path, bytes] : dataset.files()) {
      const std::string text(text_of(bytes));
      if (path.ends_with("database.db")) seeds.write("colmap_database", "small.db", text);
      if (path.find("sparse/0/") != std::string::npos)
        model += "-- " + fs::path(path).filename().string() + " --\n" + text + "\n";
      // One file of a kind, of the first frame and camera, is enough.
      if (text.size() > kLongestSeed || path.find("000001") != std::string::npos) continue;
      std::string name = path;
      std::replace(name.begin(), name.end(), '/', '.');
      seeds.write("dataset_" + format, name, "-- " + path + " --\n" + text);
    }
    if (format == "colmap") seeds.write("colmap_model", "binary.bin", model);
  }
}

/// Two topics, of which one has two messages.
void write_bag(const SeedFolder& seeds) {
  const fs::path file = scratch_folder("bag") / "small.mcap";
  std::vector<exporters::McapChannel> channels;
  for (const std::string type : {"sensor_msgs/msg/Range", "tf2_msgs/msg/TFMessage"})
    channels.push_back({.topic = "/" + std::to_string(channels.size()),
                        .type = type,
                        .definition = exporters::ros_definition(type),
                        .metadata = {{"offered_qos_profiles", "- depth: 1\n"}}});
  exporters::McapFile bag(file, "seed", channels);
  bag.add_metadata("terracast", {{"sequence", "small"}});
  bag.write(0, 1000, exporters::range_message({1000, "laser"}, {.range_m = 2.5F}));
  const exporters::RosTransform transform{{1000, "map"}, "base_link", {}};
  bag.write(1, 1000, exporters::transforms_message(std::span(&transform, 1)));
  bag.write(0, 2000, exporters::range_message({2000, "laser"}, {.range_m = 3.5F}));
  bag.finish();
  seeds.write("mcap", "small.mcap", core::read_file(file, kLongestSeed));
}

}  // namespace
}  // namespace terracast::fuzz

int main(int argc, char** argv) {
  using namespace terracast::fuzz;
  if (argc != 2) {
    std::fputs("usage: terracast_fuzz_seeds FOLDER (tests/fuzz/seeds)\n", stderr);
    return 2;
  }
  const SeedFolder seeds(argv[1]);
  write_tiles(seeds);
  write_world_parts(seeds);
  write_world(seeds);
  write_capture(seeds);
  write_images(seeds);
  write_rasters_of_gdal(seeds);
  write_datasets(seeds);
  write_bag(seeds);
  return 0;
}
