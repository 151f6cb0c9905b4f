#include <cpl_conv.h>
#include <cpl_vsi.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>

#include "core/atomic_file.h"
#include "tests/support/peak_memory.h"
#include "tests/tiler/vector_files.h"
#include "tiler/gdal_support.h"
#include "tiler/raster_source.h"
#include "tiler/vector_source.h"
#include "world/vdb/vdb_file.h"

/// Files of some kilobytes that unpack to gigabytes, or say that they do: each reader refuses them before it has
/// made room for what they state.
namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;

constexpr int kMebibyte = 1 << 20;

/// Fails where reading took more than some memory beside what the process had held before.
void expect_cheap_refusal(ErrorKind kind, const std::vector<std::string>& words,
                          const std::function<void()>& read) {
  const PeakMemory peak;
  expect_error(kind, words, read);
  EXPECT_LT(peak.more_mb(), 200.0);
}

tiler::VectorData read_features(const std::string& path) {
  static const geo::WorldFrame frame(
      {.lat_deg = kOriginLat_deg, .lon_deg = kOriginLon_deg, .height_m = 0.0});
  return tiler::read_vectors({.written = path, .resolved = path}, {},
                             {.frame = frame,
                              .size_m = 20480.0,
                              .ground_height_m = [](const geo::Geodetic&) { return 0.0; }});
}
void read_raster(const std::string& path) {
  tiler::RasterSource::open({.written = path, .resolved = path}, {},
                            {.lat_deg = kOriginLat_deg, .lon_deg = kOriginLon_deg});
}

/// Writes a member of an archive by GDAL, its last part so many times.
void write_packed(const std::string& path, const std::string& begin, const std::string& repeated,
                  int repeats, const std::string& end = "") {
  VSILFILE* file = VSIFOpenL(path.c_str(), "wb");
  ASSERT_NE(file, nullptr) << path;
  const auto put = [&](const std::string& text) {
    ASSERT_EQ(VSIFWriteL(text.data(), 1, text.size(), file), text.size());
  };
  put(begin);
  for (int i = 0; i < repeats; ++i) put(repeated);
  put(end);
  ASSERT_EQ(VSIFCloseL(file), 0);
}

std::string bytes_of(const fs::path& file) { return core::read_text_file(file); }

TEST(ArchiveBombs, ArchivesOfAHundredTimesTheirSizeAreRefused) {
  const ScratchFolder folder;
  const std::string in_zip = "/vsizip/" + folder.path().string();
  const std::string nothing(kMebibyte, '\0');
  const std::vector<std::string> words = {"unpacks from", "name the file"};
  // A GeoPackage behind whose pages others follow, a KML of spaces, a raster.
  write_vectors(folder / "things.gpkg", "GPKG", {{"POINT (1.5 42.5)", {}}});
  const std::string package = bytes_of(folder / "things.gpkg");
  write_packed(in_zip + "/sound.zip/things.gpkg", package, "", 0);
  EXPECT_EQ(read_features((folder / "sound.zip").string()).features.size(), 1U);
  write_packed(in_zip + "/package.zip/things.gpkg", package, nothing, 300);
  for (const std::string& path :
       {(folder / "package.zip").string(), in_zip + "/package.zip/things.gpkg"})
    expect_cheap_refusal(ErrorKind::Input, words, [&] { read_features(path); });

  const std::string kml = R"(<kml xmlns="http://www.opengis.net/kml/2.2"><Document><Placemark>)"
                          "<Point><coordinates>1.5,42.5</coordinates></Point></Placemark>";
  const std::string kml_end = "</Document></kml>";
  write_packed(in_zip + "/sound.kmz/doc.kml", kml, "", 0, kml_end);
  EXPECT_EQ(read_features((folder / "sound.kmz").string()).features.size(), 1U);
  write_packed(in_zip + "/bomb.kmz/doc.kml", kml, std::string(kMebibyte, ' '), 300, kml_end);
  expect_cheap_refusal(ErrorKind::Input, words,
                       [&] { read_features((folder / "bomb.kmz").string()); });

  RasterSpec spec = utm_spec(1024.0, 32.0);
  spec.value = [](double u, double) { return 100.0 + std::fmod(u, 50.0); };
  write_raster(folder / "heights.tif", spec);
  write_packed(in_zip + "/sound_heights.zip/heights.tif", bytes_of(folder / "heights.tif"), "", 0);
  for (const std::string& path :
       {(folder / "sound_heights.zip").string(), in_zip + "/sound_heights.zip/heights.tif",
        "/vsisubfile/0," + (folder / "heights.tif").string()})
    EXPECT_NO_THROW(read_raster(path)) << path;
  write_packed(in_zip + "/heights.zip/heights.bil", "", nothing, 300);
  expect_cheap_refusal(ErrorKind::Input, words,
                       [&] { read_raster((folder / "heights.zip").string()); });
  for (const char* name : {"package.zip", "bomb.kmz", "heights.zip"})
    EXPECT_LT(fs::file_size(folder / name), 1U << 20) << name;
}

