#include <cpl_string.h>
#include <gdal_priv.h>

#include <algorithm>
#include <new>
#include <span>

#include "core/bytes_text.h"
#include "core/error.h"
#include "core/reading_apart.h"
#include "tiler/apart/apart_readers.h"
#include "tiler/apart/form_io.h"
#include "tiler/apart/raster_form.h"
#include "tiler/gdal_formats.h"
#include "tiler/gdal_support.h"

namespace terracast::tiler {
namespace {

std::vector<MetadataForm> metadata_of(GDALMajorObject& object) {
  // GDAL makes these of the description itself.
  constexpr std::string_view kDerived = "DERIVED_SUBDATASETS";
  std::vector<MetadataForm> all;
  const CPLStringList domains(object.GetMetadataDomainList(), TRUE);
  std::vector<std::string> names = {""};
  for (int i = 0; i < domains.Count(); ++i)
    if (*domains[i] != '\0' && domains[i] != kDerived) names.emplace_back(domains[i]);
  for (const std::string& name : names) {
    char** items = object.GetMetadata(name.c_str());
    MetadataForm form{.domain = name, .items = {}};
    for (int i = 0; items != nullptr && items[i] != nullptr; ++i) form.items.emplace_back(items[i]);
    if (!form.items.empty()) all.push_back(std::move(form));
  }
  return all;
}

template <class Value, class Get>
std::optional<Value> if_declared(const Get& get) {
  int is_declared = FALSE;
  const Value value = get(&is_declared);
  return is_declared != FALSE ? std::optional(value) : std::nullopt;
}

void take_colours(GDALRasterBand& band, BandForm& form) {
  const GDALColorTable* table = band.GetColorTable();
  if (table == nullptr) return;
  form.palette = table->GetPaletteInterpretation();
  for (int i = 0; i < table->GetColorEntryCount(); ++i) {
    const GDALColorEntry& entry = *table->GetColorEntry(i);
    form.colours.push_back({{entry.c1, entry.c2, entry.c3, entry.c4}});
  }
}

BandForm band_form(GDALRasterBand& band) {
  BandForm form;
  form.description = band.GetDescription();
  if (band.GetUnitType() != nullptr) form.unit = band.GetUnitType();
  form.no_data = if_declared<double>([&](int* is) { return band.GetNoDataValue(is); });
  if (band.GetRasterDataType() == GDT_Int64)
    form.signed_no_data =
        if_declared<std::int64_t>([&](int* is) { return band.GetNoDataValueAsInt64(is); });
  if (band.GetRasterDataType() == GDT_UInt64)
    form.unsigned_no_data =
        if_declared<std::uint64_t>([&](int* is) { return band.GetNoDataValueAsUInt64(is); });
  form.scale = if_declared<double>([&](int* is) { return band.GetScale(is); });
  form.offset = if_declared<double>([&](int* is) { return band.GetOffset(is); });
  form.interpretation = band.GetColorInterpretation();
  take_colours(band, form);
  if (char** names = band.GetCategoryNames()) {
    form.categories.emplace();
    for (; *names != nullptr; ++names) form.categories->emplace_back(*names);
  }
  form.has_attribute_table = band.GetDefaultRAT() != nullptr;
  form.num_overviews = band.GetOverviewCount();
  form.mask_flags = band.GetMaskFlags();
  form.metadata = metadata_of(band);
  return form;
}

PlaneForm plane_form(GDALRasterBand& band) {
  PlaneForm plane;
  plane.type = band.GetRasterDataType();
  band.GetBlockSize(&plane.block_width, &plane.block_height);
  return plane;
}

/// A raster's form, and the bands behind its planes.
class RasterReading {
 public:
  /// opening   holds what GDAL says on the way
  RasterReading(GDALDataset& dataset, const core::Path& file, const GdalErrors& opening)
      : file_(file), opening_(opening) {
    form_.format = dataset.GetDriver() == nullptr ? "" : dataset.GetDriver()->GetDescription();
    form_.description = dataset.GetDescription();
    form_.files = files_of(dataset, file);
    form_.width = dataset.GetRasterXSize();
    form_.height = dataset.GetRasterYSize();
    PlacesForm places;
    if (dataset.GetGeoTransform(places.geotransform.data()) == CE_None) form_.places = places;
    form_.crs = CrsForm::of(dataset.GetSpatialRef());
    form_.num_control_points = dataset.GetGCPCount();
    form_.metadata = metadata_of(dataset);
    if (dataset.GetRasterCount() == 0)
      core::fail(core::ErrorKind::Input, "{}: has no bands; name the raster in it that is meant",
                 file.written);
    for (int number = 1; number <= dataset.GetRasterCount(); ++number) {
      GDALRasterBand& band = *dataset.GetRasterBand(number);
      form_.bands.push_back(band_form(band));
      take_plane(band);
    }
    for (std::size_t i = 0; i < form_.bands.size(); ++i)
      take_mask(*dataset.GetRasterBand(static_cast<int>(i) + 1), i);
    check_size();
  }

