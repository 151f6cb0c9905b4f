#include "geo/geoid.h"

#include <GeographicLib/Geoid.hpp>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <vector>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"

namespace terracast::geo {
namespace {

namespace fs = std::filesystem;

constexpr const char* kGridFile = "egm96_15.gtx";

/// A geoid's grid over the whole Earth: nodes from pole to pole, from longitude 0 eastwards.
struct PgmGrid {
  const char* name;         ///< as GeographicLib calls it
  const char* description;  ///< as GeographicLib's file says it
  const char* published;
  int rows;
  int columns;
};
constexpr PgmGrid kEgm96 = {"egm96-15", "WGS84 EGM96, 15-minute grid", "1996-01-01 00:00:00", 721,
                            1440};
constexpr PgmGrid kEgm2008 = {"egm2008-2_5", "WGS84 EGM2008, 2.5-minute grid",
                              "2008-04-01 00:00:00", 4321, 8640};

// EGM96's grid, in quarter degrees: both files hold its nodes, poles included.
constexpr int kRows = kEgm96.rows;
constexpr int kColumns = kEgm96.columns;
constexpr double kSpacing_deg = 0.25;

// GeographicLib's format: height = offset + scale x pixel.
constexpr double kOffset_m = -108.0;
constexpr double kScale_m = 0.003;

/// Vertical data of the Earth lie within 110 m of each other; planets' and typing errors do not.
constexpr double kLargestOffset_m = 1000.0;
/// Undulations of the Earth's geoid lie within -107 and 86 m.
constexpr double kLargestUndulation_m = 107.5;

std::uint64_t big_endian(const std::byte* bytes, int count) {
  std::uint64_t value = 0;
  for (int i = 0; i < count; ++i) value = (value << 8) | std::to_integer<std::uint64_t>(bytes[i]);
  return value;
}

double big_endian_double(const std::byte* bytes) {
  return std::bit_cast<double>(big_endian(bytes, 8));
}

double big_endian_float(const std::byte* bytes) {
  return static_cast<double>(
      std::bit_cast<float>(static_cast<std::uint32_t>(big_endian(bytes, 4))));
}

/// Undulations of a GTX file, north to south, from longitude 0 eastwards.
std::vector<double> read_gtx(const fs::path& file) {
  constexpr std::size_t kHeaderBytes = 40;
  constexpr std::size_t kFileBytes = kHeaderBytes + std::size_t{4} * kRows * kColumns;
  const std::vector<std::byte> bytes = core::read_file(file, 2 * kFileBytes);
  if (bytes.size() != kFileBytes) {
    core::fail(core::ErrorKind::Input,
               "{}: {} bytes; the 15-minute EGM96 grid in GTX form has {} (is it damaged? the "
               "package proj-data brings it)",
               file.string(), bytes.size(), kFileBytes);
  }
  const double south_deg = big_endian_double(&bytes[0]);
  const double west_deg = big_endian_double(&bytes[8]);
  const double lat_step_deg = big_endian_double(&bytes[16]);
  const double lon_step_deg = big_endian_double(&bytes[24]);
  const std::uint64_t rows = big_endian(&bytes[32], 4);
  const std::uint64_t columns = big_endian(&bytes[36], 4);
  const double shift = west_deg / kSpacing_deg;
  if (south_deg != -90.0 || lat_step_deg != kSpacing_deg || lon_step_deg != kSpacing_deg ||
      rows != kRows || columns != kColumns || !(std::abs(west_deg) <= 360.0) ||
      shift != std::round(shift)) {
    core::fail(core::ErrorKind::Input,
               "{}: a grid of {} x {} nodes from lat {} deg, lon {} deg in steps of {}, {} deg; "
               "EGM96's has {} x {} from the south pole in steps of 0.25",
               file.string(), rows, columns, south_deg, west_deg, lat_step_deg, lon_step_deg, kRows,
               kColumns);
  }
  const int first_column = static_cast<int>(std::lround(shift));
  std::vector<double> heights_m(std::size_t{kRows} * kColumns);
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      const int from_zero = ((column + first_column) % kColumns + kColumns) % kColumns;
      const std::size_t source = std::size_t(row) * kColumns + std::size_t(column);
      const double value = big_endian_float(&bytes[kHeaderBytes + 4 * source]);
      const double pixel = (value - kOffset_m) / kScale_m;
      if (!(pixel >= 0.0 && pixel <= 65535.0)) {
        core::fail(core::ErrorKind::Input,
                   "{}: undulation {} m at row {}, column {} is outside EGM96's range of -107 to "
                   "86 m",
                   file.string(), value, row, column);
      }
      heights_m[std::size_t(kRows - 1 - row) * kColumns + std::size_t(from_zero)] = value;
    }
  }
  return heights_m;
}