/// Only what has an end that is known beforehand is unpacked, and nothing is fetched.
TEST(ArchiveBombs, StreamsNetworksAndArchivesInArchivesAreNoFiles) {
  const ScratchFolder folder;
  // Once something was opened, GDAL writes no stream either; its name is what is refused.
  write_text(folder / "points.geojson.gz", "no matter what");
  for (const std::string& path :
       {"/vsigzip/" + (folder / "points.geojson.gz").string(),
        std::string("/vsicurl/http://127.0.0.1:9/points.geojson"),
        "/vsizip//vsigzip/" + (folder / "points.geojson.gz").string() + "/points.geojson",
        "/vsisubfile/0,/vsigzip/" + (folder / "points.geojson.gz").string(),
        "/vsitar/" + (folder / "points.tar.gz").string() + "/points.geojson"}) {
    SCOPED_TRACE(path);
    expect_error(ErrorKind::Input, {"only files are read", "/vsizip/FILE.zip/MEMBER"},
                 [&] { read_features(path); });
    expect_error(ErrorKind::Input, {"only files are read", "/vsizip/FILE.zip/MEMBER"},
                 [&] { read_raster(path); });
  }
  write_packed("/vsizip/" + (folder / "points.zip").string() + "/points.geojson", "{}", "", 0);
  for (const std::string& path :
       {"/vsizip/{" + (folder / "points.zip").string() + "}/points.geojson",
        "/vsizip/" + (folder / "points.zip").string() + "/../points.geojson",
        "/vsizip/" + (folder / "gone.zip").string() + "/points.geojson"}) {
    SCOPED_TRACE(path);
    expect_error(ErrorKind::Input, {"a path into an archive is"}, [&] { read_features(path); });
  }
}

// ---- OpenStreetMap's PBF, by hand: blocks of protocol buffers, each packed by zlib.

std::string varint(std::uint64_t value) {
  std::string text;
  for (; value >= 128; value >>= 7) text.push_back(static_cast<char>((value & 127) | 128));
  text.push_back(static_cast<char>(value));
  return text;
}
std::string whole_field(std::uint64_t number, std::uint64_t value) {
  return varint(number << 3) + varint(value);
}
std::string bytes_field(std::uint64_t number, const std::string& bytes) {
  return varint(number << 3 | 2) + varint(bytes.size()) + bytes;
}
/// stated_bytes   of what it unpacks to; below 0: as it is
std::string blob(const std::string& kind, const std::string& bytes,
                 std::int64_t stated_bytes = -1) {
  std::size_t num_packed = 0;
  void* packed = CPLZLibDeflate(bytes.data(), bytes.size(), 9, nullptr, 0, &num_packed);
  const std::string zipped(static_cast<const char*>(packed), num_packed);
  VSIFree(packed);
  const std::uint64_t stated =
      stated_bytes < 0 ? bytes.size() : static_cast<std::uint64_t>(stated_bytes);
  const std::string body = whole_field(2, stated) + bytes_field(3, zipped);
  const std::string head = bytes_field(1, kind) + whole_field(3, body.size());
  std::string size(4, '\0');
  size[3] = static_cast<char>(head.size());
  return size + head + body;
}
std::string head() {
  return blob("OSMHeader", bytes_field(4, "OsmSchema-V0.6") + bytes_field(4, "DenseNodes"));
}
/// So many nodes, each a tower at the origin.
std::string towers(int count) {
  const std::string strings =
      bytes_field(1, "") + bytes_field(1, "man_made") + bytes_field(1, "tower");
  const auto zigzag = [](std::uint64_t value) { return value << 1; };
  const std::string node = whole_field(1, zigzag(1)) + whole_field(8, zigzag(425000000)) +
                           whole_field(9, zigzag(15000000)) + bytes_field(2, varint(1)) +
                           bytes_field(3, varint(2));
  std::string group;
  for (int i = 0; i < count; ++i) group += bytes_field(1, node);
  return bytes_field(1, strings) + bytes_field(2, group);
}

