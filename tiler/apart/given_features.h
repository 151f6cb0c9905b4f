#pragma once

#include "tiler/apart/feature_form.h"
#include "tiler/apart/kept_forms.h"

namespace terracast::tiler {

/// Features as a process of its own reads them (core::read_apart()), of whatever format of gdal_formats.h; read once for
/// all that open them, as given_raster(). Layers without geometry are given by their counts alone.
/// throws   as open_gdal_vectors(), and as core::read_apart()
GdalDatasetPtr given_features(const core::Path& file);

/// The dataset of a form, whose layers give features one after the other.
GdalDatasetPtr dataset_of(std::shared_ptr<const KeptFeatures> features);

/// As given_features(), of what is not kept, with limits of the caller's own.
std::shared_ptr<const KeptFeatures> read_features_apart(const core::Path& file,
                                                        core::ApartOptions options);

}  // namespace terracast::tiler