/// EGM2008's undulations off GEOTRANS's file, north to south, from longitude 0 eastwards. Big-endian:
/// i32 width of the rim, rows, columns; f64 steps of latitude and longitude, deg; then f32
/// undulations, north to south, of the grid (the first column again behind the last) and a rim
/// about it that repeats what lies across the pole or the meridian.
std::vector<double> read_geotrans_grid(const fs::path& file) {
  constexpr std::size_t kHeaderBytes = 28;
  constexpr int kRim = 9;
  constexpr double kStep_deg = 2.5 / 60.0;
  constexpr std::size_t kStride = kEgm2008.columns + 1 + 2 * kRim;
  constexpr std::size_t kFileBytes = kHeaderBytes + 4 * (kEgm2008.rows + 2 * kRim) * kStride;
  const std::vector<std::byte> bytes = core::read_file(file, 2 * kFileBytes);
  if (bytes.size() != kFileBytes)
    core::fail(
        core::ErrorKind::Input,
        "{}: {} bytes; GEOTRANS's grid of EGM2008 "
        "(Und_min2.5x2.5_egm2008_WGS84_TideFree_reformatted, of the Debian package geotranz) "
        "has {}",
        file.string(), bytes.size(), kFileBytes);
  const std::uint64_t rim = big_endian(&bytes[0], 4);
  const std::uint64_t rows = big_endian(&bytes[4], 4);
  const std::uint64_t columns = big_endian(&bytes[8], 4);
  const double lat_step_deg = big_endian_double(&bytes[12]);
  const double lon_step_deg = big_endian_double(&bytes[20]);
  const auto is_step = [](double step_deg) { return std::abs(step_deg - kStep_deg) < 1e-12; };
  if (rim != kRim || rows != kEgm2008.rows || columns != kEgm2008.columns ||
      !is_step(lat_step_deg) || !is_step(lon_step_deg))
    core::fail(core::ErrorKind::Input,
               "{}: a grid of {} x {} nodes with a rim of {} in steps of {}, {} deg; GEOTRANS's of "
               "EGM2008 has {} x {} with one of {} in steps of {}",
               file.string(), rows, columns, rim, lat_step_deg, lon_step_deg, kEgm2008.rows,
               kEgm2008.columns, kRim, kStep_deg);
  std::vector<double> heights_m(std::size_t{kEgm2008.rows} * kEgm2008.columns);
  for (std::size_t row = 0; row < kEgm2008.rows; ++row)
    for (std::size_t column = 0; column < kEgm2008.columns; ++column) {
      const std::size_t node = (row + kRim) * kStride + column + kRim;
      const double value_m = big_endian_float(&bytes[kHeaderBytes + 4 * node]);
      if (!(std::abs(value_m) <= kLargestUndulation_m))
        core::fail(core::ErrorKind::Input,
                   "{}: undulation {} m at row {}, column {} is outside EGM2008's range of -107 to "
                   "86 m; is the file damaged?",
                   file.string(), value_m, row, column);
      heights_m[row * kEgm2008.columns + column] = value_m;
    }
  return heights_m;
}

/// The whole file that GeographicLib reads. It depends on the grid alone.
std::string pgm_text(const PgmGrid& grid, const std::vector<double>& heights_m) {
  std::string text = fmt::format(
      "P5\n"
      "# Geoid file in PGM format for the GeographicLib::Geoid class\n"
      "# Description {}\n"
      "# DateTime {}\n"
      "# Offset {}\n"
      "# Scale {}\n"
      "# Origin 90N 0E\n"
      "# AREA_OR_POINT Point\n"
      "# Vertical_Datum WGS84\n"
      "{} {}\n"
      "65535\n",
      grid.description, grid.published, kOffset_m, kScale_m, grid.columns, grid.rows);
  text.reserve(text.size() + 2 * heights_m.size());
  for (const double height_m : heights_m) {
    const auto pixel = static_cast<std::uint16_t>(std::lround((height_m - kOffset_m) / kScale_m));
    text.push_back(static_cast<char>(pixel >> 8));
    text.push_back(static_cast<char>(pixel & 0xff));
  }
  return text;
}

