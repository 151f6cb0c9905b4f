#include <cpl_vsi.h>
#include <ogrsf_frmts.h>

#include <memory>

#include "core/error.h"
#include "core/reading_apart.h"
#include "tiler/apart/apart_readers.h"
#include "tiler/apart/feature_form.h"
#include "tiler/apart/form_io.h"
#include "tiler/gdal_formats.h"
#include "tiler/gdal_support.h"

namespace terracast::tiler {
namespace {

/// Appends features in pieces of some size.
class FeatureFile {
 public:
  explicit FeatureFile(const core::Path& file) : file_(file) {}

  void append(const OGRFeature& feature) {
    const std::vector<std::byte> bytes = encode_feature(feature);
    const std::uint64_t size = bytes.size();
    if (size > kMostFeatureBytes)
      core::fail(
          core::ErrorKind::Input,
          "{}: feature {} takes {} bytes, and one of up to {} is read; simplify it, or leave "
          "it out",
          file_.written, feature.GetFID(), size, kMostFeatureBytes);
    const auto length = std::as_bytes(std::span(&size, 1));
    piece_.insert(piece_.end(), length.begin(), length.end());
    piece_.insert(piece_.end(), bytes.begin(), bytes.end());
    size_bytes_ += length.size() + size;
    constexpr std::size_t kPiece_bytes = 1 << 20;
    if (piece_.size() > kPiece_bytes) flush();
  }
  void flush() {
    core::append_to_file(piece_, file_.written);
    piece_.clear();
  }
  std::uint64_t size_bytes() const { return size_bytes_; }

 private:
  const core::Path& file_;
  std::vector<std::byte> piece_;
  std::uint64_t size_bytes_ = 0;
};

std::vector<FieldForm> field_forms(const OGRFeatureDefn& defn) {
  std::vector<FieldForm> fields;
  for (int i = 0; i < defn.GetFieldCount(); ++i) {
    const OGRFieldDefn& field = *defn.GetFieldDefn(i);
    fields.push_back({.name = field.GetNameRef(),
                      .type = field.GetType(),
                      .subtype = field.GetSubType(),
                      .width = field.GetWidth(),
                      .precision = field.GetPrecision()});
  }
  return fields;
}

LayerForm read_layer(OGRLayer& layer, FeatureFile& out) {
  const GdalErrors errors;
  LayerForm form;
  form.name = layer.GetName();
  form.geometry = static_cast<std::uint32_t>(layer.GetGeomType());
  form.crs = CrsForm::of(layer.GetSpatialRef());
  form.first_byte = out.size_bytes();
  if (form.geometry != wkbNone) {
    layer.ResetReading();
    while (const auto feature = std::unique_ptr<OGRFeature>(layer.GetNextFeature())) {
      out.append(*feature);
      ++form.num_given;
    }
  }
  // Where the count is none of the format's own, it would be got by reading once more.
  const bool is_read = form.geometry != wkbNone && layer.TestCapability(OLCFastFeatureCount) == 0;
  form.num_stated = is_read ? form.num_given : layer.GetFeatureCount();
  // Some find out about fields while they read.
  form.fields = field_forms(*layer.GetLayerDefn());
  form.end_byte = out.size_bytes();
  form.said = SaidForm::of(errors);
  return form;
}

/// SQLite reads a database without the changes that wait in a log beside it, where it may not write.
void refuse_waiting_changes(const core::Path& file) {
  const std::string log = gdal_path(file) + "-wal";
  VSIStatBufL status;
  if (VSIStatL(log.c_str(), &status) == 0 && status.st_size > 0)
    core::fail(
        core::ErrorKind::Input,
        "{}: changes wait in {}-wal that are not yet written into it; close the program that "
        "has it open, or have it written (sqlite3 FILE \"PRAGMA wal_checkpoint(TRUNCATE)\")",
        file.written, file.written);
}

}  // namespace

std::vector<std::byte> read_features_request(const core::Json& request) {
  const core::Path file = file_of_request(request);
  register_all_gdal();
  FeatureForm form;
  FeatureFile out(file);
  const GdalErrors errors;
  const GdalDatasetPtr dataset = open_vectors_here(file, errors);
  refuse_waiting_changes(file);
  form.said = SaidForm::of(errors);
  form.format = dataset->GetDriver() == nullptr ? "" : dataset->GetDriver()->GetDescription();
  form.description = dataset->GetDescription();
  for (int i = 0; i < dataset->GetLayerCount(); ++i)
    form.layers.push_back(read_layer(*dataset->GetLayer(i), out));
  out.flush();
  form.files = files_of(*dataset, file);
  return encode_form(form);
}

}  // namespace terracast::tiler
