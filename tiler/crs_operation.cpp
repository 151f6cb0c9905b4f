#include "tiler/crs_operation.h"

#include <proj.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "core/error.h"

namespace terracast::tiler {
namespace {

CrsOperation find_operation(const std::string& crs_wkt, const geo::Geodetic& near, bool ballpark) {
  struct ContextCloser {
    void operator()(PJ_CONTEXT* c) const { proj_context_destroy(c); }
  };
  struct PjCloser {
    void operator()(PJ* p) const { proj_destroy(p); }
  };
  using PjPtr = std::unique_ptr<PJ, PjCloser>;
  const std::unique_ptr<PJ_CONTEXT, ContextCloser> context(proj_context_create());
  proj_log_level(context.get(), PJ_LOG_NONE);
  proj_context_set_enable_network(context.get(), 0);
  const PjPtr source(proj_create(context.get(), "EPSG:4326"));
  const PjPtr target(proj_create(context.get(), crs_wkt.c_str()));
  if (!source || !target) return {};
  PJ_OPERATION_FACTORY_CONTEXT* factory =
      proj_create_operation_factory_context(context.get(), nullptr);
  const double lon_deg = std::remainder(near.lon_deg, 360.0);
  proj_operation_factory_context_set_area_of_interest(
      context.get(), factory, std::max(lon_deg - 0.1, -180.0), std::max(near.lat_deg - 0.1, -90.0),
      std::min(lon_deg + 0.1, 180.0), std::min(near.lat_deg + 0.1, 90.0));
  proj_operation_factory_context_set_spatial_criterion(context.get(), factory,
                                                       PROJ_SPATIAL_CRITERION_PARTIAL_INTERSECTION);
  proj_operation_factory_context_set_grid_availability_use(
      context.get(), factory, PROJ_GRID_AVAILABILITY_DISCARD_OPERATION_IF_MISSING_GRID);
  proj_operation_factory_context_set_allow_ballpark_transformations(context.get(), factory,
                                                                    ballpark ? 1 : 0);
  PJ_OBJ_LIST* list = proj_create_operations(context.get(), source.get(), target.get(), factory);
  CrsOperation operation;
  if (list != nullptr && proj_list_get_count(list) > 0) {
    const PjPtr first(proj_list_get(context.get(), list, 0));
    const PjPtr op(proj_normalize_for_visualization(context.get(), first.get()));
    const char* text =
        op ? proj_as_proj_string(context.get(), op.get(), PJ_PROJ_5, nullptr) : nullptr;
    if (text != nullptr) operation.pipeline = text;
    operation.is_ballpark =
        proj_coordoperation_has_ballpark_transformation(context.get(), first.get()) != 0;
  }
  if (list != nullptr) proj_list_destroy(list);
  proj_operation_factory_context_destroy(factory);
  return operation;
}

/// GeoPackage's rows for what has no system: "Undefined geographic SRS", "Undefined Cartesian SRS".
bool is_undefined(const OGRSpatialReference& crs) {
  const char* name = crs.GetName();
  return name != nullptr && std::string_view(name).starts_with("Undefined ");
}

}  // namespace

HorizontalCrs horizontal_crs(const OGRSpatialReference* declared, const std::string& written,
                             const CrsTools& tools, const GdalErrors& errors) {
  const bool is_empty = declared == nullptr || declared->IsEmpty();
  if (is_empty ? !errors.has_failure() : is_undefined(*declared))
    core::fail(core::ErrorKind::Input,
               "{}: states no coordinate reference system; add it with {} EPSG:…", written,
               tools.setter);
  if (is_empty)
    core::fail(core::ErrorKind::Input,
               "{}: its coordinate reference system is not known ({}); state the right one with {} "
               "EPSG:…",
               written, errors.text(), tools.setter);
  HorizontalCrs horizontal;
  OGRSpatialReference crs(*declared);
  if (crs.IsCompound() != FALSE) {
    const char* name = nullptr;
    crs.GetTargetLinearUnits("VERT_CS", &name);
    if (name != nullptr) horizontal.vertical_unit = name;
    const char* vertical = crs.GetAttrValue("COMPD_CS|VERT_CS");
    const char* authority = crs.GetAuthorityName("COMPD_CS|VERT_CS");
    const char* code = crs.GetAuthorityCode("COMPD_CS|VERT_CS");
    horizontal.vertical_name = vertical == nullptr ? "unnamed" : vertical;
    if (authority != nullptr && code != nullptr)
      horizontal.vertical_name = fmt::format("{}:{} {}", authority, code, horizontal.vertical_name);
    // PROJ would apply a geoid of the vertical part, and ours would be the second.
    crs.StripVertical();
  }
  horizontal.is_3d = crs.IsCompound() == FALSE && crs.GetAxesCount() == 3;
  crs.DemoteTo2D(nullptr);
  crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  if (crs.IsGeographic() == FALSE && crs.IsProjected() == FALSE)
    core::fail(core::ErrorKind::Input,
               "{}: its coordinate reference system ({}) is neither geographic nor projected; turn "
               "it into one that is, with {} -t_srs",
               written, declared->GetName() == nullptr ? "unnamed" : declared->GetName(),
               tools.changer);
  horizontal.is_geographic = crs.IsGeographic() != FALSE;
  const char* authority = crs.GetAuthorityName(nullptr);
  const char* code = crs.GetAuthorityCode(nullptr);
  const char* name = crs.GetName();
  horizontal.name = name == nullptr ? "unnamed" : name;
  if (authority != nullptr && code != nullptr)
    horizontal.name = fmt::format("{}:{} {}", authority, code, horizontal.name);
  char* wkt = nullptr;
  const char* const wkt2[] = {"FORMAT=WKT2_2019", nullptr};
  crs.exportToWkt(&wkt, wkt2);
  horizontal.wkt = wkt == nullptr ? "" : wkt;
  CPLFree(wkt);
  return horizontal;
}

CrsOperation best_operation(const std::string& crs_wkt, const geo::Geodetic& near) {
  const CrsOperation operation = find_operation(crs_wkt, near, false);
  return operation.pipeline.empty() ? find_operation(crs_wkt, near, true) : operation;
}

void SharedTransformation::Closer::operator()(OGRCoordinateTransformation* t) const {
  OGRCoordinateTransformation::DestroyCT(t);
}

SharedTransformation::SharedTransformation(const std::string& pipeline, bool is_reverse) {
  OGRCoordinateTransformationOptions options;
  options.SetCoordinateOperation(pipeline.c_str(), is_reverse);
  first_.reset(OGRCreateCoordinateTransformation(nullptr, nullptr, options));
}

bool SharedTransformation::transform(std::vector<double>& x, std::vector<double>& y) const {
  Ptr mine;
  {
    const std::lock_guard lock(mutex_);
    if (idle_.empty()) {
      mine.reset(first_->Clone());
    } else {
      mine = std::move(idle_.back());
      idle_.pop_back();
    }
  }
  if (!mine) return false;
  std::vector<int> is_done(x.size(), 0);
  const bool is_good = mine->Transform(static_cast<int>(x.size()), x.data(), y.data(), nullptr,
                                       is_done.data()) != FALSE;
  const std::lock_guard lock(mutex_);
  idle_.push_back(std::move(mine));
  for (std::size_t i = 0; i < x.size(); ++i)
    if (is_done[i] == 0 || !std::isfinite(x[i]) || !std::isfinite(y[i])) return false;
  return is_good;
}

}  // namespace terracast::tiler