  void write_samples() {
    if (form_.has_blocks_alike()) return write(0, bands_.size());
    for (std::size_t plane = 0; plane < bands_.size(); ++plane) write(plane, plane + 1);
  }

  RasterForm& form() { return form_; }

 private:
  void take_plane(GDALRasterBand& band) {
    form_.planes.push_back(plane_form(band));
    bands_.push_back(&band);
  }

  void take_mask(GDALRasterBand& band, std::size_t index) {
    BandForm& form = form_.bands[index];
    if ((form.mask_flags & (GMF_ALL_VALID | GMF_NODATA | GMF_ALPHA)) != 0) return;
    GDALRasterBand* mask = band.GetMaskBand();
    const auto known = std::find(bands_.begin() + static_cast<std::ptrdiff_t>(form_.bands.size()),
                                 bands_.end(), mask);
    form.mask_plane = static_cast<std::int32_t>(known - bands_.begin());
    if (known == bands_.end()) take_plane(*mask);
  }

  void check_size() const {
    if (form_.samples_bytes() > static_cast<double>(kMostSamplesBytes))
      core::fail(core::ErrorKind::Input,
                 "{}: its samples take {}, and of a file in the format {} up to {} are unpacked; "
                 "turn it into a GeoTIFF, of which only what is needed is read (gdal_translate)",
                 file_.written, core::bytes_text(form_.samples_bytes()), form_.format,
                 core::bytes_text(static_cast<double>(kMostSamplesBytes)));
  }

  /// Planes from one to before another, whose blocks are alike.
  void write(std::size_t first, std::size_t end) {
    const std::int64_t across = form_.blocks_across(form_.planes[first]);
    const std::int64_t num_blocks = across * form_.blocks_down(form_.planes[first]);
    std::vector<std::byte> samples;
    for (std::int64_t block = 0; block < num_blocks; ++block)
      for (std::size_t plane = first; plane < end; ++plane) {
        samples.assign(form_.planes[plane].block_bytes(), std::byte{0});
        const GdalErrors errors;
        if (!read_block(*bands_[plane], block % across, block / across, samples))
          note_unread(form_.planes[plane], block, errors);
        core::append_to_file(samples, file_.written);
      }
  }

  static bool read_block(GDALRasterBand& band, std::int64_t column, std::int64_t row,
                         std::span<std::byte> samples) {
    GDALRasterBlock* block =
        band.GetLockedBlockRef(static_cast<int>(column), static_cast<int>(row));
    if (block == nullptr) return false;
    std::copy_n(static_cast<const std::byte*>(block->GetDataRef()), samples.size(),
                samples.begin());
    block->DropLock();
    return true;
  }

  void note_unread(PlaneForm& plane, std::int64_t block, const GdalErrors& errors) const {
    if (errors.has_lacked_memory()) throw std::bad_alloc();
    if (!plane.unread.empty() && plane.unread.back().first + plane.unread.back().count == block) {
      ++plane.unread.back().count;
      return;
    }
    // GDAL says only once why it cannot open what a file names.
    const std::string before = opening_.has_failure() ? opening_.said() + "; " : "";
    plane.unread.push_back({.first = block, .count = 1, .why = before + errors.said()});
  }

  const core::Path& file_;
  const GdalErrors& opening_;
  RasterForm form_;
  std::vector<GDALRasterBand*> bands_;
};

}  // namespace

core::Json apart_request(const core::Path& file) {
  return core::Json::object()
      .set("written", core::path_for_request(file.written))
      .set("resolved", core::path_for_request(file.resolved));
}

core::Path file_of_request(const core::Json& request) {
  return {.written = core::path_of_request(request.at("written").string()).string(),
          .resolved = core::path_of_request(request.at("resolved").string())};
}

std::vector<std::byte> read_raster_request(const core::Json& request) {
  const core::Path file = file_of_request(request);
  register_all_gdal();
  constexpr GIntBig kMostCached_bytes = GIntBig{512} << 20;  // by default a share of the machine
  GDALSetCacheMax64(kMostCached_bytes);
  const GdalErrors errors;
  const GdalDatasetPtr dataset = open_raster_here(file, errors);
  RasterReading reading(*dataset, file, errors);
  reading.form().said = SaidForm::of(errors);
  reading.write_samples();
  return encode_form(reading.form());
}

}  // namespace terracast::tiler
