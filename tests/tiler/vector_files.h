#pragma once

#include <ogrsf_frmts.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/test_data.h"
#include "tests/tiler/raster_files.h"

namespace terracast::test {

/// A feature to be written by OGR.
struct VectorSpec {
  std::string wkt;
  std::vector<std::pair<std::string, std::string>> fields;
  std::optional<double> first_x = {};  ///< of a line or ring, in place of the WKT's: NaN, infinity
};

/// Writes features, in a CRS in traditional axis order ("": none is stated).
inline void write_vectors(const std::filesystem::path& file, const std::string& driver,
                          const std::vector<VectorSpec>& features,
                          const std::string& crs = "EPSG:4326",
                          const std::string& layer_name = "things") {
  register_all_drivers();
  GDALDriver* found = GetGDALDriverManager()->GetDriverByName(driver.c_str());
  ASSERT_NE(found, nullptr);
  GDALDataset* dataset = found->Create(file.c_str(), 0, 0, 0, GDT_Unknown, nullptr);
  ASSERT_NE(dataset, nullptr);
  OGRSpatialReference reference;
  if (!crs.empty()) {
    ASSERT_EQ(reference.SetFromUserInput(crs.c_str()), OGRERR_NONE);
    reference.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  }
  OGRLayer* layer = dataset->CreateLayer(layer_name.c_str(), crs.empty() ? nullptr : &reference,
                                         wkbUnknown, nullptr);
  ASSERT_NE(layer, nullptr);
  for (const VectorSpec& spec : features) {
    for (const auto& [key, value] : spec.fields)
      if (layer->GetLayerDefn()->GetFieldIndex(key.c_str()) < 0) {
        OGRFieldDefn field(key.c_str(), OFTString);
        ASSERT_EQ(layer->CreateField(&field), OGRERR_NONE);
      }
    OGRFeature feature(layer->GetLayerDefn());
    for (const auto& [key, value] : spec.fields) feature.SetField(key.c_str(), value.c_str());
    OGRGeometry* geometry = nullptr;
    const char* text = spec.wkt.c_str();
    ASSERT_EQ(OGRGeometryFactory::createFromWkt(text, nullptr, &geometry), OGRERR_NONE) << text;
    if (spec.first_x) {
      const bool is_area = wkbFlatten(geometry->getGeometryType()) == wkbPolygon;
      OGRSimpleCurve* line = is_area ? geometry->toPolygon()->getExteriorRing()
                                     : static_cast<OGRSimpleCurve*>(geometry->toLineString());
      line->setPoint(0, *spec.first_x, 42.5);
      if (is_area) line->setPoint(line->getNumPoints() - 1, *spec.first_x, 42.5);
    }
    ASSERT_EQ(feature.SetGeometryDirectly(geometry), OGRERR_NONE);
    ASSERT_EQ(layer->CreateFeature(&feature), OGRERR_NONE);
  }
  GDALClose(dataset);
}

inline core::Path path_of(const std::filesystem::path& file) {
  return {.written = file.string(), .resolved = file};
}

}  // namespace terracast::test