bool holds(const fs::path& file, const std::string& text) {
  std::error_code ignored;
  if (fs::file_size(file, ignored) != text.size() || ignored) return false;
  try {
    const std::vector<std::byte> bytes = core::read_file(file, text.size());
    return bytes.size() == text.size() && std::memcmp(bytes.data(), text.data(), text.size()) == 0;
  } catch (const core::Error&) {
    return false;  // unreadable counts as damaged: it is written again
  }
}

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? std::string() : std::string(value);
}

/// The grid in the first of PROJ's data folders that has it.
fs::path find_gtx() {
  std::vector<fs::path> folders;
  for (const char* variable : {"PROJ_DATA", "PROJ_LIB"}) {
    std::string list = environment(variable);
    while (!list.empty()) {
      const std::size_t end = std::min(list.find(':'), list.size());
      if (end > 0) folders.emplace_back(list.substr(0, end));
      list.erase(0, end + 1);
    }
  }
  for (const char* folder : {"/usr/share/proj", "/usr/local/share/proj"})
    folders.emplace_back(folder);
  std::string searched;
  for (const fs::path& folder : folders) {
    std::error_code ignored;
    if (fs::exists(folder / kGridFile, ignored)) return folder / kGridFile;
    searched += (searched.empty() ? "" : ", ") + folder.string();
  }
  core::fail(core::ErrorKind::Io,
             "{} is in none of PROJ's data folders ({}); install the package proj-data, which has it",
             kGridFile, searched);
}

/// The user's cache folder first; a folder for temporary files where there is none to write to.
std::vector<fs::path> cache_folders() {
  std::vector<fs::path> folders;
  if (const std::string cache = environment("XDG_CACHE_HOME"); !cache.empty()) {
    folders.push_back(fs::path(cache) / "terracast");
  }
  if (const std::string home = environment("HOME"); !home.empty()) {
    folders.push_back(fs::path(home) / ".cache" / "terracast");
  }
  std::error_code none;
  const fs::path temporary = fs::temp_directory_path(none);
  if (!none) folders.push_back(temporary / "terracast-cache");
  return folders;
}

/// Beside a grid that we wrote: the hash of its bytes.
fs::path hash_file_of(fs::path pgm_file) { return pgm_file.replace_extension(".xxh3"); }

[[noreturn]] void fail_without_cache() {
  core::fail(core::ErrorKind::Io,
             "no folder to keep the geoid's grid in; set XDG_CACHE_HOME to one");
}

/// The finest grid in the first folder that has one: ours, then those of GeographicLib.
fs::path find_egm2008() {
  std::vector<fs::path> folders = cache_folders();
  if (const std::string path = environment("GEOGRAPHICLIB_GEOID_PATH"); !path.empty())
    folders.emplace_back(path);
  if (const std::string path = environment("GEOGRAPHICLIB_DATA"); !path.empty())
    folders.push_back(fs::path(path) / "geoids");
  for (const char* folder :
       {"/usr/local/share/GeographicLib/geoids", "/usr/share/GeographicLib/geoids"})
    folders.emplace_back(folder);
  std::string searched;
  for (const fs::path& folder : folders) {
    for (const char* name : {"egm2008-1.pgm", "egm2008-2_5.pgm", "egm2008-5.pgm"}) {
      std::error_code ignored;
      if (fs::exists(folder / name, ignored)) return folder / name;
    }
    searched += (searched.empty() ? "" : ", ") + folder.string();
  }
  core::fail(core::ErrorKind::Io,
             "no grid of EGM2008 (egm2008-….pgm) is in {}; bring one there: `apt-get download "
             "geotranz`, unpack it with `dpkg-deb -x`, then `terracast geoid import "
             "usr/share/geotranz/data/Und_min2.5x2.5_egm2008_WGS84_TideFree_reformatted`",
             searched);
}

}  // namespace