TEST(ArchiveBombs, BlocksOfOpenStreetMapThatAreNotWhatTheyStateAreRefused) {
  const ScratchFolder folder;
  const auto path = [&](const char* name) { return (folder / name).string(); };
  write_text(folder / "sound.osm.pbf", head() + blob("OSMData", towers(1)));
  EXPECT_EQ(read_features(path("sound.osm.pbf")).features.size(), 1U);
  write_text(folder / "states_2_gib.osm.pbf", head() + blob("OSMData", towers(1), 0x7fffffff));
  write_text(folder / "states_60_mib.osm.pbf", head() + blob("OSMData", towers(1), 60 << 20));
  write_text(folder / "is_200_mib.osm.pbf",
             head() + blob("OSMData", std::string(std::size_t{200} << 20, '\0')));
  write_text(folder / "a_million_alike.osm.pbf", head() + blob("OSMData", towers(1000000)));
  write_text(folder / "of_zeros.osm.pbf",
             head() + blob("OSMData", std::string(std::size_t{30} << 20, '\0')));
  for (const char* name : {"states_2_gib.osm.pbf", "states_60_mib.osm.pbf", "is_200_mib.osm.pbf",
                           "of_zeros.osm.pbf"}) {
    SCOPED_TRACE(name);
    EXPECT_LT(fs::file_size(folder / name), 1U << 20);
    expect_cheap_refusal(ErrorKind::Input, {name, "cannot be read"},
                         [&] { read_features(path(name)); });
  }
  constexpr const char* kAlike = "a_million_alike.osm.pbf";
  EXPECT_LT(fs::file_size(folder / kAlike), 1U << 20);
  expect_cheap_refusal(ErrorKind::Input, {kAlike, "999999 of its nodes", "stand there once more"},
                       [&] { read_features(path(kAlike)); });
}

