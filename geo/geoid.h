#pragma once

#include <filesystem>
#include <memory>
#include <string>

namespace terracast::geo {

/// What a height is above. Every source of heights states one.
enum class VerticalDatum { Ellipsoid, Egm96 };

/// throws Config: unknown word; the known ones are named
VerticalDatum vertical_datum_from_name(const std::string& name);
std::string name_of(VerticalDatum datum);

/// Undulation of EGM96: ellipsoidal height = orthometric height + undulation_m(place).
///
/// The 15-minute grid comes from proj-data's egm96_15.gtx; it is written once, in GeographicLib's
/// own format, into the user's cache folder, and read by GeographicLib's Geoid (cubic).
/// accuracy   1 cm of NGA's published test points; cubic interpolation of a grid rounded to 3 mm
/// threads    safe
class Geoid {
 public:
  /// throws Io: no egm96_15.gtx where PROJ keeps its data (says which package brings it), or no
  ///        cache folder that can be written
  static std::shared_ptr<const Geoid> egm96();
  /// The same from a given grid file and cache folder.
  static std::shared_ptr<const Geoid> egm96(const std::filesystem::path& gtx_file,
                                            const std::filesystem::path& cache_folder);
  ~Geoid();
  Geoid(const Geoid&) = delete;
  Geoid& operator=(const Geoid&) = delete;

  double undulation_m(double lat_deg, double lon_deg) const;

 private:
  struct Impl;
  explicit Geoid(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace terracast::geo
