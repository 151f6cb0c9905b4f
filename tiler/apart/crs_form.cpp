#include "tiler/apart/crs_form.h"

#include <cpl_conv.h>
#include <cpl_error.h>

#include <map>
#include <mutex>

namespace terracast::tiler {

namespace {

bool set_from_text(OGRSpatialReference& crs, const std::string& text) {
  const char* const alone[] = {"ALLOW_NETWORK_ACCESS=NO", "ALLOW_FILE_ACCESS=NO", nullptr};
  return crs.SetFromUserInput(text.c_str(), alone) == OGRERR_NONE;
}

std::string taken(char* text) {
  const std::string result = text == nullptr ? "" : text;
  CPLFree(text);
  return result;
}

std::string wkt_of(const OGRSpatialReference& crs, const char* format) {
  char* text = nullptr;
  const char* const options[] = {format, nullptr};
  crs.exportToWkt(&text, options);
  return taken(text);
}

constexpr const char* kNewestWkt = "FORMAT=WKT2_2019";

std::string text_of(const OGRSpatialReference& crs) {
  const GdalErrors quiet;
  const std::string newest = wkt_of(crs, kNewestWkt);
  char* json = nullptr;
  crs.exportToPROJJSON(&json, nullptr);
  std::vector<std::string> texts = {newest, taken(json), wkt_of(crs, "FORMAT=WKT1_GDAL")};
  const char* const authority = crs.GetAuthorityName(nullptr);
  const char* const code = crs.GetAuthorityCode(nullptr);
  if (authority != nullptr && code != nullptr) texts.push_back(std::string(authority) + ":" + code);
  for (const std::string& text : texts) {
    OGRSpatialReference again;
    if (!text.empty() && set_from_text(again, text) && wkt_of(again, kNewestWkt) == newest)
      return text;
  }
  return newest.empty() ? texts[2] : newest;
}

}  // namespace

std::optional<CrsForm> CrsForm::of(const OGRSpatialReference* crs) {
  if (crs == nullptr) return std::nullopt;
  CrsForm form;
  if (crs->IsEmpty() == 0) form.text = text_of(*crs);
  form.strategy = crs->GetAxisMappingStrategy();
  for (const int axis : crs->GetDataAxisToSRSAxisMapping()) form.axes.push_back(axis);
  form.epoch = crs->GetCoordinateEpoch();
  return form;
}

OGRSpatialReference CrsForm::make() const {
  OGRSpatialReference crs;
  if (!text.empty() && !set_from_text(crs, text)) {
    CPLError(CE_Failure, CPLE_AppDefined, "its coordinate reference system cannot be read");
    return crs;
  }
  if (strategy == OAMS_CUSTOM)
    crs.SetDataAxisToSRSAxisMapping({axes.begin(), axes.end()});
  else
    crs.SetAxisMappingStrategy(strategy);
  if (epoch > 0.0) crs.SetCoordinateEpoch(epoch);
  return crs;
}

SaidForm SaidForm::of(const GdalErrors& errors) {
  return {.text = errors.said(), .is_failure = errors.has_failure()};
}

void SaidForm::say() const {
  if (!text.empty())
    CPLError(is_failure ? CE_Failure : CE_Warning, CPLE_AppDefined, "%s", text.c_str());
}

GDALDriver* driver_named(const std::string& format) {
  static std::mutex mutex;
  static std::map<std::string, std::unique_ptr<GDALDriver>> drivers;
  const std::lock_guard lock(mutex);
  std::unique_ptr<GDALDriver>& driver = drivers[format];
  if (!driver) {
    driver = std::make_unique<GDALDriver>();
    driver->SetDescription(format.c_str());
  }
  return driver.get();
}

}  // namespace terracast::tiler