struct Geoid::Impl {
  virtual ~Impl() = default;
  virtual double undulation_m(double lat_deg, double lon_deg) const = 0;
  virtual bool covers(double lat_deg, double lon_deg) const = 0;
};

struct Geoid::GlobalGrid : Geoid::Impl {
  explicit GlobalGrid(const fs::path& pgm_file)
      : grid(pgm_file.stem().string(), pgm_file.parent_path().string(), true, true) {}
  double undulation_m(double lat_deg, double lon_deg) const override {
    return grid(lat_deg, lon_deg);
  }
  bool covers(double, double) const override { return true; }
  GeographicLib::Geoid grid;  // thread-safe: the whole grid is in memory and the file is closed
};

struct Geoid::LocalGrid : Geoid::Impl {
  explicit LocalGrid(OffsetGrid offsets) : grid(std::move(offsets)) {}

  double row_of(double lat_deg) const { return (lat_deg - grid.south_deg) / grid.lat_step_deg; }
  double column_of(double lon_deg) const {
    // Counted so that it falls into the grid, or as near to it as whole turns bring it.
    const double middle_deg = grid.west_deg + 0.5 * (grid.num_columns - 1) * grid.lon_step_deg;
    const double turned_deg = middle_deg + std::remainder(lon_deg - middle_deg, 360.0);
    return (turned_deg - grid.west_deg) / grid.lon_step_deg;
  }
  bool covers(double lat_deg, double lon_deg) const override {
    const double row = row_of(lat_deg);
    const double column = column_of(lon_deg);
    return row >= 0.0 && row <= grid.num_rows - 1 && column >= 0.0 &&
           column <= grid.num_columns - 1 && std::isfinite(undulation_m(lat_deg, lon_deg));
  }
  double undulation_m(double lat_deg, double lon_deg) const override {
    const double row = std::clamp(row_of(lat_deg), 0.0, grid.num_rows - 1.0);
    const double column = std::clamp(column_of(lon_deg), 0.0, grid.num_columns - 1.0);
    const int j = std::min(static_cast<int>(row), grid.num_rows - 2);
    const int i = std::min(static_cast<int>(column), grid.num_columns - 2);
    const auto node = [&](int dj, int di) {
      return grid
          .offsets_m[static_cast<std::size_t>(j + dj) * static_cast<std::size_t>(grid.num_columns) +
                     static_cast<std::size_t>(i + di)];
    };
    const double south = node(0, 0) + (column - i) * (node(0, 1) - node(0, 0));
    const double north = node(1, 0) + (column - i) * (node(1, 1) - node(1, 0));
    return south + (row - j) * (north - south);
  }
  OffsetGrid grid;
};

