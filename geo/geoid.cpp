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

namespace terracast::geo {
namespace {

namespace fs = std::filesystem;

constexpr const char* kGridName = "egm96-15";
constexpr const char* kGridFile = "egm96_15.gtx";

// The grid, in quarter degrees: both files hold its nodes, poles included.
constexpr int kRows = 721;
constexpr int kColumns = 1440;
constexpr double kSpacing_deg = 0.25;

// GeographicLib's format: height = offset + scale x pixel.
constexpr double kOffset_m = -108.0;
constexpr double kScale_m = 0.003;

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

/// The whole file that GeographicLib reads. It depends on the grid alone.
std::string pgm_text(const std::vector<double>& heights_m) {
  std::string text = fmt::format(
      "P5\n"
      "# Geoid file in PGM format for the GeographicLib::Geoid class\n"
      "# Description WGS84 EGM96, 15-minute grid\n"
      "# DateTime 1996-01-01 00:00:00\n"
      "# Offset {}\n"
      "# Scale {}\n"
      "# Origin 90N 0E\n"
      "# AREA_OR_POINT Point\n"
      "# Vertical_Datum WGS84\n"
      "{} {}\n"
      "65535\n",
      kOffset_m, kScale_m, kColumns, kRows);
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
             "{} is in none of PROJ's data folders ({}); install the package proj-data, or set "
             "PROJ_DATA to the folder that has it",
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

}  // namespace

struct Geoid::Impl {
  explicit Impl(const fs::path& folder) : grid(kGridName, folder.string(), true, true) {}
  GeographicLib::Geoid grid;  // thread-safe: the whole grid is in memory and the file is closed
};

Geoid::Geoid(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Geoid::~Geoid() = default;

std::shared_ptr<const Geoid> Geoid::egm96(const fs::path& gtx_file, const fs::path& cache_folder) {
  const std::string text = pgm_text(read_gtx(gtx_file));
  const fs::path file = cache_folder / (std::string(kGridName) + ".pgm");
  if (!holds(file, text)) core::write_file(file, std::string_view(text));
  try {
    return std::shared_ptr<const Geoid>(new Geoid(std::make_unique<Impl>(cache_folder)));
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
  if (!cached) {
    core::fail(core::ErrorKind::Io,
               "no folder to keep the geoid's grid in; set XDG_CACHE_HOME to one");
  }
  return cached;
}

double Geoid::undulation_m(double lat_deg, double lon_deg) const {
  if (!(std::abs(lat_deg) <= 90.0) || !std::isfinite(lon_deg)) {
    core::fail(core::ErrorKind::Input,
               "the geoid has no height at lat {} deg, lon {} deg: latitude lies in -90 to 90",
               lat_deg, lon_deg);
  }
  return impl_->grid(lat_deg, lon_deg);
}

VerticalDatum vertical_datum_from_name(const std::string& name) {
  if (name == "ellipsoid") return VerticalDatum::Ellipsoid;
  if (name == "egm96") return VerticalDatum::Egm96;
  core::fail(core::ErrorKind::Config,
             "unknown vertical datum \"{}\"; known: ellipsoid (heights above WGS84), egm96 (above "
             "mean sea level)",
             name);
}

std::string name_of(VerticalDatum datum) {
  return datum == VerticalDatum::Ellipsoid ? "ellipsoid" : "egm96";
}

}  // namespace terracast::geo
