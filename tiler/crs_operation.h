#pragma once

#include <ogr_spatialref.h>

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "geo/geodesy.h"
#include "tiler/gdal_support.h"

namespace terracast::tiler {

/// The horizontal part of the CRS that a file declares.
struct HorizontalCrs {
  std::string name;           ///< "EPSG:32631 WGS 84 / UTM zone 31N"
  std::string wkt;            ///< WKT2:2019, in traditional axis order: longitude or easting first
  std::string vertical_unit;  ///< as the vertical part names it; empty where there is none
  std::string
      vertical_name;  ///< of the vertical part, with its code: "EPSG:5773 EGM96 height"; empty: none
  bool is_3d = false;  ///< its own third axis: heights above the ellipsoid
  bool is_geographic = false;
};

/// Tools of GDAL that help a file without a CRS that we can use, for messages.
struct CrsTools {
  const char* setter;   ///< "gdal_edit.py -a_srs"
  const char* changer;  ///< "gdalwarp"
};

/// declared   nullptr: none
/// written    the file, for messages
/// errors     since the file was opened: what GDAL says of a system that it does not know
/// throws     Input: none is declared, one that GDAL does not know, or one that is neither
///            geographic nor projected
HorizontalCrs horizontal_crs(const OGRSpatialReference* declared, const std::string& written,
                             const CrsTools& tools, const GdalErrors& errors);

/// How PROJ leads from WGS84 longitude and latitude to a CRS.
struct CrsOperation {
  std::string pipeline;  ///< "+proj=noop": nothing to do; empty: there is none
  bool is_ballpark = false;
};

/// The operation that PROJ ranks first near a place, of those whose grids are there; a ballpark one
/// when there is no other.
CrsOperation best_operation(const std::string& crs_wkt, const geo::Geodetic& near);

/// A transformation for any number of threads: OGR's are for one at a time, so each call borrows a
/// clone.
class SharedTransformation {
 public:
  SharedTransformation(const std::string& pipeline, bool is_reverse);
  bool is_good() const { return first_ != nullptr; }

  /// In place. False when a place cannot be transformed.
  bool transform(std::vector<double>& x, std::vector<double>& y) const;

 private:
  struct Closer {
    void operator()(OGRCoordinateTransformation* t) const;
  };
  using Ptr = std::unique_ptr<OGRCoordinateTransformation, Closer>;
  Ptr first_;
  mutable std::mutex mutex_;
  mutable std::vector<Ptr> idle_;
};

}  // namespace terracast::tiler
