#include "tiler/apart/given_features.h"

#include <ogrsf_frmts.h>

#include <algorithm>
#include <exception>

#include "core/error.h"
#include "tiler/apart/apart_readers.h"
#include "tiler/apart/form_io.h"
#include "tiler/apart/given_dataset.h"

namespace terracast::tiler {
namespace {

class GivenLayer final : public OGRLayer {
 public:
  GivenLayer(std::shared_ptr<const KeptFeatures> kept, std::size_t index)
      : kept_(std::move(kept)), form_(kept_->form.layers[index]), at_byte_(form_.first_byte) {
    fields_ = new OGRFeatureDefn(form_.name.c_str());
    fields_->Reference();
    SetDescription(form_.name.c_str());
    fields_->SetGeomType(static_cast<OGRwkbGeometryType>(form_.geometry));
    for (const FieldForm& field : form_.fields) {
      OGRFieldDefn defn(field.name.c_str(), field.type);
      defn.SetSubType(field.subtype);
      defn.SetWidth(field.width);
      defn.SetPrecision(field.precision);
      fields_->AddFieldDefn(&defn);
    }
    if (!form_.crs || fields_->GetGeomFieldCount() == 0) return;
    auto* crs = new OGRSpatialReference(form_.crs->make());
    fields_->GetGeomFieldDefn(0)->SetSpatialRef(crs);
    crs->Release();
  }
  ~GivenLayer() override { fields_->Release(); }
  GivenLayer(const GivenLayer&) = delete;
  GivenLayer& operator=(const GivenLayer&) = delete;

  OGRFeatureDefn* GetLayerDefn() override { return fields_; }
  GIntBig GetFeatureCount(int) override { return form_.num_stated; }
  int TestCapability(const char* name) override { return EQUAL(name, OLCFastFeatureCount); }
  void ResetReading() override {
    at_byte_ = form_.first_byte;
    num_read_ = 0;
  }
  OGRFeature* GetNextFeature() override {
    if (num_read_ < form_.num_given) {
      ++num_read_;
      return next();
    }
    if (num_read_++ == form_.num_given) form_.said.say();
    return nullptr;
  }

 private:
  OGRFeature* next() {
    const std::string& file = kept_->form.description;
    std::uint64_t size = 0;
    take(std::as_writable_bytes(std::span(&size, 1)));
    if (size > kMostFeatureBytes) refuse(file);
    feature_.resize(size);
    take(feature_);
    return decode_feature(feature_, fields_, file).release();
  }

  /// What stands next in the file.
  void take(std::span<std::byte> out) {
    if (out.size() > form_.end_byte - at_byte_) refuse(kept_->form.description);
    while (!out.empty()) {
      if (at_byte_ < piece_at_ || at_byte_ >= piece_at_ + piece_.size()) read_piece();
      const std::size_t from = at_byte_ - piece_at_;
      const std::size_t count = std::min(out.size(), piece_.size() - from);
      std::copy_n(piece_.begin() + static_cast<std::ptrdiff_t>(from), count, out.begin());
      out = out.subspan(count);
      at_byte_ += count;
    }
  }

  void read_piece() {
    constexpr std::uint64_t kPiece_bytes = 1 << 20;
    piece_at_ = at_byte_;
    piece_.resize(std::min(kPiece_bytes, form_.end_byte - at_byte_));
    kept_->features.read(piece_at_, piece_);
  }

  [[noreturn]] static void refuse(const std::string& file) {
    core::fail(core::ErrorKind::Input,
               "{}: damaged: a feature goes on behind the end of its layer; {}", file, kFormWayOut);
  }

  std::shared_ptr<const KeptFeatures> kept_;
  const LayerForm& form_;
  OGRFeatureDefn* fields_ = nullptr;
  std::uint64_t at_byte_;
  std::int64_t num_read_ = 0;
  std::vector<std::byte> feature_;
  std::uint64_t piece_at_ = 0;
  std::vector<std::byte> piece_;
};

class GivenFeatures final : public GivenDataset {
 public:
  explicit GivenFeatures(const std::shared_ptr<const KeptFeatures>& kept)
      : GivenDataset(kept->form.format, kept->form.files) {
    SetDescription(kept->form.description.c_str());
    for (std::size_t i = 0; i < kept->form.layers.size(); ++i)
      layers_.push_back(std::make_unique<GivenLayer>(kept, i));
  }

  int GetLayerCount() override { return static_cast<int>(layers_.size()); }
  OGRLayer* GetLayer(int index) override {
    return index >= 0 && index < GetLayerCount() ? layers_[static_cast<std::size_t>(index)].get()
                                                 : nullptr;
  }

 private:
  std::vector<std::unique_ptr<GivenLayer>> layers_;
};

}  // namespace

GdalDatasetPtr dataset_of(std::shared_ptr<const KeptFeatures> features) {
  features->form.said.say();
  return GdalDatasetPtr(new GivenFeatures(features));
}

std::shared_ptr<const KeptFeatures> read_features_apart(const core::Path& file,
                                                        core::ApartOptions options) {
  const auto kept = std::make_shared<KeptFeatures>();
  options.file = &kept->features;
  kept->form = decode_form<FeatureForm>(
      core::read_apart("features", apart_request(file), file.written, options), file.written);
  check_feature_form(kept->form, kept->features.size_bytes(), file.written);
  return kept;
}

GdalDatasetPtr given_features(const core::Path& file) {
  static KeptForms<KeptFeatures> kept;
  return dataset_of(kept.get(file, [&] {
    return read_features_apart(
        file, {.limits = limits_of_apart(kMostFeaturesBytes), .most_result_bytes = kMostFormBytes});
  }));
}

}  // namespace terracast::tiler
