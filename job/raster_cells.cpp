#include "job/raster_cells.h"

#include <Eigen/LU>
#include <cmath>
#include <vector>

#include "core/error.h"
#include "tiler/crs_operation.h"
#include "tiler/gdal_support.h"

namespace terracast::job {

std::optional<Eigen::Vector2d> pixel_from_geodetic(const world::RasterInfo& raster, double lat_deg,
                                                   double lon_deg) {
  std::vector<double> x = {lon_deg};
  std::vector<double> y = {lat_deg};
  if (!raster.pipeline.empty()) {
    const tiler::GdalErrors errors;
    const tiler::SharedTransformation crs_from_geodetic(raster.pipeline, false);
    if (!crs_from_geodetic.is_good())
      core::fail(core::ErrorKind::Input, "{}: the transformation {} cannot be used ({})",
                 raster.name, raster.pipeline, errors.text());
    if (!crs_from_geodetic.transform(x, y)) return std::nullopt;
  }
  const std::array<double, 6>& gt = raster.geotransform;
  Eigen::Matrix2d crs_from_pixel;
  crs_from_pixel << gt[1], gt[2], gt[4], gt[5];
  const Eigen::Vector2d corner(gt[0], gt[3]);
  if (raster.is_geographic) {
    // Longitudes that go on without a jump through the raster's middle.
    const Eigen::Vector2d middle =
        corner + crs_from_pixel * Eigen::Vector2d(0.5 * raster.width_px, 0.5 * raster.height_px);
    x[0] -= 360.0 * std::round((x[0] - middle.x()) / 360.0);
  }
  const Eigen::Vector2d pixel = crs_from_pixel.inverse() * (Eigen::Vector2d(x[0], y[0]) - corner);
  return pixel.allFinite() ? std::optional(pixel) : std::nullopt;
}

std::optional<Eigen::Vector2i> cell_from_geodetic(const world::RasterInfo& raster, double lat_deg,
                                                  double lon_deg) {
  const auto pixel = pixel_from_geodetic(raster, lat_deg, lon_deg);
  if (!pixel || pixel->minCoeff() < 0.0 || !(pixel->x() < raster.width_px) ||
      !(pixel->y() < raster.height_px))
    return std::nullopt;
  return Eigen::Vector2i(static_cast<int>(std::floor(pixel->x())),
                         static_cast<int>(std::floor(pixel->y())));
}

}  // namespace terracast::job
