// Recordings of flights, tables of rays, geoids.

#include <memory>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/hash.h"
#include "core/toml_reader.h"
#include "geo/camera_model.h"
#include "geo/fixes/cleaning.h"
#include "geo/fixes/fix_format.h"
#include "geo/fixes/placing.h"
#include "geo/geoid.h"
#include "tests/fuzz/scratch.h"

namespace terracast::fuzz {
namespace {

namespace fs = std::filesystem;

const geo::WorldFrame& frame() {
  static const geo::WorldFrame frame({.lat_deg = 42.5, .lon_deg = 1.5, .height_m = 0.0});
  return frame;
}

/// The keys that a format's options have in a config.
struct FormatKeys {
  geo::FixFormat& format;
  void describe(core::SchemaVisitor& visit) { format.describe(visit); }
  void validate() const { format.validate(); }
};

/// Reads a recording, once with its heights and once without, and places and cleans its fixes.
/// keys   TOML
void read_fixes(std::string_view name, const fs::path& path, Bytes keys = {}) {
  for (const geo::FixFormatInfo& info : geo::fix_formats()) {
    if (info.name != name) continue;
    const std::unique_ptr<geo::FixFormat> format = info.make();
    FormatKeys described{*format};
    core::TomlDocument::parse(text_of(keys), "keys.toml").read(described);
    for (const std::string above : {"ellipsoid", "none"}) {
      try {
        const geo::FixTable table = format->read(path, above);
        geo::PlacingOptions options;
        options.above = above;
        options.origin.east_m = options.origin.north_m = 0.0;
        const geo::TrajectoryContext context{
            .frame = frame(),
            .ground_height_m = [](double, double) { return 1000.0; },
            .geoid = {}};
        geo::CleaningCounts counts;
        const geo::PlacedFixes placed =
            geo::place_fixes(table, options, above, geo::CleaningOptions().max_gap_s, context);
        std::vector<geo::FixPart> parts = geo::clean_fixes(placed.fixes, {}, counts);
        geo::take_attitudes(placed.attitudes, parts);
      } catch (const core::Error& error) {
        if (above == "none" || error.kind() == core::ErrorKind::Internal) throw;
      }
    }
  }
}

void read_with_keys(std::string_view name, std::string_view file, Bytes input) {
  const std::vector<Part> parts = parts_of(input);
  const bool has_keys = parts.size() > 1 && parts[1].name == "keys";
  read_fixes(name, put(file, parts[0].bytes), has_keys ? parts[1].bytes : Bytes());
}

}  // namespace

void fuzz_fixes_adsb(Bytes input) { read_fixes("adsb", put("flight.csv", input)); }
void fuzz_fixes_gpx(Bytes input) { read_fixes("gpx", put("flight.gpx", input)); }
void fuzz_fixes_sbet(Bytes input) { read_fixes("sbet", put("flight.out", input)); }
void fuzz_fixes_tum(Bytes input) { read_fixes("tum", put("flight.txt", input)); }

/// A part of the name "keys" is the format's options.
void fuzz_fixes_csv(Bytes input) { read_with_keys("csv", "flight.csv", input); }
void fuzz_fixes_euroc(Bytes input) { read_with_keys("euroc", "data.csv", input); }
void fuzz_fixes_jsbsim(Bytes input) { read_with_keys("jsbsim", "flight.csv", input); }
void fuzz_fixes_srt(Bytes input) { read_with_keys("srt", "flight.srt", input); }

/// By each of its sources of places; what the log holds may be none but the first that it finds.
void fuzz_fixes_ulog(Bytes input) {
  const fs::path file = put("flight.ulg", input);
  for (const std::string_view places : {"local", "gps", "local_origin"}) {
    const std::string keys = fmt::format("places = \"{}\"\n", places);
    try {
      read_fixes("ulog", file, bytes_of(keys));
    } catch (const core::Error& error) {
      if (error.kind() == core::ErrorKind::Internal) throw;
    }
  }
  read_fixes("ulog", file);
}

/// The first part is the times, the others are packets.
void fuzz_fixes_oxts(Bytes input) {
  const fs::path folder = fresh_folder();
  fs::create_directory(folder / "data");
  int number = 0;
  for (const Part& part : parts_of(input)) {
    if (part.name.empty())
      write_bytes(folder / "timestamps.txt", part.bytes);
    else if (number < 100)
      write_bytes(folder / "data" / fmt::format("{:010}.txt", number++), part.bytes);
  }
  read_fixes("oxts", folder);
}

void fuzz_tabulated(Bytes input) {
  const fs::path file = put("rays.txt", input);
  for (const geo::CameraModelInfo& model : geo::camera_models()) {
    if (model.name != "tabulated") continue;
    const std::unique_ptr<geo::CameraModel> camera = geo::make_camera(
        {.model = "tabulated", .width_px = 64, .height_px = 48, .parameters = model.read(file)});
    for (const Eigen::Vector2d& pixel : {Eigen::Vector2d(0.5, 0.5), Eigen::Vector2d(40.0, 30.0)}) {
      const Eigen::Vector3d ray = camera->ray_from_pixel(pixel);
      if (ray.allFinite()) camera->pixel_from_ray(ray);
    }
  }
}

/// A grid in GeographicLib's form, whose hash is right.
void fuzz_geoid(Bytes input) {
  const fs::path file = put("egm2008-5.pgm", input);
  write_bytes(file.parent_path() / "egm2008-5.xxh3", bytes_of(core::content_hash(input)));
  const std::shared_ptr<const geo::Geoid> geoid = geo::Geoid::egm2008(file);
  geoid->undulation_m(42.5, 1.5);
  geoid->undulation_m(-90.0, 359.9);
}

}  // namespace terracast::fuzz
