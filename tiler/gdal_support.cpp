#include "tiler/gdal_support.h"

#include <cpl_error.h>
#include <cpl_string.h>
#include <cpl_vsi.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <memory>
#include <mutex>
#include <new>
#include <set>
#include <string_view>
#include <vector>

#include "core/error.h"
#include "core/hash.h"
#include "tiler/apart/given_dataset.h"
#include "tiler/apart/given_features.h"
#include "tiler/apart/given_raster.h"
#include "tiler/apart/trodden.h"
#include "tiler/gdal_formats.h"
#include "tiler/gdal_options.h"
#include "tiler/osm_order.h"
#include "tiler/terrain_tiles_source.h"
#include "tiler/text_grids.h"
#include "tiler/vrt_sources.h"

namespace terracast::tiler {

using core::ErrorKind;
using core::fail;

GdalErrors::GdalErrors() { CPLPushErrorHandlerEx(&GdalErrors::collect, this); }
GdalErrors::~GdalErrors() { CPLPopErrorHandler(); }

std::string GdalErrors::text() const {
  return text_.empty() ? "GDAL gives no reason" : "GDAL: " + text_;
}

void CPL_STDCALL GdalErrors::collect(CPLErr level, CPLErrorNum number, const char* message) {
  if (level < CE_Warning) return;
  auto* self = static_cast<GdalErrors*>(CPLGetErrorHandlerUserData());
  self->has_failure_ = self->has_failure_ || level >= CE_Failure;
  self->has_lacked_memory_ = self->has_lacked_memory_ || number == CPLE_OutOfMemory;
  if (self->text_.size() < 400)
    self->text_ += (self->text_.empty() ? "" : "; ") + std::string(message);
}

namespace {

constexpr std::string_view kZipped = "/vsizip/";

void refuse_empty(const VSIStatBufL& status, const std::string& written) {
  if (VSI_ISREG(status.st_mode) && status.st_size == 0)
    fail(ErrorKind::Input, "{}: is empty, a file of 0 bytes; fetch or write it again", written);
}

/// The one file of an archive, as GDAL finds it.
std::string only_member(const std::string& archive, const std::string& written) {
  const std::string folder = std::string(kZipped) + archive;
  char** entries = VSIReadDir(folder.c_str());
  std::vector<std::string> files;
  for (int i = 0; entries != nullptr && entries[i] != nullptr; ++i) {
    VSIStatBufL status;
    const std::string member = folder + "/" + entries[i];
    if (VSIStatL(member.c_str(), &status) == 0 && VSI_ISDIR(status.st_mode) == 0)
      files.push_back(member);
  }
  CSLDestroy(entries);
  if (files.size() != 1)
    fail(ErrorKind::Input,
         "{}: holds {} files beside its folders; name one as /vsizip/{}/MEMBER (is it damaged, if "
         "there should be one?)",
         written, files.size(), written);
  return files.front();
}

/// What an archive may hold for each of its bytes, and beside that. Text shrinks to a thirtieth at
/// best; what a bomb is made of, to a thousandth.
constexpr std::uint64_t kLargestUnpackedShare = 100;
constexpr std::uint64_t kSmallUnpacked_bytes = std::uint64_t{64} << 20;

/// The archive in a path such as /vsizip/folder/archive.zip/member, or the file itself where it is one, as .kmz and
/// .hgt.zip are; empty where there is none.
std::string archive_of(const std::string& path) {
  std::error_code ignored;
  if (path.starts_with(kZipped)) {
    std::filesystem::path archive = path.substr(kZipped.size());
    while (archive.has_relative_path() && !std::filesystem::is_regular_file(archive, ignored))
      archive = archive.parent_path();
    return archive.has_relative_path() ? archive.string() : "";
  }
  if (!std::filesystem::is_regular_file(path, ignored)) return "";
  std::array<char, 4> begin = {};
  std::ifstream(path, std::ios::binary).read(begin.data(), begin.size());
  return std::string_view(begin.data(), begin.size()) == std::string_view("PK\3\4", 4) ? path : "";
}

/// GDAL reads more than files by such names: networks, and streams that unpack without an end.
void check_name(const std::string& path, const std::string& written) {
  std::error_code ignored;
  if (!path.starts_with("/vsi") || std::filesystem::exists(path, ignored) ||
      path.starts_with(OrderedOsm::kFolder))
    return;
  const bool is_zipped = path.starts_with(kZipped);
  const bool is_part = path.starts_with("/vsisubfile/");
  const std::string of = is_zipped ? path.substr(kZipped.size())
                         : is_part ? path.substr(path.find(',') + 1)
                                   : path;
  if (of.starts_with("/vsi"))
    fail(ErrorKind::Input,
         "{}: only files are read, and those in archives as /vsizip/FILE.zip/MEMBER; fetch or "
         "unpack it, and name the file",
         written);
  if (!is_zipped) return;
  const std::string archive = archive_of(path);
  if (archive.empty() || path.find("..", kZipped.size() + archive.size()) != std::string::npos)
    fail(ErrorKind::Input, "{}: a path into an archive is /vsizip/FILE.zip/MEMBER, without \"..\"",
         written);
}

void check_unpacked_size(const std::string& path, const std::string& written) {
  const std::string archive = archive_of(path);
  if (archive.empty()) return;
  const std::uint64_t packed_bytes = std::filesystem::file_size(archive);
  const std::string folder = std::string(kZipped) + archive;
  char** entries = VSIReadDirRecursive(folder.c_str());
  std::uint64_t unpacked_bytes = 0;
  for (int i = 0; entries != nullptr && entries[i] != nullptr; ++i) {
    VSIStatBufL status;
    if (VSIStatL((folder + "/" + entries[i]).c_str(), &status) == 0)
      unpacked_bytes += static_cast<std::uint64_t>(status.st_size);
  }
  CSLDestroy(entries);
  if (unpacked_bytes > kSmallUnpacked_bytes &&
      unpacked_bytes / kLargestUnpackedShare > packed_bytes)
    fail(
        ErrorKind::Input,
        "{}: unpacks from {} to {} bytes, as archives do that are made to fill a machine; if it is "
        "sound, unpack it and name the file",
        written, packed_bytes, unpacked_bytes);
}

/// How the OSM driver is told to keep all tags, and which closed ways go round an area.
const char* osm_rules() {
  static constexpr char kFile[] = "/vsimem/terracast_osm_rules.ini";
  static constexpr char kText[] =
      R"(closed_ways_are_polygons=aeroway,amenity,area,area:highway,boundary,building,building:part,craft,geological,golf,historic,landcover,landuse,leisure,man_made,military,natural,office,place,power,highway=platform,railway=platform,shop,sport,tourism,water,wetland,public_transport=platform
attribute_name_laundering=no
report_all_tags=yes
[points]
osm_id=yes
all_tags=yes
[lines]
osm_id=yes
all_tags=yes
[multipolygons]
osm_id=yes
all_tags=yes
[multilinestrings]
osm_id=yes
all_tags=yes
[other_relations]
osm_id=yes
all_tags=yes
)";
  static std::once_flag once;
  std::call_once(once, [] {
    VSILFILE* file = VSIFOpenL(kFile, "wb");
    VSIFWriteL(kText, 1, sizeof kText - 1, file);
    VSIFCloseL(file);
  });
  return kFile;
}

/// Nothing where there is none.
bool add_plain_file(const std::string& name, std::set<std::filesystem::path>& files) {
  const std::filesystem::path file = plain_file(name);
  std::error_code ignored;
  return std::filesystem::is_regular_file(file, ignored) && files.insert(file).second;
}

/// GDAL lists what a VRT names, but not what VRTs in it name.
void add_files_of(GDALDataset& dataset, int depth, std::set<std::filesystem::path>& files) {
  const bool is_complete = dynamic_cast<const GivenDataset*>(&dataset) != nullptr;
  const std::unique_ptr<char*, decltype(&CSLDestroy)> list(dataset.GetFileList(), &CSLDestroy);
  for (int i = 0; list && list.get()[i] != nullptr; ++i) {
    const std::string name = list.get()[i];
    if (name.ends_with(".aux.xml") || !add_plain_file(name, files)) continue;
    if (is_complete || depth == kDeepestVrt || !name.ends_with(".vrt")) continue;
    const GdalDatasetPtr inner(GDALDataset::Open(name.c_str(), GDAL_OF_RASTER, kRasterFormats));
    if (inner) add_files_of(*inner, depth + 1, files);
  }
}

/// What GDAL is to open.
/// what     "raster", for messages
/// throws   as open_gdal_raster(), but for what stands in the file
std::string path_to_open(const core::Path& file, const char* what) {
  const std::string path = gdal_path(file);
  check_name(path, file.written);
  VSIStatBufL status;
  if (VSIStatL(path.c_str(), &status) != 0)
    fail(ErrorKind::Io,
         "{}: there is no such {}; give the path of a file of a format in "
         "docs/tiler.md",
         file.written, what);
  if (VSI_ISREG(status.st_mode) == 0 && VSI_ISDIR(status.st_mode) == 0)
    fail(ErrorKind::Input,
         "{}: is a pipe or a device, and only regular files are read; copy what it gives into one",
         file.written);
  refuse_empty(status, file.written);
  check_unpacked_size(path, file.written);
  return path;
}

/// A folder of terrain tiles, which is read as the text of a VRT that names them.
bool is_folder_of_tiles(const std::string& path) {
  std::error_code ignored;
  return !path.starts_with("/vsi") && std::filesystem::is_directory(path, ignored);
}

GdalDatasetPtr open_raster(const std::string& what, const char* const* formats) {
  return GdalDatasetPtr(
      GDALDataset::Open(what.c_str(), GDAL_OF_RASTER | GDAL_OF_VERBOSE_ERROR, formats));
}

[[noreturn]] void refuse_raster(const core::Path& file, const GdalErrors& errors) {
  fail(ErrorKind::Input,
       "{}: cannot be opened as a raster; is it damaged or truncated, or of a format that leads "
       "to a network or is not read (gdal_translate makes a GeoTIFF of it)? ({})",
       file.written, errors.text());
}

GdalDatasetPtr open_vectors(const std::string& path, const char* const* formats) {
  const std::string rules = std::string("CONFIG_FILE=") + osm_rules();
  const char* const options[] = {rules.c_str(), nullptr};
  const char* const no_options[] = {nullptr};
  const bool is_osm = path.ends_with(".pbf") || path.ends_with(".osm");
  return GdalDatasetPtr(GDALDataset::Open(path.c_str(), GDAL_OF_VECTOR | GDAL_OF_VERBOSE_ERROR,
                                          formats, is_osm ? options : no_options));
}

[[noreturn]] void refuse_vectors(const core::Path& file, const GdalErrors& errors) {
  fail(ErrorKind::Input,
       "{}: cannot be opened as features; is it damaged or truncated, or a format that leads "
       "elsewhere, such as VRT? ({})",
       file.written, errors.text());
}

}  // namespace