Geoid::Geoid(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Geoid::~Geoid() = default;

std::shared_ptr<const Geoid> Geoid::egm96(const fs::path& gtx_file, const fs::path& cache_folder) {
  const std::string text = pgm_text(kEgm96, read_gtx(gtx_file));
  const fs::path file = cache_folder / (std::string(kEgm96.name) + ".pgm");
  if (!holds(file, text)) core::write_file(file, std::string_view(text));
  try {
    return std::shared_ptr<const Geoid>(new Geoid(std::make_unique<GlobalGrid>(file)));
  } catch (const GeographicLib::GeographicErr& error) {
    core::fail(core::ErrorKind::Io, "{}: {}; remove it and try again", file.string(), error.what());
  }
}

std::shared_ptr<const Geoid> Geoid::egm96() {
  static std::mutex mutex;
  static std::shared_ptr<const Geoid> cached;
  const std::scoped_lock lock(mutex);
  if (cached) return cached;
  const fs::path gtx_file = find_gtx();
  const std::vector<fs::path> folders = cache_folders();
  for (std::size_t i = 0; i < folders.size() && !cached; ++i) {
    try {
      cached = egm96(gtx_file, folders[i]);
    } catch (const core::Error& error) {
      const bool can_try_next = error.kind() == core::ErrorKind::Io && i + 1 < folders.size();
      if (!can_try_next) throw;
    }
  }
  if (!cached) fail_without_cache();
  return cached;
}

std::shared_ptr<const Geoid> Geoid::egm2008(const fs::path& pgm_file) {
  std::error_code ignored;
  const fs::path hash_file = hash_file_of(pgm_file);
  if (fs::exists(hash_file, ignored) &&
      core::read_text_file(hash_file) != core::content_hash_of_file(pgm_file))
    core::fail(
        core::ErrorKind::Input,
        "{}: damaged: its content is not what {} says; import it again with `terracast geoid "
        "import`",
        pgm_file.string(), hash_file.filename().string());
  try {
    return std::shared_ptr<const Geoid>(new Geoid(std::make_unique<GlobalGrid>(pgm_file)));
  } catch (const GeographicLib::GeographicErr& error) {
    core::fail(core::ErrorKind::Input, "{}: {}; import it again with `terracast geoid import`",
               pgm_file.string(), error.what());
  }
}

std::shared_ptr<const Geoid> Geoid::egm2008() {
  static std::mutex mutex;
  static std::shared_ptr<const Geoid> cached;
  const std::scoped_lock lock(mutex);
  if (!cached) cached = egm2008(find_egm2008());
  return cached;
}

std::shared_ptr<const Geoid> Geoid::from_grid(OffsetGrid grid) {
  if (grid.num_rows < 2 || grid.num_columns < 2 || !(grid.lat_step_deg > 0.0) ||
      !(grid.lon_step_deg > 0.0) || !std::isfinite(grid.south_deg) ||
      !std::isfinite(grid.west_deg) ||
      grid.offsets_m.size() !=
          static_cast<std::size_t>(grid.num_rows) * static_cast<std::size_t>(grid.num_columns))
    core::fail(core::ErrorKind::Input,
               "{}: {} x {} nodes in steps of {} and {} deg are no grid of offsets; it takes 2 x 2 "
               "and more, in latitude and longitude",
               grid.name, grid.num_columns, grid.num_rows, grid.lon_step_deg, grid.lat_step_deg);
  for (std::size_t k = 0; k < grid.offsets_m.size(); ++k)
    if (std::abs(grid.offsets_m[k]) > kLargestOffset_m)
      core::fail(core::ErrorKind::Input,
                 "{}: an offset of {} m (node {} from the south-west) is beyond {} m; is this a "
                 "grid of heights above the ellipsoid, in metres?",
                 grid.name, grid.offsets_m[k], k, kLargestOffset_m);
  return std::shared_ptr<const Geoid>(new Geoid(std::make_unique<LocalGrid>(std::move(grid))));
}

double Geoid::undulation_m(double lat_deg, double lon_deg) const {
  if (!(std::abs(lat_deg) <= 90.0) || !std::isfinite(lon_deg)) {
    core::fail(core::ErrorKind::Input,
               "the geoid has no height at lat {} deg, lon {} deg: latitude lies in -90 to 90",
               lat_deg, lon_deg);
  }
  return impl_->undulation_m(lat_deg, lon_deg);
}

bool Geoid::covers(double lat_deg, double lon_deg) const { return impl_->covers(lat_deg, lon_deg); }

fs::path geoid_folder() {
  const std::vector<fs::path> folders = cache_folders();
  if (folders.empty()) fail_without_cache();
  return folders.front();
}

fs::path import_egm2008(const fs::path& file, const fs::path& folder) {
  const fs::path written = folder / (std::string(kEgm2008.name) + ".pgm");
  core::make_folder(folder);
  const std::string text = pgm_text(kEgm2008, read_geotrans_grid(file));
  // Without its hash a grid is taken as it is: the old one goes first, the new one comes last.
  std::error_code ignored;
  fs::remove(hash_file_of(written), ignored);
  core::write_file(written, std::string_view(text));
  core::write_file(hash_file_of(written),
                   std::string_view(core::content_hash(std::string_view(text))));
  return written;
}

void check_vertical_datum_name(const std::string& name) {
  if (name == "ellipsoid" || name == "egm96" || name == "egm2008") return;
  core::fail(core::ErrorKind::Config,
             "unknown vertical datum \"{}\"; known: ellipsoid (heights above WGS84), egm96 and "
             "egm2008 (above mean sea level); grid (of rasters: a grid of offsets of their own)",
             name);
}

VerticalDatum vertical_datum_from_name(const std::string& name) {
  check_vertical_datum_name(name);
  if (name == "egm96") return {name, Geoid::egm96()};
  if (name == "egm2008") return {name, Geoid::egm2008()};
  return {name, nullptr};
}

}  // namespace terracast::geo
