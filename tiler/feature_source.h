#pragma once

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/ledger.h"
#include "core/schema.h"
#include "tiler/tag_rules.h"
#include "tiler/vector_source.h"

namespace terracast::tiler {

/// A source of features that only one kind of layer has.
struct OwnSource {
  std::string name;
  std::string summary;
};

/// Config keys of a layer that is made from features: where they come from.
struct FeatureSourceOptions {
  std::string source = "files";  ///< files, country, or one of the layer's own
  std::vector<core::Path> files;
  std::vector<std::string> layers;  ///< of the files; empty: all
  std::string number_field;

  void describe(core::SchemaVisitor& visit, std::span<const OwnSource> own = {});
  /// throws   Config: files without a source of files, or none where there must be
  void validate() const;
};

/// The features of a layer, of all its files.
struct FeatureSet {
  std::vector<VectorFeature> features;  ///< by number; one number stands once (of the first file)
  std::string name;                     ///< for LayerInfo::source
  std::string content_hash;
  std::vector<std::pair<std::string, std::int64_t>> counts;  ///< for LayerInfo::counts
  core::Ledger ledger;  ///< of the features' tags, for LayerInfo::ledger
};

/// Reads the features that are wanted, of files or a country. Warnings are logged.
/// wanted   kinds, tags and margin; its layers and number_field are the options'
/// tags     what the layer knows of tags
/// throws   as read_vectors()
FeatureSet read_features(const FeatureSourceOptions& options, VectorOptions wanted,
                         const LayerInputs& inputs, const TagTable& tags);

}  // namespace terracast::tiler