std::string gdal_path(const core::Path& file) {
  const std::string path = file.resolved.empty() ? file.written : file.resolved.string();
  VSIStatBufL status;
  const bool is_archive = path.ends_with(".zip") && !path.ends_with(".hgt.zip") &&
                          !path.starts_with("/vsi") && VSIStatL(path.c_str(), &status) == 0;
  if (is_archive) refuse_empty(status, file.written);
  return is_archive ? only_member(path, file.written) : path;
}

std::filesystem::path plain_file(const std::string& gdal_path) {
  std::filesystem::path file =
      gdal_path.starts_with(kZipped) ? gdal_path.substr(kZipped.size()) : gdal_path;
  std::error_code ignored;
  while (file.has_relative_path() && !std::filesystem::exists(file, ignored))
    file = file.parent_path();
  return file;
}

GdalDatasetPtr open_gdal_raster(const core::Path& file, const GdalErrors& errors) {
  register_gdal();
  const std::string path = path_to_open(file, "raster");
  if (!is_folder_of_tiles(path) && !is_trodden_raster(path))
    return has_all_gdal() ? open_raster_here(file, errors) : given_raster(file);
  GdalDatasetPtr dataset = open_raster(
      is_folder_of_tiles(path) ? vrt_of_terrain_tiles(path, file.written) : path, kTroddenRasters);
  if (!dataset) refuse_raster(file, errors);
  return dataset;
}

