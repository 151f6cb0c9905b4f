#pragma once

#include <cpl_conv.h>
#include <fmt/format.h>
#include <ogr_spatialref.h>

#include <string>

namespace terracast::test {

/// A reference system with the order of its axes and its epoch, to be compared.
inline std::string crs_text(const OGRSpatialReference* crs) {
  if (crs == nullptr) return "none";
  char* text = nullptr;
  const char* const newest[] = {"FORMAT=WKT2_2019", nullptr};
  crs->exportToWkt(&text, newest);
  std::string all = text == nullptr ? "empty" : text;
  CPLFree(text);
  for (const int axis : crs->GetDataAxisToSRSAxisMapping()) all += fmt::format(" {}", axis);
  return all + fmt::format(" {}", crs->GetCoordinateEpoch());
}

}  // namespace terracast::test
