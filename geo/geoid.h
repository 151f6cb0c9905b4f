#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace terracast::geo {

/// What is to be added to heights to make them ellipsoidal, on a regular grid of places.
struct OffsetGrid {
  std::string name;  ///< for messages
  double south_deg = 0.0;
  double west_deg = 0.0;
  double lat_step_deg = 0.0;  ///< positive
  double lon_step_deg = 0.0;  ///< positive
  int num_rows = 0;
  int num_columns = 0;
  /// Row by row from south to north, each from west to east; NaN where the grid knows none.
  std::vector<double> offsets_m;
};

/// Undulation of a geoid: ellipsoidal height = orthometric height + undulation_m(place).
///
/// EGM96's 15-minute grid comes from proj-data's egm96_15.gtx; it is written once, in
/// GeographicLib's own format, into the user's cache folder. EGM2008's grid is brought there by
/// import_egm2008(), or by GeographicLib's own downloads. Both are read by GeographicLib's Geoid
/// (cubic).
/// accuracy   EGM96 1 cm, EGM2008 at 2.5 minutes 3 cm of NGA's published test points; cubic
///            interpolation of grids rounded to 3 mm
/// threads    safe
class Geoid {
 public:
  /// throws Io: no egm96_15.gtx where PROJ keeps its data (says which package brings it), or no
  ///        cache folder that can be written
  static std::shared_ptr<const Geoid> egm96();
  /// The same from a given grid file and cache folder.
  static std::shared_ptr<const Geoid> egm96(const std::filesystem::path& gtx_file,
                                            const std::filesystem::path& cache_folder);

  /// The finest grid of EGM2008 that is found: in the user's cache folder, or where GeographicLib
  /// keeps its geoids.
  /// throws Io: there is none (says how to import one); Input: it is damaged
  static std::shared_ptr<const Geoid> egm2008();
  /// The same of a given file, egm2008-….pgm.
  static std::shared_ptr<const Geoid> egm2008(const std::filesystem::path& pgm_file);

  /// Bilinear in the grid's cells, as PROJ reads such grids; beyond it, its border carried on.
  /// throws Input: less than 2 x 2 nodes, steps that are none, offsets beyond 1000 m
  static std::shared_ptr<const Geoid> from_grid(OffsetGrid grid);

  ~Geoid();
  Geoid(const Geoid&) = delete;
  Geoid& operator=(const Geoid&) = delete;

  double undulation_m(double lat_deg, double lon_deg) const;

  /// Whether the undulation there is known, and not carried on from a grid's border.
  bool covers(double lat_deg, double lon_deg) const;

 private:
  struct Impl;
  struct GlobalGrid;
  struct LocalGrid;
  explicit Geoid(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Where import_egm2008() puts the grid when no folder is given: the user's cache folder.
std::filesystem::path geoid_folder();

/// Turns the EGM2008 grid of the program GEOTRANS (2.5 minutes; its Debian package is geotranz) into
/// GeographicLib's own format.
/// file      GEOTRANS's Und_min2.5x2.5_egm2008_WGS84_TideFree_reformatted
/// folder    where egm2008-2_5.pgm is written, and beside it its hash, which Geoid::egm2008 checks
/// returns   the written file
/// accuracy  undulations are rounded to 3 mm
/// throws    Io; Input: not that grid, truncated, or values that are no undulations of EGM2008
std::filesystem::path import_egm2008(const std::filesystem::path& file,
                                     const std::filesystem::path& folder);

/// What a height is above; every source of heights states it.
struct VerticalDatum {
  std::string name = "ellipsoid";      ///< ellipsoid, egm96, egm2008, or the file of a grid
  std::shared_ptr<const Geoid> geoid;  ///< null: the ellipsoid

  bool is_ellipsoid() const { return geoid == nullptr; }
  /// Data are the same when their names are.
  bool operator==(const VerticalDatum& other) const { return name == other.name; }
};

/// ellipsoid, egm96 or egm2008.
/// throws   Config: unknown name; the known ones are named. Io: as Geoid::egm96(), egm2008()
VerticalDatum vertical_datum_from_name(const std::string& name);

/// throws   Config: unknown name; the known ones are named
void check_vertical_datum_name(const std::string& name);

}  // namespace terracast::geo
