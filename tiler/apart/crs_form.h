#pragma once

#include <ogr_spatialref.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tiler/apart/form_io.h"
#include "tiler/gdal_support.h"

namespace terracast::tiler {

template <>
inline constexpr std::int32_t kLargestOf<OSRAxisMappingStrategy> = OAMS_CUSTOM;

/// A coordinate reference system as a form (form_io.h).
struct CrsForm {
  /// WKT, PROJJSON or a code, whichever says again what was read: each gives some datums, axes or units other names.
  /// "": the system is there, and empty.
  std::string text;
  OSRAxisMappingStrategy strategy = OAMS_AUTHORITY_COMPLIANT;
  std::vector<std::int32_t> axes;  ///< of the system for each of the data, from 1
  double epoch = 0.0;              ///< of its coordinates, in years; 0: none
  template <class Visitor>
  void describe(Visitor& visit) {
    visit(text), visit(strategy), visit(axes), visit(epoch);
  }

  static std::optional<CrsForm> of(const OGRSpatialReference* crs);
  /// What cannot be read is told to GDAL's handler of errors, and is an empty system.
  OGRSpatialReference make() const;
};

/// What GDAL said on the way, to be said again.
struct SaidForm {
  std::string text;
  bool is_failure = false;
  template <class Visitor>
  void describe(Visitor& visit) {
    visit(text), visit(is_failure);
  }

  static SaidForm of(const GdalErrors& errors);
  void say() const;
};

/// Files that a dataset is read from, by their bytes; a name is no text.
using FileNames = std::vector<std::string>;

/// A driver of a format by name, of which nothing but the name is asked. Threads: safe.
GDALDriver* driver_named(const std::string& format);

}  // namespace terracast::tiler
