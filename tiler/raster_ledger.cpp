#include "tiler/raster_ledger.h"

#include <cpl_string.h>
#include <fmt/format.h>

#include <array>
#include <string>

namespace terracast::tiler {
namespace {

constexpr const char* kPacking = "how the samples are packed in the file; GDAL unpacks them";
constexpr const char* kNote = "a note for readers";
constexpr const char* kSummary = "a summary of samples, which are read themselves";
constexpr const char* kGivenByGdal = "made by GDAL of the raster itself";
constexpr const char* kOfSensor = "a model of the sensor; the georeference says where samples lie";

/// Items of metadata of rasters and bands; first by whole names, as the first that fits decides.
constexpr std::array kItems = {
    core::KnownName{"AREA_OR_POINT", "whether the georeference is of pixels or of their centres"},
    core::KnownName{"DTED_VerticalDatum", "the vertical datum, which has to be the stated one"},
    core::KnownName{"DTED_*", kNote, false},
    core::KnownName{"TIFFTAG_*", kNote, false},
    core::KnownName{"STATISTICS_*", kSummary, false},
    core::KnownName{"COVARIANCES", kSummary, false},
    core::KnownName{"LAYER_TYPE", "the config says what the samples are", false},
    core::KnownName{"RepresentationType", "the config says what the samples are", false},
    core::KnownName{"DataType", "the config says what the samples are", false},
    core::KnownName{"IMAGE_STRUCTURE:*", kPacking, false},
    core::KnownName{"DERIVED_SUBDATASETS:*", kGivenByGdal, false},
    core::KnownName{"COLOR_PROFILE:*", "colours are taken for sRGB", false},
    core::KnownName{"xml:XMP:*", kNote, false},
    core::KnownName{"xml:VRT:*", "GDAL reads the rasters that it names", false},
    core::KnownName{"xml:ESRI:*", kSummary, false},
    core::KnownName{"EXIF:*", kNote, false},
    core::KnownName{"EXIF_*", kNote, false},
    core::KnownName{"RPC:*", kOfSensor, false},
    core::KnownName{"GEOLOCATION:*", kOfSensor, false},
    core::KnownName{"TILING_SCHEME:*", kPacking, false},
    core::KnownName{"ZOOM_LEVEL", kPacking, false},
    core::KnownName{"IDENTIFIER", kNote, false},
};

/// Statements that GDAL gives by functions.
constexpr std::array kStatements = {
    core::KnownName{"horizontal system", "where its samples lie on the Earth"},
    core::KnownName{"vertical system",
                    "the vertical datum and unit, which have to be the stated ones"},
    core::KnownName{"band unit", "the unit of heights"},
    core::KnownName{"band scale", "samples are multiplied by it"},
    core::KnownName{"band offset", "is added to scaled samples"},
    core::KnownName{"band no-data value", "samples of it have no value"},
    core::KnownName{"band mask", "samples that it masks have no value"},
    core::KnownName{"band alpha", "samples where it is 0 have no value"},
    core::KnownName{"band colour table", "the colours of samples"},
    core::KnownName{"band colours", "which bands are red, green and blue"},
    core::KnownName{"band description", kNote, false},
    core::KnownName{"band category names", "legends say what codes mean", false},
    core::KnownName{"band attribute table", "legends say what codes mean", false},
    core::KnownName{"overviews", "all samples are read at their full resolution", false},
    core::KnownName{"ground control points", "the georeference says where samples lie", false},
    core::KnownName{"further band", "another band is read", false},
};

void count_items(GDALMajorObject& object, core::Ledger& ledger) {
  const CPLStringList domains(object.GetMetadataDomainList(), TRUE);
  std::vector<std::string> names = {""};
  for (int i = 0; i < domains.Count(); ++i)
    if (*domains[i] != '\0') names.emplace_back(domains[i]);
  for (const std::string& domain : names) {
    const bool is_xml = domain.starts_with("xml:");
    char** items = object.GetMetadata(domain.c_str());
    for (int i = 0; items != nullptr && items[i] != nullptr; ++i) {
      const std::string_view text = items[i];
      const std::string item(is_xml ? "document" : text.substr(0, text.find('=')));
      ledger.count(domain.empty() ? item : fmt::format("{}:{}", domain, item), kItems);
    }
  }
}

class Statements {
 public:
  Statements(GDALDataset& dataset, const RasterUse& use, core::Ledger& ledger)
      : dataset_(dataset), use_(use), ledger_(ledger) {}

  void count() const {
    const OGRSpatialReference* crs = dataset_.GetSpatialRef();
    if (crs != nullptr) ledger_.use("horizontal system");
    if (crs != nullptr && (crs->IsCompound() != FALSE || crs->GetAxesCount() == 3))
      state("vertical system", use_.uses_unit);
    if (dataset_.GetGCPCount() > 0) known("ground control points");
    for (int band = 1; band <= dataset_.GetRasterCount(); ++band)
      count(*dataset_.GetRasterBand(band), band);
  }

 private:
  void known(std::string_view name) const { ledger_.count(name, kStatements); }
  void state(std::string_view name, bool is_used) const {
    if (is_used)
      known(name);
    else
      ledger_.ignore(name, fmt::format("the config says what counts, or {} have none", use_.what));
  }

  void count(GDALRasterBand& band, int number) const {
    count_items(band, ledger_);
    const bool is_alpha = band.GetColorInterpretation() == GCI_AlphaBand;
    if (is_alpha) return state("band alpha", use_.uses_mask);
    if (use_.uses_colours && band.GetColorInterpretation() != GCI_Undefined) known("band colours");
    if (number != use_.band && !use_.uses_colours) return known("further band");
    if (band.GetUnitType() != nullptr && *band.GetUnitType() != '\0')
      state("band unit", use_.uses_unit);
    int has_value = FALSE;
    const double scale = band.GetScale(&has_value);
    if (has_value != FALSE && scale != 1.0) state("band scale", use_.uses_scale);
    const double offset = band.GetOffset(&has_value);
    if (has_value != FALSE && offset != 0.0) state("band offset", use_.uses_scale);
    band.GetNoDataValue(&has_value);
    if (has_value != FALSE) state("band no-data value", use_.uses_nodata);
    if ((band.GetMaskFlags() & (GMF_ALL_VALID | GMF_NODATA | GMF_ALPHA)) == 0)
      state("band mask", use_.uses_mask);
    if (band.GetColorTable() != nullptr) state("band colour table", use_.uses_colours);
    if (band.GetDescription() != nullptr && *band.GetDescription() != '\0')
      known("band description");
    if (band.GetCategoryNames() != nullptr) known("band category names");
    if (band.GetDefaultRAT() != nullptr) known("band attribute table");
    if (band.GetOverviewCount() > 0) known("overviews");
  }

  GDALDataset& dataset_;
  const RasterUse& use_;
  core::Ledger& ledger_;
};

}  // namespace

core::Ledger ledger_of(GDALDataset& dataset, const RasterUse& use) {
  core::Ledger ledger;
  count_items(dataset, ledger);
  Statements(dataset, use, ledger).count();
  return ledger;
}

std::vector<core::KnownTable> raster_tables() {
  return {{"rasters", "statements", kStatements}, {"rasters", "items of metadata", kItems}};
}

}  // namespace terracast::tiler
