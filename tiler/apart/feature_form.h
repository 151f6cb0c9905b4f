#pragma once

#include <ogr_core.h>

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/unnamed_file.h"
#include "tiler/apart/crs_form.h"

class OGRFeature;
class OGRFeatureDefn;

namespace terracast::tiler {

template <>
inline constexpr std::int32_t kLargestOf<OGRFieldType> = OFTMaxType;
template <>
inline constexpr std::int32_t kLargestOf<OGRFieldSubType> = OFSTMaxSubType;

struct FieldForm {
  std::string name;
  OGRFieldType type = OFTString;
  OGRFieldSubType subtype = OFSTNone;
  std::int32_t width = 0;  ///< of numbers as text; 0: not said
  std::int32_t precision = 0;
  template <class Visitor>
  void describe(Visitor& visit) {
    visit(name), visit(type), visit(subtype), visit(width), visit(precision);
  }
};

struct LayerForm {
  std::string name;
  std::uint32_t geometry = wkbUnknown;  ///< OGRwkbGeometryType, whose values are bits
  std::optional<CrsForm> crs;
  std::vector<FieldForm> fields;
  std::int64_t num_stated = 0;  ///< features by the driver's count
  std::int64_t num_given = 0;   ///< features in the file beside; of a layer without geometry none
  std::uint64_t first_byte = 0;
  std::uint64_t end_byte = 0;
  SaidForm said;  ///< while its features were read
  template <class Visitor>
  void describe(Visitor& visit) {
    visit(name), visit(geometry), visit(crs), visit(fields), visit(num_stated), visit(num_given);
    visit(first_byte), visit(end_byte), visit(said);
  }
};

/// All that this program looks at of a file of features, as a process of its own has read it. The features are in a file
/// beside the form, layer after layer, each behind its length.
struct FeatureForm {
  std::string format;  ///< GDAL's name of it
  std::string description;
  FileNames files;  ///< whose bytes it follows from
  std::vector<LayerForm> layers;
  SaidForm said;  ///< at opening
  template <class Visitor>
  void describe(Visitor& visit) {
    visit(format), visit(description), visit(files), visit(layers), visit(said);
  }
};

/// Bytes that features may take.
inline constexpr std::uint64_t kMostFeaturesBytes = std::uint64_t{64} << 30;
inline constexpr std::uint64_t kMostFeatureBytes = std::uint64_t{1} << 30;

/// What FeatureForm says holds together: layers, their bytes in the file, types of fields.
/// throws   Input: it does not
void check_feature_form(const FeatureForm& form, std::uint64_t file_bytes, const std::string& file);

/// A feature's number, its fields and its first geometry.
std::vector<std::byte> encode_feature(const OGRFeature& feature);

/// throws   Input: damaged; names the file
std::unique_ptr<OGRFeature> decode_feature(std::span<const std::byte> bytes, OGRFeatureDefn* fields,
                                           const std::string& file);

/// Features that were read apart.
struct KeptFeatures {
  FeatureForm form;
  core::UnnamedFile features;
};

}  // namespace terracast::tiler