GdalDatasetPtr open_raster_here(const core::Path& file, const GdalErrors& errors) {
  GdalDatasetPtr dataset = open_raster(path_to_open(file, "raster"), kRasterFormats);
  if (!dataset && errors.has_lacked_memory()) throw std::bad_alloc();
  if (!dataset) refuse_raster(file, errors);
  read_text_grid_in_order(*dataset, file.written);
  return dataset;
}

GdalDatasetPtr open_gdal_vectors(const core::Path& file, const GdalErrors& errors) {
  register_gdal();
  const std::string path = path_to_open(file, "file");
  if (!is_trodden_vectors(path))
    return has_all_gdal() ? open_vectors_here(file, errors) : given_features(file);
  GdalDatasetPtr dataset = open_vectors(path, kTroddenVectors);
  if (!dataset) refuse_vectors(file, errors);
  return dataset;
}

GdalDatasetPtr open_vectors_here(const core::Path& file, const GdalErrors& errors) {
  GdalDatasetPtr dataset = open_vectors(path_to_open(file, "file"), kVectorFormats);
  if (!dataset && errors.has_lacked_memory()) throw std::bad_alloc();
  if (!dataset) refuse_vectors(file, errors);
  return dataset;
}

std::vector<std::string> files_of(GDALDataset& dataset, const core::Path& file) {
  std::set<std::filesystem::path> files;
  add_files_of(dataset, 0, files);
  if (files.empty()) add_plain_file(gdal_path(file), files);
  std::vector<std::string> names;
  for (const std::filesystem::path& one : files) names.push_back(one.string());
  return names;
}

std::string content_hash_of(GDALDataset& dataset, const core::Path& file) {
  std::string all = gdal_identity() + "\n";
  for (const std::filesystem::path one : files_of(dataset, file))
    all += one.extension().string() + " " + core::content_hash_of_file(one) + "\n";
  return core::content_hash(all);
}

}  // namespace terracast::tiler
