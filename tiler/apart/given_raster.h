#pragma once

#include "tiler/apart/kept_forms.h"
#include "tiler/apart/raster_form.h"

namespace terracast::tiler {

/// A raster as a process of its own reads it (core::read_apart()), of whatever format of gdal_formats.h. It is read once
/// for all that open it, and again when its files have changed; its samples are kept in a temporary file as long as this
/// process runs.
/// throws   as open_gdal_raster(), and as core::read_apart()
GdalDatasetPtr given_raster(const core::Path& file);

/// The dataset of a form, from which samples are read as from any other.
GdalDatasetPtr dataset_of(std::shared_ptr<const KeptRaster> raster);

/// As given_raster(), of one that is not kept, with limits of the caller's own.
std::shared_ptr<const KeptRaster> read_raster_apart(const core::Path& file,
                                                    core::ApartOptions options);

}  // namespace terracast::tiler
