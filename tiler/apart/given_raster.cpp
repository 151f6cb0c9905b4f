#include "tiler/apart/given_raster.h"

#include <cpl_string.h>
#include <gdal_rat.h>

#include <algorithm>
#include <exception>

#include "core/error.h"
#include "tiler/apart/apart_readers.h"
#include "tiler/apart/form_io.h"
#include "tiler/apart/given_dataset.h"

namespace terracast::tiler {
namespace {

void set_metadata(GDALMajorObject& object, const std::vector<MetadataForm>& metadata) {
  for (const MetadataForm& form : metadata) {
    CPLStringList items;
    for (const std::string& item : form.items) items.AddString(item.c_str());
    object.SetMetadata(items.List(), form.domain.c_str());
  }
}

template <class Value>
Value if_declared(const std::optional<Value>& value, Value otherwise, int* is_declared) {
  if (is_declared != nullptr) *is_declared = value ? TRUE : FALSE;
  return value.value_or(otherwise);
}

/// A plane of samples: those of a band, or a mask.
class GivenPlane : public GDALRasterBand {
 public:
  GivenPlane(GDALDataset* dataset, std::shared_ptr<const KeptRaster> raster, std::size_t plane)
      : raster_(std::move(raster)), plane_(plane) {
    poDS = dataset;
    nRasterXSize = raster_->form.width;
    nRasterYSize = raster_->form.height;
    eDataType = form().type;
    nBlockXSize = form().block_width;
    nBlockYSize = form().block_height;
  }

  CPLErr IReadBlock(int column, int row, void* samples) override {
    const std::int64_t block = raster_->form.blocks_across(form()) * row + column;
    for (const PlaneForm::Unread& run : form().unread)
      if (block >= run.first && block - run.first < run.count)
        return refuse(run.why.empty() ? "GDAL gives no reason" : run.why.c_str());
    try {
      raster_->samples.read(raster_->form.place_of(plane_, block),
                            {static_cast<std::byte*>(samples), form().block_bytes()});
    } catch (const std::exception& error) {  // none gets through GDAL
      return refuse(error.what());
    }
    return CE_None;
  }

 protected:
  const KeptRaster& raster() const { return *raster_; }

 private:
  const PlaneForm& form() const { return raster_->form.planes[plane_]; }
  static CPLErr refuse(const char* why) {
    CPLError(CE_Failure, CPLE_FileIO, "%s", why);
    return CE_Failure;
  }

  std::shared_ptr<const KeptRaster> raster_;
  std::size_t plane_;
};

class GivenBand final : public GivenPlane {
 public:
  GivenBand(GDALDataset* dataset, const std::shared_ptr<const KeptRaster>& raster,
            std::size_t index)
      : GivenPlane(dataset, raster, index), form_(raster->form.bands[index]) {
    SetDescription(form_.description.c_str());
    set_metadata(*this, form_.metadata);
    for (const std::string& name : form_.categories.value_or(std::vector<std::string>()))
      categories_.AddString(name.c_str());
    if (form_.palette) colours_ = std::make_unique<GDALColorTable>(*form_.palette);
    for (std::size_t i = 0; i < form_.colours.size(); ++i) {
      const auto& [c1, c2, c3, c4] = form_.colours[i].channels;
      const GDALColorEntry entry{c1, c2, c3, c4};
      colours_->SetColorEntry(static_cast<int>(i), &entry);
    }
    if (form_.mask_plane >= 0)
      mask_ =
          std::make_unique<GivenPlane>(dataset, raster, static_cast<std::size_t>(form_.mask_plane));
  }

  double GetNoDataValue(int* is_declared) override {
    return if_declared(form_.no_data, kNoDataOtherwise, is_declared);
  }
  std::int64_t GetNoDataValueAsInt64(int* is_declared) override {
    return if_declared(form_.signed_no_data, std::int64_t{0}, is_declared);
  }
  std::uint64_t GetNoDataValueAsUInt64(int* is_declared) override {
    return if_declared(form_.unsigned_no_data, std::uint64_t{0}, is_declared);
  }
  double GetScale(int* is_declared) override { return if_declared(form_.scale, 1.0, is_declared); }
  double GetOffset(int* is_declared) override {
    return if_declared(form_.offset, 0.0, is_declared);
  }
  const char* GetUnitType() override { return form_.unit.c_str(); }
  GDALColorInterp GetColorInterpretation() override { return form_.interpretation; }
  GDALColorTable* GetColorTable() override { return colours_.get(); }
  char** GetCategoryNames() override { return form_.categories ? names() : nullptr; }
  GDALRasterAttributeTable* GetDefaultRAT() override {
    return form_.has_attribute_table ? &attributes_ : nullptr;
  }
  int GetOverviewCount() override { return form_.num_overviews; }
  GDALRasterBand* GetOverview(int) override { return nullptr; }
  int GetMaskFlags() override { return form_.mask_flags; }
  GDALRasterBand* GetMaskBand() override {
    return mask_ ? mask_.get() : GDALRasterBand::GetMaskBand();
  }

 private:
  static constexpr double kNoDataOtherwise = -1e10;  // GDAL's own

  char** names() {
    static char* none[] = {nullptr};
    return categories_.Count() > 0 ? categories_.List() : none;
  }

  const BandForm& form_;
  CPLStringList categories_;
  std::unique_ptr<GDALColorTable> colours_;
  GDALDefaultRasterAttributeTable attributes_;
  std::unique_ptr<GivenPlane> mask_;
};

class GivenRaster final : public GivenDataset {
 public:
  explicit GivenRaster(const std::shared_ptr<const KeptRaster>& raster)
      : GivenDataset(raster->form.format, raster->form.files), raster_(raster) {
    const RasterForm& form = raster->form;
    SetDescription(form.description.c_str());
    nRasterXSize = form.width;
    nRasterYSize = form.height;
    set_metadata(*this, form.metadata);
    if (form.crs) crs_ = form.crs->make();
    for (std::size_t i = 0; i < form.bands.size(); ++i)
      SetBand(static_cast<int>(i) + 1, new GivenBand(this, raster, i));
  }

  CPLErr GetGeoTransform(double* geotransform) override {
    if (!raster_->form.places) return CE_Failure;
    const auto& stated = raster_->form.places->geotransform;
    std::copy(stated.begin(), stated.end(), geotransform);
    return CE_None;
  }
  const OGRSpatialReference* GetSpatialRef() const override { return crs_ ? &*crs_ : nullptr; }
  int GetGCPCount() override { return raster_->form.num_control_points; }

 private:
  std::shared_ptr<const KeptRaster> raster_;
  std::optional<OGRSpatialReference> crs_;
};

}  // namespace

GdalDatasetPtr dataset_of(std::shared_ptr<const KeptRaster> raster) {
  raster->form.said.say();
  return GdalDatasetPtr(new GivenRaster(raster));
}

std::shared_ptr<const KeptRaster> read_raster_apart(const core::Path& file,
                                                    core::ApartOptions options) {
  const auto raster = std::make_shared<KeptRaster>();
  options.file = &raster->samples;
  raster->form = decode_form<RasterForm>(
      core::read_apart("raster", apart_request(file), file.written, options), file.written);
  check_raster_form(raster->form, raster->samples.size_bytes(), file.written);
  return raster;
}

GdalDatasetPtr given_raster(const core::Path& file) {
  static KeptForms<KeptRaster> kept;
  return dataset_of(kept.get(file, [&] {
    return read_raster_apart(
        file, {.limits = limits_of_apart(kMostSamplesBytes), .most_result_bytes = kMostFormBytes});
  }));
}

}  // namespace terracast::tiler