/// Of a volume of eight voxels, whose parts are then changed.
std::string small_vdb() {
  world::Volume volume;
  volume.size = {2, 2, 2};
  volume.density.assign(8, 255);
  const world::VdbGrid grid{.name = "heat", .volume = &volume};
  const std::vector<std::byte> bytes = world::encode_vdb({&grid, 1});
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

TEST(ArchiveBombs, VolumesThatStateMoreThanTheyHoldAreRefused) {
  const ScratchFolder folder;
  const std::string sound = small_vdb();
  write_text(folder / "heat.vdb", sound);
  EXPECT_EQ(world::read_vdb(folder / "heat.vdb", {}).size, Eigen::Vector3i(2, 2, 2));
  const auto number = [](std::uint32_t value) {
    return std::string(reinterpret_cast<const char*>(&value), sizeof value);
  };
  // The tree's root: one buffer, its background, no tiles, one child about the origin.
  const std::string root = number(1) + number(0) + number(0) + number(1) + std::string(12, '\0');
  const std::size_t root_at = sound.find(root);
  ASSERT_NE(root_at, std::string::npos);
  const std::size_t name_at = sound.find(number(4) + "heat");
  ASSERT_NE(name_at, std::string::npos);
  constexpr std::uint32_t kMost = 0xffffffffU;
  const auto with = [&](std::size_t at, const std::string& bytes) {
    std::string changed = sound;
    return changed.replace(at, bytes.size(), bytes);
  };
  // 4096 voxels a side in the 17 bytes of one tile of the root, which lies 4096 voxels east.
  std::string huge = with(root_at + 8, number(1));
  const float full = 1.0f;
  huge.insert(root_at + 16, number(4096) + number(0) + number(0) +
                                std::string(reinterpret_cast<const char*>(&full), 4) + '\1');
  struct Bomb {
    std::string bytes;
    std::vector<std::string> words;
  };
  constexpr std::size_t kMetadataAt = 8 + 3 * 4 + 1 + 36;  // magic, versions, a flag, an identity
  const std::vector<Bomb> bombs = {
      {huge, {"heat", "voxels"}},
      {with(root_at + 8, number(kMost)), {"damaged"}},
      {with(root_at + 12, number(kMost)), {"damaged"}},
      {with(name_at, number(kMost)), {"states 4294967295 bytes", "damaged"}},
      {with(kMetadataAt, number(kMost)), {"damaged"}},
      {with(kMetadataAt + 4, number(0x7fffffffU)), {"states 2147483647 grids"}},
      {with(8, number(200)), {"format 200", "newer"}},
  };
  // Files state where their grids end, or do not.
  const std::size_t offsets_at = name_at + 8 + (4 + std::strlen("Tree_float_5_4_3")) + 4;
  const auto with_offsets = [&](std::string bytes) {
    const std::uint64_t end = bytes.size();
    bytes[kMetadataAt - 37] = '\1';
    return bytes.replace(offsets_at + 16, 8, std::string(reinterpret_cast<const char*>(&end), 8));
  };
  write_text(folder / "heat.vdb", with_offsets(sound));
  EXPECT_EQ(world::read_vdb(folder / "heat.vdb", {}).size, Eigen::Vector3i(2, 2, 2));
  for (const Bomb& bomb : bombs)
    for (const bool has_offsets : {false, true}) {
      SCOPED_TRACE(bomb.words.front() + (has_offsets ? ", with offsets" : ""));
      write_text(folder / "bomb.vdb", has_offsets ? with_offsets(bomb.bytes) : bomb.bytes);
      const auto start = std::chrono::steady_clock::now();
      expect_cheap_refusal(ErrorKind::Input, bomb.words,
                           [&] { world::read_vdb(folder / "bomb.vdb", {}); });
      EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(5));
    }
}

TEST(ArchiveBombs, VolumesOfNoNumbersAreRefused) {
  const ScratchFolder folder;
  world::Volume volume;
  volume.size = {2, 2, 2};
  volume.density.assign(8, 255);
  const auto with = [&](double factor, const Eigen::Affine3d& frame) {
    const world::VdbGrid grid{
        .name = "heat", .volume = &volume, .factor = factor, .file_from_volume = frame};
    const std::vector<std::byte> bytes = world::encode_vdb({&grid, 1});
    write_text(folder / "heat.vdb", {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  };
  const Eigen::Affine3d as_it_is = Eigen::Affine3d::Identity();
  with(1.0, as_it_is);
  EXPECT_NO_THROW(world::read_vdb(folder / "heat.vdb", {}));
  for (const double value :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    SCOPED_TRACE(value);
    with(value, as_it_is);
    expect_error(ErrorKind::Input, {"heat.vdb", "heat"},
                 [&] { world::read_vdb(folder / "heat.vdb", {}); });
    // OpenVDB writes no such place, so it is written into the file.
    constexpr double kPlace = 12345.625;
    Eigen::Affine3d nowhere = as_it_is;
    nowhere.translation().x() = kPlace;
    with(1.0, nowhere);
    std::string bytes = bytes_of(folder / "heat.vdb");
    int num_changed = 0;
    for (std::size_t at = 0; at + sizeof kPlace <= bytes.size(); ++at) {
      double own = 0.0;
      std::memcpy(&own, bytes.data() + at, sizeof own);
      if (!(std::abs(own - kPlace) < 10.0)) continue;  // a voxel's middle, not its corner
      std::memcpy(bytes.data() + at, &value, sizeof value);
      ++num_changed;
    }
    ASSERT_GT(num_changed, 0);
    write_text(folder / "heat.vdb", bytes);
    expect_error(ErrorKind::Input, {"heat.vdb"}, [&] { world::read_vdb(folder / "heat.vdb", {}); });
  }
}

}  // namespace
}  // namespace terracast::test
